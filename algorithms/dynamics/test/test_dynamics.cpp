// Properties of the door itself: the same numbers asked in other ways, rows on several cores, objects
// that are moved. What the kernels behind it answer is tested in fast/test.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/dynamics/test/door_support.hpp"
#include "algorithms/test/singular.hpp"

namespace kalmarm::test {
namespace {

template <class T>
class Doors : public testing::Test {};

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Doors, Precisions, PrecisionName);

// --- the same numbers, asked in other ways

TYPED_TEST(Doors, BiasIsInverseDynamicsWithoutAccelerationAndGravityThatWithoutMotion) {
  using T = TypeParam;
  for (const Family& family : robots()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = family.make(3);
    const State<T> s = random_state(model, 4).template cast<T>();
    const VectorX<T> zero = VectorX<T>::Zero(model.nv());
    Dynamics<T> robot = dynamics_of<T>(model, by_all_rules);
    VectorX<T> bias = poisoned<T>(model.nv()), torque = bias, gravity = bias;
    robot.bias(s.q, s.qd, bias);
    robot.inverse_dynamics(s.q, s.qd, zero, torque);
    EXPECT_TRUE(bias == torque);
    robot.gravity(s.q, gravity);
    robot.bias(s.q, zero, bias);
    EXPECT_TRUE(bias == gravity);
    Model<double> weightless = model;
    weightless.set_gravity({0, 0, 0});
    dynamics_of<T>(weightless, by_all_rules).gravity(s.q, gravity);
    EXPECT_TRUE(gravity.isZero(0));
  }
}

// a is that of the call without columns, X that of `solve`: of one state and of rows, by one sweep or
// by more (parts, the certified form). Factors that were kept are there again.
TYPED_TEST(Doors, ColumnsBesideAccelerationsAreThoseOfSolve) {
  using T = TypeParam;
  using Rows = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  for (const Family& family : robots())
    for (const Tolerance tolerance : tolerances)
      for (const bool all : {false, true}) {
        SCOPED_TRACE(std::string(family.name) + " " + name_of(tolerance));
        const Model<double> model = rounded<T>(family.make(3));
        const int nv = model.nv(), m = 3, count = 300;  // so that each thread has some
        Dynamics<T> robot = dynamics_of<T>(
            model, {.tolerance = tolerance, .rules = all ? all_rules() : std::set<Rule>{}});
        MatrixX<T> B = MatrixX<T>::Zero(nv, m), X = poisoned<T>(nv, m), expected = X;
        for (int j = 0; j < m; ++j) B(nv - 1 - j % nv, j) = T(1), B(0, j) += T(0.5);
        Rows q(count, robot.nq()), qd(count, nv), tau(count, nv), a = poisoned<T>(count, nv);
        MatrixX<T> X_rows = poisoned<T>(nv, count * m);
        for (int i = 0; i < count; ++i) {
          const State<T> s = random_state(model, i).template cast<T>();
          q.row(i) = s.q, qd.row(i) = s.qd, tau.row(i) = s.tau;
        }
        std::vector<Outcome> outcomes(count);
        ASSERT_EQ(robot.forward_dynamics(q, qd, tau, a, B, X_rows, outcomes, 2), 0);
        const State<T> kept = random_state(model, 99).template cast<T>();
        for (int i = 0; i < count; i += 16) {
          const State<T> s = random_state(model, i).template cast<T>();
          VectorX<T> one = poisoned<T>(nv), plain_a = one;
          ASSERT_TRUE(robot.forward_dynamics(s.q, s.qd, s.tau, plain_a));
          ASSERT_TRUE(robot.factor(s.q));
          ASSERT_TRUE(robot.solve(B, expected));
          ASSERT_TRUE(robot.factor(kept.q));
          const Outcome outcome = robot.forward_dynamics(s.q, s.qd, s.tau, one, B, X);
          ASSERT_TRUE(outcome);
          EXPECT_GE(outcome.error, 0);
          EXPECT_GE(outcomes[i].error, 0);
          const auto near = [&](const auto& x, const auto& right) {
            EXPECT_LE((x - right).norm(), 2000 * unit_roundoff<T>() * right.norm()) << i;
          };
          near(one, plain_a);
          near(VectorX<T>(a.row(i)), plain_a);
          near(X, expected);
          near(MatrixX<T>(X_rows.middleCols(i * m, m)), expected);
        }
        MatrixX<T> again = poisoned<T>(nv, m);
        ASSERT_TRUE(robot.solve(B, again));
        ASSERT_TRUE(robot.factor(kept.q));
        ASSERT_TRUE(robot.solve(B, expected));
        EXPECT_EQ(again, expected);
      }
}

// Of rows each its own column: that of one state with it, by lanes, by what they leave over (the fourth row is far away), and
// by parts.
TYPED_TEST(Doors, AColumnOfEveryRowIsThatOfItsState) {
  using T = TypeParam;
  using Rows = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  for (const Family& family : robots())
    for (const Tolerance tolerance : tolerances) {
      SCOPED_TRACE(std::string(family.name) + " " + name_of(tolerance));
      const Model<double> model = rounded<T>(family.make(3));
      const int nv = model.nv(), count = 70;
      Dynamics<T> robot = dynamics_of<T>(model, {.tolerance = tolerance});
      Rows q(count, robot.nq()), qd(count, nv), tau(count, nv), b(count, nv),
          a = poisoned<T>(count, nv), x = poisoned<T>(count, nv);
      for (int i = 0; i < count; ++i) {
        const State<T> s = random_state(model, i).template cast<T>();
        q.row(i) = s.q, qd.row(i) = s.qd, tau.row(i) = s.tau;
        b.row(i) = random_state(model, 100 + i).tau.template cast<T>();
      }
      qd.row(3) *= T(1e3);
      std::vector<Outcome> outcomes(count);
      ASSERT_EQ(robot.forward_dynamics_and_solve(q, qd, tau, a, b, x, outcomes, 2), 0);
      for (const int i : {0, 3, 41, count - 1}) {
        const VectorX<T> of_q = q.row(i), of_qd = qd.row(i), of_tau = tau.row(i);
        const MatrixX<T> column = b.row(i).transpose();
        VectorX<T> one = poisoned<T>(nv);
        MatrixX<T> X = poisoned<T>(nv, 1);
        ASSERT_TRUE(robot.forward_dynamics(of_q, of_qd, of_tau, one, column, X));
        const auto near = [&](const VectorX<T>& is, const VectorX<T>& right) {
          EXPECT_LE((is - right).norm(), 2000 * unit_roundoff<T>() * right.norm()) << i;
        };
        near(a.row(i), one);
        near(x.row(i), X);
      }
      EXPECT_THROW((void)robot.forward_dynamics_and_solve(q, qd, tau, a, b, b, outcomes),
                   std::invalid_argument);
    }
}

TYPED_TEST(Doors, ColumnsThatOverlapOrDoNotFitAreRefused) {
  using T = TypeParam;
  const Model<double> model = creature(1);
  const int nv = model.nv();
  Dynamics<T> robot = dynamics_of<T>(model, {});
  const State<T> s = random_state(model, 4).template cast<T>();
  VectorX<T> a(nv);
  MatrixX<T> B = MatrixX<T>::Identity(nv, 2), few(nv, 1);
  EXPECT_THROW((void)robot.forward_dynamics(s.q, s.qd, s.tau, a, B, B), std::invalid_argument);
  EXPECT_THROW((void)robot.forward_dynamics(s.q, s.qd, s.tau, a, B, few), std::invalid_argument);
}

TYPED_TEST(Doors, MassTimesItsInverseIsOne) {
  using T = TypeParam;
  for (const Family& family : robots())
    for (const Tolerance tolerance : tolerances) {
      SCOPED_TRACE(std::string(family.name) + " " + name_of(tolerance));
      const Model<double> model = family.make(3);
      const int nv = model.nv();
      const VectorX<T> q = random_state(model, 4).template cast<T>().q;
      Dynamics<T> robot = dynamics_of<T>(model, {.tolerance = tolerance, .rules = all_rules()});
      MatrixX<T> M = poisoned<T>(nv, nv), X = M;
      robot.mass(q, M);
      ASSERT_TRUE(robot.inverse_mass(q, X));
      // joints may have any units
      const VectorX<T> scale = M.diagonal().cwiseSqrt();
      M = scale.cwiseInverse().asDiagonal() * M * scale.cwiseInverse().asDiagonal();
      X = scale.asDiagonal() * X * scale.asDiagonal();
      EXPECT_LE((M * X - MatrixX<T>::Identity(nv, nv)).norm(),
                100 * unit_roundoff<T>() * M.norm() * X.norm());
    }
}

// Whatever is asked between: rows, other positions, suspects that others answer.
TYPED_TEST(Doors, FactorsAreKeptWhateverElseIsAsked) {
  using T = TypeParam;
  std::vector<Model<double>> models;
  for (const Family& family : robots()) models.push_back(family.make(3));
  models.push_back(singular_mechanisms(1)[0].model);  // with a rotor, which is a suspect
  models.back().set_noise(3, 1e-9);
  for (const Model<double>& model : models)
    for (const Tolerance tolerance : tolerances) {
      const int nv = model.nv();
      const State<T> here = random_state(model, 4).template cast<T>();
      const State<T> there = random_state(model, 5).template cast<T>();
      DynamicsOptions options{
          .tolerance = tolerance, .question = about(all_but(nv, {}), model), .rules = all_rules()};
      Dynamics<T> robot = dynamics_of<T>(model, options);
      VectorX<T> right = poisoned<T>(nv), x = right, y = right;
      MatrixX<T> X(nv, nv), J(18, 18);
      T number;
      std::vector<Outcome> outcomes(1);
      std::vector<T> matrix(X.size());
      const VectorX<T> nowhere = poisoned<T>(robot.nq());
      ASSERT_TRUE(robot.factor(here.q));
      EXPECT_TRUE(robot.solve(here.tau, right));
      for (const VectorX<T>& q : {there.q, nowhere})
        for (const auto& between : std::vector<std::function<void()>>{
                 [&] { (void)robot.forward_dynamics(q, there.qd, there.tau, y); },
                 [&] { (void)robot.forward_dynamics(q, there.qd, there.tau, y, outcomes); },
                 [&] { robot.inverse_dynamics(q, there.qd, there.tau, y); },
                 [&] { robot.mass(q, X); }, [&] { (void)robot.inverse_mass(q, X); },
                 [&] { (void)robot.mass(q, matrix, outcomes); },
                 [&] { (void)robot.inverse_mass(q, matrix, outcomes); },
                 [&] { (void)robot.solve(q, there.tau, y, outcomes); },
                 [&] { (void)robot.derivatives(q, there.qd, there.tau, {}, y); },
                 [&] { (void)robot.diagonal(q, y); }, [&] { (void)robot.log_det(q, number); },
                 [&] { (void)robot.operational(q, J); }}) {
          between();
          x = poisoned<T>(nv);
          EXPECT_TRUE(robot.solve(here.tau, x));
          EXPECT_TRUE(x == right);
        }
    }
}

// The mechanism and a position at which M is singular, and one at which it is not.
struct Lock {
  Model<double> model;
  VectorX<double> q, elsewhere;
};

Lock gimbal_lock(int trees) {
  for (const Mechanism& mechanism : singular_mechanisms(1)) {
    if (mechanism.name != "gimbal_lock") continue;
    std::vector<Joint<double>> joints;
    std::vector<std::string> names;
    VectorX<double> q(trees * mechanism.model.nq());
    for (int tree = 0; tree < trees; ++tree)
      for (int k = 0; k < mechanism.model.nv(); ++k) {
        joints.push_back(mechanism.model.joint(k));
        Joint<double>& joint = joints.back();
        if (joint.parent >= 0) joint.parent += tree * mechanism.model.nv();
        joint.q_index += tree * mechanism.model.nq();
        names.push_back(mechanism.model.name(k) + std::to_string(tree));
        q[joint.q_index] = mechanism.q[mechanism.model.joint(k).q_index] + 0.4 * (tree == 0);
      }
    const auto nq = static_cast<int>(q.size());
    return {{joints, names, nq, mechanism.model.gravity()}, q, q.array() + 0.4};
  }
  return {};
}

// Whatever came between, and of several parts that of the one which failed.
TYPED_TEST(Doors, ASolveHasTheOutcomeOfItsFactors) {
  using T = TypeParam;
  for (const int trees : {1, 2})
    for (const Tolerance tolerance : tolerances) {
      SCOPED_TRACE(std::string(name_of(tolerance)) + " of " + std::to_string(trees) + " trees");
      Lock lock = gimbal_lock(trees);
      if (trees == 1) lock.q.array() -= 0.4;
      const VectorX<T> q = lock.q.template cast<T>(), regular = lock.elsewhere.template cast<T>();
      const int nv = lock.model.nv();
      Dynamics<T> robot = dynamics_of<T>(lock.model, {.tolerance = tolerance});
      MatrixX<T> X(nv, nv), tau = MatrixX<T>::Ones(nv, 3), x = poisoned<T>(nv, 3);

      ASSERT_TRUE(robot.factor(regular));
      const Outcome good = robot.solve(tau, x);
      EXPECT_TRUE(good && x.allFinite());
      if (tolerance) {
        EXPECT_LE(good.error, 100 * unit_roundoff<T>());
      }
      tau(1, 2) = std::numeric_limits<T>::quiet_NaN();
      EXPECT_EQ(robot.solve(tau, x).status, Outcome::Status::not_finite);
      tau(1, 2) = T(1);

      const Outcome refused = robot.factor(q);
      ASSERT_EQ(refused.status, Outcome::Status::singular);
      for (const bool between : {false, true}) {
        if (between) {
          EXPECT_TRUE(robot.inverse_mass(regular, X));
        }
        x.setZero();
        const Outcome out = robot.solve(tau, x);
        EXPECT_EQ(out.status, Outcome::Status::singular);
        EXPECT_EQ(out.joint, refused.joint);
        EXPECT_TRUE(x.array().isNaN().all());
      }
    }
}

// --- rows

// To the bit, whichever core takes which rows, with rows that fail; and nothing else is written.
template <class T>
void expect_rows_agree_on_every_count_of_threads(const Model<double>& model,
                                                 const DynamicsOptions& options) {
  Dynamics<T> robot = dynamics_of<T>(model, options), one = dynamics_of<T>(model, options);
  const int n = robot.asked(), nq = model.nq(), nv = model.nv();
  const auto dofs = [&](int k) {
    return options.question.dofs.empty() ? k : options.question.dofs[k];
  };
  // An entry of q that fails where it is asked about, at which tau would too.
  const int poisoned_tau = dofs(n - 1);
  for (const int count : {0, 1, 17, 63, 64, 65, 400}) {
    SCOPED_TRACE(std::to_string(count) + " states");
    Rows<T> given(model, count);
    for (int i = 5; i < count; i += 40)
      given.tau[i * nv + poisoned_tau] = std::numeric_limits<T>::quiet_NaN();
    Rows<T> right = given;
    const int failed = right.forward_dynamics(one);
    EXPECT_EQ(failed, count > 5 ? (count - 6) / 40 + 1 : 0);
    for (const int threads : {1, 2, 3, 2}) {
      SCOPED_TRACE(std::to_string(threads) + " threads");
      Rows<T> rows = given;
      EXPECT_EQ(rows.forward_dynamics(robot, threads), failed);
      for (int i = 0; i < count; ++i) {
        ASSERT_EQ(rows.outcomes[i].status, right.outcomes[i].status) << "state " << i;
        EXPECT_EQ(rows.outcomes[i].joint, right.outcomes[i].joint);
        EXPECT_EQ(!rows.outcomes[i], i % 40 == 5) << i;
        if (!rows.outcomes[i]) continue;
        ASSERT_TRUE(std::equal(&rows.a[i * n], &rows.a[i * n] + n, &right.a[i * n]))
            << "state " << i;
      }
      for (std::size_t i = std::size_t(count) * n; i < rows.a.size(); ++i)
        ASSERT_EQ(rows.a[i], T(-77));
    }
    // Against one state at a time, which may be contracted to FMA differently.
    for (int i = 0; i < std::min(count, 17); ++i) {
      if (!right.outcomes[i]) continue;
      VectorX<T> a = poisoned<T>(n);
      const auto at = [i](const std::vector<T>& all, int width) {
        return VectorView<const T>(all.data() + i * width, width);
      };
      EXPECT_TRUE(one.forward_dynamics(at(given.q, nq), at(given.qd, nv), at(given.tau, nv), a));
      const Eigen::Map<const VectorX<T>> row(&right.a[i * n], n);
      EXPECT_LE((row - a).norm(), 4000 * unit_roundoff<T>() * a.norm()) << "state " << i;
    }

    Rows<T> torques(model, count);
    torques.inverse_dynamics(one);
    for (const int threads : {2, 3, 1}) {
      Rows<T> rows(model, count);
      rows.inverse_dynamics(robot, threads);
      EXPECT_TRUE(rows.a == torques.a) << threads << " threads";
    }
    for (int i = 0; i < std::min(count, 17); ++i) {
      VectorX<T> tau = poisoned<T>(n);
      const auto at = [i](const std::vector<T>& all, int width) {
        return VectorView<const T>(all.data() + i * width, width);
      };
      one.inverse_dynamics(at(given.q, nq), at(given.qd, nv), at(torques.tau, nv), tau);
      const Eigen::Map<const VectorX<T>> row(&torques.a[i * n], n);
      EXPECT_LE((row - tau).norm(), 100 * unit_roundoff<T>() * tau.norm()) << "state " << i;
    }
  }
}

TYPED_TEST(Doors, RowsAgreeToTheBitOnEveryCountOfThreads) {
  for (const Family& family : robots())
    for (const Tolerance tolerance : tolerances) {
      SCOPED_TRACE(std::string(family.name) + " " + name_of(tolerance));
      expect_rows_agree_on_every_count_of_threads<TypeParam>(
          family.make(3), {.tolerance = tolerance,
                           .question = {.want = {Want::acceleration, Want::inverse_dynamics}},
                           .rules = all_rules()});
    }
}

TYPED_TEST(Doors, OneRowIsOneStateToTheBit) {
  using T = TypeParam;
  for (const Family& family : robots()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = family.make(3);
    const int n = model.nv();
    Dynamics<T> robot = dynamics_of<T>(model, by_all_rules);
    Rows<T> rows(model, 1);
    VectorX<T> a = poisoned<T>(n);
    EXPECT_EQ(rows.forward_dynamics(robot), 0);
    const Outcome one = robot.forward_dynamics(rows.q, rows.qd, rows.tau, a);
    EXPECT_TRUE(one && std::equal(a.begin(), a.end(), rows.a.begin()));
    EXPECT_EQ(rows.outcomes[0].rung, one.rung);
    rows.inverse_dynamics(robot);
    robot.inverse_dynamics(rows.q, rows.qd, rows.tau, a);
    EXPECT_TRUE(std::equal(a.begin(), a.end(), rows.a.begin()));
    rows.tau[0] = std::numeric_limits<T>::quiet_NaN();
    EXPECT_EQ(rows.forward_dynamics(robot), 1);
    EXPECT_FALSE(rows.outcomes[0]);
  }
}

TYPED_TEST(Doors, RowsOfAQuestionAgreeToTheBitOnEveryCountOfThreads) {
  for (const Family& family : robots())
    for (const bool at_rest : {false, true}) {
      const Model<double> model = family.make(3);
      DynamicsOptions options = by_all_rules;
      options.question.want = {Want::acceleration, Want::inverse_dynamics, Want::mass};
      options.question.locked = some_locked(model);
      options.question.at_rest = at_rest;
      options.question.q.resize(model.nq());
      const State<double> home = random_state(model, 9);
      std::copy(home.q.begin(), home.q.end(), options.question.q.begin());
      options.question.dofs = all_but(model.nv(), options.question.locked);
      options.question.dofs.erase(options.question.dofs.begin());
      SCOPED_TRACE(std::string(family.name) + (at_rest ? " at rest" : ""));
      expect_rows_agree_on_every_count_of_threads<TypeParam>(model, options);
    }
}

// --- objects

TYPED_TEST(Doors, MovedObjectsAnswerAsBefore) {
  using T = TypeParam;
  const Model<double> model = forest(3), other = floating_base(4);
  const State<T> s = random_state(model, 4).template cast<T>();
  const DynamicsOptions options{.question = about({}, model)};
  const auto answer = [&](Dynamics<T>& robot) {
    VectorX<T> a = poisoned<T>(model.nv());
    EXPECT_TRUE(robot.forward_dynamics(s.q, s.qd, s.tau, a));
    return a;
  };
  Dynamics<T> first = dynamics_of<T>(model, options);
  const VectorX<T> right = answer(first);
  ASSERT_TRUE(first.factor(s.q));
  Rows<T> rows(model, 100);
  EXPECT_EQ(rows.forward_dynamics(first, 2), 0);
  const std::vector<T> rows_right = rows.a;

  Dynamics<T> second(std::move(first));
  EXPECT_TRUE(answer(second) == right);
  Dynamics<T> third = dynamics_of<T>(other, {});
  third = std::move(second);
  EXPECT_EQ(third.nv(), model.nv());
  EXPECT_EQ(third.nq(), model.nq());
  EXPECT_TRUE(answer(third) == right);
  VectorX<T> x = poisoned<T>(model.nv());
  EXPECT_TRUE(third.solve(s.tau, x));
  EXPECT_TRUE(x.allFinite()) << "factors move along";
  EXPECT_EQ(rows.forward_dynamics(third, 3), 0);
  EXPECT_TRUE(rows.a == rows_right);

  first = dynamics_of<T>(model, options);  // what was moved from may be given a robot again
  EXPECT_TRUE(answer(first) == right);
  std::vector<Dynamics<T>> many;
  for (int i = 0; i < 5; ++i) many.push_back(dynamics_of<T>(model, options));
  for (Dynamics<T>& robot : many) EXPECT_TRUE(answer(robot) == right);
}

TYPED_TEST(Doors, ObjectsShareNothing) {
  using T = TypeParam;
  const Model<double> model = floating_base(5);
  const State<T> here = random_state(model, 4).template cast<T>();
  const State<T> there = random_state(model, 5).template cast<T>();
  const int nv = model.nv();
  std::optional<RobotModel> robot_model = plain(model);
  Dynamics<T> one(*robot_model), two(*robot_model), alone(*robot_model);
  robot_model.reset();
  VectorX<T> right = poisoned<T>(nv), x = right, a = right, b = right;
  ASSERT_TRUE(alone.factor(here.q));
  EXPECT_TRUE(alone.solve(here.tau, right));
  ASSERT_TRUE(one.factor(here.q));
  ASSERT_TRUE(two.factor(there.q));
  EXPECT_TRUE(one.solve(here.tau, x));
  EXPECT_TRUE(x == right);
  EXPECT_TRUE(two.forward_dynamics(there.q, there.qd, there.tau, a));
  EXPECT_TRUE(one.forward_dynamics(here.q, here.qd, here.tau, b));
  EXPECT_TRUE(two.forward_dynamics(there.q, there.qd, there.tau, b));
  EXPECT_TRUE(a == b);
  EXPECT_TRUE(one.solve(here.tau, x));
  EXPECT_TRUE(x == right);
}

TYPED_TEST(Doors, ARobotWithoutJointsHasEmptyAnswers) {
  using T = TypeParam;
  Dynamics<T> robot{RobotModel()};
  EXPECT_EQ(robot.nv(), 0);
  VectorX<T> none(0);
  MatrixX<T> X(0, 0);
  T log_det(1);
  EXPECT_TRUE(robot.forward_dynamics(none, none, none, none));
  robot.inverse_dynamics(none, none, none, none);
  robot.mass(none, X);
  EXPECT_TRUE(robot.inverse_mass(none, X));
  EXPECT_TRUE(robot.factor(none));
  EXPECT_TRUE(robot.solve(none, none));
  std::vector<Outcome> outcomes(2);
  EXPECT_EQ(robot.mass(none, none, outcomes), 0);
  EXPECT_EQ(robot.inverse_mass(none, none, outcomes), 0);
  EXPECT_EQ(robot.solve(none, none, none, outcomes), 0);
  EXPECT_TRUE(robot.diagonal(none, none));
  EXPECT_TRUE(robot.log_det(none, log_det));
  EXPECT_EQ(log_det, T(0));
  EXPECT_TRUE(robot.derivatives(none, none, none, {.dq = X, .dqd = X, .dtau = X}, none));
}

TEST(Dynamics, NamesItsInstructionSetAndForm) {
  EXPECT_NE(std::string(instruction_set()), "");
  EXPECT_EQ(dynamics_of<double>(chain(1, 2), {.tolerance = last_bits}).tolerance(), last_bits);
}

// That one part of several was answered by another rung is said, whatever a question adds.
TYPED_TEST(Doors, AHigherRungIsReportedWhateverIsAsked) {
  using T = TypeParam;
  Random random(3);
  Builder builder;
  for (int tree = 0; tree < 3; ++tree) {  // the second has a heavy tip
    int link = builder.add(random_joint(random, -1));
    for (int i = 0; tree == 1 && i < 10; ++i) link = builder.add(random_joint(random, link));
    Joint<double> tip = random_joint(random, link);
    if (tree == 1) {
      tip.body.mass *= 2e13;
      tip.body.moments *= 2e13;
    }
    builder.add(tip);
  }
  const Model<double> model = builder.build();
  const State<T> s = random_state(model, 4).template cast<T>();
  for (const bool rules : {true, false})
    for (const std::vector<int>& dofs : {std::vector<int>{}, std::vector<int>{0, 3}}) {
      DynamicsOptions options{.question = about(dofs, model)};
      if (!rules) options.rules = {};
      Dynamics<T> robot = dynamics_of<T>(model, options);
      const int n = robot.asked();
      VectorX<T> x(n);
      MatrixX<T> X(n, n), J(18, 18);
      T number;
      EXPECT_GT(robot.forward_dynamics(s.q, s.qd, s.tau, x).rung, Outcome::Rung::float64);
      EXPECT_GT(robot.inverse_mass(s.q, X).rung, Outcome::Rung::float64);
      EXPECT_GT(robot.factor(s.q).rung, Outcome::Rung::float64);
      EXPECT_GT(robot.diagonal(s.q, x).rung, Outcome::Rung::float64);
      EXPECT_GT(robot.operational(s.q, J).rung, Outcome::Rung::float64);
      VectorX<T> of_J(18);
      EXPECT_GT(robot.operational_diagonal(s.q, of_J).rung, Outcome::Rung::float64);
      if (rules) {
        EXPECT_GT(robot.log_det(s.q, number).rung, Outcome::Rung::float64);  // else by Cholesky
      }
      std::vector<Outcome> outcomes(1);
      EXPECT_EQ(robot.forward_dynamics(s.q, s.qd, s.tau, x, outcomes), 0);
      EXPECT_GT(outcomes[0].rung, Outcome::Rung::float64);
    }
}

}  // namespace
}  // namespace kalmarm::test
