// The filter's factors of the mass matrix, M = (I + K) D (I + K*): D(k) and g(k) of every joint,
// from any covariance update. Tips to base:
//   P-(k) = M(k) + sum over children c of phi(k,c) P+(c) phi'(k,c)       (3.6)
//   D, g, P+ of k                                                        by Update: (3.6), (3.10)
//
// Is D(k) zero? A covariance form knows it to u times the size of what went into it, a square-root
// form to u^2 times that. The size of what went in, less what the filter has forgotten since, is
//   S-(k) = M(k) + sum over children c of phi(k,c) S+(c) phi'(k,c) + E(c)
//   S+(k) = (I - gH) S- (I - gH)' + P-                      P- is what the update subtracts from
//   E(c)  = diagonal of |phi| |P+(c)| |phi'|                 terms of phi P+ phi' before they
//   cancel scale(k) = H S- H' + r
// and the mechanism is called singular where D(k) <= (32 u)^resolution scale(k). D(k) against the
// composite inertia M(k,k) would not do: stretched out, D/M(k,k) falls as N^-3 in a chain although
// D is known to all digits. S costs more than a sweep, so it is worked out only if some D(k) is
// below net J(k), with the cheap J of polar_moment.hpp. J does not see errors that a nearly
// singular joint has blown up on the way, so the net is wide, sqrt((32 u)^resolution), but for
// covariance forms in float32: there it would catch every wrist, and is (32 u)^resolution itself.
#pragma once

#include <cmath>
#include <vector>

#include "algorithms/inverse_mass/polar_moment.hpp"
#include "algorithms/model/random_model.hpp"
#include "algorithms/outcome.hpp"
#include "algorithms/riccati/covariance_update.hpp"

namespace kalmarm {

template <class T, CovarianceUpdate<T> Update>
struct Factors {
  std::vector<T> D;
  std::vector<Vector6<T>> g;
  typename Update::template Workspace<T> update;
  std::vector<PolarMoment<T>> polar, body_polar;  // of the outboard side, of the link alone
  std::vector<Matrix6<T>> P, S;                   // of the singularity test

  explicit Factors(const Model<T>& model)
      : D(model.nv()),
        g(model.nv()),
        update(model),
        polar(model.nv()),
        body_polar(body_polar_moments(model)),
        P(model.nv()),
        S(model.nv()) {}
};

// The first joint, tips to base as far as `first`, whose D is lost in rounding: D <= resolution
// scale.
template <class T, class Update>
Outcome check_singular(const Model<T>& model, const RandomModel<T>& rm, int first,
                       const T& resolution, Factors<T, Update>& ws) {
  for (int k = 0; k < model.nv(); ++k) ws.P[k] = ws.S[k] = model.M(k).matrix();
  for (int k = model.nv() - 1; k >= first; --k) {
    const Joint<T>& joint = model.joint(k);
    const int h = joint.axis();
    const T scale = ws.S[k](h, h) + joint.r;
    if (!(ws.D[k] > resolution * scale)) {
      const bool lost = !(ws.D[k] >= -resolution * scale);
      return {lost ? Outcome::Status::indefinite : Outcome::Status::singular, k,
              static_cast<double>(ws.D[k]), static_cast<double>(scale)};
    }
    if (joint.parent < 0) continue;
    Matrix6<T> psi = Matrix6<T>::Identity();  // I - gH
    psi.col(h) -= ws.g[k];
    const Matrix6<T> P_minus = ws.P[k];
    ws.P[k] = psi * P_minus * psi.transpose() + joint.r * ws.g[k] * ws.g[k].transpose();
    ws.S[k] = psi * ws.S[k] * psi.transpose() + P_minus;
    const Transform<T>& phi = rm.phi[k];
    const Matrix6<T> phi_abs = phi.matrix().cwiseAbs();
    ws.P[joint.parent] += phi.congruence(ws.P[k]);
    ws.S[joint.parent] += phi.congruence(ws.S[k]);
    ws.S[joint.parent].diagonal() +=
        (phi_abs * ws.P[k].cwiseAbs() * phi_abs.transpose()).diagonal();
  }
  return {};
}

// D and g of every joint. On failure the outcome names the joint, and ws is not to be used.
template <class T, class Update>
Outcome factor(const Model<T>& model, const RandomModel<T>& rm, Factors<T, Update>& ws) {
  using std::sqrt;
  T resolution = T(1);
  for (int i = 0; i < Update::resolution; ++i) resolution *= T(32) * unit_roundoff<T>();

  const bool wide = Update::resolution > 1 || unit_roundoff<T>() < T(1e-10);
  const T net = wide ? T(sqrt(resolution)) : resolution;
  bool suspect = false;
  ws.polar = ws.body_polar;
  Update::start(model, ws.update);
  for (int k = model.nv() - 1; k >= 0; --k) {
    const Joint<T>& joint = model.joint(k);
    ws.D[k] = Update::measure(model, k, ws.update, ws.g[k]);
    suspect = suspect || !(ws.D[k] > net * ws.polar[k].size(joint));
    if (!(ws.D[k] > T(0))) {
      const Outcome outcome = check_singular(model, rm, k, resolution, ws);
      if (!outcome) return outcome;
      return {Outcome::Status::indefinite, k, static_cast<double>(ws.D[k]),
              static_cast<double>(ws.polar[k].size(joint))};
    }
    if (joint.parent < 0) continue;
    const Transform<T>& phi = rm.phi[k];
    Update::propagate(model, k, phi, ws.update);
    ws.polar[joint.parent].add_child(ws.polar[k], phi.p);
  }
  return suspect ? check_singular(model, rm, 0, resolution, ws) : Outcome{};
}

}  // namespace kalmarm
