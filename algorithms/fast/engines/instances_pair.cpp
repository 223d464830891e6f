// Residuals in pairs, in a file of their own: products and sums of pairs must not be contracted
// (spatial/pair.hpp).
#include "algorithms/fast/certified/residual.hpp"
#include "algorithms/fast/engine/instances.hpp"

namespace kalmarm {

KALMARM_LOWERING_INSTANCES(, Pair<double>)
template class TwiceResidual<double>;
template class TwiceResidual<StateLanes<double>>;

}  // namespace kalmarm
