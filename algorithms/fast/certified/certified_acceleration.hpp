// Accelerations whose error is known: forward dynamics by the conventional form (4.2) to (4.11),
// refined by its own factors (refine.hpp), judged by the residual in twice the precision; where
// these do not help, by a sweep in a wider precision.
//
// A sweep of which some D may be lost in rounding (its margin, and then rounding_bound.hpp) is
// not refined by its own factors: along a direction in which they are too stiff by orders of
// magnitude the residual shows as little as they do. Then two numbers for one answer
// (wide_acceleration.hpp); what these cannot tell from singular is refused.
//
// The residual is rounded too, in pairs, of roundoff u2. Where a first step is enough (refine.hpp), the
// sweep was right to sqrt(u) / 20, and that does not show. Else, by (10) of force_noise.hpp,
//   |da|_M / |a|_M <= b u2 sqrt((N + E) / |a|_s^2)                                        (1)
// of which claimed_share_of_residuals counts in the error where (1) is above enough_of_residuals u
// (test_certified.cpp, EquilibriumIsRefinedNotRefused).
//
// Constants of the robot are right to u2 beside the largest of their kind, and sweep and residual share
// them: gravity along a slide that is all but level is right to a few u. A force of u2 m g on every body is
//   |da|^2 <= T (c u2)^2 G,  G = |gravity|^2 sum of m(k),  T: (3) of least_inertia.hpp        (2)
// which counts in every error, c = roundings_of_constants: for want of it a search found an error of 8 u where
// less than 1 u was told. Where (2) is above little_share u, T is (4) of force_noise.hpp.
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "algorithms/fast/certified/bounded_solve.hpp"
#include "algorithms/fast/certified/refine.hpp"
#include "algorithms/fast/certified/wide_acceleration.hpp"
#include "algorithms/fast/engine/forms.hpp"
#include "algorithms/fast/engine/instances.hpp"
#include "algorithms/model/plain.hpp"

namespace kalmarm {

// A robot's models, shared by all that certifies; `lowered` is kept by reference.
struct CertifiedModels {
  const LoweredModel<double>& lowered;
  LoweredModel<Pair<double>> twice;
  RobotModel robot;

  CertifiedModels(const LoweredModel<double>& in_double, const RobotModel& of_robot)
      : lowered(in_double), twice(model_of(of_robot).cast<Pair<double>>()), robot(of_robot) {}
};

// A sweep of the conventional form and its refinement, for one state or one in every lane.
template <class T>
class CertifiedSweep {
 public:
  explicit CertifiedSweep(const CertifiedModels& models)
      : sweep_(models.lowered),
        solve_(models.lowered),
        residual_(models.twice),
        refiner_(models.lowered.nv(), std::hypot(models.robot.gravity[0], models.robot.gravity[1],
                                                 models.robot.gravity[2])),
        second_(models.lowered),
        forces_(models.lowered) {}

  // a (nv) of the first `states` lanes. Where out[i] is not settled, or is not trusted, it is not to
  // be used.
  void acceleration(const CertifiedModels& models, const T* q, const T* qd, const T* tau,
                    int states, T* a, Verdict* out) {
    covariance_acceleration(models.lowered, q, qd, tau, sweep_, a);
    residual_.set_motion(models.twice, q, qd, tau);
    refiner_.refine(models.twice, residual_, solve_.on(models.lowered, sweep_), states, a, out);
    for (int i = 0; i < states; ++i) {
      if (out[i].settled && out[i].steps > 1) add_rounding_of_residual(models, a, i, out[i]);
      if (out[i].settled) add_rounding_of_constants(models, i, out[i]);
    }
  }

  // Whether no D of the last call is lost in rounding, in a lane whose position is q (nq).
  bool trusted(const CertifiedModels& models, const double* q, int lane = 0) {
    return detail::number(sweep_.margin, lane) > 0 ||
           second_.look(models.lowered, q).bound < error_of_D_to_refine;
  }

 private:
  // (1), with N by (2) of force_noise.hpp, or where that is coarse by (3) and (4) there.
  void add_rounding_of_residual(const CertifiedModels& models, const T* a, int lane, Verdict& out) {
    const double u2 = roundoff_of_pairs, unit = models.lowered.rounding_unit();
    const double limit = enough_of_residuals * unit_roundoff<double>();
    const double energy = unit * detail::number(sweep_.energy, lane);
    const int nv = models.lowered.nv();
    const auto size = [&](const auto& scale) {
      double sum = 0;
      for (int k = 0; k < nv; ++k) sum += scale(k) * square(detail::number(a[k], lane));
      return sum;
    };
    const auto of = [&](double noise, double squares) {
      return rounding_constant_of_error * u2 * std::sqrt(noise / (unit * squares));
    };
    double error = of(detail::number(sweep_.noise, lane) + energy,
                      size([&](int k) { return models.lowered.least_inertias()[k]; }));
    if (error <= limit) return;
    if constexpr (Lanes<T>::count == 1) {
      forces_.trace(models.lowered, sweep_);
      const double squares = size([&](int k) { return 1 / forces_.variance(k); });
      const double little = square(limit / u2) * little_share * unit * squares;
      double noise = energy;
      forces_.begin();
      for (int k = nv - 1; k >= 0; --k)
        noise += forces_.charge(models.lowered, sweep_, k, sweep_.z[k], little);
      error = std::min(error, of(noise, squares));
      if (error <= limit) return;
    }
    out.settled = Lanes<T>::count == 1 && std::isfinite(error);
    out.error += claimed_share_of_residuals * error;
  }

  // (2)
  void add_rounding_of_constants(const CertifiedModels& models, int lane, Verdict& out) {
    const double energy = models.lowered.energy_of_gravity();
    if (!(energy > 0)) return;
    const auto of = [&](double trace) {
      return roundings_of_constants * roundoff_of_pairs * std::sqrt(trace * energy) / out.size;
    };
    double error = of(models.lowered.largest_variance());
    if (!(error <= little_share * unit_roundoff<double>()))
      error = of(detail::number(forces_.trace(models.lowered, sweep_), lane));
    out.error += error;
  }

  static double square(double x) { return x * x; }

  CovarianceWorkspace<T> sweep_;
  BoundedSolve<T> solve_;
  TwiceResidual<T> residual_;
  Refiner<T> refiner_;
  RoundingBound<double> second_;
  ForceNoise<T> forces_;
};

inline Outcome outcome_of(const Verdict& refined) {
  Outcome out;
  out.rung = Outcome::Rung::refined;
  out.error = refined.error;
  out.steps = refined.steps;
  return out;
}

class CertifiedAcceleration {
 public:
  explicit CertifiedAcceleration(const CertifiedModels& models)
      : sweep_(models), wide_(models.robot) {}

  // a (nv).
  Outcome acceleration(const CertifiedModels& models, const double* q, const double* qd,
                       const double* tau, double* a) {
    Verdict refined;
    sweep_.acceleration(models, q, qd, tau, 1, a, &refined);
    return refined.settled && sweep_.trusted(models, q) ? outcome_of(refined)
                                                        : last_resort(models, q, qd, tau, a);
  }

  // The same in two doubles, with joint noise r (nv) where it is given (WideAcceleration).
  Outcome last_resort(const CertifiedModels& models, const double* q, const double* qd,
                      const double* tau, double* a, const double* r = nullptr) {
    const int nq = models.lowered.nq(), nv = models.lowered.nv();
    if (!all_finite(nq, q) || !all_finite(nv, qd) || !all_finite(nv, tau))
      return {.status = Outcome::Status::not_finite};
    Outcome out = wide_.acceleration(q, qd, tau, a, r);
    out.rung = Outcome::Rung::two_doubles;
    return out;
  }

 private:
  CertifiedSweep<double> sweep_;
  WideAcceleration wide_;
};

}  // namespace kalmarm
