// Accelerations whose error is known: forward dynamics by the conventional form (4.2) to (4.11),
// refined by its own factors (refine.hpp), judged by the residual in twice the precision; where the
// error is above what the tolerance asks, by a sweep in a wider precision.
//
// A sweep of which some D may be lost in rounding (its margin, and then rounding_bound.hpp) is
// not refined by its own factors: along a direction in which they are too stiff by orders of
// magnitude the residual shows as little as they do. Then two numbers for one answer
// (wide_acceleration.hpp); what these cannot tell from singular is refused.
//
// The residual is rounded too, in pairs, of roundoff u2, by (10) of force_noise.hpp, and constants of the robot
// are right to u2 beside the largest of their kind, which sweep and residual share: gravity along a slide that
// is all but level is right to a few u. A force of u2 m g on every body has the energy u2^2 G, so that
//   (c u2)^2 ((N + E) / |a|_s^2 + T G / |a|^2),  G = |gravity|^2 sum of m(k)               (1)
// is the square of what counts in every error: for want of G a search found an error of 8 u where less than
// 1 u was estimated.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "algorithms/fast/certified/bounded_solve.hpp"
#include "algorithms/fast/certified/refine.hpp"
#include "algorithms/fast/certified/wide_acceleration.hpp"
#include "algorithms/fast/claims/arithmetic.hpp"
#include "algorithms/fast/engine/engine.hpp"
#include "algorithms/fast/engine/forms.hpp"
#include "algorithms/fast/engine/instances.hpp"
#include "algorithms/model/plain.hpp"

namespace kalmarm {

// A robot's models, shared by all that certifies, and the tolerance; `lowered` is kept by reference.
struct CertifiedModels {
  const LoweredModel<double>& lowered;
  LoweredModel<Pair<double>> twice;
  RobotModel robot;
  double tolerance;
  CallFrames frames;

  CertifiedModels(const LoweredModel<double>& in_double, const RobotModel& of_robot,
                  const EngineOptions& options)
      : lowered(in_double),
        twice(model_of(of_robot).cast<Pair<double>>(), Zeros::left_out,
              accepted_error(default_tolerance<Pair<double>>), options.frames),
        robot(of_robot),
        tolerance(options.tolerance),
        frames(options.frames) {}
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
        bound_(models.lowered),
        q_(models.lowered.nq()),
        loads_(models.lowered.widths().l) {}

  // a (nv) of the first `states` lanes. Where out[i] is not settled, it is not to be used.
  void acceleration(const CertifiedModels& models, const T* q, const T* qd, const T* tau,
                    const Acting<T>& acting, int states, T* a, RefinedAnswer* out) {
    covariance_acceleration(models.lowered, q, qd, tau, sweep_, a, acting);
    refine(models, q, qd, tau, acting, sweep_, states, a, out);
  }

  // The same of a that a sweep has left.
  void refine(const CertifiedModels& models, const T* q, const T* qd, const T* tau,
              const Acting<T>& acting, const CovarianceWorkspace<T>& swept, int states, T* a,
              RefinedAnswer* out) {
    residual_.set_motion(models.twice, q, qd, tau, acting);
    std::array<double, Lanes<T>::count> errors{};
    for (int i = 0; i < states; ++i) errors[i] = error_of_D(models, swept, q, acting, i);
    const T eps = packed(errors);
    refiner_.refine(
        models.twice, residual_,
        [&](const T* r, T* d) { return solve_.solve(models.lowered, swept, eps, r, d); }, states, a,
        out);
    const AccelerationSums<T> sums = CovarianceForm::sums(swept);
    for (int i = 0; i < states; ++i) {
      out[i].error += rounding_of_residual(models, sums, i, out[i].size);
      out[i].settled = out[i].settled && errors[i] < largest_error_of_D &&
                       out[i].error <= accepted_error_refined(models.tolerance);
    }
  }

 private:
  static T packed(const std::array<double, Lanes<T>::count>& x) {
    if constexpr (Lanes<T>::count == 1)
      return x[0];
    else
      return T::load(x.data());
  }

  // In a lane.
  double error_of_D(const CertifiedModels& models, const CovarianceWorkspace<T>& swept, const T* q,
                    const Acting<T>& acting, int lane) {
    if (detail::number(swept.margin, lane) > 0) return models.lowered.error_of_D();
    const auto take = [lane](const T* from, std::vector<double>& to) {
      for (std::size_t i = 0; i < to.size(); ++i) to[i] = detail::number(from[i], lane);
      return to.data();
    };
    const Acting<double> loads{.loads = acting.loads ? take(acting.loads, loads_) : nullptr};
    return bound_.look(models.lowered, take(q, q_), loads).bound;
  }

  // The root of (1), beside |a|.
  static double rounding_of_residual(const CertifiedModels& models, const AccelerationSums<T>& sums,
                                     int lane, double size) {
    const double cu = rounding_constant * roundoff_of_pairs;
    const double trace =
        std::min<double>(detail::number(sums.trace, lane), models.lowered.largest_variance());
    const double forces = detail::number(sums.noise, lane) / models.lowered.rounding_unit() +
                          detail::number(sums.energy, lane);
    const double of_gravity = trace * models.lowered.energy_of_gravity();
    return cu * std::hypot(root_of_ratio(forces, detail::number(sums.size, lane)),
                           root_of_ratio(of_gravity, size * size));
  }

  CovarianceWorkspace<T> sweep_;
  BoundedSolve<T> solve_;
  TwiceResidual<T> residual_;
  Refiner<T> refiner_;
  RoundingBound<double> bound_;
  std::vector<double> q_, loads_;  // of a lane
};

inline Outcome outcome_of(const RefinedAnswer& refined) {
  Outcome out;
  out.rung = Outcome::Rung::refined;
  out.error = refined.error;
  out.steps = refined.steps;
  return out;
}

class CertifiedAcceleration {
 public:
  explicit CertifiedAcceleration(const CertifiedModels& models)
      : sweep_(models), wide_(models.robot, models.frames) {}

  // call.out = a (nv); swept: of a sweep that has been made, with its a, or null.
  Outcome acceleration(const CertifiedModels& models, const Call<double>& call,
                       const CovarianceWorkspace<double>* swept = nullptr) {
    const Acting<double> acting = forces_of(call);
    RefinedAnswer refined;
    if (swept)
      sweep_.refine(models, call.q, call.qd, call.tau, acting, *swept, 1, call.out, &refined);
    else
      sweep_.acceleration(models, call.q, call.qd, call.tau, acting, 1, call.out, &refined);
    return refined.settled ? outcome_of(refined) : last_resort(models, call);
  }

  // The same in two doubles, with joint noise where it is given (WideAcceleration).
  Outcome last_resort(const CertifiedModels& models, const Call<double>& call) {
    const Widths width = models.lowered.widths();
    if (!all_finite(width.nq, call.q) || !all_finite(width.nv, call.qd) ||
        !all_finite(width.nv, call.tau) || (call.forces && !all_finite(width.f, call.forces)) ||
        (call.loads && !all_finite(width.l, call.loads)) ||
        (call.gravity && !all_finite(numbers_of_gravity, call.gravity)))
      return {.status = Outcome::Status::not_finite};
    Outcome out = wide_.acceleration(call);
    out.rung = Outcome::Rung::two_doubles;
    return out;
  }

 private:
  CertifiedSweep<double> sweep_;
  WideAcceleration wide_;
};

}  // namespace kalmarm
