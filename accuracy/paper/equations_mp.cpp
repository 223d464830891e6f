#include "accuracy/paper/equations_impl.hpp"

namespace kalmarm {

template Soundness soundness<Real>(const Model<double>&, const State&);
template std::vector<Row> check_paper<Real>(const Model<double>&, const State&,
                                            const Model<double>&, const State&);

}  // namespace kalmarm
