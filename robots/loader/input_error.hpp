// Bad input: a file, a model or a flag. The message is one line that names it; programs print it
// and exit with 2.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <utility>

namespace kalmarm {

// Without line ends and other control characters, which names in a file may have: a zero would end
// the message, others would command the terminal. Of a very long text the middle is left out.
inline std::string one_line(std::string text) {
  constexpr std::size_t longest = 4000, half = 1950;
  constexpr unsigned char delete_control = 0x7f;
  for (char& c : text)
    if (const auto code = static_cast<unsigned char>(c); code < ' ' || code == delete_control)
      c = ' ';
  while (!text.empty() && text.back() == ' ') text.pop_back();
  if (text.size() > longest)
    text = text.substr(0, half) + " ... " + text.substr(text.size() - half);
  return text;
}

class InputError : public std::runtime_error {
 public:
  explicit InputError(std::string message) : std::runtime_error(one_line(std::move(message))) {}
};

}  // namespace kalmarm
