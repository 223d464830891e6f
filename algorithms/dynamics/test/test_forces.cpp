// Forces from outside: accelerations, torques and derivatives against truth in 50 digits, the work that
// forces do, one state and rows.
#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "algorithms/dynamics/test/door_support.hpp"
#include "algorithms/fast/test/derivatives_support.hpp"
#include "kalmarm/implicit_step.hpp"
#include "kalmarm/kinematics.hpp"

namespace kalmarm::test {
namespace {

constexpr Axes all_axes[] = {Axes::local, Axes::world, Axes::aligned};

std::string name_of(Axes axes) {
  return std::array{"local", "world", "aligned"}[static_cast<int>(axes)];
}

// On two links, one of them twice, and on the base, where they do nothing.
Push some_forces(const Model<double>& model, Axes axes, std::uint64_t seed, double size = 5) {
  Random random(seed);
  const int last = end_of_joint(model, model.nv() - 1),
            middle = end_of_joint(model, model.nv() / 2);
  Push push{{{last, {1, 0.2, -0.3, 0.1}, {0.1, 0, 0.2}},
             {-1, {0.5, 0.1, 0, 0.3}, {1, 2, 3}},
             {middle, {-0.1, 0.7, 0.2, 0.3}, {-0.2, 0.1, 0}},
             {last, {1, 0, 0, 0}, {0, -0.1, 0}}},
            size * random.vector(24),
            axes};
  push.forces = rounded<float>(push.forces);
  return push;
}

template <class T>
Dynamics<T> pushed_robot(const Model<double>& model, const Push& push, DynamicsOptions options) {
  options.question.acted_on = push.frames;
  return dynamics_of<T>(model, options);
}

template <class T>
StateForces<T> forces_of(const VectorX<T>& f, Axes axes) {
  return {VectorView<const T>(f), axes};
}

template <class T>
class Pushed : public testing::Test {};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Pushed, Precisions, PrecisionName);

// Within what is accepted without forces, with which the size of an error grows too.
TYPED_TEST(Pushed, AccelerationsAndTorquesAreThoseOfMechanics) {
  using T = TypeParam;
  const double u = static_cast<double>(unit_roundoff<T>());
  for (const Family& family : families_and_robots())
    for (const Axes axes : all_axes) {
      SCOPED_TRACE(std::string(family.name) + " " + name_of(axes));
      const Model<double> model = rounded<T>(family.make(3));
      const State<T> s = random_state(model, 5).template cast<T>();
      const Push push = some_forces(model, axes, 8);
      const VectorX<T> f = push.forces.cast<T>();
      const Truth truth(model, s.template cast<double>(), push);
      Dynamics<T> robot = pushed_robot<T>(
          model, push, {.question = {.want = {Want::acceleration, Want::inverse_dynamics}}});
      VectorX<T> a = poisoned<T>(model.nv()), tau = a;
      const Outcome outcome = robot.forward_dynamics(s.q, s.qd, s.tau, a, forces_of(f, axes));
      ASSERT_TRUE(outcome);
      EXPECT_LE(truth.relative(a), 1e3 * u);
      // What double has answered for float has an error in Euclid's norm, by its rounding.
      const double error = std::is_same_v<T, float> ? truth.relative(a) : truth.energy(a);
      EXPECT_LE(error, 4 * std::max(outcome.error, u));
      robot.inverse_dynamics(s.q, s.qd, s.tau, tau, forces_of(f, axes));
      EXPECT_LE(truth.torque(tau), (20 + 4 * model.nv()) * u);
    }
}

// Refined answers to the last digits, whatever the axes; rows and one state, also in two doubles.
TEST(Forces, RefinedAnswersHaveAllDigits) {
  for (const Family& family : families_and_robots())
    for (const Axes axes : all_axes) {
      SCOPED_TRACE(std::string(family.name) + " " + name_of(axes));
      const Model<double> model = family.make(4);
      const int nv = model.nv(), nq = model.nq(), count = 3;
      const Push push = some_forces(model, axes, 9);
      Dynamics<double> robot = pushed_robot<double>(
          model, push, {.tolerance = last_bits, .question = {.want = {Want::acceleration}}});
      VectorX<double> q(count * nq), qd(count * nv), tau(count * nv), f(count * 24),
          rows = poisoned<double>(count * nv);
      for (int i = 0; i < count; ++i) {
        const State<double> s = random_state(model, i);
        q.segment(i * nq, nq) = s.q, qd.segment(i * nv, nv) = s.qd, tau.segment(i * nv, nv) = s.tau;
        f.segment(i * 24, 24) = push.forces;
      }
      std::vector<Outcome> outcomes(count);
      ASSERT_EQ(robot.forward_dynamics(q, qd, tau, rows, outcomes, 1, {f, axes}), 0);
      for (int i = 0; i < count; ++i) {
        const State<double> s = random_state(model, i);
        const Truth truth(model, s, push);
        VectorX<double> a = poisoned<double>(nv);
        const Outcome outcome = robot.forward_dynamics(s.q, s.qd, s.tau, a, {push.forces, axes});
        ASSERT_TRUE(outcome);
        EXPECT_LE(truth.relative(a), 2 * unit_roundoff<double>());
        EXPECT_LE(truth.relative(rows.segment(i * nv, nv)), 2 * unit_roundoff<double>());
      }
    }
}

// With forces that turn with their frames.
TYPED_TEST(Pushed, DerivativesAgreeWithDifferencesOfTruth) {
  using T = TypeParam;
  const double u = static_cast<double>(unit_roundoff<T>());
  for (const Family& family : families_and_robots()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = family.make(3);
    const State<T> s = random_state(model, 4).template cast<T>();
    const Push push = some_forces(model, Axes::local, 8);
    const VectorX<T> f = push.forces.cast<T>();
    const int nv = model.nv();
    Dynamics<T> robot = pushed_robot<T>(model, push, {.question = {.want = {Want::derivatives}}});
    AccelerationDerivatives<T> out(nv), row(nv);
    ASSERT_TRUE(robot.derivatives(s.q, s.qd, s.tau,
                                  {.dq = out.dq, .dqd = out.dqd, .dtau = out.dtau}, out.a,
                                  forces_of(f, Axes::local)));
    const TrueDerivatives truth(model, random_state(model, 4), push);
    const double bound = 4 * (40 + 2 * std::sqrt(truth.condition())) * u;
    EXPECT_LE(truth.error(out.template cast<double>()), bound);
    // Two rows, since one is a state.
    const auto twice = [](const VectorX<T>& x) {
      VectorX<T> both(2 * x.size());
      both << x, x;
      return both;
    };
    const VectorX<T> q = twice(s.q), qd = twice(s.qd), tau = twice(s.tau), ff = twice(f);
    VectorX<T> dq(2 * nv * nv), dqd = dq, dtau = dq, a(2 * nv);
    std::vector<Outcome> outcomes(2);
    const auto rows = [&](VectorX<T>& X) { return RowsView<T>(X.data(), 2, nv * nv); };
    ASSERT_EQ(robot.derivatives(q, qd, tau, {.dq = rows(dq), .dqd = rows(dqd), .dtau = rows(dtau)},
                                a, outcomes, 1, {ff, Axes::local}),
              0);
    row.dq = Eigen::Map<MatrixX<T>>(dq.data() + nv * nv, nv, nv);
    row.dqd = Eigen::Map<MatrixX<T>>(dqd.data() + nv * nv, nv, nv);
    row.dtau = Eigen::Map<MatrixX<T>>(dtau.data() + nv * nv, nv, nv);
    row.a = a.tail(nv);
    EXPECT_LE(truth.error(row.template cast<double>()), bound);
  }
}

// Virtual power: what forces add to tau, times qd, is force' (J qd) with J of the same axes.
TYPED_TEST(Pushed, DoTheWorkOfTheirFrames) {
  using T = TypeParam;
  for (const Family& family : robots())
    for (const Axes axes : all_axes) {
      SCOPED_TRACE(std::string(family.name) + " " + name_of(axes));
      const Model<double> model = rounded<T>(family.make(6));
      const State<T> s = random_state(model, 7).template cast<T>();
      const Push push = some_forces(model, axes, 10);
      const VectorX<T> f = push.forces.cast<T>();
      Dynamics<T> robot = pushed_robot<T>(model, push, by_all_rules);
      VectorX<T> with = poisoned<T>(model.nv()), without = with;
      robot.bias(s.q, s.qd, with, forces_of(f, axes));
      robot.bias(s.q, s.qd, without);
      MatrixX<T> V(6, 4);
      Kinematics<T>(plain(model), push.frames).compute(s.q, s.qd, {.axes = axes, .velocities = V});
      const Eigen::Map<const VectorX<T>> velocities(V.data(), V.size());
      const double size = static_cast<double>(with.norm() + without.norm()) * s.qd.norm();
      EXPECT_NEAR(static_cast<double>((without - with).dot(s.qd)),
                  static_cast<double>(f.dot(velocities)),
                  100 * model.nv() * static_cast<double>(unit_roundoff<T>()) * size);
    }
}

// Every row has what is right for its own state and forces, in parts and whole, on two threads, with columns.
TYPED_TEST(Pushed, RowsAreTheirStates) {
  using T = TypeParam;
  const double u = static_cast<double>(unit_roundoff<T>());
  for (const Family& family : robots())
    for (const Axes axes : all_axes)
      for (const bool all : {false, true}) {
        SCOPED_TRACE(std::string(family.name) + " " + name_of(axes));
        const Model<double> model = rounded<T>(family.make(3));
        const int nv = model.nv(), nq = model.nq(), count = 37, m = 2;
        const Push push = some_forces(model, axes, 0);
        Dynamics<T> robot =
            pushed_robot<T>(model, push, {.rules = all ? all_rules() : std::set<Rule>{}});
        VectorX<T> q(count * nq), qd(count * nv), tau(count * nv), f(count * 24),
            a = poisoned<T>(count * nv), again = a, torques = a;
        MatrixX<T> B = MatrixX<T>::Zero(nv, m), X(nv, count * m);
        B(0, 0) = B(nv - 1, 1) = T(1);
        for (int i = 0; i < count; ++i) {
          const State<T> s = random_state(model, i).template cast<T>();
          q.segment(i * nq, nq) = s.q, qd.segment(i * nv, nv) = s.qd,
                            tau.segment(i * nv, nv) = s.tau;
          f.segment(i * 24, 24) = some_forces(model, axes, i).forces.cast<T>();
        }
        std::vector<Outcome> outcomes(count);
        ASSERT_EQ(robot.forward_dynamics(q, qd, tau, a, outcomes, 2, {f, axes}), 0);
        ASSERT_EQ(robot.forward_dynamics(q, qd, tau, again, B, X, outcomes, 1, {f, axes}), 0);
        robot.inverse_dynamics(q, qd, tau, torques, 1, {f, axes});
        for (int i = 0; i < count; i += 4) {
          const VectorX<T> fi = f.segment(i * 24, 24);
          const Push own{push.frames, fi.template cast<double>(), axes};
          const Truth truth(model,
                            random_state(model, i).template cast<T>().template cast<double>(), own);
          EXPECT_LE(truth.relative(a.segment(i * nv, nv)), 1e3 * u) << i;
          EXPECT_LE(truth.relative(again.segment(i * nv, nv)), 1e3 * u) << i;
          EXPECT_LE(truth.torque(torques.segment(i * nv, nv)), (20 + 4 * nv) * u) << i;
        }
      }
}

// Locked joints: the forces act on the composite bodies.
TYPED_TEST(Pushed, ActWhereJointsAreLocked) {
  using T = TypeParam;
  for (const Family& family : robots()) {
    const Model<double> model = rounded<T>(family.make(5));
    const State<T> s = random_state(model, 6).template cast<T>();
    const std::vector<int> locked = some_locked(model);
    for (const Axes axes : all_axes) {
      SCOPED_TRACE(std::string(family.name) + " " + name_of(axes));
      const Push push = some_forces(model, axes, 11);
      const VectorX<T> f = push.forces.cast<T>();
      VectorX<T> a[2];
      for (const bool by_rule : {false, true}) {
        DynamicsOptions options{.question = {.want = {Want::acceleration}, .locked = locked}};
        const VectorX<double> at = s.q.template cast<double>();
        options.question.q.assign(at.begin(), at.end());
        if (!by_rule) options.rules.erase(Rule::locked_joints);
        Dynamics<T> robot = pushed_robot<T>(model, push, options);
        State<T> still = s;
        for (const int k : locked) still.qd[k] = still.tau[k] = T(0);
        a[by_rule] = poisoned<T>(robot.asked());
        ASSERT_TRUE(
            robot.forward_dynamics(still.q, still.qd, still.tau, a[by_rule], forces_of(f, axes)));
      }
      const double size = static_cast<double>(a[0].norm());
      EXPECT_LE(static_cast<double>((a[0] - a[1]).norm()),
                1e4 * static_cast<double>(unit_roundoff<T>()) * size);
    }
  }
}

// Two forces that cancel leave nothing in z-, but what they were rounded by: the estimate counts it, so that the
// answer to large ones is refined.
TEST(Forces, ThatCancelAreCountedByTheEstimate) {
  const Model<double> model = chain(3, 12);
  const State<double> s = random_state(model, 4);
  for (const double size : {1.0, 1e2, 1e5}) {
    Push push = some_forces(model, Axes::aligned, 3, size);
    push.frames.resize(2);
    push.frames[1] = push.frames[0];
    push.forces.conservativeResize(12);
    push.forces.tail(6) = -push.forces.head(6);
    Dynamics<double> robot =
        pushed_robot<double>(model, push, {.question = {.want = {Want::acceleration}}});
    VectorX<double> a = poisoned<double>(model.nv());
    const Outcome outcome = robot.forward_dynamics(s.q, s.qd, s.tau, a, {push.forces, push.axes});
    ASSERT_TRUE(outcome);
    EXPECT_LE(Truth(model, s, push).energy(a), 4 * outcome.error) << size;
    EXPECT_EQ(outcome.rung, size < 1e5 ? Outcome::Rung::float64 : Outcome::Rung::refined) << size;
  }
}

// Of a robot 1000 km away a force in the world's axes has a moment about the base's origin that its lever nearly
// cancels: the estimate counts what that loses.
TEST(Forces, FromFarAwayAreCountedByTheEstimate) {
  const Model<double> model = floating_base(3);
  for (int seed = 0; seed < 8; ++seed) {
    State<double> s = random_state(model, seed);
    s.q.head<3>() << 1e6, -3e5, 2e5;
    Random random(seed);
    const Vector3<double> f = 5 * random.vector3();
    Push push{{{5}}, VectorX<double>(6), Axes::world};
    Vector3<double> p;
    Kinematics<double>(plain(model), push.frames).compute(s.q, {.positions = p});
    push.forces << p.cross(f), f;
    Dynamics<double> robot =
        pushed_robot<double>(model, push, {.question = {.want = {Want::acceleration}}});
    VectorX<double> a = poisoned<double>(model.nv());
    const Outcome outcome = robot.forward_dynamics(s.q, s.qd, s.tau, a, {push.forces, push.axes});
    ASSERT_TRUE(outcome);
    EXPECT_LE(Truth(model, s, push).energy(a), 4 * outcome.error) << seed;
  }
}

// What a constant force does on the way of its frame is what the robot's energy gains.
TEST(Forces, AddTheirWorkToTheEnergy) {
  const Model<double> model = chain(5, 6);
  const std::vector<Frame> frames = {{5, {1, 0, 0, 0}, {0.1, 0.2, 0}}};
  Kinematics<double> kinematics(plain(model), frames);
  Dynamics<double> robot =
      dynamics_of<double>(model, {.question = {.want = {Want::acceleration}, .acted_on = frames}});
  VectorX<double> force(6), torque = VectorX<double>::Zero(6);
  force << 0, 0, 0, 3, -2, 5;
  State<double> s = random_state(model, 3);
  const auto energy_less_work = [&] {
    double kinetic = 0, potential = 0;
    VectorX<double> x(3);
    kinematics.compute(s.q, s.qd,
                       {.positions = x,
                        .kinetic_energy = MatrixView<double>(&kinetic, 1, 1),
                        .potential_energy = MatrixView<double>(&potential, 1, 1)});
    return kinetic + potential - force.tail(3).dot(x);
  };
  const double before = energy_less_work();
  const Vector3<double> f = force.tail(3);
  const auto accelerated = [&](const VectorX<double>& q, const VectorX<double>& qd) {
    VectorX<double> a(6);
    EXPECT_TRUE(robot.forward_dynamics(q, qd, torque, a, {force, Axes::aligned}));
    return a;
  };
  const double h = 1e-3;
  for (int step = 0; step < 300; ++step) {  // Runge and Kutta's
    const VectorX<double> v1 = s.qd, a1 = accelerated(s.q, v1);
    const VectorX<double> v2 = s.qd + h / 2 * a1, a2 = accelerated(s.q + h / 2 * v1, v2);
    const VectorX<double> v3 = s.qd + h / 2 * a2, a3 = accelerated(s.q + h / 2 * v2, v3);
    const VectorX<double> v4 = s.qd + h * a3, a4 = accelerated(s.q + h * v3, v4);
    s.q += h / 6 * (v1 + 2 * v2 + 2 * v3 + v4);
    s.qd += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
  EXPECT_NEAR(energy_less_work(), before, 1e-7 * (std::abs(before) + f.norm()));
}

// In a step with rows that couple joints, and in its derivatives, a force is the torque J' f.
TEST(Forces, ActOnCoupledStepsAsTorquesDo) {
  const Model<double> model = chain(4, 6);
  const std::vector<Frame> frames = {{5, {1, 0.1, 0, 0}, {0.1, 0.2, 0}}};
  DynamicsOptions options;
  options.question.acted_on = frames;
  JointTerms terms{.damping = std::vector<double>(6, 0.3), .stiffness = std::vector<double>(6, 20)};
  terms.rows = {{.jacobian = {1, 0, -2, 0, 0, 0}, .damping = 0.5, .stiffness = 1e3}};
  ImplicitStep<double> step(plain(model), 0.01, terms, Scheme::springs_at_end, options);
  const State<double> s = random_state(model, 3);
  VectorX<double> f(6), a(6), b(6);
  f << 1, -2, 3, 4, -5, 6;
  MatrixX<double> Jt(6, 6);
  Kinematics<double> kinematics(plain(model), frames);
  const auto torque_at = [&](const VectorX<double>& q) -> VectorX<double> {
    kinematics.compute(q, {.axes = Axes::local, .jacobians = Jt});
    return s.tau + Jt * f;
  };
  AccelerationDerivatives<double> out(6);
  ASSERT_TRUE(step.acceleration(s.q, s.qd, s.tau, a, {f, Axes::local}));
  ASSERT_TRUE(step.acceleration(s.q, s.qd, torque_at(s.q), b));
  EXPECT_LE((a - b).norm(), 1e-12 * b.norm());
  ASSERT_TRUE(step.derivatives(s.q, s.qd, s.tau, {.dq = out.dq, .dqd = out.dqd, .dtau = out.dtau},
                               out.a, {f, Axes::local}));
  EXPECT_LE((out.a - b).norm(), 1e-12 * b.norm());
  for (int k = 0; k < 6; ++k) {
    const double h = 1e-5;
    VectorX<double> q = s.q, ahead(6), behind(6);
    q[k] += h;
    ASSERT_TRUE(step.acceleration(q, s.qd, torque_at(q), ahead));
    q[k] -= 2 * h;
    ASSERT_TRUE(step.acceleration(q, s.qd, torque_at(q), behind));
    EXPECT_LE(((ahead - behind) / (2 * h) - out.dq.col(k)).norm(), 1e-7 * out.dq.norm()) << k;
  }
  // Rows take the force of each.
  VectorX<double> q(12), v(12), tau(12), ff(12), rows(12);
  q << s.q, s.q, v << s.qd, s.qd, tau << s.tau, s.tau, ff << VectorX<double>::Zero(6), f;
  std::vector<Outcome> outcomes(2);
  ASSERT_EQ(step.acceleration(q, v, tau, rows, outcomes, 1, {ff, Axes::local}), 0);
  EXPECT_LE((rows.tail(6) - b).norm(), 1e-12 * b.norm());
  ASSERT_TRUE(step.acceleration(s.q, s.qd, s.tau, a));
  EXPECT_LE((rows.head(6) - a).norm(), 1e-12 * a.norm());
}

// A step with dampers is a robot with more armature at less torque: one state, rows, rows with gains.
TEST(Forces, ActOnImplicitSteps) {
  const double h = 0.01, b = 0.25;
  for (const Axes axes : all_axes) {
    SCOPED_TRACE(name_of(axes));
    const Model<double> model = creature(4);
    const int nv = model.nv(), nq = model.nq(), count = 5;
    const Push push = some_forces(model, axes, 9);
    DynamicsOptions options;
    options.question.acted_on = push.frames;
    ImplicitStep<double> step(plain(model), h, {.damping = std::vector<double>(nv, b)},
                              Scheme::springs_at_end, options);
    Model<double> damped = model;
    for (int k = 0; k < nv; ++k) damped.set_noise(k, model.joint(k).r + h * b);
    VectorX<double> q(count * nq), v(count * nv), tau(count * nv), f(count * 24), a(count * nv);
    for (int i = 0; i < count; ++i) {
      const State<double> s = random_state(model, i);
      q.segment(i * nq, nq) = s.q, v.segment(i * nv, nv) = s.qd, tau.segment(i * nv, nv) = s.tau;
      f.segment(i * 24, 24) = push.forces;
    }
    const VectorX<double> gains = VectorX<double>::Constant(count * nv, b);
    std::vector<Outcome> outcomes(count);
    const auto expect_rows = [&] {
      for (int i = 0; i < count; ++i) {
        State<double> s = random_state(model, i);
        s.tau -= b * s.qd;
        EXPECT_LE(Truth(damped, s, push).relative(a.segment(i * nv, nv)),
                  1e3 * unit_roundoff<double>());
      }
    };
    ASSERT_EQ(step.acceleration(q, v, tau, a, outcomes, 1, {f, axes}), 0);
    expect_rows();
    a.setConstant(-1);
    ASSERT_EQ(step.acceleration(q, v, tau, {.damping = {gains.data(), count, nv}}, a, outcomes, 1,
                                {f, axes}),
              0);
    expect_rows();
    a.setConstant(-1);
    for (int i = 0; i < count; ++i) {
      const State<double> s = random_state(model, i);
      ASSERT_TRUE(step.acceleration(s.q, s.qd, s.tau, a.segment(i * nv, nv), {push.forces, axes}));
    }
    expect_rows();
  }
}

TEST(Forces, WhatIsNoForceIsRefused) {
  const Model<double> model = floating_base(3);
  const State<double> s = random_state(model, 4);
  const auto at = [&](int link) {
    return dynamics_of<double>(model, {.question = {.acted_on = {{link}}}});
  };
  EXPECT_THROW(at(model.nv()), std::invalid_argument);
  EXPECT_THROW(at(3), std::invalid_argument);  // within the free joint
  Dynamics<double> robot = at(5);
  VectorX<double> a(model.nv()), f = VectorX<double>::Zero(6);
  EXPECT_THROW((void)robot.forward_dynamics(s.q, s.qd, s.tau, a, {VectorX<double>(f.head(5))}),
               std::invalid_argument);
  AccelerationDerivatives<double> out(model.nv());
  EXPECT_THROW((void)robot.derivatives(s.q, s.qd, s.tau, {.dq = out.dq}, out.a, {f}),
               std::invalid_argument);
  f[4] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(robot.forward_dynamics(s.q, s.qd, s.tau, a, {f}).status, Outcome::Status::not_finite);
}

// A NaN in one row is that row's alone.
TYPED_TEST(Pushed, ARowThatIsNotFiniteDisturbsNoOther) {
  using T = TypeParam;
  const Model<double> model = floating_base(3);
  const int nv = model.nv(), nq = model.nq(), count = 20, bad = 7;
  Dynamics<T> robot = dynamics_of<T>(model, {.question = {.acted_on = {{5}}}});
  VectorX<T> q(count * nq), qd(count * nv), tau(count * nv), f = VectorX<T>::Zero(count * 6),
                                                             a(count * nv);
  for (int i = 0; i < count; ++i) {
    const State<T> s = random_state(model, i).template cast<T>();
    q.segment(i * nq, nq) = s.q, qd.segment(i * nv, nv) = s.qd, tau.segment(i * nv, nv) = s.tau;
  }
  f[6 * bad + 2] = std::numeric_limits<T>::quiet_NaN();
  std::vector<Outcome> outcomes(count);
  EXPECT_EQ(robot.forward_dynamics(q, qd, tau, a, outcomes, 1, {f}), 1);
  for (int i = 0; i < count; ++i)
    EXPECT_EQ(outcomes[i].status, i == bad ? Outcome::Status::not_finite : Outcome::Status::ok);
}

}  // namespace
}  // namespace kalmarm::test
