#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "accuracy/measures/measures.hpp"
#include "accuracy/truth/structured_condition.hpp"
#include "accuracy/truth/truth.hpp"
#include "algorithms/test/models.hpp"

namespace kalmarm {
namespace {

using test::Builder;
using test::Random;

// What truth depends on, and all of its numbers by name.
struct Problem {
  std::vector<Joint<double>> joints;
  int nq;
  Vector3<double> gravity;
  VectorX<double> q;
  Task<double> task;

  Problem(const Model<double>& model, VectorX<double> position, Task<double> asked)
      : nq(model.nq()), gravity(model.gravity()), q(std::move(position)), task(std::move(asked)) {
    for (int k = 0; k < model.nv(); ++k) joints.push_back(model.joint(k));
  }

  std::vector<double*> numbers() {
    std::vector<double*> out;
    const auto add = [&](auto& x) {
      for (double& entry : x.reshaped()) out.push_back(&entry);
    };
    for (Joint<double>& joint : joints) {
      RigidBody<double>& body = joint.body;
      for (double* x : {&joint.ref, &joint.r, &body.mass}) out.push_back(x);
      add(joint.rotation.coeffs());
      add(joint.translation);
      add(body.com);
      add(body.axes.coeffs());
      add(body.moments);
    }
    if (task.gravity) add(gravity);
    add(q);
    add(task.qd);
    add(task.value);
    return out;
  }

  Model<double> model() const {
    return {joints, std::vector<std::string>(joints.size()), nq, gravity};
  }
  Truth<double> answer(int draws = 0) const {
    return truth<double>(model(), q, {task}, {.draws = draws});
  }
};

// From every parameter alone, by solving again: signs are independent, so squares add up.
StructuredCondition solved_again(Problem problem) {
  const Truth<double> at = problem.answer();
  const Digits digits(at.digits);
  const VectorX<Real>& a = at.responses[0].a;
  const double step = 0x1p-20;
  Real sum = 0, energy_sum = 0;
  for (double* number : problem.numbers()) {
    const double value = *number;
    if (value == 0) continue;
    *number = value * (1 + step);
    const double above = *number;
    const VectorX<Real> plus = problem.answer().responses[0].a;
    *number = value * (1 - step);
    const double below = *number;
    const VectorX<Real> minus = problem.answer().responses[0].a;
    *number = value;
    const VectorX<Real> da = (plus - minus) * (Real(value) / (Real(above) - Real(below)));
    sum += da.squaredNorm();
    energy_sum += da.dot(at.M * da);
  }
  return {quotient(sqrt(sum), a.norm()), quotient(sqrt(energy_sum), sqrt(a.dot(at.M * a)))};
}

Model<double> slide_hinge_ball(std::uint64_t seed) {
  Random random(seed);
  Builder builder;
  Joint<double> slide = test::random_joint(random, -1, Coordinate::distance);
  slide.r = 0.3;
  int link = builder.add(slide);
  link = builder.add(test::random_joint(random, link));
  builder.add_ball(test::random_joint(random, link));
  return builder.build();
}

TEST(StructuredCondition, IsWhatSolvingAgainSays) {
  struct Row {
    Model<double> model;
    bool gravity;
  };
  for (const Row& row : {Row{slide_hinge_ball(1), true}, Row{slide_hinge_ball(2), false},
                         Row{test::planar_two_link(0), true}}) {
    const auto state = test::random_state(row.model, 5);
    const Problem problem(row.model, state.q, {state.tau, state.qd, Drive::torque, row.gravity});
    const StructuredCondition expected = solved_again(problem),
                              kS = problem.answer(1000).responses[0].kS;
    EXPECT_NEAR(kS.relative / expected.relative, 1, 0.1);
    EXPECT_NEAR(kS.energy / expected.energy, 1, 0.1);
  }
}

Joint<double> wheel(double moment, double armature) {
  Joint<double> joint;
  joint.body = {2, Vector3<double>::Zero(), {1, 0, 0, 0}, {0.3, 0.3, moment}};
  joint.r = armature;
  return joint;
}

StructuredCondition of(const Joint<double>& joint, const Vector3<double>& gravity, double tau,
                       int draws) {
  Builder builder;
  builder.add(joint);
  const VectorX<double> q = VectorX<double>::Constant(1, 0.7), qd = VectorX<double>::Zero(1);
  return Problem(builder.build(gravity), q, {VectorX<double>::Constant(1, tau), qd})
      .answer(draws)
      .responses[0]
      .kS;
}

// a = tau / (J + r): da/a = dtau/tau - (dJ + dr) / (J + r).
TEST(StructuredCondition, OfAWheelHasItsClosedForm) {
  for (const double r : {0.0, 0.5, 4.0}) {
    const double J = 0.5, expected = std::sqrt(1 + (J * J + r * r) / ((J + r) * (J + r)));
    const StructuredCondition kS = of(wheel(J, r), Vector3<double>::Zero(), 3, 4000);
    EXPECT_NEAR(kS.relative / expected, 1, 0.04);
    EXPECT_NEAR(kS.energy / kS.relative, 1, 1e-12);  // one joint: one norm
  }
}

// A weight that slides along gravity falls with g, whatever its mass.
TEST(StructuredCondition, OfFreeFallIsOne) {
  Joint<double> joint = wheel(0.5, 0);
  joint.slides = true;
  joint.coordinate = Coordinate::distance;
  EXPECT_NEAR(of(joint, {0, 0, -9.81}, 0, 1).relative, 1, 1e-12);
}

TEST(StructuredCondition, OfNothingIsZero) {
  const StructuredCondition kS = of(wheel(0.5, 0.1), Vector3<double>::Zero(), 0, 3);
  EXPECT_EQ(kS.relative, 0);
  EXPECT_EQ(kS.energy, 0);
}

// Units of mass and, by a power of two, of time change no digit of what is asked.
TEST(StructuredCondition, DoesNotDependOnUnits) {
  const Model<double> model = test::floating_base(2);
  const auto state = test::random_state(model, 2);
  Problem problem(model, state.q, {state.tau, state.qd});
  const StructuredCondition before = problem.answer(6).responses[0].kS;
  for (Joint<double>& joint : problem.joints) {
    joint.body.mass *= 0x1p30;
    joint.body.moments *= 0x1p30;
    joint.r *= 0x1p30;
  }
  problem.task.value *= 0x1p30 * 0x1p10;
  problem.task.qd *= 0x1p5;
  problem.gravity *= 0x1p10;
  const StructuredCondition after = problem.answer(6).responses[0].kS;
  EXPECT_NEAR(after.relative / before.relative, 1, 1e-12);
  EXPECT_NEAR(after.energy / before.energy, 1, 1e-12);
}

// kappa(M) grows as the fourth power of the length; what is random does not notice, and what is
// made from an acceleration does.
TEST(StructuredCondition, OfARandomTorqueIsNotTheConditionOfM) {
  const Model<double> model = test::straight_chain(64);
  Random random(1);
  const VectorX<double> zero = VectorX<double>::Zero(64);
  const auto t = truth<double>(
      model, zero,
      {{random.vector(64), zero, Drive::torque}, {random.vector(64), zero, Drive::acceleration}},
      {.draws = 6});
  EXPECT_LT(t.responses[0].kS.relative, 50);
  EXPECT_GT(t.responses[1].kS.relative, 1e4);
  EXPECT_LT(t.responses[1].kS.relative, condition(t.M, t.X).kappa);
}

// The filter as solver, and digits beyond those of the fixed type.
TEST(StructuredCondition, IsTheSameWithoutMatricesAndWithMoreDigits) {
  const Model<double> model = test::chain(3);
  const auto state = test::random_state(model, 3);
  const std::vector<Task<double>> tasks{{state.tau, state.qd}};
  const auto full = truth(model, state.q, tasks, {.draws = 6}),
             linear = truth(model, state.q, tasks, {.matrices = false, .draws = 6});
  const StructuredCondition kS = full.responses[0].kS;
  EXPECT_NEAR(linear.responses[0].kS.relative / kS.relative, 1, 1e-12);
  const Solve solve = [&](const VectorX<Real>& r) { return VectorX<Real>(full.X * r); };
  const auto more = structured_condition(model, state.q, tasks, full.responses, solve, 120, 6);
  EXPECT_NEAR(more[0].relative / kS.relative, 1, 1e-12);
  EXPECT_NEAR(more[0].energy / kS.energy, 1, 1e-12);
}

}  // namespace
}  // namespace kalmarm
