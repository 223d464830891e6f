// Bad input: a file, a model or a flag. The message is one line that names it; programs print it
// and exit with 2.
#pragma once

#include <stdexcept>
#include <string>

namespace kalmarm {

class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace kalmarm
