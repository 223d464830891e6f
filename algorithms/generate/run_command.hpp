// Another program, run without a shell and within a time.
#pragma once

#include <string>
#include <vector>

namespace kalmarm {

struct CommandResult {
  std::string output;  // standard output and errors together
  double seconds = 0;  // of the processor
};

// command: a program, found on PATH, and its arguments; its input is empty. Throws std::runtime_error, in one line, where
// there is none, where it fails, with its first error, and where it takes longer than `limit` seconds, when it is ended
// together with all that it started.
CommandResult run_command(const std::vector<std::string>& command, double limit);

}  // namespace kalmarm
