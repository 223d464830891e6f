// Slides alone, in one to three dimensions: what moves does not turn, so that phi = 1 on forces,
// and M does not depend on q.
//
//   D = u'P-u + r,  g = P-u / D,  P+ = P- - g (P-u)',  P-(parent) += P+        (3.6), (3.10)
// with P 3 x 3 and u the slide's axis, in world axes: once a model, in a wider precision. A call is
//   e = tau - u'z-,  z-(parent) += z- + g e                                    (4.2), (4.4)
//   a = e / D - g'l+,  l- = l+ + u a                                           (4.9), (4.11)
// of 3-vectors: 25 flops a slide. There is no bias but weight, whose part of a is constant. Up to
// `few` slides M^-1 times tau has less to wait for: six take 26 ns, seven by sweeps 49 ns. More
// than a few would lose digits where the masses differ much.
//
// Rounding moves x = M^-1 tau + a0, a0 = by_weight, by about b u of its terms, of which the energy is
//   |dx|_M^2 <= (b u)^2 (sum over k of tau(k)^2 h(k) + sum over i of M(i,i) a0(i)^2),
//   h(k) = sum over i of M(i,i) X(i,k)^2,  X = M^-1                            (1)
// In sweeps the terms that tau(k) brings in have at most the energy X(k,k) <= h(k).
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "algorithms/fast/claims/claims.hpp"
#include "algorithms/fast/claims/constants.hpp"
#include "algorithms/model/model.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

// Nothing turns.
template <class T>
bool is_translational(const Model<T>& model) {
  for (int k = 0; k < model.nv(); ++k)
    if (model.joint(k).coordinate != Coordinate::distance) return false;
  return true;
}

// One slide of the tree, and the mass that it carries without another slide between.
template <class W>
struct Slide {
  int parent;
  Vector3<W> axis;  // a unit vector
  W r, mass = W(0);
};

// Down to which D over the masses that it is made of rounding in W, in which factors are worked out once and
// for all, does not show in an answer: of slides that are nearly coplanar one is rounded by u(W) size / D, and
// then the next by size / D times as much. A search found accelerations wrong by 2e-6 at 6e-8.
template <class W>
W sure_D_over_size(double tolerance) {
  using std::sqrt;
  const W accepted = W(accepted_error(std::min(tolerance, default_tolerance<double>)));
  return W(sqrt(W(rounding_constant_of_P) * unit_roundoff<W>() / accepted));
}

template <class T>
class TranslationalFactors {
 public:
  static constexpr int few = 6;

  // threshold: a D below threshold times the masses it is made of is no sure one.
  template <class W>
  TranslationalFactors(const std::vector<Slide<W>>& slides, const Vector3<W>& gravity,
                       const W& threshold)
      : links_(slides.size()),
        inverse_(slides.size(), slides.size()),
        by_weight_(slides.size()),
        energies_(slides.size()) {
    using std::log;
    const int n = nv();
    Swept<W> swept{slides, std::vector<W>(n), std::vector<Vector3<W>>(n)};
    std::vector<Matrix3<W>> P(n);
    std::vector<W> size(n);  // of the terms of P
    VectorX<W> M(n);         // its diagonal
    W log_det(0);
    for (int k = 0; k < n; ++k) {
      P[k] = slides[k].mass * Matrix3<W>::Identity();
      size[k] = W(3) * slides[k].mass + slides[k].r;
      M[k] = slides[k].mass;
    }
    for (int k = n - 1; k >= 0; --k) {
      const Vector3<W> Pu = P[k] * slides[k].axis;
      const W D = slides[k].axis.dot(Pu) + slides[k].r;
      suspect_ = suspect_ || !(D > threshold * size[k]);
      const Vector3<W> g = Pu / D;
      if (slides[k].parent >= 0) {
        P[slides[k].parent] += P[k] - g * Pu.transpose();
        size[slides[k].parent] += P[k].trace();
        M[slides[k].parent] += M[k];
      }
      log_det += log(D);
      swept.D[k] = D;
      swept.g[k] = g;
      links_[k].parent = slides[k].parent;
      links_[k].inverse_D = T(W(1) / D);
      links_[k].u = slides[k].axis.template cast<T>();
      links_[k].g = g.template cast<T>();
    }
    log_det_ = T(log_det);
    for (int k = 0; k < n; ++k) M[k] += slides[k].r;
    VectorX<W> x(n);
    for (int j = 0; j < n; ++j) {
      swept.solve(VectorX<W>(VectorX<W>::Unit(n, j)), Vector3<W>(Vector3<W>::Zero()), x);
      for (int k = 0; k <= j; ++k) inverse_(k, j) = inverse_(j, k) = T(x[k]);
      energies_[j] = T(x.cwiseAbs2().dot(M));
    }
    swept.solve(VectorX<W>(VectorX<W>::Zero(n)), Vector3<W>(-gravity), x);
    by_weight_ = x.template cast<T>();
    energy_by_weight_ = T(x.cwiseAbs2().dot(M));
  }

  int nv() const { return static_cast<int>(links_.size()); }
  bool suspect() const { return suspect_; }
  const T& log_det() const { return log_det_; }
  const MatrixX<T>& inverse() const { return inverse_; }
  const VectorX<T>& by_weight() const { return by_weight_; }  // a where tau is 0

  // Of (1), over (b u)^2: of M^-1 tau, tau(k) of slide k, and of a0.
  template <class Tau>
  T energy(const Tau& tau) const {
    T sum = T(0);
    for (int k = 0; k < nv(); ++k) {
      const T force = tau(k);
      sum += energies_[k] * (force * force);
    }
    return sum;
  }
  const T& energy_by_weight() const { return energy_by_weight_; }

  // write(k, x) of x = M^-1 tau.
  template <class Tau, class Write>
  KALMARM_INLINE void solve(const Tau& tau, const Write& write) {
    const int n = nv();
    if (n <= few) {
      T x[few] = {};
      for (int k = 0; k < n; ++k) {
        const T force = tau(k);
        for (int i = 0; i < n; ++i) x[i] += inverse_(i, k) * force;
      }
      for (int k = 0; k < n; ++k) write(k, x[k]);
      return;
    }
    for (Link& link : links_) link.z.setZero();
    for (int k = n - 1; k >= 0; --k) {
      Link& link = links_[k];
      link.e = tau(k) - link.u.dot(link.z);
      if (link.parent >= 0) links_[link.parent].z += link.z + link.g * link.e;
    }
    for (int k = 0; k < n; ++k) {
      Link& link = links_[k];
      if (link.parent >= 0)
        link.l = links_[link.parent].l;
      else
        link.l.setZero();
      const T a = link.e * link.inverse_D - link.g.dot(link.l);
      link.l += link.u * a;
      write(k, a);
    }
  }

 private:
  struct Link {
    int parent;
    T inverse_D;
    Vector3<T> u, g, z, l;
    T e;
  };

  // The same sweeps in the wider precision.
  template <class W>
  struct Swept {
    const std::vector<Slide<W>>& slides;
    std::vector<W> D;
    std::vector<Vector3<W>> g;

    void solve(const VectorX<W>& tau, const Vector3<W>& a0, VectorX<W>& x) const {
      const int n = static_cast<int>(slides.size());
      std::vector<Vector3<W>> z(n, Vector3<W>::Zero()), l(n);
      for (int k = n - 1; k >= 0; --k) {
        x[k] = tau[k] - slides[k].axis.dot(z[k]);
        if (slides[k].parent >= 0) z[slides[k].parent] += z[k] + g[k] * x[k];
      }
      for (int k = 0; k < n; ++k) {
        l[k] = slides[k].parent < 0 ? a0 : l[slides[k].parent];
        x[k] = x[k] / D[k] - g[k].dot(l[k]);
        l[k] += slides[k].axis * x[k];
      }
    }
  };

  std::vector<Link> links_;
  MatrixX<T> inverse_;
  VectorX<T> by_weight_;
  VectorX<T> energies_;  // h
  T energy_by_weight_ = T(0), log_det_ = T(0);
  bool suspect_ = false;
};

}  // namespace kalmarm
