// Rows of M, M^-1 and M^-1 tau: what one state gets, whatever the other rows hold.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "algorithms/dynamics/test/door_support.hpp"
#include "algorithms/fast/engine/engine.hpp"
#include "algorithms/fast/test/mechanisms_that_lose.hpp"
#include "algorithms/test/singular.hpp"

namespace kalmarm::test {
namespace {

// Whether another rung than the first that lanes of T have gave the answer to a row.
template <class T>
bool climbed(const Outcome& row) {
  return row.rung > answered_in_lanes<T>().rung;
}

template <class T>
class RowsOfM : public testing::Test {};

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(RowsOfM, Precisions, PrecisionName);

// The three answers to states, with guards behind them; poisoned before.
template <class T>
struct Answers {
  static constexpr int guard = 64;
  static constexpr T untouched = T(-77);

  std::vector<T> q, tau, M, X, x;
  std::vector<Outcome> of_M, of_X, of_x;
  int failed_M = 0, failed_X = 0, failed_x = 0;
  int n, nq, count;

  // Of robots with n joints asked about; tau may be longer than is needed.
  Answers(const Dynamics<T>& robot, const Model<double>& model, int states)
      : n(robot.asked()), nq(model.nq()), count(states) {
    for (int i = 0; i < count; ++i) {
      const State<T> s = random_state(model, i).template cast<T>();
      q.insert(q.end(), s.q.begin(), s.q.end());
      tau.insert(tau.end(), s.tau.begin(), s.tau.begin() + n);
    }
  }

  void ask(Dynamics<T>& robot, int threads = 1) {
    const auto clear = [&](std::vector<T>& out, int width, std::vector<Outcome>& outcomes) {
      out.assign(std::size_t(count) * width, std::numeric_limits<T>::quiet_NaN());
      out.insert(out.end(), guard, untouched);
      outcomes.assign(count, Outcome{.status = Outcome::Status::indefinite});
    };
    clear(M, n * n, of_M);
    clear(X, n * n, of_X);
    clear(x, n, of_x);
    const RowsView<const T> tau_rows(tau.data(), count, n);
    failed_M = robot.mass(q, RowsView<T>(M.data(), count, n * n), of_M, threads);
    failed_X = robot.inverse_mass(q, RowsView<T>(X.data(), count, n * n), of_X, threads);
    failed_x = robot.solve(q, tau_rows, RowsView<T>(x.data(), count, n), of_x, threads);
    for (const std::vector<T>* out : {&M, &X, &x})
      EXPECT_TRUE(std::all_of(out->end() - guard, out->end(), [](T y) { return y == untouched; }));
    const auto failures = [](const std::vector<Outcome>& all) {
      return std::ranges::count_if(all, [](const Outcome& one) { return !one; });
    };
    EXPECT_EQ(failed_M, failures(of_M));
    EXPECT_EQ(failed_X, failures(of_X));
    EXPECT_EQ(failed_x, failures(of_x));
  }

  VectorX<T> q_of(int i) const { return Eigen::Map<const VectorX<T>>(&q[i * nq], nq); }
  VectorX<T> tau_of(int i) const { return Eigen::Map<const VectorX<T>>(&tau[i * n], n); }
  MatrixX<T> M_of(int i) const { return Eigen::Map<const MatrixX<T>>(&M[i * n * n], n, n); }
  MatrixX<T> X_of(int i) const { return Eigen::Map<const MatrixX<T>>(&X[i * n * n], n, n); }
  VectorX<T> x_of(int i) const { return Eigen::Map<const VectorX<T>>(&x[i * n], n); }
};

// Of one state at a time.
template <class T>
struct One {
  MatrixX<T> M, X;
  VectorX<T> x;
  Outcome of_X, of_x;

  One(Dynamics<T>& robot, const VectorX<T>& q, const VectorX<T>& tau)
      : M(poisoned<T>(robot.asked(), robot.asked())), X(M), x(poisoned<T>(robot.asked())) {
    robot.mass(q, M);
    of_X = robot.inverse_mass(q, X);
    of_x = robot.factor(q);
    if (of_x) of_x = robot.solve(tau, x);
  }
};

DynamicsOptions of_M(Tolerance tolerance = {}, std::set<Rule> rules = all_rules()) {
  return {.tolerance = tolerance,
          .question = {.want = {Want::mass, Want::inverse, Want::solve}},
          .rules = std::move(rules)};
}

// Largest |difference| / sqrt(diagonal diagonal): joints may have any units.
template <class T>
double scaled(const MatrixX<T>& X, const MatrixX<T>& right) {
  const VectorX<double> d = right.template cast<double>().diagonal().cwiseSqrt().cwiseInverse();
  const MatrixX<double> wrong = (X - right).template cast<double>();
  return X.rows() > 0 ? (d.asDiagonal() * wrong * d.asDiagonal()).cwiseAbs().maxCoeff() : 0;
}

template <class T>
void expect_as_one_state(const Model<double>& model, const DynamicsOptions& options, int count) {
  Dynamics<T> robot = dynamics_of<T>(model, options), one = dynamics_of<T>(model, options);
  Answers<T> rows(robot, model, count);
  rows.ask(robot);
  EXPECT_EQ(rows.failed_M + rows.failed_X + rows.failed_x, 0);
  const double u = static_cast<double>(unit_roundoff<T>());
  for (int i = 0; i < count; ++i) {
    const One<T> right(one, rows.q_of(i), rows.tau_of(i));
    const MatrixX<T> M = rows.M_of(i), X = rows.X_of(i);
    EXPECT_TRUE(M == M.transpose());
    EXPECT_TRUE(X == X.transpose());
    ASSERT_LE(scaled(M, right.M), 200 * u) << "state " << i << " of " << count;
    ASSERT_LE((X - right.X).norm(), 4000 * u * right.X.norm()) << "state " << i << " of " << count;
    ASSERT_LE((rows.x_of(i) - right.x).norm(), 4000 * u * right.X.norm() * rows.tau_of(i).norm());
  }
}

// Trees, free bases, ball joints, slides, rotors, parts; all forms.
TYPED_TEST(RowsOfM, AreWhatOneStateGets) {
  for (const Family& family : families_and_robots()) {
    if (std::string(family.name) == "massless_links") continue;  // errors there are not a few u
    for (const Tolerance tolerance : tolerances)
      for (const std::set<Rule>& rules : {all_rules(), std::set<Rule>{}}) {
        SCOPED_TRACE(std::string(family.name) + " " + name_of(tolerance));
        expect_as_one_state<TypeParam>(family.make(3), of_M(tolerance, rules), 19);
      }
  }
}

// Registers that are full and not, from one state on.
TYPED_TEST(RowsOfM, AreWhatOneStateGetsInEveryCount) {
  for (const Model<double>& model : {chain(3, 1), chain(3, 2), creature(3), floating_base(3)})
    for (int count = 0; count <= 34; ++count) expect_as_one_state<TypeParam>(model, of_M(), count);
}

// On either side of the size from which states are answered one after another.
TYPED_TEST(RowsOfM, AreWhatOneStateGetsInEverySize) {
  for (int n = 1; n <= 40; ++n) expect_as_one_state<TypeParam>(chain(5, n), of_M(), 17);
  for (int n = 94; n <= 99; ++n) expect_as_one_state<TypeParam>(chain(5, n), of_M(), 17);
}

TYPED_TEST(RowsOfM, AreWhatOneStateGetsOfOneBody) {
  for (const Model<double>& model : single_bodies())
    expect_as_one_state<TypeParam>(model, of_M(), 11);
}

// Of joints that are locked, and of some that are asked about.
TYPED_TEST(RowsOfM, AnswerQuestions) {
  for (const Family& family : robots())
    for (const bool at_rest : {false, true}) {
      SCOPED_TRACE(family.name);
      const Model<double> model = family.make(3);
      DynamicsOptions options = of_M(Tolerance(), all_rules());
      options.question.locked = some_locked(model);
      options.question.at_rest = at_rest;
      const State<double> home = random_state(model, 9);
      options.question.q.assign(home.q.begin(), home.q.end());
      options.question.dofs = all_but(model.nv(), options.question.locked);
      options.question.dofs.erase(options.question.dofs.begin());
      expect_as_one_state<TypeParam>(model, options, 19);
    }
}

// Within a few roundings of what is right to 50 digits.
TYPED_TEST(RowsOfM, AgreeWithMultiPrecision) {
  using T = TypeParam;
  const double u = static_cast<double>(unit_roundoff<T>());
  for (const Family& family : all_families()) {
    // Near gimbal lock M^-1 loses what the condition of M allows.
    const double allowed = (std::string(family.name) == "massless_links" ? 1600 : 80) * u;
    SCOPED_TRACE(family.name);
    const Model<double> model = rounded<T>(family.make(3));
    Dynamics<T> robot = dynamics_of<T>(model, of_M());
    Answers<T> rows(robot, model, 17);
    rows.ask(robot);
    for (const int i : {0, 5, 16}) {
      const Truth truth(model, rounded<T>(random_state(model, i)));
      EXPECT_LE(truth.mass(rows.M_of(i)), 80 * u) << i;
      EXPECT_LE(truth.inverse(rows.X_of(i)), allowed) << i;
      EXPECT_LE(truth.solution(rows.x_of(i)), allowed) << i;
    }
  }
}

// To the bit, and nothing else is written.
TYPED_TEST(RowsOfM, AgreeToTheBitOnEveryCountOfThreads) {
  using T = TypeParam;
  for (const Family& family : robots())
    for (const Tolerance tolerance : tolerances)
      for (const int count : {1, 64, 131}) {
        SCOPED_TRACE(std::string(family.name) + " " + name_of(tolerance));
        const Model<double> model = family.make(3);
        Dynamics<T> robot = dynamics_of<T>(model, of_M(tolerance)),
                    alone = dynamics_of<T>(model, of_M(tolerance));
        Answers<T> right(alone, model, count), rows = right;
        right.ask(alone);
        for (const int threads : {1, 2, 3, 2}) {
          rows.ask(robot, threads);
          EXPECT_TRUE(rows.M == right.M && rows.X == right.X && rows.x == right.x) << threads;
        }
      }
}

// One row is at gimbal lock, where M is singular, or so near that a D is lost in rounding: it alone is
// refused, or answered by the certified form.
TYPED_TEST(RowsOfM, ASuspectDoesNotTouchItsNeighbours) {
  using T = TypeParam;
  const double u = static_cast<double>(unit_roundoff<T>());
  for (const Mechanism& mechanism : singular_mechanisms(1)) {
    if (mechanism.name != "gimbal_lock" && mechanism.name != "oblique_gimbal_lock") continue;
    for (const double distance : {0.0, std::is_same_v<T, float> ? 2e-3 : 1e-6})
      for (const int at : {0, 3, 16, 18}) {
        SCOPED_TRACE(mechanism.name + " row " + std::to_string(at));
        const Model<double>& model = mechanism.model;
        Dynamics<T> robot = dynamics_of<T>(model, of_M()), one = dynamics_of<T>(model, of_M());
        Answers<T> rows(robot, model, 19), undisturbed = rows;
        undisturbed.ask(robot);
        const VectorX<T> q = (mechanism.q.array() + distance).matrix().template cast<T>();
        std::copy(q.begin(), q.end(), &rows.q[at * rows.nq]);
        rows.ask(robot);
        EXPECT_EQ(rows.failed_M, 0);
        for (int i = 0; i < rows.count; ++i) {
          if (i != at) {
            EXPECT_TRUE(rows.of_X[i] && rows.of_x[i]);
            EXPECT_TRUE(rows.X_of(i) == undisturbed.X_of(i) && rows.x_of(i) == undisturbed.x_of(i));
            continue;
          }
          const One<T> right(one, q, rows.tau_of(i));
          EXPECT_EQ(rows.of_X[i].status, right.of_X.status);
          EXPECT_EQ(rows.of_x[i].status, right.of_x.status);
          if (distance == 0) {
            EXPECT_EQ(rows.of_X[i].status, Outcome::Status::singular);
            EXPECT_EQ(rows.of_x[i].status, Outcome::Status::singular);
            EXPECT_TRUE(std::ranges::count(mechanism.joints, rows.of_X[i].joint));
          } else {
            EXPECT_TRUE(climbed<T>(rows.of_X[i]) && climbed<T>(rows.of_x[i]));
            EXPECT_TRUE(rows.X_of(i) == right.X && rows.x_of(i) == right.x);
            State<double> s = rounded<T>(random_state(model, i));
            s.q = q.template cast<double>();
            EXPECT_LE(Truth(rounded<T>(model), s).inverse(rows.X_of(i)), 2000 * u);
          }
        }
      }
  }
}

// Mechanisms on which covariances lose digits: what is not refused is as right as one state's answer,
// which is promised to be, row by row.
TYPED_TEST(RowsOfM, AreAsRightAsPromisedWhereDigitsAreLost) {
  using T = TypeParam;
  const double promised = std::is_same_v<T, float> ? 1e-2 : 1e-6;
  int climbs = 0, believed = 0;
  std::vector<Model<double>> models{com_inboard(12), com_inboard(30)};
  for (int seed = 0; seed < 20; ++seed) models.push_back(wild(seed));
  for (const double heaviest : {1e1, 1e3, 1e6, 1e9}) {
    const double by = std::is_same_v<T, float> ? heaviest : heaviest * heaviest;
    models.push_back(growing(1, by));
  }
  for (const Model<double>& drawn : models) {
    const Model<double> model = rounded<T>(drawn);
    Dynamics<T> robot = dynamics_of<T>(model, of_M()), one = dynamics_of<T>(model, of_M());
    Answers<T> rows(robot, model, 11);
    rows.ask(robot);
    for (int i = 0; i < rows.count; ++i) {
      const One<T> right(one, rows.q_of(i), rows.tau_of(i));
      EXPECT_EQ(rows.of_X[i].status, right.of_X.status);
      EXPECT_EQ(rows.of_x[i].status, right.of_x.status);
      climbs += climbed<T>(rows.of_X[i]);
      believed += rows.of_X[i] && !climbed<T>(rows.of_X[i]);
      if (!rows.of_X[i] || rows.of_X[i].warns()) continue;
      EXPECT_LE(scaled(rows.X_of(i), right.X), 2 * promised) << i;
      if (!rows.of_x[i] || rows.of_x[i].warns()) continue;
      EXPECT_LE((rows.x_of(i) - right.x).norm(), 2 * promised * right.x.norm()) << i;
    }
  }
  EXPECT_GT(climbs, 0);
  EXPECT_GT(believed, 0);
}

TYPED_TEST(RowsOfM, ARowThatIsNotFiniteFailsAlone) {
  using T = TypeParam;
  constexpr T nan = std::numeric_limits<T>::quiet_NaN();
  for (const Family& family : robots())
    for (const Tolerance tolerance : tolerances)
      for (const int at : {0, 4, 18}) {
        if (std::string(family.name) == "eight_slides") continue;  // whose M no position moves
        SCOPED_TRACE(std::string(family.name) + " " + name_of(tolerance));
        const Model<double> model = family.make(3);
        Dynamics<T> robot = dynamics_of<T>(model, of_M(tolerance));
        Answers<T> rows(robot, model, 19), undisturbed = rows;
        undisturbed.ask(robot);
        for (int i = 0; i < rows.nq; ++i) rows.q[at * rows.nq + i] = nan;
        rows.ask(robot);
        EXPECT_EQ(rows.failed_M, 1);
        EXPECT_EQ(rows.failed_X, 1);
        EXPECT_EQ(rows.failed_x, 1);
        EXPECT_EQ(rows.of_M[at].status, Outcome::Status::not_finite);
        EXPECT_EQ(rows.of_X[at].status, Outcome::Status::not_finite);
        EXPECT_EQ(rows.of_x[at].status, Outcome::Status::not_finite);
        for (int i = 0; i < rows.count; ++i)
          if (i != at) {
            EXPECT_TRUE(rows.M_of(i) == undisturbed.M_of(i)) << i;
            EXPECT_TRUE(rows.X_of(i) == undisturbed.X_of(i)) << i;
            EXPECT_TRUE(rows.x_of(i) == undisturbed.x_of(i)) << i;
          }

        rows = undisturbed;
        rows.tau[at * rows.n + rows.n - 1] = nan;
        rows.ask(robot);
        EXPECT_EQ(rows.failed_M + rows.failed_X, 0);
        EXPECT_EQ(rows.failed_x, 1);
        EXPECT_EQ(rows.of_x[at].status, Outcome::Status::not_finite);
      }
}

TYPED_TEST(RowsOfM, WhatDoesNotFitOverlapsOrIsNotWantedIsRefused) {
  using T = TypeParam;
  const Model<double> model = creature(1);
  Dynamics<T> robot = dynamics_of<T>(model, of_M());
  const int n = model.nv(), nq = model.nq();
  std::vector<Outcome> two(2);
  std::vector<T> q(2 * nq), X(2 * n * n), tau(2 * n), x(2 * n);
  const RowsView<T> narrow(X.data(), 2, n);
  EXPECT_THROW((void)robot.mass(q, narrow, two), std::invalid_argument);
  EXPECT_THROW((void)robot.inverse_mass(q, narrow, two), std::invalid_argument);
  EXPECT_THROW((void)robot.inverse_mass(tau, X, two), std::invalid_argument);
  EXPECT_THROW((void)robot.solve(q, X, x, two), std::invalid_argument);
  EXPECT_THROW((void)robot.solve(q, tau, X, two), std::invalid_argument);
  EXPECT_THROW((void)robot.solve(q, x, x, two), std::invalid_argument);
  Dynamics<T> other = dynamics_of<T>(model, {.question = {.want = {Want::diagonal}}});
  EXPECT_THROW((void)other.mass(q, X, two), std::logic_error);
  EXPECT_THROW((void)other.inverse_mass(q, X, two), std::logic_error);
  EXPECT_THROW((void)other.solve(q, tau, x, two), std::logic_error);
}

}  // namespace
}  // namespace kalmarm::test
