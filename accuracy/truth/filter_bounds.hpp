// The filter of a mechanism, bounded from below and from above in the Loewner order (A <= B: B - A
// is positive semidefinite). For exact parameters and a state,
//   P(k) = M(k) + sum over children c of phi(c) P+(c) phi'(c)                              (1)
//   D(k) = H P(k) H' + r(k),   P+(k) = P(k) - P(k) H' H P(k) / D(k)                        (2)
// Where D > 0 the update is a minimum over one number,
//   x'P+x = min over t of (x + H't)'P (x + H't) + r t^2                                    (3)
// so that a larger P has a larger P+, D and, by (1), P of the parent. A bound need not be positive
// semidefinite for that.
//
// A bound P_ is a matrix of numbers, not of balls. (1), worked out in balls from those of the
// children, is a matrix of balls, centres C and radii E. For every symmetric error |e| <= E,
//   -diag(E 1) <= e <= diag(E 1)                                                           (4)
// so that C -+ diag(E 1) is the bound of the next link, again of numbers alone: what is lost in a
// link is added to the next, and not multiplied along the chain, as the radii of balls are that are
// rotated from link to link. O(nv).
//
// With less noise in the joints, r - theta, the filter from below proves, if every D_ > 0,
//   M >= diag(theta)                                                                       (5)
// since M - diag(theta) is then at least (I + K_) D_ (I + K_*) of that filter.
//
// With both bounds and W = P_above - P_below, 0 <= P - P_below <= W:
//   |P - P_below|(c,h) <= sqrt(W(c,c) W(h,h))                                              (6)
// bounds P H', and with D_below <= D <= D_above the gain g = P H' / D.
#pragma once

#include <optional>

#include "accuracy/truth/ball.hpp"
#include "algorithms/model/link_kinematics.hpp"

namespace kalmarm {

// Balls that hold D (nv) and g (6 x nv).
struct FactorBalls {
  VectorX<Ball> D;
  MatrixX<Ball> g;
};

// (6). Nothing where a bound of D from below is not positive.
std::optional<FactorBalls> factor_balls(const Model<Ball>& model, const LinkKinematics<Ball>& kin);

// Whether the filter proves (5). theta: nv numbers.
bool exceeds(const Model<Ball>& model, const LinkKinematics<Ball>& kin, const VectorX<Ball>& theta);

}  // namespace kalmarm
