// What a benchmark file says of the binary and the machine that made it.
#pragma once

namespace kalmarm {

// Adds revision, compiler, flags, library versions and `timed_call` (what a timed call includes) to
// the context of the Google Benchmark JSON. After benchmark::Initialize.
void add_context(const char* timed_call);

}  // namespace kalmarm
