// What any text does to a reader of ours, under clang's libFuzzer and sanitizers: it is refused with
// one line, or what was read keeps its promises. Anything else is a finding: scripts/fuzz.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "robots/loader/input_error.hpp"
#include "robots/loader/test/temporary_file.hpp"

namespace kalmarm {

[[noreturn]] inline void found(const std::string& what) {
  std::fprintf(stderr, "FOUND: %s\n", what.c_str());
  std::abort();
}

inline void expect_one_line(const std::string& message) {
  if (message.empty() || message.find('\n') != std::string::npos)
    found("a refusal that is not one line: '" + message + "'");
}

inline void expect(bool holds, const char* what) {
  if (!holds) found(what);
}

// read(path) reads the text as a file, and expects what it likes of the result.
template <class Read>
int fuzz_reader(const std::uint8_t* data, std::size_t size, const char* ending, const Read& read) {
  const TemporaryFile file(std::string(reinterpret_cast<const char*>(data), size), ending);
  try {
    read(file.path());
  } catch (const InputError& e) {
    expect_one_line(e.what());
  }
  return 0;
}

// A ball joint and a slide on it: quaternions and numbers, and few of both.
inline const char* const small_robot = R"(<mujoco><worldbody><body><joint name="ball" type="ball"/>
  <inertial pos="0 0 .1" mass="1" diaginertia=".1 .1 .1"/><body><joint name="rail" type="slide"/>
  <inertial pos="0 0 .1" mass="1" diaginertia=".1 .1 .1"/></body></body></worldbody></mujoco>)";

}  // namespace kalmarm
