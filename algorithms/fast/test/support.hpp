// What the tests of the fast path's forms share: mechanisms, truth, batches.
#pragma once

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/spatial/count.hpp"
#include "algorithms/structured/dynamics.hpp"
#include "algorithms/test/models.hpp"
#include "algorithms/test/world_frame.hpp"

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

struct Truth {
  MatrixX<Mp> M;
  VectorX<Mp> a;
  Mp size;  // |M^-1 tau|_M + |M^-1 bias|_M

  Truth(const Model<Mp>& model, const State<Mp>& state) {
    const World world(model, state.q, state.qd);
    const VectorX<Mp> bias = world.bias();
    M = world.mass_matrix();
    const Eigen::LDLT<MatrixX<Mp>> ldlt(M);
    a = ldlt.solve(state.tau - bias);
    size = sqrt(Mp(state.tau.dot(ldlt.solve(state.tau)))) + sqrt(Mp(bias.dot(ldlt.solve(bias))));
  }

  template <class T>
  double error(const VectorX<T>& x) const {
    const VectorX<Mp> d = x.template cast<Mp>() - a;
    return Mp(sqrt(Mp(d.dot(M * d))) / size).template convert_to<double>();
  }
};

template <class T>
VectorX<T> poisoned(int n) {
  return VectorX<T>::Constant(n, std::numeric_limits<T>::quiet_NaN());
}

template <class Form>
double flops_per_joint(const Model<double>& model) {
  const State<double> state = random_state(model, 3);
  const StructuredModel<double> structured(model);
  typename Form::template Workspace<Count> ws(structured);
  const auto counts = [](const VectorX<double>& x) {
    return std::vector<Count>(x.begin(), x.end());
  };
  const std::vector<Count> q = counts(state.q), qd = counts(state.qd), tau = counts(state.tau);
  std::vector<Count> a(model.nv());
  Count::flops = 0;
  Form::acceleration(structured, q.data(), qd.data(), tau.data(), ws, a.data());
  return static_cast<double>(Count::flops) / model.nv();
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
};

struct PrecisionName {
  template <class T>
  static std::string GetName(int) {
    return std::is_same_v<T, float> ? "float32" : "float64";
  }
};

}  // namespace kalmarm::test
