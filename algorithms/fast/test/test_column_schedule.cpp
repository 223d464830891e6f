// The schedule of M's columns: which registers hold them, what is swept, what is written where.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>
#include <vector>

#include "algorithms/fast/rigid/column_schedule.hpp"
#include "algorithms/fast/test/support.hpp"

namespace kalmarm::test {
namespace {

// Limbs of so many hinges on one link.
Model<double> limbs_of(const std::vector<int>& lengths) {
  Random random(1);
  Builder builder;
  const int trunk = builder.add(random_joint(random, -1));
  for (const int length : lengths) {
    int link = trunk;
    for (int k = 0; k < length; ++k) link = builder.add(random_joint(random, link));
  }
  return builder.build();
}

// Of any order, on the base too, with slides, ball and free joints, and limbs of unequal length or one link.
std::vector<Family> branched_families() {
  std::vector<Family> all = all_families();
  all.push_back({"creature", creature});
  all.push_back({"limbs", [](std::uint64_t) { return limbs_of({6, 1, 4, 6, 2}); }});
  all.push_back({"one_link_limbs", [](std::uint64_t) { return limbs_of({1, 1, 1, 1, 1, 1, 1}); }});
  return all;
}

// Whether link m is k or between it and the base.
bool is_inboard(const Model<double>& model, int m, int k) {
  while (k > m) k = model.joint(k).parent;
  return k == m;
}

std::size_t links_on_path(const Model<double>& model, int first, int last) {
  std::size_t links = 0;
  for (int m = 0; m <= last; ++m) {
    bool visited = false;
    for (int k = first; k <= last; ++k) visited |= is_inboard(model, m, k);
    links += visited;
  }
  return links;
}

// Over every division of columns first to the last one.
std::size_t fewest_steps(const Model<double>& model, int first, int lanes) {
  if (first == model.nv()) return 0;
  std::size_t fewest = std::numeric_limits<std::size_t>::max();
  for (int end = first + 1; end <= std::min(first + lanes, model.nv()); ++end)
    fewest =
        std::min(fewest, links_on_path(model, first, end - 1) + fewest_steps(model, end, lanes));
  return fewest;
}

TEST(ColumnSchedule, HasAsFewStepsAsAnyDivision) {
  for (const std::vector<int>& lengths :
       {std::vector<int>{3, 3, 3}, {6, 6}, {1, 5, 2}, {1, 1, 1, 1, 1, 1}, {4, 1, 4}, {12}})
    for (const int lanes : {1, 2, 4, 8}) {
      const Model<double> model = limbs_of(lengths);
      const ColumnSchedule schedule(LoweredModel<double>(model), model.nv(), lanes);
      EXPECT_EQ(schedule.steps().size(), fewest_steps(model, 0, lanes));
    }
}

// A trunk, two legs of six links and two arms of seven: with registers of eight nothing is swept
// along a limb but its own columns.
TEST(ColumnSchedule, LimbsHaveRegistersOfTheirOwn) {
  const Model<double> model = limbs_of({6, 6, 7, 7});
  const ColumnSchedule schedule(LoweredModel<double>(model), model.nv(), 8);
  EXPECT_EQ(schedule.steps().size(), 1U + 2 * 6 + 2 * 7 + 3);  // the trunk with a leg
}

// What the steps make of a force of 1 at every column's own link: a row of lanes a step, and zero.
std::vector<std::vector<int>> carried_by(const ColumnSchedule& schedule, int branches, int lanes) {
  const std::vector<int> zero(lanes, 0);
  std::vector<std::vector<int>> out, sums(branches, zero);
  std::vector<int> z = zero;
  const auto add = [](std::vector<int>& to, const std::vector<int>& from) {
    for (std::size_t i = 0; i < to.size(); ++i) to[i] += from[i];
  };
  for (const ColumnStep& step : schedule.steps()) {
    if (step.begins) z = zero;
    if (step.from >= 0) add(z, sums[step.from]);
    if (step.lane >= 0) ++z[step.lane];
    out.push_back(z);
    if (step.into < 0) continue;
    if (step.opens) sums[step.into] = zero;
    add(sums[step.into], z);
  }
  out.push_back(zero);
  return out;
}

// What is written last at (i,k), i >= k, is from a step of link k in the lane of column i: 1 where k is
// inboard of i, 0 where they are on different branches.
TEST(ColumnSchedule, WritesTheLowerTriangle) {
  for (const Family& family : branched_families())
    for (const int lanes : {1, 2, 4, 8, 16, 32}) {
      SCOPED_TRACE(family.name + (" of " + std::to_string(lanes)));
      const Model<double> model = family.make(2);
      const LoweredModel<double> lowered(model);
      const int nv = model.nv();
      const ColumnSchedule schedule(lowered, nv, lanes);
      const auto carried = carried_by(schedule, lowered.branch_count(), lanes);
      std::vector<int> written(nv * nv, -1);
      for (const ColumnWrite& write : schedule.writes()) {
        const std::size_t k = write.to / nv, step = write.step;
        if (step < schedule.steps().size()) {
          EXPECT_EQ(schedule.steps()[step].link, static_cast<int>(k));
        }
        for (int lane = 0; lane < lanes && write.to + lane < nv * nv; ++lane)
          written[write.to + lane] = carried[step][lane];
      }
      for (int k = 0; k < nv; ++k)
        for (int i = k; i < nv; ++i)
          EXPECT_EQ(written[k * nv + i], is_inboard(model, k, i)) << i << ' ' << k;
    }
}

}  // namespace
}  // namespace kalmarm::test
