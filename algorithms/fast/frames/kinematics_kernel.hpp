// The results of kalmarm/kinematics.hpp, from one sweep (world_motion.hpp), for one state or, with T a Pack,
// one state in every lane. Of a frame with the constant pose (A, s) in its link's axes:
//   R = R(k) A,  t = R(k) s,  p = root + p(k) + t                                             (1)
//   v = v(k) + w x t,  a = a(k) + w' x t + w x (w x t)                                        (2)
//   J's column of DoF j: (e; e x (p - p(j))) where it turns, (0; e) where it slides           (3)
// in aligned axes. In local ones (w; v) is (R'w; R'v), and (w'; a) is (R'w'; R'(a - w x v)); in world
// (w; v - w x p) and (w'; a - w' x p - w x v).
#pragma once

#include <algorithm>
#include <array>
#include <numeric>
#include <set>
#include <utility>
#include <vector>

#include "algorithms/fast/frames/coriolis.hpp"
#include "algorithms/fast/frames/kinematics_engine.hpp"
#include "algorithms/fast/frames/regressor.hpp"
#include "algorithms/model/plain.hpp"

namespace kalmarm {

template <class T>
class KinematicsKernel {
  using S = typename Lanes<T>::Scalar;

 public:
  // `model` is kept by reference.
  KinematicsKernel(const LoweredModel<S>& model, const Vector3<double>& gravity,
                   const std::vector<Frame>& frames, const std::vector<int>& bodies);

  // The results that `call` wants, into memory that `result` shows; of the call's numbers none is read.
  template <class Call>
  void fill(const Call& call, const T* q, const T* qd, const T* qdd);

  // Column-major. quaternions are read off rotations.
  const std::vector<T>& result(Kinematic what) const { return results_[static_cast<int>(what)]; }

 private:
  using Place = LoweredFrame<S>;

  // In rising order.
  static std::vector<int> links_to(const std::vector<Place>& places) {
    std::set<int> links;
    for (const Place& place : places) links.insert(place.way.begin(), place.way.end());
    return {links.begin(), links.end()};
  }
  static std::vector<int> all_links(int nv) {
    std::vector<int> links(nv);
    std::iota(links.begin(), links.end(), 0);
    return links;
  }

  T* at(Kinematic what) { return results_[static_cast<int>(what)].data(); }
  T* with_memory(Kinematic what) {
    std::vector<T>& result = results_[static_cast<int>(what)];
    result.resize(sizes_[static_cast<int>(what)], T(S(0)));
    return result.data();
  }
  static void put(const Triple<T>& v, T* to) {
    to[0] = v.x;
    to[1] = v.y;
    to[2] = v.z;
  }
  void put(Kinematic angular_and_linear, int frame, const Triple<T>& angular,
           const Triple<T>& linear) {
    T* const to = at(angular_and_linear) + 6 * frame;
    put(angular, to);
    put(linear, to + 3);
  }

  template <class Call>
  void fill_frame(const Call& call, int f);
  void fill_jacobian(Axes axes, const Place& place, int f, const Triad<T>& R, const Triple<T>& p,
                     const Triple<T>& root);
  template <class Call>
  void fill_whole(const Call& call, const T* qd);
  void put_row(Kinematic what, int row, int k, const T& x) { at(what)[row * model_.nv() + k] = x; }

  const LoweredModel<S>& model_;
  std::vector<Place> places_;
  Way<T> on_a_way_, all_;  // of links on the way to a frame, of all
  WorldMotion<T> motion_;
  WholeBody<T> whole_;
  CoriolisMatrix<T> coriolis_;
  Regressor<T> regressor_;
  std::array<int, kinematics> sizes_;
  std::array<std::vector<T>, kinematics> results_;  // C and Y: from the first call for them on
};

template <class T>
KinematicsKernel<T>::KinematicsKernel(const LoweredModel<S>& model, const Vector3<double>& gravity,
                                      const std::vector<Frame>& frames,
                                      const std::vector<int>& bodies)
    : model_(model),
      places_(model.lowered(frames)),
      on_a_way_(model, links_to(places_)),
      all_(model, all_links(model.nv())),
      motion_(model),
      whole_(model, gravity),
      coriolis_(model),
      regressor_(model, gravity, bodies) {
  const auto shapes = kinematic_shapes(model.nv(), static_cast<int>(frames.size()),
                                       static_cast<int>(bodies.size()));
  for (int i = 0; i < kinematics; ++i) {
    sizes_[i] = shapes[i].size();
    if (i < static_cast<int>(Kinematic::coriolis)) results_[i].assign(sizes_[i], T(S(0)));
  }
}

template <class T>
template <class Call>
void KinematicsKernel<T>::fill(const Call& call, const T* q, const T* qd, const T* qdd) {
  const bool whole =
      call.wants({Kinematic::center, Kinematic::center_velocity, Kinematic::center_acceleration,
                  Kinematic::center_jacobian, Kinematic::momentum, Kinematic::momentum_rate,
                  Kinematic::momentum_matrix, Kinematic::kinetic_energy,
                  Kinematic::potential_energy, Kinematic::coriolis, Kinematic::regressor});
  Way<T>& way = whole ? all_ : on_a_way_;
  if (call.wants_motion())
    motion_.move(model_, way, q, qd, qdd);
  else
    motion_.stand(model_, way, q);
  for (int f = 0; f < static_cast<int>(places_.size()); ++f) fill_frame(call, f);
  if (whole) fill_whole(call, qd);
}

template <class T>
template <class Call>
void KinematicsKernel<T>::fill_frame(const Call& call, int f) {
  const Place& place = places_[f];
  const Triple<T> zero = detail::zeros<T>();
  const T one = T(S(1)), none = T(S(0));
  const Triad<T> base = {{one, none, none}, {none, one, none}, {none, none, one}};
  const auto* const link = place.link < 0 ? nullptr : &motion_.links[place.link];
  const Triad<T>& on = link ? link->R : base;
  const auto turned = [&](const auto& v) { return on.turned(S(v[0]), S(v[1]), S(v[2])); };
  const auto& A = place.A;
  const Triad<T> R = {turned(A.col(0)), turned(A.col(1)), turned(A.col(2))};  // (1)
  const Triple<T> t = turned(place.s), p = link ? link->p + t : t;
  const Triple<T> root = link ? motion_.roots[link->tree] : zero, origin = root + p;
  put(origin, at(Kinematic::positions) + 3 * f);
  T* const rotation = at(Kinematic::rotations) + 9 * f;
  put(R.x, rotation);
  put(R.y, rotation + 3);
  put(R.z, rotation + 6);
  if (call[Kinematic::jacobians]) fill_jacobian(call.axes, place, f, R, p, root);
  if (!link || !call.wants({Kinematic::velocities, Kinematic::accelerations})) return;
  const Triple<T> w_x_t = cross(link->w, t);
  const Triple<T> v = link->v + w_x_t;  // (2)
  const Triple<T> a = link->a + cross(link->w_dot, t) + cross(link->w, w_x_t);
  switch (call.axes) {
    case Axes::aligned:
      put(Kinematic::velocities, f, link->w, v);
      put(Kinematic::accelerations, f, link->w_dot, a);
      return;
    case Axes::local:
      put(Kinematic::velocities, f, R.back(link->w), R.back(v));
      put(Kinematic::accelerations, f, R.back(link->w_dot), R.back(a - cross(link->w, v)));
      return;
    case Axes::world:
      put(Kinematic::velocities, f, link->w, v - cross(link->w, origin));
      put(Kinematic::accelerations, f, link->w_dot,
          a - cross(link->w_dot, origin) - cross(link->w, v));
      return;
  }
}

template <class T>
void KinematicsKernel<T>::fill_jacobian(Axes axes, const Place& place, int f, const Triad<T>& R,
                                        const Triple<T>& p, const Triple<T>& root) {
  const Triple<T> zero = detail::zeros<T>();
  // Where linear velocities are taken, from the tree's root.
  const Triple<T> point = axes == Axes::world ? zero - root : p;
  for (const int j : place.way) {
    const auto& link = motion_.links[j];
    const bool slides = model_.link(j).slides;
    Triple<T> angular = slides ? zero : link.R.z;  // (3)
    Triple<T> linear = slides ? link.R.z : cross(link.R.z, point - link.p);
    if (axes == Axes::local) {
      if (!slides) angular = R.back(angular);
      linear = R.back(linear);
    }
    const T column[6] = {angular.x, angular.y, angular.z, linear.x, linear.y, linear.z};
    for (int i = 0; i < 6; ++i) put_row(Kinematic::jacobians, 6 * f + i, j, column[i]);
  }
}

template <class T>
template <class Call>
void KinematicsKernel<T>::fill_whole(const Call& call, const T* qd) {
  whole_.stand(model_, motion_);
  put(motion_.roots[0] + whole_.center, at(Kinematic::center));
  *at(Kinematic::potential_energy) = whole_.potential;
  if (call.wants({Kinematic::center_velocity, Kinematic::center_acceleration, Kinematic::momentum,
                  Kinematic::momentum_rate, Kinematic::kinetic_energy})) {
    whole_.move(model_, motion_, qd);
    put(whole_.center_velocity, at(Kinematic::center_velocity));
    put(whole_.center_acceleration, at(Kinematic::center_acceleration));
    put(Kinematic::momentum, 0, whole_.angular, whole_.linear);
    put(Kinematic::momentum_rate, 0, whole_.angular_rate, whole_.linear_rate);
    *at(Kinematic::kinetic_energy) = whole_.kinetic;
  }
  if (call[Kinematic::regressor])
    regressor_.fill(model_, motion_, with_memory(Kinematic::regressor));
  if (!call.wants({Kinematic::center_jacobian, Kinematic::momentum_matrix, Kinematic::coriolis}))
    return;
  whole_.compose(model_, motion_);
  if (call[Kinematic::coriolis])
    coriolis_.fill(model_, motion_, whole_, with_memory(Kinematic::coriolis));
  const T one = T(S(1)) / whole_.mass;
  for (int k = 0; k < model_.nv(); ++k) {
    const auto& [angular, linear] = whole_.columns[k];
    const T column[6] = {angular.x, angular.y, angular.z, linear.x, linear.y, linear.z};
    for (int i = 0; i < 6; ++i) put_row(Kinematic::momentum_matrix, i, k, column[i]);
    for (int i = 0; i < 3; ++i) put_row(Kinematic::center_jacobian, i, k, column[3 + i] * one);
  }
}

}  // namespace kalmarm
