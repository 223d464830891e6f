// The modules that bench_peers has contenders of.
#pragma once

#include <vector>

#include "benchmarks/peers/peer.hpp"

namespace kalmarm {

using Module = decltype(&kalmarm_peers);

// Ours, then those that were built beside it. Throws InputError where one cannot be loaded.
std::vector<Module> load_modules();

}  // namespace kalmarm
