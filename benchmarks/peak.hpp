// The machine's limit in the same run as what is measured against it: fused multiply-adds on
// registers alone, x <- x b + c, as many chains as cover their latency.
#pragma once

#include <benchmark/benchmark.h>

#include "algorithms/spatial/pack.hpp"
#include "benchmarks/case.hpp"

namespace kalmarm {

template <class S>
void run_peak(benchmark::State& run) {
#if defined(__AVX512F__)
  constexpr int bytes = 64;
#elif defined(__AVX__)
  constexpr int bytes = 32;
#else
  constexpr int bytes = 16;
#endif
  constexpr int lanes = bytes / static_cast<int>(sizeof(S)), chains = 12, steps = 1000;
  using P = Pack<S, lanes>;
  const volatile S factor = S(0.5), term = S(1);  // not known to the compiler; x stays near 2
  const P b(factor), c(term);
  P x[chains];
  for (int i = 0; i < chains; ++i) x[i] = P(S(i));
  for (auto _ : run) {
    for (int step = 0; step < steps; ++step)
      for (int i = 0; i < chains; ++i) x[i] = x[i] * b + c;
    benchmark::DoNotOptimize(x);
  }
  count(run, 2.0 * lanes * chains * steps, 1);
}

inline void register_peak() {
  benchmark::RegisterBenchmark(name_of("peak", "fma", "native", false).c_str(), run_peak<double>);
  benchmark::RegisterBenchmark(name_of("peak", "fma", "native", true).c_str(), run_peak<float>);
}

}  // namespace kalmarm
