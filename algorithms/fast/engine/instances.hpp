// The kernels of the fast path that are compiled once: for one state in double, for one in every lane
// in float and double; each in its own file (instances_*.cpp), so that what calls a kernel does
// not change the code that a compiler makes of it. Other scalars (multi-precision, counting) are
// instantiated where they are used.
#pragma once

#include "algorithms/fast/covariance/at_rest.hpp"
#include "algorithms/fast/covariance/forward_dynamics.hpp"
#include "algorithms/fast/covariance/rounding_bound.hpp"
#include "algorithms/fast/derivatives/derivatives.hpp"
#include "algorithms/fast/derivatives/derivatives_of_rows.hpp"
#include "algorithms/fast/factors/diagonal.hpp"
#include "algorithms/fast/factors/inverse.hpp"
#include "algorithms/fast/factors/inverse_of_rows.hpp"
#include "algorithms/fast/factors/lambda.hpp"
#include "algorithms/fast/factors/selected.hpp"
#include "algorithms/fast/factors/solve.hpp"
#include "algorithms/fast/rigid/inverse_dynamics.hpp"
#include "algorithms/fast/rigid/mass.hpp"
#include "algorithms/fast/rigid/mass_of_rows.hpp"

namespace kalmarm {

// A state in every lane.
template <class S>
using StateLanes = Pack<S, padding<S>>;

#define KALMARM_LOWERING_INSTANCES(KIND, S) \
  KIND template class LoweredModel<S>;      \
  KIND template LoweredModel<S>::LoweredModel(const Model<S>&, Zeros, double, const CallFrames&);

// Of numbers T: one state, or one in every lane.
#define KALMARM_FORWARD_INSTANCES(KIND, S, T)                                                      \
  KIND template void covariance_acceleration(const LoweredModel<S>&, const T*, const T*, const T*, \
                                             CovarianceWorkspace<T>&, T*, const Acting<T>&);       \
  KIND template void resting_acceleration(const LoweredModel<S>&, const T*, const T*,              \
                                          CovarianceWorkspace<T>&, T*, const Acting<T>&);

#define KALMARM_RIGID_INSTANCES(KIND, S, T)                                                      \
  KIND template void fast_inverse_dynamics(const LoweredModel<S>&, const T*, const T*, const T*, \
                                           InverseDynamicsWorkspace<T>&, T*, const Acting<T>&);

// Of one state.
#define KALMARM_FACTOR_INSTANCES(KIND, S)                                                 \
  KIND template void covariance_factor(const LoweredModel<S>&, const S*, FastFactors<S>&, \
                                       const Acting<S>&);                                 \
  KIND template void fast_lambda(const LoweredModel<S>&, const FastFactors<S>&,           \
                                 LambdaWorkspace<S>&);                                    \
  KIND template class InverseColumns<S>;                                                  \
  KIND template class InverseDiagonal<S>;                                                 \
  KIND template class FactorSolver<S>;                                                    \
  KIND template SolveSums<WidePack<S>> FactorSolver<S>::solve(                            \
      const LoweredModel<S>&, const FastFactors<S>&, int, int, const S*, S*);             \
  KIND template SolveSums<WidePack<S>> FactorSolver<S>::solve(                            \
      const LoweredModel<S>&, const CovarianceWorkspace<S>&, int, int, const S*, S*);     \
  KIND template class SelectedColumns<S>;                                                 \
  KIND template class RoundingBound<S>;

#define KALMARM_MASS_INSTANCES(KIND, S) KIND template class FastMass<S>;

#define KALMARM_DERIVATIVE_INSTANCES(KIND, S)                                               \
  KIND template struct DerivativeWorkspace<S>;                                              \
  KIND template DerivativeWorkspace<S>::DerivativeWorkspace(const LoweredModel<S>&);        \
  KIND template void fast_derivatives(const LoweredModel<S>&, const S*, const S*, const S*, \
                                      DerivativeWorkspace<S>&, S*, S*, S*, S*, const Acting<S>&);

// Of one state in every lane of P: accelerations with joint noise of every lane; M, M^-1, parts of it
// and solves; derivatives.
#define KALMARM_NOISY_INSTANCES(KIND, S, P)                                                        \
  KIND template void covariance_acceleration(const LoweredModel<S>&, const P*, const P*, const P*, \
                                             const P*, CovarianceWorkspace<P>&, P*,                \
                                             const Acting<P>&);

#define KALMARM_ROW_INSTANCES(KIND, S, P)                                                       \
  KIND template void covariance_factor(const LoweredModel<S>&, const P*, FastFactors<P>&,       \
                                       const Acting<P>&);                                       \
  KIND template class InverseOfRows<P>;                                                         \
  KIND template class RowSolver<P>;                                                             \
  KIND template SolveSums<P> RowSolver<P>::solve(const LoweredModel<S>&, const FastFactors<P>&, \
                                                 const std::vector<P>&);                        \
  KIND template SolveSums<P> RowSolver<P>::solve(                                               \
      const LoweredModel<S>&, const CovarianceWorkspace<P>&, const std::vector<P>&);            \
  KIND template SolveSums<P> RowSolver<P>::solve(const LoweredModel<S>&,                        \
                                                 const CovarianceWorkspace<P>&, const S*);      \
  KIND template void fast_lambda(const LoweredModel<S>&, const FastFactors<P>&,                 \
                                 LambdaWorkspace<P>&);                                          \
  KIND template class InverseDiagonal<P>;                                                       \
  KIND template class SelectedColumns<P>;                                                       \
  KIND template class MassOfRows<P>;

#define KALMARM_DERIVATIVE_ROW_INSTANCES(KIND, P) KIND template class DerivativesOfRows<P>;

#define KALMARM_LANE_INSTANCES(KIND, S, P) \
  KALMARM_LOWERING_INSTANCES(KIND, S)      \
  KALMARM_FORWARD_INSTANCES(KIND, S, P)    \
  KALMARM_NOISY_INSTANCES(KIND, S, P)      \
  KALMARM_RIGID_INSTANCES(KIND, S, P)      \
  KALMARM_ROW_INSTANCES(KIND, S, P)        \
  KALMARM_DERIVATIVE_ROW_INSTANCES(KIND, P)

KALMARM_LANE_INSTANCES(extern, float, StateLanes<float>)
KALMARM_LANE_INSTANCES(extern, double, StateLanes<double>)
KALMARM_FORWARD_INSTANCES(extern, double, double)
KALMARM_RIGID_INSTANCES(extern, double, double)
KALMARM_FACTOR_INSTANCES(extern, double)
KALMARM_MASS_INSTANCES(extern, double)
KALMARM_DERIVATIVE_INSTANCES(extern, double)

}  // namespace kalmarm
