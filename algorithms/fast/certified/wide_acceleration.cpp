// In a file of its own: sums and products of DoubleDouble must not be contracted.
#include "algorithms/fast/certified/wide_acceleration.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "algorithms/fast/certified/bounded_solve.hpp"
#include "algorithms/fast/certified/wide_test.hpp"
#include "algorithms/fast/claims/constants.hpp"
#include "algorithms/fast/engine/forms.hpp"
#include "algorithms/fast/rigid/inverse_dynamics.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/spatial/double_double.hpp"

namespace kalmarm {

struct WideAcceleration::Sweeps {
  using T = DoubleDouble;

  Sweeps(const RobotModel& robot, const CallFrames& frames)
      : model(kalmarm::model_of(robot).cast<T>(), Zeros::left_out,
              accepted_error(default_tolerance<T>), frames),
        sweep(model),
        inverse_dynamics(model),
        solve(model),
        test(model),
        q(model.nq()),
        qd(model.nv()),
        tau(qd),
        a(qd),
        r(qd),
        d(qd),
        forces(model.widths().f),
        loads(model.widths().l),
        given_gravity(numbers_of_gravity),
        gravity(std::hypot(robot.gravity[0], robot.gravity[1], robot.gravity[2])) {
    for (int k = 0; k < model.nv(); ++k) own_noise.push_back(model.body(k).r);
  }

  // What is derived from a robot's own noise, its weights, holds for more of it.
  void set_noise(const double* noise) {
    if (!noise && !noisy) return;
    noisy = noise != nullptr;
    for (int k = 0; k < model.nv(); ++k)
      if (own_noise[k] > T(0)) model.set_noise(k, noise ? T(noise[k]) : own_noise[k]);
  }

  // T (N + E + G) (c u)^2 of the last sweep.
  double squares_of_rounding() {
    const AccelerationSums<T> sums = CovarianceForm::sums(sweep);
    const T forces = sums.noise / model.rounding_unit() + sums.energy + model.energy_of_gravity();
    const double cu = rounding_constant * static_cast<double>(unit_roundoff<T>());
    return cu * cu * static_cast<double>(std::min(sums.trace, model.largest_variance()) * forces);
  }

  LoweredModel<T> model;
  CovarianceWorkspace<T> sweep;
  InverseDynamicsWorkspace<T> inverse_dynamics;
  BoundedSolve<T> solve;
  WideTest test;
  std::vector<T> q, qd, tau, a, r, d, forces, loads, given_gravity;
  std::vector<T> own_noise;
  bool noisy = false;  // the model has that of a call
  double gravity;
};

WideAcceleration::WideAcceleration(const RobotModel& robot, const CallFrames& frames)
    : sweeps_(std::make_unique<Sweeps>(robot, frames)) {}

WideAcceleration::WideAcceleration(WideAcceleration&&) noexcept = default;
WideAcceleration::~WideAcceleration() = default;

Outcome WideAcceleration::acceleration(const Call<double>& call) {
  Sweeps& w = *sweeps_;
  w.set_noise(call.r);
  const int nv = w.model.nv();
  std::copy_n(call.q, w.q.size(), w.q.begin());
  std::copy_n(call.qd, nv, w.qd.begin());
  std::copy_n(call.tau, nv, w.tau.begin());
  if (call.forces) std::copy_n(call.forces, w.forces.size(), w.forces.begin());
  if (call.loads) std::copy_n(call.loads, w.loads.size(), w.loads.begin());
  if (call.gravity) std::copy_n(call.gravity, numbers_of_gravity, w.given_gravity.begin());
  const Acting<DoubleDouble> acting = {call.forces ? w.forces.data() : nullptr, call.axes,
                                       call.loads ? w.loads.data() : nullptr,
                                       call.gravity ? w.given_gravity.data() : nullptr};
  if (const Outcome out = w.test.of_D(w.model, w.q.data(), acting); !out) return out;
  covariance_acceleration(w.model, w.q.data(), w.qd.data(), w.tau.data(), w.sweep, w.a.data(),
                          acting);
  fast_inverse_dynamics(w.model, w.q.data(), w.qd.data(), w.a.data(), w.inverse_dynamics,
                        w.r.data(), acting);
  for (int k = 0; k < nv; ++k) w.r[k] = w.tau[k] - w.r[k];
  const double bound(
      w.solve.solve(w.model, w.sweep, DoubleDouble(w.test.error_of_D()), w.r.data(), w.d.data()));
  double size = 0, change = 0, lost = 0, check = 0, velocities = 0;
  for (int k = 0; k < nv; ++k) {
    const DoubleDouble x = w.a[k] + w.d[k];
    call.out[k] = x.hi;
    check += 0 * x.hi;
    size += x.hi * x.hi;
    lost += x.lo * x.lo;
    change += w.d[k].hi * w.d[k].hi;
    velocities += call.qd[k] * call.qd[k];
  }
  if (check != 0) return {.status = Outcome::Status::not_finite};
  const double nothing = unit_roundoff<double>() * (w.gravity + velocities);
  double error =
      std::sqrt(change) + std::sqrt(bound) + std::sqrt(lost) + std::sqrt(w.squares_of_rounding());
  if (error > 0) error /= std::max(std::sqrt(size), nothing);
  return w.test.of_error(error);
}

}  // namespace kalmarm
