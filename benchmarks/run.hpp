// Google Benchmark's part of a benchmark program.
#pragma once

#include <string>

#include "accuracy/programs/common/descriptor.hpp"

namespace kalmarm {

class Benchmarks {
 public:
  // Takes Google Benchmark's flags out of the arguments; first in main. `usage` is what --help says
  // before them.
  Benchmarks(int& argc, char** argv, const std::string& usage);

  // Times what is registered; within run_program. The file of --benchmark_out is as all others
  // (output_file.hpp). Throws InputError where a filter leaves nothing to time. `timed_call`: what
  // a timed call includes.
  void run(const char* timed_call);

 private:
  std::string out_, wrong_;
  Descriptor memory_;  // for the library to write to
};

}  // namespace kalmarm
