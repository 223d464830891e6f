// Forward mode: the derivative of everything in the filter and the smoother along one direction
// (dM of every link, dr, dtau), in O(N). From the closed-loop recursion, tips to base,
//
//   dP-(k) = dM(k) + sum over children c of phi(k,c) dP+(c) phi'(k,c)            of (3.6)
//   dD(k)  = H dP- H' + dr                                                       of (3.6)
//   dg(k)  = ((I - gH) dP- H' - g dr) / D                                        of (3.10)
//   dP+(k) = (I - gH) dP- (I - gH)' + g dr g' = dP- - u g' - g u' + g dD g',     u = dP- H'
//   dz-(k) = db(k) + sum over children c of phi(k,c) dz+(c)                      of (4.4)
//   de-(k) = dtau - H dz-,   de+ = (de- - e+ dD) / D                             of (4.2), (4.6)
//   dz+(k) = dz- + dg e- + g de- + dP+ c(k)                                      of (4.5)
// with db = v x* dM v, and base to tips
//   dl+(k) = phi' dl-(parent)                                                    of (4.10)
//   da(k)  = de+ - dg'l+ - g'dl+                                                 of (4.9)
//   dl-(k) = dl+ + H'da                                                          of (4.11)
//
// A reference: the recursions of the paper, differentiated line by line. Fits take whole Jacobians,
// which cost less than one direction a parameter; those of a and log D are tested against this.
#pragma once

#include <vector>

#include "algorithms/study/derivatives/inertial_parameters.hpp"
#include "algorithms/study/inverse_mass/sweeps.hpp"

namespace kalmarm {

// A direction, or a gradient.
template <class T>
struct ParameterVector {
  std::vector<InertialVector<T>> theta;  // of every link
  VectorX<T> r, tau;                     // nv values each

  explicit ParameterVector(const Model<T>& model)
      : theta(model.nv(), InertialVector<T>::Zero()),
        r(VectorX<T>::Zero(model.nv())),
        tau(VectorX<T>::Zero(model.nv())) {}
};

template <class T>
struct FactorDirection {
  std::vector<Matrix6<T>> dP_minus, dP_plus;
  std::vector<Vector6<T>> dg, dz_minus, dz_plus, dl_plus, dl_minus;
  VectorX<T> dD, de_minus, de_plus, da;

  explicit FactorDirection(const Model<T>& model)
      : dP_minus(model.nv()),
        dP_plus(model.nv()),
        dg(model.nv()),
        dz_minus(model.nv()),
        dz_plus(model.nv()),
        dl_plus(model.nv()),
        dl_minus(model.nv()),
        dD(model.nv()),
        de_minus(model.nv()),
        de_plus(model.nv()),
        da(model.nv()) {}
};

// l+(k) from l-(k), which is what a sweep leaves.
template <class T>
Vector6<T> l_plus(const Model<T>& model, const Sweeps<T>& sweeps, const VectorX<T>& a, int k) {
  Vector6<T> l = sweeps.l[k];
  l[model.joint(k).axis()] -= a[k];
  return l;
}

// All of ws along `direction`, from the gains of the same state and the sweeps that gave a (nv
// values). About 900 flops a link.
template <class T>
void factor_direction(const Model<T>& model, const LinkKinematics<T>& kin, const Gains<T>& gains,
                      const Sweeps<T>& sweeps, const VectorX<T>& a,
                      const ParameterVector<T>& direction, FactorDirection<T>& ws) {
  for (int k = 0; k < model.nv(); ++k) {
    const SpatialInertia<T> dM = spatial_inertia<T>(direction.theta[k]);
    ws.dP_minus[k] = dM.matrix();
    ws.dz_minus[k] = cross_force(kin.v[k], Vector6<T>(dM * kin.v[k]));
  }
  for (int k = model.nv() - 1; k >= 0; --k) {
    const int h = model.joint(k).axis(), parent = model.parent(k);
    const T &D = gains.D[k], &e_plus = sweeps.e[k], &dr = direction.r[k];
    const Vector6<T>& g = gains.g[k];
    const Vector6<T> u = ws.dP_minus[k].col(h);
    const T dD = u[h] + dr;
    ws.dD[k] = dD;
    ws.dg[k] = (u - g * dD) / D;  // (I - gH) u = u - g H u
    ws.de_minus[k] = direction.tau[k] - ws.dz_minus[k][h];
    ws.de_plus[k] = (ws.de_minus[k] - e_plus * dD) / D;
    const Vector6<T> x = u - g * (dD / T(2));
    ws.dP_plus[k] = ws.dP_minus[k] - x * g.transpose() - g * x.transpose();
    ws.dz_plus[k] =
        ws.dz_minus[k] + ws.dg[k] * (D * e_plus) + g * ws.de_minus[k] + ws.dP_plus[k] * kin.c[k];
    if (parent < 0) continue;
    ws.dP_minus[parent] += kin.phi[k].congruence(ws.dP_plus[k]);
    ws.dz_minus[parent] += kin.phi[k].force_to_parent(ws.dz_plus[k]);
  }
  for (int k = 0; k < model.nv(); ++k) {
    const int h = model.joint(k).axis(), parent = model.parent(k);
    Vector6<T>& dl = ws.dl_plus[k];
    if (parent < 0)
      dl.setZero();
    else
      dl = kin.phi[k].motion_from_parent(ws.dl_minus[parent]);
    ws.da[k] = ws.de_plus[k] - ws.dg[k].dot(l_plus(model, sweeps, a, k)) - gains.g[k].dot(dl);
    ws.dl_minus[k] = dl;
    ws.dl_minus[k][h] += ws.da[k];
  }
}

}  // namespace kalmarm
