// Rows of derivatives: what one state gets, whatever the other rows hold.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "algorithms/dynamics/test/door_support.hpp"
#include "algorithms/fast/claims/tuning.hpp"
#include "algorithms/fast/test/derivatives_support.hpp"
#include "algorithms/fast/test/mechanisms_that_lose.hpp"
#include "algorithms/test/singular.hpp"

namespace kalmarm::test {
namespace {

template <class T>
class RowsOfDerivatives : public testing::Test {};

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(RowsOfDerivatives, Precisions, PrecisionName);

DynamicsOptions of_derivatives(Tolerance tolerance = {}, std::set<Rule> rules = all_rules()) {
  return {
      .tolerance = tolerance, .question = {.want = {Want::derivatives}}, .rules = std::move(rules)};
}

// Of states, with guards behind the answers; poisoned before.
template <class T>
struct Answers {
  static constexpr int guard = 64;
  static constexpr T untouched = T(-77);

  std::vector<T> q, qd, tau, dq, dqd, dtau, a;
  std::vector<Outcome> outcomes;
  int n, nq, nv, count, failed = 0;

  Answers(const Dynamics<T>& robot, const Model<double>& model, int states)
      : n(robot.asked()), nq(model.nq()), nv(model.nv()), count(states) {
    for (int i = 0; i < count; ++i) {
      const State<T> s = random_state(model, i).template cast<T>();
      q.insert(q.end(), s.q.begin(), s.q.end());
      qd.insert(qd.end(), s.qd.begin(), s.qd.end());
      tau.insert(tau.end(), s.tau.begin(), s.tau.end());
    }
  }

  void ask(Dynamics<T>& robot, int threads = 1) {
    const auto clear = [&](std::vector<T>& out, int width) {
      out.assign(std::size_t(count) * width, std::numeric_limits<T>::quiet_NaN());
      out.insert(out.end(), guard, untouched);
    };
    for (std::vector<T>* X : {&dq, &dqd, &dtau}) clear(*X, n * n);
    clear(a, n);
    outcomes.assign(count, Outcome{.status = Outcome::Status::indefinite});
    const auto rows = [&](std::vector<T>& X, int width) {
      return RowsView<T>(X.data(), count, width);
    };
    failed = robot.derivatives(
        q, qd, tau, {.dq = rows(dq, n * n), .dqd = rows(dqd, n * n), .dtau = rows(dtau, n * n)},
        rows(a, n), outcomes, threads);
    for (const std::vector<T>* out : {&dq, &dqd, &dtau, &a})
      EXPECT_TRUE(std::all_of(out->end() - guard, out->end(), [](T y) { return y == untouched; }));
    EXPECT_EQ(failed, std::ranges::count_if(outcomes, [](const Outcome& one) { return !one; }));
  }

  State<T> state(int i) const {
    const auto of = [i](const std::vector<T>& rows, int width) -> VectorX<T> {
      return Eigen::Map<const VectorX<T>>(&rows[std::size_t(i) * width], width);
    };
    return {of(q, nq), of(qd, nv), of(tau, nv)};
  }

  AccelerationDerivatives<T> of(int i) const {
    AccelerationDerivatives<T> out(0);
    const auto matrix = [&](const std::vector<T>& rows) -> MatrixX<T> {
      return Eigen::Map<const MatrixX<T>>(&rows[std::size_t(i) * n * n], n, n);
    };
    out.dq = matrix(dq);
    out.dqd = matrix(dqd);
    out.dtau = matrix(dtau);
    out.a = Eigen::Map<const VectorX<T>>(&a[std::size_t(i) * n], n);
    return out;
  }
};

template <class T>
struct One {
  AccelerationDerivatives<T> out;
  Outcome outcome;

  One(Dynamics<T>& robot, const State<T>& s) : out(robot.asked()) {
    outcome = robot.derivatives(s.q, s.qd, s.tau, {.dq = out.dq, .dqd = out.dqd, .dtau = out.dtau},
                                out.a);
  }
};

template <class T>
bool equal(const AccelerationDerivatives<T>& x, const AccelerationDerivatives<T>& y) {
  return x.dq == y.dq && x.dqd == y.dqd && x.dtau == y.dtau && x.a == y.a;
}

// Both err by a few tens of roundoffs of the largest entries: those of M^-1, and what forces and
// velocities make of them.
template <class T>
void expect_as_one_state(const Model<double>& model, const DynamicsOptions& options, int count) {
  Dynamics<T> robot = dynamics_of<T>(model, options), one = dynamics_of<T>(model, options);
  Answers<T> rows(robot, model, count);
  rows.ask(robot);
  EXPECT_EQ(rows.failed, 0);
  const double u = static_cast<double>(unit_roundoff<T>());
  const auto near = [u](const auto& x, const auto& right, double scale) {
    return (x - right).template cast<double>().norm() <= 4000 * u * scale;
  };
  for (int i = 0; i < count; ++i) {
    const One<T> right(one, rows.state(i));
    const AccelerationDerivatives<T> row = rows.of(i);
    const double size = std::max(1.0, static_cast<double>(right.out.dtau.norm()));
    const auto scale = [size](const auto& x) {
      return std::max(size, static_cast<double>(x.norm()));
    };
    EXPECT_TRUE(row.dtau == row.dtau.transpose());
    EXPECT_TRUE(std::isnan(rows.outcomes[i].error));
    EXPECT_EQ(rows.outcomes[i].warns(), right.outcome.warns());
    ASSERT_TRUE(near(row.dtau, right.out.dtau, size)) << "state " << i << " of " << count;
    ASSERT_TRUE(near(row.dq, right.out.dq, scale(right.out.dq))) << "state " << i;
    ASSERT_TRUE(near(row.dqd, right.out.dqd, scale(right.out.dqd))) << "state " << i;
    ASSERT_TRUE(near(row.a, right.out.a, scale(right.out.a))) << "state " << i;
  }
}

// Trees, free bases, ball joints, slides, rotors, parts; all forms.
TYPED_TEST(RowsOfDerivatives, AreWhatOneStateGets) {
  for (const Family& family : families_and_robots()) {
    if (std::string(family.name) == "massless_links") continue;  // errors there are not a few u
    for (const Tolerance tolerance : tolerances)
      for (const std::set<Rule>& rules : {all_rules(), std::set<Rule>{}}) {
        SCOPED_TRACE(std::string(family.name) + " " + name_of(tolerance));
        expect_as_one_state<TypeParam>(family.make(3), of_derivatives(tolerance, rules), 19);
      }
  }
}

// Registers that are full and not, from one state on.
TYPED_TEST(RowsOfDerivatives, AreWhatOneStateGetsInEveryCount) {
  for (const Model<double>& model : {chain(3, 1), chain(3, 2), creature(3), floating_base(3)})
    for (int count = 0; count <= 34; ++count)
      expect_as_one_state<TypeParam>(model, of_derivatives(), count);
}

// On either side of the size from which states are answered one after another.
TYPED_TEST(RowsOfDerivatives, AreWhatOneStateGetsInEverySize) {
  for (int n = 1; n <= 40; ++n) expect_as_one_state<TypeParam>(chain(5, n), of_derivatives(), 17);
  for (const int n : {most_derivatives_in_lanes, most_derivatives_in_lanes + 1})
    expect_as_one_state<TypeParam>(chain(5, n), of_derivatives(), 17);
}

TYPED_TEST(RowsOfDerivatives, AreWhatOneStateGetsOfOneBody) {
  for (const Model<double>& model : single_bodies())
    expect_as_one_state<TypeParam>(model, of_derivatives(), 11);
}

// Of joints that are locked, of a robot at rest, and of some DoF that are asked about.
TYPED_TEST(RowsOfDerivatives, AnswerQuestions) {
  for (const Family& family : families_and_robots())
    for (const bool at_rest : {false, true})
      for (const bool some : {false, true}) {
        SCOPED_TRACE(family.name);
        if (std::string(family.name) == "massless_links") continue;
        const Model<double> model = family.make(3);
        DynamicsOptions options = of_derivatives(Tolerance(), all_rules());
        options.question.at_rest = at_rest;
        const State<double> home = random_state(model, 9);
        options.question.q.assign(home.q.begin(), home.q.end());
        if (some) {
          options.question.locked = some_locked(model);
          options.question.dofs = all_but(model.nv(), options.question.locked);
          options.question.dofs.erase(options.question.dofs.begin());
        }
        expect_as_one_state<TypeParam>(model, options, 19);
      }
}

TYPED_TEST(RowsOfDerivatives, AgreeWithDifferencesOfTruth) {
  using T = TypeParam;
  const double u = static_cast<double>(unit_roundoff<T>());
  for (const Family& family : all_families()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = rounded<T>(family.make(3));
    Dynamics<T> robot = dynamics_of<T>(model, of_derivatives());
    Answers<T> rows(robot, model, 17);
    rows.ask(robot);
    for (const int i : {0, 16}) {
      const TrueDerivatives truth(model, rounded<T>(random_state(model, i)));
      // As one state's, AccelerationDerivatives.AgreeWithDifferencesOfTruth.
      const double bound = 4 * (40 + 2 * std::sqrt(truth.condition())) * u;
      EXPECT_LE(truth.error(rows.of(i).template cast<double>()), bound) << i;
    }
  }
}

// To the bit, and nothing else is written.
TYPED_TEST(RowsOfDerivatives, AgreeToTheBitOnEveryCountOfThreads) {
  using T = TypeParam;
  for (const Family& family : robots())
    for (const Tolerance tolerance : tolerances)
      for (const int count : {1, 64, 131}) {
        SCOPED_TRACE(std::string(family.name) + " " + name_of(tolerance));
        const Model<double> model = family.make(3);
        Dynamics<T> robot = dynamics_of<T>(model, of_derivatives(tolerance)),
                    alone = dynamics_of<T>(model, of_derivatives(tolerance));
        Answers<T> right(alone, model, count), rows = right;
        right.ask(alone);
        for (const int threads : {1, 2, 3, 2}) {
          rows.ask(robot, threads);
          EXPECT_TRUE(rows.dq == right.dq && rows.dqd == right.dqd && rows.dtau == right.dtau &&
                      rows.a == right.a)
              << threads;
        }
      }
}

TYPED_TEST(RowsOfDerivatives, WhatIsLeftOutIsNotWritten) {
  using T = TypeParam;
  for (const Family& family : robots())
    for (int left_out = 0; left_out < 8; ++left_out) {
      SCOPED_TRACE(family.name);
      const Model<double> model = family.make(3);
      Dynamics<T> robot = dynamics_of<T>(model, of_derivatives());
      Answers<T> right(robot, model, 19);
      right.ask(robot);
      std::vector<T> X[3];
      std::optional<RowsView<T>> views[3];
      for (int i = 0; i < 3; ++i) {
        X[i].assign(right.dq.size(), Answers<T>::untouched);
        if (!(left_out >> i & 1)) views[i].emplace(X[i].data(), right.count, right.n * right.n);
      }
      EXPECT_EQ(
          robot.derivatives(right.q, right.qd, right.tau,
                            {.dq = views[0], .dqd = views[1], .dtau = views[2]},
                            RowsView<T>(right.a.data(), right.count, right.n), right.outcomes),
          0);
      const std::vector<T>* const all[] = {&right.dq, &right.dqd, &right.dtau};
      for (int i = 0; i < 3; ++i) {
        const bool untouched =
            std::ranges::all_of(X[i], [](T y) { return y == Answers<T>::untouched; });
        EXPECT_TRUE(views[i] ? X[i] == *all[i] : untouched) << i;
      }
    }
}

// One row is at gimbal lock, where M is singular, or so near that a D is lost in rounding: it alone is
// refused, or gets the answer and the warning of one state.
TYPED_TEST(RowsOfDerivatives, ASuspectDoesNotTouchItsNeighbours) {
  using T = TypeParam;
  for (const Mechanism& mechanism : singular_mechanisms(1)) {
    if (mechanism.name != "gimbal_lock" && mechanism.name != "oblique_gimbal_lock") continue;
    for (const double distance : {0.0, std::is_same_v<T, float> ? 2e-3 : 1e-6})
      for (const int at : {0, 3, 16, 18}) {
        SCOPED_TRACE(mechanism.name + " row " + std::to_string(at));
        const Model<double>& model = mechanism.model;
        Dynamics<T> robot = dynamics_of<T>(model, of_derivatives()),
                    one = dynamics_of<T>(model, of_derivatives());
        Answers<T> rows(robot, model, 19), undisturbed = rows;
        undisturbed.ask(robot);
        const VectorX<T> q = (mechanism.q.array() + distance).matrix().template cast<T>();
        std::copy(q.begin(), q.end(), &rows.q[at * rows.nq]);
        rows.ask(robot);
        for (int i = 0; i < rows.count; ++i) {
          if (i != at) {
            EXPECT_TRUE(rows.outcomes[i] && equal(rows.of(i), undisturbed.of(i)));
            continue;
          }
          const One<T> right(one, rows.state(i));
          EXPECT_EQ(rows.outcomes[i].status, right.outcome.status);
          EXPECT_EQ(rows.outcomes[i].warns(), right.outcome.warns());
          if (distance == 0) {
            EXPECT_EQ(rows.outcomes[i].status, Outcome::Status::singular);
            EXPECT_TRUE(std::ranges::count(mechanism.joints, rows.outcomes[i].joint));
          } else {
            EXPECT_TRUE(equal(rows.of(i), right.out));
          }
        }
      }
  }
}

// A row warns or is refused where one state is, and where a D of twelve decades of masses is lost.
TYPED_TEST(RowsOfDerivatives, WarnWhereOneStateDoes) {
  using T = TypeParam;
  int silent = 0;
  for (int seed = 0; seed < 60; ++seed) {
    const Model<double> model = rounded<T>(wild(seed));
    Dynamics<T> robot = dynamics_of<T>(model, of_derivatives()),
                one = dynamics_of<T>(model, of_derivatives());
    Answers<T> rows(robot, model, 11);
    rows.ask(robot);
    for (int i = 0; i < rows.count; ++i) {
      const One<T> right(one, rows.state(i));
      EXPECT_EQ(rows.outcomes[i].status, right.outcome.status);
      EXPECT_EQ(rows.outcomes[i].warns(), right.outcome.warns());
      silent += !right.outcome.warns();
    }
  }
  EXPECT_GT(silent, 0);
}

TYPED_TEST(RowsOfDerivatives, ARowThatIsNotFiniteFailsAlone) {
  using T = TypeParam;
  constexpr T nan = std::numeric_limits<T>::quiet_NaN();
  for (const Family& family : robots())
    for (const Tolerance tolerance : tolerances)
      for (const int at : {0, 4, 18}) {
        SCOPED_TRACE(std::string(family.name) + " " + name_of(tolerance));
        const Model<double> model = family.make(3);
        Dynamics<T> robot = dynamics_of<T>(model, of_derivatives(tolerance));
        Answers<T> rows(robot, model, 19), undisturbed = rows;
        undisturbed.ask(robot);
        rows.tau[at * rows.nv + rows.nv - 1] = nan;
        rows.ask(robot);
        EXPECT_EQ(rows.failed, 1);
        EXPECT_EQ(rows.outcomes[at].status, Outcome::Status::not_finite);
        for (int i = 0; i < rows.count; ++i)
          if (i != at) {
            EXPECT_TRUE(equal(rows.of(i), undisturbed.of(i))) << i;
          }
      }
}

TYPED_TEST(RowsOfDerivatives, WhatDoesNotFitOrIsNotWantedIsRefused) {
  using T = TypeParam;
  const Model<double> model = creature(1);
  Dynamics<T> robot = dynamics_of<T>(model, of_derivatives());
  const int n = model.nv(), nq = model.nq();
  std::vector<Outcome> two(2);
  std::vector<T> q(2 * nq), qd(2 * n), tau(2 * n), a(2 * n), X(2 * n * n), narrow(2 * n);
  const auto ask = [&](Dynamics<T>& of, std::vector<T>& given_qd, std::vector<T>& given_a,
                       const DerivativeRows<T>& out) {
    return of.derivatives(q, given_qd, tau, out, given_a, two);
  };
  EXPECT_THROW((void)ask(robot, q, a, {}), std::invalid_argument);
  EXPECT_THROW((void)ask(robot, qd, X, {}), std::invalid_argument);
  EXPECT_THROW((void)ask(robot, qd, a, {.dq = RowsView<T>(narrow)}), std::invalid_argument);
  EXPECT_THROW((void)ask(robot, qd, a, {.dqd = RowsView<T>(narrow)}), std::invalid_argument);
  EXPECT_THROW((void)ask(robot, qd, a, {.dtau = RowsView<T>(narrow)}), std::invalid_argument);
  Dynamics<T> other = dynamics_of<T>(model, {.question = {.want = {Want::diagonal}}});
  EXPECT_THROW((void)ask(other, qd, a, {}), std::logic_error);
}

}  // namespace
}  // namespace kalmarm::test
