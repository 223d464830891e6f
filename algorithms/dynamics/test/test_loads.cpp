// Bodies that a state adds to the robot's: all calls are those of the robot with these bodies among its own, against
// truth in 50 digits; one state and rows, on every rung.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "algorithms/dynamics/is_body.hpp"
#include "algorithms/dynamics/test/door_support.hpp"
#include "algorithms/fast/test/derivatives_support.hpp"
#include "kalmarm/implicit_step.hpp"

namespace kalmarm::test {
namespace {

constexpr int numbers = 10;

// On frames of links; their ten numbers are exact in float.
struct Carried {
  std::vector<Frame> frames;
  std::vector<RigidBody<double>> bodies;

  VectorX<double> loads() const {
    VectorX<double> out(numbers * bodies.size());
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const SpatialInertia<double> M(bodies[i]);
      out.segment<numbers>(numbers * i) << M.m, M.h, M.I(0, 0), M.I(1, 1), M.I(2, 2), M.I(0, 1),
          M.I(0, 2), M.I(1, 2);
    }
    return out;
  }
};

RigidBody<double> dyadic_body(Random& random, double size) {
  const auto eighths = [&](int below) { return (1 + random.below(below)) / 8.0; };
  const auto side = [&] { return random.chance(0.5) ? eighths(3) : -eighths(3); };
  const double m = size * eighths(8), x = eighths(4) / 8, y = eighths(4) / 8, z = eighths(4) / 8;
  return {m, {side(), side(), side()}, {1, 0, 0, 0}, m * Vector3<double>(y + z, x + z, x + y)};
}

// Two on one link, one on another, and one on the base, where it does nothing.
Carried some_loads(const Model<double>& model, std::uint64_t seed, double size = 1) {
  Random random(seed);
  const int last = end_of_joint(model, model.nv() - 1),
            middle = end_of_joint(model, model.nv() / 2);
  Carried out;
  out.frames = {{last, {1, 0.25, -0.5, 0.125}, {0.125, 0, 0.25}},
                {middle},
                {-1},
                {last, {0, 1, 0, 0}, {0, -0.25, 0}}};
  for (std::size_t i = 0; i < out.frames.size(); ++i)
    out.bodies.push_back(dyadic_body(random, size));
  return out;
}

// The robot with the bodies on hinges that a huge rotor holds still: in 50 digits they stand.
struct Whole {
  Model<double> model;
  State<double> state;
  int nv;

  Whole(const Model<double>& robot, const State<double>& of_robot, const Carried& carried,
        double rotor = 1e60)
      : state(of_robot), nv(robot.nv()) {
    std::vector<Joint<double>> joints;
    std::vector<std::string> names = robot.names();
    for (int k = 0; k < nv; ++k) joints.push_back(robot.joint(k));
    int nq = robot.nq();
    for (std::size_t i = 0; i < carried.frames.size(); ++i) {
      const Frame& frame = carried.frames[i];
      if (frame.link < 0) continue;
      Joint<double> joint;
      joint.parent = frame.link;
      joint.q_index = nq++;
      const auto& r = frame.rotation;
      joint.rotation = {r[0], r[1], r[2], r[3]};
      joint.translation = Vector3<double>(frame.translation.data());
      joint.r = rotor;
      joint.body = carried.bodies[i];
      joints.push_back(joint);
      names.push_back("load " + std::to_string(i));
    }
    model = Model<double>(std::move(joints), names, nq, robot.gravity());
    state.q = with_zeros(of_robot.q, nq);
    state.qd = with_zeros(of_robot.qd);
    state.tau = with_zeros(of_robot.tau);
  }

  static VectorX<double> with_zeros(const VectorX<double>& x, Eigen::Index size) {
    VectorX<double> out = VectorX<double>::Zero(size);
    out.head(x.size()) = x;
    return out;
  }
  template <class V>
  VectorX<double> with_zeros(const V& x) const {
    return with_zeros(x.template cast<double>(), model.nv());
  }
  Truth truth() const { return {model, state}; }
};

template <class T>
Dynamics<T> loaded_robot(const Model<double>& model, const Carried& carried,
                         DynamicsOptions options = {}) {
  options.question.loaded = carried.frames;
  return dynamics_of<T>(model, options);
}

template <class T>
StateForces<T> given(const VectorX<T>& loads) {
  return {.loads = VectorView<const T>(loads)};
}

double euclid(const VectorX<double>& x, const VectorX<double>& exact) {
  return (x - exact).norm() / exact.norm();
}

template <class T>
class Loaded : public testing::Test {};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Loaded, Precisions, PrecisionName);

// Accelerations within what their estimate says, and torques within rounding, of light loads and heavy ones.
TYPED_TEST(Loaded, MotionIsThatOfTheWhole) {
  using T = TypeParam;
  const double u = static_cast<double>(unit_roundoff<T>());
  for (const Family& family : families_and_robots())
    for (const double size : {0.0078125, 1.0, 1024.0}) {
      SCOPED_TRACE(std::string(family.name) + " " + std::to_string(size));
      const Model<double> model = rounded<T>(family.make(3));
      const State<T> s = random_state(model, 5).template cast<T>();
      const Carried carried = some_loads(model, 7, size);
      const Whole whole(model, s.template cast<double>(), carried);
      const Truth truth = whole.truth();
      const VectorX<T> loads = carried.loads().cast<T>();
      Dynamics<T> robot = loaded_robot<T>(model, carried);
      VectorX<T> a = poisoned<T>(model.nv()), tau = a, bias = a;
      const Outcome outcome = robot.forward_dynamics(s.q, s.qd, s.tau, a, given<T>(loads));
      ASSERT_TRUE(outcome);
      EXPECT_LE(truth.relative(whole.with_zeros(a)), default_tolerance<T>);
      // What is refined, or rounded to float, has an error in Euclid's norm.
      const bool by_sweep = std::is_same_v<T, double> && outcome.rung == Outcome::Rung::float64;
      const double error =
          by_sweep ? truth.energy(whole.with_zeros(a)) : truth.relative(whole.with_zeros(a));
      EXPECT_LE(error, 4 * std::max(outcome.error, u));

      const DenseMechanics dense = dense_mechanics(whole.model, whole.state);
      const MatrixX<double> M = dense.M.topLeftCorner(whole.nv, whole.nv);
      const VectorX<double> of_bodies = dense.bias.head(whole.nv),
                            of_rates = M * s.tau.template cast<double>();
      robot.inverse_dynamics(s.q, s.qd, s.tau, tau, given<T>(loads));
      robot.bias(s.q, s.qd, bias, given<T>(loads));
      const double most = (40 + 8 * model.nv()) * u;
      EXPECT_LE((bias.template cast<double>() - of_bodies).norm(), most * of_bodies.norm());
      EXPECT_LE((tau.template cast<double>() - of_bodies - of_rates).norm(),
                most * (of_bodies.norm() + of_rates.norm()));
    }
}

// M, M^-1, its diagonal, log det, solves.
TYPED_TEST(Loaded, MatricesAreThoseOfTheWhole) {
  using T = TypeParam;
  const double u = static_cast<double>(unit_roundoff<T>());
  for (const Family& family : families_and_robots()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = rounded<T>(family.make(3));
    const int nv = model.nv();
    const State<T> s = random_state(model, 5).template cast<T>();
    const Carried carried = some_loads(model, 7);
    const Whole whole(model, s.template cast<double>(), carried);
    const MatrixX<double> M = dense_mechanics(whole.model, whole.state).M.topLeftCorner(nv, nv);
    const Eigen::LLT<MatrixX<double>> llt(M);
    const MatrixX<double> inverse = llt.solve(MatrixX<double>::Identity(nv, nv));
    const double condition = M.norm() * inverse.norm();
    const VectorX<T> loads = carried.loads().cast<T>();
    Dynamics<T> robot = loaded_robot<T>(model, carried);
    MatrixX<T> X(nv, nv);
    robot.mass(s.q, X, VectorView<const T>(loads));
    EXPECT_LE((X.template cast<double>() - M).norm(), (20 + 4 * nv) * u * M.norm());
    const StateContacts<T> extra = given<T>(loads);
    ASSERT_TRUE(robot.inverse_mass(s.q, X, extra));
    const double most = default_tolerance<T> + 0x1p-48 * condition;
    EXPECT_LE((X.template cast<double>() - inverse).norm(), most * inverse.norm());
    VectorX<T> x = poisoned<T>(nv), diagonal = x;
    ASSERT_TRUE(robot.factor(s.q, extra));
    ASSERT_TRUE(robot.solve(s.tau, x));
    EXPECT_LE(euclid(x.template cast<double>(), llt.solve(s.tau.template cast<double>())), most);
    ASSERT_TRUE(robot.diagonal(s.q, diagonal, extra));
    EXPECT_LE(euclid(diagonal.template cast<double>(), inverse.diagonal()), most);
    T log_det = 0;
    ASSERT_TRUE(robot.log_det(s.q, log_det, extra));
    const double exact = 2 * llt.matrixLLT().diagonal().array().log().sum();
    EXPECT_NEAR(static_cast<double>(log_det), exact, nv * most);
  }
}

// All digits where they are asked for, by residuals in twice the precision and in two doubles, one state and rows.
TEST(Loads, RefinedAnswersHaveAllDigits) {
  for (const Family& family : families_and_robots()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = family.make(4);
    const int nv = model.nv(), nq = model.nq(), count = 3;
    const Carried carried = some_loads(model, 9);
    const VectorX<double> loads = carried.loads();
    Dynamics<double> robot = loaded_robot<double>(
        model, carried,
        {.tolerance = last_bits, .question = {.want = {Want::acceleration, Want::solve}}});
    VectorX<double> q(count * nq), qd(count * nv), tau(count * nv), all(count * loads.size()),
        rows = poisoned<double>(count * nv);
    for (int i = 0; i < count; ++i) {
      const State<double> s = random_state(model, i);
      q.segment(i * nq, nq) = s.q, qd.segment(i * nv, nv) = s.qd, tau.segment(i * nv, nv) = s.tau;
      all.segment(i * loads.size(), loads.size()) = loads;
    }
    std::vector<Outcome> outcomes(count);
    const ForceRows<double> of_rows{.loads =
                                        RowsView<const double>(all.data(), count, loads.size())};
    ASSERT_EQ(robot.forward_dynamics(q, qd, tau, rows, outcomes, 1, of_rows), 0);
    for (int i = 0; i < count; ++i) {
      const State<double> s = random_state(model, i);
      const Whole whole(model, s, carried);
      const Truth truth = whole.truth();
      VectorX<double> a = poisoned<double>(nv);
      ASSERT_TRUE(robot.forward_dynamics(s.q, s.qd, s.tau, a, given<double>(loads)));
      EXPECT_LE(truth.relative(whole.with_zeros(a)), 2 * unit_roundoff<double>());
      EXPECT_LE(truth.relative(whole.with_zeros(rows.segment(i * nv, nv))),
                2 * unit_roundoff<double>());
      VectorX<double> x = poisoned<double>(nv);
      ASSERT_TRUE(robot.factor(s.q, given<double>(loads)));
      ASSERT_TRUE(robot.solve(s.tau, x));
      EXPECT_LE(euclid(x, truth.solution().head(nv)), 2 * unit_roundoff<double>());
    }
  }
}

// Each row has its own loads, as one state after another has them, whatever is asked.
TYPED_TEST(Loaded, RowsHaveLoadsOfTheirOwn) {
  using T = TypeParam;
  for (const Family& family : robots()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = rounded<T>(family.make(3));
    const int nv = model.nv(), nq = model.nq(), count = 19;
    const Carried carried = some_loads(model, 0);
    const int width = numbers * static_cast<int>(carried.frames.size());
    Dynamics<T> robot = loaded_robot<T>(model, carried);
    VectorX<T> q(count * nq), qd(count * nv), tau(count * nv), loads(count * width),
        a = poisoned<T>(count * nv), x = a, torques = a, diagonal = a,
        M = poisoned<T>(count * nv * nv), X = M;
    for (int i = 0; i < count; ++i) {
      const State<T> s = random_state(model, i).template cast<T>();
      q.segment(i * nq, nq) = s.q, qd.segment(i * nv, nv) = s.qd, tau.segment(i * nv, nv) = s.tau;
      loads.segment(i * width, width) = some_loads(model, i).loads().template cast<T>();
    }
    const ForceRows<T> extra{.loads = RowsView<const T>(loads.data(), count, width)};
    std::vector<Outcome> outcomes(count);
    ASSERT_EQ(robot.forward_dynamics(q, qd, tau, a, outcomes, 1, extra), 0);
    ASSERT_EQ(robot.solve(q, tau, x, outcomes, 1, extra), 0);
    robot.inverse_dynamics(q, qd, tau, torques, 1, extra);
    ASSERT_EQ(robot.diagonal(q, diagonal, outcomes, 1, extra), 0);
    ASSERT_EQ(robot.mass(q, M, outcomes, 1, extra.loads), 0);
    ASSERT_EQ(robot.inverse_mass(q, X, outcomes, 1, extra), 0);
    for (int i = 0; i < count; ++i) {
      SCOPED_TRACE(i);
      const VectorX<T> own = loads.segment(i * width, width);
      const VectorX<T> at = q.segment(i * nq, nq), rates = qd.segment(i * nv, nv),
                       torque = tau.segment(i * nv, nv);
      const auto close = [&](const VectorX<T>& rows, const VectorX<T>& one) {
        const VectorX<T> of_row = rows.segment(i * one.size(), one.size());
        EXPECT_LE((of_row - one).norm(), T(2 * default_tolerance<T>) * one.norm());
      };
      VectorX<T> one = poisoned<T>(nv);
      ASSERT_TRUE(robot.forward_dynamics(at, rates, torque, one, given<T>(own)));
      close(a, one);
      robot.inverse_dynamics(at, rates, torque, one, given<T>(own));
      close(torques, one);
      ASSERT_TRUE(robot.diagonal(at, one, given<T>(own)));
      close(diagonal, one);
      ASSERT_TRUE(robot.factor(at, given<T>(own)));
      ASSERT_TRUE(robot.solve(torque, one));
      close(x, one);
      MatrixX<T> Y(nv, nv);
      robot.mass(at, Y, VectorView<const T>(own));
      close(M, Y.reshaped());
      ASSERT_TRUE(robot.inverse_mass(at, Y, given<T>(own)));
      close(X, Y.reshaped());
    }
  }
}

// Derivatives are those of the whole, whose loads a huge rotor holds, one state and rows.
TEST(Loads, DerivativesAreThoseOfTheWhole) {
  const double rotor = 1 / (unit_roundoff<double>() * unit_roundoff<double>());
  for (const Family& family : families_and_robots()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = family.make(3);
    const int nv = model.nv();
    const State<double> s = random_state(model, 5);
    const Carried carried = some_loads(model, 7);
    const Whole whole(model, s, carried, rotor);
    Dynamics<double> robot = loaded_robot<double>(model, carried);
    Dynamics<double> of_whole = dynamics_of<double>(whole.model, {});
    AccelerationDerivatives<double> got(nv), want(whole.model.nv());
    const VectorX<double> loads = carried.loads();
    ASSERT_TRUE(of_whole.derivatives(whole.state.q, whole.state.qd, whole.state.tau,
                                     {.dq = want.dq, .dqd = want.dqd, .dtau = want.dtau}, want.a));
    ASSERT_TRUE(robot.derivatives(s.q, s.qd, s.tau,
                                  {.dq = got.dq, .dqd = got.dqd, .dtau = got.dtau}, got.a,
                                  {.axes = Axes::local, .loads = VectorView<const double>(loads)}));
    const auto close = [&](const MatrixX<double>& X, const MatrixX<double>& exact) {
      const MatrixX<double> block = exact.topLeftCorner(nv, nv);
      EXPECT_LE((X - block).norm(), 1e-11 * block.norm() + 1e-14);  // of terms about 1
    };
    close(got.dq, want.dq);
    close(got.dqd, want.dqd);
    close(got.dtau, want.dtau);
    // Without loads it is the robot again.
    Dynamics<double> bare = dynamics_of<double>(model, {});
    AccelerationDerivatives<double> without(nv), plain(nv);
    ASSERT_TRUE(robot.derivatives(s.q, s.qd, s.tau, {.dq = without.dq}, without.a));
    ASSERT_TRUE(bare.derivatives(s.q, s.qd, s.tau, {.dq = plain.dq}, plain.a));
    close(without.dq, plain.dq);
  }
}

// A step with dampers and springs: (M + h b) a = tau - b v - bias, rows with gains of their own too.
TEST(Loads, StepsAreThoseOfTheWhole) {
  const double h = 0.01;
  const Model<double> model = creature(3);
  const int nv = model.nv();
  const Carried carried = some_loads(model, 7);
  const VectorX<double> loads = carried.loads();
  const std::vector<double> b(nv, 0.5);
  DynamicsOptions options;
  options.question.loaded = carried.frames;
  ImplicitStep<double> step(plain(model), h, {.damping = b}, Scheme::springs_at_end, options);
  const State<double> s = random_state(model, 5);
  const Whole whole(model, s, carried);
  const DenseMechanics dense = dense_mechanics(whole.model, whole.state);
  const MatrixX<double> M =
      dense.M.topLeftCorner(nv, nv) + h * 0.5 * MatrixX<double>::Identity(nv, nv);
  const VectorX<double> exact = M.llt().solve(s.tau - 0.5 * s.qd - dense.bias.head(nv));
  VectorX<double> a = poisoned<double>(nv), rows = poisoned<double>(2 * nv);
  ASSERT_TRUE(step.acceleration(s.q, s.qd, s.tau, a, given<double>(loads)));
  EXPECT_LE(euclid(a, exact), 1e-10);
  VectorX<double> q(2 * s.q.size()), v(2 * nv), tau(2 * nv), all(2 * loads.size()),
      damping = VectorX<double>::Constant(2 * nv, 0.5);
  q << s.q, s.q;
  v << s.qd, s.qd;
  tau << s.tau, s.tau;
  all << loads, loads;
  std::vector<Outcome> outcomes(2);
  const ForceRows<double> extra{.loads = RowsView<const double>(all.data(), 2, loads.size())};
  for (const bool own : {false, true}) {
    const GainRows<double> gains{.damping = own ? RowsView<const double>(damping.data(), 2, nv)
                                                : RowsView<const double>(nullptr, 0, 0)};
    ASSERT_EQ(step.acceleration(q, v, tau, gains, rows, outcomes, 1, extra), 0);
    for (int i = 0; i < 2; ++i) EXPECT_LE(euclid(rows.segment(i * nv, nv), exact), 1e-8);
  }
}

// Loads far heavier and far lighter than what carries them are right, or climb: no answer is wrong in silence.
TYPED_TEST(Loaded, NothingIsSilent) {
  using T = TypeParam;
  int warned = 0;
  for (int seed = 0; seed < 60; ++seed) {
    Random random(seed);
    const Model<double> model = rounded<T>(chain(seed, 2 + random.below(8)));
    const State<T> s = random_state(model, seed).template cast<T>();
    const Carried carried = some_loads(model, seed, std::exp2(random.below(60) - 30));
    const Whole whole(model, s.template cast<double>(), carried);
    const int nv = model.nv(), count = 2;
    Dynamics<T> robot =
        loaded_robot<T>(model, carried, {.question = {.want = {Want::acceleration}}});
    const VectorX<T> loads = carried.loads().cast<T>();
    VectorX<T> q(count * s.q.size()), qd(count * nv), tau(count * nv), all(count * loads.size()),
        a = poisoned<T>(count * nv);
    q << s.q, s.q;
    qd << s.qd, s.qd;
    tau << s.tau, s.tau;
    all << loads, loads;
    std::vector<Outcome> outcomes(count);
    static_cast<void>(robot.forward_dynamics(
        q, qd, tau, a, outcomes, 1, {.loads = RowsView<const T>(all.data(), count, loads.size())}));
    const double error = whole.truth().relative(whole.with_zeros(a.tail(nv)));
    warned += !outcomes[1] || outcomes[1].warns();
    if (outcomes[1] && !outcomes[1].warns()) {
      EXPECT_LE(error, default_tolerance<T>) << seed;
    }
  }
  EXPECT_EQ(warned, 0);
}

// What is no body is refused, by its DoF, one state and rows, of which others go on.
TEST(Loads, WhatIsNoBodyIsRefused) {
  const Model<double> model = chain(3, 5);
  const int nv = model.nv(), width = 2 * numbers;
  DynamicsOptions options;
  options.question.loaded = {{1}, {4}};
  Dynamics<double> robot = dynamics_of<double>(model, options);
  const State<double> s = random_state(model, 2);
  VectorX<double> a(nv), X(nv);
  const auto status = [&](const VectorX<double>& loads) {
    return robot.forward_dynamics(s.q, s.qd, s.tau, a, given<double>(loads));
  };
  VectorX<double> loads = VectorX<double>::Zero(width);
  EXPECT_TRUE(status(loads));
  loads[10] = 1;
  EXPECT_TRUE(status(loads));  // a point at the frame's origin
  const auto refuses = [&](int i, double x) {
    VectorX<double> wrong = loads;
    wrong[i] = x;
    const Outcome out = status(wrong);
    EXPECT_EQ(out.status, Outcome::Status::indefinite);
    EXPECT_EQ(out.joint, i < numbers ? 1 : 4);
    EXPECT_FALSE(robot.factor(s.q, given<double>(wrong)));
  };
  refuses(10, -1);
  refuses(10, std::numeric_limits<double>::quiet_NaN());
  refuses(1, 0.5);    // a first moment without mass
  refuses(11, 0.25);  // of a point that is not at the origin, without its moments
  refuses(14, 1);     // about one axis alone: against the triangle inequality
  refuses(17, 0.1);   // a product alone

  VectorX<double> q(3 * nv), qd(3 * nv), tau(3 * nv), all(3 * width), rows(3 * nv);
  q << s.q, s.q, s.q;
  qd << s.qd, s.qd, s.qd;
  tau << s.tau, s.tau, s.tau;
  all << loads, loads, loads;
  all[width + 10] = -1;
  std::vector<Outcome> outcomes(3);
  EXPECT_EQ(robot.forward_dynamics(q, qd, tau, rows, outcomes, 1,
                                   {.loads = RowsView<const double>(all.data(), 3, width)}),
            1);
  EXPECT_EQ(outcomes[1].status, Outcome::Status::indefinite);
  ASSERT_TRUE(status(loads));
  EXPECT_LE(euclid(rows.tail(nv), a), 1e-12);

  EXPECT_THROW(static_cast<void>(status(VectorX<double>::Zero(width - 1))), std::invalid_argument);
  options.question.loaded = {{7}};
  EXPECT_THROW(dynamics_of<double>(model, options), std::invalid_argument);
}

// Bodies that can be pass, as their numbers are rounded to T; a moment lowered by 1 per cent of the others does not.
TYPED_TEST(Loaded, BodiesAreToldFromWhatIsNone) {
  using T = TypeParam;
  for (int seed = 0; seed < 200; ++seed) {
    Random random(seed);
    const bool flat = seed % 2;
    RigidBody<double> body = random_body(random);
    if (flat)
      body.moments[2] = body.moments[0] + body.moments[1];  // a plate: the least that can be
    const SpatialInertia<double> M(body);
    VectorX<T> pi(numbers);
    pi << T(M.m), M.h.template cast<T>(), T(M.I(0, 0)), T(M.I(1, 1)), T(M.I(2, 2)), T(M.I(0, 1)),
        T(M.I(0, 2)), T(M.I(1, 2));
    EXPECT_TRUE(is_body(pi.data())) << seed;
    if (!flat) continue;
    const Matrix3<double> E = rotation(body.axes);
    const Matrix3<double> less = M.I + 0.01 * body.moments[2] * E.col(2) * E.col(2).transpose();
    pi.tail(6) << T(less(0, 0)), T(less(1, 1)), T(less(2, 2)), T(less(0, 1)), T(less(0, 2)),
        T(less(1, 2));
    EXPECT_FALSE(is_body(pi.data())) << seed;
  }
}

}  // namespace
}  // namespace kalmarm::test
