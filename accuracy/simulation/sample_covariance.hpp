// A sample covariance, by as many threads as there are, and the same bits for any number of them.
//
// Samples come in blocks of 64. A block's sum of y y* is a product of matrices; the sums of blocks
// are added in pairs by a tree that depends on the range alone (parallel_deterministic_reduce).
// Each grow() is one such tree: the last bits depend on the counts on the way, on nothing else.
#pragma once

#include <tbb/enumerable_thread_specific.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <cstdint>
#include <utility>

#include "accuracy/simulation/sampler.hpp"
#include "algorithms/study/estimation/simulation.hpp"

namespace kalmarm {

// So many threads as long as it lives, also more than the machine has cores.
class SamplerThreads {
 public:
  explicit SamplerThreads(int count)
      : limit_(tbb::global_control::max_allowed_parallelism, count), arena_(count) {}

  template <class F>
  void run(F&& f) {
    arena_.execute(std::forward<F>(f));
  }

 private:
  tbb::global_control limit_;
  tbb::task_arena arena_;
};

class SampleCovariance {
 public:
  static constexpr int block = 64;

  // The simulation, the sampler and the threads must outlive it.
  SampleCovariance(const Simulation<double>& simulation, Quantity quantity, const Sampler& sampler,
                   SamplerThreads& threads);

  // Draws more samples until there are so many, a multiple of `block`.
  void grow(std::int64_t samples);

  std::int64_t samples() const { return samples_; }

  // 1/S sum of y y*, both triangles.
  MatrixX<double> value() const;

 private:
  struct Workspace {
    MatrixX<double> normals, y;  // one sample a column
    Sample<double> sample;
  };
  struct Sum;

  const Simulation<double>& simulation_;
  const Quantity quantity_;
  const Sampler& sampler_;
  SamplerThreads& threads_;
  tbb::enumerable_thread_specific<Workspace> workspaces_;
  MatrixX<double> sum_;  // lower triangle
  std::int64_t samples_ = 0;
};

}  // namespace kalmarm
