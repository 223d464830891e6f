#include "accuracy/adversary/search.hpp"

#include <algorithm>
#include <boost/random/mersenne_twister.hpp>
#include <boost/random/uniform_int_distribution.hpp>
#include <boost/random/uniform_real_distribution.hpp>
#include <cmath>
#include <nlopt.hpp>
#include <numeric>
#include <random>

namespace kalmarm::adversary {
namespace {

constexpr int population = 20;                              // of the evolution strategy
constexpr std::size_t elite = 5;                            // rounds whose best may be gone on from
constexpr double smallest_step = 0.01, largest_step = 0.3;  // the simplex, of the range

class Searcher {
 public:
  Searcher(const Objective& objective, std::uint64_t seed, const std::vector<Round>& done)
      : objective_(objective), done_(done) {
    std::seed_seq mixed{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32),
                        static_cast<std::uint32_t>(done.size())};
    random_.seed(mixed);
  }

  Round run(const Effort& effort) && {
    const bool searches = effort.evolution + effort.simplex > 0;
    if (searches && done_.size() % 2 == 1) {
      go_on();
      optimise(nlopt::GN_ESCH, effort.random + effort.evolution);
    } else {
      for (int i = 0; i < effort.random; ++i) look(drawn());
      optimise(nlopt::GN_ESCH, effort.evolution);
    }
    optimise(nlopt::LN_SBPLX, effort.simplex);
    return std::move(round_);
  }

 private:
  double uniform() { return boost::random::uniform_real_distribution<double>(0, 1)(random_); }
  int below(int n) { return boost::random::uniform_int_distribution<int>(0, n - 1)(random_); }

  Genome drawn() {
    Genome out{1 + below(most_dofs), {}};
    out.x.resize(static_cast<std::size_t>(length_of(out.bodies)));
    for (double& x : out.x) x = uniform();
    return out;
  }

  double look(const Genome& genome) {
    const double value = objective_(genome);
    ++round_.evaluations;
    if (round_.curve.empty() || value > round_.value) {
      round_.best = genome;
      round_.value = value;
      round_.curve.emplace_back(round_.evaluations, value);
    }
    return value;
  }

  // From one of the best so far.
  void go_on() {
    std::vector<const Round*> ranked;
    for (const Round& round : done_) ranked.push_back(&round);
    std::ranges::stable_sort(ranked, std::ranges::greater(), &Round::value);
    const Round& from = *ranked[below(static_cast<int>(std::min(elite, ranked.size())))];
    round_.best = from.best;
    round_.value = from.value;
    round_.curve.emplace_back(0, from.value);
  }

  void optimise(nlopt::algorithm algorithm, int evaluations) {
    if (evaluations < 1) return;
    Target target{this, round_.best.bodies};
    std::vector<double> x = round_.best.x;
    nlopt::srand(random_());  // of this thread
    nlopt::opt optimiser(algorithm, static_cast<unsigned>(x.size()));
    optimiser.set_lower_bounds(0);
    optimiser.set_upper_bounds(1);
    optimiser.set_initial_step(smallest_step * std::pow(largest_step / smallest_step, uniform()));
    optimiser.set_population(population);
    optimiser.set_maxeval(evaluations);
    optimiser.set_max_objective(&Target::value, &target);
    double best = 0;
    try {
      optimiser.optimize(x, best);
    } catch (const nlopt::roundoff_limited&) {  // what it found is kept
    }
  }

  struct Target {
    Searcher* searcher;
    int bodies;

    static double value(const std::vector<double>& x, std::vector<double>&, void* data) {
      const Target& target = *static_cast<Target*>(data);
      return target.searcher->look({target.bodies, x});
    }
  };

  const Objective& objective_;
  const std::vector<Round>& done_;
  boost::random::mt19937_64 random_;
  Round round_;
};

}  // namespace

Round next_round(const Objective& objective, const Effort& effort, std::uint64_t seed,
                 const std::vector<Round>& done) {
  return Searcher(objective, seed, done).run(effort);
}

int evaluations_of(const std::vector<Round>& rounds) {
  return std::accumulate(rounds.begin(), rounds.end(), 0,
                         [](int sum, const Round& round) { return sum + round.evaluations; });
}

const Round& best_of(const std::vector<Round>& rounds) {
  return *std::ranges::max_element(rounds, {}, &Round::value);
}

}  // namespace kalmarm::adversary
