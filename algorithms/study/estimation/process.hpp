// The paper's state space model in its own generality: any phi, H and covariance, on a tree.
//
//   z-(k)  = sum over children c of phi(k,c) z+(c) + w(k)         (1.1), summed for a tree
//   z+(k)  = z-(k)                                                (1.2)
//   E w(k) = b(k),  cov w(k) = M(k) = W(k) W'(k)                  (1.3)
//   tau(k) = H(k) z+(k) + noise of variance r(k)                  (1.4), with joint noise
//
// A robot in a state is one such process (link_kinematics.hpp). The paper's b(k) is all that the link
// does at q'' = 0, gravity and velocity terms of the links before it included:
//   a0(k) = phi'(k) a0(parent) + c(k),  a0(base) = -gravity
//   b(k)  = M(k) a0(k) + v(k) x* M(k) v(k)
// Here phi, M and H are dense and nothing of their structure is used: these files are the paper to
// be read and checked. The library's kernels (riccati/, inverse_mass/) are the ones to compute
// with.
//
// The paper counts bodies from the tip, the code from the base: parent(k) < k. So the paper's
// causal, lower triangular operators are upper triangular here.
#pragma once

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <vector>

#include "algorithms/model/link_kinematics.hpp"

namespace kalmarm {

template <class T>
struct Process {
  std::vector<int> parent;      // < k; -1: the base
  std::vector<Matrix6<T>> phi;  // phi(parent,k)
  std::vector<Vector6<T>> H;    // H'(k)
  std::vector<Matrix6<T>> M, W;
  std::vector<Vector6<T>> b;
  std::vector<T> r;

  Process() = default;

  // Of a robot, after set_position and set_velocity.
  Process(const Model<T>& model, const LinkKinematics<T>& kin) {
    std::vector<Vector6<T>> a0;
    for (int k = 0; k < model.nv(); ++k) {
      const Joint<T>& joint = model.joint(k);
      const Vector6<T> inboard =
          joint.parent < 0 ? base_acceleration(model) : Vector6<T>(a0[joint.parent]);
      a0.push_back(kin.phi[k].motion_from_parent(inboard) + kin.c[k]);
      parent.push_back(joint.parent);
      phi.push_back(kin.phi[k].matrix());
      H.push_back(Vector6<T>::Unit(joint.axis()));
      M.push_back(model.M(k).matrix());
      W.push_back(model.W(k));
      b.push_back(model.M(k) * a0[k] + kin.b[k]);
      r.push_back(joint.r);
    }
  }

  int size() const { return static_cast<int>(parent.size()); }
};

// What makes a process meaningless, found before anything is computed with it.
struct [[nodiscard]] Flaw {
  enum class Kind {
    none,
    not_finite,
    not_symmetric,   // M(link) differs from its transpose
    indefinite,      // M(link) is no covariance: value is its lowest eigenvalue, scaled
    negative_noise,  // r(link) < 0
  };

  Kind kind = Kind::none;
  int link = -1;
  double value = 0;  // the asymmetry, the eigenvalue or the noise
  double scale = 0;  // what it was compared with, same unit

  explicit operator bool() const { return kind != Kind::none; }
};

inline const char* to_string(Flaw::Kind kind) {
  switch (kind) {
    case Flaw::Kind::none:
      return "none";
    case Flaw::Kind::not_finite:
      return "not_finite";
    case Flaw::Kind::not_symmetric:
      return "not_symmetric";
    case Flaw::Kind::indefinite:
      return "indefinite";
    case Flaw::Kind::negative_noise:
      return "negative_noise";
  }
  return "?";
}

// The first flaw, base to tips; none if the process is sound. Moments and masses have different
// units, so M(k) is scaled to unit diagonal before its eigenvalues are looked at. It may be
// semidefinite (a massless link, a point mass): down to -64 u, in T or in double, is rounding.
template <class T>
Flaw find_flaw(const Process<T>& process) {
  using std::isfinite;
  using std::sqrt;
  const T rounding = T(64) * unit_roundoff<T>();
  for (int k = 0; k < process.size(); ++k) {
    const Matrix6<T>& M = process.M[k];
    const T& r = process.r[k];
    if (!M.allFinite() || !process.phi[k].allFinite() || !process.H[k].allFinite() ||
        !process.b[k].allFinite() || !isfinite(r))
      return {Flaw::Kind::not_finite, k};
    if (r < T(0)) return {Flaw::Kind::negative_noise, k, static_cast<double>(r)};

    const T size = M.cwiseAbs().maxCoeff();
    const T asymmetry = (M - M.transpose()).cwiseAbs().maxCoeff();
    if (asymmetry > rounding * size)
      return {Flaw::Kind::not_symmetric, k, static_cast<double>(asymmetry),
              static_cast<double>(size)};

    Vector6<T> scale;  // 1 / sqrt(M_ii); a row without variance must be zero
    for (int i = 0; i < 6; ++i) {
      const T variance = M(i, i);
      const T entry = M.row(i).cwiseAbs().maxCoeff();
      if (variance < T(0) || (variance == T(0) && entry > T(0)))
        return {Flaw::Kind::indefinite, k, static_cast<double>(variance < T(0) ? variance : -entry),
                static_cast<double>(size)};
      scale[i] = variance == T(0) ? T(0) : T(1) / T(sqrt(variance));
    }
    const Matrix6<T> scaled = scale.asDiagonal() * M * scale.asDiagonal();
    const Matrix6<double> correlation = scaled.template cast<double>();
    const double smallest =
        Eigen::SelfAdjointEigenSolver<Matrix6<double>>(correlation, Eigen::EigenvaluesOnly)
            .eigenvalues()[0];
    if (smallest < -std::max(static_cast<double>(rounding), 64 * unit_roundoff<double>()))
      return {Flaw::Kind::indefinite, k, smallest, 1};
  }
  return {};
}

}  // namespace kalmarm
