// AnswerCheck against truth in 50 digits: whether the error that it tells of anybody's answer is that error.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/fast/claims/constants.hpp"
#include "algorithms/fast/test/mechanisms_that_lose.hpp"
#include "algorithms/fast/test/support.hpp"
#include "algorithms/test/singular.hpp"
#include "kalmarm/check.hpp"

namespace kalmarm::test {
namespace {

constexpr double u = 0x1p-53;

// Answers wrong by about `size`, of several kinds: entry by entry, in one entry, along one direction.
VectorX<double> spoiled(const VectorX<double>& a, double size, Random& random) {
  VectorX<double> out = a;
  const int n = static_cast<int>(a.size()), kind = random.below(3);
  if (kind == 0)
    for (double& x : out) x *= 1 + size * random.uniform(-1, 1);
  else if (kind == 1)
    out[random.below(n)] *= 1 + size;
  else
    for (double& x : out) x += size * a.norm() * random.uniform(-1, 1);
  return out;
}

// What became of checks whose answers are known to be wrong by `error` and `euclid`.
struct Tally {
  int all = 0, close = 0, unknown = 0;
  double lowest = std::numeric_limits<double>::infinity();

  void add(const AnswerError& told, double error) {
    ++all;
    if (!std::isfinite(told.error) || told.outcome.near_singular) {
      ++unknown;
      return;
    }
    if (error < u / 256) {  // less than any answer can be told apart
      close += told.error <= u / 64;
      return;
    }
    const double ratio = told.error / error;
    close += ratio > 1.0 / 3 && ratio < 3;
    lowest = std::min(lowest, ratio);
  }
};

// Of one mechanism and state: last bits, then answers wrong by 1e-16 to 1.
template <class Use>
void for_each_answer(const Model<double>& model, const State<double>& state, std::uint64_t seed,
                     const Use& use) {
  Random random(seed);
  Dynamics<double> robot = dynamics_of<double>(
      model, {.tolerance = last_bits, .question = {.want = {Want::acceleration}}});
  VectorX<double> a(model.nv());
  if (!robot.forward_dynamics(state.q, state.qd, state.tau, a)) return;
  use(a);
  for (int k = 0; k <= 16; ++k) use(spoiled(a, std::pow(10, -k), random));
  use(a.cast<float>().cast<double>().eval());
}

TEST(AnswerCheck, TellsTheErrorOfAnyAccelerationOfOrdinaryMechanisms) {
  Tally tally;
  for (const Family& family : all_families())
    for (int seed = 0; seed < 3; ++seed) {
      SCOPED_TRACE(std::string(family.name) + " " + std::to_string(seed));
      const Model<double> model = family.make(seed);
      const State<double> state = random_state(model, seed + 50);
      const Truth truth(model, state);
      AnswerCheck check(plain(model));
      for_each_answer(model, state, seed, [&](const VectorX<double>& a) {
        const AnswerError told = check.forward_dynamics(state.q, state.qd, state.tau, a);
        tally.add(told, truth.energy(a));
        EXPECT_NEAR(told.euclid, truth.relative(a), 0.1 * truth.relative(a) + u / 64);
        EXPECT_LE(std::abs(told.error - truth.energy(a)), 3 * told.uncertainty + 0.01 * told.error);
      });
    }
  EXPECT_EQ(tally.close, tally.all);
  EXPECT_EQ(tally.unknown, 0);
}

// Masses over twelve decades: 99 of 100 within a factor of 3, none below a quarter, and no verdict is `right` of an
// answer that is not.
TEST(AnswerCheck, TellsTheErrorOfAnyAccelerationOfWildMechanisms) {
  constexpr double tolerance = 1e-2;
  Tally tally;
  int wrongly_right = 0;
  for (int seed = 0; seed < 500; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const Model<double> model = wild(seed);
    const State<double> state = random_state(model, seed);
    const Truth truth(model, state);
    AnswerCheck check(plain(model), {.tolerance = tolerance});
    const double least = least_beside_gravity * model.gravity().norm();
    for_each_answer(model, state, seed, [&](const VectorX<double>& a) {
      const AnswerError told = check.forward_dynamics(state.q, state.qd, state.tau, a);
      tally.add(told, truth.energy(a));
      const double beside = std::min(1.0, a.norm() / least);
      wrongly_right += told.verdict == Verdict::right && truth.relative(a) * beside > tolerance;
    });
  }
  EXPECT_GE(tally.all, 9000);
  EXPECT_GE(tally.close, 0.99 * tally.all);
  EXPECT_LE(tally.unknown, 0.01 * tally.all);
  EXPECT_GE(tally.lowest, 0.25);
  EXPECT_EQ(wrongly_right, 0);
}

TEST(AnswerCheck, TellsTheErrorOfSolvesAndOfInverses) {
  for (const Family& family : all_families()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = family.make(1);
    const int n = model.nv();
    const State<double> state = random_state(model, 51);
    const Truth truth(model, state);
    AnswerCheck check(plain(model));
    Random random(7);
    Dynamics<double> robot = dynamics_of<double>(
        model, {.tolerance = last_bits, .question = {.want = {Want::solve, Want::inverse}}});
    VectorX<double> x(n);
    MatrixX<double> X(n, n);
    ASSERT_TRUE(robot.factor(state.q) && robot.solve(state.tau, x) &&
                robot.inverse_mass(state.q, X));
    for (int k = 0; k <= 16; ++k) {
      const double size = std::pow(10, -k);
      const VectorX<double> y = spoiled(x, size, random);
      const double error = truth.solution(y);
      const AnswerError told = check.solve(state.q, state.tau, y);
      EXPECT_NEAR(told.error, error, 0.05 * error + u / 64);
      MatrixX<double> Y = X;
      for (double& entry : Y.reshaped()) entry *= 1 + size * random.uniform(-1, 1);
      const double entries = truth.inverse(Y);
      const AnswerError of_inverse = check.inverse_mass(state.q, Y);
      EXPECT_NEAR(of_inverse.error, entries, 0.05 * entries + u / 64);
      EXPECT_EQ(of_inverse.verdict == Verdict::right, of_inverse.error <= 1e-8);
    }
  }
}

TEST(AnswerCheck, TellsTheErrorOfTorquesAndOfMassMatrices) {
  for (const Family& family : all_families()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = family.make(1);
    const int n = model.nv();
    const State<double> state = random_state(model, 51);
    const Truth truth(model, state);
    AnswerCheck check(plain(model));
    Random random(7);
    Dynamics<double> robot = dynamics_of<double>(model, {});
    VectorX<double> tau(n);
    MatrixX<double> M(n, n);
    robot.inverse_dynamics(state.q, state.qd, state.tau, tau);
    robot.mass(state.q, M);
    for (int k = 0; k <= 16; ++k) {
      const double size = std::pow(10, -k);
      const VectorX<double> t = spoiled(tau, size, random);
      const AnswerError told = check.inverse_dynamics(state.q, state.qd, state.tau, t);
      EXPECT_NEAR(told.error, (t - tau).norm() / tau.norm(), 1e-2 * told.error + 100 * u);
      MatrixX<double> Y = M;
      for (double& entry : Y.reshaped()) entry *= 1 + size * random.uniform(-1, 1);
      const double error = truth.mass(Y);
      EXPECT_NEAR(check.mass(state.q, Y).error, error, 1e-3 * error + u / 64);
    }
  }
}

// A row has what it has alone, whatever stands beside it, on any number of threads.
TEST(AnswerCheck, RowsAreCheckedAsStatesAre) {
  const Model<double> model = creature(4);
  const int n = model.nv(), nq = model.nq(), count = 201;
  AnswerCheck check(plain(model));
  std::vector<double> q, qd, tau, a(count * n);
  for (int i = 0; i < count; ++i) {
    const State<double> state = random_state(model, i);
    q.insert(q.end(), state.q.begin(), state.q.end());
    qd.insert(qd.end(), state.qd.begin(), state.qd.end());
    tau.insert(tau.end(), state.tau.begin(), state.tau.end());
  }
  std::vector<Outcome> outcomes(count);
  Dynamics<double> robot(plain(model));
  ASSERT_EQ(robot.forward_dynamics(q, qd, tau, a, outcomes), 0);
  a[5 * n] *= 1.25;
  a[17 * n + 3] = std::numeric_limits<double>::quiet_NaN();
  q[20 * nq] = std::numeric_limits<double>::infinity();
  std::vector<AnswerError> one(count), two(count);
  EXPECT_EQ(check.forward_dynamics(q, qd, tau, a, one), 3);
  EXPECT_EQ(check.forward_dynamics(q, qd, tau, a, two, 3), 3);
  for (int i = 0; i < count; ++i) {
    SCOPED_TRACE(i);
    const auto at = [&](const std::vector<double>& x, int width) {
      return VectorView<const double>(x.data() + i * width, width);
    };
    const AnswerError alone = check.forward_dynamics(at(q, nq), at(qd, n), at(tau, n), at(a, n));
    EXPECT_EQ(one[i].verdict, i == 20             ? Verdict::unknown
                              : i == 5 || i == 17 ? Verdict::wrong
                                                  : Verdict::right);
    for (const AnswerError* other : {&std::as_const(two[i]), &alone}) {
      EXPECT_EQ(one[i].verdict, other->verdict);
      EXPECT_TRUE(one[i].error == other->error || std::isnan(other->error));
    }
  }
  EXPECT_EQ(one[17].error, std::numeric_limits<double>::infinity());
  EXPECT_EQ(one[20].outcome.status, Outcome::Status::not_finite);
}

// Where errors are below the resolution, double alone says so.
TEST(AnswerCheck, ResolutionIsWhatNeedsNotBeToldApart) {
  const Model<double> model = floating_base(3);
  const State<double> state = random_state(model, 3);
  VectorX<double> a(model.nv());
  Dynamics<double> robot(plain(model));
  ASSERT_TRUE(robot.forward_dynamics(state.q, state.qd, state.tau, a));
  const auto told = [&](double resolution) {
    AnswerCheck check(plain(model), {.resolution = resolution});
    return check.forward_dynamics(state.q, state.qd, state.tau, a);
  };
  const AnswerError coarse = told(1e-8), fine = told(0);
  EXPECT_EQ(coarse.outcome.rung, Outcome::Rung::float64);
  EXPECT_LE(coarse.error + coarse.uncertainty, 1e-8);
  EXPECT_EQ(fine.outcome.rung, Outcome::Rung::refined);
  EXPECT_GT(fine.error, 0);
  EXPECT_LT(fine.error, 1e-12);
  EXPECT_EQ(coarse.verdict, Verdict::right);
}

// Held still, a is zero but for rounding: as wrong as it may be relative to that, it is right beside gravity.
TEST(AnswerCheck, NothingIsBesideGravity) {
  const Model<double> model = armature(2);
  State<double> state = random_state(model, 2);
  state.qd.setZero();
  Dynamics<double> robot(plain(model));
  robot.gravity(state.q, state.tau);
  AnswerCheck check(plain(model));
  const VectorX<double> a = VectorX<double>::Constant(model.nv(), 1e-13);
  const AnswerError told = check.forward_dynamics(state.q, state.qd, state.tau, a);
  EXPECT_EQ(told.verdict, Verdict::right);
  EXPECT_GT(told.error, 1e-3);
}

TEST(AnswerCheck, OfWhatIsSingularNothingIsKnown) {
  for (const Mechanism& mechanism : singular_mechanisms(3)) {
    SCOPED_TRACE(mechanism.name);
    const Model<double>& model = mechanism.model;
    State<double> state = random_state(model, 1);
    state.q = mechanism.q;
    AnswerCheck check(plain(model));
    const AnswerError told = check.forward_dynamics(state.q, state.qd, state.tau, state.tau);
    EXPECT_EQ(told.verdict, Verdict::unknown);
    EXPECT_FALSE(told.outcome);
    EXPECT_GE(told.outcome.joint, 0);
  }
}

TEST(AnswerCheck, SizesAndOptionsAreChecked) {
  const RobotModel model = plain(chain(1, 3));
  EXPECT_THROW(AnswerCheck(model, {.tolerance = 0}), std::invalid_argument);
  EXPECT_THROW(AnswerCheck(model, {.resolution = -1}), std::invalid_argument);
  AnswerCheck check(model);
  const VectorX<double> three = VectorX<double>::Zero(3), four = VectorX<double>::Zero(4);
  EXPECT_THROW((void)check.forward_dynamics(three, three, three, four), std::invalid_argument);
  EXPECT_THROW((void)check.mass(three, four), std::invalid_argument);
  const AnswerCheck moved = std::move(check);
  EXPECT_THROW((void)check.solve(three, three, three), std::logic_error);  // NOLINT
}

}  // namespace
}  // namespace kalmarm::test
