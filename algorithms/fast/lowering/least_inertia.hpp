// The least inertia mu(k) that joint k meets, in any position and whatever the other joints do: the
// scale in which an acceleration of that joint is large or small.
//
// 1 / M^-1(k,k) is twice the least kinetic energy of a robot whose joint k moves at unit rate.
// Without its joints a robot has no more of it, and of two bodies that are free the rate between
// them is a difference of independent motions:
//   M^-1(k,k) <= 1 / mu(k) = h' M(k)^-1 h + n' M(parent)^-1 n,   mu(k) >= r(k)             (1)
// with h, n the joint's axis in the frames of its two bodies: (z; 0) of a hinge, (0; z) of a slide
// and (p x z; z) on its parent. So the trace of M^-1 is at most the sum of 1 / mu, and
//   |a|_s^2 = sum over k of mu(k) a(k)^2                                                   (2)
// is |a|^2 in each joint's own scale. Energies of the two bodies add up likewise, by Cauchy's inequality,
//   a(k)^2 <= (|v|_M^2 + |v(parent)|_M(parent)^2) / mu(k),   or a(k)^2 = r(k) a(k)^2 / mu(k) of a rotor
// so that, with every body's energy counted once, Euclid's norm is the larger by at most
//   |a|^2 <= T |a|_M^2,   T = max over bodies of the sum of 1 / mu over the joints at it     (3)
// which is a few joints' 1 / mu however many there are. mu is 0 where (1) knows no bound: at a body that
// resists no motion about some axis, and where a free joint lets it go any distance from its parent.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <limits>
#include <vector>

#include "algorithms/fast/claims/arithmetic.hpp"
#include "algorithms/fast/lowering/lowered_link.hpp"

namespace kalmarm::detail {

// M^-1 of a body alone, about its link's origin; in a plane, of moments about z and forces along x
// and y alone, the others 0. Infinite where M is singular to ten digits or so.
template <class S>
Eigen::Matrix<double, 6, 6> free_covariance(const LoweredBody<S>& body, bool planar) {
  const double m(body.m), x(body.h[0]), y(body.h[1]), z(body.h[2]);
  Eigen::Matrix<double, 6, 6> M;
  M << double(body.Ixx), double(body.Ixy), double(body.Ixz), 0, -z, y,  //
      double(body.Ixy), double(body.Iyy), double(body.Iyz), z, 0, -x,   //
      double(body.Ixz), double(body.Iyz), double(body.Izz), -y, x, 0,   //
      0, z, -y, m, 0, 0,                                                //
      -z, 0, x, 0, m, 0,                                                //
      y, -x, 0, 0, 0, m;
  Eigen::Matrix<double, 6, 6> out = Eigen::Matrix<double, 6, 6>::Zero();
  const auto put = [&](const auto& part, int first) {
    const auto X = part.inverse().eval();
    const int n = static_cast<int>(X.rows());
    for (int i = 0; i < n; ++i)
      if (!(X(i, i) > 0 && X(i, i) * part(i, i) < largest_condition)) {
        out.fill(std::numeric_limits<double>::infinity());
        return;
      }
    out.block(first, first, n, n) = X;
  };
  if (planar)
    put(Eigen::Matrix3d(M.block<3, 3>(2, 2)), 2);
  else
    put(M, 0);
  return out;
}

// Of all links: in a plane are those whose joints up to the base have parallel axes.
template <class S>
std::vector<Eigen::Matrix<double, 6, 6>> free_covariances(
    const std::vector<LoweredLink<S>>& links, const std::vector<LoweredBody<S>>& bodies) {
  std::vector<Eigen::Matrix<double, 6, 6>> out;
  std::vector<char> planar(links.size());
  for (std::size_t k = 0; k < links.size(); ++k) {
    const LoweredLink<S>& link = links[k];
    planar[k] = link.kind == LoweredLink<S>::Kind::screws && !link.slides &&
                (link.parent < 0 || (planar[link.parent] && link.alpha.s == S(0)));
    out.push_back(free_covariance(bodies[k], planar[k]));
  }
  return out;
}

// The largest variance of a motion about, or along, any axis.
inline double largest(const Eigen::Matrix3d& block) {
  return block.allFinite() ? block.selfadjointView<Eigen::Lower>().eigenvalues().maxCoeff()
                           : std::numeric_limits<double>::infinity();
}

// mu of every joint (nv).
template <class S>
std::vector<S> least_inertias(const std::vector<LoweredLink<S>>& links,
                              const std::vector<LoweredBody<S>>& bodies,
                              const std::vector<LinkRun>& runs,
                              const std::vector<UncommonPlacement<S>>& uncommon,
                              const std::vector<Eigen::Matrix<double, 6, 6>>& covariances) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  // Of a joint on a screw: its axis is constant in both frames.
  const auto on_a_screw = [&](int k) {
    const LoweredLink<S>& link = links[k];
    const int own = link.slides ? 5 : 2;
    double variance = covariances[k](own, own);
    if (link.parent < 0) return variance;
    Eigen::Vector3d z(0, -double(link.alpha.s), double(link.alpha.c));
    if (link.turned) {
      const Turn<S>& theta = uncommon[link.uncommon].theta;
      z.head<2>() = Eigen::Vector2d(-double(theta.s) * z[1], double(theta.c) * z[1]);
    }
    Eigen::Matrix<double, 6, 1> n;
    if (link.slides)
      n << link.p.template cast<double>().cross(z), z;
    else
      n << z, Eigen::Vector3d::Zero();
    const auto& parent = covariances[link.parent];
    variance += parent.allFinite() ? n.dot(parent * n) : infinite;
    return variance;
  };
  // Of one axis of a ball or free joint, which turns with either body.
  const auto about_any_axis = [&](int body, const LoweredLink<S>& first, bool slides) {
    const double turning = largest(covariances[body].template topLeftCorner<3, 3>());
    if (slides)
      return first.parent < 0 ? largest(covariances[body].template bottomRightCorner<3, 3>())
                              : infinite;
    return turning + (first.parent < 0
                          ? 0
                          : largest(covariances[first.parent].template topLeftCorner<3, 3>()));
  };
  std::vector<S> out(links.size());
  for (const LinkRun& run : runs)
    for (int k = run.first; k <= run.last; ++k) {
      const bool screw = links[k].kind == LoweredLink<S>::Kind::screws;
      const double variance = run.at_once
                                  ? about_any_axis(run.last, links[run.first], links[k].slides)
                              : screw ? on_a_screw(k)
                                      : infinite;
      const double known = variance > 0 && variance < infinite ? 1 / variance : 0;
      out[k] = S(std::max(known, static_cast<double>(bodies[k].r)));
    }
  return out;
}

// T of (3), or the sum of all 1 / mu where that is less.
template <class S>
double largest_variance(const std::vector<LoweredLink<S>>& links,
                        const std::vector<LoweredBody<S>>& bodies, const std::vector<LinkRun>& runs,
                        const std::vector<S>& least_inertias) {
  std::vector<double> at(links.size(), 0);
  double sum = 0, most = 0;
  for (const LinkRun& run : runs)
    for (int k = run.first; k <= run.last; ++k) {
      const double mu(least_inertias[k]), variance = mu > 0 ? 1 / mu : no_body;
      sum += variance;
      most = std::max(most, variance);
      if (least_inertias[k] == bodies[k].r) continue;  // a rotor's
      at[run.at_once ? run.last : k] += variance;
      const int parent = links[run.at_once ? run.first : k].parent;
      if (parent >= 0) at[parent] += variance;
    }
  for (const double variance : at) most = std::max(most, variance);
  return std::min(sum, most);
}

}  // namespace kalmarm::detail
