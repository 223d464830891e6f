#include "algorithms/study/registry.hpp"

namespace kalmarm {

template std::vector<RegisteredVariant<float>> registered_variants<float>(Want);

}  // namespace kalmarm
