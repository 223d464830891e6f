#pragma once

namespace kalmarm {

// What a lowered model does of angles that are zero or right (zero_terms.hpp): kept is to compare.
enum class Zeros { left_out, kept };

}  // namespace kalmarm
