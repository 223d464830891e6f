// What stands before the functions of generated code: numbers of one state or of one in every lane, and what
// straight-line code asks of them (print_c.hpp).
#pragma once

#include <string>

namespace kalmarm {

// Whether a sine or cosine, or a square root, is asked for: compilers warn of functions that are not.
struct FunctionsUsed {
  bool sines = false, roots = false;
};

// S: float or double.
template <class S>
std::string preamble_of_one_state(const FunctionsUsed& used);
template <class S>
std::string preamble_of_rows(const FunctionsUsed& used);

}  // namespace kalmarm
