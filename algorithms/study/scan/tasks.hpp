// Phases of independent tasks, one phase after another: on one thread a loop, on several oneTBB.
// What a task writes no other task of its phase reads, so that the answer does not depend on
// threads.
//
// On counting numbers (spatial/count.hpp) it keeps the flops of every task. With w the work of a
// phase and s its largest task,
//   work = sum of w,   span = sum of s,   flops on p processors <= sum of (s + (w - s) / p)     (1)
// the last by Graham's bound for any schedule that leaves no processor idle.
#pragma once

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <memory>
#include <type_traits>
#include <vector>

#include "algorithms/spatial/count.hpp"

namespace kalmarm::scan {

struct PhaseCost {
  double work = 0, longest = 0;  // flops
};

inline double work(const std::vector<PhaseCost>& phases) {
  double out = 0;
  for (const PhaseCost& phase : phases) out += phase.work;
  return out;
}

// (1); an infinite number gives the span.
inline double flops_on(const std::vector<PhaseCost>& phases, double processors) {
  double out = 0;
  for (const PhaseCost& phase : phases)
    out += phase.longest + (phase.work - phase.longest) / processors;
  return out;
}

template <class T>
class Tasks {
 public:
  explicit Tasks(int threads) {
    if (threads > 1) arena_ = std::make_unique<tbb::task_arena>(threads);
  }

  // f(i) for every i of the list.
  template <class F>
  void run(const std::vector<int>& list, const F& f) {
    if constexpr (std::is_same_v<T, Count>) {
      PhaseCost phase;
      for (const int i : list) {
        const long before = Count::flops;
        f(i);
        const auto flops = static_cast<double>(Count::flops - before);
        phase.work += flops;
        phase.longest = std::max(phase.longest, flops);
      }
      phases.push_back(phase);
    } else if (arena_ && list.size() > 1) {
      arena_->execute([&] {
        tbb::parallel_for(std::size_t{0}, list.size(), [&](std::size_t i) { f(list[i]); });
      });
    } else {
      for (const int i : list) f(i);
    }
  }

  // f(i) for the nodes of a tree, a phase a depth: from the leaves, and from the root.
  template <class F>
  void run_upwards(const std::vector<std::vector<int>>& by_depth, const F& f) {
    for (auto nodes = by_depth.rbegin(); nodes != by_depth.rend(); ++nodes) run(*nodes, f);
  }
  template <class F>
  void run_downwards(const std::vector<std::vector<int>>& by_depth, const F& f) {
    for (const std::vector<int>& nodes : by_depth) run(nodes, f);
  }

  std::vector<PhaseCost> phases;  // of counting numbers, since it was cleared last

 private:
  std::unique_ptr<tbb::task_arena> arena_;
};

}  // namespace kalmarm::scan
