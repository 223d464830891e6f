// Bad input: a file, a model or a flag. The message is one line that names it; programs print it
// and exit with 2.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

namespace kalmarm {

// Without line ends, which names in a file may have.
inline std::string one_line(std::string text) {
  for (char& c : text)
    if (c == '\n' || c == '\r') c = ' ';
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

class InputError : public std::runtime_error {
 public:
  explicit InputError(std::string message) : std::runtime_error(one_line(std::move(message))) {}
};

}  // namespace kalmarm
