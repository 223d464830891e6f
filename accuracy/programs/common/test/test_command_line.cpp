#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <new>
#include <stdexcept>
#include <thread>

#include "accuracy/programs/common/command_line.hpp"
#include "algorithms/test/temporary_folder.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

struct Ended {
  int code;
  std::string output, error;
};

// What a program in a process of its own makes of it.
Ended ended(const std::function<int()>& run, const std::vector<std::string>& arguments = {},
            const std::string& output = "") {
  const TemporaryFolder folder;
  const pid_t child = fork();
  if (child == 0) {
    const std::string path = output.empty() ? folder / "output" : output;
    dup2(open(path.c_str(), O_WRONLY | O_CREAT, 0600), STDOUT_FILENO);
    dup2(open((folder / "error").c_str(), O_WRONLY | O_CREAT, 0600), STDERR_FILENO);
    CLI::App app("A program.", "program");
    std::vector<std::string> words{"program"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> argv;
    for (std::string& word : words) argv.push_back(word.data());
    const int code = run_program(app, static_cast<int>(argv.size()), argv.data(), run);
    std::fflush(nullptr);
    _exit(code);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status),
          content(folder / "output"), content(folder / "error")};
}

int refuse() { throw InputError("refused where nothing may be thrown"); }

TEST(RunProgram, WhateverIsThrownEndsItInALine) {
  const std::vector<std::pair<std::function<int()>, std::string>> all{
      {[]() -> int { throw InputError("no\nsuch robot"); }, "no such robot"},
      {[]() -> int { throw std::bad_alloc(); }, "out of memory"},
      {[]() -> int { throw std::length_error("vector::reserve"); }, "memory"},
      {[]() -> int { throw std::out_of_range("no joint 7"); }, "no joint 7"},
      {[]() -> int { throw std::filesystem::filesystem_error("bad\nname", {}); }, "bad name"},
      {[]() -> int { throw 1; }, "unknown"},
      {[] {
         std::thread([] { throw InputError("of a thread"); }).join();
         return 0;
       },
       "of a thread"},
      {[]() noexcept { return refuse(); }, "refused where nothing may be thrown"}};
  for (const auto& [run, word] : all) {
    SCOPED_TRACE(word);
    const Ended it = ended(run);
    EXPECT_EQ(it.code, 2);
    EXPECT_TRUE(it.error.starts_with("program: error: ")) << it.error;
    EXPECT_EQ(it.error.find('\n'), it.error.size() - 1) << it.error;
    EXPECT_NE(it.error.find(word), std::string::npos) << it.error;
  }
}

TEST(RunProgram, NotesAreToldOnceAndOnlyOfASuccess) {
  const auto noted = [](int code) {
    return [code]() -> int {
      add_note("as it is");
      add_note("as it is");
      if (code == 2) throw InputError("wrong");
      return code;
    };
  };
  EXPECT_EQ(ended(noted(0)).error, "program: note: as it is\n");
  EXPECT_EQ(ended(noted(2)).error, "program: error: wrong\n");
}

TEST(RunProgram, WhatDoesNotArriveOnStandardOutputIsAnError) {
  const auto print = [](int code) {
    return [code] {
      std::printf("text\n");
      return code;
    };
  };
  const std::string line = "program: error: standard output cannot be written\n";
  EXPECT_EQ(ended(print(0)).output, "text\n");
  for (const int code : {0, 1}) {
    const Ended full = ended(print(code), {}, "/dev/full");
    EXPECT_EQ(full.code, 2);
    EXPECT_EQ(full.error, line);
  }
  EXPECT_EQ(ended(print(0), {"--help"}, "/dev/full").error, line);
  EXPECT_EQ(ended([] { return 0; }, {}, "/dev/full").code, 0);
}

TEST(RunProgram, AClosedStandardStreamIsNoFileOfTheProgram) {
  EXPECT_EQ(ended([] {
              close(STDIN_FILENO);
              CLI::App app("Within.", "within");
              std::string name = "within";
              char* argv[] = {name.data()};
              return run_program(app, 1, argv, [] {
                const int file = open("/dev/null", O_RDONLY);
                return file > STDERR_FILENO ? 0 : 1;
              });
            }).code,
            0);
}

}  // namespace
}  // namespace kalmarm
