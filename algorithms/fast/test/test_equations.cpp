// The fast path's equations without rounding: all that is instantiated for multi-precision, in a
// file of its own.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "algorithms/fast/covariance/forward_dynamics.hpp"
#include "algorithms/fast/derivatives/derivatives.hpp"
#include "algorithms/fast/factors/columns.hpp"
#include "algorithms/fast/factors/lambda.hpp"
#include "algorithms/fast/rigid/inverse_dynamics.hpp"
#include "algorithms/fast/rigid/mass.hpp"
#include "algorithms/fast/test/derivatives_support.hpp"
#include "algorithms/fast/test/exact.hpp"
#include "algorithms/fast/test/zero_terms_support.hpp"
#include "algorithms/fast/translational/translational.hpp"
#include "algorithms/model/inverse_dynamics.hpp"

namespace kalmarm::test {
namespace {

struct Case {
  Model<Mp> model;
  State<Mp> state;
  LoweredModel<Mp> lowered;

  Case(const Model<double>& drawn, std::uint64_t seed)
      : model(drawn.cast<Mp>()), state(random_state(drawn, seed).cast<Mp>()), lowered(model) {}

  VectorX<Mp> acceleration() const {
    CovarianceWorkspace<Mp> ws(lowered);
    VectorX<Mp> a = poisoned<Mp>(model.nv());
    covariance_acceleration(lowered, state.q.data(), state.qd.data(), state.tau.data(), ws,
                            a.data());
    return a;
  }

  VectorX<Mp> torque(const VectorX<Mp>& qdd) const {
    InverseDynamicsWorkspace<Mp> ws(lowered);
    VectorX<Mp> tau = poisoned<Mp>(model.nv());
    fast_inverse_dynamics(lowered, state.q.data(), state.qd.data(), qdd.data(), ws, tau.data());
    return tau;
  }

  // Columns are worked on one at a time.
  AccelerationDerivatives<Mp> derivatives() const {
    static_assert(lanes_of<Mp> == 1);
    DerivativeWorkspace<Mp> ws(lowered);
    AccelerationDerivatives<Mp> out(model.nv());
    fast_derivatives(lowered, state.q.data(), state.qd.data(), state.tau.data(), ws, out.dq.data(),
                     out.dqd.data(), out.dtau.data(), out.a.data());
    return out;
  }
};

TEST(Equations, OfTheFilterHold) {
  for (const Family& family : all_families()) {
    const Case at(family.make(3), 4);
    EXPECT_LE(Exact(at.model, at.state).error(at.acceleration()), 1e-40) << family.name;
  }
}

TEST(Equations, OfInverseDynamicsHold) {
  for (const Family& family : all_families()) {
    const Case at(family.make(3), 4);
    const VectorX<Mp>& qdd = at.state.tau;
    const ExactTorque truth(Exact(at.model, at.state), qdd);
    EXPECT_LE(truth.error(at.torque(qdd)), 1e-43) << family.name;

    LinkKinematics<Mp> kin(at.model);
    InverseDynamics<Mp> ws(at.model);
    VectorX<Mp> tau = poisoned<Mp>(at.model.nv());
    set_position(at.model, at.state.q, kin);
    set_velocity(at.model, at.state.qd, kin);
    inverse_dynamics(at.model, kin, qdd, ws, Eigen::Ref<VectorX<Mp>>(tau));
    EXPECT_LE(truth.error(tau), 1e-43) << family.name;
  }
}

TEST(Equations, HoldWhereTermsAreZeroAndLeftOut) {
  for (int seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    const Case at(like_a_robot(seed), seed);
    const VectorX<Mp> a = at.acceleration();
    EXPECT_LE(Exact(at.model, at.state).error(a), 1e-40);
    EXPECT_LE((at.torque(a) - at.state.tau).norm(), Mp(1e-40) * at.state.tau.norm());
  }
}

TEST(Equations, OfFactorsAndCompositesHold) {
  for (const Family& family : all_families()) {
    SCOPED_TRACE(family.name);
    const Case at(family.make(3), 4);
    const Exact exact(at.model, at.state);
    const MatrixX<Mp>&M = exact.M, X = exact.inverse();
    const int nv = at.model.nv();

    FastFactors<Mp> factors(at.lowered);
    covariance_factor(at.lowered, at.state.q.data(), factors);
    ColumnsWorkspace<Mp> ws(at.lowered);
    const std::vector<char> all(nv, 1);
    VectorX<Mp> solved(nv);
    detail::sweep_inward(
        at.lowered, factors, nv - 1, all.data(), [&](int k) { return at.state.tau[k]; }, ws);
    detail::sweep_outward(at.lowered, factors, nv - 1, ws,
                          [&](int k, const Mp& a) { solved[k] = a; });
    EXPECT_LE(Mp((M * solved - at.state.tau).norm() / at.state.tau.norm()), 1e-38);

    LambdaWorkspace<Mp> lambda(at.lowered);
    fast_lambda(at.lowered, factors, lambda);
    for (int k = 0; k < nv; ++k) EXPECT_LE(Mp(abs(lambda.alpha[k] / X(k, k) - 1)), 1e-38) << k;

    CompositeForces<Mp> composite(at.lowered);
    composite_forces(at.lowered, at.state.q.data(), composite);
    for (int j = 0; j < nv; ++j) {
      detail::sweep_composite_forces(
          at.lowered, composite, j, j, all.data(), [](int) { return Mp(1); }, ws);
      for (int k = 0; k <= j; ++k)
        EXPECT_LE(Mp(abs(ws.e[k] - M(k, j)) / sqrt(Mp(M(k, k) * M(j, j)))), 1e-40) << k << ' ' << j;
    }
  }
}

TEST(Equations, OfDerivativesHold) {
  std::vector<Family> all = all_families();
  all.push_back({"long_chain", [](std::uint64_t seed) { return long_chain(seed, 19); }});
  for (const Family& family : all) {
    const Case at(family.make(3), 4);
    EXPECT_LE(error(at.derivatives(), differences(at.model, at.state)), 1e-28) << family.name;
  }
}

// What tests of derivatives are held against, by what a derivative is.
TEST(Equations, DifferencesOfTorquesGiveThoseOfAccelerations) {
  const Mp h("1e-17");
  for (const Family& family : all_families()) {
    const Model<double> drawn = family.make(5);
    const Model<Mp> model = drawn.cast<Mp>();
    const State<Mp> state = random_state(drawn, 6).cast<Mp>();
    const AccelerationDerivatives<Mp> truth = differences(model, state);
    const int k = model.nv() / 2;
    const auto expect = [&](const State<Mp>& after, const State<Mp>& before, const auto& column) {
      const VectorX<Mp> own = (Exact(model, after).a - Exact(model, before).a) / (2 * h);
      EXPECT_LE(Mp((own - column).norm() / (own.norm() + 1)), 1e-28) << family.name;
    };
    expect(moved(model, state, k, h), moved(model, state, k, -h), truth.dq.col(k));
    State<Mp> faster = state, slower = state;
    faster.qd[k] += h;
    slower.qd[k] -= h;
    expect(faster, slower, truth.dqd.col(k));
  }
}

// Of every size, by columns and by tiles.
TEST(Derivatives, AgreeWithOneColumnAtATimeInMultiPrecision) {
  for (int n = 1; n <= 70; n += n < 40 ? 1 : 7) {
    const Model<double> drawn = n % 3 == 0 ? long_chain(7, n) : chain(7, n);
    const State<double> state = random_state(drawn, 8);
    const AccelerationDerivatives<Mp> truth = Case(drawn, 8).derivatives();
    EXPECT_LE(error(derivatives(drawn, state).cast<Mp>(), truth), 1000 * unit_roundoff<double>())
        << n;
    EXPECT_LE(error(derivatives(drawn, state.cast<float>()).cast<Mp>(), truth),
              1000 * unit_roundoff<float>())
        << n;
  }
}

// Slides on two trees, one with armature, whose quaternions are integers: axes are exact but for Mp.
TEST(Equations, OfSlidesAloneHold) {
  Random random(4);
  Builder builder;
  const std::vector<Eigen::Quaterniond> rotations{{3, 1, -2, 5}, {2, 0, 0, 1}, {5, -3, 4, 0},
                                                  {5, 3, -4, 0}, {0, 2, 1, 0}, {3, 0, 4, 2}};
  const std::vector<int> parents{-1, 0, 1, 0, -1, 4};
  for (int k = 0; k < 6; ++k) {
    Joint<double> joint = random_joint(random, parents[k], Coordinate::distance);
    joint.rotation = rotations[k];
    if (k == 3) joint.r = 0.2;
    builder.add(joint);
  }
  const Model<double> drawn = builder.build();
  const Model<Mp> model = drawn.cast<Mp>();
  std::vector<Matrix3<Mp>> axes;
  std::vector<Slide<Mp>> slides;
  for (int k = 0; k < 6; ++k) {
    const int parent = model.parent(k);
    axes.push_back(parent < 0 ? model.E(k) : Matrix3<Mp>(axes[parent] * model.E(k)));
    slides.push_back({parent, axes[k].col(2), model.joint(k).r, model.joint(k).body.mass});
  }
  const State<Mp> state = random_state(drawn, 4).cast<Mp>();
  const Exact truth(model, state);
  TranslationalFactors<Mp> factors(slides, model.gravity(), Mp(1e-20));
  VectorX<Mp> a = poisoned<Mp>(6);
  factors.solve([&](int k) { return state.tau[k]; },
                [&](int k, const Mp& x) { a[k] = x + factors.by_weight()[k]; });
  EXPECT_LE(truth.error(a), 1e-40);
}

}  // namespace
}  // namespace kalmarm::test
