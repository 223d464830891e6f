// The model of a part of a robot: joints that are locked make composite bodies, and branches
// are left out.
//
// Where link k is locked, at position phi(parent,k), what hangs on it hangs on its parent:
//   phi(parent,c) = phi(parent,k) phi(k,c)                for every child c of k
//   M(parent)    += phi(parent,k) M(k) phi(parent,k)'     dropped on the fixed base
// Everything is worked out in long double and rounded once, so that the smaller model is as exact
// as if the robot had been built with that body: errors are those of rounding its parameters.
#pragma once

#include <cassert>
#include <cmath>
#include <vector>

#include "algorithms/model/model.hpp"
#include "algorithms/spatial/principal_axes.hpp"
#include "algorithms/spatial/sincos.hpp"

namespace kalmarm {

enum class Fate : char { free, locked, dropped };

struct Reduction {
  Model<double> model;
  std::vector<int> dofs;     // DoF k of it is DoF dofs[k] of the whole
  std::vector<int> q_whole;  // entry i of its q is entry q_whole[i] of the whole's
};

// Where a link's frame stands in the axes of a link of the smaller model; -1: the base.
struct Standing {
  using Long = long double;

  int link = -1;
  Eigen::Quaternion<Long> rotation = {1, 0, 0, 0};
  Vector3<Long> translation = Vector3<Long>::Zero();

  Standing then(const Eigen::Quaternion<Long>& R, const Vector3<Long>& p) const {
    return {link, (rotation * R).normalized(), translation + kalmarm::rotation(rotation) * p};
  }
};

namespace detail {

// phi(parent,k) at q, as link_kinematics.hpp says.
inline Standing across(const Joint<long double>& joint, const VectorX<long double>& q,
                       const Standing& parent) {
  using Quaternion = Eigen::Quaternion<long double>;
  using Translation = Vector3<long double>;
  const Quaternion C(0.5L, 0.5L, 0.5L, 0.5L);
  if (joint.coordinate == Coordinate::follower) return parent.then(C, Translation::Zero());
  const int i = joint.q_index;
  const Standing at = parent.then(joint.rotation, joint.translation);
  switch (joint.coordinate) {
    case Coordinate::angle: {
      long double s, c;  // of half the angle
      sin_cos(q[i] / 2, -joint.ref / 2, s, c);
      return at.then({c, 0, 0, s}, Translation::Zero());
    }
    case Coordinate::distance:
      return at.then(Quaternion::Identity(), {0, 0, q[i] - joint.ref});
    case Coordinate::quaternion:
      return at.then(Quaternion(q[i], q[i + 1], q[i + 2], q[i + 3]) * C, Translation::Zero());
    default:  // position
      return at.then(C, {q[i], q[i + 1], q[i + 2]});
  }
}

}  // namespace detail

// fate: of every link; all of a joint's DoF share it, and what hangs on a dropped link is dropped.
// q: nq values, of which those of locked joints are used. standing: where asked for, of every link
// that is not dropped.
inline Reduction reduce(const Model<double>& whole, const std::vector<Fate>& fate,
                        const VectorX<double>& q, std::vector<Standing>* standing = nullptr) {
  using Long = long double;
  const Model<Long> model = whole.cast<Long>();
  const VectorX<Long> position = q.cast<Long>();
  std::vector<Standing> at(model.nv());
  std::vector<Joint<Long>> joints;
  std::vector<std::string> names;
  Reduction out;
  for (int k = 0; k < model.nv(); ++k) {
    if (fate[k] == Fate::dropped) continue;
    Joint<Long> joint = model.joint(k);
    const Standing parent = joint.parent < 0 ? Standing() : at[joint.parent];
    if (fate[k] == Fate::locked) {
      at[k] = detail::across(joint, position, parent);
      if (at[k].link < 0) continue;
      RigidBody<Long> body = joint.body;
      body.com = at[k].translation + rotation(at[k].rotation) * body.com;
      body.axes = at[k].rotation * body.axes;
      RigidBody<Long>& link = joints[at[k].link].body;
      link = welded(link, body);
      continue;
    }
    if (joint.coordinate != Coordinate::follower && joint.parent >= 0 &&
        fate[joint.parent] == Fate::locked) {
      const Standing placed = parent.then(joint.rotation, joint.translation);
      joint.rotation = placed.rotation;
      joint.translation = placed.translation;
    }
    joint.parent = parent.link;
    joint.q_index = static_cast<int>(out.q_whole.size());
    for (int i = 0; i < q_entries(joint.coordinate); ++i)
      out.q_whole.push_back(model.joint(k).q_index + i);
    at[k].link = static_cast<int>(joints.size());
    joints.push_back(joint);
    names.push_back(model.name(k));
    out.dofs.push_back(k);
  }
  std::vector<Joint<double>> rounded;
  for (const Joint<Long>& joint : joints) rounded.push_back(joint.cast<double>());
  out.model = Model<double>(std::move(rounded), std::move(names),
                            static_cast<int>(out.q_whole.size()), whole.gravity());
  if (standing) *standing = at;
  return out;
}

}  // namespace kalmarm
