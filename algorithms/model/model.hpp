// A robot as a tree of one-DoF joints: all that the algorithms know of it.
//
// A joint of several degrees of freedom (ball, free, MuJoCo's several joints on a body) is lowered
// to one-DoF joints with massless links between them: one scalar measurement after another, which
// is exact. Link frames are chosen so that every joint axis is the link's z axis and, for a turning
// joint, the origin lies on it. So
//   H(k) = e_3' (turning) or e_6' (sliding):  a unit vector, and `axis` is its index,
//   phi(parent,k) = placement x coordinate (kalmarm/robot_model.hpp).
// Positions q and velocities keep the order and the conventions of the file that the model came
// from; DoF k has velocity k.
#pragma once

#include <cassert>
#include <limits>
#include <string>
#include <vector>

#include "algorithms/spatial/inertia.hpp"
#include "algorithms/spatial/spatial.hpp"
#include "kalmarm/robot_model.hpp"

namespace kalmarm {

template <class T>
struct Joint {
  int parent = -1;  // link on the inboard side; -1: the fixed base
  bool slides = false;
  Coordinate coordinate = Coordinate::angle;
  int q_index = 0;  // first entry of q that it reads
  T ref = T(0);     // q at which the link is at its placement [rad or m]
  Eigen::Quaternion<T> rotation = {T(1), T(0), T(0), T(0)};  // E, any length but zero
  Vector3<T> translation = Vector3<T>::Zero();               // d [m]
  T r = T(0);         // joint noise = armature, >= 0 [kg m^2 or kg]
  RigidBody<T> body;  // of the link outboard of this DoF

  int axis() const { return slides ? 5 : 2; }

  template <class U>
  Joint<U> cast() const {
    return {parent,
            slides,
            coordinate,
            q_index,
            U(ref),
            rotation.template cast<U>(),
            translation.template cast<U>(),
            U(r),
            body.template cast<U>()};
  }
};

// The parameters are exact in whatever precision T they are held; the rest is derived from them.
template <class T>
class Model {
 public:
  Model() = default;
  Model(std::vector<Joint<T>> joints, std::vector<std::string> names, int nq,
        const Vector3<T>& gravity)
      : joints_(std::move(joints)), names_(std::move(names)), nq_(nq), gravity_(gravity) {
    assert(joints_.size() == names_.size());
    for (const Joint<T>& joint : joints_) {
      assert(joint.parent < static_cast<int>(inertia_.size()));
      inertia_.emplace_back(joint.body);
      E_.push_back(kalmarm::rotation(joint.rotation));
    }
  }

  int nv() const { return static_cast<int>(joints_.size()); }
  int nq() const { return nq_; }
  const Joint<T>& joint(int k) const { return joints_[k]; }
  int parent(int k) const { return joints_[k].parent; }
  const std::string& name(int k) const { return names_[k]; }
  const std::vector<std::string>& names() const { return names_; }
  const Vector3<T>& gravity() const { return gravity_; }  // [m/s^2]
  void set_gravity(const Vector3<T>& gravity) { gravity_ = gravity; }

  const LinkInertia<T>& inertia(int k) const { return inertia_[k]; }
  const SpatialInertia<T>& M(int k) const { return inertia_[k].M; }
  const Matrix6<T>& W(int k) const { return inertia_[k].W; }
  const Matrix3<T>& E(int k) const { return E_[k]; }

  // Another inertia or joint noise, as a fit tries them. M is all that is given of the inertia: the
  // forms W and V, which ask for principal axes, become NaN, and updates that need them must not
  // be used.
  void set_inertia(int k, const SpatialInertia<T>& M) {
    RigidBody<T>& body = joints_[k].body;
    body.mass = M.m;
    body.com = M.h / M.m;
    body.axes.coeffs().setConstant(T(std::numeric_limits<double>::quiet_NaN()));
    body.moments.setConstant(T(std::numeric_limits<double>::quiet_NaN()));
    inertia_[k] = LinkInertia<T>(M, body.com);
  }
  void set_noise(int k, const T& r) { joints_[k].r = r; }

  // The same robot with its parameters rounded to U.
  template <class U>
  Model<U> cast() const {
    std::vector<Joint<U>> joints;
    joints.reserve(joints_.size());
    for (const Joint<T>& joint : joints_) joints.push_back(joint.template cast<U>());
    return Model<U>(std::move(joints), names_, nq_, gravity_.template cast<U>());
  }

 private:
  std::vector<Joint<T>> joints_;
  std::vector<std::string> names_;
  int nq_ = 0;
  Vector3<T> gravity_ = Vector3<T>::Zero();
  std::vector<LinkInertia<T>> inertia_;
  std::vector<Matrix3<T>> E_;
};

}  // namespace kalmarm
