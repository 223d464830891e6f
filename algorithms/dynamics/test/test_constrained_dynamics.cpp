// Constrained dynamics against its definition in 50 digits, closed forms and what physics keeps; and what it refuses.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "algorithms/dynamics/test/constrained_truth.hpp"
#include "algorithms/dynamics/test/door_support.hpp"
#include "kalmarm/constrained_dynamics.hpp"
#include "kalmarm/model_builder.hpp"

namespace kalmarm::test {
namespace {

using Kind = Constraint::Kind;
using std::numbers::pi;

// The last joints of a robot of one DoF.
std::vector<int> single_dofs(const Model<double>& model) {
  std::vector<int> out;
  for (int k = 0; k < model.nv(); ++k)
    if (is_single(model, k)) out.push_back(k);
  return out;
}

// The link with most joints between it and the base.
int deepest(const Model<double>& model) {
  std::vector<int> depth;
  for (int k = 0; k < model.nv(); ++k)
    depth.push_back(model.parent(k) < 0 ? 0 : depth[model.parent(k)] + 1);
  return static_cast<int>(std::max_element(depth.begin(), depth.end()) - depth.begin());
}

// A pose against the base, a gear that is not linear, and a point between two links, each with its own k and b.
std::vector<Constraint> some_of_each(const Model<double>& model) {
  const int nv = model.nv(), tip = end_of_joint(model, deepest(model));
  std::vector<Constraint> out = {{.name = "pose",
                                  .kind = Kind::pose,
                                  .first = {tip, {1, 0.2, -0.3, 0.1}, {0.1, 0, 0.2}},
                                  .second = {-1, {0.3, 1, 0, 0.2}, {0.4, 0.1, 0.3}},
                                  .turning = 0.7,
                                  .stiffness = 100,
                                  .damping = 20}};
  const std::vector<int> single = single_dofs(model);
  Constraint gear = {.name = "gear", .kind = Kind::coupling, .stiffness = 400, .damping = 5};
  gear.jacobian.assign(nv, 0);
  gear.other.assign(nv, 0);
  gear.jacobian[single[0]] = 1;
  gear.other[single[1]] = -0.5;
  gear.other[single[2]] = 2;
  gear.reference = 0.3;
  gear.polynomial = {0.1, 1.5, -0.4, 0.2, 0.05};
  out.push_back(gear);
  out.push_back({.name = "point",
                 .first = {end_of_joint(model, nv / 2), {1, 0, 0, 0}, {0.2, 0, 0}},
                 .second = {tip, {1, 0, 0, 0}, {0, 0.1, 0}},
                 .stiffness = 25,
                 .damping = 4});
  return out;
}

// Of |is - should|_M / |should|_M.
template <class T>
double energy_error(const ConstrainedTruth& truth, const VectorX<T>& a) {
  const VectorX<double> d = a.template cast<double>() - truth.a;
  return std::sqrt(d.dot(truth.M * d) / truth.a.dot(truth.M * truth.a));
}

template <class T>
class Constrained : public testing::Test {};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Constrained, Precisions, PrecisionName);

// Exact and soft, of a fixed arm, a free trunk with limbs and what has every kind of joint.
TYPED_TEST(Constrained, AccelerationsAndForcesAreThoseOfTheDefinition) {
  using T = TypeParam;
  const double u = static_cast<double>(unit_roundoff<T>());
  for (const auto& make : {&creature, &everything})
    for (int seed = 1; seed < 3; ++seed)
      for (const double R : {0.0, 0.3}) {
        const Model<double> model = rounded<T>(make(seed));
        std::vector<Constraint> constraints = some_of_each(model);
        for (Constraint& c : constraints) c.compliance = {R, 2 * R};
        const State<double> state = rounded<T>(random_state(model, seed));
        const ConstrainedTruth truth = constrained_truth(model, state, constraints);
        ConstrainedDynamics<T> robot(plain(model), constraints);
        const int nv = model.nv(), m = robot.rows();
        const State<T> s = state.template cast<T>();
        VectorX<T> a = poisoned<T>(nv), forces = poisoned<T>(m), e(m), rate(m);
        const Outcome outcome = robot.forward_dynamics(s.q, s.qd, s.tau, a, forces);
        ASSERT_TRUE(outcome) << robot.name_of(outcome);
        const double error = energy_error(truth, a);
        EXPECT_LE(error, std::max(2 * outcome.error, 4 * u)) << seed;
        EXPECT_LE(error, 1e5 * u) << seed;
        EXPECT_LE(outcome.error, 1e7 * u) << seed;
        EXPECT_LE((forces.template cast<double>() - truth.forces).norm(),
                  1e6 * u * truth.forces.norm());
        robot.evaluate(s.q, s.qd, {.error = e, .rate = rate});
        EXPECT_LE((e.template cast<double>() - truth.e).norm(), 50 * u * (1 + truth.e.norm()));
        EXPECT_LE((rate.template cast<double>() - truth.rate).norm(),
                  100 * u * (1 + truth.rate.norm()));
      }
}

// On a link that the constraints leave free, in every axes, and on the base, where they do nothing; of rows each its own.
TYPED_TEST(Constrained, ForcesFromOutsideMoveItAsTheirTorquesDo) {
  using T = TypeParam;
  const double u = static_cast<double>(unit_roundoff<T>());
  const Model<double> model = rounded<T>(creature(2));
  const std::vector<Constraint> constraints = some_of_each(model);
  const int nv = model.nv(), count = 70;
  const int limb = end_of_joint(model, nv / 3);
  Push push{{{limb, {1, 0.2, -0.3, 0.1}, {0.1, 0, 0.2}}, {-1, {1, 0, 0, 0}, {1, 0, 0}}},
            rounded<float>(VectorX<double>(20 * Random(3).vector(12)))};
  ConstrainedDynamics<T> robot(plain(model), constraints, {.acted_on = push.frames});
  const State<double> state = rounded<T>(random_state(model, 2));
  const State<T> s = state.template cast<T>();
  const int m = robot.rows();
  for (const Axes axes : {Axes::local, Axes::world, Axes::aligned}) {
    push.axes = axes;
    const ConstrainedTruth truth = constrained_truth(model, state, constraints, push);
    const VectorX<T> f = push.forces.cast<T>();
    VectorX<T> a = poisoned<T>(nv), forces = poisoned<T>(m);
    const Outcome outcome = robot.forward_dynamics(s.q, s.qd, s.tau, a, forces, {f, axes});
    ASSERT_TRUE(outcome) << robot.name_of(outcome);
    EXPECT_LE(energy_error(truth, a), std::max(2 * outcome.error, 4 * u));
    EXPECT_LE(energy_error(truth, a), 1e5 * u);
    EXPECT_LE((forces.template cast<double>() - truth.forces).norm(),
              1e6 * u * truth.forces.norm());

    VectorX<T> q = s.q.replicate(count, 1), qd = s.qd.replicate(count, 1),
               tau = s.tau.replicate(count, 1), acting = VectorX<T>::Zero(12 * count),
               many = poisoned<T>(count * nv), of_many = poisoned<T>(count * m);
    acting.segment(12 * 66, 12) = f;  // beyond the rows that are answered together
    std::vector<Outcome> outcomes(count);
    ASSERT_EQ(robot.forward_dynamics(q, qd, tau, many, of_many, outcomes, 1, {acting, axes}), 0);
    const auto close = [&](int row, const VectorX<T>& to) {
      const double missed = static_cast<double>((many.segment(row * nv, nv) - to).norm());
      EXPECT_LE(missed, 20 * (outcomes[row].error + 1e-13) * static_cast<double>(to.norm())) << row;
    };
    close(66, a);
    const VectorX<T> pushed = a;
    ASSERT_TRUE(robot.forward_dynamics(s.q, s.qd, s.tau, a, forces));  // none
    EXPECT_GE((pushed - a).norm(), 0.1 * a.norm());
    close(65, a);
    close(67, a);
  }
  VectorX<T> a(nv), forces(m), few(6);
  EXPECT_THROW((void)robot.forward_dynamics(s.q, s.qd, s.tau, a, forces, {few, Axes::local}),
               std::invalid_argument);
}

// J' lambda is what the torques lack, and so lambda' e' the power of the constraints.
TEST(Constrained, ForcesDoTheWorkOfTheTorquesThatTheyStandFor) {
  const Model<double> model = creature(7);
  const State<double> s = random_state(model, 8);
  ConstrainedDynamics<double> robot(plain(model), some_of_each(model));
  const int nv = model.nv(), m = robot.rows();
  VectorX<double> a(nv), forces(m), rate(m), torque(nv);
  MatrixX<double> Jt(nv, m);
  ASSERT_TRUE(robot.forward_dynamics(s.q, s.qd, s.tau, a, forces));
  robot.evaluate(s.q, s.qd, {.rate = rate, .jacobian = Jt});
  Dynamics<double>(plain(model)).inverse_dynamics(s.q, s.qd, a, torque);
  const double size = torque.norm() + s.tau.norm();
  EXPECT_LE((torque - s.tau - Jt * forces).norm(), 1e-12 * size);
  EXPECT_NEAR(s.qd.dot(torque - s.tau), forces.dot(rate), 1e-11 * size * s.qd.norm());
}

// A four-bar in the plane of x and y: crank, coupler and rocker, closed at the rocker's end, which slides out of the plane
// where `slides`; else the loop's row out of the plane repeats what the joints say.
struct FourBar {
  static constexpr double m1 = 0.8, m2 = 1.1, m3 = 0.6, gravity = 9.81;
  double a, b, c, d;  // lengths: crank, coupler, rocker, base
  double pin;         // mass of what slides
  RobotModel model;
  std::vector<Constraint> loop;

  FourBar(double crank, double coupler, double rocker, double base, bool slides)
      : a(crank), b(coupler), c(rocker), d(base), pin(slides ? 0.05 : 0) {
    ModelBuilder builder;
    builder.set_gravity({0, -gravity, 0});
    const auto bar = [&](const char* name, int parent, double at, double mass, double length) {
      const double I = mass * length * length / 12;
      return builder.add_body({.name = name,
                               .parent = parent,
                               .joint = JointType::hinge,
                               .position = {at, 0, 0},
                               .mass = mass,
                               .center_of_mass = {length / 2, 0, 0},
                               .inertia = {1e-4, I, I, 0, 0, 0},
                               .solid = false});
    };
    const int one = bar("crank", -1, 0, m1, a), two = bar("coupler", one, a, m2, b),
              three = bar("rocker", -1, d, m3, c);
    int end = three;
    if (slides)
      end = builder.add_body({.name = "pin",
                              .parent = three,
                              .joint = JointType::slide,
                              .position = {c, 0, 0},
                              .mass = pin});
    model = builder.build();
    Frame tip = builder.frame(two), at_end = builder.frame(end);
    tip.translation = {b, 0, 0};
    at_end.translation = {slides ? 0 : c, 0, 0};
    loop = {{.name = "pin", .first = tip, .second = at_end}};
  }

  // Angles of the joints where the crank stands at theta, the coupler above; and their rates for a crank's of one.
  VectorX<double> q(double theta) const {
    const double x = d - a * std::cos(theta), y = -a * std::sin(theta), r = std::hypot(x, y);
    const double at_tip = std::acos((b * b + r * r - c * c) / (2 * b * r));
    const double coupler = std::atan2(y, x) + at_tip;
    const double px = a * std::cos(theta) + b * std::cos(coupler) - d,
                 py = a * std::sin(theta) + b * std::sin(coupler);
    VectorX<double> out = VectorX<double>::Zero(model.nq);
    out.head(3) << theta, coupler - theta, std::atan2(py, px);
    return out;
  }
  // Central differences of the closed form.
  VectorX<double> rates(double theta) const {
    const double h = 1e-5;
    return (8 * (q(theta + h) - q(theta - h)) - (q(theta + 2 * h) - q(theta - 2 * h))) / (12 * h);
  }

  double kinetic(double theta, double rate) const {
    const VectorX<double> w = rates(theta) * rate;
    const double phi = q(theta)[0] + q(theta)[1], w2 = w[0] + w[1];
    const double vx = -a * std::sin(theta) * w[0] - b / 2 * std::sin(phi) * w2,
                 vy = a * std::cos(theta) * w[0] + b / 2 * std::cos(phi) * w2;
    return (m1 * a * a / 3 * w[0] * w[0] + (m3 / 3 + pin) * c * c * w[2] * w[2] +
            m2 * (b * b / 12 * w2 * w2 + vx * vx + vy * vy)) /
           2;
  }
  double potential(double theta) const {
    const VectorX<double> at = q(theta);
    return gravity * (m1 * a / 2 * std::sin(at[0]) +
                      m2 * (a * std::sin(at[0]) + b / 2 * std::sin(at[0] + at[1])) +
                      (m3 / 2 + pin) * c * std::sin(at[2]));
  }
  // theta'' of Lagrange's equation of the one coordinate, with a torque at the crank.
  double acceleration(double theta, double rate, double tau) const {
    const double h = 1e-4;
    const auto slope = [&](const auto& f) { return (f(theta + h) - f(theta - h)) / (2 * h); };
    const double mass = 2 * kinetic(theta, 1);
    const double mass_slope = slope([&](double x) { return 2 * kinetic(x, 1); });
    const double weight = slope([&](double x) { return potential(x); });
    return (tau - weight - mass_slope * rate * rate / 2) / mass;
  }
};

TEST(FourBars, MoveByTheirClosedForm) {
  for (const bool slides : {true, false}) {
    const FourBar bars(0.3, 0.7, 0.5, 0.6, slides);
    ConstrainedDynamics<double> robot(bars.model, bars.loop, {.proximal = slides ? 0 : 1e-8});
    for (const double theta : {0.4, 1.3, 2.7, 4.0, 5.5}) {
      const double rate = 1.7, tau = 0.4;
      const VectorX<double> q = bars.q(theta);
      VectorX<double> qd = bars.rates(theta) * rate, t = VectorX<double>::Zero(qd.size());
      VectorX<double> a(qd.size()), forces(3), e(3);
      t[0] = tau;
      robot.evaluate(q, {.error = e});
      EXPECT_LE(e.norm(), 1e-15);
      const Outcome outcome = robot.forward_dynamics(q, qd, t, a, forces);
      ASSERT_TRUE(outcome);
      EXPECT_LE(outcome.error, 1e-6);  // rates close to 1e-10
      const double truth = bars.acceleration(theta, rate, tau);
      EXPECT_NEAR(a[0], truth, 1e-5 * std::abs(truth) + 1e-6) << theta;
    }
  }
}

// Where all bars lie on one line, the loop leaves two motions, and its rows say that they depend on each other.
TEST(FourBars, AreSingularAtTheirDeadPointsAndNowhereElse) {
  const FourBar bars(0.3, 0.5, 0.3, 0.5, true);  // flat at 0
  ConstrainedDynamics<double> robot(bars.model, bars.loop);
  const VectorX<double> zero = VectorX<double>::Zero(4);
  VectorX<double> a(4), forces(3);
  double before = 1;
  for (const double theta : {1.0, 1e-2, 1e-4}) {
    VectorX<double> q = zero;
    q[0] = q[2] = theta;
    q[1] = -theta;  // a parallelogram
    const Outcome outcome = robot.forward_dynamics(q, zero, zero, a, forces);
    ASSERT_TRUE(outcome) << theta;
    EXPECT_LT(outcome.D / outcome.scale, before);
    before = 1e-2 * outcome.D / outcome.scale;
  }
  const Outcome outcome = robot.forward_dynamics(zero, zero, zero, a, forces);
  EXPECT_EQ(outcome.status, Outcome::Status::singular);
  EXPECT_EQ(robot.name_of(outcome), "pin");
  EXPECT_TRUE(a.array().isNaN().all());
}

// By steps of Runge and Kutta's fourth order.
TEST(FourBars, KeepTheirEnergyAndStayClosed) {
  const FourBar bars(0.3, 0.7, 0.5, 0.6, false);
  std::vector<Constraint> loop = bars.loop;
  loop[0].stiffness = 400, loop[0].damping = 40;
  ConstrainedDynamics<double> robot(bars.model, loop, {.proximal = 1e-8});
  VectorX<double> q = bars.q(1), qd = bars.rates(1) * 2, forces(3), e(3);
  const VectorX<double> zero = VectorX<double>::Zero(3);
  const double energy = bars.kinetic(1, 2) + bars.potential(1), h = 1e-3;
  const auto rate = [&](const VectorX<double>& at, const VectorX<double>& v) {
    VectorX<double> a(3);
    EXPECT_TRUE(robot.forward_dynamics(at, v, zero, a, forces));
    return a;
  };
  for (int step = 0; step < 1000; ++step) {
    const VectorX<double> a1 = rate(q, qd), v2 = qd + h / 2 * a1, a2 = rate(q + h / 2 * qd, v2),
                          v3 = qd + h / 2 * a2, a3 = rate(q + h / 2 * v2, v3), v4 = qd + h * a3,
                          a4 = rate(q + h * v3, v4);
    q += h / 6 * (qd + 2 * v2 + 2 * v3 + v4);
    qd += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
  }
  robot.evaluate(q, {.error = e});
  EXPECT_LE(e.norm(), 1e-9);
  EXPECT_NEAR(bars.kinetic(q[0], qd[0]) + bars.potential(q[0]), energy, 1e-7 * std::abs(energy));
}

TEST(Constrained, ImpulsesLeaveVelocitiesThatTheConstraintsAllowAndTakeNoMoreEnergyThanNeeded) {
  const Model<double> model = creature(4);
  const State<double> s = random_state(model, 5);
  ConstrainedDynamics<double> robot(plain(model), some_of_each(model));
  const int nv = model.nv(), m = robot.rows();
  VectorX<double> after(nv), again(nv), impulses(m), none(m), rate(m);
  MatrixX<double> Jt(nv, m), M(nv, nv);
  const Outcome outcome = robot.impulse(s.q, s.qd, after, impulses);
  ASSERT_TRUE(outcome);
  EXPECT_LE(outcome.error, 1e-9);
  robot.evaluate(s.q, after, {.rate = rate, .jacobian = Jt});
  EXPECT_LE(rate.norm(), 1e-13 * s.qd.norm());
  Dynamics<double>(plain(model)).mass(s.q, M);
  EXPECT_LE((M * (after - s.qd) - Jt * impulses).norm(), 1e-11 * (M * s.qd).norm());
  // What is lost is the energy of the change, as it is of no other change to an allowed velocity.
  const VectorX<double> change = s.qd - after;
  EXPECT_NEAR(s.qd.dot(M * s.qd), after.dot(M * after) + change.dot(M * change),
              1e-12 * s.qd.dot(M * s.qd));
  ASSERT_TRUE(robot.impulse(s.q, after, again, none));
  EXPECT_LE((again - after).norm(), 1e-12 * after.norm());
}

TEST(Constrained, SoftRowsSolveTheMassMatrixWithTheirInertia) {
  const Model<double> model = creature(4);
  const State<double> s = random_state(model, 5);
  const int nv = model.nv();
  for (const double d : {1e-2, 1.0, 1e4}) {
    std::vector<Constraint> constraints = some_of_each(model);
    for (Constraint& c : constraints) c.compliance = {1 / d, 1 / d};
    ConstrainedDynamics<double> robot(plain(model), constraints);
    const int m = robot.rows();
    VectorX<double> x(nv), forces(m);
    MatrixX<double> Jt(nv, m), M(nv, nv);
    ASSERT_TRUE(robot.solve(s.q, s.tau, x, forces)) << d;
    robot.evaluate(s.q, {.jacobian = Jt});
    Dynamics<double>(plain(model)).mass(s.q, M);
    using Long = MatrixX<long double>;
    const Long J = Jt.cast<long double>(), H = M.cast<long double>() + d * J * J.transpose();
    const VectorX<long double> truth = H.ldlt().solve(s.tau.cast<long double>());
    EXPECT_LE((x.cast<long double>() - truth).norm(), 1e-10 * truth.norm()) << d;
    EXPECT_LE((forces + d * Jt.transpose() * x).norm(), 1e-6 * forces.norm()) << d;
  }
}

// Twice the same constraint: its second name where rows have to be independent, and with the proximal method the same
// accelerations by half the force each.
TEST(Constrained, RepeatedRowsAreNamedOrShareTheirForce) {
  const Model<double> model = creature(4);
  const State<double> s = random_state(model, 5);
  const int nv = model.nv();
  std::vector<Constraint> once = some_of_each(model), twice = once;
  twice.push_back(once[0]);
  twice.back().name = "again";
  VectorX<double> a(nv), b(nv), one(10), two(16);
  ASSERT_TRUE(
      ConstrainedDynamics<double>(plain(model), once).forward_dynamics(s.q, s.qd, s.tau, a, one));
  ConstrainedDynamics<double> repeated(plain(model), twice);
  const Outcome outcome = repeated.forward_dynamics(s.q, s.qd, s.tau, b, two);
  EXPECT_EQ(outcome.status, Outcome::Status::singular);
  EXPECT_EQ(repeated.name_of(outcome), "again");
  EXPECT_TRUE(b.array().isNaN().all() && two.array().isNaN().all());
  for (const double mu : {1e-4, 1e-8}) {
    ConstrainedDynamics<double> robot(plain(model), twice, {.proximal = mu});
    const Outcome solved = robot.forward_dynamics(s.q, s.qd, s.tau, b, two);
    ASSERT_TRUE(solved) << mu;
    EXPECT_LE(solved.error, 1e-8);
    EXPECT_LE((a - b).norm(), 1e-11 * a.norm()) << mu;
    EXPECT_LE((two.head(6) - two.tail(6)).norm(), 1e-6 * two.norm());
    EXPECT_LE((two.head(6) + two.tail(6) - one.head(6)).norm(), 1e-7 * one.norm()) << mu;
  }
}

TEST(Constrained, ContradictingRowsAreRefusedByName) {
  const Model<double> model = creature(4);
  const State<double> s = random_state(model, 5);
  const int nv = model.nv();
  std::vector<Constraint> constraints = some_of_each(model);
  constraints.push_back(constraints[1]);
  constraints.back().name = "otherwise";
  constraints.back().stiffness = constraints.back().damping = 0;
  VectorX<double> a(nv), forces(11);
  for (const double mu : {0.0, 1e-8}) {
    ConstrainedDynamics<double> robot(plain(model), constraints, {.proximal = mu});
    const Outcome outcome = robot.forward_dynamics(s.q, s.qd, s.tau, a, forces);
    EXPECT_EQ(outcome.status, Outcome::Status::singular) << mu;
    const std::string name = robot.name_of(outcome);
    EXPECT_TRUE(name == "otherwise" || (mu > 0 && name == "gear")) << name;
    EXPECT_TRUE(a.array().isNaN().all());
  }
}

// A constraint that no joint moves holds nothing, however it is solved.
TEST(Constrained, RowsThatNothingMovesAreRefusedByName) {
  const FourBar bars(0.3, 0.7, 0.5, 0.6, false);
  std::vector<Constraint> constraints = bars.loop;
  Constraint hinge = {.name = "hinge"};
  hinge.first = {0};  // the crank's axis
  constraints.push_back(hinge);
  const VectorX<double> zero = VectorX<double>::Zero(3);
  VectorX<double> a(3), forces(6);
  ConstrainedDynamics<double> robot(bars.model, constraints, {.proximal = 1e-8});
  const Outcome outcome = robot.forward_dynamics(bars.q(1), zero, zero, a, forces);
  EXPECT_EQ(outcome.status, Outcome::Status::singular);
  EXPECT_EQ(robot.name_of(outcome), "hinge");
}

TYPED_TEST(Constrained, RowsAnswerAsStatesDoAndDisturbEachOtherNowhere) {
  using T = TypeParam;
  const Model<double> model = rounded<T>(creature(3));
  const int nv = model.nv(), nq = model.nq(), count = 150, bad = 70;
  ConstrainedDynamics<T> robot(plain(model), some_of_each(model));
  const int m = robot.rows();
  using RowMajor = Eigen::Matrix<T, -1, -1, Eigen::RowMajor>;
  RowMajor q(count, nq), qd(count, nv), tau(count, nv);
  for (int i = 0; i < count; ++i) {
    const State<T> s = random_state(model, i).template cast<T>();
    q.row(i) = s.q.transpose(), qd.row(i) = s.qd.transpose(), tau.row(i) = s.tau.transpose();
  }
  qd(bad, 1) = std::numeric_limits<T>::quiet_NaN();
  std::vector<Outcome> outcomes(count), others(count);
  RowMajor a = RowMajor::Zero(count, nv), forces = RowMajor::Zero(count, m), b = a, f = forces;
  const int failed = robot.forward_dynamics(q, qd, tau, a, forces, outcomes);
  EXPECT_EQ(robot.forward_dynamics(q, qd, tau, b, f, others, 3), failed);
  EXPECT_LE(failed, count / 10);  // float32 refuses some
  EXPECT_EQ(outcomes[bad].status, Outcome::Status::not_finite);
  EXPECT_TRUE(a.row(bad).array().isNaN().all() && forces.row(bad).array().isNaN().all());
  for (int i = 0; i < count; ++i) {
    if (!outcomes[i]) continue;
    EXPECT_TRUE(a.row(i) == b.row(i) && forces.row(i) == f.row(i)) << i;
    const VectorX<T> at = q.row(i), v = qd.row(i), t = tau.row(i);
    VectorX<T> alone(nv), alone_forces(m);
    ASSERT_TRUE(robot.forward_dynamics(at, v, t, alone, alone_forces));
    const double scale = static_cast<double>(alone.norm());
    EXPECT_LE(static_cast<double>((alone - a.row(i).transpose()).norm()),
              20 * (outcomes[i].error + 1e-13) * scale)
        << i;
  }
  EXPECT_LE(robot.impulse(q, tau, a, forces, outcomes), count / 10);
  EXPECT_LE(robot.solve(q, tau, b, f, outcomes), count / 10);
  VectorX<T> x(nv), one(m);
  ASSERT_TRUE(robot.solve(VectorX<T>(q.row(7)), VectorX<T>(tau.row(7)), x, one));
  EXPECT_LE(static_cast<double>((x - b.row(7).transpose()).norm()),
            1e4 * static_cast<double>(unit_roundoff<T>() * x.norm()));
}

TEST(Constrained, BadInputIsRefusedInOneLineWithTheNameAndTheValue) {
  const Model<double> model = creature(4);
  const RobotModel robot = plain(model);
  const auto message = [&](const std::function<void(Constraint&)>& spoil, int which = 0,
                           const ConstrainedOptions& options = {}) -> std::string {
    std::vector<Constraint> constraints = some_of_each(model);
    spoil(constraints[which]);
    try {
      ConstrainedDynamics<double> made(robot, constraints, options);
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return "";
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto holds = [](const std::string& text, const char* name, const char* what) {
    EXPECT_TRUE(text.find(name) != std::string::npos && text.find(what) != std::string::npos)
        << text;
    EXPECT_EQ(text.find('\n'), std::string::npos);
  };
  holds(message([](Constraint& c) { c.stiffness = -2; }), "'pose'", "stiffness -2");
  holds(message([&](Constraint& c) { c.damping = nan; }), "'pose'", "damping nan");
  holds(message([](Constraint& c) { c.compliance[0] = -1; }), "'pose'", "compliance -1");
  holds(message([](Constraint& c) { c.turning = 0; }), "'pose'", "turning 0");
  holds(message([](Constraint& c) { c.first.link = 99; }), "'pose'", "link 99");
  holds(message([](Constraint& c) { c.second = c.first; }), "'pose'", "both frames are on link");
  holds(message([](Constraint& c) { c.first.link = -1; }), "'pose'", "both frames are on the base");
  holds(message([](Constraint& c) { c.impedance = Impedance{.least = 0}; }), "'pose'",
        "impedance of 0");
  holds(message([](Constraint& c) { c.jacobian.pop_back(); }, 1), "'gear'", "numbers");
  holds(message([](Constraint& c) { c.jacobian.assign(c.jacobian.size(), 0), c.other.clear(); }, 1),
        "'gear'", "no joint");
  holds(message([](Constraint& c) { c.jacobian[0] = 1; }, 1), "'gear'", "no hinge or slide");
  holds(message([&](Constraint& c) { c.polynomial[3] = nan; }, 1), "'gear'", "nan");
  holds(message([](Constraint&) {}, 0, {.proximal = -1}), "proximal", "-1");
  EXPECT_THROW(ConstrainedDynamics<double>(robot, {}), std::invalid_argument);
  ConstrainedDynamics<double> made(robot, some_of_each(model));
  VectorX<double> q(model.nq()), qd(model.nv()), a(model.nv()), forces(3);
  EXPECT_THROW((void)made.forward_dynamics(q, qd, qd, a, forces), std::invalid_argument);
  const ConstrainedDynamics<double> taken = std::move(made);
  EXPECT_THROW((void)made.forward_dynamics(q, qd, qd, a, forces), std::logic_error);
}

}  // namespace
}  // namespace kalmarm::test
