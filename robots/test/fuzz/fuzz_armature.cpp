// --armature: what is read are finite numbers by name.
#include <cmath>

#include "robots/file_options.hpp"
#include "robots/test/fuzz/reader.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kalmarm;
  return fuzz_reader(data, size, ".json", [](const std::string& path) {
    for (const auto& [joint, value] : read_armature(path))
      expect(std::isfinite(value), "not finite");
  });
}
