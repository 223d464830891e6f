// The batch of dynamics.hpp on all cores: the states are cut into parts, each with a workspace of
// its own.
//
// The threads are those of the standard library's parallel algorithms (with GCC's: TBB where it is
// installed, else there is one). A core gets several parts, so that one that is held up elsewhere
// leaves its last ones to the others.
#pragma once

#include <algorithm>
#include <execution>
#include <numeric>
#include <thread>
#include <vector>

#include "algorithms/structured/dynamics.hpp"

namespace kalmarm {

template <class S, class Form = CovarianceForm, int lanes = padding<S>>
class ThreadedBatch {
 public:
  explicit ThreadedBatch(const Model<S>& model) : nq_(model.nq()), nv_(model.nv()) {
    const int cores = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
    for (int i = 0; i < parts_a_core * cores; ++i) parts_.push_back({i, 0, Batch(model)});
  }

  // As StructuredBatch::acceleration, to the bit.
  int acceleration(int count, const S* q, const S* qd, const S* tau, S* a, Outcome* outcomes) {
    const int packs = (count + lanes - 1) / lanes, parts = static_cast<int>(parts_.size());
    std::for_each(std::execution::par, parts_.begin(), parts_.end(), [&](Part& part) {
      const auto start = [&](long i) { return static_cast<int>(packs * i / parts) * lanes; };
      const int first = start(part.index), end = std::min(count, start(part.index + 1));
      part.failed = 0;
      if (first >= end) return;
      part.failed = part.batch.acceleration(end - first, q + first * nq_, qd + first * nv_,
                                            tau + first * nv_, a + first * nv_, outcomes + first);
    });
    return std::accumulate(parts_.begin(), parts_.end(), 0,
                           [](int sum, const Part& part) { return sum + part.failed; });
  }

 private:
  using Batch = StructuredBatch<S, Form, lanes>;
  struct Part {
    int index, failed;
    Batch batch;
  };
  static constexpr int parts_a_core = 4;

  std::ptrdiff_t nq_, nv_;
  std::vector<Part> parts_;
};

}  // namespace kalmarm
