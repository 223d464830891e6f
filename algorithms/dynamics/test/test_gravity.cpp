// Gravity that a state has in the place of the robot's: all calls are those of the robot with that gravity, against truth
// in 50 digits; one state and rows, on every rung.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <tuple>
#include <vector>

#include "algorithms/dynamics/test/door_support.hpp"
#include "algorithms/fast/test/derivatives_support.hpp"
#include "algorithms/test/refusal.hpp"
#include "kalmarm/gradients.hpp"
#include "kalmarm/implicit_step.hpp"
#include "kalmarm/step_gradients.hpp"

namespace kalmarm::test {
namespace {

template <class T>
class Weighing : public testing::Test {};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Weighing, Precisions, PrecisionName);

Model<double> with_gravity(const Model<double>& model, const VectorX<double>& gravity) {
  RobotModel robot = plain(model);
  robot.gravity = {gravity[0], gravity[1], gravity[2]};
  return model_of(robot);
}

// Tilted, and of another size than the robots'.
template <class T>
VectorX<T> some_gravity(std::uint64_t seed) {
  return (5 * Random(seed).vector(3)).template cast<T>();
}

template <class T>
StateForces<T> given(const VectorX<T>& gravity) {
  return {.axes = Axes::local, .gravity = VectorView<const T>(gravity)};
}

template <class T>
double distance(const VectorX<T>& x, const VectorX<T>& y) {
  return (x - y).template cast<double>().norm();
}

// Accelerations within what their estimate says, and all their digits where these are asked for.
TYPED_TEST(Weighing, AccelerationsAreThoseOfTheRobotThatWeighsSo) {
  using T = TypeParam;
  const double u = static_cast<double>(unit_roundoff<T>());
  for (const Family& family : families_and_robots())
    for (const double tolerance : {default_tolerance<T>, last_bits}) {
      SCOPED_TRACE(std::string(family.name) + " " + std::to_string(tolerance));
      const Model<double> model = rounded<T>(family.make(3));
      const State<T> s = random_state(model, 5).template cast<T>();
      const VectorX<T> gravity = some_gravity<T>(6);
      const Truth truth(with_gravity(model, gravity.template cast<double>()),
                        s.template cast<double>());
      Dynamics<T> robot = dynamics_of<T>(model, {.tolerance = tolerance});
      VectorX<T> a = poisoned<T>(model.nv());
      const Outcome outcome = robot.forward_dynamics(s.q, s.qd, s.tau, a, given(gravity));
      ASSERT_TRUE(outcome);
      const VectorX<double> wide = a.template cast<double>();
      EXPECT_LE(truth.relative(wide), std::max(tolerance, 2 * u));
      // What is refined, or rounded to float, has an error in Euclid's norm.
      const bool by_sweep = std::is_same_v<T, double> && outcome.rung == Outcome::Rung::float64;
      EXPECT_LE(by_sweep ? truth.energy(wide) : truth.relative(wide),
                4 * std::max(outcome.error, u));
    }
}

// Torques and derivatives are those of the robot with that gravity, of the same code and so to some roundoffs.
TYPED_TEST(Weighing, TorquesAndDerivativesAreThoseOfTheRobotThatWeighsSo) {
  using T = TypeParam;
  const double u = static_cast<double>(unit_roundoff<T>());
  for (const Family& family : families_and_robots()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = rounded<T>(family.make(7));
    const int n = model.nv();
    const State<T> s = random_state(model, 8).template cast<T>();
    const VectorX<T> gravity = some_gravity<T>(9);
    Dynamics<T> robot = dynamics_of<T>(model, {}),
                other = dynamics_of<T>(with_gravity(model, gravity.template cast<double>()), {});
    VectorX<T> tau = poisoned<T>(n), exact = tau;
    robot.inverse_dynamics(s.q, s.qd, s.tau, tau, given(gravity));
    other.inverse_dynamics(s.q, s.qd, s.tau, exact);
    EXPECT_LE(distance(tau, exact), 40 * u * exact.norm());
    robot.bias(s.q, s.qd, tau, given(gravity));
    other.bias(s.q, s.qd, exact);
    EXPECT_LE(distance(tau, exact), 40 * u * exact.norm());

    AccelerationDerivatives<T> got(n), want(n);
    ASSERT_TRUE(robot.derivatives(
        s.q, s.qd, s.tau, {.dq = got.dq, .dqd = got.dqd, .dtau = got.dtau}, got.a, given(gravity)));
    ASSERT_TRUE(other.derivatives(s.q, s.qd, s.tau,
                                  {.dq = want.dq, .dqd = want.dqd, .dtau = want.dtau}, want.a));
    const TrueDerivatives truth(with_gravity(model, gravity.template cast<double>()),
                                s.template cast<double>());
    const double most = 4 * (40 + 2 * std::sqrt(truth.condition())) * u;
    EXPECT_LE((got.dq - want.dq).norm(), most * (want.dq.norm() + want.a.norm()));
    EXPECT_LE((got.dqd - want.dqd).norm(), most * (want.dqd.norm() + want.a.norm()));
    EXPECT_EQ(got.dtau, want.dtau);  // which gravity is no part of
    EXPECT_LE(distance(got.a, want.a), most * want.a.norm());
  }
}

// Each row has its own gravity, as one state after another has it: of all that takes one.
TYPED_TEST(Weighing, RowsHaveGravityOfTheirOwn) {
  using T = TypeParam;
  for (const double tolerance : {default_tolerance<T>, last_bits})
    for (const Family& family : robots()) {
      SCOPED_TRACE(std::string(family.name) + " " + std::to_string(tolerance));
      const Model<double> model = rounded<T>(family.make(3));
      const int nv = model.nv(), nq = model.nq(), count = 19;
      Dynamics<T> robot = dynamics_of<T>(model, {.tolerance = tolerance});
      VectorX<T> q(count * nq), qd(count * nv), tau(count * nv), gravity(3 * count),
          a = poisoned<T>(count * nv), torques = a, of_derivatives = a;
      MatrixX<T> dq(nv, nv * count);
      for (int i = 0; i < count; ++i) {
        const State<T> s = random_state(model, i).template cast<T>();
        q.segment(i * nq, nq) = s.q, qd.segment(i * nv, nv) = s.qd, tau.segment(i * nv, nv) = s.tau;
        gravity.segment(3 * i, 3) = some_gravity<T>(i);
      }
      const ForceRows<T> extra{.axes = Axes::local,
                               .gravity = RowsView<const T>(gravity.data(), count, 3)};
      std::vector<Outcome> outcomes(count);
      ASSERT_EQ(robot.forward_dynamics(q, qd, tau, a, outcomes, 2, extra), 0);
      robot.inverse_dynamics(q, qd, tau, torques, 2, extra);
      ASSERT_EQ(robot.derivatives(q, qd, tau, {.dq = RowsView<T>(dq.data(), count, nv * nv)},
                                  of_derivatives, outcomes, 2, extra),
                0);
      for (int i = 0; i < count; ++i) {
        SCOPED_TRACE(i);
        const VectorX<T> own = gravity.segment(3 * i, 3), at = q.segment(i * nq, nq),
                         rates = qd.segment(i * nv, nv), torque = tau.segment(i * nv, nv);
        const auto close = [&](const VectorX<T>& rows, const VectorX<T>& one) {
          EXPECT_LE(distance<T>(rows.segment(i * nv, nv), one),
                    2 * default_tolerance<T> * one.norm());
        };
        VectorX<T> one = poisoned<T>(nv);
        ASSERT_TRUE(robot.forward_dynamics(at, rates, torque, one, given(own)));
        close(a, one);
        close(of_derivatives, one);
        robot.inverse_dynamics(at, rates, torque, one, given(own));
        close(torques, one);
        MatrixX<T> X(nv, nv);
        ASSERT_TRUE(robot.derivatives(at, rates, torque, {.dq = X}, one, given(own)));
        EXPECT_LE((dq.middleCols(i * nv, nv) - X).norm(),
                  T(2 * default_tolerance<T>) * (X.norm() + one.norm()));
      }
    }
}

// Torques are linear in gravity; accelerations through them, with and without the terms of a step.
TYPED_TEST(Weighing, GradientsAreThoseOfTheRobotThatWeighsSo) {
  using T = TypeParam;
  const double u = static_cast<double>(unit_roundoff<T>());
  for (const Family& family : families_and_robots()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = rounded<T>(family.make(12));
    const int n = model.nv();
    const State<T> s = random_state(model, 13).template cast<T>();
    const VectorX<T> gravity = some_gravity<T>(14), none = VectorX<T>::Zero(3),
                     w = Random(15).vector(n).template cast<T>(),
                     along = Random(16).vector(n).template cast<T>(), zero = VectorX<T>::Zero(n);
    const RobotModel plain_model = plain(model),
                     other_model = plain(with_gravity(model, gravity.template cast<double>()));
    const TrueDerivatives truth(model_of(other_model), s.template cast<double>());
    const AccelerationDerivatives<double> derived = truth.rounded();
    const double most = 4 * (40 + 2 * std::sqrt(truth.condition())) * u;
    VectorX<T> by = poisoned<T>(3), dq = poisoned<T>(n), dqd = dq, lambda = dq, exact_dq = dq,
               exact_dqd = dq, by_torques = by, of_gravity = dq, without = dq, da = dq,
               exact_da = dq;
    Dynamics<T> dynamics(plain_model);
    Gradients<T> robot(plain_model), other(other_model);
    robot.inverse_dynamics_vjp(s.q, s.qd, s.tau, w, {.gravity = by}, given(gravity));
    dynamics.inverse_dynamics(s.q, s.qd, s.tau, of_gravity, given(gravity));
    dynamics.inverse_dynamics(s.q, s.qd, s.tau, without, given(none));
    EXPECT_LE(std::abs(w.dot(of_gravity - without) - by.dot(gravity)),
              T(40 * u) * w.norm() * (of_gravity.norm() + without.norm()));

    // Twice what each may be wrong by (test_gradients.cpp), of the robot alone too: a step adds to D.
    const double wrong_dq = 2 * most * (derived.dq.norm() + derived.a.norm()) * w.norm(),
                 wrong_dqd = 2 * most * (derived.dqd.norm() + derived.a.norm()) * w.norm(),
                 wrong_da = 2 * most * along.norm() *
                            (derived.dq.norm() + derived.dqd.norm() + derived.a.norm());
    const auto judge = [&](auto& mine, auto& others, const auto& vjp, const auto& jvp) {
      VectorX<T> exact_by = poisoned<T>(3);
      ASSERT_TRUE(vjp(others, exact_dq, exact_dqd, lambda, exact_by, {}));
      ASSERT_TRUE(vjp(mine, dq, dqd, lambda, by, given(gravity)));
      EXPECT_LE(distance(dq, exact_dq), wrong_dq);
      EXPECT_LE(distance(dqd, exact_dqd), wrong_dqd);
      EXPECT_LE(distance(by, exact_by), most * exact_by.norm());
      ASSERT_TRUE(jvp(mine, da, given(gravity)));
      ASSERT_TRUE(jvp(others, exact_da, {}));
      EXPECT_LE(distance(da, exact_da), wrong_da);
    };
    judge(
        robot, other,
        [&](Gradients<T>& of, VectorX<T>& by_q, VectorX<T>& by_qd, VectorX<T>& by_tau,
            VectorX<T>& by_gravity, const StateForces<T>& forces) {
          return of.forward_dynamics_vjp(
              s.q, s.qd, s.tau, w,
              {.dq = by_q, .dqd = by_qd, .dtau = by_tau, .gravity = by_gravity}, forces);
        },
        [&](Gradients<T>& of, VectorX<T>& out, const StateForces<T>& forces) {
          return of.forward_dynamics_jvp(s.q, s.qd, s.tau, along, along, zero, out, forces);
        });
    // Gravity enters a by the torques alone: w'da = -lambda'd ID.
    robot.inverse_dynamics_vjp(s.q, s.qd, s.tau, VectorX<T>(-lambda), {.gravity = by_torques},
                               given(gravity));
    EXPECT_LE(distance(by, by_torques), most * by_torques.norm());

    JointTerms terms{.damping = std::vector<double>(n, 0.5)};
    for (int k = 0; k < n; ++k) terms.stiffness.push_back(is_single(model, k) ? 0.25 : 0);
    StepGradients<T> step(plain_model, 0.0078125, terms), other_step(other_model, 0.0078125, terms);
    judge(
        step, other_step,
        [&](StepGradients<T>& of, VectorX<T>& by_q, VectorX<T>& by_qd, VectorX<T>& by_tau,
            VectorX<T>& by_gravity, const StateForces<T>& forces) {
          return of.acceleration_vjp(
              s.q, s.qd, s.tau, w, {.dq = by_q, .dv = by_qd, .dtau = by_tau, .gravity = by_gravity},
              forces);
        },
        [&](StepGradients<T>& of, VectorX<T>& out, const StateForces<T>& forces) {
          return of.acceleration_jvp(s.q, s.qd, s.tau, along, along, zero, out, forces);
        });
  }
}

// Steps, rows with gains of their own among them.
TEST(Gravity, StepsAreThoseOfTheRobotThatWeighsSo) {
  for (const Family& family : robots()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = family.make(17);
    const int nv = model.nv(), nq = model.nq(), count = 5;
    const JointTerms terms{.damping = std::vector<double>(nv, 0.5)};
    ImplicitStep<double> robot(plain(model), 0.01, terms);
    VectorX<double> q(count * nq), v(count * nv), tau(count * nv), gravity(3 * count),
        a = poisoned<double>(count * nv), with_gains = a,
        damping = VectorX<double>::Constant(count * nv, 0.5);
    for (int i = 0; i < count; ++i) {
      const State<double> s = random_state(model, i);
      q.segment(i * nq, nq) = s.q, v.segment(i * nv, nv) = s.qd, tau.segment(i * nv, nv) = s.tau;
      gravity.segment(3 * i, 3) = some_gravity<double>(i);
    }
    const ForceRows<double> extra{.gravity = RowsView<const double>(gravity.data(), count, 3)};
    std::vector<Outcome> outcomes(count);
    ASSERT_EQ(robot.acceleration(q, v, tau, a, outcomes, 2, extra), 0);
    ASSERT_EQ(robot.acceleration(q, v, tau, {.damping = damping}, with_gains, outcomes, 2, extra),
              0);
    for (int i = 0; i < count; ++i) {
      ImplicitStep<double> other(plain(with_gravity(model, gravity.segment(3 * i, 3))), 0.01,
                                 terms);
      VectorX<double> one = poisoned<double>(nv);
      ASSERT_TRUE(other.acceleration(q.segment(i * nq, nq), v.segment(i * nv, nv),
                                     tau.segment(i * nv, nv), one));
      const double most = 2 * default_tolerance<double> * one.norm();
      EXPECT_LE(distance<double>(a.segment(i * nv, nv), one), most);
      EXPECT_LE(distance<double>(with_gains.segment(i * nv, nv), one), most);
    }
  }
}

TEST(Gravity, OfAWrongSizeOrNoNumberIsRefused) {
  const Model<double> model = robots()[0].make(1);
  const int n = model.nv();
  const State<double> s = random_state(model, 2);
  Dynamics<double> robot = dynamics_of<double>(model, {});
  Gradients<double> gradients(plain(model));
  VectorX<double> a(n), four = VectorX<double>::Ones(4), gravity = VectorX<double>::Ones(3);
  EXPECT_EQ(
      message_of([&] { std::ignore = robot.forward_dynamics(s.q, s.qd, s.tau, a, given(four)); }),
      "forward_dynamics: gravity has size 4, 3 is needed");
  EXPECT_EQ(message_of([&] {
              std::ignore =
                  gradients.forward_dynamics_vjp(s.q, s.qd, s.tau, s.tau, {.gravity = four});
            }),
            "forward_dynamics_vjp: gravity has size 1 x 4, 1 x 3 is needed");
  EXPECT_EQ(message_of([&] {
              std::ignore = gradients.solve_vjp(s.q, s.tau, s.tau, {.gravity = gravity});
            }),
            "solve_vjp: gravity: of what does not weigh");
  gravity[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(robot.forward_dynamics(s.q, s.qd, s.tau, a, given(gravity)).status,
            Outcome::Status::not_finite);
}

}  // namespace
}  // namespace kalmarm::test
