// Products of an implicit step's Jacobians with vectors, from either side: against differences of truth in 50 digits, each
// other, and what is built with a row's gains.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "algorithms/dynamics/test/door_support.hpp"
#include "algorithms/test/refusal.hpp"
#include "kalmarm/gradients.hpp"
#include "kalmarm/step_gradients.hpp"

namespace kalmarm::test {
namespace {

constexpr double h = 0.00390625;
constexpr Scheme schemes[] = {Scheme::springs_at_end, Scheme::springs_at_start};

template <class T>
class StepGradientsOf : public testing::Test {};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(StepGradientsOf, Precisions, PrecisionName);

template <class T>
using Rows = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Eighths, so that few bits of torques are lost. Some DoF have no damper, and some, and balls and free joints, no spring.
template <class T>
struct Gains {
  Rows<T> damping, stiffness, reference, armature;

  Gains(const Model<double>& model, int count, std::uint64_t seed)
      : damping(Rows<T>::Zero(count, model.nv())),
        stiffness(damping),
        reference(damping),
        armature(damping) {
    Random random(seed);
    const auto eighths = [&](double least, double most) {
      return static_cast<T>(std::round(8 * random.uniform(least, most)) / 8);
    };
    for (int i = 0; i < count; ++i)
      for (int k = 0; k < model.nv(); ++k) {
        if (k % 3 != 0) damping(i, k) = eighths(0, 40);
        if (is_single(model, k) && k % 4 != 1) stiffness(i, k) = eighths(0, 800);
        reference(i, k) = eighths(-1, 1);
        armature(i, k) = eighths(0, 1);
      }
  }

  GainRows<T> rows() const { return {damping, stiffness, reference, armature}; }
  JointTerms of(int row) const {
    const auto numbers = [row](const Rows<T>& x) {
      const VectorX<double> one = x.row(row).template cast<double>();
      return std::vector<double>(one.begin(), one.end());
    };
    return {numbers(damping), numbers(stiffness), numbers(reference)};
  }
};

// What a call fills, poisoned before.
template <class T>
struct Products {
  Rows<T> dq, dv, dtau, damping, stiffness, reference, inertias, armature, result;

  Products(int count, int n)
      : dq(poisoned<T>(count, n)),
        dv(dq),
        dtau(dq),
        damping(dq),
        stiffness(dq),
        reference(dq),
        inertias(poisoned<T>(count, 10 * n)),
        armature(dq),
        result(dq) {}

  RowsOfStepVectorJacobian<T> all() {
    return {.dq = dq,
            .dv = dv,
            .dtau = dtau,
            .damping = damping,
            .stiffness = stiffness,
            .reference = reference,
            .inertias = inertias,
            .armature = armature,
            .result = result};
  }
};

template <class T>
struct Batch {
  Rows<T> q, v, tau, w;
  std::vector<Outcome> outcomes;

  Batch(const Model<double>& model, int count, std::uint64_t seed)
      : q(count, model.nq()), v(count, model.nv()), tau(v), w(v), outcomes(count) {
    Random random(seed);
    for (int i = 0; i < count; ++i) {
      const State<T> state = random_state(model, seed + i).template cast<T>();
      q.row(i) = state.q;
      v.row(i) = state.qd;
      tau.row(i) = state.tau;
      w.row(i) = random.vector(model.nv()).template cast<T>();
    }
  }
};

// In 50 digits of the robot with the step's noise at the step's torque: (4) of implicit_step.hpp, and what a and lambda make
// of gains.
TYPED_TEST(StepGradientsOf, AgreeWithDifferencesOfTruth) {
  using T = TypeParam;
  const double u = static_cast<double>(unit_roundoff<T>());
  for (const Family& family : families_and_robots())
    for (const Scheme scheme : schemes) {
      SCOPED_TRACE(family.name);
      const Model<double> model = rounded<T>(family.make(3));
      const int n = model.nv();
      const double h_of_springs = scheme == Scheme::springs_at_end ? h : 0;
      const Gains<T> gains(model, 1, 4);
      Batch<T> batch(model, 1, 5);
      StepGradients<T> step(plain(model), h, gains.of(0), scheme);
      Products<T> by(1, n);
      ASSERT_EQ(
          step.acceleration_vjp(batch.q, batch.v, batch.tau, batch.w, by.all(), batch.outcomes), 0);

      const auto wide = [](const auto& x) {
        return x.row(0).template cast<double>().transpose().eval();
      };
      const VectorX<double> q = wide(batch.q), v = wide(batch.v), w = wide(batch.w),
                            b = wide(gains.damping), k = wide(gains.stiffness),
                            q0 = wide(gains.reference);
      VectorX<double> stretch = VectorX<double>::Zero(n);  // p
      RobotModel noisy = plain(model);
      for (int i = 0; i < n; ++i) {
        if (k[i] > 0) stretch[i] = q[model.joint(i).q_index] - q0[i] + h_of_springs * v[i];
        noisy.links[i].armature += h * (b[i] + h_of_springs * k[i]);
      }
      const VectorX<double> held = b.cwiseProduct(v) + k.cwiseProduct(stretch),
                            torque = wide(batch.tau) - held;
      const TrueDerivatives truth(model_of(noisy), State<double>{q, v, torque});
      const AccelerationDerivatives<double> exact = truth.rounded();
      const VectorX<double> lambda = exact.dtau * w, a = exact.a;

      const double bound = 4 * (40 + 2 * std::sqrt(truth.condition())), X = exact.dtau.norm();
      // What rounding of the step's torque moves comes on top.
      const double moved = 1 + X * held.norm() / a.norm();
      const auto expect = [&](const Rows<T>& x, const VectorX<double>& right, double size,
                              const char* name) {
        EXPECT_LE((wide(x) - right).norm(), bound * u * size * moved) << name;
      };
      const double sizes = (exact.a.norm() + X * (b.norm() + k.norm())) * w.norm();
      expect(by.dq, exact.dq.transpose() * w - k.cwiseProduct(lambda),
             sizes + exact.dq.norm() * w.norm(), "dq");
      expect(by.dv, exact.dqd.transpose() * w - (b + h_of_springs * k).cwiseProduct(lambda),
             sizes + exact.dqd.norm() * w.norm(), "dv");
      expect(by.dtau, lambda, X * w.norm(), "dtau");
      expect(by.reference, k.cwiseProduct(lambda), k.norm() * X * w.norm(), "reference");
      expect(by.result, a, a.norm(), "a");
      const VectorX<double> after = v + h * a;
      expect(by.damping, -lambda.cwiseProduct(after), lambda.norm() * (v.norm() + h * a.norm()),
             "damping");
      expect(by.armature, -lambda.cwiseProduct(a), lambda.norm() * a.norm(), "armature");
      for (int i = 0; i < n; ++i) {
        const double p =
            is_single(model, i) ? q[model.joint(i).q_index] - q0[i] + h_of_springs * after[i] : 0;
        EXPECT_NEAR(static_cast<double>(by.stiffness(0, i)), -lambda[i] * p,
                    bound * u * moved * lambda.norm() *
                        (std::abs(p) + std::abs(q0[i]) + 1 + h * (v.norm() + h * a.norm())))
            << i;
      }
    }
}

// <w, J x> = <J'w, x> over all that a step may be derived by, and rows have gains of their own.
TYPED_TEST(StepGradientsOf, ProductsFromEitherSideAreAdjoint) {
  using T = TypeParam;
  const int count = 11;
  for (const Family& family : families_and_robots())
    for (const Scheme scheme : schemes) {
      SCOPED_TRACE(family.name);
      const Model<double> model = rounded<T>(family.make(6));
      const int n = model.nv();
      const Gains<T> gains(model, count, 7), along(model, count, 8);
      Batch<T> batch(model, count, 9);
      const Batch<T> directions(model, count, 10), more(model, count, 11);
      StepGradients<T> step(plain(model), h, {}, scheme);
      Products<T> by(count, n);
      ASSERT_EQ(step.acceleration_vjp(batch.q, batch.v, batch.tau, batch.w, by.all(),
                                      batch.outcomes, 1, gains.rows()),
                0);
      Rows<T> da = poisoned<T>(count, n);
      ASSERT_EQ(step.acceleration_jvp(batch.q, batch.v, batch.tau, directions.v, directions.w,
                                      more.tau, da, batch.outcomes, 1, gains.rows(), along.rows()),
                0);
      const double u = static_cast<double>(unit_roundoff<T>());
      for (int i = 0; i < count; ++i) {
        double sum = 0, size = 0;
        const auto add = [&](const Rows<T>& x, const Rows<T>& y, double sign) {
          const VectorX<double> one = x.row(i).template cast<double>(),
                                other = y.row(i).template cast<double>();
          sum += sign * one.dot(other);
          size += one.norm() * other.norm();
        };
        add(by.dq, directions.v, 1);
        add(by.dv, directions.w, 1);
        add(by.dtau, more.tau, 1);
        add(by.damping, along.damping, 1);
        add(by.stiffness, along.stiffness, 1);
        add(by.reference, along.reference, 1);
        add(by.armature, along.armature, 1);
        add(batch.w, da, -1);
        // As far as both answers may be wrong.
        EXPECT_LE(std::abs(sum), (4000 * u + 20 * batch.outcomes[i].error) * size) << i;
      }
    }
}

// To rounding, whatever the threads; and a call without gains of rows is of the step's own.
TYPED_TEST(StepGradientsOf, RowsWithGainsAreAsARobotThatIsBuiltWithThem) {
  using T = TypeParam;
  const int count = 70;
  for (const Family& family : families_and_robots()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = rounded<T>(family.make(12));
    const int n = model.nv();
    const Gains<T> gains(model, count, 13);
    Batch<T> batch(model, count, 14);
    StepGradients<T> step(plain(model), h, {});
    Products<T> rows(count, n), threaded(count, n);
    ASSERT_EQ(step.acceleration_vjp(batch.q, batch.v, batch.tau, batch.w, threaded.all(),
                                    batch.outcomes, 3, gains.rows()),
              0);
    ASSERT_EQ(step.acceleration_vjp(batch.q, batch.v, batch.tau, batch.w, rows.all(),
                                    batch.outcomes, 1, gains.rows()),
              0);
    for (const auto member : {&Products<T>::dq, &Products<T>::dv, &Products<T>::dtau,
                              &Products<T>::stiffness, &Products<T>::inertias})
      EXPECT_EQ(rows.*member, threaded.*member);
    for (const int i : {0, count - 1}) {
      RobotModel robot = plain(model);
      for (int k = 0; k < n; ++k)
        robot.links[k].armature = static_cast<double>(gains.armature(i, k));
      StepGradients<T> one(robot, h, gains.of(i));
      VectorX<T> dq = poisoned<T>(n), dv(dq), dtau(dq), a(dq), stiffness(dq);
      const auto of = [i](const Rows<T>& x) { return VectorX<T>(x.row(i)); };
      const VectorX<T> q = of(batch.q), v = of(batch.v), tau = of(batch.tau), w = of(batch.w);
      const Outcome outcome = one.acceleration_vjp(
          q, v, tau, w, {.dq = dq, .dv = dv, .dtau = dtau, .stiffness = stiffness, .result = a});
      ASSERT_TRUE(outcome);
      const double tolerance = 10 * (outcome.error + batch.outcomes[i].error +
                                     2000 * static_cast<double>(unit_roundoff<T>()));
      const auto apart = [&](const Rows<T>& x, const VectorX<T>& y) {
        return static_cast<double>((of(x) - y).norm() / (y.norm() + T(1e-30)));
      };
      EXPECT_LE(apart(rows.dq, dq), tolerance);
      EXPECT_LE(apart(rows.dv, dv), tolerance);
      EXPECT_LE(apart(rows.dtau, dtau), tolerance);
      EXPECT_LE(apart(rows.result, a), tolerance);
      EXPECT_LE(apart(rows.stiffness, stiffness), tolerance);
    }
  }
}

// What hangs on the robot is in M^ of both halves, and what acts from outside in a alone.
TYPED_TEST(StepGradientsOf, ForcesAndLoadsAreGivenAndDerivedBy) {
  using T = TypeParam;
  const Model<double> model = rounded<T>(floating_base(15));
  const int n = model.nv();
  const int last = end_of_joint(model, n - 1);
  const Question question{.acted_on = {{last, {1, 0, 0, 0}, {0.25, 0, 0}}}, .loaded = {{last}}};
  const State<T> state = random_state(model, 16).template cast<T>();
  Random random(17);
  const VectorX<T> w = random.vector(n).template cast<T>(), f = random.vector(6).template cast<T>();
  VectorX<T> load(10);
  load << T(1.25), T(.125), T(.25), T(-.25), T(.5), T(.625), T(.75), T(.03125), T(.0625), T(.03125);
  const StateForces<T> given{
      .on = VectorView<const T>(f), .axes = Axes::local, .loads = VectorView<const T>(load)};
  // Without terms a step is forward dynamics.
  StepGradients<T> step(plain(model), h, {}, Scheme::springs_at_end, {.question = question});
  Gradients<T> robot(plain(model), {.question = question});
  VectorX<T> of_step[4], of_robot[4];
  for (VectorX<T>* const x : {of_step, of_robot})
    for (int i = 0; i < 4; ++i) x[i] = poisoned<T>(i < 2 ? n : i == 2 ? 6 : 10);
  ASSERT_TRUE(step.acceleration_vjp(
      state.q, state.qd, state.tau, w,
      {.dq = of_step[0], .dtau = of_step[1], .forces = of_step[2], .loads = of_step[3]}, given));
  ASSERT_TRUE(robot.forward_dynamics_vjp(
      state.q, state.qd, state.tau, w,
      {.dq = of_robot[0], .dtau = of_robot[1], .forces = of_robot[2], .loads = of_robot[3]},
      given));
  for (int i = 0; i < 4; ++i)
    EXPECT_TRUE(of_step[i].isApprox(of_robot[i], 400 * unit_roundoff<T>())) << i;
}

TYPED_TEST(StepGradientsOf, AFailureStaysInItsRow) {
  using T = TypeParam;
  const Model<double> model = floating_base(18);
  const int n = model.nv(), count = 40;
  Batch<T> batch(model, count, 19);
  batch.q(7, 9) = batch.w(21, 2) = std::numeric_limits<T>::quiet_NaN();
  StepGradients<T> step(plain(model), h, {.damping = std::vector<double>(n, 0.5)});
  Products<T> by(count, n);
  EXPECT_EQ(step.acceleration_vjp(batch.q, batch.v, batch.tau, batch.w, by.all(), batch.outcomes),
            2);
  for (int i = 0; i < count; ++i) {
    EXPECT_EQ(bool(batch.outcomes[i]), i != 7 && i != 21) << i;
    EXPECT_EQ(by.dq.row(i).allFinite() && by.damping.row(i).allFinite(), i != 7 && i != 21) << i;
  }
}

TEST(StepGradientsRefusals, NameWhatIsWrong) {
  const RobotModel robot = plain(chain(20, 3));
  EXPECT_EQ(message_of([&] {
              StepGradients<double>(robot, h, {.rows = {{.jacobian = {1, 1, 0}}}});
            }),
            "step gradients: of terms that couple joints");
  EXPECT_EQ(message_of([&] {
              StepGradients<double>(robot, h, {}, Scheme::springs_at_end,
                                    {.question = {.acted_on = {{-1}}}});
            }),
            "step gradients: a frame on the fixed base, where forces and loads do nothing");
  StepGradients<double> step(robot, h, {});
  const VectorX<double> x = VectorX<double>::Zero(3), two = VectorX<double>::Zero(2);
  VectorX<double> out(3);
  EXPECT_EQ(message_of([&] { (void)step.acceleration_vjp(x, x, x, two, {.dq = out}); }),
            "acceleration_vjp: w has size 1 x 2, 1 x 3 is needed");
  const Rows<double> rows = Rows<double>::Zero(2, 3), short_rows = Rows<double>::Zero(1, 3);
  Rows<double> da(2, 3);
  std::vector<Outcome> outcomes(2);
  EXPECT_EQ(message_of([&] {
              static_cast<void>(step.acceleration_jvp(rows, rows, rows, rows, rows, rows, da,
                                                      outcomes, 1, {.damping = short_rows}));
            }),
            "acceleration_jvp: damping has size 1 x 3, 2 x 3 is needed");
  StepGradients<double> taken = std::move(step);
  EXPECT_THROW((void)step.acceleration_vjp(x, x, x, x, {.dq = out}), std::logic_error);
  EXPECT_TRUE(taken.acceleration_vjp(x, x, x, x, {.dq = out}));
}

}  // namespace
}  // namespace kalmarm::test
