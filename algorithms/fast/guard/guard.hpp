// Whether the answer of a kernel can be used, and what answers in its place where not.
//
// A sweep leaves for every lane: margin, positive where rounding cannot have moved a D far; for
// accelerations AccelerationSums, for solves N, E and |x|^2 of force_noise.hpp, for the rest check,
// which is zero where every result is finite. Only a state that fails a test, or whose estimated error
// is coarse, pays for more: a second look, then the certified form.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "algorithms/fast/certified/certified_answer.hpp"
#include "algorithms/fast/engine/forms.hpp"
#include "algorithms/fast/engine/instances.hpp"
#include "algorithms/fast/factors/solve.hpp"

namespace kalmarm {

// What AccelerationSums say, of one state or one in every lane.
template <class T>
struct Believed {
  T margin;     // (8): positive where rounding cannot have moved a far
  T error;      // (10) and (14)
  T of_sweeps;  // the square of (10): what a second look can know better
};

template <class S, class F>
class Guard {
 public:
  Guard(const RobotModel& robot, const LoweredModel<S>& lowered, const EngineOptions& options)
      : second_(lowered),
        forces_(lowered),
        allowed_(S(largest_error_of_a<S> * largest_error_of_a<S>) * rounding_unit<S>() /
                 square(S(rounding_constant_of_a) * unit_roundoff<S>())),
        least_(S(least_beside_gravity * least_beside_gravity) * squares_of(robot.gravity)),
        least_size_(least_ * square(mean_root(lowered.least_inertias()))),
        weight_(lowered.energy_of_gravity()),
        terms_(lowered.terms_of_columns()),
        loses_(F::may_lose_motion(lowered)),
        own_(lowered),
        a_(lowered.nv()),
        certified_(robot, lowered, options, F::at_rest),
        q_(lowered.nq()) {}

  CertifiedAnswer<S>& certified() { return certified_; }

  // NaN where a is not finite.
  template <class T>
  Believed<T> believed(const AccelerationSums<T>& of_a) const {
    return believed_beside(of_a, T(allowed_ / forces_.largest_variance()));
  }
  // With a trace of M^-1 of every lane.
  template <class T>
  Believed<T> believed(const AccelerationSums<T>& of_a, const T& trace) const {
    using std::min;
    return believed_beside(of_a, T(allowed_) / min(trace, T(forces_.largest_variance())));
  }

  // Whether the sums of x = M^-1 tau pass (8'), by factors whose D pass their own test. false where x
  // is not finite.
  bool believed(const SolveSums<S>& of_x) const {
    return margin(S(of_x.noise + of_believed_D() * of_x.energy), of_x.squares) > S(0);
  }

  // Whether what a sweep has left of a lane vouches for its accelerations: its margin of D, and `by`.
  template <class T>
  static bool vouched(const T& margin_of_D, const Believed<T>& by, int lane) {
    const S D = detail::number(margin_of_D, lane), of_a = detail::number(by.margin, lane);
    const S error = detail::number(by.of_sweeps, lane);
    return D > S(0) && of_a > S(0) && error <= square(S(coarse_error) * unit_roundoff<S>());
  }

  // The estimated error of a lane of `swept`, accelerations a that `by` is said of; NaN where they are
  // to be answered anew. A look at another kernel's state, whose numbers are rounded elsewhere, is one
  // at a sweep of the form itself, which then has answered.
  template <class Swept, class T>
  double error(const LoweredModel<S>& lowered, const S* q, const S* qd, const S* tau, S* a,
               const Swept& swept, const Believed<T>& by, int lane = 0) {
    if (vouched(swept.margin, by, lane)) return detail::number(by.error, lane);
    if (std::isnan(detail::number(by.margin, lane))) return answer_anew;
    if constexpr (!std::is_same_v<Swept, typename F::template Workspace<T>>) {
      F::acceleration(lowered, q, qd, tau, own_, a);
      return look(lowered, q, own_, a);
    } else if constexpr (std::is_same_v<T, S>) {
      return look(lowered, q, swept, a);
    } else {
      const double of_D = error_of_D(lowered, q, swept, lane);
      return of_D < error_of_D_to_refine ? closer(lowered, q, qd, tau, of_D) : answer_anew;
    }
  }

  // The same by a sweep of its own, with the relative error of D.
  double closer(const LoweredModel<S>& lowered, const S* q, const S* qd, const S* tau,
                double error_of_D) {
    F::acceleration(lowered, q, qd, tau, own_, a_.data());
    return closer(lowered, own_, a_.data(), error_of_D);
  }

  // Of factors, from what the sweeps have left of a state q.
  template <class Swept, class T>
  bool may_be_wrong(const LoweredModel<S>& lowered, const S* q, const Swept& swept, const T& check,
                    int lane = 0) {
    if (detail::number(check, lane) != S(0)) return true;
    if (detail::number(swept.margin, lane) > S(0)) return false;
    return !(second_.error_of_D(lowered, q, swept, lane) < share_of_one_D * error_of_D_let_pass<S>);
  }

  // Whether columns of M^-1 pass (11), by the sum of D(k) X(k,k).
  bool believed_columns(const S& energy) const { return passes(energy + terms_); }

  // The same by all of S, of factors that have made X.
  template <class Factors, class Diagonal>
  bool believed_columns(const LoweredModel<S>& lowered, const Factors& factors,
                        const Diagonal& diagonal) {
    return passes(forces_.energy_of_columns(lowered, factors, diagonal));
  }
  bool passes(const S& energy_of_columns) const {
    return rounding_unit<S>() * energy_of_columns < allowed_;
  }

  // Factors at q are kept, by which columns are solved.
  void keep(const LoweredModel<S>& lowered, const S* q) {
    std::copy_n(q, lowered.nq(), q_.data());
    kept_.reset();
    looked_at_.reset();
  }

  // Of a column x = M^-1 tau by the factors that are kept and believed, where of_x is not: the second
  // look of (8'). z(k): z-(k) of its sweep.
  template <class Forces>
  bool may_be_wrong(const LoweredModel<S>& lowered, const FastFactors<S>& factors,
                    const SolveSums<S>& of_x, const Forces& z) {
    if (!looked_at_)
      looked_at_ = {second_.error_of_D(lowered, q_.data(), factors, 0),
                    forces_.trace(lowered, factors)};
    const auto& [of_D, trace] = *looked_at_;
    if (!(of_D < error_of_D_to_refine)) return true;
    const S energy = rounding_unit<S>() * of_x.energy;
    const S most = allowed_ * of_x.squares / trace;
    const S N = energy + noise_closer(lowered, factors, z, most);
    return !(static_cast<double>(N) + in_units(of_D, rounding_constant_of_a) * energy <
             static_cast<double>(most));
  }

  // The column by certified factors, which are made for the first.
  Outcome certified_column(int nv, const S* tau, S* x) {
    if (!Eigen::Map<const VectorX<S>>(tau, nv).allFinite())
      return {.status = Outcome::Status::not_finite};
    if (!kept_) kept_ = certified_.factor(q_.data());
    return *kept_ ? certified_.solve(1, tau, x) : *kept_;
  }

 private:
  // How wrong a D of a lane can be, relatively, where it may count.
  template <class Swept>
  double error_of_D(const LoweredModel<S>& lowered, const S* q, const Swept& swept, int lane) {
    const bool every_D = detail::number(swept.margin, lane) > S(0) && !loses_;
    return every_D ? 0 : second_.error_of_D(lowered, q, swept, lane);
  }

  // A second look at accelerations a of one state; the estimated error, or NaN.
  template <class Swept>
  double look(const LoweredModel<S>& lowered, const S* q, const Swept& swept, const S* a) {
    const double of_D = error_of_D(lowered, q, swept, 0);
    return of_D < error_of_D_to_refine ? closer(lowered, swept, a, of_D) : answer_anew;
  }

  static S squares_of(const std::array<double, 3>& x) {
    return S(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
  }

  // (9), and then the second look of (10).
  template <class Swept>
  double closer(const LoweredModel<S>& lowered, const Swept& swept, const S* a, double error_of_D) {
    const S most = allowed_ * std::max(swept.squares, least_) / forces_.trace(lowered, swept);
    const S noise = noise_closer(
        lowered, swept, [&](int k) { return F::forces(lowered, swept, k); }, most);
    const double N = static_cast<double>(rounding_unit<S>() * swept.energy + noise);
    const double E = static_cast<double>(rounding_unit<S>() * (swept.energy + weight_));
    double of_D = in_units(error_of_D, rounding_constant_of_a) * E;
    if (swept.margin > S(0))
      of_D = std::min(of_D, static_cast<double>(energy_lost(F::sums(swept))));
    if (!(N + of_D < static_cast<double>(most))) return answer_anew;
    S size = S(0);
    for (int k = 0; k < lowered.nv(); ++k) size += a[k] * a[k] / forces_.variance(k);
    const double told = N + square(rounding_constant_of_a / rounding_constant_of_error) * of_D;
    const double of_answer = square(unit_roundoff<S>()) * F::sums(swept).rounding;
    return std::sqrt((static_cast<double>(unit_of_error()) * told + of_answer) /
                     static_cast<double>(std::max(size, least_size_)));
  }

  // N by (3), of z(k) = z-(k), where `most` is allowed.
  template <class Swept, class Forces>
  S noise_closer(const LoweredModel<S>& lowered, const Swept& swept, const Forces& z, S most) {
    const S little = S(little_share) * most;
    S N = S(0);
    forces_.begin();
    for (int k = lowered.nv() - 1; k >= 0; --k)
      N += forces_.charge(lowered, swept, k, z(k), little);
    return N;
  }

  // The factor of E in (8'), in units of the weights.
  static S of_believed_D() {
    return S((1 + square(rounding_constant_of_believed_D / rounding_constant_of_a))) *
           rounding_unit<S>();
  }

  // (8): what may be added to the sum of N and E, in units of the weights.
  template <class T>
  T margin(const T& sum, const T& squares) const {
    return T(allowed_ / forces_.largest_variance()) * squares - sum;
  }

  // allowed: beside |a|^2.
  template <class T>
  Believed<T> believed_beside(const AccelerationSums<T>& of_a, const T& allowed) const {
    using std::sqrt;
    const T nothing = of_a.squares * T(S(0));
    const T sum = of_a.noise + T(rounding_unit<S>()) * of_a.energy;
    const T told =
        sum +
        T(square(S(share_of_lost_told * rounding_constant_of_a / rounding_constant_of_error)) *
          weight_of_lost()) *
            of_a.lost;
    const T size = larger(of_a.size, T(least_size_));
    const T of_sweeps = T(unit_of_error()) * told / size;
    const T of_answer = T(square(unit_roundoff<S>())) * of_a.rounding / size;
    return {(allowed * larger(of_a.squares, T(least_)) - (sum + energy_lost(of_a))) + nothing,
            sqrt(of_sweeps + of_answer) + nothing, of_sweeps};
  }

  // Of (12), in units of the weights.
  static S weight_of_lost() {
    return S(rounding_constant_of_traces * rounding_constant_of_lost /
             square(rounding_constant_of_a));
  }

  // (12) and (13), likewise.
  template <class T>
  T energy_lost(const AccelerationSums<T>& of_a) const {
    const S by_most =
        S(in_units(error_of_D_let_pass<S>, rounding_constant_of_a)) * rounding_unit<S>();
    return T(weight_of_lost()) * of_a.lost +
           T(by_most) * (of_a.loss * of_a.loss) * (of_a.energy + T(weight_));
  }

  // (eps / (c u))^2
  static double in_units(double eps, double c) {
    return square(eps / (c * static_cast<double>(unit_roundoff<S>())));
  }

  template <class T>
  static T square(const T& x) {
    return x * x;
  }
  template <class T>
  static T larger(const T& a, const T& b) {
    using std::min;
    return -min(T(-a), T(-b));
  }

  // (b u)^2, of N in units of its weights.
  static S unit_of_error() {
    return square(S(rounding_constant_of_error) * unit_roundoff<S>()) / rounding_unit<S>();
  }

  static S mean_root(const std::vector<S>& x) {
    S sum = S(0);
    for (const S& one : x) sum += std::sqrt(one);
    return x.empty() ? S(0) : sum / S(x.size());
  }

  typename F::template SecondLook<S> second_;
  ForceNoise<S> forces_;
  static constexpr double answer_anew = std::numeric_limits<double>::quiet_NaN();

  S allowed_, least_, least_size_;  // e^2 / (c u)^2, the least |a|^2 and |a|_s^2
  S weight_;                        // |gravity|^2 sum of m(k), of (9)
  S terms_;                         // (2) of terms_of_columns.hpp
  bool loses_;                      // F::may_lose_motion
  typename F::template Workspace<S> own_;
  std::vector<S> a_;
  CertifiedAnswer<S> certified_;
  std::vector<S> q_;             // of the factors that are kept
  std::optional<Outcome> kept_;  // of certified ones there
  struct LookedAt {
    double error_of_D;
    S trace;  // T of (4)
  };
  std::optional<LookedAt> looked_at_;  // of those that are kept
};

}  // namespace kalmarm
