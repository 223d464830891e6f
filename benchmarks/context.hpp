// What surrounds a measurement: the kernels that OpenBLAS picks, and what a benchmark file says of
// the binary and the machine that made it.
#pragma once

namespace kalmarm {

// OpenBLAS 0.3.21 does not know processors from 2022 on and falls back to its SSE3 kernels
// ("Prescott"), 1.8 times slower at n = 500. Where it did so on a machine with AVX2, and the user
// has not chosen, starts this program again with OPENBLAS_CORETYPE=Haswell; the library reads it
// only when it is loaded. The context says which kernels ran. Call it first in main.
void choose_openblas_kernels(char** argv);

// Adds revision, compiler, flags, library versions and `timed_call` (what a timed call includes) to
// the context of the Google Benchmark JSON. After benchmark::Initialize.
void add_context(const char* timed_call);

}  // namespace kalmarm
