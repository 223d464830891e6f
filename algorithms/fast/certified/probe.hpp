// How wrong are factors of M, or M^-1 itself? A probe is one torque s whose answer y ~ M^-1 s is
// judged by the residual in twice the precision:
//   r = s - M y,   d = M^^-1 r ~ M^-1 s - y                                                (1)
//   s(k) = z(k) sqrt(D(k)),   z(k) = +-(0.5 to 1.5), drawn once                             (2)
//   error = sqrt(sum of D d^2 / sum of D y^2)                                                (3)
// With E the error of D^1/2 M^-1 D^1/2, that is of M^-1 in units in which every D is 1, (3) is
// |E z| / |D^1/2 y|: of random signs its square has the mean |E|^2 in Frobenius' norm, so that a
// large error shows unless it happens to be orthogonal to z. M^ has to be right to a digit for d to
// be: the sweep's margin says so.
#pragma once

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "algorithms/fast/certified/residual.hpp"
#include "algorithms/fast/factors/solve.hpp"

namespace kalmarm {

// C: in what the residual is carried.
template <class C>
class Probe {
 public:
  using Model = typename TwiceResidual<double, C>::Model;

  Probe(const LoweredModel<double>& model, const Model& wide)
      : residual_(wide), z_(model.nv()), s_(model.nv()), y_(model.nv()), r_(model.nv()), d_(z_) {
    std::mt19937_64 random;
    for (double& z : z_) {
      const double size = 0.5 + static_cast<double>(random()) * 0x1p-64;
      z = random() % 2 ? size : -size;
    }
  }

  // (2) of the factors' D, at q.
  void set(const Model& wide, const FastFactors<double>& factors, const double* q) {
    for (std::size_t k = 0; k < z_.size(); ++k)
      s_[k] = z_[k] / std::sqrt(factors.links[k].inverse_D);
    residual_.set_mass(wide, q);
    residual_.set_torque(s_.data());
  }

  // (3), where answer(s, y) writes y. NaN where anything is not finite.
  template <class Answer>
  double error(const LoweredModel<double>& model, const Model& wide,
               const FastFactors<double>& factors, FactorSolver<double>& solver,
               const Answer& answer) {
    answer(s_.data(), y_.data());
    residual_.of(wide, y_.data(), nullptr, r_.data());
    solver.solve(model, factors, 1, r_.data(), d_.data());
    double dd = 0, yy = 0;
    for (int k = 0; k < model.nv(); ++k) {
      dd += d_[k] * d_[k] / factors.links[k].inverse_D;
      yy += y_[k] * y_[k] / factors.links[k].inverse_D;
    }
    return model.nv() == 0 ? 0 : std::sqrt(dd / yy);
  }

  // Of the mass equation at the q of `set`.
  TwiceResidual<double, C>& residual() { return residual_; }

 private:
  TwiceResidual<double, C> residual_;
  std::vector<double> z_, s_, y_, r_, d_;
};

}  // namespace kalmarm
