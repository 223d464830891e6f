// What accelerations say of their own error is not below what roundings can do: the spread of the same sweep
// in Monte Carlo arithmetic (perturbed.hpp), against multi-precision in the energy norm.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "algorithms/fast/engine/acceptance.hpp"
#include "algorithms/fast/engine/instances.hpp"
#include "algorithms/fast/test/mechanisms_that_lose.hpp"
#include "algorithms/fast/test/perturbed.hpp"
#include "algorithms/fast/test/support.hpp"
#include "algorithms/model/plain.hpp"

namespace kalmarm::test {
namespace {

// A body that two or three slides carry, with massless links between, and an arm and a ball on it.
Model<double> cart(std::uint64_t seed) {
  Random random(seed);
  Builder builder;
  int link = -1;
  for (int slide = 1 + random.below(2); slide >= 0; --slide)
    link = builder.add_massless(random_joint(random, link, Coordinate::distance));
  const int base = builder.add(random_joint(random, link));
  builder.add_ball(random_joint(random, base));
  link = base;
  for (int k = 0; k < 4; ++k) link = builder.add(random_joint(random, link));
  return builder.build();
}

std::vector<Perturbed> perturbed(const VectorX<double>& x) { return {x.begin(), x.end()}; }

// Root mean square of the errors of `runs` draws, in the norm of M.
double spread(const Model<double>& drawn, const LoweredModel<double>& model,
              const State<double>& state, int runs) {
  const Truth truth(drawn, state);
  const std::vector<Perturbed> q = perturbed(state.q), qd = perturbed(state.qd),
                               tau = perturbed(state.tau);
  CovarianceWorkspace<Perturbed> ws(model);
  std::vector<Perturbed> a(drawn.nv());
  double squares = 0;
  for (int run = 0; run < runs; ++run) {
    covariance_acceleration(model, q.data(), qd.data(), tau.data(), ws, a.data());
    VectorX<double> out(drawn.nv());
    for (int k = 0; k < drawn.nv(); ++k) out[k] = static_cast<double>(a[k]);
    const double error = truth.energy(out);
    squares += error * error;
  }
  return std::sqrt(squares / runs);
}

class PerturbedRoundings : public testing::Test {
 protected:
  void SetUp() override { Perturbed::random = Random(1); }

  // The estimated error over the spread of 80 draws, which deviates by 1 / sqrt(160), a twelfth; infinite of an
  // answer that is left to the next rung.
  static double ratio(const Model<double>& drawn, int seed) {
    constexpr double tolerance = 1e-6;
    const State<double> state = random_state(drawn, seed);
    const LoweredModel<double> model(drawn, Zeros::left_out, accepted_error(tolerance));
    const Acceptance<double> acceptance(plain(drawn), model, tolerance);
    CovarianceWorkspace<double> ws(model);
    VectorX<double> a(drawn.nv());
    covariance_acceleration(model, state.q.data(), state.qd.data(), state.tau.data(), ws, a.data());
    const Judged<double> by = acceptance.judge(CovarianceForm::sums(ws));
    if (!acceptance.accepts(ws.margin, by, 0)) return std::numeric_limits<double>::infinity();
    return by.error / spread(drawn, model, state, 80);
  }
};

TEST_F(PerturbedRoundings, MoveAccelerationsOfAllFamiliesByNoMoreThanTwiceTheEstimate) {
  std::vector<Family> all = all_families();
  all.push_back({"cart", cart});
  double least = std::numeric_limits<double>::infinity(), most = 0;
  for (const Family& family : all)
    for (int seed = 0; seed < 5; ++seed) {
      SCOPED_TRACE(family.name);
      const double said = ratio(family.make(seed), seed);
      EXPECT_GE(said, 0.5) << seed;
      EXPECT_LE(said, 300) << seed;  // accepted, and not far off
      least = std::min(least, said);
      most = std::max(most, said);
    }
  RecordProperty("least", std::to_string(least));
  RecordProperty("most", std::to_string(most));
  EXPECT_GE(ratio(straight_chain(31), 1), 0.5);
  EXPECT_GE(ratio(chain(1, 31), 1), 0.5);
}

// Of 400 wild mechanisms double answers 66. One, of seed 289, is moved by five times its estimate, all others by
// less than theirs: what an error of D does to a is in no sum.
TEST_F(PerturbedRoundings, MoveAccelerationsOfWildMechanismsByAtMostTenTimesTheEstimate) {
  int accepted = 0, above = 0;
  for (int seed = 0; seed < 400; ++seed) {
    const double said = ratio(wild(seed), seed);
    accepted += std::isfinite(said);
    above += said < 1;
    EXPECT_GE(said, 0.1) << seed;
  }
  EXPECT_GE(accepted, 50);
  EXPECT_LE(above, 1);
  RecordProperty("accepted", accepted);
}

}  // namespace
}  // namespace kalmarm::test
