#include "accuracy/programs/common/provenance.hpp"

#include <Eigen/Core>
#include <fstream>
#include <iterator>

#include "accuracy/programs/common/digest.hpp"
#include "robots/loader/input_error.hpp"

// Null where it is not linked.
extern "C" char* openblas_get_config() __attribute__((weak));
extern "C" char* openblas_get_corename() __attribute__((weak));

namespace kalmarm {

Provenance provenance() {
  std::ifstream file("/proc/self/exe", std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(file), {});
  if (bytes.empty()) throw InputError("/proc/self/exe: cannot be read");
  std::string blas = "none";
  if (openblas_get_config && openblas_get_corename)
    blas = std::string(openblas_get_config()) + ", " + openblas_get_corename();
  return {hex(digest_of(bytes)), KALMARM_COMPILER, KALMARM_FLAGS, Eigen::SimdInstructionSetsInUse(),
          blas};
}

}  // namespace kalmarm
