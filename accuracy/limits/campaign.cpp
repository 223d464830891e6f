#include "accuracy/limits/campaign.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>

#include "accuracy/limits/sentence.hpp"

namespace kalmarm::limits {
namespace {

constexpr double full_effort = 10;  // DoF
constexpr int most_refined = 3;     // values tried by bisection between two

class Campaign {
 public:
  Campaign(const Scene& scene, const Effort& effort, std::uint64_t seed,
           const std::function<void(const std::string&)>& done)
      : scene_(scene), effort_(effort), seed_(seed), done_(done) {}

  // Searches a value and puts it into the list at `position`; those before it lend their states.
  void measure(Swept& swept, double value, std::size_t position) const {
    const Model<double> model = swept.stress.model(value);
    const auto search = [&](std::size_t task) {
      std::vector<Found>& found = swept.found[task];
      const std::vector<State> starts =
          position > 0 ? found[position - 1].states : std::vector<State>();
      found.insert(found.begin() + static_cast<std::ptrdiff_t>(position),
                   search_worst(scene_, model, tasks[task], effort_, seed_, starts));
      done_(swept.stress.title + ' ' + short_value(value));
    };
    tbb::parallel_invoke([&] { search(0); }, [&] { search(1); });
    swept.values.insert(swept.values.begin() + static_cast<std::ptrdiff_t>(position), value);
  }

  // All values of a stress. given: the robot as it is.
  Swept sweep(const Stress& stress, const Swept* given) const {
    Swept out{stress, {}, {}};
    for (const double value : stress.values) {
      if (given && stress.scales && value == 1) {
        out.values.push_back(value);
        for (std::size_t task = 0; task < tasks.size(); ++task)
          out.found[task].push_back(given->found[task][0]);
      } else {
        measure(out, value, out.values.size());
      }
    }
    return out;
  }

  // Bisection between the last value that keeps the promise and the next.
  void refine(Swept& swept, const Promise& promise) const {
    const std::size_t kept = values_kept(swept, promise);
    if (promise.contender < 0 || kept == 0 || kept == swept.values.size()) return;
    const std::vector<double> between = values_between(swept.values[kept - 1], swept.values[kept]);
    std::size_t low = 0, high = between.size();  // those before low keep it, from high on none
    for (std::size_t position = kept; low < high;) {
      const std::size_t middle = (low + high) / 2;
      measure(swept, between[middle], position);
      const bool keeps = values_kept(swept, promise) > position;
      if (keeps) ++position;
      (keeps ? low : high) = middle + keeps;
    }
  }

 private:
  const Scene& scene_;
  const Effort& effort_;
  std::uint64_t seed_;
  const std::function<void(const std::string&)>& done_;
};

}  // namespace

Effort effort_for(int nv) {
  const double share = std::min(1.0, full_effort / nv);
  Effort out;
  for (int* states : {&out.global, &out.local, &out.local_float64})
    *states = static_cast<int>(share * *states);
  return out;
}

std::vector<double> values_between(double from, double to) {
  std::vector<double> out;
  if (!(from > 0 && to > 0)) return out;
  const double low = std::min(from, to), high = std::max(from, to);
  constexpr double margin = 1 + 1e-9;  // of powers
  for (int exponent = static_cast<int>(std::floor(std::log10(low) + 1e-9));; ++exponent)
    for (const double digit : {1, 2, 3, 5}) {
      const double value = digit * std::pow(10, exponent);
      if (value * margin > high) {
        if (from > to) std::ranges::reverse(out);
        return out;
      }
      if (value > low * margin) out.push_back(value);
    }
}

int most_searches(const std::vector<Stress>& stresses) {
  int out = 0;
  for (const Stress& stress : stresses)
    out += static_cast<int>(tasks.size() * (stress.values.size() + most_refined));
  return out;
}

std::vector<Swept> search_all(const Scene& scene, const Effort& effort, std::uint64_t seed,
                              const std::function<void(const std::string& what)>& done) {
  const std::vector<Stress> stresses = stresses_of(scene);
  const Campaign campaign(scene, effort, seed, done);
  std::vector<Swept> out(stresses.size());
  out[0] = campaign.sweep(stresses[0], nullptr);
  const Promise promise = promise_of(out[0]);
  tbb::parallel_for(std::size_t{1}, stresses.size(), [&](std::size_t i) {
    out[i] = campaign.sweep(stresses[i], &out[0]);
    campaign.refine(out[i], promise);
  });
  return out;
}

}  // namespace kalmarm::limits
