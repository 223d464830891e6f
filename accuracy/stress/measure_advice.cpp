#include "accuracy/stress/measure_advice.hpp"

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>
#include <cmath>
#include <limits>

#include "accuracy/contenders/advice.hpp"
#include "accuracy/measures/measures.hpp"
#include "accuracy/programs/common/csv.hpp"
#include "accuracy/truth/truth_cache.hpp"

namespace kalmarm::stress {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

// Of what the candidate answers in the only state.
double error_of(const Candidate& candidate, Want want, const Truth<double>& truth) {
  const auto trial = candidate.make();
  trial->poison();
  if (!truth.outcome || !trial->answer(0)) return infinite;
  const VectorX<double> x = trial->result();
  if (want == Want::inverse) {
    const Eigen::Index n = truth.X.rows();
    return matrix_error(MatrixX<double>(x.reshaped(n, n)), truth.X).scaled;
  }
  const VectorX<Real>& a = truth.responses[0].a;
  return quotient(Real((x.cast<Real>() - a).norm()), Real(a.norm()));
}

}  // namespace

std::string measure_advice(const Family& family, double value, std::uint64_t seed,
                           const std::vector<double>& tolerances) {
  const Case c = family.make(value, seed);
  const int nv = c.model.nv();
  const bool matrices = nv <= largest_inverse;
  State state{c.q, c.qd, VectorX<double>(nv)};
  boost::random::mt19937_64 random(seed);
  boost::random::normal_distribution<double> normal;
  for (double& tau : state.tau) tau = normal(random);
  const Truth<double> truth =
      cached_truth<double>(c.model, c.q, {{state.tau, state.qd}}, {.matrices = matrices});

  const Scene scene = generated_scene(family.name, c.model);
  const QuestionOptions asked;
  std::string out;
  for (const Want want : {Want::acceleration, Want::inverse}) {
    if (want == Want::inverse && !matrices) continue;
    const auto advisor = make_advisor(scene, asked, {.want = {want}}, {state});
    for (const double tolerance : tolerances) {
      const Advice advice = advise(*advisor, tolerance);
      const Candidate& chosen = advisor->candidates()[advice.candidate];
      const double error = error_of(chosen, want, truth);
      out += field(family.name) + ',' + number(value) + ',' + std::to_string(nv) + ',' +
             std::to_string(seed) + ',' + (want == Want::inverse ? "inverse" : "dynamics") + ',' +
             number(tolerance) + ',' + field(chosen.variant) + ',' + to_string(chosen.precision) +
             ',' + number(advisor->observe(advice.candidate).predicted) + ',' +
             (advice.enough ? "1" : "0") + ',' + number(error) + '\n';
    }
  }
  return out;
}

}  // namespace kalmarm::stress
