#include "benchmarks/context.hpp"

#include <benchmark/benchmark.h>

#include <Eigen/Core>
#include <fstream>
#include <string>

#include "revision.hpp"
#include "robots/scene/mujoco_solver.hpp"

// Null where it is not linked.
extern "C" char* openblas_get_config() __attribute__((weak));
extern "C" int openblas_get_num_threads() __attribute__((weak));

namespace kalmarm {
namespace {

// First value of a key in a "key : value" file, such as /proc/cpuinfo.
std::string value_of(const std::string& path, const std::string& key) {
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (!line.starts_with(key)) continue;
    const std::size_t start = line.find_first_not_of(" \t\":=", line.find_first_of(":="));
    const std::size_t end = line.find_last_not_of(" \t\"");
    if (start != std::string::npos && start <= end) return line.substr(start, end - start + 1);
  }
  return "unknown";
}

}  // namespace

void add_context(const char* timed_call) {
  using benchmark::AddCustomContext;
  AddCustomContext("git_revision", KALMARM_REVISION);
  AddCustomContext("compiler", KALMARM_COMPILER);
  AddCustomContext("flags", KALMARM_FLAGS);
  AddCustomContext("cpu", value_of("/proc/cpuinfo", "model name"));
  AddCustomContext("operating_system", value_of("/etc/os-release", "PRETTY_NAME"));
  AddCustomContext("eigen", std::to_string(EIGEN_WORLD_VERSION) + "." +
                                std::to_string(EIGEN_MAJOR_VERSION) + "." +
                                std::to_string(EIGEN_MINOR_VERSION) + ", " +
                                Eigen::SimdInstructionSetsInUse());
  if (openblas_get_config && openblas_get_num_threads) {
    AddCustomContext("openblas", openblas_get_config());
    AddCustomContext("openblas_threads", std::to_string(openblas_get_num_threads()));
  }
  AddCustomContext("mujoco", mujoco_version());
  AddCustomContext("timed_call", timed_call);
}

}  // namespace kalmarm
