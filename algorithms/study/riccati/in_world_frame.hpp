// Any covariance update with P carried in the world's axes instead of the link's: what it costs in
// digits to leave link frames.
//
//   P_w(k) = X P X',   M_w = X M X',   H_w = H X^-1,   g = X^-1 g_w
//   WorldAxes    about the link's origin:   X(k) = [Q 0; 0 Q],     phi_w(parent,k) = [1 d~; 0 1]
//   WorldOrigin  about the world's origin:  X(k) = [Q p~Q; 0 Q],   phi_w(parent,k) = 1
//   d = Q(parent) p(parent,k)
// Q and p are the pose of link k, from the base outwards.
// Link vectors are turned into the world's axes and never taken as differences of positions. The
// filter and the smoother stay in link frames, and so does the test for singular mechanisms, which
// misses some here.
#pragma once

#include <string>
#include <vector>

#include "algorithms/study/riccati/covariance_update.hpp"

namespace kalmarm {

enum class Origin { link, world };

template <class Update, Origin origin>
struct InWorldFrame {
  static constexpr bool in_world_frame = true;

  static std::string name() {
    return std::string(origin == Origin::link ? "WorldAxes<" : "WorldOrigin<") + Update::name() +
           ">";
  }
  static constexpr int resolution = Update::resolution;
  static constexpr bool exact_constraint = false;

  template <class T>
  struct Workspace {
    typename Update::template Workspace<T> update;
    std::vector<Matrix3<T>> Q;
    std::vector<Transform<T>> X, to_parent;

    explicit Workspace(const Model<T>& model)
        : update(model), Q(model.nv()), X(model.nv()), to_parent(model.nv()) {}
  };

  template <class T>
  static void start(const Model<T>& model, const LinkKinematics<T>& kin, Workspace<T>& ws) {
    constexpr bool at_origin = origin == Origin::world;
    for (int k = 0; k < model.nv(); ++k) {
      const int parent = model.parent(k);
      const Transform<T>& phi = kin.phi[k];
      const Vector3<T> d = parent < 0 ? phi.p : Vector3<T>(ws.Q[parent] * phi.p);
      ws.Q[k] = parent < 0 ? phi.R : Matrix3<T>(ws.Q[parent] * phi.R);
      const Vector3<T> origin_of_parent =
          parent < 0 || !at_origin ? Vector3<T>(Vector3<T>::Zero()) : ws.X[parent].p;
      ws.X[k] = {ws.Q[k], at_origin ? Vector3<T>(origin_of_parent + d) : origin_of_parent};
      ws.to_parent[k] = {Matrix3<T>::Identity(), at_origin ? Vector3<T>(Vector3<T>::Zero()) : d};
      Update::set(k, model.inertia(k).seen_from(ws.X[k]), ws.update);
    }
  }

  template <class T>
  static T measure(const Model<T>& model, int k, Workspace<T>& ws, Vector6<T>& g) {
    const Joint<T>& joint = model.joint(k);
    const Vector6<T> H = to_world_motion(ws.X[k], Vector6<T>(Vector6<T>::Unit(joint.axis())));
    const T D = Update::update(k, H, joint.r, ws.update, g);
    g = from_world_force(ws.X[k], g);
    return D;
  }

  template <class T>
  static void propagate(const Model<T>& model, const LinkKinematics<T>&, int k, Workspace<T>& ws) {
    Update::add(k, model.parent(k), ws.to_parent[k], ws.update);
  }

  template <class T>
  static Vector6<T> P_plus_times(int k, const Vector6<T>& x, const Workspace<T>& ws) {
    const Vector6<T> y = Update::P_plus_times(k, to_world_motion(ws.X[k], x), ws.update);
    return from_world_force(ws.X[k], y);
  }

 private:
  // X^-T x: w = Q w_k, v = Q v_k + p x w.
  template <class T>
  static Vector6<T> to_world_motion(const Transform<T>& X, const Vector6<T>& x) {
    const Vector3<T> w = X.R * x.template head<3>();
    Vector6<T> out;
    out << w, X.R * x.template tail<3>() + X.p.cross(w);
    return out;
  }

  // X^-1 f.
  template <class T>
  static Vector6<T> from_world_force(const Transform<T>& X, const Vector6<T>& f) {
    const Vector3<T> force = f.template tail<3>();
    Vector6<T> out;
    out << X.R.transpose() * (f.template head<3>() - X.p.cross(force)), X.R.transpose() * force;
    return out;
  }
};

template <class Update>
using WorldAxes = InWorldFrame<Update, Origin::link>;
template <class Update>
using WorldOrigin = InWorldFrame<Update, Origin::world>;

}  // namespace kalmarm
