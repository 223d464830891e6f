// Which code answers: the library's loops over links, or code for one robot (docs/generated.md), which is generated,
// compiled and loaded when a Dynamics is made. Results and outcomes mean the same.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "kalmarm/question.hpp"

namespace kalmarm {

enum class Kernels { loops, generated };

// How generated code comes about. What cannot be had the loops answer: Dynamics::notes() says why.
struct CodeOptions {
  // Of acceleration, inverse_dynamics, mass, inverse, diagonal, solve and derivatives; empty: those that the question wants.
  std::set<Want> tasks = {};
  bool rows = true;  // also for rows of states, which is half of what is compiled
  // A program and its first arguments, such as {"python3", "-m", "ziglang", "cc"}; empty: $CC, else cc, clang or gcc.
  std::vector<std::string> compiler = {};
  // What is compiled stays there, and is taken again by the next process: a folder that this user alone may read and
  // write. Empty: `code` in $KALMARM_CACHE, or in kalmarm in $XDG_CACHE_HOME or ~/.cache.
  std::string folder = {};
  double limit = 120;  // seconds that the compiler may take for a file
};

}  // namespace kalmarm
