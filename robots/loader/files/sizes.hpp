// Sizes for which MuJoCo's reader would take memory or time without end.
#pragma once

#include <vector>

#include "robots/loader/files/model_files.hpp"

namespace kalmarm {

// That reader makes what a file counts, and ends the program where memory does: throws InputError with
// the file and the element where an <hfield> has more than 1e8 numbers, a <flexcomp> or <composite> more
// than 1e6 points, or a <replicate>, with those that it stands in, makes more than 10 000 copies. Sizes
// that only a simulation needs are passed over (strip() of mujoco_strip.hpp).
void refuse_huge_sizes(const std::vector<ModelFile>& files);

}  // namespace kalmarm
