// What the benchmarks of forward dynamics and of M share: a scene with its states, what is right
// for the first few of them, and how a result is reported.
#pragma once

#include <benchmark/benchmark.h>

#include <cstdint>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/inverse_mass/condition.hpp"
#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/solver.hpp"
#include "robots/scene.hpp"

namespace kalmarm {

inline constexpr int batch_size = 1024;
inline constexpr int verified = 5;

inline std::string wrong(double error, double bound) {
  char text[80];
  std::snprintf(text, sizeof text, "wrong: error %.2g, bound %.2g", error, bound);
  return text;
}

// The truth is that of the float64 square-root filter. Bounds: 1000 nv u, times the condition
// number where M^-1 enters.
struct Case {
  Scene scene;
  std::vector<State> states;
  std::vector<VectorX<double>> a;
  std::vector<MatrixX<double>> M, X;  // X = M^-1
  std::vector<double> condition;      // upper bound of that of M scaled to unit diagonal
  std::string flaw;                   // why the reference itself failed

  Case(Scene what, std::uint64_t seed)
      : scene(std::move(what)), states(random_states(scene, batch_size, seed)) {
    const int nv = scene.model.nv();
    const auto solver = make_solver<double>("Sequential<ArrayMGS>", scene.model);
    RandomModel<double> rm(scene.model);
    CompositeInertia<double> composite(scene.model);
    for (int i = 0; i < verified; ++i) {
      a.emplace_back(nv);
      M.emplace_back(nv, nv);
      X.emplace_back(nv, nv);
      set_position(scene.model, states[i].q, rm);
      mass_matrix(scene.model, rm, composite, Eigen::Ref<MatrixX<double>>(M.back()));
      Outcome outcome = solver->acceleration(states[i].q, states[i].qd, states[i].tau, a.back());
      if (outcome) outcome = solver->inverse(states[i].q, X.back());
      if (!outcome) flaw = std::string("reference: ") + to_string(outcome.status);
      condition.push_back(scaled_condition_bound(M.back(), X.back()));
    }
  }

  // Of a relative error in precision T, by what it is amplified.
  template <class T>
  double bound(double amplification) const {
    return 1000.0 * scene.model.nv() * static_cast<double>(unit_roundoff<T>()) * amplification;
  }

  // "" where x, computed in precision T, is near enough to what is right.
  template <class T, class Right, class Result>
  std::string compare(const Right& right, const Result& x, double amplification) const {
    const double error = (x.template cast<double>() - right).norm() / right.norm();
    return error <= bound<T>(amplification) ? "" : wrong(error, bound<T>(amplification));
  }

  // The acceleration of state i.
  template <class T>
  std::string judge(int i, const VectorX<T>& x) const {
    return compare<T>(a[i], x, condition[i]);
  }
};

inline std::string name_of(const std::string& task, const std::string& variant,
                           const std::string& scene, bool is_float32) {
  return task + "/" + variant + "/" + scene + (is_float32 ? "/float32" : "/float64");
}

// Counters of a call on `states` states, of `flops` each; 0: not known.
inline void count(benchmark::State& run, double flops, int states) {
  using benchmark::Counter;
  if (flops > 0) {
    run.counters["flops"] = flops;
    run.counters["FLOP/s"] = Counter(flops * states, Counter::kIsIterationInvariantRate);
  }
  if (states > 1)
    run.counters["s/state"] =
        Counter(states, Counter::kIsIterationInvariantRate | Counter::kInvert);
}

}  // namespace kalmarm
