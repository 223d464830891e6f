// --armature: what is read are finite numbers by name.
#include <cmath>

#include "robots/loader/test/fuzz/reader.hpp"
#include "robots/scene/file_options.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace kalmarm;
  return fuzz_reader(data, size, ".json", [](const std::string& path) {
    for (const auto& [joint, value] : read_numbers(path))
      expect(std::isfinite(value), "not finite");
  });
}
