// The filter's factors of the mass matrix, M = (I + K) D (I + K*): D(k) and g(k) of every joint,
// from any covariance update. Tips to base:
//   P-(k) = M(k) + sum over children c of phi(k,c) P+(c) phi'(k,c)       (3.6)
//   D, g, P+ of k                                                        by Update: (3.6), (3.10)
//
// Is D(k) zero? A covariance form computes it with an absolute error of u times what was subtracted
// to reach it, a square-root form with u^2 times that. What was subtracted, and how much of the
// rounding of it the filter has forgotten since, is the recursion
//   S-(k) = M(k) + sum over children c of phi(k,c) S+(c) phi'(k,c)
//   S+(k) = (I - gH) S- (I - gH)' + P-,      scale(k) = H S- H' + r
// and the mechanism is called singular where D(k) <= 32 u^resolution scale(k). D(k) against the
// composite inertia M(k,k) alone would call every long chain singular: stretched out, D/M(k,k)
// falls as N^-3 although D is known to all digits. S costs as much as a sweep, so it is worked out
// only if some D(k) <= 32 u^resolution J(k), where
//   J(k) = J_body + sum over children c of J(c) + 2 p'R h(c) + m(c) p'p
//   h(k) = h_body + sum over children c of R h(c) + m(c) p               30 flops a link
// is the polar moment of the whole outboard side about the joint's origin, or its mass for a
// sliding joint.
#pragma once

#include <vector>

#include "algorithms/model/random_model.hpp"
#include "algorithms/outcome.hpp"
#include "algorithms/riccati/covariance_update.hpp"

namespace kalmarm {

template <class T>
struct PolarMoment {
  T m = T(0), J = T(0);
  Vector3<T> h = Vector3<T>::Zero();
};

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
        P(model.nv()),
        S(model.nv()) {
    for (int k = 0; k < model.nv(); ++k) {
      const RigidBody<T>& body = model.joint(k).body;
      body_polar.push_back({body.mass,
                            body.mass * body.com.squaredNorm() + body.moments.sum() / T(2),
                            body.mass * body.com});
    }
  }
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
    ws.P[joint.parent] += rm.phi[k].congruence(ws.P[k]);
    ws.S[joint.parent] += rm.phi[k].congruence(ws.S[k]);
  }
  return {};
}

// D and g of every joint. On failure the outcome names the joint, and ws is not to be used.
template <class T, class Update>
Outcome factor(const Model<T>& model, const RandomModel<T>& rm, Factors<T, Update>& ws) {
  T resolution = T(32);
  for (int i = 0; i < Update::resolution; ++i) resolution *= unit_roundoff<T>();

  bool suspect = false;
  ws.polar = ws.body_polar;
  Update::start(model, ws.update);
  for (int k = model.nv() - 1; k >= 0; --k) {
    const Joint<T>& joint = model.joint(k);
    const PolarMoment<T>& polar = ws.polar[k];
    ws.D[k] = Update::measure(model, k, ws.update, ws.g[k]);
    suspect = suspect || !(ws.D[k] > resolution * ((joint.slides ? polar.m : polar.J) + joint.r));
    if (!(ws.D[k] > T(0))) return check_singular(model, rm, k, resolution, ws);
    if (joint.parent < 0) continue;
    const Transform<T>& phi = rm.phi[k];
    Update::propagate(model, k, phi, ws.update);

    PolarMoment<T>& outboard = ws.polar[joint.parent];
    const Vector3<T> Rh = phi.R * polar.h;
    outboard.m += polar.m;
    outboard.h += Rh + polar.m * phi.p;
    outboard.J += polar.J + T(2) * phi.p.dot(Rh) + polar.m * phi.p.squaredNorm();
  }
  return suspect ? check_singular(model, rm, 0, resolution, ws) : Outcome{};
}

}  // namespace kalmarm
