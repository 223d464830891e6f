// Refusals of bad input.
#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "robots/loader/input_error.hpp"

namespace kalmarm {

inline std::string complaint(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& e) {
    return e.what();
  }
  return "";
}

// Expects a one-line refusal with every word in it.
inline void expect_refused(const std::function<void()>& action,
                           const std::vector<std::string>& words) {
  const std::string message = complaint(action);
  EXPECT_FALSE(message.empty()) << "was accepted";
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  for (const std::string& word : words) EXPECT_NE(message.find(word), std::string::npos) << message;
}

}  // namespace kalmarm
