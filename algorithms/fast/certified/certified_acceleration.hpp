// Accelerations whose error is known: forward dynamics by the conventional form (4.2) to (4.11),
// refined by its own factors (refine.hpp), judged by the residual in twice the precision; where
// these do not help, by a sweep in a wider precision.
//
// A sweep of which some D may be lost in rounding (its margin, and then the form's second look) is
// not refined by its own factors: along a direction in which they are too stiff by orders of
// magnitude the residual shows as little as they do. The square-root form's factors are not tried
// in between: a search found mechanisms on which they are too stiff without a sign of it. In float32
// what comes after the sweep's own factors is float64, certified; in float64 two numbers for one
// (wide_acceleration.hpp). What these cannot tell from singular is refused.
//
// The residual is rounded too, in float64 for float32 and in pairs, of roundoff u2, for
// float64. Where a first step is enough (refine.hpp), the sweep was right to sqrt(u) / 20, and that
// does not show. Else in float32 float64 answers: accelerations of joints that cancel within a heavy
// link were seen to spoil the residual by 240 u, which no sum of the sweep has. In float64, by (10)
// of force_noise.hpp,
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

// A robot's models, shared by all that certifies.
template <class S>
struct CertifiedModels {
  using Wide = typename detail::Carrier<S>::Scalar;

  const LoweredModel<S>& lowered;
  LoweredModel<Wide> twice;
  RobotModel robot;  // with parameters as S holds them

  CertifiedModels(const LoweredModel<S>& in_S, const Model<S>& model)
      : lowered(in_S),
        twice(model.template cast<Wide>()),
        robot(plain(model.template cast<double>())) {}
};

// A sweep of the conventional form and its refinement, for one state or one in every lane.
template <class T>
class CertifiedSweep {
 public:
  using S = typename Lanes<T>::Scalar;

  explicit CertifiedSweep(const CertifiedModels<S>& models)
      : sweep_(models.lowered),
        solve_(models.lowered),
        residual_(models.twice),
        refiner_(models.lowered.nv(), std::hypot(models.robot.gravity[0], models.robot.gravity[1],
                                                 models.robot.gravity[2])),
        second_(models.lowered),
        forces_(models.lowered) {}

  // a (nv) of the first `states` lanes. Where out[i] is not settled, or is not trusted, it is not to
  // be used.
  void acceleration(const CertifiedModels<S>& models, const T* q, const T* qd, const T* tau,
                    int states, T* a, Verdict* out) {
    covariance_acceleration(models.lowered, q, qd, tau, sweep_, a);
    residual_.set_motion(models.twice, q, qd, tau);
    refiner_.refine(models.twice, residual_, solve_.on(models.lowered, sweep_), states, a, out);
    for (int i = 0; i < states; ++i) {
      if (out[i].settled && out[i].steps > 1) {
        if constexpr (std::is_same_v<S, float>)
          out[i].settled = false;
        else
          add_rounding_of_residual(models, a, i, out[i]);
      }
      if (out[i].settled) add_rounding_of_constants(models, i, out[i]);
    }
  }

  // Whether no D of the last call is lost in rounding, in a lane whose position is q (nq).
  bool trusted(const CertifiedModels<S>& models, const S* q, int lane = 0) {
    return detail::number(sweep_.margin, lane) > S(0) ||
           second_.error_of_D(models.lowered, q, sweep_, lane) < error_of_D_to_refine;
  }

 private:
  // (1), with N by (2) of force_noise.hpp, or where that is coarse by (3) and (4) there.
  void add_rounding_of_residual(const CertifiedModels<S>& models, const T* a, int lane,
                                Verdict& out) {
    const double u2 = roundoff_of_pairs, unit = rounding_unit<S>();
    const double limit = enough_of_residuals * unit_roundoff<S>();
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
  void add_rounding_of_constants(const CertifiedModels<S>& models, int lane, Verdict& out) {
    const double energy = models.lowered.energy_of_gravity();
    if (!(energy > 0)) return;
    const auto of = [&](double trace) {
      return roundings_of_constants * roundoff_of_twice<S> * std::sqrt(trace * energy) / out.size;
    };
    double error = of(models.lowered.largest_variance());
    if (!(error <= little_share * unit_roundoff<S>()))
      error = of(detail::number(forces_.trace(models.lowered, sweep_), lane));
    out.error += error;
  }

  static double square(double x) { return x * x; }

  CovarianceWorkspace<T> sweep_;
  BoundedSolve<T> solve_;
  TwiceResidual<T> residual_;
  Refiner<T> refiner_;
  CovarianceForm::SecondLook<S> second_;
  ForceNoise<T> forces_;
};

inline Outcome outcome_of(const Verdict& refined) {
  Outcome out;
  out.error = refined.error;
  out.steps = refined.steps;
  return out;
}

template <class S>
bool all_finite(std::ptrdiff_t count, const S* x) {
  S check = S(0);
  for (std::ptrdiff_t i = 0; i < count; ++i) check += x[i] * S(0);
  return check == S(0);
}

// What answers where the sweep's own factors do not do.
template <class S>
class LastResortAcceleration;

template <>
class LastResortAcceleration<double> {
 public:
  explicit LastResortAcceleration(const CertifiedModels<double>& models) : wide_(models.robot) {}

  Outcome acceleration(const CertifiedModels<double>&, const double* q, const double* qd,
                       const double* tau, double* a) {
    Outcome out = wide_.acceleration(q, qd, tau, a);
    out.recomputed = static_cast<bool>(out);
    return out;
  }

 private:
  WideAcceleration wide_;
};

template <class S>
class CertifiedAcceleration {
 public:
  explicit CertifiedAcceleration(const CertifiedModels<S>& models)
      : sweep_(models), last_resort_(models) {}

  // a (nv).
  Outcome acceleration(const CertifiedModels<S>& models, const S* q, const S* qd, const S* tau,
                       S* a) {
    Verdict refined;
    sweep_.acceleration(models, q, qd, tau, 1, a, &refined);
    return refined.settled && sweep_.trusted(models, q) ? outcome_of(refined)
                                                        : last_resort(models, q, qd, tau, a);
  }

  // The same without the sweep.
  Outcome last_resort(const CertifiedModels<S>& models, const S* q, const S* qd, const S* tau,
                      S* a) {
    const int nq = models.lowered.nq(), nv = models.lowered.nv();
    if (!all_finite(nq, q) || !all_finite(nv, qd) || !all_finite(nv, tau))
      return {.status = Outcome::Status::not_finite};
    return last_resort_.acceleration(models, q, qd, tau, a);
  }

 private:
  CertifiedSweep<S> sweep_;
  LastResortAcceleration<S> last_resort_;
};

template <>
class LastResortAcceleration<float> {
 public:
  explicit LastResortAcceleration(const CertifiedModels<float>& models)
      : models_(models.twice, model_of(models.robot)),
        wide_(models_),
        q_(models.lowered.nq()),
        qd_(models.lowered.nv()),
        tau_(qd_.size()),
        a_(qd_.size()) {}

  Outcome acceleration(const CertifiedModels<float>&, const float* q, const float* qd,
                       const float* tau, float* a) {
    const auto nv = qd_.size();
    std::copy_n(q, q_.size(), q_.data());
    std::copy_n(qd, nv, qd_.data());
    std::copy_n(tau, nv, tau_.data());
    Outcome out = wide_.acceleration(models_, q_.data(), qd_.data(), tau_.data(), a_.data());
    if (!out) return out;
    out.recomputed = true;
    double lost = 0, size = 0;
    for (std::size_t k = 0; k < nv; ++k) {
      a[k] = static_cast<float>(a_[k]);
      lost += (a_[k] - a[k]) * (a_[k] - a[k]);
      size += a_[k] * a_[k];
    }
    if (!all_finite(static_cast<std::ptrdiff_t>(nv), a))
      return {.status = Outcome::Status::not_finite};
    if (size > 0) out.error += std::sqrt(lost / size);
    return out;
  }

 private:
  CertifiedModels<double> models_;
  CertifiedAcceleration<double> wide_;
  std::vector<double> q_, qd_, tau_, a_;
};

}  // namespace kalmarm
