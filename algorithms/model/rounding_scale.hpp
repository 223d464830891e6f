// How large the terms are that D(k) of a covariance form is summed from, S of study/inverse_mass/singularity.hpp,
// and from which D on nothing is lost in rounding.
#pragma once

#include <cmath>
#include <vector>

#include "algorithms/model/link_kinematics.hpp"
#include "algorithms/model/polar_moment.hpp"

namespace kalmarm {

// A D(k) up to this times H S H' + r is no more than rounding: (32 u)^order, order 2 of square roots.
template <class T>
T least_D_over_scale(int order) {
  T out = T(1);
  for (int i = 0; i < order; ++i) out *= T(32) * unit_roundoff<T>();
  return out;
}

// A D(k) up to this times J(k) of polar_moment.hpp gets a second look. J does not see errors that a
// nearly singular joint has blown up on the way, so this is high, sqrt((32 u)^order), but for
// covariance forms in float32: there it would catch every wrist, and is 256 u.
template <class T>
T least_D_over_size(int order) {
  using std::sqrt;
  const bool wide = order > 1 || unit_roundoff<T>() < T(1e-10);
  const T least = least_D_over_scale<T>(order);
  return wide ? T(sqrt(least)) : T(T(8) * least);
}

// S, tips to base.
template <class T>
struct RoundingScale {
  std::vector<Matrix6<T>> P, S;

  explicit RoundingScale(const Model<T>& model) : P(model.nv()), S(model.nv()) {}

  void begin(const Model<T>& model) {
    for (int k = 0; k < model.nv(); ++k) P[k] = S[k] = model.M(k).matrix();
  }

  T scale(const Model<T>& model, int k) const {
    const Joint<T>& joint = model.joint(k);
    return S[k](joint.axis(), joint.axis()) + joint.r;
  }

  void propagate(const Model<T>& model, const Transform<T>& phi, int k, const Vector6<T>& g) {
    const Joint<T>& joint = model.joint(k);
    Matrix6<T> psi = Matrix6<T>::Identity();  // I - gH
    psi.col(joint.axis()) -= g;
    const Matrix6<T> P_minus = P[k];
    P[k] = psi * P_minus * psi.transpose() + joint.r * g * g.transpose();
    S[k] = psi * S[k] * psi.transpose() + P_minus;
    const Matrix6<T> phi_abs = phi.matrix().cwiseAbs();
    P[joint.parent] += phi.congruence(P[k]);
    S[joint.parent] += phi.congruence(S[k]);
    S[joint.parent].diagonal() += (phi_abs * P[k].cwiseAbs() * phi_abs.transpose()).diagonal();
  }
};

}  // namespace kalmarm
