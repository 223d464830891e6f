// Is a mechanism planar, and where is it at home: at q = ref.
//
// Planar: there is a direction n, fixed in the world, such that every hinge's axis is +n or -n and
// every slide's is parallel to n or perpendicular to it. What moves across n then never turns n, so
// that what holds at q = ref holds for all q; and M has no entry between joints that move in the
// plane and slides along n (planar_model.hpp).
//   n is the first hinge's axis, where there is a hinge; else the axis of a slide, or perpendicular
//   to two that are not parallel, or to the only direction that there is.
// A joint's axis is compared with its parent's, and then set right, so that nothing adds up along a
// chain. It may be off by 16 u, u of the precision that the model is given in:
//   2 u          for each quaternion whose numbers are rounded, two where it is a product
//   2 sqrt(2) 4 u     for rounding in the product: each number is a sum of four products, off by up
//                to 4 u |a| |b|, and two of them tilt the axis, by twice as much
// At a slide two placements count; where they add up to more the spatial kernels answer. To leave
// that out is to change each placement by rounding. A chain whose axes were tilted on purpose is
// not planar.
#pragma once

#include <cmath>
#include <optional>
#include <type_traits>
#include <vector>

#include "algorithms/model/model.hpp"

namespace kalmarm {

// Precision in which a model is looked at: a float's tilt of 1e-16 is no rounding yet.
template <class T>
using Lowering = std::conditional_t<std::is_same_v<T, float>, Wider<Wider<T>>, Wider<T>>;

// A link's axes and origin at q = ref.
template <class W>
struct HomeFrame {
  Matrix3<W> R = Matrix3<W>::Identity();
  Vector3<W> o = Vector3<W>::Zero();

  HomeFrame child(const Joint<W>& joint, const Matrix3<W>& E) const {
    return {R * E, o + R * joint.translation};
  }
};

template <class W>
struct Plane {
  Matrix3<W> axes;                 // its rows in the world's axes: two in the plane, and n
  std::vector<HomeFrame<W>> home;  // of every link, in the plane's axes

  Vector3<W> normal() const { return axes.row(2).transpose(); }
};

namespace detail {

template <class W>
W across(const Vector3<W>& x) {
  using std::sqrt;
  return sqrt(x[0] * x[0] + x[1] * x[1]);
}

// Rows e1, e2, n. The world's own axes where n is one of them.
template <class W>
Matrix3<W> axes_about(const Vector3<W>& n) {
  int least = 0;
  for (int i = 1; i < 3; ++i)
    if (n[i] * n[i] < n[least] * n[least]) least = i;
  const Vector3<W> e1 = Vector3<W>(Vector3<W>::Unit(least) - n[least] * n).normalized();
  Matrix3<W> axes;
  axes << e1.transpose(), n.cross(e1).transpose(), n.transpose();
  return axes;
}

// R turned by so little that its z axis is z.
template <class W>
Matrix3<W> with_axis(const Matrix3<W>& R, const Vector3<W>& z) {
  const Vector3<W> x = Vector3<W>(R.col(0) - z.dot(R.col(0)) * z).normalized();
  Matrix3<W> out;
  out << x, z.cross(x), z;
  return out;
}

// The mechanism at home in the axes of a plane with that normal, if it is one that it moves in.
template <class W>
std::optional<Plane<W>> at_home(const Model<W>& model, const Vector3<W>& n, const W& tolerance) {
  using std::abs;
  Plane<W> plane;
  plane.axes = axes_about(n);
  const HomeFrame<W> base{plane.axes, Vector3<W>::Zero()};
  for (int k = 0; k < model.nv(); ++k) {
    const Joint<W>& joint = model.joint(k);
    const HomeFrame<W>& parent = joint.parent < 0 ? base : plane.home[joint.parent];
    HomeFrame<W> frame = parent.child(joint, model.E(k));
    Vector3<W> z = frame.R.col(2);
    if (across(z) <= tolerance)
      z << W(0), W(0), W(z[2] < W(0) ? -1 : 1);
    else if (joint.slides && abs(z[2]) <= tolerance)
      z << z[0] / across(z), z[1] / across(z), W(0);
    else
      return std::nullopt;
    frame.R = with_axis(frame.R, z);
    plane.home.push_back(frame);
  }
  return plane;
}

// Directions of which one is normal to the plane, if there is a plane.
template <class W>
std::vector<Vector3<W>> candidate_normals(const Model<W>& model, const W& tolerance) {
  std::vector<Matrix3<W>> R;
  for (int k = 0; k < model.nv(); ++k) {
    const int parent = model.parent(k);
    R.push_back(parent < 0 ? model.E(k) : Matrix3<W>(R[parent] * model.E(k)));
    if (!model.joint(k).slides) return {R[k].col(2)};
  }
  if (R.empty()) return {};
  const Vector3<W> first = R[0].col(2);
  Vector3<W> second = first;  // the one that is least parallel to it
  for (const Matrix3<W>& other : R)
    if (first.cross(Vector3<W>(other.col(2))).norm() > first.cross(second).norm())
      second = other.col(2);
  const Vector3<W> normal = first.cross(second);
  if (normal.norm() > tolerance) return {normal.normalized(), first, second};
  return {axes_about(first).row(0).transpose()};
}

}  // namespace detail

// The plane that a mechanism of hinges and slides moves in; nothing for any other. Once a model.
template <class T>
std::optional<Plane<Lowering<T>>> find_plane(const Model<T>& model) {
  using W = Lowering<T>;
  for (int k = 0; k < model.nv(); ++k)
    if (const Coordinate coordinate = model.joint(k).coordinate;
        coordinate != Coordinate::angle && coordinate != Coordinate::distance)
      return std::nullopt;
  const Model<W> wide = model.template cast<W>();
  const W tolerance = W(16) * W(unit_roundoff<T>());
  for (const Vector3<W>& n : detail::candidate_normals(wide, tolerance))
    if (auto plane = detail::at_home(wide, n, tolerance)) return plane;
  return std::nullopt;
}

}  // namespace kalmarm
