// Work in parts on several cores.
#pragma once

#include <functional>
#include <memory>

namespace kalmarm {

class Threads {
 public:
  Threads();
  ~Threads();
  Threads(Threads&&) noexcept;
  Threads& operator=(Threads&&) noexcept;

  // f(worker, part) for every part from 0 on, on `threads` cores: the caller is worker 0. Parts are
  // taken in order, so that a core that is held up elsewhere leaves the rest to the others. The
  // threads are kept for the next call. Where the system gives fewer, those do the work; a forked
  // process, which has none of them, gets its own.
  void run(int threads, int parts, const std::function<void(int worker, int part)>& f);

 private:
  struct Pool;
  struct End {
    void operator()(Pool* pool) const;
  };
  std::unique_ptr<Pool, End> pool_;
};

}  // namespace kalmarm
