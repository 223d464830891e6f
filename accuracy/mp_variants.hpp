// The registry's variants in multi-precision, instantiated once (mp_variants.cpp).
#pragma once

#include "accuracy/real.hpp"
#include "algorithms/registry.hpp"

namespace kalmarm {

extern template std::vector<RegisteredVariant<Real>> registered_variants<Real>();

}  // namespace kalmarm
