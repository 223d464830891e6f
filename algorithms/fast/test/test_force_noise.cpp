// Forces that cancel: what rounding of them does to accelerations is told, and on robots as they are
// made nothing is suspected. Truth is multi-precision.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "algorithms/fast/engine/instances.hpp"
#include "algorithms/fast/factors/diagonal.hpp"
#include "algorithms/fast/factors/solve.hpp"
#include "algorithms/fast/test/mechanisms_that_lose.hpp"
#include "algorithms/fast/test/support.hpp"
#include "algorithms/model/plain.hpp"

namespace kalmarm::test {
namespace {

template <class T>
class ForceNoiseOf : public testing::Test {
 protected:
  // An acceleration by a sweep that suspects no D: its error is below the root of the left side of (8) with
  // c = 1 and what an error of D adds to it by (9), with T of the state; a tenth of it with T of all states;
  // and at most half the root of the left side of (8), which is 2.8 u where there is one joint.
  void expect_bound(const Model<double>& drawn, int seed) {
    const State<T> state = random_state(drawn, seed).template cast<T>();
    const LoweredModel<T> model(drawn.cast<T>());
    CovarianceWorkspace<T> ws(model);
    VectorX<T> a = poisoned<T>(model.nv());
    covariance_acceleration(model, state.q.data(), state.qd.data(), state.tau.data(), ws, a.data());
    if (!(ws.margin > T(0))) return;
    const double u = unit_roundoff<T>(), size = a.template cast<double>().norm();
    double weight = 0;
    for (int k = 0; k < model.nv(); ++k)
      weight += drawn.gravity().squaredNorm() * drawn.joint(k).body.mass;
    const double of_D = RoundingBound<T>(model).look(model, state.q.data()).bound;
    const double of_energy = u * u * ws.energy + of_D * of_D * (ws.energy + weight);
    const double error = Truth(rounded<T>(drawn), state.template cast<double>()).relative(a) * size;
    ForceNoise<T> noise(model);
    const double all = noise.largest_variance(), here = noise.trace(model, ws);
    const double unit = u * u / model.rounding_unit();
    EXPECT_FALSE(10 * error > std::sqrt(all * (unit * ws.noise + of_energy)));
    EXPECT_FALSE(error > std::sqrt(here * (unit * ws.noise + of_energy)));
    const double c = rounding_constant;
    const double of_sums = c * c * (unit * ws.noise + u * u * ws.energy);
    EXPECT_FALSE(2 * error > std::sqrt(all * (of_sums + of_D * of_D * (ws.energy + weight))));
    ++looked_at_;
  }

  // Through the door: what is answered without a word is right to the tolerance beside |a|, or a
  // hundredth of gravity.
  void expect_no_silent_error(const Model<double>& drawn, const State<double>& given) {
    const State<T> state = given.template cast<T>();
    Dynamics<T> robot = dynamics_of<T>(drawn, spatial({Want::acceleration}));
    VectorX<T> a = poisoned<T>(drawn.nv());
    const Outcome out = robot.forward_dynamics(state.q, state.qd, state.tau, a);
    told_ += !out || out.warns();
    again_ += out && out.rung > Outcome::Rung::float64;
    ++looked_at_;
    if (!out || out.warns()) return;
    const double error =
        Truth(rounded<T>(drawn), state.template cast<double>()).relative(a) * a.norm();
    EXPECT_LE(error,
              default_tolerance<T> * std::max<double>(a.norm(), 0.01 * drawn.gravity().norm()));
  }

  // S of (11) is at least what (7) says of any column of M^-1, which solving for it shows; of its second
  // sum the number for all states is at least that of this one.
  void expect_bound_of_columns(const Model<double>& drawn, int seed) {
    const VectorX<T> q = random_state(drawn, seed).q.template cast<T>();
    const LoweredModel<T> model(drawn.cast<T>());
    FastFactors<T> factors(model);
    covariance_factor(model, q.data(), factors);
    if (!(factors.margin > T(0))) return;
    const int nv = model.nv();
    VectorX<T> diagonal(nv), x(nv);
    InverseDiagonal<T>(model, InverseDiagonal<T>::Terms::positive)
        .fill(model, factors, diagonal.data());
    double first = 0;
    for (int k = 0; k < nv; ++k) first += diagonal[k] / factors.links[k].inverse_D;
    const double S =
        ForceNoise<T>(model).energy_of_columns(model, factors, [&](int k) { return diagonal[k]; });
    constexpr double more = 1.02;  // a D is let pass where it is right to 1 %
    EXPECT_GE(S * more, first);
    EXPECT_LE(S, more * (first + double(model.terms_of_columns())));
    FactorSolver<T> solver(model);
    for (int j = 0; j < nv; ++j) {
      const VectorX<T> tau = VectorX<T>::Unit(nv, j);
      const double E = solver.solve(model, factors, 1, nv, tau.data(), x.data()).energy[0];
      EXPECT_LE(E, more * S * diagonal[j]) << j;
    }
    ++looked_at_;
  }

  int looked_at_ = 0, told_ = 0, again_ = 0;
};

// T of least_inertia.hpp is above every eigenvalue of M^-1.
void expect_largest_variance(const Model<double>& drawn) {
  const LoweredModel<double> model(drawn);
  const int nv = model.nv();
  State<double> state = random_state(drawn, 2);
  MatrixX<double> X(nv, nv);
  for (int j = 0; j < nv; ++j) {
    state.tau = VectorX<double>::Unit(nv, j);
    X.col(j) = Truth(drawn, state).solution();
  }
  const double largest = X.selfadjointView<Eigen::Lower>().eigenvalues().maxCoeff();
  EXPECT_LE(largest, model.largest_variance() * (1 + 1e-9));
  for (int k = 0; k < nv; ++k) EXPECT_LE(X(k, k) * model.least_inertias()[k], 1 + 1e-9) << k;
}

TEST(LargestVariance, IsAboveTheEigenvaluesOfTheInverse) {
  for (const Family& family : all_families()) {
    SCOPED_TRACE(family.name);
    expect_largest_variance(family.make(1));
  }
  for (int seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    expect_largest_variance(wild(seed));
  }
}

TEST(LargestVariance, IsThatOfAFewJointsHoweverManyThereAre) {
  const auto of = [](int n) { return LoweredModel<double>(chain(1, n)).largest_variance(); };
  EXPECT_LE(of(400), 4 * of(40));
  const LoweredModel<double> long_chain(chain(1, 400));
  double sum = 0;
  for (const double mu : long_chain.least_inertias()) sum += 1 / mu;
  EXPECT_LE(long_chain.largest_variance(), sum / 20);
}

// M(k,k) over what it can be at most, of joints from which no slide lets anything go far: the largest.
double most_of_largest_inertias(const Model<double>& drawn, const State<double>& state) {
  const LoweredModel<double> model(drawn);
  const int nv = model.nv();
  Dynamics<double> robot = dynamics_of<double>(drawn, spatial({Want::mass}));
  MatrixX<double> M(nv, nv);
  robot.mass(state.q, M);
  double most = 0;
  for (int k = 0; k < nv; ++k) {
    const double largest = model.largest_inertias()[k];
    if (largest > model.body(k).r) most = std::max(most, M(k, k) / largest);
  }
  return most;
}

TEST(LargestInertias, AreAboveTheDiagonalOfM) {
  for (const Family& family : all_families()) {
    SCOPED_TRACE(family.name);
    for (int seed = 0; seed < 5; ++seed) {
      const Model<double> model = family.make(seed);
      EXPECT_LE(most_of_largest_inertias(model, random_state(model, seed)), 1 + 1e-9);
    }
  }
  for (int seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    EXPECT_LE(most_of_largest_inertias(wild(seed), random_state(wild(seed), seed)), 1 + 1e-9);
  }
}

TEST(LargestInertias, AreReachedByAChainThatIsStretchedOut) {
  const Model<double> model = straight_chain(31);
  State<double> state = random_state(model, 1);
  state.q.setZero();
  EXPECT_GE(most_of_largest_inertias(model, state), 0.9);
}

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(ForceNoiseOf, Precisions, PrecisionName);

TYPED_TEST(ForceNoiseOf, ErrorsOfAllFamiliesAreBelowIt) {
  for (const Family& family : all_families())
    for (int seed = 0; seed < 5; ++seed) {
      SCOPED_TRACE(std::string(family.name) + " seed " + std::to_string(seed));
      this->expect_bound(family.make(seed), seed);
    }
  EXPECT_GE(this->looked_at_, 90);
}

TYPED_TEST(ForceNoiseOf, ErrorsOfWildMechanismsAreBelowIt) {
  for (int seed = 0; seed < 400; ++seed) {
    SCOPED_TRACE(seed);
    this->expect_bound(wild(seed), seed);
  }
  EXPECT_GE(this->looked_at_, 50);
}

TYPED_TEST(ForceNoiseOf, ColumnsOfAllFamiliesAndOfWildMechanismsAreBelowTheirs) {
  for (int seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE("wild " + std::to_string(seed));
    this->expect_bound_of_columns(wild(seed), seed);
  }
  for (const Family& family : all_families()) {
    SCOPED_TRACE(family.name);
    this->expect_bound_of_columns(family.make(0), 0);
  }
  EXPECT_GE(this->looked_at_, 40);
}

TYPED_TEST(ForceNoiseOf, NothingIsAnsweredWrongInSilence) {
  for (int seed = 0; seed < 400; ++seed) {
    SCOPED_TRACE(seed);
    this->expect_no_silent_error(wild(seed), random_state(wild(seed), seed));
  }
  EXPECT_LE(this->told_, 2) << "of " << this->looked_at_;
}

// Every D is right, and forces cancel beside a ball that weighs nothing, between a heavy base and a
// load that is far off: without the tests (8) and (9), float64 loses every digit in silence.
TYPED_TEST(ForceNoiseOf, ForcesThatPassThroughALightBallAreNeverAnsweredWrongInSilence) {
  for (int seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    const auto joint = [&](int parent, const RigidBody<double>& body) {
      Joint<double> made = random_joint(random, parent);
      made.body = body;
      made.r = 0;
      return made;
    };
    Builder builder;
    const int base = builder.add(joint(-1, point_mass(1e5, {0.001, 0, 0})));
    RigidBody<double> light = point_mass(1e-8, {0, 0, 0});
    light.moments = {1e-16, 1e-16, 1e-16};
    Joint<double> load =
        joint(builder.add_ball(joint(base, light)), point_mass(1500, {0, 0, -700}));
    load.rotation = {1, 0, 0, 0};
    load.translation = {0, 0, 0.35};
    load.r = 8;
    builder.add(load);
    const Model<double> drawn = builder.build();
    State<double> state = random_state(drawn, seed);
    state.tau.setZero();
    this->expect_no_silent_error(drawn, state);
  }
}

TYPED_TEST(ForceNoiseOf, OrdinaryRobotsAreNotSuspected) {
  for (const Family& family : all_families()) {
    if (std::string(family.name).find("massless") != std::string::npos) continue;
    for (int seed = 0; seed < 5; ++seed) {
      const Model<double> drawn = family.make(seed);
      this->expect_no_silent_error(drawn, random_state(drawn, seed));
    }
  }
  EXPECT_EQ(this->told_, 0);
  EXPECT_LE(this->again_, this->looked_at_ / 10);
}

}  // namespace
}  // namespace kalmarm::test
