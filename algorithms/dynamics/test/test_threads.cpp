// Work in parts: each is done once, by the workers asked for, in forked processes too.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <utility>
#include <vector>

#include "algorithms/dynamics/threads.hpp"

namespace kalmarm {
namespace {

bool every_part_is_done_once(Threads& threads, int workers, int parts) {
  std::vector<std::atomic<int>> done(parts);
  std::atomic<bool> known = true;
  threads.run(workers, parts, [&](int worker, int part) {
    if (worker < 0 || worker >= workers) known = false;
    ++done[part];
  });
  for (const std::atomic<int>& times : done)
    if (times != 1) return false;
  return known;
}

TEST(Threads, DoEveryPartOnceWhateverTheCallsBeforeAskedFor) {
  Threads threads;
  for (const int workers : {1, 4, 2, 7, 1, 3})
    for (const int parts : {0, 1, 2, 100})
      EXPECT_TRUE(every_part_is_done_once(threads, workers, parts));
}

TEST(Threads, OfAForkedProcessAreItsOwn) {
  Threads used, unused;
  EXPECT_TRUE(every_part_is_done_once(used, 3, 50));
  EXPECT_TRUE(every_part_is_done_once(unused, 3, 50));
  const pid_t child = fork();
  if (child == 0) {
    alarm(20);  // in the place of hanging
    bool right = every_part_is_done_once(used, 3, 50);
    for (Threads* one : {&used, &unused}) Threads(std::move(*one));  // whose threads end here
    _exit(right ? 0 : 1);
  }
  int status = -1;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  EXPECT_TRUE(every_part_is_done_once(used, 3, 50));
}

}  // namespace
}  // namespace kalmarm
