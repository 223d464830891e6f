// The registry's variants in the tests' multi-precision.
#include "algorithms/study/registry.hpp"
#include "algorithms/test/dense_mechanics.hpp"

namespace kalmarm {

template std::vector<RegisteredVariant<test::Mp>> registered_variants<test::Mp>(Want);

}  // namespace kalmarm
