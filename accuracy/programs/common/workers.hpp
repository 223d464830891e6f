// Work that is split over processes, not threads, because multi-precision keeps its precision per
// process.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "accuracy/programs/common/held_signals.hpp"

namespace kalmarm {

// Parts 0 to count - 1, of which each is done once, by any process, in any order.
struct SplitWork {
  using Part = std::function<void(std::size_t)>;

  std::size_t count = 0;
  std::function<std::string(std::size_t)> name;  // of a part, for progress and for what fails
  std::function<Part()> begin;                   // once in each process: what does a part there
};

// Does all parts in so many processes (0: as many as the machine has threads), and shows how far it
// is. Throws InputError where a part failed, with the first one's reason, or a process died. Where a
// signal waits the processes are ended, and it returns. They end with this one, however that ends.
void work_in_processes(const SplitWork& work, int processes, HeldSignals& signals);

}  // namespace kalmarm
