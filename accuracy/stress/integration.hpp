// Formulation stiffness: how many right-hand sides an adaptive integrator asks for.
//
//   x = (q; q'),  x' = f(x) = (q'; M^-1 (tau - bias)),  tau = 0,  x(0) = (q0; 0)              (1)
// Dormand and Prince's pair of orders 5 and 4 accepts a step h from x to x5 where
//   max_i |x5 - x4|_i / (tol (1 + |x|_i + h |x'|_i)) <= 1                                     (2)
// and chooses the next h by that number. Rounding errors of relative size e in q'' are no smooth
// function of x: they add about h e |q''| to |x5 - x4|, however short the step, so that h falls to
// about tol / (e |q''|) where the motion itself would allow more. The motion is the same for every
// variant; what the calls differ by is the price of the variant's errors.
//
// The energy of a motion without losses stays what it was:
//   K = 1/2 sum_k (m |v_c|^2 + w' I_cm w + r q'^2),  v_c = v_o + w x c                        (3)
//   V = - sum_k m gravity' (p + R c),  p(k) = p(parent) + R(parent) p_phi(k)                  (4)
//                                      R(k) = R(parent) R_phi(k)
//   drift = |K + V - K(0) - V(0)| / K  at the end                                             (5)
// (3) to (5) are evaluated in long double.
#pragma once

#include <string>
#include <vector>

#include "algorithms/study/solver.hpp"

namespace kalmarm::stress {

// From the most used to the most accurate.
inline const std::vector<std::string> usual_variants = {"Batch<EigenLLT>",
                                                        "Refined<Batch<EigenLLT>>",
                                                        "Sequential<Conventional>",
                                                        "Sequential<ArrayMGS>",
                                                        "FactoredBias<ArrayMGS>",
                                                        "FactoredBias<ArrayGivens>",
                                                        "WideRefined<FactoredBias<ArrayGivens>>"};

struct Energy {
  long double kinetic = 0, potential = 0;  // [J]; potential: 0 where every com is at the origin

  long double total() const { return kinetic + potential; }
};

Energy energy(const Model<long double>& model, const VectorX<long double>& q,
              const VectorX<long double>& qd);

struct Fall {
  double duration = 0.3;    // [s]
  double tolerance = 1e-9;  // relative and absolute
  int cap = 6000;           // calls of the right-hand side
};

struct Integration {
  int calls = 0;              // of the right-hand side, the last one included if it failed
  bool finished = false;      // false: the cap was reached, or the solver refused a state
  VectorX<double> q, qd;      // the state that it came to
  double energy_drift = 0.0;  // NaN where it did not finish
};

// From rest at q. Only the acceleration is in precision T; the integrator's state is in double. The
// solver is the model's, which has hinges and slides alone.
template <class T>
Integration free_fall(Solver<T>& solver, const Model<T>& model, const VectorX<double>& q,
                      const Fall& fall);

}  // namespace kalmarm::stress
