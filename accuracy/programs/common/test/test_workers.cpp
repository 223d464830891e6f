#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <iterator>
#include <numeric>
#include <set>
#include <sstream>
#include <vector>

#include "accuracy/programs/common/workers.hpp"
#include "algorithms/test/temporary_folder.hpp"
#include "robots/loader/test/refusal.hpp"

namespace kalmarm {
namespace {

namespace fs = std::filesystem;

SplitWork work_of(std::size_t count, const SplitWork::Part& part) {
  return {count, [](std::size_t i) { return "part " + std::to_string(i); }, [=] { return part; }};
}

void work(const SplitWork& work, int processes = 3) {
  HeldSignals signals;
  work_in_processes(work, processes, signals);
}

// Appends a line, which processes do one after another.
void note(const fs::path& file, const std::string& line) {
  const int to = open(file.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
  ASSERT_EQ(write(to, (line + '\n').data(), line.size() + 1),
            static_cast<ssize_t>(line.size()) + 1);
  close(to);
}

TEST(Workers, DoEveryPartOnceAndBeginOnceInEachProcess) {
  const TemporaryFolder folder;
  const fs::path parts = fs::path(folder.path()) / "parts", begun = parts.string() + "-begun";
  SplitWork all = work_of(50, {});
  all.begin = [&]() -> SplitWork::Part {
    note(begun, std::to_string(getpid()));
    return [&](std::size_t i) { note(parts, std::to_string(i)); };
  };
  work(all);
  std::istringstream text(content(parts)), processes(content(begun));
  std::vector<int> done(std::istream_iterator<int>(text), {}), each(50);
  std::sort(done.begin(), done.end());
  std::iota(each.begin(), each.end(), 0);
  EXPECT_EQ(done, each);
  const std::vector<int> pids(std::istream_iterator<int>(processes), {});
  EXPECT_EQ(pids.size(), 3);
  EXPECT_EQ(std::set<int>(pids.begin(), pids.end()).size(), 3);
}

TEST(Workers, TellWhichPartFailedAndWhy) {
  const auto part = [](std::size_t i) {
    if (i == 7) throw InputError("no such robot");
  };
  EXPECT_EQ(complaint([&] { work(work_of(20, part)); }), "part 7: no such robot");
  SplitWork none = work_of(20, part);
  none.begin = []() -> SplitWork::Part { throw InputError("no journal"); };
  EXPECT_EQ(complaint([&] { work(none); }), "no journal");
}

TEST(Workers, TellThatOneDied) {
  const auto part = [](std::size_t i) {
    if (i == 7) raise(SIGKILL);
  };
  expect_refused([&] { work(work_of(20, part)); }, {"a worker died", "run again"});
}

TEST(Workers, EndAtASignalWhichIsTheCallers) {
  const pid_t child = fork();
  if (child == 0) {
    const pid_t parent = getpid();
    HeldSignals signals;
    work_in_processes(work_of(3,
                              [=](std::size_t) {
                                kill(parent, SIGTERM);
                                for (;;) pause();  // until it is ended
                              }),
                      3, signals);
    if (signals.waiting() != SIGTERM) _exit(1);
    signals.release();
    raise(SIGTERM);
    _exit(2);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status)) << WEXITSTATUS(status);
  EXPECT_EQ(WTERMSIG(status), SIGTERM);
}

}  // namespace
}  // namespace kalmarm
