// Reverse mode: the gradient of any f(D, g, e-, a) over theta of every link, r and tau, in O(N), by
// the adjoint of factor_direction.hpp. A bar is the derivative of f by what is under it.
//
// The smoother backwards, tips to base, with l-bar(k) = sum over children c of phi(k,c) l+bar(c):
//   abar  += H l-bar                              (4.11): l- = l+ + H'a
//   e+bar  = abar,   gbar -= abar l+              (4.9):  a = e+ - g'l+
//   l+bar  = l-bar - g abar                       (4.9), (4.10)
// The filter backwards, base to tips:
//   z+bar(k) = phi' z-bar(parent)                                                 (4.4)
//   P+bar(k) = phi' P-bar(parent) phi + 1/2 (z+bar c' + c z+bar')                 (3.6), (4.5)
//   gbar  += z+bar e-
//   e-bar += e+bar / D + g'z+bar,   Dbar -= e+bar e+ / D                          (4.6)
//   z-bar  = z+bar - H'e-bar                                                      (4.2)
//   P-bar  = (I - gH)' P+bar (I - gH) + 1/2 (y H + H'y') + H' Dbar H,   y = (I - gH)'gbar / D
//   rbar   = Dbar + g'P+bar g - g'gbar / D                                  (3.6), (3.10)
//   taubar = e-bar
//   thetabar = gradient of tr(M P-bar) + z-bar'(v x* M v)        log_det.hpp, inertial_rows.hpp
// With e-bar = gbar = abar = 0 and Dbar = 1/D, P-bar is L- of (5.6): the gradient of log det M.
//
// A reference, against which log_det_gradient is tested. Fits are least squares and take Jacobians;
// this is for a scalar to be minimised by its gradient alone, which no program here does.
#pragma once

#include <vector>

#include "algorithms/study/derivatives/factor_direction.hpp"
#include "algorithms/study/derivatives/inertial_rows.hpp"
#include "algorithms/study/derivatives/log_det.hpp"

namespace kalmarm {

// Dbar, gbar, e-bar and abar: derivatives of f by D, g, e- and a of every joint.
template <class T>
struct FactorAdjoint {
  VectorX<T> D, e_minus, a;
  std::vector<Vector6<T>> g;

  explicit FactorAdjoint(const Model<T>& model)
      : D(VectorX<T>::Zero(model.nv())),
        e_minus(VectorX<T>::Zero(model.nv())),
        a(VectorX<T>::Zero(model.nv())),
        g(model.nv(), Vector6<T>::Zero()) {}
};

template <class T>
struct FactorGradient {
  FactorAdjoint<T> bar;
  std::vector<Vector6<T>> l, z;  // l-bar; z-bar
  std::vector<Matrix6<T>> P;     // P-bar

  explicit FactorGradient(const Model<T>& model)
      : bar(model), l(model.nv()), z(model.nv()), P(model.nv()) {}
};

namespace detail {

// (I - gH)' P (I - gH) of a symmetric P.
template <class T>
void close_loop(const Vector6<T>& g, int h, Matrix6<T>& P) {
  const Vector6<T> Pg = P * g;
  P.row(h) -= Pg.transpose();
  P.col(h) -= Pg;
  P(h, h) += g.dot(Pg);
}

}  // namespace detail

// out = the gradient of f from its adjoint, with the gains of the same state and the sweeps that
// gave a (nv values). About 1050 flops a link.
template <class T>
void factor_gradient(const Model<T>& model, const LinkKinematics<T>& kin, const Gains<T>& gains,
                     const Sweeps<T>& sweeps, const VectorX<T>& a, const FactorAdjoint<T>& adjoint,
                     FactorGradient<T>& ws, ParameterVector<T>& out) {
  FactorAdjoint<T>& bar = ws.bar;
  bar = adjoint;
  for (Vector6<T>& l : ws.l) l.setZero();
  for (int k = model.nv() - 1; k >= 0; --k) {
    const int h = model.joint(k).axis(), parent = model.parent(k);
    bar.a[k] += ws.l[k][h];
    bar.g[k] -= bar.a[k] * l_plus(model, sweeps, a, k);
    if (parent >= 0) ws.l[parent] += kin.phi[k].force_to_parent(ws.l[k] - gains.g[k] * bar.a[k]);
  }
  for (int k = 0; k < model.nv(); ++k) {
    const int h = model.joint(k).axis(), parent = model.parent(k);
    const T &D = gains.D[k], &e_plus = sweeps.e[k], &e_plus_bar = bar.a[k];
    const Vector6<T>&g = gains.g[k], &c = kin.c[k];
    Vector6<T>&z = ws.z[k], &gbar = bar.g[k];
    Matrix6<T>& P = ws.P[k];
    if (parent < 0) {
      z.setZero();
      P.setZero();
    } else {
      z = kin.phi[k].motion_from_parent(ws.z[parent]);
      P = kin.phi[k].dual_congruence(ws.P[parent]);
      P += (z * c.transpose() + c * z.transpose()) / T(2);
    }
    gbar += z * (D * e_plus);
    const T e_minus_bar = bar.e_minus[k] + e_plus_bar / D + g.dot(z);
    const T Dbar = bar.D[k] - e_plus_bar * e_plus / D;
    z[h] -= e_minus_bar;
    Vector6<T> y = gbar / D;
    const T gy = g.dot(y);
    out.tau[k] = e_minus_bar;
    out.r[k] = Dbar + g.dot(P * g) - gy;
    y[h] -= gy;
    detail::close_loop(g, h, P);
    P.row(h) += y.transpose() / T(2);
    P.col(h) += y / T(2);
    P(h, h) += Dbar;
    out.theta[k] = inertial_gradient<T>(P) - bilinear<T>(cross_motion(kin.v[k], z), kin.v[k]);
  }
}

}  // namespace kalmarm
