// What the results of a program depend on beside its options: results of two are comparable, to the
// last bit, where all of it is the same.
#pragma once

#include <string>

namespace kalmarm {

struct Provenance {
  std::string program;          // SHA-1 of the executable file
  std::string compiler, flags;  // with which it was compiled
  std::string isa;              // instruction sets that the compiler was allowed
  std::string blas;  // version and kernels of OpenBLAS, which it chooses by the processor
};

// Throws InputError where the executable cannot be read.
Provenance provenance();

}  // namespace kalmarm
