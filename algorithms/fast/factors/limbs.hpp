// The filter of the fast path (filter.hpp) on the limbs of a tree, one limb per SIMD lane.
//
// A limb is a run of hinges without contacts and loads from a link that branches, or from the base, to a tip. All lanes reach
// their limb's root joint in the same step. Lanes of shorter limbs start with dummy bodies (unit
// inertia about the axis, else zero), which pass on exactly nothing:
//   P = H'H,  D = 1,  g = H',  P+ = 0 to the last bit
// If some lanes of a step have joint noise, the others run with r = 0: P+ is the same, and g(axis)
// is set to 1. One SIMD step costs about two scalar links, so limbs are grouped only if together
// they have 2.5 times the links of the longest.
#pragma once

#include <algorithm>
#include <cstring>
#include <type_traits>
#include <utility>
#include <vector>

#include "algorithms/fast/covariance/filter.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

// For scalars without SIMD lanes.
struct NoLimbs {
  template <class Model>
  explicit NoLimbs(const Model&) {}

  static constexpr bool have(int) { return false; }
  template <class Model, class Factors>
  void factor(const Model&, Factors&) const {}
};

template <class S>
class LimbsInLanes {
 public:
  explicit LimbsInLanes(const LoweredModel<S>& model) : taken_(model.nv(), 0) {
    std::vector<Limb> limbs = limbs_of(model);
    std::stable_sort(limbs.begin(), limbs.end(),
                     [](const Limb& a, const Limb& b) { return a.links > b.links; });
    for (std::size_t first = 0; first < limbs.size(); first += lanes) {
      const std::vector<Limb> group(
          limbs.begin() + first,
          limbs.begin() + std::min(limbs.size(), first + std::size_t(lanes)));
      int links = 0;
      for (const Limb& limb : group) links += limb.links;
      if (2 * links >= 5 * group[0].links) take(model, group);
    }
  }

  // Whether factor() handles link k.
  bool have(int k) const { return taken_[k]; }

  // g and D of the limbs' links. phi P+ phi' of their root joints is added to the parents'
  // branches, and their margin is included.
  template <class Factors>
  void factor(const LoweredModel<S>& model, Factors& factors) {
    for (Group& group : groups_) factor(model, factors, group);
  }

 private:
  static constexpr int lanes = 8, numbers_of_P = 21;
  using Lane = Pack<S, lanes>;
  static_assert(sizeof(Articulated<S>) == numbers_of_P * sizeof(S) &&
                sizeof(Articulated<Lane>) == numbers_of_P * sizeof(Lane));

  struct Limb {
    int first, links;
  };

  // A joint of every lane.
  struct Level {
    int link[lanes];  // -1: a dummy body
    bool has_noise = false, turned = false, has_y = false, has_z = false;
    LoweredBody<Lane> body;
    Turn<Lane> alpha{Lane(S(1)), Lane(S(0))}, theta = alpha;
    Lane p[3], d = Lane(S(0));
    Lane cos = Lane(S(1)), sin = Lane(S(0));
  };
  struct Group {
    std::vector<Limb> limbs;
    std::vector<Level> levels;  // tips to base
  };

  static std::vector<Limb> limbs_of(const LoweredModel<S>& model) {
    std::vector<int> children(model.nv(), 0);
    for (int k = 0; k < model.nv(); ++k)
      if (model.link(k).parent >= 0) ++children[model.link(k).parent];
    std::vector<Limb> limbs;
    for (int tip = 0; tip < model.nv(); ++tip) {
      if (children[tip] > 0) continue;
      const auto is_hinge = [&](int k) {
        const LoweredLink<S>& link = model.link(k);
        return link.coordinate == Coordinate::angle && !link.resists && !link.loaded;
      };
      int first = tip;
      if (!is_hinge(first)) continue;
      while (model.link(first).hangs_on_previous && children[first - 1] == 1 && is_hinge(first - 1))
        --first;
      const int parent = model.link(first).parent;
      if (parent < 0 || model.link(parent).branch >= 0) limbs.push_back({first, tip - first + 1});
    }
    return limbs;
  }

  static void set(Lane& x, int lane, const S& value) { x.set(lane, value); }
  static void set(Turn<Lane>& x, int lane, const Turn<S>& value) {
    set(x.c, lane, value.c);
    set(x.s, lane, value.s);
    set(x.ss, lane, value.ss);
    set(x.cs, lane, value.cs);
  }
  static void set(LoweredBody<Lane>& x, int lane, const LoweredBody<S>& value) {
    set(x.r, lane, value.r);
    set(x.m, lane, value.m);
    for (int i = 0; i < 3; ++i) set(x.h[i], lane, value.h[i]);
    set(x.Ixx, lane, value.Ixx);
    set(x.Ixy, lane, value.Ixy);
    set(x.Ixz, lane, value.Ixz);
    set(x.Iyy, lane, value.Iyy);
    set(x.Iyz, lane, value.Iyz);
    set(x.Izz, lane, value.Izz);
    set(x.reach, lane, value.reach);
    const RoundingWeights<S>& w = value.weights;
    RoundingWeights<Lane>& to = x.weights;
    set(to.Axx, lane, w.Axx);
    set(to.Ayy, lane, w.Ayy);
    set(to.Azz, lane, w.Azz);
    set(to.Cxx, lane, w.Cxx);
    set(to.Cyy, lane, w.Cyy);
    set(to.Czz, lane, w.Czz);
    set(to.moment, lane, w.moment);
    set(to.force, lane, w.force);
    set(to.reach, lane, w.reach);
    set(to.unit, lane, w.unit);
    to.tested |= w.tested;
  }

  void take(const LoweredModel<S>& model, const std::vector<Limb>& limbs) {
    Group group{limbs, std::vector<Level>(limbs[0].links)};
    const int height = limbs[0].links;
    for (int i = 0; i < height; ++i) {
      Level& level = group.levels[i];
      for (Lane& x : level.p) x = Lane(S(0));
      LoweredBody<S> none;
      none.Izz = S(1);
      for (int lane = 0; lane < lanes; ++lane) {
        level.link[lane] = -1;
        set(level.body, lane, none);
        if (lane >= static_cast<int>(limbs.size())) continue;
        const int k = limbs[lane].first + height - 1 - i;
        if (k >= limbs[lane].first + limbs[lane].links) continue;
        const LoweredLink<S>& link = model.link(k);
        taken_[k] = 1;
        level.link[lane] = k;
        level.has_noise |= link.has_noise;
        level.turned |= link.turned;
        level.has_y |= link.p[1] != S(0);
        level.has_z |= link.p[2] != S(0);
        set(level.body, lane, model.body(k));
        set(level.alpha, lane, link.alpha);
        if (link.turned) set(level.theta, lane, model.uncommon(link).theta);
        for (int j = 0; j < 3; ++j) set(level.p[j], lane, link.p[j]);
        set(level.d, lane, link.d);
      }
    }
    groups_.push_back(std::move(group));
  }

  template <class Factors>
  static void factor(const LoweredModel<S>& model, Factors& factors, Group& group) {
    const int limbs = static_cast<int>(group.limbs.size());
    for (Level& level : group.levels)
      for (int lane = 0; lane < limbs; ++lane)
        if (level.link[lane] >= 0) {
          const int at = model.link(level.link[lane]).varying;
          set(level.cos, lane, factors.cos[at]);
          set(level.sin, lane, factors.sin[at]);
        }

    const Lane zero = Lane(S(0));
    Articulated<Lane> P = {zero, zero, zero, zero, zero, zero, zero, zero, zero, zero, zero,
                           zero, zero, zero, zero, zero, zero, zero, zero, zero, zero};
    HandedOn<Lane> pending = {zero, zero};
    Lane margin = Lane(factors.margin);
    for (const Level& level : group.levels) {
      if (level.has_noise)
        cross<true>(model, level, limbs, P, pending, margin, factors);
      else
        cross<false>(model, level, limbs, P, pending, margin, factors);
    }
    for (int lane = 0; lane < limbs; ++lane) {
      factors.margin = std::min(factors.margin, margin[lane]);
      const int parent = model.link(group.limbs[lane].first).parent;
      if (parent >= 0) leave(P, pending, lane, factors.branches[model.link(parent).branch]);
    }
  }

  // Across the joints of a level, as in filter.hpp.
  template <bool noise, class Factors>
  KALMARM_INLINE static void cross(const LoweredModel<S>& model, const Level& level, int limbs,
                                   Articulated<Lane>& P, HandedOn<Lane>& pending, Lane& margin,
                                   Factors& factors) {
    const LoweredBody<Lane>& body = level.body;
    add_body(P, body);
    Lane D;
    // A row of the factors a link: {d, 1/D, g} (factors.hpp).
    Lane rows[lanes];
    Sixfold<Lane> g;
    auto P_plus = measure_turn<noise>(P, body.r, D, rows[1], g);
    if (body.weights.tested) {
      const Lane e = detail::absorbed<false>(body.weights, P, level.d);
      detail::test_D<false>(body.weights, e, P, D, g, pending, margin);
      pending.move(body.reach);
    }

    translate_z(level.d, P_plus);
    rotate_z(Turn<Lane>(level.cos, level.sin), P_plus);
    P = rotate_x(level.alpha, P_plus);
    if (level.turned) rotate_z(level.theta, P);
    translate_x(level.p[0], P);
    if (level.has_y) translate_y(level.p[1], P);
    if (level.has_z) translate_z(level.p[2], P);

    rows[0] = Lane(S(0));
    rows[2] = g.x;
    rows[3] = g.y;
    rows[4] = noise ? g.z : Lane(S(1));
    rows[5] = g.u;
    rows[6] = g.v;
    rows[7] = g.w;
    transpose(rows);
    for (int lane = 0; lane < limbs; ++lane) {
      const int k = level.link[lane];
      if (k < 0) continue;
      auto& at = factors.links[k];
      static_assert(sizeof at == sizeof rows[lane]);
      std::memcpy(&at, &rows[lane], sizeof at);
      if (noise && !model.link(k).has_noise) at.g.z = S(1);
    }
  }

  // Adds one lane's P and what is pending to the sum over a link's children.
  template <class Branch>
  static void leave(const Articulated<Lane>& P, const HandedOn<Lane>& pending, int lane,
                    Branch& branch) {
    const Lane* const numbers = &P.Axx;
    S* const sum = &branch.P.Axx;
    for (int i = 0; i < numbers_of_P; ++i) sum[i] += numbers[i][lane];
    branch.pending.add({pending.moment[lane], pending.force[lane]});
  }

  std::vector<char> taken_;
  std::vector<Group> groups_;
};

// Those of T, if it has lanes.
template <class T>
using Limbs = std::conditional_t<std::is_floating_point_v<T>, LimbsInLanes<T>, NoLimbs>;

}  // namespace kalmarm
