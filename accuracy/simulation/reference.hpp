// The exact covariances of section 5, from dense operators in multi-precision: neither the Riccati
// recursion nor the filter, the smoother or the simulation takes part.
//
//   M        of world_mechanics.hpp; H R H* + diag(r) must agree with it
//   R        = phi Q phi*, block (i,j): the sum over links k of phi(i,k) M(k) phi'(j,k)      (2.2)
//   M        = U D U*,  U unit triangular as I + K,  so e- = U^-1 T and cov e- = D          (3.1)
//   Z        = G e-,  G(k,j) = E x(k) e(j) / D(j)  for j outboard of k, 0 elsewhere:
//              the conditional mean of x(k) given what was measured outboard of it
//   P        = cov (X - Z) = R - E G* - G E* + G D G*,  E = E X e-* = R H* U^-*
//   l+       = Phi* H* a,  Phi = phi - I,  a = M^-1 T                                       (2.9)
//   Lambda   = cov l+ = Phi* H* M^-1 H Phi
#pragma once

#include "accuracy/measures/real.hpp"
#include "algorithms/study/estimation/simulation.hpp"

namespace kalmarm {

struct Reference {
  MatrixX<Real> M, P, D, Lambda;

  const MatrixX<Real>& operator[](Quantity quantity) const;
};

// At the precision in force, in which the model must have been cast; 60 digits leave 40 where the
// condition of M is below 1e20. M must be regular. Throws std::runtime_error if the two M differ by
// more than 1e-30 of their size.
Reference reference(const Model<Real>& model, const VectorX<Real>& q);

// A matrix to 32 digits as the sum of two, so that errors far below 1e-16 are seen in double.
struct Exact {
  MatrixX<double> high, low;

  explicit Exact(const MatrixX<Real>& A);
};

// |C - exact| / |exact|, Frobenius; 0 where there is no difference, also from nothing.
double relative_error(const MatrixX<double>& C, const Exact& exact);

}  // namespace kalmarm
