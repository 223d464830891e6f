// C code is compiled once, and changes nothing but what it computes; what another user could have written, or is not
// whole, is not loaded.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "algorithms/generate/c_library.hpp"
#include "algorithms/test/temporary_folder.hpp"

namespace kalmarm::test {
namespace {

namespace fs = std::filesystem;

using Files = std::map<std::string, std::string>;

const CCompiler compiler = {{KALMARM_TEST_COMPILER}, {"-Ofast"}};
// In two files, as long functions are.
const Files twice = {
    {"twice.c", "double sum(double, double); double twice(double x) { return sum(x, x); }"},
    {"sum.c", "double sum(double x, double y) { return x + y; }"}};

double twice_by(const CLibrary& library, double x) {
  auto* const function = library.function<double(double)>("twice");
  return function ? function(x) : NAN;
}

// A compiler that is a script: `before` runs first.
CCompiler script(const TemporaryFolder& folder, const std::string& before) {
  const std::string path = folder / "script";
  put(path, "#!/bin/sh\n" + before + "\nexec " KALMARM_TEST_COMPILER " \"$@\"\n");
  fs::permissions(path, fs::perms::owner_all);
  return {{path}, {"-O1"}};
}

std::string error_of(const Files& files, const CCompiler& by, const fs::path& folder) {
  try {
    make_library(files, by, folder);
  } catch (const std::runtime_error& e) {
    const std::string what = e.what();
    EXPECT_EQ(what.find('\n'), std::string::npos) << what;
    return what;
  }
  return "";
}

TEST(CLibrary, ComputesWhatTheTextSays) {
  const TemporaryFolder folder;
  const CLibrary library = make_library(twice, compiler, folder.path());
  EXPECT_EQ(twice_by(library, 21), 42);
  EXPECT_EQ(library.function<void()>("thrice"), nullptr);
  EXPECT_NE(library.made().version, "");
}

TEST(CLibrary, TheSameTextIsCompiledOnce) {
  const TemporaryFolder folder;
  const CLibrary first = make_library(twice, compiler, folder.path());
  const auto written = fs::last_write_time(first.made().path);
  const CLibrary second = make_library(twice, compiler, folder.path());
  EXPECT_FALSE(first.made().was_there);
  EXPECT_TRUE(second.made().was_there);
  EXPECT_EQ(second.made().path, first.made().path);
  EXPECT_NEAR(second.made().seconds, first.made().seconds, 1e-6);
  EXPECT_EQ(fs::last_write_time(second.made().path), written);
}

// The instruction set is among the macros that a compiler defines.
TEST(CLibrary, OtherTextFlagsAndCompilersAreOtherLibraries) {
  const TemporaryFolder folder, scripts;
  const fs::path first = make_library(twice, compiler, folder.path()).made().path;
  Files thrice = twice;
  thrice.at("twice.c") += "\n";
  EXPECT_NE(make_library(thrice, compiler, folder.path()).made().path, first);
  CCompiler other = compiler;
  other.flags = {"-O1"};
  EXPECT_NE(make_library(twice, other, folder.path()).made().path, first);
  const fs::path by_script = make_library(twice, script(scripts, ""), folder.path()).made().path;
  EXPECT_NE(by_script, first);
  EXPECT_NE(
      make_library(twice, script(scripts, "set -- -DANOTHER \"$@\""), folder.path()).made().path,
      by_script);
}

TEST(CLibrary, WhatFailsSaysWhyAndLeavesNothing) {
  const TemporaryFolder folder, scripts;
  EXPECT_NE(error_of({{"wrong.c", "no C"}}, compiler, folder.path()).find("error"),
            std::string::npos);
  EXPECT_NE(error_of(twice, {{"/no/compiler"}, {}}, folder.path()).find("/no/compiler"),
            std::string::npos);
  EXPECT_NE(error_of(twice, script(scripts, "echo broken; exit 3"), folder.path()).find("broken"),
            std::string::npos);
  EXPECT_NE(error_of(twice, script(scripts, "exit 0"), folder.path()).find("has not written"),
            std::string::npos);
  EXPECT_EQ(folder.count(), 0);
}

// With all that it has started.
TEST(CLibrary, ACompilerThatTakesTooLongIsEnded) {
  const TemporaryFolder folder, scripts;
  CCompiler slow = script(scripts, "(echo $$ > '" + scripts / "group" + "'; exec sleep 1000)");
  slow.limit = 0.5;
  EXPECT_NE(error_of(twice, slow, folder.path()).find("longer than 0.5 s"), std::string::npos);
  EXPECT_EQ(folder.count(), 0);
  const pid_t group = std::stoi(content(scripts / "group"));
  while (kill(-group, 0) == 0) usleep(1000);  // until init has taken it
}

// Half a library, another's text under the same name, one that others may write to, one that somebody else put there.
TEST(CLibrary, WhatIsNotWholeOrNotOursIsMadeAgain) {
  const TemporaryFolder folder;
  const fs::path library = make_library(twice, compiler, folder.path()).made().path,
                 entry = library.parent_path();
  const auto is_made_again = [&] {
    const CLibrary again = make_library(twice, compiler, folder.path());
    return !again.made().was_there && again.made().path == library && twice_by(again, 21) == 42;
  };
  fs::resize_file(library, fs::file_size(library) / 2);
  EXPECT_TRUE(is_made_again());
  put(library, content(library) + "x");
  EXPECT_TRUE(is_made_again());
  put(entry / "recipe", content(entry / "recipe") + "x");
  EXPECT_TRUE(is_made_again());
  fs::permissions(library, fs::perms::others_write, fs::perm_options::add);
  EXPECT_TRUE(is_made_again());
  fs::permissions(entry, fs::perms::group_write, fs::perm_options::add);
  EXPECT_TRUE(is_made_again());
  fs::rename(library, folder.path() / "elsewhere");
  fs::create_symlink(folder.path() / "elsewhere", library);
  EXPECT_TRUE(is_made_again());
  if (geteuid() == 0 && chown(library.c_str(), 65534, 65534) == 0) {
    EXPECT_TRUE(is_made_again());
  }
}

TEST(CLibrary, ProcessesMakeItAtTheSameTime) {
  const TemporaryFolder folder;
  std::vector<pid_t> children;
  for (int i = 0; i < 4; ++i) {
    const pid_t child = fork();
    if (child == 0) {
      bool is_right = false;
      try {
        is_right = twice_by(make_library(twice, compiler, folder.path()), 21) == 42;
      } catch (const std::exception&) {
      }
      _exit(is_right ? 0 : 1);
    }
    children.push_back(child);
  }
  for (const pid_t child : children) {
    int status = -1;
    waitpid(child, &status, 0);
    EXPECT_EQ(status, 0);
  }
  EXPECT_EQ(folder.count(), 1);
}

TEST(CLibrary, DenormalNumbersAreNotFlushedOnceItIsLoaded) {
  const TemporaryFolder folder;
  const CLibrary library = make_library(twice, compiler, folder.path());
  volatile double smallest = std::numeric_limits<double>::min();
  EXPECT_GT(smallest / 2, 0);
}

}  // namespace
}  // namespace kalmarm::test
