// True accelerations for campaigns of millions of mechanisms: as truth.hpp has them, but proven no
// further than answers are judged, which takes a sixth of the time.
//
// The filter of link frames runs in long double. Its answers are refined by the residual of the
// enclosure, of which the centre has 38 digits,
//   r = tau - ID(a),   a <- a + M^^-1 r                                                    (1)
// until the enclosure (enclosure.hpp, 1 to 3) proves in its balls, of a in both norms and of M,
//   width of a <= 2^-64,   width of M <= 1e-25                                             (2)
// No digit of the filter enters the proof: it takes a and theta however they came about.
//
// Why 2^-64: an error is judged in long double (measures.hpp), to which the truth is rounded with
// an error as large. An error e is so known to 2^-63 / e of itself: to 1 per cent, half a bin of
// stress/error_bins.hpp, where e is above a tenth of the roundoff of float64. Below that an answer
// is right to its last bit, and its bin is one of several. M needs more, since the energy of an
// error, da'M da, may be far below its terms.
//
// Where (2) is not reached, or the filter sees a singular mechanism, truth.hpp answers, with its
// digits and its widths: for one wild mechanism in a thousand.
//
// kS is that of structured_condition.hpp with 9 digits: for its decade.
#pragma once

#include <vector>

#include "accuracy/truth/truth.hpp"

namespace kalmarm {

// a and tau of every task, and M where matrices are asked for. X, D and g are there only where
// truth.hpp had to answer. Throws as truth() does.
template <class T>
Truth<T> acceleration_truth(const Model<T>& model, const VectorX<T>& q,
                            const std::vector<Task<T>>& tasks, const TruthOptions& options = {});

}  // namespace kalmarm
