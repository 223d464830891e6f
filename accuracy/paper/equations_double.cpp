#include "accuracy/paper/equations_impl.hpp"

namespace kalmarm {

template Soundness soundness<double>(const Model<double>&, const State&);
template std::vector<Row> check_paper<double>(const Model<double>&, const State&,
                                              const Model<double>&, const State&);

}  // namespace kalmarm
