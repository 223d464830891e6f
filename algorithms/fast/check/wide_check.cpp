// In a file of its own: sums and products of DoubleDouble must not be contracted.
#include "algorithms/fast/check/wide_check.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>
#include <vector>

#include "algorithms/fast/certified/wide_test.hpp"
#include "algorithms/fast/check/energy.hpp"
#include "algorithms/fast/claims/claims.hpp"
#include "algorithms/fast/covariance/forward_dynamics.hpp"
#include "algorithms/fast/engine/engine.hpp"
#include "algorithms/fast/rigid/inverse_dynamics.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/spatial/double_double.hpp"

namespace kalmarm {

struct WideCheck::Sweeps {
  using T = DoubleDouble;

  explicit Sweeps(const RobotModel& robot)
      : model(kalmarm::model_of(robot).cast<T>(), Zeros::left_out,
              accepted_error(default_tolerance<T>)),
        sweep(model),
        factors(model),
        inverse_dynamics(model),
        energies(model),
        test(model),
        q(model.nq()),
        qd(model.nv()),
        tau(qd),
        x(qd),
        a(qd),
        r(qd),
        d(qd) {}

  // (c u)^2 (N + E + G), of sums whose N is in units of weights.
  double rounding(const T& noise, const T& energy, const T& gravity) const {
    const double cu = rounding_constant * static_cast<double>(unit_roundoff<T>());
    return cu * cu * static_cast<double>(noise / model.rounding_unit() + energy + gravity);
  }

  // |d|_M, u but for the rounding of r, by factors that have r.
  template <class Factors>
  void measure(const Factors& by, Measured& out) {
    const EnergySums<T> sums = energies.solve(model, by, r.data(), d.data());
    const double eps = test.error_of_D();
    out.energy = static_cast<double>(sums.size);
    out.squares = static_cast<double>(sums.squares);
    out.uncertainty =
        rounding(sums.noise, sums.energy, T(0)) + eps * eps * static_cast<double>(sums.energy);
    out.trace = static_cast<double>(std::min(sums.trace, model.largest_variance()));
  }

  LoweredModel<T> model;
  CovarianceWorkspace<T> sweep;
  FastFactors<T> factors;
  InverseDynamicsWorkspace<T> inverse_dynamics;
  EnergySweeps<T> energies;
  WideTest test;
  std::vector<T> q, qd, tau, x, a, r, d;
};

WideCheck::WideCheck(const RobotModel& robot) : sweeps_(std::make_unique<Sweeps>(robot)) {}
WideCheck::WideCheck(WideCheck&&) noexcept = default;
WideCheck::~WideCheck() = default;

Outcome WideCheck::acceleration(const CheckCall& call, Measured& out) {
  Sweeps& w = *sweeps_;
  const std::size_t nv = w.qd.size();
  std::copy_n(call.q, w.q.size(), w.q.begin());
  std::copy_n(call.qd, nv, w.qd.begin());
  std::copy_n(call.tau, nv, w.tau.begin());
  std::copy_n(call.x, nv, w.x.begin());
  if (const Outcome tested = w.test.of_D(w.model, w.q.data(), {}); !tested) return tested;
  covariance_acceleration(w.model, w.q.data(), w.qd.data(), w.tau.data(), w.sweep, w.a.data());
  fast_inverse_dynamics(w.model, w.q.data(), w.qd.data(), w.x.data(), w.inverse_dynamics,
                        w.r.data());
  for (std::size_t k = 0; k < nv; ++k) w.r[k] = w.tau[k] - w.r[k];
  w.measure(w.sweep, out);
  const auto gravity = w.model.energy_of_gravity();
  const double rounded = w.rounding(w.sweep.noise, w.sweep.energy, gravity),
               eps = w.test.error_of_D();
  out.uncertainty += rounded;
  const std::array<const DoubleDouble*, 1> exact = {w.a.data()};
  const auto sizes = w.energies.of<1>(w.model, w.sweep, exact);
  out.size = static_cast<double>(sizes[0].size);
  out.size_squares = static_cast<double>(sizes[0].squares);
  out.uncertainty_of_size = rounded + eps * eps * static_cast<double>(w.sweep.energy + gravity);
  return {.rung = Outcome::Rung::two_doubles};
}

Outcome WideCheck::factor(const double* q) {
  Sweeps& w = *sweeps_;
  std::copy_n(q, w.q.size(), w.q.begin());
  if (const Outcome tested = w.test.of_D(w.model, w.q.data(), {}); !tested) return tested;
  covariance_factor(w.model, w.q.data(), w.factors);
  detail::set_placements(w.model, w.q.data(), w.inverse_dynamics);
  return {.rung = Outcome::Rung::two_doubles};
}

void WideCheck::column(const double* tau, const double* x, Measured& out) {
  Sweeps& w = *sweeps_;
  const std::size_t nv = w.x.size();
  std::copy_n(tau, nv, w.tau.begin());
  std::copy_n(x, nv, w.x.begin());
  const auto exact = w.energies.solve(w.model, w.factors, w.tau.data(), w.a.data());
  constexpr std::array<std::pair<int, Sixfold<DoubleDouble>>, 0> no_contacts{};
  detail::mass_times(w.model, w.x.data(), no_contacts, {}, w.inverse_dynamics, w.r.data());
  for (std::size_t k = 0; k < nv; ++k) w.r[k] = w.tau[k] - w.r[k];
  w.measure(w.factors, out);
  const double rounded = w.rounding(exact.noise, exact.energy, 0), eps = w.test.error_of_D();
  out.uncertainty += rounded;
  out.size = static_cast<double>(exact.size);
  out.size_squares = static_cast<double>(exact.squares);
  out.uncertainty_of_size = rounded + eps * eps * static_cast<double>(exact.energy);
}

double WideCheck::error_of(int k) const { return static_cast<double>(sweeps_->d[k]); }

// r is right to u^2 of what double rounds there, which is not known here: it counts as all of tau.
void WideCheck::torques(const CheckCall& call, Measured& out) {
  Sweeps& w = *sweeps_;
  const std::size_t nv = w.qd.size();
  std::copy_n(call.q, w.q.size(), w.q.begin());
  std::copy_n(call.qd, nv, w.qd.begin());
  std::copy_n(call.tau, nv, w.tau.begin());
  fast_inverse_dynamics(w.model, w.q.data(), w.qd.data(), w.tau.data(), w.inverse_dynamics,
                        w.r.data());
  out = {};
  out.trace = 1;
  for (std::size_t k = 0; k < nv; ++k) {
    const double d(DoubleDouble(call.x[k]) - w.r[k]), exact(w.r[k]);
    out.energy += d * d;
    out.size += exact * exact;
  }
  out.squares = out.energy;
  out.size_squares = out.size;
}

Outcome WideCheck::unknown() const {
  Outcome out = sweeps_->test.of_error(std::numeric_limits<double>::infinity());
  out.rung = Outcome::Rung::two_doubles;
  out.near_singular = true;
  return out;
}

}  // namespace kalmarm
