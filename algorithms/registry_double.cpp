#include "algorithms/registry.hpp"

namespace kalmarm {

template std::vector<RegisteredVariant<double>> registered_variants<double>(Want);

}  // namespace kalmarm
