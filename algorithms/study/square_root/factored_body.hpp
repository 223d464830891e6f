// A link's body as weighted rows for the square-root form (square_root.hpp), in its frame, from its
// parameters: mass m, centre of mass c, principal moments J along axes E, I = E diag(J) E'.
//
//   linear      (0, cz, -cy; 1,0,0), (-cz, 0, cx; 0,1,0), (cy, -cx, 0; 0,0,1)    weight m each
//               zeta = W c = w (w'c) - c w'w
//   rotational  L w' + zeta,  L' diag(Dz, Dx, Dy) L = I,  L the unit triangle ordered z, x, y
//               (z:1, x:Lzx, y:Lzy), (x:1, y:Lxy), (y:1)
//               zeta = L I^-1 (w x I w) = Z (wx^2 - wz^2, wy^2 - wz^2, wx wy, wx wz, wy wz)
// The triangle is made from the rows E' and weights J by fast Givens steps, and Z with it, from the
// rows' own bias ((J3 - J2) / J1) w2 w3 in principal axes. No term of I is formed, so that rods,
// points and bodies far from the origin keep their digits; the ratios are bounded by 1.
#pragma once

#include <algorithm>
#include <utility>

#include "algorithms/spatial/inertia.hpp"

namespace kalmarm {

// Weights are floored at this, so that no pivot is 0 / 0. Far below what a mass can be, and its
// inverse is finite.
template <class S>
S least_weight() {
  using std::ldexp;
  return std::is_same_v<S, float> ? S(0x1p-100F) : S(ldexp(S(1), -900));
}

template <class S>
struct FactoredBody {
  static constexpr int monomials = 5;

  S m = least_weight<S>();
  Vector3<S> c = Vector3<S>::Zero();
  S Dz = m, Dx = m, Dy = m;
  S Lzx = S(0), Lzy = S(0), Lxy = S(0);
  Eigen::Matrix<S, 3, monomials> Z = Eigen::Matrix<S, 3, monomials>::Zero();  // rows z, x, y

  // How large D(k) would be without cancellation: outboard mass x reach^2 + outboard spin.
  S distance = S(0);                             // |c|
  S length = S(0);                               // from the parent's origin; of a slide without d
  S outboard_mass = S(0), outboard_spin = S(0);  // sum of m, of (J1 + J2 + J3) / 2
  bool light_parent = false;                     // the parent is light beside it

  // Whether a weight is less than 2^-20 of what a child has there.
  bool is_light_beside(const FactoredBody& child) const {
    const S reach = child.length + child.distance;
    const S spin = child.outboard_mass * reach * reach + child.outboard_spin;
    const S least = std::min(Dz, std::min(Dx, Dy));
    return S(0x1p20) * m < child.outboard_mass || S(0x1p20) * least < spin;
  }
};

// E and c in the link's frame.
template <class S, class W>
void factor_body(const W& mass, const Vector3<W>& c, const Matrix3<W>& E, const Vector3<W>& J,
                 FactoredBody<S>& out) {
  using std::abs;
  using std::sqrt;
  constexpr int column[] = {2, 0, 1};
  constexpr int monomials = FactoredBody<S>::monomials;
  Eigen::Matrix<W, 3, 3 + monomials> A;
  Vector3<W> weight = J;
  const W resolution = W(16) * unit_roundoff<W>();
  for (int i = 0; i < 3; ++i) {
    for (int a = 0; a < 3; ++a)
      A(i, a) = abs(E(column[a], i)) > resolution ? E(column[a], i) : W(0);
    const Vector3<W> e = E.col((i + 1) % 3), f = E.col((i + 2) % 3);  // (e'w) (f'w)
    const W difference = J[(i + 2) % 3] - J[(i + 1) % 3];
    const W ratio = J[i] > W(0) ? W(difference / J[i]) : W(0);  // J(i) = 0: so is the difference
    A.row(i).template tail<monomials>() << ratio * e[0] * f[0], ratio * e[1] * f[1],
        ratio * (e[0] * f[1] + e[1] * f[0]), ratio * (e[0] * f[2] + e[2] * f[0]),
        ratio * (e[1] * f[2] + e[2] * f[1]);
  }
  for (int j = 0; j < 3; ++j) {
    int best = j, lightest = j;
    const auto size = [&](int i) { return W(weight[i] * A(i, j) * A(i, j)); };
    for (int i = j + 1; i < 3; ++i) {
      if (size(i) > size(best)) best = i;
      if (weight[i] < weight[lightest]) lightest = i;
    }
    const bool empty = !(size(best) > W(0));
    if (empty) best = lightest;  // its weight is zero: a rank of 3 would fill the column
    A.row(j).swap(A.row(best));
    std::swap(weight[j], weight[best]);
    if (empty) {
      A.row(j).setZero();
      A(j, j) = W(1);
      weight[j] = W(0);
      continue;
    }
    const W pivot = A(j, j);
    A.row(j) /= pivot;
    weight[j] *= pivot * pivot;
    for (int i = j + 1; i < 3; ++i) {
      const W x = A(i, j), D = weight[j] + weight[i] * x * x;
      const Eigen::Matrix<W, 1, 3 + monomials> p = A.row(j), r = A.row(i);
      A.row(i) = r - x * p;
      A.row(j) = W(weight[j] / D) * p + W(weight[i] * x / D) * r;
      A(j, j) = W(1);
      A(i, j) = W(0);
      weight[i] *= weight[j] / D;
      weight[j] = D;
    }
  }
  const auto floored = [](const W& w) {
    const S rounded = S(w);
    return rounded > least_weight<S>() ? rounded : least_weight<S>();
  };
  out.m = floored(mass);
  out.c = c.template cast<S>();
  out.Dz = floored(weight[0]);
  out.Dx = floored(weight[1]);
  out.Dy = floored(weight[2]);
  out.Lzx = S(A(0, 1));
  out.Lzy = S(A(0, 2));
  out.Lxy = S(A(1, 2));
  out.Z = A.template rightCols<monomials>().template cast<S>();
  out.distance = S(sqrt(c.squaredNorm()));
  out.outboard_mass = S(mass);
  out.outboard_spin = S(J.sum() / W(2));
}

}  // namespace kalmarm
