// The true answer to what is asked of a mechanism in a state, whose numbers are exact as T rounds
// them, and how much of it these decide.
//
// a, x = M^-1 tau, M^-1 and D are proven (truth.hpp). Derivatives of a follow from inverse dynamics,
// ID(q, qd, a) = tau, with twice the digits that the proof of a needs:
//   M da = -dID,   dID = ID(moved by h) - ID,   h = 10^-digits                             (1)
// along each velocity, for da/dq, and by each velocity, for da/dqd; da/dtau = M^-1. What (1) leaves
// out is of the size of h.
//
// kS is what u in every parameter and number of the state does to the answer, in units of u:
// that of structured_condition.hpp, and for M^-1, its diagonal and log det M the same with
//   dX = -X dM X,   d log det M = trace(X dM)                                              (2)
// in the measure of measure.hpp. Of derivatives it is that of a.
#pragma once

#include <limits>

#include "accuracy/adversary/genome.hpp"
#include "accuracy/adversary/measure.hpp"

namespace kalmarm::adversary {

struct Exact {
  Answer<long double> answer;  // empty: singular, or not known within the digits
  double kS = std::numeric_limits<double>::quiet_NaN();
};

// T: float or double. with_kS: else it stays empty, which takes half the time.
template <class T>
Exact exact_answer(Want task, const Mechanism& mechanism, bool with_kS);

}  // namespace kalmarm::adversary
