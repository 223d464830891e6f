// Kalman filter and Bryson-Frazier smoother on given gains: M^-1 = (I - L*) D^-1 (I - L), (3.3),
// one right-hand side in O(N).
//
//   filter, tips to base:
//     z-(k) = b(k) + sum over children c of phi(k,c) z+(c)     (4.4)
//     e-(k) = tau(k) - H z-                                    (4.2)
//     e+(k) = e- / D                                           (4.6)
//     z+(k) = z- + g e- + P+ c(k)                              (4.5)
//   smoother, base to tips:
//     l+(k) = phi'(k) l-(parent) + c(k)                        (4.10)
//     a(k)  = e+(k) - g' l+                                    (4.9)
//     l-(k) = l+ + H' a                                        (4.11), corrected
// The velocity-product accelerations c(k) and the base acceleration l-(base) = -gravity enter where
// they arise (link_kinematics.hpp): the paper gathers them in b instead. z is then the force still
// missing at link k, P+ c included. With r = 0 two identities hold exactly,
//   H z+ = tau,   H l- = e+ - sum over j != h of g_j l+_j
// and where the update makes HP+ = 0 exact they are used instead of the sums, which keeps
// near-parallel axes accurate.
#pragma once

#include <vector>

#include "algorithms/study/inverse_mass/factors.hpp"

namespace kalmarm {

template <class T>
struct Sweeps {
  std::vector<Vector6<T>> z, l;
  std::vector<T> e;  // e-, then e+

  explicit Sweeps(const Model<T>& model) : z(model.nv()), l(model.nv()), e(model.nv()) {}
};

// e- and e+ of joint k, and z becomes z+; P_plus_c(k, z) adds P+ c.
template <class T, class Add>
void filter_joint(const Joint<T>& joint, int k, const Gains<T>& gains, const T& tau, Sweeps<T>& ws,
                  const Add& P_plus_c) {
  const int h = joint.axis();
  Vector6<T>& z = ws.z[k];
  const T e = tau - z[h];    // (4.2)
  ws.e[k] = e / gains.D[k];  // (4.6)
  if (joint.parent < 0) return;
  z += gains.g[k] * e;  // (4.5)
  P_plus_c(k, z);
  if (gains.exact_at(joint)) z[h] = tau;
}

// e+ of every joint from tau. At the start ws.z holds b; P_plus_c(k) is added behind joint k. About
// 80 flops a link.
template <class T, class Add>
void filter(const Model<T>& model, const LinkKinematics<T>& kin, const Gains<T>& gains,
            const VectorX<T>& tau, Sweeps<T>& ws, const Add& P_plus_c) {
  for (int k = model.nv() - 1; k >= 0; --k) {
    const int parent = model.parent(k);
    filter_joint(model.joint(k), k, gains, tau[k], ws, P_plus_c);
    if (parent >= 0) ws.z[parent] += kin.phi[k].force_to_parent(ws.z[k]);  // (4.4)
  }
}

// a(k) by (4.9), and l+ becomes l- by (4.11).
template <class T>
T smooth(const Joint<T>& joint, bool exact, const Vector6<T>& g, const T& e_plus, Vector6<T>& l) {
  const int h = joint.axis();
  if (exact) {
    const T l_plus = l[h];
    l[h] = T(0);
    l[h] = e_plus - g.dot(l);
    return l[h] - l_plus;
  }
  const T a = e_plus - g.dot(l);
  l[h] += a;
  return a;
}

// a from e+, with c(k) and gravity. About 60 flops a link.
template <class T>
void smooth_with_bias(const Model<T>& model, const LinkKinematics<T>& kin, const Gains<T>& gains,
                      Sweeps<T>& ws, VectorX<T>& a) {
  const Vector6<T> l0 = base_acceleration(model);
  for (int k = 0; k < model.nv(); ++k) {
    const int parent = model.parent(k);
    const Joint<T>& joint = model.joint(k);
    ws.l[k] = kin.phi[k].motion_from_parent(parent < 0 ? l0 : ws.l[parent]) + kin.c[k];  // (4.10)
    a[k] = smooth(joint, gains.exact_at(joint), gains.g[k], ws.e[k], ws.l[k]);
  }
}

// x = M^-1 tau: b, c and gravity are zero. About 140 flops a link.
template <class T>
void solve(const Model<T>& model, const LinkKinematics<T>& kin, const Gains<T>& gains,
           const VectorX<T>& tau, Sweeps<T>& ws, VectorX<T>& x) {
  for (Vector6<T>& z : ws.z) z.setZero();
  filter(model, kin, gains, tau, ws, [](int, Vector6<T>&) {});
  for (int k = 0; k < model.nv(); ++k) {
    const int parent = model.parent(k);
    const Joint<T>& joint = model.joint(k);
    if (parent < 0)
      ws.l[k].setZero();
    else
      ws.l[k] = kin.phi[k].motion_from_parent(ws.l[parent]);
    x[k] = smooth(joint, gains.exact_at(joint), gains.g[k], ws.e[k], ws.l[k]);
  }
}

// M^-1 (nv x nv), both triangles. Column j needs the filter only on the path from j to the base,
// and the smoother on DoF 0..j, since M^-1 is symmetric. O(N^2) altogether.
template <class T>
void inverse_by_columns(const Model<T>& model, const LinkKinematics<T>& kin, const Gains<T>& gains,
                        Sweeps<T>& ws, MatrixX<T>& X) {
  for (int j = 0; j < model.nv(); ++j) {
    // filter with tau = e_j: zero outboard of j and on other branches
    for (int k = 0; k <= j; ++k) ws.e[k] = T(0);
    ws.e[j] = T(1) / gains.D[j];
    Vector6<T> z = gains.g[j];
    if (gains.exact_at(model.joint(j))) z[model.joint(j).axis()] = T(1);
    for (int child = j, k = model.parent(j); k >= 0; child = k, k = model.parent(k)) {
      z = kin.phi[child].force_to_parent(z);
      const int h = model.joint(k).axis();
      const T e = -z[h];
      ws.e[k] = e / gains.D[k];
      z += gains.g[k] * e;
      if (gains.exact_at(model.joint(k))) z[h] = T(0);
    }
    for (int k = 0; k <= j; ++k) {
      const int parent = model.parent(k);
      const Joint<T>& joint = model.joint(k);
      if (parent < 0)
        ws.l[k].setZero();
      else
        ws.l[k] = kin.phi[k].motion_from_parent(ws.l[parent]);
      X(j, k) = X(k, j) = smooth(joint, gains.exact_at(joint), gains.g[k], ws.e[k], ws.l[k]);
    }
  }
}

}  // namespace kalmarm
