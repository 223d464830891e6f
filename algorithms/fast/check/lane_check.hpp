// Errors of answers, a state in every lane, rung by rung (kalmarm/check.hpp): what a rung does not know of a
// state (measured.hpp) is left to the next.
//
// Of accelerations, in double: a* by the filter beside the given one, d = a - a*, |d|_M by (1) of energy.hpp. With N,
// E, G and R of force_noise.hpp, and eps the error that a D may have,
//   u^2 = (c u)^2 (N + E + G) + u^2 R + eps^2 (E + G) + ((c u)^2 + eps^2) E(d)             (1)
// In pairs r = tau - ID(q, q', a), |d|_M by (2) there, on the factors of the same sweep:
//   u^2 = (c u)^2 N(d) + ((c u)^2 + eps^2) E(d) + (c u2)^2 F + (c u)^4 F^2 / s^2,  F = N + E + G     (2)
// u2 the roundoff of pairs, of which the last term is that of second order where their high parts lose digits
// ((3) of refine.hpp), s = max(|a*|_M, 0.01 sqrt(G)). Of M^-1 tau (2) with N and E of the solve, G = 0. Column j of
// X = M^-1 is such a solution with |X*_j|_M^2 = X*_jj; an entry of d is uncertain by u sqrt(X*_ii).
//
// Of torques and of M the residual in pairs is the error: by the same rule it is right to (e / s)^2 s, e what double
// makes another of it, measured.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "algorithms/fast/certified/certified_acceleration.hpp"
#include "algorithms/fast/check/check_engine.hpp"
#include "algorithms/fast/check/energy.hpp"
#include "algorithms/fast/check/measured.hpp"
#include "algorithms/fast/check/wide_check.hpp"
#include "algorithms/fast/claims/tuning.hpp"
#include "algorithms/fast/engine/row_block.hpp"
#include "algorithms/model/plain.hpp"

namespace kalmarm {

// Shared by all workers.
struct CheckModels {
  RobotModel robot;
  AnswerCheckOptions options;
  LoweredModel<double> lowered;
  CertifiedModels certified;

  CheckModels(const RobotModel& of_robot, const AnswerCheckOptions& given)
      : robot(of_robot),
        options(given),
        lowered(model_of(robot), Zeros::left_out, accepted_error(tolerance_of_checks)),
        certified(lowered, robot, {}) {}
  CheckModels(const CheckModels&) = delete;

  const LoweredModel<Pair<double>>& twice() const { return certified.twice; }
};

// The memory of one worker.
class LaneCheck {
 public:
  explicit LaneCheck(const CheckModels& models)
      : models_(models),
        lowered_(models.lowered),
        sweep_(lowered_),
        factors_(lowered_),
        energies_(lowered_),
        residual_(models.twice()),
        in_double_(lowered_),
        inverse_diagonal_(lowered_, InverseDiagonal<P>::Terms::positive),
        bound_(lowered_),
        wide_(models.robot),
        q_(lowered_.nq()),
        qd_(lowered_.nv()),
        tau_(qd_),
        x_(qd_),
        exact_(qd_),
        r_(qd_),
        d_(qd_),
        diagonal_(qd_),
        unit_(lowered_.nv(), 0.0),
        sizes_(unit_),
        resolution_(std::max(models.options.resolution, least_resolution)) {
    const auto& g = models.robot.gravity;
    const double least = least_beside_gravity * least_beside_gravity;
    least_ = least * lowered_.energy_of_gravity();
    least_squares_ = least * (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
  }

  void answer(int count, const CheckCall& call, AnswerError* errors) {
    const std::ptrdiff_t nq = lowered_.nq(), nv = lowered_.nv();
    for (int first = 0; first < count; first += lanes) {
      Block block{call.from(first, nq, nv),
                  std::min(lanes, count - first),
                  count - first,
                  errors + first,
                  {}};
      answer(block);
    }
  }

 private:
  using P = StateLanes<double>;
  static constexpr int lanes = Lanes<P>::count;
  static constexpr double cu2 = rounding_constant * roundoff_of_pairs;
  // Not static: nothing of a kernel may run when it is loaded, whatever the processor is.
  const double u = unit_roundoff<double>(), cu = rounding_constant * u;

  // Rows that are looked at together; open: their errors are not known yet.
  struct Block {
    CheckCall call;
    int states, left;
    AnswerError* errors;
    std::array<bool, lanes> open;

    bool any() const {
      return std::find(open.begin(), open.begin() + states, true) != open.begin() + states;
    }
  };

  static double square(double x) { return x * x; }
  static double at(const P& x, int i) { return x[i]; }

  void answer(Block& block) {
    const CheckCall& call = block.call;
    const int nv = lowered_.nv();
    begin(block);
    if (!block.any()) return;
    to_lanes(call.q, lowered_.nq(), block.states, block.left, q_);
    if (call.qd) to_lanes(call.qd, nv, block.states, block.left, qd_);
    if (call.tau) to_lanes(call.tau, nv, block.states, block.left, tau_);
    if (!call.is_matrix()) to_lanes(call.x, nv, block.states, block.left, x_);
    switch (call.want) {
      case Want::acceleration:
        return accelerations(block);
      case Want::inverse_dynamics:
        return torques(block);
      case Want::solve:
        return solutions(block);
      case Want::inverse:
        return inverses(block);
      default:
        return masses(block);
    }
  }

  // What is not finite needs no sweep.
  void begin(Block& block) {
    const std::ptrdiff_t nq = lowered_.nq(), nv = lowered_.nv();
    for (int i = 0; i < block.states; ++i) {
      const CheckCall one = block.call.from(i, nq, nv);
      block.open[i] = false;
      if (!all_finite(nq, one.q) || (one.qd && !all_finite(nv, one.qd)) ||
          (one.tau && !all_finite(nv, one.tau)))
        block.errors[i] = no_answer({.status = Outcome::Status::not_finite});
      else if (!all_finite(one.is_matrix() ? nv * nv : nv, one.x))
        block.errors[i] = infinitely_wrong();
      else
        block.open[i] = true;
    }
  }

  void say(Block& block, int i, const Measured& measured, const Outcome& outcome) {
    block.errors[i] = measured.error(models_.options.tolerance);
    block.errors[i].outcome = outcome;
    block.errors[i].outcome.error = block.errors[i].error;
    block.open[i] = false;
  }

  // Says what is known; of the rest nothing is changed.
  void say_known(Block& block, const std::array<Measured, lanes>& all, Outcome::Rung rung) {
    for (int i = 0; i < block.states; ++i)
      if (block.open[i] && all[i].is_known(resolution_)) say(block, i, all[i], {.rung = rung});
  }

  // The last rung has measured state i.
  void say_last(Block& block, int i, const Outcome& outcome, const Measured& measured) {
    if (!outcome) {
      block.errors[i] = no_answer(outcome);
      block.open[i] = false;
      return;
    }
    const bool known = measured.energy_is_known(resolution_);
    say(block, i, measured, known ? outcome : wide_.unknown());
  }

  // eps of the D that a sweep has left; infinite where its bound does not stand.
  double error_of_D(const P& margin, const Block& block, int i) {
    if (margin[i] > 0) return lowered_.error_of_D();
    const double eps =
        bound_.look(lowered_, block.call.q + std::ptrdiff_t(i) * lowered_.nq()).bound;
    return eps < largest_error_of_D ? eps : std::numeric_limits<double>::infinity();
  }

  double trace(const EnergySums<P>& sums, int i) const {
    return std::min(at(sums.trace, i), lowered_.largest_variance());
  }

  void accelerations(Block& block) {
    const int nv = lowered_.nv();
    covariance_acceleration(lowered_, q_.data(), qd_.data(), tau_.data(), sweep_, exact_.data());
    const AccelerationSums<P> swept = CovarianceForm::sums(sweep_);
    for (int k = 0; k < nv; ++k) d_[k] = x_[k] - exact_[k];
    const std::array<const P*, 2> vectors = {d_.data(), exact_.data()};
    const auto [of_d, of_a] = energies_.of<2>(lowered_, sweep_, vectors);

    std::array<Measured, lanes> all;
    std::array<double, lanes> eps, forces;
    const double gravity = lowered_.energy_of_gravity();
    for (int i = 0; i < block.states; ++i) {
      if (!block.open[i]) continue;
      eps[i] = error_of_D(sweep_.margin, block, i);
      forces[i] = swept.noise[i] / lowered_.rounding_unit() + swept.energy[i] + gravity;
      const double of_size = square(cu) * forces[i] + square(u) * swept.rounding[i] +
                             square(eps[i]) * (swept.energy[i] + gravity);
      all[i] = {of_d.size[i],
                of_d.squares[i],
                of_size + (square(cu) + square(eps[i])) * of_d.energy[i],
                of_a.size[i],
                of_a.squares[i],
                of_size,
                std::min(at(swept.trace, i), lowered_.largest_variance()),
                least_,
                least_squares_};
    }
    say_known(block, all, Outcome::Rung::float64);
    if (!block.any()) return;

    residual_.set_motion(models_.twice(), q_.data(), qd_.data(), tau_.data(), {});
    residual_.of(models_.twice(), x_.data(), nullptr, r_.data());
    const EnergySums<P> refined = energies_.solve(lowered_, sweep_, r_.data(), d_.data());
    for (int i = 0; i < block.states; ++i)
      if (block.open[i]) refine(refined, i, eps[i], forces[i], all[i]);
    say_known(block, all, Outcome::Rung::refined);
    for (int i = 0; i < block.states; ++i) {
      if (!block.open[i]) continue;
      Measured one;
      const Outcome outcome = wide_.acceleration(block.call.from(i, lowered_.nq(), nv), one);
      one.least = least_;
      one.least_squares = least_squares_;
      say_last(block, i, outcome, one);
    }
  }

  // (2)
  void refine(const EnergySums<P>& sums, int i, double eps, double forces, Measured& out) const {
    out.energy = sums.size[i];
    out.squares = sums.squares[i];
    out.uncertainty = square(cu) * sums.noise[i] / lowered_.rounding_unit() +
                      (square(cu) + square(eps)) * sums.energy[i] + square(cu2) * forces +
                      square(square(cu) * forces) / std::max(out.size, out.least);
  }

  // x = M^-1 tau of the lanes' tau_ and x_, by factors_ and a residual that has their position.
  void column(const Block& block, const std::array<double, lanes>& eps,
              std::array<Measured, lanes>& all) {
    const EnergySums<P> exact = energies_.solve(lowered_, factors_, tau_.data(), exact_.data());
    residual_.set_torque(tau_.data());
    residual_.of(models_.twice(), x_.data(), nullptr, r_.data());
    const EnergySums<P> refined = energies_.solve(lowered_, factors_, r_.data(), d_.data());
    for (int i = 0; i < block.states; ++i) {
      if (!block.open[i]) continue;
      const double noise = exact.noise[i] / lowered_.rounding_unit(),
                   forces = noise + exact.energy[i];
      all[i] = {};
      all[i].size = exact.size[i];
      all[i].size_squares = exact.squares[i];
      all[i].uncertainty_of_size = square(cu) * forces + square(eps[i]) * exact.energy[i];
      all[i].trace = trace(exact, i);
      refine(refined, i, eps[i], forces, all[i]);
    }
  }

  std::array<double, lanes> factor(const Block& block) {
    covariance_factor(lowered_, q_.data(), factors_);
    residual_.set_mass(models_.twice(), q_.data());
    std::array<double, lanes> eps{};
    for (int i = 0; i < block.states; ++i)
      if (block.open[i]) eps[i] = error_of_D(factors_.margin, block, i);
    return eps;
  }

  void solutions(Block& block) {
    std::array<Measured, lanes> all;
    column(block, factor(block), all);
    say_known(block, all, Outcome::Rung::refined);
    for (int i = 0; i < block.states; ++i) {
      if (!block.open[i]) continue;
      const CheckCall one = block.call.from(i, lowered_.nq(), lowered_.nv());
      Measured measured;
      const Outcome outcome = wide_.factor(one.q);
      if (outcome) wide_.column(one.tau, one.x, measured);
      say_last(block, i, outcome, measured);
    }
  }

  // Of the worst entry of a matrix, relative to the roots of its diagonal's.
  static Measured no_entries() {
    Measured out{};
    out.size = out.size_squares = out.trace = 1;
    return out;
  }

  // d(k)^2 / diagonal(k) is at most `entry` in a column.
  static void add_column(const Measured& column, double entry, Measured& whole) {
    const auto grow = [](double x, double& to) {
      if (!(x <= to)) to = x;  // NaN stays
    };
    grow(entry / column.size, whole.energy);
    grow(column.uncertainty / column.size, whole.uncertainty);
    grow(column.uncertainty_of_size / column.size, whole.uncertainty_of_size);
    whole.squares = whole.energy;
  }

  void inverses(Block& block) {
    const int nv = lowered_.nv();
    const std::array<double, lanes> eps = factor(block);
    inverse_diagonal_.fill(lowered_, factors_, diagonal_.data());
    std::array<Measured, lanes> columns, all;
    all.fill(no_entries());
    for (int j = 0; j < nv; ++j) {
      set_unit(j, tau_);
      load_column(block, j);
      column(block, eps, columns);
      P worst(0.0);
      for (int k = 0; k < nv; ++k) worst = max(worst, d_[k] * d_[k] / diagonal_[k]);
      for (int i = 0; i < block.states; ++i)
        if (block.open[i]) add_column(columns[i], worst[i] + 0 * columns[i].squares, all[i]);
    }
    say_known(block, all, Outcome::Rung::refined);
    for (int i = 0; i < block.states; ++i)
      if (block.open[i]) inverse_in_two_doubles(block, i);
  }

  void inverse_in_two_doubles(Block& block, int i) {
    const std::ptrdiff_t nv = lowered_.nv();
    const CheckCall one = block.call.from(i, lowered_.nq(), nv);
    const Outcome outcome = wide_.factor(one.q);
    Measured column, whole = no_entries();
    const auto measure = [&](std::ptrdiff_t j) {
      unit_[j] = 1;
      wide_.column(unit_.data(), one.x + j * nv, column);
      unit_[j] = 0;
    };
    for (std::ptrdiff_t j = 0; outcome && j < nv; ++j) {
      measure(j);
      sizes_[j] = column.size;
    }
    for (std::ptrdiff_t j = 0; outcome && j < nv; ++j) {
      measure(j);
      double worst = 0;
      for (std::ptrdiff_t k = 0; k < nv; ++k)
        worst = std::max(worst, square(wide_.error_of(static_cast<int>(k))) / sizes_[k]);
      add_column(column, worst + 0 * column.squares, whole);
    }
    say_last(block, i, outcome, whole);
  }

  static void set_unit(int j, std::vector<P>& e) {
    std::fill(e.begin(), e.end(), P(0.0));
    e[j] = P(1.0);
  }

  // Of each state's matrix.
  void load_column(const Block& block, int j) {
    const std::ptrdiff_t nv = lowered_.nv();
    for (int i = 0; i < lanes; ++i) {
      const double* const from = block.call.x + (std::min(i, block.states - 1) * nv + j) * nv;
      for (int k = 0; k < nv; ++k) x_[k].set(i, from[k]);
    }
  }

  // Of torques: Euclid's norms alone, and T = 1.
  static Measured of_residual(double squares, double size, double by_double) {
    Measured out{};
    out.energy = out.squares = squares;
    out.size = out.size_squares = size;
    out.trace = 1;
    out.uncertainty = size > 0 ? square(by_double) / size : by_double;
    out.uncertainty += square(cu2) * size;
    return out;
  }

  void torques(Block& block) {
    const int nv = lowered_.nv();
    // x_: the torques, tau_: qdd, of which the residual is -r.
    fast_inverse_dynamics(lowered_, q_.data(), qd_.data(), tau_.data(), in_double_, exact_.data());
    residual_.set_motion(models_.twice(), q_.data(), qd_.data(), x_.data(), {});
    residual_.of(models_.twice(), tau_.data(), nullptr, r_.data());
    P squares(0.0), size(0.0), by_double(0.0);
    for (int k = 0; k < nv; ++k) {
      const P exact = x_[k] - r_[k], e = exact - exact_[k];
      squares += r_[k] * r_[k];
      size += exact * exact;
      by_double += e * e;
    }
    std::array<Measured, lanes> all;
    for (int i = 0; i < block.states; ++i) all[i] = of_residual(squares[i], size[i], by_double[i]);
    say_known(block, all, Outcome::Rung::refined);
    for (int i = 0; i < block.states; ++i) {
      if (!block.open[i]) continue;
      Measured one;
      wide_.torques(block.call.from(i, lowered_.nq(), nv), one);
      say(block, i, one, {.rung = Outcome::Rung::two_doubles});
    }
  }

  // e_ij^2 of the worst entry, and what double makes another of it.
  void masses(Block& block) {
    const int nv = lowered_.nv();
    constexpr std::array<std::pair<int, Sixfold<P>>, 0> no_contacts{};
    detail::set_placements(lowered_, q_.data(), in_double_);
    residual_.set_mass(models_.twice(), q_.data());
    for (int j = 0; j < nv; ++j) {
      set_unit(j, tau_);
      detail::mass_times(lowered_, tau_.data(), no_contacts, {}, in_double_, exact_.data());
      diagonal_[j] = exact_[j];
    }
    P worst(0.0), by_double(0.0);
    for (int j = 0; j < nv; ++j) {
      set_unit(j, tau_);
      load_column(block, j);
      detail::mass_times(lowered_, tau_.data(), no_contacts, {}, in_double_, exact_.data());
      residual_.set_torque(x_.data());
      residual_.of(models_.twice(), tau_.data(), nullptr, r_.data());
      for (int k = 0; k < nv; ++k) {
        const P scale = diagonal_[j] * diagonal_[k], e = (x_[k] - r_[k]) - exact_[k];
        worst = max(worst, r_[k] * r_[k] / scale);
        by_double = max(by_double, e * e / scale);
      }
    }
    std::array<Measured, lanes> all;
    for (int i = 0; i < block.states; ++i) all[i] = of_residual(worst[i], 1, by_double[i]);
    say_known(block, all, Outcome::Rung::refined);
    for (int i = 0; i < block.states; ++i) {
      if (!block.open[i]) continue;
      say(block, i, all[i], {.rung = Outcome::Rung::refined, .near_singular = true});
    }
  }

  const CheckModels& models_;
  const LoweredModel<double>& lowered_;
  CovarianceWorkspace<P> sweep_;
  FastFactors<P> factors_;
  EnergySweeps<P> energies_;
  TwiceResidual<P> residual_;
  InverseDynamicsWorkspace<P> in_double_;
  InverseDiagonal<P> inverse_diagonal_;
  RoundingBound<double> bound_;
  WideCheck wide_;
  std::vector<P> q_, qd_, tau_, x_, exact_, r_, d_, diagonal_;
  std::vector<double> unit_, sizes_;
  double resolution_, least_ = 0, least_squares_ = 0;
};

}  // namespace kalmarm
