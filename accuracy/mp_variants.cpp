#include "accuracy/mp_variants.hpp"

namespace kalmarm {

template std::vector<RegisteredVariant<Real>> registered_variants<Real>();

}  // namespace kalmarm
