// Every stress of a robot at every value, and where a form ceases to be right.
//
// The robot as given comes first: it says what may be promised (sentence.hpp). Then each stress is
// searched value after value, from the worst states of the value before. Where the promise holds up
// to one value and not at the next, values 1, 2, 3 and 5 times powers of ten between them are tried
// by bisection and stand in the list like the others.
//
// Stresses run in parallel, and so do the two tasks; every search begins from the same seed, so
// that the result is the same on any number of threads.
#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "accuracy/limits/search.hpp"
#include "accuracy/limits/stresses.hpp"

namespace kalmarm::limits {

inline constexpr std::array tasks = {Want::acceleration, Want::inverse};

struct Swept {
  Stress stress;
  std::vector<double> values;  // those of the stress, and those tried between
  std::array<std::vector<Found>, tasks.size()> found;  // of each task, one a value
};

// States that keep an arm within 20 s and a humanoid of 35 DoF within 60 s of two cores.
Effort effort_for(int nv);

// The first is the robot as given. done: after every search, most_searches() times at most, from
// any thread.
std::vector<Swept> search_all(const Scene& scene, const Effort& effort, std::uint64_t seed,
                              const std::function<void(const std::string& what)>& done);
int most_searches(const std::vector<Stress>& stresses);

// 1, 2, 3 and 5 times powers of ten between two values, from the first to the second; none
// where one is 0.
std::vector<double> values_between(double from, double to);

}  // namespace kalmarm::limits
