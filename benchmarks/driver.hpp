// What the benchmark programs share: the command line, its scenes, and running what `add`
// registers.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "robots/scene/scene.hpp"

namespace CLI {
class App;
}

namespace kalmarm {

struct Driver {
  using Add = std::function<void(const std::vector<Scene>& scenes, std::uint64_t seed)>;

  std::string name, about;               // of the program
  const char* timed_call;                // what a timed call includes
  std::string flags = "";                // of its own, as the usage line shows them
  std::vector<std::string> scenes = {};  // taken where none is given; empty: one has to be

  // main(): add(scenes, seed) registers the benchmarks. `configure` may add flags to the command
  // line, which Google Benchmark's have been taken out of by then.
  int run(
      int argc, char** argv, const Add& add,
      const std::function<void(CLI::App&)>& configure = [](CLI::App&) {});
};

}  // namespace kalmarm
