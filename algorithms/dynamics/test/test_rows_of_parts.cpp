// Rows of parts of M^-1, its diagonal, log det M and J M^-1 J': what one state gets.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "algorithms/dynamics/plan.hpp"
#include "algorithms/dynamics/test/door_support.hpp"
#include "algorithms/fast/test/mechanisms_that_lose.hpp"
#include "algorithms/test/singular.hpp"

namespace kalmarm::test {
namespace {

template <class T>
class RowsOfParts : public testing::Test {};

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(RowsOfParts, Precisions, PrecisionName);

DynamicsOptions of_parts(const Model<double>& model, Tolerance tolerance = {},
                         std::set<Rule> rules = all_rules()) {
  return {.tolerance = tolerance,
          .question = {.want = {Want::diagonal, Want::log_det, Want::operational,
                                Want::operational_diagonal},
                       .frames = some_frames(model)},
          .rules = std::move(rules)};
}

// The answers to states, with guards behind them; poisoned before.
template <class T>
struct Answers {
  static constexpr int guard = 64;
  static constexpr T untouched = T(-77);

  struct Rows {
    int width;
    std::vector<T> x = {};
    std::vector<Outcome> outcomes = {};
    int failed = 0;
  };

  std::vector<T> q;
  int nq, count;
  Rows diagonal, log_det, operational, of_frames;

  Answers(const Dynamics<T>& robot, const Model<double>& model, int states)
      : nq(model.nq()),
        count(states),
        diagonal{robot.asked()},
        log_det{1},
        operational{18 * 18},
        of_frames{18} {
    for (int i = 0; i < count; ++i) {
      const VectorX<T> one = random_state(model, i).q.template cast<T>();
      q.insert(q.end(), one.begin(), one.end());
    }
  }

  void ask(Dynamics<T>& robot, int threads = 1) {
    const auto each = [&](Rows& rows, const auto& call) {
      rows.x.assign(std::size_t(count) * rows.width, std::numeric_limits<T>::quiet_NaN());
      rows.x.insert(rows.x.end(), guard, untouched);
      rows.outcomes.assign(count, Outcome{.status = Outcome::Status::indefinite});
      rows.failed = call(RowsView<T>(rows.x.data(), count, rows.width), rows.outcomes);
      EXPECT_TRUE(
          std::all_of(rows.x.end() - guard, rows.x.end(), [](T y) { return y == untouched; }));
      EXPECT_EQ(rows.failed,
                std::ranges::count_if(rows.outcomes, [](const Outcome& one) { return !one; }));
    };
    using View = RowsView<T>;
    using Outcomes = std::vector<Outcome>;
    each(diagonal, [&](View x, Outcomes& out) { return robot.diagonal(q, x, out, threads); });
    each(log_det, [&](View x, Outcomes& out) { return robot.log_det(q, x, out, threads); });
    each(operational, [&](View x, Outcomes& out) { return robot.operational(q, x, out, threads); });
    each(of_frames,
         [&](View x, Outcomes& out) { return robot.operational_diagonal(q, x, out, threads); });
  }

  VectorX<T> q_of(int i) const { return Eigen::Map<const VectorX<T>>(&q[i * nq], nq); }
  static VectorX<T> of(const Rows& rows, int i) {
    return Eigen::Map<const VectorX<T>>(&rows.x[std::size_t(i) * rows.width], rows.width);
  }
};

template <class T>
struct One {
  VectorX<T> diagonal;
  T log_det = std::numeric_limits<T>::quiet_NaN();
  MatrixX<T> operational;
  VectorX<T> of_frames;
  Outcome of_diagonal, of_log_det, of_operational;

  One(Dynamics<T>& robot, const VectorX<T>& q)
      : diagonal(poisoned<T>(robot.asked())),
        operational(poisoned<T>(18, 18)),
        of_frames(poisoned<T>(18)) {
    of_diagonal = robot.diagonal(q, diagonal);
    of_log_det = robot.log_det(q, log_det);
    of_operational = robot.operational(q, operational);
    EXPECT_EQ(robot.operational_diagonal(q, of_frames).status, of_operational.status);
  }
};

// By how many u log det M of Cholesky moves where every link rounds M once, of one state or of rows:
//   |dL| <= sum of |M^-1(i,j)| |dM(i,j)|
template <class T>
double rounding_of_M(const Model<double>& model, const VectorX<T>& q) {
  Dynamics<double> exact(plain(model), {.question = {.want = {Want::mass, Want::inverse}}});
  const int nv = model.nv();
  MatrixX<double> M(nv, nv), X(nv, nv);
  const VectorX<double> at = q.template cast<double>();
  exact.mass(at, M);
  EXPECT_TRUE(exact.inverse_mass(at, X));
  const VectorX<double> root = M.diagonal().cwiseSqrt();
  return nv * root.dot(X.cwiseAbs() * root);
}

template <class T>
void expect_as_one_state(const Model<double>& model, const DynamicsOptions& options, int count) {
  Dynamics<T> robot = dynamics_of<T>(model, options), one = dynamics_of<T>(model, options);
  Answers<T> rows(robot, model, count);
  rows.ask(robot);
  EXPECT_EQ(
      rows.diagonal.failed + rows.log_det.failed + rows.operational.failed + rows.of_frames.failed,
      0);
  const double u = static_cast<double>(unit_roundoff<T>());
  for (int i = 0; i < count; ++i) {
    const One<T> right(one, rows.q_of(i));
    const VectorX<T> x = rows.of(rows.diagonal, i);
    for (int k = 0; k < x.size(); ++k)  // positive, each in units of its own
      ASSERT_LE(std::abs(static_cast<double>(x[k] - right.diagonal[k])),
                4000 * u * static_cast<double>(right.diagonal[k]))
          << "state " << i << " DoF " << k;
    const double L = static_cast<double>(right.log_det);
    const double scale = robot.plan().partial_answers ? 4000 * std::max(1.0, std::abs(L))
                                                      : rounding_of_M(model, rows.q_of(i));
    ASSERT_LE(std::abs(static_cast<double>(rows.log_det.x[i]) - L), scale * u) << "state " << i;
    const VectorX<T> X = rows.of(rows.operational, i);
    const Eigen::Map<const VectorX<T>> right_X(right.operational.data(), 18 * 18);
    ASSERT_LE((X - right_X).norm(), 4000 * u * right_X.norm()) << "state " << i;
    const VectorX<T> y = rows.of(rows.of_frames, i);
    for (const VectorX<T>& should : {right.of_frames, VectorX<T>(right.operational.diagonal())})
      ASSERT_LE((y - should).norm(), 4000 * u * should.norm()) << "state " << i;
  }
}

// Trees, free bases, ball joints, slides, rotors, parts; all forms.
TYPED_TEST(RowsOfParts, AreWhatOneStateGets) {
  for (const Family& family : families_and_robots()) {
    if (std::string(family.name) == "massless_links") continue;  // errors there are not a few u
    for (const Tolerance tolerance : tolerances)
      for (const std::set<Rule>& rules : {all_rules(), std::set<Rule>{}}) {
        SCOPED_TRACE(std::string(family.name) + " " + name_of(tolerance));
        const Model<double> model = family.make(3);
        expect_as_one_state<TypeParam>(model, of_parts(model, tolerance, rules), 19);
      }
  }
}

// Of which the longer ones are by Lambda.
TYPED_TEST(RowsOfParts, AreWhatOneStateGetsInEveryCountAndSize) {
  for (const Model<double>& model : {chain(3, 1), creature(3), floating_base(3)})
    for (int count = 0; count <= 34; ++count)
      expect_as_one_state<TypeParam>(model, of_parts(model), count);
  for (int n = 1; n <= 100; n += n < 20 ? 1 : 16)
    expect_as_one_state<TypeParam>(chain(5, n), of_parts(chain(5, n)), 17);
}

// Of joints that are locked, and of some that are asked about.
TYPED_TEST(RowsOfParts, AnswerQuestions) {
  for (const Family& family : robots()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = family.make(3);
    DynamicsOptions options = of_parts(model, Tolerance(), all_rules());
    options.question.locked = some_locked(model);
    const State<double> home = random_state(model, 9);
    options.question.q.assign(home.q.begin(), home.q.end());
    options.question.dofs = all_but(model.nv(), options.question.locked);
    options.question.dofs.erase(options.question.dofs.begin());
    expect_as_one_state<TypeParam>(model, options, 19);
  }
}

TYPED_TEST(RowsOfParts, AgreeToTheBitOnEveryCountOfThreads) {
  using T = TypeParam;
  for (const Family& family : robots())
    for (const int count : {1, 64, 131}) {
      SCOPED_TRACE(family.name);
      const Model<double> model = family.make(3);
      Dynamics<T> robot = dynamics_of<T>(model, of_parts(model)),
                  alone = dynamics_of<T>(model, of_parts(model));
      Answers<T> right(alone, model, count), rows = right;
      right.ask(alone);
      for (const int threads : {1, 2, 3, 2}) {
        rows.ask(robot, threads);
        EXPECT_TRUE(rows.diagonal.x == right.diagonal.x && rows.log_det.x == right.log_det.x &&
                    rows.operational.x == right.operational.x &&
                    rows.of_frames.x == right.of_frames.x)
            << threads;
      }
    }
}

// One row is at gimbal lock or near it, and one is not finite.
TYPED_TEST(RowsOfParts, ASuspectDoesNotTouchItsNeighbours) {
  using T = TypeParam;
  for (const Mechanism& mechanism : singular_mechanisms(1)) {
    if (mechanism.name != "gimbal_lock" && mechanism.name != "oblique_gimbal_lock") continue;
    for (const double distance :
         {0.0, std::is_same_v<T, float> ? 2e-3 : 1e-6, std::numeric_limits<double>::quiet_NaN()})
      for (const int at : {0, 3, 16, 18}) {
        SCOPED_TRACE(mechanism.name + " row " + std::to_string(at));
        const Model<double>& model = mechanism.model;
        Dynamics<T> robot = dynamics_of<T>(model, of_parts(model)),
                    one = dynamics_of<T>(model, of_parts(model));
        Answers<T> rows(robot, model, 19), undisturbed = rows;
        undisturbed.ask(robot);
        const VectorX<T> q = (mechanism.q.array() + distance).matrix().template cast<T>();
        std::copy(q.begin(), q.end(), &rows.q[at * rows.nq]);
        rows.ask(robot);
        for (int i = 0; i < rows.count; ++i) {
          if (i != at) {
            EXPECT_TRUE(rows.of(rows.diagonal, i) == rows.of(undisturbed.diagonal, i));
            EXPECT_EQ(rows.log_det.x[i], undisturbed.log_det.x[i]);
            EXPECT_TRUE(rows.of(rows.operational, i) == rows.of(undisturbed.operational, i));
            EXPECT_TRUE(rows.of(rows.of_frames, i) == rows.of(undisturbed.of_frames, i));
            continue;
          }
          const One<T> right(one, q);
          EXPECT_EQ(rows.diagonal.outcomes[i].status, right.of_diagonal.status);
          EXPECT_EQ(rows.log_det.outcomes[i].status, right.of_log_det.status);
          EXPECT_EQ(rows.operational.outcomes[i].status, right.of_operational.status);
          EXPECT_EQ(rows.of_frames.outcomes[i].status, right.of_operational.status);
          EXPECT_EQ(rows.diagonal.outcomes[i].status == Outcome::Status::singular, distance == 0);
          EXPECT_EQ(rows.log_det.outcomes[i].status == Outcome::Status::not_finite,
                    std::isnan(distance));
          if (!right.of_diagonal) continue;
          EXPECT_GT(rows.diagonal.outcomes[i].rung, Outcome::Rung::float64);
          EXPECT_TRUE(rows.of(rows.diagonal, i) == right.diagonal);
          EXPECT_EQ(rows.log_det.x[i], right.log_det);
          EXPECT_TRUE(rows.of(rows.operational, i) ==
                      Eigen::Map<const VectorX<T>>(right.operational.data(), 18 * 18));
          EXPECT_TRUE(rows.of(rows.of_frames, i) == right.of_frames);
        }
      }
  }
}

TYPED_TEST(RowsOfParts, WhatDoesNotFitOrIsNotWantedIsRefused) {
  using T = TypeParam;
  const Model<double> model = creature(1);
  Dynamics<T> robot = dynamics_of<T>(model, of_parts(model));
  const int n = model.nv(), nq = model.nq();
  std::vector<Outcome> two(2);
  std::vector<T> q(2 * nq), x(2 * n), L(2), X(2 * 18 * 18);
  EXPECT_THROW((void)robot.diagonal(x, x, two), std::invalid_argument);
  EXPECT_THROW((void)robot.diagonal(q, L, two), std::invalid_argument);
  EXPECT_THROW((void)robot.log_det(q, x, two), std::invalid_argument);
  EXPECT_THROW((void)robot.operational(q, x, two), std::invalid_argument);
  Dynamics<T> other = dynamics_of<T>(model, {.question = {.want = {Want::mass}}});
  EXPECT_THROW((void)other.diagonal(q, x, two), std::logic_error);
  EXPECT_THROW((void)other.log_det(q, L, two), std::logic_error);
  EXPECT_THROW((void)other.operational(q, X, two), std::logic_error);
}

}  // namespace
}  // namespace kalmarm::test
