// What the fast path stores of a link: its placement, its body, and what few links need.
//
//   phi(parent,k) = T(p) Rz(theta) Rx(alpha) Rz(angle) Tz(d)       T: translation, R: rotation
//   angle = q + offset + quarters of a turn at a hinge,  d = q + offset at a slide
//   M(k) = [I  h~; -h~  m 1],  h = m c                             I about the link's origin
// lowered_model.hpp says how the numbers are chosen.
#pragma once

#include <vector>

#include "algorithms/fast/claims/arithmetic.hpp"
#include "algorithms/fast/lowering/link_frame.hpp"
#include "algorithms/model/model.hpp"
#include "algorithms/spatial/sincos.hpp"

namespace kalmarm {

// The same, with sin^2 and sin cos for tensors.
template <class T>
struct Turn : Direction<T> {
  T ss, cs;

  Turn(const T& c, const T& s) : Direction<T>{c, s}, ss(s * s), cs(c * s) {}
};

// What few links need, kept apart so that long chains stay in the cache.
template <class S>
struct UncommonPlacement {
  Turn<S> turn{S(1), S(0)}, theta{S(1), S(0)};  // turn: Rz(angle) of a slide
  Matrix3<S> E = Matrix3<S>::Identity();        // matrix: the placement's rotation
  // Of a child of the base, whose own frame is its placement on the base:
  Vector3<S> a0 = Vector3<S>::Zero();      // its acceleration, -gravity
  Matrix3<S> E0 = Matrix3<S>::Identity();  // that placement
  Vector3<S> d0 = Vector3<S>::Zero();
};

// Of all hinges: their angle is q[q_index] + offset + quarters of a turn, 0 to 3.
template <class S>
struct HingeAngles {
  std::vector<int> q_index;
  std::vector<S> offset;  // these two padded, as sin_cos takes them
  std::vector<IntegerOf<S>> quarters;
};

// For the test of a sweep (rounding_weights.hpp).
template <class S>
struct RoundingWeights {
  S Axx = S(0), Ayy = S(0), Azz = S(0), Cxx = S(0), Cyy = S(0), Czz = S(0);  // of P's diagonal
  S moment = S(0), force = S(0);                                             // of what is pending
  S unit = S(0);        // of all weights: c u over the error of a D that is let pass
  S reach = S(0);       // sum over axes of the largest p^2 of a child
  S bias = S(0);        // of w^4, for what cancels within a link's own bias (force_noise.hpp)
  bool tested = false;  // else nothing is lost in any position, here and outboard
  bool counts = true;   // what is rounded here is not counted by another link

  // Whether the body resists motions about every axis, so that what is pending ends here.
  bool absorbs() const { return moment < S(no_body); }

  // Between the DoF of a joint in one block step nothing is rounded that its last does not count.
  void leave_to_the_last() {
    Axx = Ayy = Azz = Cxx = Cyy = Czz = S(0);
    counts = false;
  }
};

// What only the inward sweep needs.
template <class S>
struct LoweredBody {
  S r = S(0), m = S(0);                                                      // joint noise, mass
  S h[3] = {S(0), S(0), S(0)};                                               // m c
  S Ixx = S(0), Ixy = S(0), Ixz = S(0), Iyy = S(0), Iyz = S(0), Izz = S(0);  // about the origin
  S reach = S(0);  // 2 |origin from the parent's|^2; of a slide 4 |p|^2, without its d
  RoundingWeights<S> weights;
};

// What inverse dynamics needs, about the centre of mass.
template <class S>
struct CentralBody {
  S m, c[3];
  S Jxx, Jxy, Jxz, Jyy, Jyz, Jzz;  // integral of r r' dm = tr(I)/2 - I
};

template <class S>
struct LoweredLink {
  enum class Kind { screws, matrix, cyclic };
  enum class Tilt { none, right, any };  // alpha = 0, a right angle

  Kind kind = Kind::screws;
  Tilt tilt = Tilt::any;
  int parent = -1;
  bool slides = false, has_noise = false, massless = false, hangs_on_previous = false,
       turned = false;
  bool aligned = false;  // at a hinge: theta = 0, p = (a, b, 0)
  bool resists = false;  // contacts stand on it
  bool loaded = false;   // a call may add to its body
  int branch = -1;       // index of its sum over children other than k + 1 in a workspace; else -1
  int q_index = 0;       // of the joint's first coordinate
  Coordinate coordinate = Coordinate::angle;
  int varying = -1;   // of the joint's angle in HingeAngles, or of its matrix
  int uncommon = -1;  // of its UncommonPlacement

  S d = S(0);  // of a slide: what is added to q
  Turn<S> alpha{S(1), S(0)};
  Vector3<S> p = Vector3<S>::Zero();
};

// Consecutive links that a sweep treats one by one, or the three or six DoF of a ball or free joint
// that it treats in one block step (three_axes.hpp).
struct LinkRun {
  int first, last;
  bool at_once;
};

}  // namespace kalmarm
