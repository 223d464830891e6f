#include "benchmarks/run.hpp"

#include <benchmark/benchmark.h>
#include <sys/mman.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <iterator>
#include <sstream>
#include <string_view>
#include <utility>

#include "accuracy/programs/common/command_line.hpp"
#include "accuracy/programs/common/output_file.hpp"
#include "accuracy/programs/common/ranges.hpp"
#include "benchmarks/context.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

constexpr std::string_view out_flag = "--benchmark_out=";

// Google Benchmark takes a function without arguments.
std::string usage;
bool asks_for_help = false;

// The library asks for help where a flag of its own has a wrong value, too, and ends well.
void print_help() {
  try {
    if (!asks_for_help)
      throw InputError(
          "--benchmark_format and --benchmark_out_format are console, json or csv; "
          "--benchmark_color is yes, no or auto");
    std::fputs(usage.c_str(), stdout);
    benchmark::PrintDefaultHelp();
    flush_standard_output();
  } catch (const InputError& e) {
    std::fprintf(stderr, "%s: error: %s\n", program_invocation_short_name, e.what());
    std::exit(2);
  }
}

std::string path_of(const Descriptor& memory) {
  return "/proc/self/fd/" + std::to_string(memory.number());
}

// Standard error while the library writes there. It says in a line of its own that a filter matches
// nothing or cannot be read, and goes on as if all were well: that line is kept, to be the program's
// error.
class ErrorStream : public std::stringbuf {
 public:
  ErrorStream() : before_(std::cerr.rdbuf(this)) {}
  ErrorStream(const ErrorStream&) = delete;
  ErrorStream& operator=(const ErrorStream&) = delete;
  ~ErrorStream() override { std::cerr.rdbuf(before_); }

 private:
  int sync() override {
    for (const char* failure : {"Failed to match", "Could not compile"})
      if (str().starts_with(failure)) return 0;
    std::fputs(str().c_str(), stderr);
    str("");
    return 0;
  }

  std::streambuf* before_;
};

// Google Benchmark aborts on a negative number of repetitions, and says in a line of its own where
// one is too large. What is wrong with the first wrong flag, which it does not see then; empty where
// none is.
std::string take_wrong_flag(int& argc, char** argv) {
  const std::pair<std::string, CLI::Validator> flags[] = {
      {"--benchmark_repetitions", between(1, 1'000'000)}, {"--benchmark_min_time", positive()}};
  for (int i = 1; i < argc; ++i)
    for (const auto& [name, range] : flags) {
      const std::string argument = argv[i];
      if (!argument.starts_with(name + "=")) continue;
      const std::string wrong = range(argument.substr(name.size() + 1));
      if (wrong.empty()) continue;
      std::copy(argv + i + 1, argv + argc + 1, argv + i);  // with the null at the end
      --argc;
      return name + ": " + wrong;
    }
  return "";
}

}  // namespace

Benchmarks::Benchmarks(int& argc, char** argv, const std::string& of) {
  start_program(argv);  // before Initialize takes its flags out of argv
  usage = of;
  wrong_ = take_wrong_flag(argc, argv);
  std::string in_memory;
  for (int i = 1; i < argc; ++i) {
    const std::string_view flag = argv[i];
    asks_for_help = asks_for_help || flag.starts_with("--help");
    if (!flag.starts_with(out_flag) || flag == out_flag) continue;
    out_ = flag.substr(out_flag.size());
    if (!memory_) memory_ = Descriptor(memfd_create("benchmark_out", MFD_CLOEXEC));
    in_memory = std::string(out_flag) + path_of(memory_);
    argv[i] = in_memory.data();
  }
  benchmark::Initialize(&argc, argv, print_help);
}

void Benchmarks::run(const char* timed_call) {
  if (!wrong_.empty()) throw InputError(wrong_);
  OutputFile out(out_);
  add_context(timed_call);
  std::size_t matched = 0;
  std::string unmatched;
  {
    const ErrorStream errors;
    matched = benchmark::RunSpecifiedBenchmarks();
    unmatched = errors.str();
  }
  benchmark::Shutdown();
  if (matched == 0) throw InputError(unmatched.empty() ? "nothing to time" : unmatched);
  std::ifstream file(path_of(memory_), std::ios::binary);
  if (const std::string text{std::istreambuf_iterator<char>(file), {}}; !text.empty())
    out.write(text);
}

}  // namespace kalmarm
