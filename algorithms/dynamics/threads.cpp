#include "algorithms/dynamics/threads.hpp"

#include <unistd.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace kalmarm {

// Threads that wait for a round of work, in which all of them take part.
struct Threads::Pool {
  explicit Pool(int threads) : wanted(threads) {
    try {
      for (int worker = 1; worker <= threads; ++worker)
        all.emplace_back([this, worker] { wait(worker); });
    } catch (const std::system_error&) {  // the system has no more
    }
  }
  ~Pool() {
    {
      const std::lock_guard lock(mutex);
      ends = true;
    }
    begins.notify_all();
    for (std::thread& thread : all) thread.join();
  }

  bool is_forked() const { return getpid() != process; }

  void wait(int worker) {
    std::unique_lock lock(mutex);
    for (unsigned seen = 0;;) {
      begins.wait(lock, [&] { return ends || round != seen; });
      if (ends) return;
      seen = round;
      lock.unlock();
      (*work)(worker);
      lock.lock();
      if (--working == 0) done.notify_one();
    }
  }

  // f(worker) of all, and of the caller as worker 0.
  void run(const std::function<void(int worker)>& f) {
    {
      const std::lock_guard lock(mutex);
      work = &f;
      working = static_cast<int>(all.size());
      ++round;
    }
    begins.notify_all();
    f(0);
    std::unique_lock lock(mutex);
    done.wait(lock, [&] { return working == 0; });
  }

  const int wanted;
  const pid_t process = getpid();
  std::mutex mutex;
  std::condition_variable begins, done;
  const std::function<void(int)>* work = nullptr;
  unsigned round = 0;
  int working = 0;
  bool ends = false;
  std::vector<std::thread> all;
};

// In a forked process there is nobody to wait for, and locks are as the fork found them.
void Threads::End::operator()(Pool* pool) const {
  if (!pool->is_forked()) delete pool;
}

Threads::Threads() = default;
Threads::~Threads() = default;
Threads::Threads(Threads&&) noexcept = default;
Threads& Threads::operator=(Threads&&) noexcept = default;

void Threads::run(int threads, int parts, const std::function<void(int worker, int part)>& f) {
  std::atomic<int> next = 0;
  const auto work = [&](int worker) {
    if (worker >= threads) return;  // of an earlier call for more
    for (int part = next++; part < parts; part = next++) f(worker, part);
  };
  if (threads <= 1) return work(0);
  if (!pool_ || pool_->is_forked() || pool_->wanted < threads - 1)
    pool_.reset(new Pool(threads - 1));
  pool_->run(work);
}

}  // namespace kalmarm
