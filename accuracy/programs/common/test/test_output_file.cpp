#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>

#include <csignal>
#include <functional>
#include <thread>

#include "accuracy/programs/common/held_signals.hpp"
#include "accuracy/programs/common/output_file.hpp"
#include "algorithms/test/temporary_folder.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

namespace fs = std::filesystem;

// The exit code of a child process that calls it, or 128 and the signal that ended it.
int in_child(const std::function<int()>& call) {
  const pid_t child = fork();
  if (child == 0) _exit(call());
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

bool refuses(const std::string& path) {
  try {
    const OutputFile out(path);
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find(path), std::string::npos) << e.what();
    return true;
  }
  return false;
}

std::string error_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

TEST(OutputFile, IsWrittenAsAWholeAndLeavesNothingElse) {
  const TemporaryFolder folder;
  OutputFile out(folder / "a.csv");
  EXPECT_EQ(folder.count(), 0) << "nothing is there before it is written";
  out.write("one\n");
  EXPECT_EQ(content(folder / "a.csv"), "one\n");
  out.write("two\n");
  EXPECT_EQ(content(folder / "a.csv"), "two\n");
  EXPECT_EQ(folder.count(), 1);
}

TEST(OutputFile, OthersInTheFolderStay) {
  const TemporaryFolder folder;
  put(folder / "a.csv.part", "a user's");
  OutputFile(folder / "a.csv").write("ours");
  EXPECT_EQ(content(folder / "a.csv.part"), "a user's");
  EXPECT_EQ(folder.count(), 2);
}

TEST(OutputFile, LinksAreFollowedAndStay) {
  const TemporaryFolder folder, other;
  put(other / "target", "before");
  fs::create_symlink(other / "target", folder / "far");
  fs::create_symlink("far", folder / "link");  // to a link, and relative
  fs::create_symlink("new", folder / "dangling");
  OutputFile(folder / "link").write("after");
  OutputFile(folder / "dangling").write("made");
  EXPECT_EQ(content(other / "target"), "after");
  EXPECT_EQ(content(folder / "new"), "made");
  for (const char* name : {"far", "link", "dangling"})
    EXPECT_TRUE(fs::is_symlink(folder / name)) << name;
  EXPECT_EQ(other.count(), 1);
  fs::create_symlink("loop", folder / "loop");
  EXPECT_TRUE(refuses(folder / "loop"));
}

TEST(OutputFile, PermissionsStay) {
  const TemporaryFolder folder;
  for (const mode_t mode : {0600, 0644, 0755, 0666}) {
    put(folder / "a", "before");
    chmod((folder / "a").c_str(), mode);
    OutputFile(folder / "a").write("after");
    struct stat it;
    stat((folder / "a").c_str(), &it);
    EXPECT_EQ(it.st_mode & 07777, mode);
    EXPECT_EQ(content(folder / "a"), "after");
  }
}

TEST(OutputFile, WhatCannotBeWrittenIsRefusedBeforeTheWork) {
  const TemporaryFolder folder;
  EXPECT_TRUE(refuses(folder / "nowhere/a"));
  EXPECT_TRUE(refuses(folder.path()));
  EXPECT_TRUE(refuses(folder / "new/"));
  EXPECT_TRUE(refuses(folder / std::string(300, 'a')));
  EXPECT_TRUE(refuses("/proc/nowhere"));
  put(folder / "file", "");
  EXPECT_TRUE(refuses(folder / "file/a"));
  EXPECT_EQ(folder.count(), 1);
}

TEST(OutputFile, AProtectedFileOrFolderIsRefused) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "closed");
  put(folder / "protected", "before");
  chmod((folder / "protected").c_str(), 0444);
  chmod((folder / "closed").c_str(), 0555);
  chmod(folder.path().c_str(), 0777);
  const int code = in_child([&] {
    constexpr uid_t nobody = 65534;
    if (getuid() == 0 && setuid(nobody) != 0) return 1;
    return refuses(folder / "protected") && refuses(folder / "closed/a") ? 0 : 1;
  });
  EXPECT_EQ(code, 0);
  EXPECT_EQ(content(folder / "protected"), "before");
}

TEST(OutputFile, WhatIsReadIsNotOverwritten) {
  const TemporaryFolder folder;
  put(folder / "robot.xml", "<mujoco/>");
  put(folder / "late", "");
  fs::create_symlink("robot.xml", folder / "link");
  fs::create_hard_link(folder / "robot.xml", folder / "twin");
  EXPECT_EQ(in_child([&] {  // inputs are a program's for good
              add_input(folder / "robot.xml");
              for (const char* name : {"robot.xml", "link", "twin"})
                EXPECT_TRUE(refuses(folder / name)) << name;
              const OutputFile out(folder / "late");
              EXPECT_THROW(add_input(folder / "late"), InputError);
              return testing::Test::HasFailure() ? 1 : 0;
            }),
            0);
  EXPECT_EQ(content(folder / "robot.xml"), "<mujoco/>");
}

TEST(OutputFile, IsWrittenByOneAtATimeWhateverItIsCalled) {
  const TemporaryFolder folder;
  fs::create_symlink("a", folder / "link");
  {
    const OutputFile out(folder / "a"), other(folder / "b");
    EXPECT_TRUE(refuses(folder / "a"));
    EXPECT_EQ(in_child([&] { return refuses(folder / "link") ? 0 : 1; }), 0);
  }
  EXPECT_FALSE(refuses(folder / "a"));
  EXPECT_EQ(folder.count(), 1) << "a lock is no file";
}

TEST(OutputFile, ALockEndsWithItsProcess) {
  const TemporaryFolder folder;
  EXPECT_EQ(in_child([&] {
              const OutputFile out(folder / "a");
              return std::raise(SIGKILL);
            }),
            128 + SIGKILL);
  EXPECT_FALSE(refuses(folder / "a"));
}

TEST(OutputFile, DevicesAndPipesAreWrittenToAndStay) {
  OutputFile("/dev/null").write("lost");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  EXPECT_NE(error_of([] { OutputFile("/dev/full").write("text"); }), "");

  const TemporaryFolder folder;
  const std::string pipe = folder / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  std::string read;
  std::thread reader([&] { read = content(pipe); });
  OutputFile(pipe).write("through");
  reader.join();
  EXPECT_EQ(read, "through");
  EXPECT_TRUE(fs::is_fifo(pipe));
}

TEST(OutputFile, AReaderThatHasGoneIsAnError) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  OutputFile out("/dev/fd/" + std::to_string(ends[1]));
  close(ends[0]);
  EXPECT_NE(error_of([&] { out.write("text"); }), "");
  close(ends[1]);
}

TEST(OutputFile, AnOpenFileThatIsNamedByItsDescriptorIsNotReplaced) {
  const TemporaryFolder folder;
  const int file = open((folder / "a").c_str(), O_WRONLY | O_CREAT, 0600);
  struct stat before, after;
  fstat(file, &before);
  OutputFile("/dev/fd/" + std::to_string(file)).write("text");
  stat((folder / "a").c_str(), &after);
  EXPECT_EQ(before.st_ino, after.st_ino);
  EXPECT_EQ(content(folder / "a"), "text");
  close(file);
}

// Also where that is a file: what is printed and what is written stand there one after the other.
TEST(OutputFile, StandardOutputIsWrittenToInOrder) {
  const TemporaryFolder folder;
  EXPECT_EQ(in_child([&] {
              if (!std::freopen((folder / "out").c_str(), "w", stdout)) return 1;
              std::printf("printed ");
              OutputFile("/dev/stdout").write("written ");
              OutputFile(folder / "out").write("so too ");
              std::printf("and printed");
              return std::fflush(stdout) == 0 ? 0 : 1;
            }),
            0);
  EXPECT_EQ(content(folder / "out"), "printed written so too and printed");
}

TEST(OutputFile, AFileThatDoesNotFitLeavesTheOneBefore) {
  const TemporaryFolder folder;
  put(folder / "a", "before");
  EXPECT_EQ(in_child([&] {
              OutputFile out(folder / "a");
              std::signal(SIGXFSZ, SIG_IGN);
              const rlimit limit{100, 100};
              setrlimit(RLIMIT_FSIZE, &limit);
              return error_of([&] { out.write(std::string(1000, 'x')); }).empty() ? 1 : 0;
            }),
            0);
  EXPECT_EQ(content(folder / "a"), "before");
  EXPECT_EQ(folder.count(), 1);
}

TEST(HeldSignals, EndTheProgramAfterWhatMustNotBeCutOff) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const TemporaryFolder folder;
    EXPECT_EQ(in_child([&] {
                const HeldSignals outer;
                {
                  const HeldSignals inner;
                  std::raise(signal);
                }
                put(folder / "done", "");
                return 0;
              }),
              128 + signal);
    EXPECT_TRUE(fs::exists(folder / "done"));
  }
}

TEST(HeldSignals, WhatIsIgnoredStaysIgnored) {
  EXPECT_EQ(in_child([] {
              std::signal(SIGHUP, SIG_IGN);  // as nohup does
              const HeldSignals held;
              std::raise(SIGHUP);
              return held.waiting();
            }),
            0);
}

}  // namespace
}  // namespace kalmarm
