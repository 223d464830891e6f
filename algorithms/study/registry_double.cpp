#include "algorithms/study/registry.hpp"

namespace kalmarm {

template std::vector<RegisteredVariant<double>> registered_variants<double>(Want);

}  // namespace kalmarm
