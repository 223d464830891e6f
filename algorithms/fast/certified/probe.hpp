// How wrong are factors of M, or M^-1 itself? Probes are torques s whose answers y are judged by the
// residual in twice the precision:
//   r = s - M y,   d = M^^-1 r ~ M^-1 s - y                                                (1)
// a probe in every lane, of numbers z(k) = +-(0.5 to 1.5) that are drawn once, of mean square 13/12.
//
// Factors are judged in their own coordinates, innovations over their deviations: with
// M = B (1 + E) B', B = (I + K) D^1/2 of the factors,
//   s = B z,  y = M^^-1 s:   |d|_M = |E z|,  mean of |E z|^2 ~ |E|^2 in Frobenius' norm       (2)
// but for what rounding does to y, which counts too. M, by which all that is made of factors is
// right, is then within 1 +- |E| in the order of positive semidefinite matrices:
//   |error of M^-1(i,j)| <= |E| sqrt(M^-1(i,i) M^-1(j,j)),   |error of log det M| <= sqrt(nv) |E|  (3)
// X ~ M^-1 is judged entry by entry:
//   s(j) = z(j) / sqrt(X(j,j)),  y = X s:   mean of d(i)^2 / X(i,i) ~ sum over j of
//   (error of X(i,j))^2 / (X(i,i) X(j,j)),                                                 (4)
// of which the largest over i and probes is told, and eps |d|_M more, by which the factors whose D
// are right to eps can be wrong about d. Eight probes are orthogonal to an error at once, to a
// quarter, for about one drawing in 10^5.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "algorithms/fast/certified/residual.hpp"
#include "algorithms/fast/engine/instances.hpp"
#include "algorithms/fast/factors/columns.hpp"

namespace kalmarm {

class Probes {
 public:
  using Lane = StateLanes<double>;
  using Residual = TwiceResidual<Lane>;
  using Model = typename Residual::Model;

  Probes(const LoweredModel<double>& model, const Model& wide)
      : residual_(wide),
        columns_(model),
        all_(model.nv(), 1),
        q_(model.nq()),
        z_(model.nv()),
        s_(z_),
        y_(z_),
        r_(z_),
        scale_(model.nv()) {
    std::mt19937_64 random;
    for (Lane& lane : z_) {
      std::array<double, Lanes<Lane>::count> z;
      for (double& one : z) {
        const double size = 0.5 + static_cast<double>(random()) * 0x1p-64;
        one = random() % 2 ? size : -size;
      }
      lane = Lane::load(z.data());
    }
  }

  void set_position(const Model& wide, const double* q) {
    std::transform(q, q + q_.size(), q_.begin(), [](double x) { return Lane(x); });
    residual_.set_mass(wide, q_.data());
  }

  // |E| of (2), of factors at the position that was set. NaN where anything is not finite.
  double of_factors(const LoweredModel<double>& model, const Model& wide,
                    const FastFactors<double>& factors) {
    Lane own = Lane(0.0);
    inward(
        model, factors,
        [&](int k) {
          return s_[k] = own + z_[k] * Lane(1 / std::sqrt(factors.links[k].inverse_D));
        },
        Innovation{model, own});
    inward(
        model, factors, [&](int k) { return s_[k]; }, detail::Unobserved{});
    outward(model, factors, [&](int k, const Lane& y) { y_[k] = y; });
    return std::sqrt(largest(energy(model, wide, factors)));
  }

  // The largest error by (4) of X (nv x nv), where error_of_D is eps. NaN where anything is not
  // finite.
  double of_matrix(const LoweredModel<double>& model, const Model& wide,
                   const FastFactors<double>& factors, const double* X, double error_of_D) {
    const std::ptrdiff_t nv = model.nv();
    for (int k = 0; k < nv; ++k) {
      scale_[k] = 1 / std::sqrt(X[k * nv + k]);
      s_[k] = z_[k] * Lane(scale_[k]);
      y_[k] = Lane(0.0);
    }
    for (int j = 0; j < nv; ++j)
      for (int i = 0; i < nv; ++i) y_[i] += Lane(X[i + j * nv]) * s_[j];
    const Lane of_D = energy(model, wide, factors);
    Lane worst = Lane(0.0), nothing = worst;
    outward(model, factors, [&](int k, const Lane& d) {
      const Lane scaled = d * Lane(scale_[k]);
      worst = -min(Lane(-worst), Lane(-scaled * scaled));
      nothing += scaled * Lane(0.0);
    });
    return std::sqrt(largest(worst + nothing)) + error_of_D * std::sqrt(largest(of_D));
  }

 private:
  // H z- of the link that is reached.
  struct Innovation : detail::Unobserved {
    const LoweredModel<double>& model;
    Lane& own;

    Innovation(const LoweredModel<double>& of, Lane& to) : model(of), own(to) {}
    void gathered(int k, const Sixfold<Lane>& z) const { own = model.link(k).slides ? z.w : z.z; }
  };

  struct Energy : detail::Unobserved {
    const FastFactors<double>& factors;
    Lane& sum;

    Energy(const FastFactors<double>& of, Lane& to) : factors(of), sum(to) {}
    void measured(int k, const Lane& e) const { sum += e * e * Lane(factors.links[k].inverse_D); }
  };

  template <class Tau, class Observer>
  void inward(const LoweredModel<double>& model, const FastFactors<double>& factors, const Tau& tau,
              const Observer& observer) {
    detail::sweep_inward(model, factors, model.nv() - 1, all_.data(), tau, columns_, observer);
  }
  template <class Write>
  void outward(const LoweredModel<double>& model, const FastFactors<double>& factors,
               const Write& write) {
    detail::sweep_outward(model, factors, model.nv() - 1, columns_, write);
  }

  // |d|_M^2 of (1), after the inward sweep of r.
  Lane energy(const LoweredModel<double>& model, const Model& wide,
              const FastFactors<double>& factors) {
    residual_.set_torque(s_.data());
    residual_.of(wide, y_.data(), nullptr, r_.data());
    Lane sum = Lane(0.0);
    inward(
        model, factors, [&](int k) { return r_[k]; }, Energy{factors, sum});
    return sum;
  }

  // NaN where one is.
  static double largest(const Lane& x) {
    double most = 0, nothing = 0;
    for (int i = 0; i < Lanes<Lane>::count; ++i) {
      most = std::max(most, x[i]);
      nothing += x[i] * 0;
    }
    return most + nothing;
  }

  Residual residual_;
  ColumnsWorkspace<Lane> columns_;
  std::vector<char> all_;  // links: a path for any torque
  std::vector<Lane> q_, z_, s_, y_, r_;
  std::vector<double> scale_;
};

}  // namespace kalmarm
