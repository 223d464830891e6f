// The registry's variants in multi-precision.
#include "accuracy/measures/real.hpp"
#include "algorithms/study/registry.hpp"

namespace kalmarm {

template std::vector<RegisteredVariant<Real>> registered_variants<Real>(Want);

}  // namespace kalmarm
