// The memory's limit in the same run as what is measured against it: the bandwidth of a copy, read and
// written bytes together. Arrays that a cache holds are copied at its bandwidth.
#pragma once

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <string>
#include <vector>

#include "algorithms/study/scan/tasks.hpp"
#include "algorithms/study/solver.hpp"

namespace kalmarm {

inline constexpr std::int64_t beyond_caches = std::int64_t{1} << 29;  // bytes

// bandwidth/copy@THREADS/bytes:BYTES/float64, of two arrays that have so many bytes together. On
// several threads it has to be told to take wall time.
inline benchmark::internal::Benchmark* register_bandwidth(int threads, std::int64_t bytes) {
  auto* const timed = benchmark::RegisterBenchmark(
      ("bandwidth/copy@" + std::to_string(threads) + "/bytes:" + std::to_string(bytes) + "/float64")
          .c_str(),
      [threads, bytes](benchmark::State& run) {
        const std::int64_t copied = bytes / (2 * std::int64_t{sizeof(double)});
        const VectorX<double> from = VectorX<double>::Ones(copied);
        VectorX<double> to = VectorX<double>::Zero(copied);
        scan::Tasks<double> tasks(threads);
        std::vector<int> parts(threads);
        std::iota(parts.begin(), parts.end(), 0);
        const std::int64_t part = (copied + threads - 1) / threads;
        for (auto _ : run) {
          tasks.run(parts, [&](int i) {
            const std::int64_t begin = std::min(i * part, copied);
            const std::int64_t count = std::min(part, copied - begin);
            to.segment(begin, count) = from.segment(begin, count);
          });
          benchmark::DoNotOptimize(to.data());
          benchmark::ClobberMemory();
        }
        run.SetBytesProcessed(run.iterations() * bytes);
      });
  return timed->Unit(benchmark::kMicrosecond);
}

// On one thread, from what the first cache holds to what none does; by the clock of calls: CPU time.
inline void register_bandwidths() {
  for (std::int64_t bytes = 1 << 13; bytes <= beyond_caches; bytes *= 4)
    register_bandwidth(1, bytes);
}

}  // namespace kalmarm
