#include "accuracy/programs/common/workers.hpp"

#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <new>
#include <thread>
#include <vector>

#include "accuracy/programs/common/command_line.hpp"
#include "accuracy/programs/common/progress.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

// Seen by all processes.
struct Shared {
  std::atomic<std::size_t> next{0}, done{0};
  std::atomic<bool> failed{false};  // the first process to fail sets it and says why
  char fault[1000] = "";
};

class SharedMemory {
 public:
  SharedMemory() {
    void* const memory =
        mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw InputError("no shared memory");
    shared_ = new (memory) Shared;
  }
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;
  ~SharedMemory() { munmap(shared_, sizeof(Shared)); }

  Shared& operator*() const { return *shared_; }

 private:
  Shared* shared_;
};

void do_parts(const SplitWork& work, Shared& shared) {
  std::string what;
  try {
    const SplitWork::Part part = work.begin();
    for (std::size_t i; !shared.failed && (i = shared.next++) < work.count; ++shared.done) {
      what = work.name(i) + ": ";
      part(i);
    }
  } catch (...) {
    if (!shared.failed.exchange(true))
      std::snprintf(shared.fault, sizeof shared.fault, "%s%s", what.c_str(),
                    handled_error().c_str());
  }
}

// A process that works until nothing is left, or until this one ends in whatever way; 0 where there
// is none.
pid_t start(const std::function<void()>& work) {
  const pid_t parent = getpid(), child = fork();
  if (child != 0) return std::max(child, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() == parent) work();  // or else it ended before that
  std::fflush(nullptr);
  _exit(0);
}

}  // namespace

void work_in_processes(const SplitWork& work, int processes, HeldSignals& signals) {
  const SharedMemory memory;
  Shared& shared = *memory;
  if (processes <= 0) processes = static_cast<int>(std::thread::hardware_concurrency());
  std::vector<pid_t> running;
  std::fflush(nullptr);
  for (int i = 0; i < std::max(1, processes); ++i) {
    const pid_t child = start([&] {
      signals.release();
      do_parts(work, shared);
    });
    if (child > 0) running.push_back(child);
  }
  bool all_well = !running.empty();
  Progress progress(static_cast<int>(work.count));
  std::size_t shown = 0;
  while (!running.empty()) {
    int status = 0;
    const pid_t ended = waitpid(-1, &status, WNOHANG);
    if (ended > 0) {
      std::erase(running, ended);
      all_well = all_well && WIFEXITED(status) && WEXITSTATUS(status) == 0;
    }
    for (; shown < std::min<std::size_t>(shared.done, work.count); ++shown)
      progress.step(work.name(shown));
    if (signals.waiting() != 0)
      for (const pid_t child : running) kill(child, SIGKILL);
    usleep(20000);
  }
  if (signals.waiting() != 0) return;
  if (shared.fault[0] != '\0') throw InputError(shared.fault);
  if (!all_well) throw InputError("a worker died; what is measured is kept, run again to go on");
}

}  // namespace kalmarm
