// AnswerCheck on the mechanisms that the adversary draws, masses over sixteen decades: the error that it tells of an
// acceleration beside the proven one.
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/random/mersenne_twister.hpp>
#include <boost/random/uniform_01.hpp>
#include <boost/random/uniform_int_distribution.hpp>
#include <cmath>
#include <optional>
#include <vector>

#include "accuracy/adversary/genome.hpp"
#include "accuracy/measures/measures.hpp"
#include "accuracy/truth/truth.hpp"
#include "algorithms/fast/claims/constants.hpp"
#include "algorithms/model/plain.hpp"
#include "kalmarm/check.hpp"
#include "kalmarm/dynamics.hpp"

namespace kalmarm::adversary {
namespace {

constexpr int mechanisms = 400;
constexpr double tolerance = 1e-2;

using Generator = boost::random::mt19937_64;

double uniform(Generator& random, double low = 0, double high = 1) {
  return low + (high - low) * boost::random::uniform_01<double>()(random);
}

Mechanism drawn(Generator& random) {
  Genome genome;
  genome.bodies = boost::random::uniform_int_distribution<int>(1, most_dofs)(random);
  genome.x.resize(length_of(genome.bodies));
  for (double& x : genome.x) x = uniform(random);
  return decode(genome);
}

// a, what float32 makes of it, and answers wrong by 1e-16 to 1, entry by entry or along any direction.
std::vector<VectorX<double>> answers_beside(const VectorX<double>& a, Generator& random) {
  std::vector<VectorX<double>> out = {a, a.cast<float>().cast<double>()};
  for (int k = 0; k <= 16; ++k) {
    const double size = std::pow(10, -k);
    VectorX<double> x = a;
    for (double& entry : x)
      entry += size * uniform(random, -1, 1) * (k % 2 == 0 ? entry : a.norm());
    out.push_back(x);
  }
  return out;
}

// Empty: singular, or beyond what can be proven.
std::optional<Truth<double>> truth_of(const Model<double>& model, const State& state) {
  try {
    Truth<double> out = truth<double>(model, state.q, {Task<double>{state.tau, state.qd}});
    if (out.outcome) return out;
  } catch (const NoTruth&) {
  }
  return {};
}

TEST(AnswerCheck, TellsErrorsOfWhatTheAdversaryDraws) {
  int all = 0, close = 0, unknown = 0, wrongly_right = 0;
  double lowest = 1;
  for (int seed = 0; seed < mechanisms; ++seed) {
    SCOPED_TRACE(seed);
    Generator random(static_cast<std::uint64_t>(seed));
    const auto [model, state] = drawn(random);
    Dynamics<double> robot(plain(model),
                           {.tolerance = last_bits, .question = {.want = {Want::acceleration}}});
    VectorX<double> a(model.nv());
    if (!robot.forward_dynamics(state.q, state.qd, state.tau, a) || a.isZero(0)) continue;
    const std::optional<Truth<double>> exact = truth_of(model, state);
    if (!exact) continue;
    const Digits digits(exact->digits);
    AnswerCheck check(plain(model), {.tolerance = tolerance});
    const double least = least_beside_gravity * model.gravity().norm();
    for (const VectorX<double>& x : answers_beside(a, random)) {
      const AccelerationError error = acceleration_error(x, exact->responses[0].a, exact->M);
      const AnswerError told = check.forward_dynamics(state.q, state.qd, state.tau, x);
      ++all;
      if (told.verdict == kalmarm::Verdict::right)
        wrongly_right += error.relative * std::min(1.0, a.norm() / least) > tolerance;
      if (!std::isfinite(told.error) || told.outcome.near_singular) {
        ++unknown;
      } else if (!(error.energy >= 0x1p-60)) {  // or less than the truth tells
        ++close;
      } else {
        close += told.error > error.energy / 3 && told.error < 3 * error.energy;
        lowest = std::min(lowest, told.error / error.energy);
      }
    }
  }
  EXPECT_GE(all, 6000);
  EXPECT_GE(close, 0.99 * all);
  EXPECT_GE(lowest, 0.25);
  EXPECT_EQ(wrongly_right, 0);
}

}  // namespace
}  // namespace kalmarm::adversary
