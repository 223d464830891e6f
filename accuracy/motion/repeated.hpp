// The time of a simulation, as the median of its repetitions.
#pragma once

#include <time.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "accuracy/motion/simulate.hpp"

namespace kalmarm::motion {

// Of the processor, for this thread [s].
inline double thread_time() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// run() simulates once, from the start.
template <class Run>
Simulation repeated(const Effort& effort, Run&& run) {
  std::vector<double> seconds;
  Simulation out;
  double sum = 0;
  do {
    const double begin = thread_time();
    Simulation one = run();
    seconds.push_back(thread_time() - begin);
    sum += seconds.back();
    out = std::move(one);
    if (out.status != Status::ok) {
      out.seconds = std::numeric_limits<double>::quiet_NaN();
      return out;
    }
  } while (sum < effort.long_run &&
           (static_cast<int>(seconds.size()) < effort.repetitions || sum < effort.least));
  const auto middle = seconds.begin() + static_cast<std::ptrdiff_t>(seconds.size() / 2);
  std::nth_element(seconds.begin(), middle, seconds.end());
  out.seconds = *middle;
  return out;
}

}  // namespace kalmarm::motion
