// What a call says of what it refuses.
#pragma once

#include <stdexcept>
#include <string>

namespace kalmarm::test {

template <class F>
std::string message_of(const F& f) {
  try {
    f();
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
  return "nothing was thrown";
}

}  // namespace kalmarm::test
