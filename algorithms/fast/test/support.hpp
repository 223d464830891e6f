// What the tests of the fast path share: mechanisms, robots of them, rows of states. They ask as a
// user does, of Dynamics: no kernel is compiled here.
#pragma once

#include <algorithm>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/fast/test/truth.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/test/models.hpp"
#include "kalmarm/dynamics.hpp"

namespace kalmarm::test {

// A hinge axis that is turned by `alpha` against its parent's, which lies a distance of 0.3 away.
inline Model<double> nearly_parallel(double alpha) {
  Random random(5);
  Builder builder;
  for (int k = 0; k < 8; ++k) {
    Joint<double> joint = random_joint(random, k - 1);
    joint.rotation = {1, alpha / 2, alpha / 3, random.uniform(-1, 1)};
    joint.translation = 0.3 * random.vector3();
    builder.add(joint);
  }
  return builder.build();
}

// Slides between hinges on branches, and a free joint and a ball joint far from the base, all with
// and without armature.
inline Model<double> everything(std::uint64_t seed) {
  Random random(seed);
  Builder builder;
  std::vector<int> links{builder.add_free(random_joint(random, -1))};
  for (int k = 0; k < 12; ++k) {
    const int parent = links[std::max(0, static_cast<int>(links.size()) - 1 - random.below(3))];
    const bool is_hinge = k == 4 || k == 8 || random.chance(0.6);
    Joint<double> joint =
        random_joint(random, parent, is_hinge ? Coordinate::angle : Coordinate::distance);
    if (random.chance(0.4)) joint.r = random.uniform(0.01, 0.1);
    links.push_back(k == 4   ? builder.add_ball(joint)
                    : k == 8 ? builder.add_free(joint)
                             : builder.add(joint));
  }
  return builder.build();
}

// One body on a ball joint, and one that is free, each with and without an arm.
template <int (Builder::*add)(Joint<double>)>
Model<double> body_on_the_base(std::uint64_t seed) {
  Random random(seed);
  Builder builder;
  int link = (builder.*add)(random_joint(random, -1));
  if (seed % 2 == 1) link = builder.add(random_joint(random, link));
  return builder.build();
}

// Eleven limbs of one to five hinges, with armature here and there, on a free trunk and on the
// base: more than there are lanes.
inline Model<double> creature(std::uint64_t seed) {
  Random random(seed);
  Builder builder;
  const auto add = [&](int parent) {
    Joint<double> joint = random_joint(random, parent);
    if (random.chance(0.3)) joint.r = random.uniform(0.01, 0.1);
    return builder.add(joint);
  };
  const int trunk = builder.add_free(random_joint(random, -1));
  const int chest = add(add(trunk));
  for (int limb = 0; limb < 11; ++limb) {
    int link = limb == 10 ? -1 : limb % 3 == 0 ? trunk : chest;
    for (int k = 0; k < 1 + (limb * 3) % 5; ++k) link = add(link);
  }
  return builder.build();
}

inline std::vector<Family> all_families() {
  std::vector<Family> all = families();
  all.push_back({"everything", everything});
  all.push_back({"ball_on_the_base", body_on_the_base<&Builder::add_ball>});
  all.push_back({"free_body", body_on_the_base<&Builder::add_free>});
  all.push_back({"antiparallel", [](std::uint64_t seed) {
                   Random random(seed);
                   Builder builder;
                   for (int k = 0; k < 6; ++k) {
                     Joint<double> joint = random_joint(random, k - 1);
                     joint.rotation = {0, 1, random.uniform(-1, 1), 0};
                     builder.add(joint);
                   }
                   return builder.build();
                 }});
  for (const auto& [name, make] :
       {std::pair{"tilted_1", +[](std::uint64_t) { return nearly_parallel(1); }},
        std::pair{"tilted_1e-1", +[](std::uint64_t) { return nearly_parallel(1e-1); }},
        std::pair{"tilted_1e-5", +[](std::uint64_t) { return nearly_parallel(1e-5); }},
        std::pair{"tilted_1e-12", +[](std::uint64_t) { return nearly_parallel(1e-12); }}})
    all.push_back({name, make});
  return all;
}

// Two rows of the same numbers: of a state that rows are to answer, since one row is answered as one state.
template <class T>
VectorX<T> twice(const VectorX<T>& x) {
  VectorX<T> out(2 * x.size());
  out << x, x;
  return out;
}

template <class T>
VectorX<T> poisoned(int n) {
  return VectorX<T>::Constant(n, std::numeric_limits<T>::quiet_NaN());
}

template <class T>
MatrixX<T> poisoned(int rows, int columns) {
  return MatrixX<T>::Constant(rows, columns, std::numeric_limits<T>::quiet_NaN());
}

// None: the default one of the precision.
using Tolerance = std::optional<double>;
inline const Tolerance tolerances[] = {{}, last_bits};

inline std::string name_of(const Tolerance& tolerance) {
  return tolerance ? "last bits" : "default tolerance";
}

// What a sweep answers itself: several trees in one.
inline std::set<Rule> rules_of_sweeps() {
  return {Rule::zero_terms, Rule::rest, Rule::partial_answers};
}

// By the kernels of 6-D vectors, also for slides alone.
inline DynamicsOptions spatial(std::set<Want> want, Tolerance tolerance = {}) {
  return {tolerance, {.want = std::move(want)}, rules_of_sweeps()};
}

// Of the robot whose parameters are rounded to T: on every rung the one that truth is of.
template <class T>
Dynamics<T> dynamics_of(const Model<double>& model, const DynamicsOptions& options) {
  return Dynamics<T>(plain(rounded<T>(model)), options);
}

// DoF of all branches, one of them twice, and frames on leaves, on a branch, two on one link, one on
// the base.
inline Selection random_selection(const Model<double>& model, std::uint64_t seed) {
  Random random(seed);
  Selection selection;
  const int nv = model.nv();
  for (int i = 0; i < std::min(nv, 9); ++i) selection.dofs.push_back(random.below(nv));
  selection.dofs.push_back(selection.dofs[0]);
  for (int link : {nv - 1, nv / 2, -1, nv / 2, random.below(nv), 0}) {
    const Eigen::Quaterniond rotation = random.quaternion();
    selection.frames.push_back({link, plain(rotation), plain(random.vector3())});
  }
  return selection;
}

// Rows with a guard behind them.
template <class T>
struct Rows {
  std::vector<T> q, qd, tau, a;
  std::vector<Outcome> outcomes;
  static constexpr int guard = 64;

  Rows(const Model<double>& model, int count)
      : a(count * model.nv() + guard, T(-77)), outcomes(count) {
    for (int i = 0; i < count; ++i) {
      const State<T> state = random_state(model, i).template cast<T>();
      q.insert(q.end(), state.q.begin(), state.q.end());
      qd.insert(qd.end(), state.qd.begin(), state.qd.end());
      tau.insert(tau.end(), state.tau.begin(), state.tau.end());
    }
  }

  // Returns how many failed.
  int forward_dynamics(Dynamics<T>& robot, int threads = 1) {
    return robot.forward_dynamics(q, qd, tau, result(robot), outcomes, threads);
  }
  // qdd stands in tau.
  void inverse_dynamics(Dynamics<T>& robot, int threads = 1) {
    robot.inverse_dynamics(q, qd, tau, result(robot), threads);
  }

 private:
  RowsView<T> result(const Dynamics<T>& robot) {
    return {a.data(), static_cast<std::ptrdiff_t>(outcomes.size()), robot.asked()};
  }
};

struct PrecisionName {
  template <class T>
  static std::string GetName(int) {
    return std::is_same_v<T, float> ? "float32" : "float64";
  }
};

}  // namespace kalmarm::test
