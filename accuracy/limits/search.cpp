#include "accuracy/limits/search.hpp"

#include <algorithm>
#include <cmath>
#include <nlopt.hpp>
#include <optional>

namespace kalmarm::limits {
namespace {

constexpr double no_error = -20;    // log10, below all
constexpr double first_step = 0.1;  // of a range: the simplex

struct Entry {
  int index;  // of q
  double low, high;
};

// The entries of q that are searched.
std::vector<Entry> searched_entries(const Scene& scene) {
  std::vector<Entry> out;
  if (scene.at_rest) return out;
  const Model<double>& model = scene.model;
  for (int k = 0; k < model.nv(); ++k) {
    const Joint<double>& joint = model.joint(k);
    const bool free = k >= 3 && model.joint(k - 3).coordinate == Coordinate::position;
    if (joint.coordinate == Coordinate::quaternion && !free)
      for (int i = 0; i < 4; ++i) out.push_back({joint.q_index + i, -1, 1});
    if (joint.coordinate != Coordinate::angle && joint.coordinate != Coordinate::distance) continue;
    const auto [low, high] = scene.range[joint.q_index];
    if (low < high) out.push_back({joint.q_index, low, high});
  }
  return out;
}

double logarithm(const Answer& answer) {
  return answer.refused ? no_error : std::log10(std::max(answer.error, std::pow(10, no_error)));
}

void count(const Answer& answer, Tally& tally) {
  tally.refused += answer.refused;
  tally.warned += answer.warned;
  tally.silent += answer.silent();
  ++tally.states;
}

// One precision.
template <class T>
class Search {
 public:
  Search(const Scene& scene, const Model<double>& model, Want task)
      : entries_(searched_entries(scene)), judge_(model, task), worst_(searched_variants) {}

  // Judges all variants; log10 of the error of one.
  double look(const State& given, int variant = 0) {
    const State state = held_by_float(given);
    ++states_;
    const double fairness = judge_.set_state(state);
    if (!(fairness > 0)) return no_error;
    if (fairness < 1)
      return std::max(no_error, logarithm(judge_(variant)) + 2 * std::log10(fairness));
    double out = no_error;
    for (int i = 0; i < searched_variants; ++i) {
      const Answer answer = judge_(i);
      count(answer, worst_[i].tally);
      if (!answer.refused && answer.error > worst_[i].error)
        worst_[i] = {worst_[i].tally, answer.error, state};
      if (i == variant) out = logarithm(answer);
    }
    return out;
  }

  bool answers(int variant) const { return worst_[variant].error >= 0; }

  // q of the variant's worst state so far, by some more states.
  void optimise(nlopt::algorithm algorithm, int variant, int states, std::uint64_t seed) {
    if (states < 1 || entries_.empty() || !answers(variant)) return;
    Target target{this, variant, worst_[variant].state};
    std::vector<double> low, high, step, x;
    for (const Entry& entry : entries_) {
      low.push_back(entry.low);
      high.push_back(entry.high);
      step.push_back(first_step * (entry.high - entry.low));
      x.push_back(std::clamp(target.state.q[entry.index], entry.low, entry.high));
    }
    nlopt::srand(seed);  // of this thread
    nlopt::opt optimiser(algorithm, static_cast<unsigned>(x.size()));
    optimiser.set_lower_bounds(low);
    optimiser.set_upper_bounds(high);
    optimiser.set_initial_step(step);
    optimiser.set_maxeval(states);
    optimiser.set_max_objective(&Target::value, &target);
    double best = 0;
    optimiser.optimize(x, best);
  }

  void add(Found& found) const {
    for (const Worst& worst : worst_) {
      found.tallies.push_back(worst.tally);
      if (worst.error >= 0) found.states.push_back(worst.state);
    }
    found.tallies.emplace_back();  // last_bits
    found.evaluations += states_;
  }

 private:
  struct Worst {
    Tally tally;
    double error = -1;
    State state;
  };

  struct Target {
    Search* search;
    int variant;
    State state;

    static double value(const std::vector<double>& x, std::vector<double>&, void* data) {
      auto& [search, variant, state] = *static_cast<Target*>(data);
      for (std::size_t i = 0; i < x.size(); ++i) state.q[search->entries_[i].index] = x[i];
      return search->look(state, variant);
    }
  };

  std::vector<Entry> entries_;
  Judge<T> judge_;
  std::vector<Worst> worst_;
  int states_ = 0;
};

// Every contender in every state that was found; what none has an answer for is dropped.
void verify_all(const Model<double>& model, Want task, Found& found) {
  std::vector<State> verified;
  for (const State& state : found.states) {
    const std::optional<std::vector<Answer>> answers = verify(model, task, state);
    if (!answers) continue;
    verified.push_back(state);
    for (std::size_t i = 0; i < answers->size(); ++i) {
      const Answer& answer = (*answers)[i];
      Tally& tally = found.tallies[i];
      if (!answer.refused && answer.error > tally.worst) {
        tally.worst = answer.error;
        tally.worst_state = static_cast<int>(verified.size()) - 1;
      }
      if (i % variants.size() == searched_variants) count(answer, tally);
    }
  }
  found.states = std::move(verified);
}

}  // namespace

Found search_worst(const Scene& scene, const Model<double>& model, Want task, const Effort& effort,
                   std::uint64_t seed, const std::vector<State>& starts) {
  const std::vector<State> random =
      random_states(scene, std::max(effort.random, effort.random_float64), seed);
  Found found;
  Search<float> in_float32(scene, model, task);
  for (const State& state : starts) in_float32.look(state);
  for (int i = 0; i < effort.random; ++i) in_float32.look(random[i]);
  for (int i = 0; i < searched_variants; ++i) {
    in_float32.optimise(nlopt::GN_CRS2_LM, i, effort.global, seed);
    in_float32.optimise(nlopt::LN_SBPLX, i, effort.local, seed);
  }
  in_float32.add(found);

  Search<double> in_float64(scene, model, task);
  for (const State& state : starts) in_float64.look(state);
  for (const State& state : found.states) in_float64.look(state);
  for (int i = 0; i < effort.random_float64; ++i) in_float64.look(random[i]);
  for (int i = 0; i < searched_variants; ++i) {
    if (!in_float32.answers(i))
      in_float64.optimise(nlopt::GN_CRS2_LM, i, effort.local_float64, seed);
    in_float64.optimise(nlopt::LN_SBPLX, i, effort.local_float64, seed);
  }
  in_float64.add(found);
  verify_all(model, task, found);
  return found;
}

}  // namespace kalmarm::limits
