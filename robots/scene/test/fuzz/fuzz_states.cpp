// --states: what is read are finite numbers of the robot's sizes, and quaternions of unit length.
#include <cmath>

#include "robots/loader/test/fuzz/reader.hpp"
#include "robots/scene/scene.hpp"
#include "robots/scene/state_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kalmarm;
  static const Scene scene = load_scene(TemporaryFile(small_robot, ".xml").path());
  return fuzz_reader(data, size, ".json", [](const std::string& path) {
    const StateFile read = read_states(scene, path);
    expect(!read.states.empty(), "no states");
    for (const State& state : read.states) {
      expect(state.q.size() == 5 && state.qd.size() == 4 && state.tau.size() == 4, "other sizes");
      expect(state.q.allFinite() && state.qd.allFinite() && state.tau.allFinite(), "not finite");
      expect(std::abs(state.q.head<4>().norm() - 1) < 1e-8, "a quaternion of another length");
    }
  });
}
