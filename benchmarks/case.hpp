// What the benchmarks of forward dynamics and of M share: a scene with its states, what is right
// for the first few of them, and how a result is reported.
#pragma once

#include <benchmark/benchmark.h>

#include <cstdint>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "algorithms/study/solver.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm {

inline constexpr int batch_size = 1024;

// Which joint failed, and how.
std::string describe(const Scene& scene, const Outcome& outcome);

std::string wrong(double error, double bound);

// By Newton and Euler in link frames; tau has the numbers of qdd.
VectorX<double> torque(const Model<double>& model, const State& state);

// The truth is that of the float64 square-root filter. Bounds: 1000 nv u, times the condition
// number where M^-1 enters.
struct Case {
  Scene scene;
  std::vector<State> states;
  std::vector<VectorX<double>> a;     // of the first states, as many as are verified
  std::vector<MatrixX<double>> M, X;  // X = M^-1
  std::vector<double> condition;      // upper bound of that of M scaled to unit diagonal
  std::string flaw;                   // why the reference itself failed

  Case(Scene what, std::uint64_t seed);

  int verified() const { return static_cast<int>(a.size()); }

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

// The states in precision T, one by one and as row-major arrays.
template <class T>
struct Pool {
  std::vector<VectorX<T>> q, qd, tau;
  std::vector<T> q_rows, qd_rows, tau_rows;

  explicit Pool(const std::vector<State>& states) {
    const auto put = [](const VectorX<double>& x, std::vector<VectorX<T>>& vectors,
                        std::vector<T>& rows) {
      vectors.push_back(x.cast<T>());
      rows.insert(rows.end(), vectors.back().begin(), vectors.back().end());
    };
    for (const State& state : states) {
      put(state.q, q, q_rows);
      put(state.qd, qd, qd_rows);
      put(state.tau, tau, tau_rows);
    }
  }
};

inline std::string name_of(const std::string& task, const std::string& variant,
                           const std::string& scene, bool is_float32) {
  return task + "/" + variant + "/" + scene + (is_float32 ? "/float32" : "/float64");
}
template <class T>
std::string name_of(const std::string& task, const std::string& variant, const Case& c) {
  return name_of(task, variant, c.scene.name, std::is_same_v<T, float>);
}

// Counters of a call on `states` states, of `flops` each and at least `bytes` to move; 0: not known.
inline void count(benchmark::State& run, double flops, int states, double bytes = 0) {
  using benchmark::Counter;
  if (bytes > 0) run.counters["bytes"] = bytes;
  if (flops > 0) {
    run.counters["flops"] = flops;
    run.counters["FLOP/s"] = Counter(flops * states, Counter::kIsIterationInvariantRate);
  }
  if (states > 1)
    run.counters["s/state"] =
        Counter(states, Counter::kIsIterationInvariantRate | Counter::kInvert);
}

// Times `call(i)`, the work on state i of the pool.
template <class Call>
void time_calls(benchmark::State& run, const Call& call) {
  int i = 0;
  for (auto _ : run) {
    call(i);
    if (++i == batch_size) i = 0;
  }
}

// "" where call(i) of every state that is verified answers, with a result for which judge(i) is "".
template <class Call, class Judge>
std::string flaw_of(const Case& c, const Call& call, const Judge& judge) {
  std::string flaw = c.flaw;
  for (int i = 0; i < c.verified() && flaw.empty(); ++i) {
    const Outcome outcome = call(i);
    flaw = outcome ? judge(i) : describe(c.scene, outcome);
  }
  return flaw;
}

// Registers `call(i)` to be timed once `verify` finds no flaw.
template <class Verify, class Call>
void add_benchmark(const std::string& name, Verify verify, Call call, double flops = 0,
                   int states = 1) {
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& run) {
    if (const std::string flaw = verify(); !flaw.empty()) {
      run.SkipWithError(flaw.c_str());
      return;
    }
    time_calls(run, call);
    count(run, flops, states);
  })->Unit(benchmark::kNanosecond);
}

}  // namespace kalmarm
