#include "algorithms/dynamics/threads.hpp"

#include <atomic>
#define EIGEN_USE_THREADS
#include <unsupported/Eigen/CXX11/ThreadPool>

namespace kalmarm {

struct Threads::Pool {
  explicit Pool(int threads) : pool(threads) {}

  Eigen::ThreadPool pool;
};

Threads::Threads() = default;
Threads::~Threads() = default;
Threads::Threads(Threads&&) noexcept = default;
Threads& Threads::operator=(Threads&&) noexcept = default;

void Threads::run(int threads, int parts, const std::function<void(int worker, int part)>& f) {
  std::atomic<int> next = 0;
  const auto work = [&](int worker) {
    for (int part = next++; part < parts; part = next++) f(worker, part);
  };
  const int others = threads - 1;
  if (others > 0 && (!pool_ || pool_->pool.NumThreads() < others))
    pool_ = std::make_unique<Pool>(others);
  Eigen::Barrier done(others);
  for (int worker = 1; worker <= others; ++worker)
    pool_->pool.Schedule([&, worker] {
      work(worker);
      done.Notify();
    });
  work(0);
  if (others > 0) done.Wait();
}

}  // namespace kalmarm
