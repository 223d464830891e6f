// Where a link's frame is put, by modified Denavit-Hartenberg, in the precision W of the lowering.
//
//   phi(parent,k) = T(p) Rz(theta) Rx(alpha) Rz(angle) Tz(d)       T: translation, R: rotation
//   frame of link k = that of Model times Rz(gamma) T(0,0,shift)
// gamma and shift of the parent are free. They are chosen for one child, the aligned one, so that
// its
//   theta = 0,  p = (a, 0, 0)
// and the parent's origin is the foot of the common perpendicular of both axes. Where the axes are
// so near to parallel that the foot is farther away than twice the distance of the origins, the
// origin stays where it is: p = (a, b, 0).
#pragma once

#include <cmath>

#include "algorithms/spatial/spatial.hpp"

namespace kalmarm {

// A turn about a coordinate axis: cos and sin, which vectors need.
template <class T>
struct Direction {
  T c, s;
};

namespace detail {

template <class W>
Matrix3<W> about_z(const Direction<W>& by) {
  Matrix3<W> R;
  R << by.c, -by.s, W(0), by.s, by.c, W(0), W(0), W(0), W(1);
  return R;
}

// R without entries that are rounding errors of zeros: their products would be subnormal numbers.
template <class W>
Matrix3<W> without_rounding(const Matrix3<W>& R) {
  using std::abs;
  const W resolution = W(16) * unit_roundoff<W>();
  return R.unaryExpr([&](const W& x) { return abs(x) > resolution ? x : W(0); });
}

// Of (x, y); (1, 0) where that is zero.
template <class W>
Direction<W> direction_of(const W& x, const W& y) {
  using std::sqrt;
  const W length = sqrt(x * x + y * y);
  if (length == W(0)) return {W(1), W(0)};
  return {x / length, y / length};
}

template <class W>
Direction<W> sum(const Direction<W>& a, const Direction<W>& b) {
  return {a.c * b.c - a.s * b.s, a.s * b.c + a.c * b.s};
}

template <class W>
int nearest_quarters(const Direction<W>& angle) {
  using std::abs;
  if (abs(angle.c) >= abs(angle.s)) return angle.c < W(0) ? 2 : 0;
  return angle.s < W(0) ? 3 : 1;
}

// Where link k's frame goes from that of Model: Rz(gamma) T(0,0,shift); and its placement there.
template <class W>
struct LinkFrame {
  Direction<W> gamma{W(1), W(0)}, theta = gamma, alpha = gamma, angle = gamma;
  W shift = W(0), d = W(0);
  Vector3<W> p = Vector3<W>::Zero();
  Matrix3<W> E = Matrix3<W>::Identity();

  // phi(parent,k) at q = ref, in the parent's new frame.
  void place(const Matrix3<W>& rotation, const Vector3<W>& translation) {
    using std::sqrt;
    E = without_rounding(rotation);
    p = translation;
    alpha = {E(2, 2), sqrt(E(0, 2) * E(0, 2) + E(1, 2) * E(1, 2))};
    theta = direction_of(W(-E(1, 2)), E(0, 2));
    const Matrix3<W> rest = about_z(theta).transpose() * E;  // Rx(alpha) Rz(angle)
    angle = direction_of(rest(0, 0), W(-rest(0, 1)));
  }
};

// Link k is its parent's aligned child: the parent's frame is turned and moved so that theta = 0
// and p has no z, and no y where the foot of the common perpendicular is near.
template <class W>
void align(LinkFrame<W>& parent, LinkFrame<W>& frame, const Matrix3<W>& E, const Vector3<W>& d) {
  using std::abs;
  using std::sqrt;
  frame.place(E, d);
  const W sin_alpha = frame.alpha.s, cos_alpha = frame.alpha.c;
  const bool parallel = sin_alpha == W(0);
  parent.gamma = parallel ? direction_of(d[0], d[1]) : frame.theta;
  const Matrix3<W> back = about_z(parent.gamma).transpose();
  frame.place(back * E, back * d);
  frame.theta = {W(1), W(0)};

  // p = (a, b, 0) + d (0, -sin alpha, cos alpha) + (0, 0, shift)
  W y = frame.p[1], z = frame.p[2];
  if (parallel) y = W(0);
  const W farthest = W(2) * sqrt(d.squaredNorm());
  frame.d = z / cos_alpha;
  if (!parallel) {
    const W foot = -y / sin_alpha, shift = z - foot * cos_alpha;
    if (abs(foot) <= farthest && abs(shift) <= farthest) {
      frame.d = foot;
      parent.shift = shift;
      y = -sin_alpha * foot;
    }
  }
  frame.p << frame.p[0], parallel ? W(0) : W(y + sin_alpha * frame.d), W(0);
}

}  // namespace detail

}  // namespace kalmarm
