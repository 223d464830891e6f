// The certified form against truth in multi-precision: how wrong it is, and whether it knows.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "algorithms/fast/test/mechanisms_that_lose.hpp"
#include "algorithms/fast/test/support.hpp"
#include "algorithms/test/singular.hpp"

namespace kalmarm::test {
namespace {

template <class T>
class Certified : public testing::Test {
 protected:
  static constexpr double u = std::is_same_v<T, float> ? 0x1p-24 : 0x1p-53;

  static Dynamics<T> robot(const Model<double>& model, std::set<Want> want) {
    return dynamics_of<T>(model, spatial(std::move(want), Tolerance(last_bits)));
  }
};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Certified, Precisions, PrecisionName);

// Of 12 hinges, with the tip `ratio` times as heavy.
Model<double> heavy_tip(std::uint64_t seed, double ratio) {
  const Model<double> even = chain(seed, 12);
  std::vector<Joint<double>> joints;
  for (int k = 0; k < even.nv(); ++k) joints.push_back(even.joint(k));
  joints.back().body.mass *= ratio;
  if (seed % 2 == 0) joints.back().body.moments *= ratio;
  return {std::move(joints), even.names(), even.nq(), even.gravity()};
}

// Right to the last bits, and says how wrong it is.
TYPED_TEST(Certified, AccelerationIsRightToTheLastBits) {
  using T = TypeParam;
  int close = 0, all = 0;
  for (const Family& family : all_families()) {
    SCOPED_TRACE(family.name);
    for (int seed = 0; seed < 5; ++seed) {
      const Model<double> model = rounded<T>(family.make(seed));
      const State<T> state = random_state(model, seed + 1000).template cast<T>();
      Dynamics<T> dynamics = this->robot(model, {Want::acceleration});
      VectorX<T> a = poisoned<T>(model.nv());
      const Outcome out = dynamics.forward_dynamics(state.q, state.qd, state.tau, a);
      ASSERT_TRUE(out);
      const double error = Truth(model, state.template cast<double>()).relative(a);
      EXPECT_LE(error, this->u);
      EXPECT_LE(error, 3 * out.error + 0.01 * this->u);
      ++all;
      close += error >= out.error / 3;
    }
  }
  EXPECT_GE(close, 0.95 * all);
}

// However heavy the tip: right, or it says how wrong. Pairs see errors down to some hundred u^2
// times the mass ratio, which at 1e16 in float64 is as many u.
TYPED_TEST(Certified, HeavyTipsAreAnsweredRightOrWithTheirError) {
  using T = TypeParam;
  int settled = 0, all = 0;
  for (const double ratio : {1e2, 1e4, 1e6, 1e8, 1e10, 1e12, 1e14, 1e16})
    for (int seed = 0; seed < 10; ++seed) {
      SCOPED_TRACE("ratio " + std::to_string(ratio) + " seed " + std::to_string(seed));
      const Model<double> model = rounded<T>(heavy_tip(seed, ratio));
      const State<T> state = random_state(model, seed).template cast<T>();
      Dynamics<T> dynamics = this->robot(model, {Want::acceleration});
      VectorX<T> a = poisoned<T>(model.nv());
      const Outcome out = dynamics.forward_dynamics(state.q, state.qd, state.tau, a);
      ASSERT_TRUE(out);
      const double error = Truth(model, state.template cast<double>()).relative(a);
      const double unseen = std::is_same_v<T, double> ? 0x1p-98 * ratio : 0;
      EXPECT_LE(error, 3 * out.error + 0.01 * this->u + unseen);
      ++all;
      settled += error <= 2 * this->u + unseen;
    }
  EXPECT_EQ(settled, all);
}

TYPED_TEST(Certified, RowsAreAnsweredAsStatesAre) {
  using T = TypeParam;
  for (const Family& family : all_families()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = rounded<T>(family.make(3));
    Dynamics<T> dynamics = this->robot(model, {Want::acceleration});
    Rows<T> rows(model, 37);
    EXPECT_EQ(rows.forward_dynamics(dynamics), 0);
    VectorX<T> a(model.nv());
    for (int i = 0; i < 37; ++i) {
      const State<T> state = random_state(model, i).template cast<T>();
      ASSERT_TRUE(dynamics.forward_dynamics(state.q, state.qd, state.tau, a));
      const Eigen::Map<const VectorX<T>> row(rows.a.data() + i * model.nv(), model.nv());
      EXPECT_LE((row - a).norm(), 2 * this->u * a.norm());
      EXPECT_LE(rows.outcomes[i].error, this->u);
    }
  }
}

TYPED_TEST(Certified, InverseIsAsRightAsItSays) {
  using T = TypeParam;
  for (const Family& family : all_families()) {
    SCOPED_TRACE(family.name);
    for (int seed = 0; seed < 5; ++seed) {
      const Model<double> model = rounded<T>(family.make(seed));
      const State<T> state = random_state(model, seed + 1000).template cast<T>();
      Dynamics<T> dynamics = this->robot(model, {Want::inverse});
      MatrixX<T> X = poisoned<T>(model.nv(), model.nv());
      const Outcome out = dynamics.inverse_mass(state.q, MatrixView<T>(X));
      ASSERT_TRUE(out);
      const double error = Truth(model, state.template cast<double>()).inverse(X);
      EXPECT_LE(error, 400 * this->u);
      EXPECT_LE(error, 10 * out.error + this->u);
    }
  }
}

TYPED_TEST(Certified, PartsOfTheInverseAndSolvesAreRight) {
  using T = TypeParam;
  for (const Family& family : all_families()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = rounded<T>(family.make(2));
    const int nv = model.nv();
    const State<T> state = random_state(model, 1002).template cast<T>();
    Dynamics<T> dynamics = this->robot(model, {Want::solve, Want::diagonal, Want::log_det});
    const Truth truth(model, state.template cast<double>());
    VectorX<T> x = poisoned<T>(nv);
    ASSERT_TRUE(dynamics.factor(state.q));
    const Outcome solved = dynamics.solve(state.tau, x);
    ASSERT_TRUE(solved);
    // In float the answer of float64, whose error is below 1e-12, is rounded: by u of every entry,
    // and so of Euclid's norm.
    EXPECT_LE(solved.error, (std::is_same_v<T, float> ? 1.01 : 1) * this->u);
    EXPECT_LE(truth.solution(x), 400 * this->u);  // in the norm of M: x is right to u in Euclid's
    ASSERT_TRUE(dynamics.diagonal(state.q, x));
    EXPECT_LE(truth.diagonal(x), 400 * this->u);
    T log_det = std::numeric_limits<T>::quiet_NaN();
    ASSERT_TRUE(dynamics.log_det(state.q, log_det));
    EXPECT_LE(truth.log_det(log_det), 40 * this->u * truth.log_det_size());
  }
}

// Errors of joints that hardly count in a norm of the whole matrix are seen as well.
TYPED_TEST(Certified, PartsOfTheInverseAreAsRightAsTheySayOnWildMechanisms) {
  using T = TypeParam;
  int answered = 0;
  const auto expect_as_said = [&](const char* what, const Outcome& out, auto&& error) {
    if (!out || out.warns()) return;
    ++answered;
    EXPECT_LE(error(), 4 * std::max(out.error, this->u)) << what;
  };
  for (int seed = 0; seed < 100; ++seed) {
    SCOPED_TRACE(seed);
    const Model<double> model = rounded<T>(wild(seed));
    const int nv = model.nv();
    const State<T> state = random_state(model, seed).template cast<T>();
    Dynamics<T> dynamics = this->robot(model, {Want::inverse, Want::diagonal, Want::log_det});
    MatrixX<T> X = poisoned<T>(nv, nv);
    VectorX<T> x = poisoned<T>(nv);
    T log_det = std::numeric_limits<T>::quiet_NaN();
    const Truth truth(model, state.template cast<double>());
    expect_as_said("M^-1", dynamics.inverse_mass(state.q, MatrixView<T>(X)),
                   [&] { return truth.inverse(X); });
    expect_as_said("diagonal", dynamics.diagonal(state.q, x), [&] { return truth.diagonal(x); });
    expect_as_said("log det", dynamics.log_det(state.q, log_det), [&] {
      return truth.log_det(log_det) / std::max(1.0, std::abs(double(log_det)));
    });
  }
  EXPECT_GE(answered, 200);
}

// At the joint, in one state and among others.
TYPED_TEST(Certified, SingularMechanismsAreRefusedAndRegularOnesAreNot) {
  using T = TypeParam;
  const auto outcome_of = [&](const Mechanism& mechanism) {
    Dynamics<T> dynamics = this->robot(mechanism.model, {Want::acceleration, Want::inverse});
    const int nv = mechanism.model.nv();
    VectorX<T> a = poisoned<T>(nv);
    MatrixX<T> X = poisoned<T>(nv, nv);
    const VectorX<T> ones = VectorX<T>::Ones(nv), q = mechanism.q.template cast<T>();
    EXPECT_EQ(static_cast<bool>(dynamics.inverse_mass(q, X)),
              static_cast<bool>(dynamics.forward_dynamics(q, ones, ones, a)));
    return dynamics.forward_dynamics(q, ones, ones, a);
  };
  for (int seed = 0; seed < 10; ++seed) {
    for (const Mechanism& mechanism : singular_mechanisms(seed)) {
      const Outcome outcome = outcome_of(mechanism);
      EXPECT_EQ(outcome.status, Outcome::Status::singular) << mechanism.name << " seed " << seed;
      EXPECT_TRUE(std::ranges::count(mechanism.joints, outcome.joint)) << mechanism.name;
      EXPECT_LE(std::abs(outcome.D), outcome.scale) << mechanism.name;
    }
    for (const Mechanism& mechanism : regular_mechanisms(seed))
      EXPECT_TRUE(outcome_of(mechanism)) << mechanism.name << " seed " << seed;
  }
}

// What every form answers about a state in all ways: an answer that is ok is as right as it says, or
// it warns and names a joint; one of the certified form says how wrong it is. Returns how many took
// the certified form's factors, or as that form, the last resort. last_resort: no others are judged.
template <class T>
int expect_no_silent_error(const Model<double>& model, const VectorX<double>& position,
                           Tolerance tolerance, bool last_resort = false) {
  const auto u = static_cast<double>(unit_roundoff<T>());
  const int nv = model.nv();
  State<T> state = random_state(model, 7).template cast<T>();
  state.q = position.template cast<T>();
  const Truth truth(model, state.template cast<double>());
  DynamicsOptions options = spatial({Want::inverse, Want::solve, Want::diagonal, Want::log_det,
                                     Want::operational, Want::operational_diagonal},
                                    tolerance);
  const Selection selection{{}, {{nv - 1}, {nv / 2}}};
  options.question.frames = selection.frames;
  Dynamics<T> robot = dynamics_of<T>(model, options);
  int suspects = 0;
  // most: what a right answer may lose that comes without an error.
  const auto judge = [&](const char* what, const Outcome& out, double error, double most) {
    const bool climbed = out.rung > (tolerance ? Outcome::Rung::refined : Outcome::Rung::float64);
    suspects += climbed;
    if (out && (climbed || tolerance)) {
      EXPECT_GE(out.error, 0) << what;
    }
    if (!out || out.warns()) {
      EXPECT_GE(out.joint, 0) << what;
    } else if (climbed || !last_resort) {
      EXPECT_LE(error, std::isnan(out.error) ? most : 10 * out.error + 8 * u) << what;
    }
  };
  MatrixX<T> X = poisoned<T>(nv, nv), J = poisoned<T>(12, 12);
  VectorX<T> x = poisoned<T>(nv);
  T log_det(0);
  Outcome out = robot.inverse_mass(state.q, X);
  judge("inverse", out, truth.inverse(X), 0.01);
  out = robot.diagonal(state.q, x);
  judge("diagonal", out, truth.diagonal(x), 0.01);
  out = robot.log_det(state.q, log_det);
  judge("log det", out, truth.log_det(log_det) / (nv * truth.log_det_size()), 0.01);
  out = robot.operational(state.q, J);
  judge("operational", out, truth.selected(selection, J), 0.01);
  VectorX<T> of_J = poisoned<T>(12);
  out = robot.operational_diagonal(state.q, of_J);
  J.diagonal() = of_J;  // so that its own entries are looked at
  judge("operational diagonal", out, truth.selected(selection, J), 0.01);
  if (robot.factor(state.q)) {
    out = robot.solve(state.tau, x);
    const VectorX<double> exact = truth.solution();
    judge("solve", out, (x.template cast<double>() - exact).norm() / exact.norm(), 0.01);
  }
  return suspects;
}

// Loads beyond what float64 carries: D of the links that bear them are lost in rounding.
TYPED_TEST(Certified, NoAnswerIsSilentlyWrongHoweverHeavyTheTip) {
  using T = TypeParam;
  int suspects = 0;
  for (const Tolerance tolerance : tolerances)
    for (const double ratio : {1e4, 1e8, 1e12, 1e16, 1e20})
      for (int seed = 0; seed < 4; ++seed) {
        SCOPED_TRACE(testing::Message()
                     << name_of(tolerance) << " ratio " << ratio << " seed " << seed);
        const Model<double> model = rounded<T>(heavy_tip(seed, ratio));
        suspects += expect_no_silent_error<T>(model, random_state(model, seed).q, tolerance);
      }
  EXPECT_GT(suspects, 100);
}

TEST(CertifiedInFloat64, WildMechanismsAreAnsweredRightByTheLastResort) {
  int answers = 0;
  for (int seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    const Model<double> model = wild(seed);
    const VectorX<double> q = random_state(model, seed).q;
    answers += expect_no_silent_error<double>(model, q, Tolerance(last_bits), true);
  }
  EXPECT_GT(answers, 60);
}

// Two hinges that are parallel but for an angle, with a massless link between them: by constants of
// the model, or where the hinge between them stands at `ref` and that angle.
Mechanism parallel_but_for(double angle) {
  Grown grown(3);
  const int middle = grown.add_massless(grown.joint(grown.root));
  grown.add(grown.gimbal(middle, Eigen::Quaterniond(1, angle / 2, 0, 0)));
  return grown.mechanism("nearly_parallel", {});
}
Mechanism gimbal_lock_but_for(double angle, double ref) {
  Grown grown(3);
  Joint<double> between = grown.gimbal(grown.add_massless(grown.joint(grown.root)), z_to_x);
  between.ref = ref;
  const int middle = grown.add_massless(between);
  grown.add(grown.gimbal(middle, x_to_z));
  Mechanism out = grown.mechanism("near_gimbal_lock", {}, true);
  out.q[out.model.joint(middle).q_index] = ref + angle;
  return out;
}

// From what two doubles cannot tell from singular to what one can. M is singular to the square of the
// angle, so that of the 50 digits of truth 18 are left at the least. Answers of the last resort are
// as right as they say, others as errors.md has it.
TEST(CertifiedInFloat64, FromSingularToRegularNothingIsSilentlyWrong) {
  int refused = 0, warned = 0, answered = 0, by_two_doubles = 0;
  for (int exponent = -16; exponent <= -6; ++exponent) {
    const double angle = std::pow(10, exponent);
    for (const Mechanism& mechanism :
         {parallel_but_for(angle), gimbal_lock_but_for(angle, 0), gimbal_lock_but_for(angle, 0.3)})
      for (const Tolerance tolerance : tolerances) {
        SCOPED_TRACE(testing::Message()
                     << mechanism.name << " " << name_of(tolerance) << " angle " << angle);
        const bool certified = tolerance.has_value();
        if (certified)
          expect_no_silent_error<double>(mechanism.model, mechanism.q, tolerance, true);
        Dynamics<double> robot = dynamics_of<double>(
            mechanism.model, spatial({Want::solve, Want::acceleration}, tolerance));
        const State<double> drawn = random_state(mechanism.model, 7);
        VectorX<double> a = poisoned<double>(mechanism.model.nv());
        const Outcome out = robot.forward_dynamics(mechanism.q, drawn.qd, drawn.tau, a);
        EXPECT_EQ(static_cast<bool>(robot.factor(mechanism.q)), static_cast<bool>(out));
        if (!out) {
          ++refused;
          EXPECT_GE(out.joint, 0);
          EXPECT_LE(std::abs(out.D), out.scale);
          continue;
        }
        (out.warns() ? warned : answered)++;
        by_two_doubles += out.rung == Outcome::Rung::two_doubles;
        const Truth truth(mechanism.model, {mechanism.q, drawn.qd, drawn.tau});
        const double most = certified ? 1e-7 : 1e-6;
        EXPECT_LE(truth.relative(a), certified && out.rung == Outcome::Rung::two_doubles
                                         ? 10 * out.error + 8 * 0x1p-53
                                         : most);
        EXPECT_TRUE(!out.warns() || out.joint >= 0);
      }
  }
  EXPECT_GT(refused, 4);
  EXPECT_GT(warned, 4);
  EXPECT_GT(answered, 40);
  EXPECT_GT(by_two_doubles, 10);
}

TYPED_TEST(Certified, StatesThatAreNotFiniteAreSaidToBe) {
  using T = TypeParam;
  const Model<double> model = everything(1);
  Dynamics<T> dynamics = this->robot(model, {Want::acceleration, Want::inverse, Want::solve});
  const State<T> good = random_state(model, 1).template cast<T>();
  const int nv = model.nv();
  VectorX<T> a(nv);
  MatrixX<T> X(nv, nv);
  for (const T bad : {std::numeric_limits<T>::quiet_NaN(), std::numeric_limits<T>::infinity()})
    for (VectorX<T> State<T>::*part : {&State<T>::q, &State<T>::qd, &State<T>::tau}) {
      State<T> state = good;
      (state.*part)[2] = bad;
      EXPECT_EQ(dynamics.forward_dynamics(state.q, state.qd, state.tau, a).status,
                Outcome::Status::not_finite);
      if (part != &State<T>::q) continue;
      EXPECT_EQ(dynamics.inverse_mass(state.q, X).status, Outcome::Status::not_finite);
      EXPECT_EQ(dynamics.factor(state.q).status, Outcome::Status::not_finite);
    }
}

// Torques that hold the robot still: a is what rounding has left of terms that cancel, some u of
// them, of which pairs and two doubles are right to some u. What these can tell of it is beside u g.
TYPED_TEST(Certified, EquilibriumIsRightAndNotRefused) {
  using T = TypeParam;
  for (const Family& family : all_families()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = rounded<T>(family.make(4));
    State<T> state = random_state(model, 5).template cast<T>();
    state.qd.setZero();
    Dynamics<T> dynamics = this->robot(model, {Want::acceleration, Want::inverse_dynamics});
    dynamics.gravity(state.q, state.tau);
    VectorX<T> a = poisoned<T>(model.nv());
    const Outcome out = dynamics.forward_dynamics(state.q, state.qd, state.tau, a);
    ASSERT_TRUE(out);
    if (a.isZero(0)) continue;
    const double error = Truth(model, state.template cast<double>()).relative(a);
    EXPECT_LE(error, (std::is_same_v<T, float> ? 1 : 400) * this->u);
    EXPECT_LE(error, 4 * std::max(out.error, this->u));
    if (std::is_same_v<T, float>) {  // a second step is one in float64
      EXPECT_LE(out.error, this->u);
      continue;
    }
    EXPECT_TRUE(out.error <= last_bits || out.rung == Outcome::Rung::two_doubles);
    EXPECT_FALSE(out.warns());
  }
}

}  // namespace
}  // namespace kalmarm::test
