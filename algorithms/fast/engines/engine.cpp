#include "algorithms/fast/engine/engine.hpp"

#include <cstdlib>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "algorithms/fast/engines/engines.hpp"

namespace kalmarm {
namespace {

struct InstructionSet {
  const char* name;
  const Engines* engines;
  bool available;
};

// The best that the processor has and KALMARM_INSTRUCTION_SET does not rule out.
InstructionSet best() {
  const InstructionSet sets[] = {
#ifdef KALMARM_DISPATCH
      {"x86-64-v4", &kalmarm_engines_v4,
       __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
           __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
           __builtin_cpu_supports("avx512vl")},
      {"x86-64-v3", &kalmarm_engines_v3,
       __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
           __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2")},
#ifdef KALMARM_X86_64_V2
      {"x86-64-v2", &kalmarm_engines_v2, true},
#endif
#else
      {"native", &kalmarm_engines_native, true},
#endif
  };
  const char* const highest = std::getenv("KALMARM_INSTRUCTION_SET");
  bool reached = !highest;
  for (const InstructionSet& one : sets) {
    reached = reached || std::strcmp(one.name, highest) == 0;
    if (reached && one.available) return one;
  }
  if (!reached)
    throw std::runtime_error(std::string("kalmarm: KALMARM_INSTRUCTION_SET is '") + highest +
                             "', of which this library has no kernels");
  throw std::runtime_error(
      "kalmarm: this processor has no AVX2; the library has to be built with KALMARM_X86_64_V2=ON");
}

// Chosen once.
const InstructionSet& chosen() {
  static const InstructionSet set = best();
  return set;
}

}  // namespace

template <>
std::unique_ptr<Engine<float>> make_engine(const RobotModel& robot, const EngineOptions& options) {
  return chosen().engines->make_float(robot, options);
}
template <>
std::unique_ptr<Engine<double>> make_engine(const RobotModel& robot, const EngineOptions& options) {
  return chosen().engines->make_double(robot, options);
}

template <>
std::unique_ptr<KinematicsEngine<float>> make_kinematics(const RobotModel& robot,
                                                         const std::vector<Frame>& frames,
                                                         const std::vector<int>& bodies) {
  return chosen().engines->kinematics_float(robot, frames, bodies);
}
template <>
std::unique_ptr<KinematicsEngine<double>> make_kinematics(const RobotModel& robot,
                                                          const std::vector<Frame>& frames,
                                                          const std::vector<int>& bodies) {
  return chosen().engines->kinematics_double(robot, frames, bodies);
}

template <>
std::unique_ptr<GradientEngine<float>> make_gradients(const RobotModel& robot,
                                                      const CallFrames& frames) {
  return chosen().engines->gradients_float(robot, frames);
}
template <>
std::unique_ptr<GradientEngine<double>> make_gradients(const RobotModel& robot,
                                                       const CallFrames& frames) {
  return chosen().engines->gradients_double(robot, frames);
}

std::unique_ptr<CheckEngine> make_check(const RobotModel& robot,
                                        const AnswerCheckOptions& options) {
  return chosen().engines->check(robot, options);
}

const char* instruction_set() { return chosen().name; }

const char* to_string(Kernel kernel) {
  switch (kernel) {
    case Kernel::spatial:
      return "spatial";
    case Kernel::spatial_at_rest:
      return "spatial_at_rest";
    case Kernel::translational:
      return "translational";
  }
  return "?";
}

}  // namespace kalmarm
