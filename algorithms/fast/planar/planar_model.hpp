// A planar mechanism (plane.hpp) lowered once: what moves in the plane, as a tree of hinges and
// slides in two dimensions, and the slides along its normal n, which are a system of their own.
//
//   M = [in the plane, 0; 0, along n]
// In the plane a link is all that moves as one there: what is carried along n alone stays with the
// link that carries it. Its frame has the axes of the plane at q = ref, so that angles add up,
//   theta(k) = theta(parent) + (q - ref)     at a hinge, with the sign of its axis along n
// and a vector of the link turns by theta alone. Of phi two numbers are left, of M(k) four: with
// the link's origin at p from its parent's, h = m c, and J about n through the origin,
//   phi(parent,k) = [1 t'; 0 1]  on (moment about n; force),   t = (-p_y, p_x)
//   M(k)          = [J b'; b m 1],                             b = (-h_y, h_x)
// Everything is worked out in a wider precision and rounded once.
#pragma once

#include <algorithm>
#include <type_traits>
#include <utility>
#include <vector>

#include "algorithms/fast/derivatives/joint_table.hpp"
#include "algorithms/fast/lowering/lowered_model.hpp"
#include "algorithms/fast/planar/plane.hpp"
#include "algorithms/fast/planar/translational.hpp"

namespace kalmarm {

// Four links at once: an arm has few, and scalar code that follows on 512-bit registers waits.
template <class T>
using Four = std::conditional_t<std::is_floating_point_v<T>, Pack<T, 4>, T>;
template <class T>
inline constexpr int four = Lanes<Four<T>>::count;

// Of what is rounded at a link, for the test of D and for N: RoundingWeights in the plane, whose
// axes turn with the link.
template <class T>
struct PlanarWeights {
  T n = T(0), force = T(0), pending_moment = T(0), pending_force = T(0), reach = T(0);
  bool tested = false;  // as of RoundingWeights
};

template <class T>
struct PlanarLink {
  int parent = -1;  // link in the plane on the inboard side; -1: the fixed base
  int dof = 0, q_index = 0;
  bool slides = false, has_noise = false, hangs_on_previous = false;
  int branch = -1;  // index of its sum over children other than k + 1 in the workspace; else -1
  int apart = -1;   // in the workspace, of a slide, or of a link on a branch; else -1
  T sign = T(1);    // of a hinge's axis along n
  T ref = T(0), r = T(0);
  T m = T(0), J = T(0);
  T reach = T(0);                                // 2 |p|^2, of a slide 4 |p|^2 at home
  T tx = T(0), ty = T(0), ux = T(0), uy = T(0);  // t and a slide's axis, at home
  PlanarWeights<T> weights;
};

template <class T>
class PlanarModel {
 public:
  // Of a link at home: t of the hinge that hangs on it and is the next link, and b. Of a hinge, the
  // sign of its axis along n, and ref; of a slide, 0.
  enum Row { next_tx, next_ty, body_x, body_y, sign, ref, rows };

  template <class Given>
  PlanarModel(const Model<Given>& model, const Plane<Lowering<Given>>& plane) {
    lower(model.template cast<Lowering<Given>>(), plane);
  }

  // Weights for tests of rounding, of the same robot's.
  void set_weights(const LoweredModel<T>& lowered) {
    for (int k = nv() - 1; k >= 0; --k) {
      PlanarLink<T>& link = links_[k];
      const RoundingWeights<T>& w = lowered.body(link.dof).weights;
      const bool tested = link.weights.tested || w.tested;  // by what a child hands on
      link.weights = {w.Azz, std::max(w.Cxx, w.Cyy), w.moment, w.force, w.reach, tested};
      if (tested && link.parent >= 0) links_[link.parent].weights.tested = true;
    }
  }

  int nv() const { return static_cast<int>(links_.size()); }  // of the DoF in the plane
  int branch_count() const { return branch_count_; }
  const std::vector<int>& apart() const { return apart_; }  // links that have such a place
  const PlanarLink<T>& link(int k) const { return links_[k]; }
  int moves_with(int link) const { return moves_with_[link]; }  // link in the plane, or -1
  bool is_chain() const {
    return is_chain_;
  }  // link k is DoF k and coordinate k, and hangs on k - 1
  const JointTable<T, rows, Four<T>>& home() const { return home_; }
  const T& a0_x() const { return a0_x_; }  // acceleration of the base, -gravity
  const T& a0_y() const { return a0_y_; }

 private:
  template <class W>
  struct Body {
    W m = W(0), J = W(0);
    Vector3<W> h = Vector3<W>::Zero();
  };

  template <class W>
  void lower(const Model<W>& model, const Plane<W>& plane) {
    a0_x_ = T(W(-plane.axes.row(0).dot(model.gravity())));
    a0_y_ = T(W(-plane.axes.row(1).dot(model.gravity())));
    std::vector<Body<W>> bodies;
    for (int k = 0; k < model.nv(); ++k) {
      const int parent = model.parent(k) < 0 ? -1 : moves_with_[model.parent(k)];
      const HomeFrame<W>& frame = plane.home[k];
      if (model.joint(k).slides && frame.R(2, 2) != W(0)) {
        moves_with_.push_back(parent);
      } else {
        moves_with_.push_back(nv());
        const Vector3<W> from = parent < 0 ? Vector3<W>::Zero() : plane.home[links_[parent].dof].o;
        add_link(model.joint(k), k, parent, frame, Vector3<W>(frame.o - from));
        bodies.emplace_back();
      }
      if (const int i = moves_with_[k]; i >= 0)
        add_body(model, k, frame, plane.home[links_[i].dof].o, bodies[i]);
    }
    home_ = JointTable<T, rows, Four<T>>(nv());
    for (int k = 0; k < nv(); ++k) {
      const PlanarLink<T>& link = links_[k];
      set_body(bodies[k], k);
      if (!link.slides) home_.at(sign, k) = link.sign;
      if (!link.slides) home_.at(ref, k) = link.ref;
      is_chain_ = is_chain_ && link.parent == k - 1 && link.dof == k && link.q_index == k;
    }
  }

  template <class W>
  void add_link(const Joint<W>& joint, int dof, int parent, const HomeFrame<W>& frame,
                const Vector3<W>& p) {
    const int k = nv();
    PlanarLink<T>& link = links_.emplace_back();
    link.parent = parent;
    link.dof = dof;
    link.q_index = joint.q_index;
    link.slides = joint.slides;
    link.ref = T(joint.ref);
    link.r = T(joint.r);
    link.has_noise = joint.r != W(0);
    link.hangs_on_previous = parent >= 0 && parent == k - 1;
    if (parent >= 0 && !link.hangs_on_previous && links_[parent].branch < 0)
      links_[parent].branch = branch_count_++;
    if (joint.slides || (parent >= 0 && !link.hangs_on_previous)) {
      link.apart = static_cast<int>(apart_.size());
      apart_.push_back(k);
    }
    link.tx = T(W(-p[1]));
    link.ty = T(p[0]);
    link.reach = T(W((joint.slides ? 4 : 2) * (p[0] * p[0] + p[1] * p[1])));
    if (joint.slides) {
      link.ux = T(frame.R(0, 2));
      link.uy = T(frame.R(1, 2));
    } else {
      link.sign = T(frame.R(2, 2));
    }
  }

  // Of link k of the model to what moves with it.
  template <class W>
  static void add_body(const Model<W>& model, int k, const HomeFrame<W>& frame,
                       const Vector3<W>& origin, Body<W>& sum) {
    const RigidBody<W>& body = model.joint(k).body;
    const Vector3<W> c = frame.o + frame.R * body.com - origin;
    const Vector3<W> n = frame.R.row(2).transpose();
    sum.m += body.mass;
    sum.h += body.mass * c;
    sum.J += n.dot(Vector3<W>(model.inertia(k).I_cm * n)) + body.mass * (c[0] * c[0] + c[1] * c[1]);
  }

  template <class W>
  void set_body(const Body<W>& body, int k) {
    PlanarLink<T>& link = links_[k];
    link.m = T(body.m);
    link.J = T(body.J);
    home_.at(body_x, k) = T(W(-body.h[1]));
    home_.at(body_y, k) = T(body.h[0]);
    if (k + 1 < nv() && links_[k + 1].hangs_on_previous && !links_[k + 1].slides) {
      home_.at(next_tx, k) = links_[k + 1].tx;
      home_.at(next_ty, k) = links_[k + 1].ty;
    }
  }

  int branch_count_ = 0;
  bool is_chain_ = true;
  std::vector<int> apart_;
  std::vector<PlanarLink<T>> links_;
  std::vector<int> moves_with_;
  JointTable<T, rows, Four<T>> home_{0};
  T a0_x_, a0_y_;
};

// The slides along n, and for every link the one that it moves with along n, or -1.
template <class W>
struct AlongNormal {
  std::vector<Slide<W>> slides;
  std::vector<int> dofs, moves_with;

  AlongNormal(const Model<W>& model, const Plane<W>& plane) {
    for (int k = 0; k < model.nv(); ++k) {
      const Joint<W>& joint = model.joint(k);
      int i = joint.parent < 0 ? -1 : moves_with[joint.parent];
      if (joint.slides && plane.home[k].R(2, 2) != W(0)) {
        slides.push_back({i, plane.home[k].R.col(2), joint.r});
        dofs.push_back(k);
        i = static_cast<int>(slides.size()) - 1;
      }
      moves_with.push_back(i);
      if (i >= 0) slides[i].mass += joint.body.mass;
    }
  }
};

}  // namespace kalmarm
