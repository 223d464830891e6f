// How the columns of M are divided among registers, and the steps of a sweep over one after another.
//
// A sweep of columns first to last visits
//   path(first, last) = first, ..., last and all links between them and the base
// The division is the one with the fewest steps, and among those with the fewest registers:
//   steps(end) = min over first of steps(first) + |path(first, end - 1)|,  end - first <= lanes
// Cuts lie where limbs begin and end rather than within two limbs, along each of which the other's
// lanes would be zero. Of g1 (35 DoF) registers of 8 lanes take 62 steps; cut every 8 columns from the
// last one on they take 71, and pairs of registers swept together 45, as 87 of one register.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "algorithms/fast/lowering/lowered_model.hpp"

namespace kalmarm {

// Of one link and the columns of one register.
struct ColumnStep {
  int link;
  int lane;             // of the link's own column; -1: in another register
  int from = -1;        // index of the branch that is added to z; -1: none
  int into = -1;        // index of the branch to which z is added at its end; -1: none
  bool begins = false;  // nothing comes from the step before
  bool opens = false;   // nothing was added to `into` yet
};

// M[to + i] = lane i, of M column-major.
struct ColumnWrite {
  int step;  // of which the lanes are the result; the number of steps: zero
  std::ptrdiff_t to;
};

class ColumnSchedule {
 public:
  // Of columns 0 to columns - 1.
  template <class S>
  ColumnSchedule(const LoweredModel<S>& model, int columns, int lanes) {
    const std::vector<int> cuts = cheapest_cuts(model, columns, lanes);
    std::vector<int> begin;  // steps of register i: from begin[i] on
    for (std::size_t i = 0; i + 1 < cuts.size(); ++i) {
      begin.push_back(static_cast<int>(steps_.size()));
      add_steps(model, cuts[i], cuts[i + 1] - 1);
    }
    // Column by column, so that what spare lanes write is written again later (lower_triangle.hpp).
    std::vector<int> next = begin;
    begin.push_back(static_cast<int>(steps_.size()));
    for (std::size_t i = 0; i < next.size(); ++i) next[i] = begin[i + 1] - 1;
    for (int k = 0; k < columns; ++k)
      for (std::size_t i = 0; i < next.size(); ++i) {
        if (cuts[i + 1] <= k) continue;
        const bool visits = next[i] >= begin[i] && steps_[next[i]].link == k;
        writes_.push_back(
            {visits ? next[i]-- : begin.back(), std::ptrdiff_t(k) * model.nv() + cuts[i]});
      }
  }

  const std::vector<ColumnStep>& steps() const { return steps_; }     // tips to base
  const std::vector<ColumnWrite>& writes() const { return writes_; }  // by column

 private:
  // First columns of the registers, and the end.
  template <class S>
  static std::vector<int> cheapest_cuts(const LoweredModel<S>& model, int columns, int lanes) {
    std::vector<std::pair<int, int>> cost(columns + 1);  // steps, registers
    std::vector<int> first_of(columns + 1, 0), visited(model.nv(), 0);
    for (int end = 1; end <= columns; ++end) {
      int links = 0;
      for (int first = end - 1; first >= std::max(0, end - lanes); --first) {
        for (int k = first; k >= 0 && visited[k] != end; k = model.link(k).parent, ++links)
          visited[k] = end;
        const std::pair<int, int> with = {cost[first].first + links, cost[first].second + 1};
        if (first < end - 1 && with >= cost[end]) continue;
        cost[end] = with;
        first_of[end] = first;
      }
    }
    std::vector<int> cuts = {columns};
    while (cuts.back() > 0) cuts.push_back(first_of[cuts.back()]);
    std::reverse(cuts.begin(), cuts.end());
    return cuts;
  }

  template <class S>
  void add_steps(const LoweredModel<S>& model, int first, int last) {
    std::vector<char> on_path(model.nv(), 0), opened(model.branch_count(), 0);
    bool carried = false;  // z comes from link k + 1
    for (int k = last; k >= 0; --k) {
      if (k < first && !on_path[k]) {
        carried = false;
        continue;
      }
      const LoweredLink<S>& link = model.link(k);
      ColumnStep step{k, k >= first ? k - first : -1};
      step.begins = !carried;
      if (link.branch >= 0 && opened[link.branch]) step.from = link.branch;
      carried = link.hangs_on_previous;
      if (link.parent >= 0) {
        on_path[link.parent] = 1;
        if (!carried) {
          step.into = model.link(link.parent).branch;
          step.opens = !opened[step.into];
          opened[step.into] = 1;
        }
      }
      steps_.push_back(step);
    }
  }

  std::vector<ColumnStep> steps_;
  std::vector<ColumnWrite> writes_;
};

}  // namespace kalmarm
