// Is D(k) zero? A covariance form knows it to u times the size of what went into it, a square-root
// form to u^2 times that. The size of what went in, less what the filter has forgotten since, is
//   S-(k) = M(k) + sum over children c of phi(k,c) S+(c) phi'(k,c) + E(c)
//   S+(k) = (I - gH) S- (I - gH)' + P-        P- is what the update subtracts from
//   E(c)  = diagonal of |phi| |P+(c)| |phi'|   terms of phi P+ phi' before they cancel
//   scale(k) = H S- H' + r
// With order = 1 or 2 the mechanism is called singular where D(k) <= (32 u)^order scale(k), and
// nearly singular, which is a warning, below (256 u)^order scale(k): then D may be wrong by 1 per
// cent. D(k) against the composite inertia M(k,k) would not do: stretched out, D/M(k,k) falls as
// N^-3 in a chain although D is known to all digits.
//
// S costs more than a sweep, so it is worked out only if some D(k) is below least_D_over_size J(k), with
// the cheap J of polar_moment.hpp.
//
// S keeps what a heavy outboard body has put in, although arrays lose no digits to it: in float32
// the rule would refuse mass ratios from 1e11 on that ArrayGivens answers to seven digits. There a
// suspect gets its second look in float64, from q on, which tells 1e-29 from zero; the float32 rule
// only warns.
#pragma once

#include <cmath>
#include <limits>
#include <span>
#include <type_traits>
#include <vector>

#include "algorithms/model/rounding_scale.hpp"
#include "algorithms/study/riccati/array.hpp"
#include "algorithms/study/riccati/gains.hpp"
#include "kalmarm/outcome.hpp"

namespace kalmarm {

// NaN for a scalar that is more than a number, as a dual number is.
template <class T>
double as_double(const T& x) {
  if constexpr (requires { static_cast<double>(x); })
    return static_cast<double>(x);
  else
    return std::numeric_limits<double>::quiet_NaN();
}

template <class T>
Outcome outcome_at(int k, const T& D, const T& scale) {
  Outcome out;
  out.joint = k;
  out.D = as_double(D);
  out.scale = as_double(scale);
  return out;
}

// Of the joint that comes nearest to singular among those whose D < (256 u)^order scale.
template <class T>
class NearestToSingular {
 public:
  explicit NearestToSingular(int order) {
    for (int i = 0; i < order; ++i) bound_ *= T(256) * unit_roundoff<T>();
  }

  void see(int k, const T& D, const T& scale) {
    if (!(D < bound_ * scale)) return;
    bound_ = D / scale;
    warning_ = outcome_at(k, D, scale);
    warning_.near_singular = true;
  }

  // What another has seen, of other joints.
  void see(const NearestToSingular& other) {
    if (other.bound_ < bound_) *this = other;
  }

  const Outcome& warning() const { return warning_; }

 private:
  T bound_ = T(1);
  Outcome warning_;
};

template <class T, int order>
class SingularityTest {
 public:
  explicit SingularityTest(const Model<T>& model)
      : polar_(model.nv()), body_polar_(body_polar_moments(model)), scale_(model), exact_(model) {}

  // From now on every mechanism gets a second look.
  void look_always() { looks_always_ = true; }

  void begin(std::span<const ContactRow<T>> contacts) {
    polar_ = body_polar_;
    suspect_ = looks_always_;
    contacts_ = contacts;
    for (const ContactRow<T>& row : contacts) {  // as a body that is as large
      polar_[row.link].J += row.d * row.e.template head<3>().squaredNorm();
      polar_[row.link].m += row.d * row.e.template tail<3>().squaredNorm();
    }
  }

  // False where D cannot be gone on with. Call it tips to base, before propagation.
  bool passes(const Model<T>& model, const LinkKinematics<T>& kin, int k, const T& D) {
    const Joint<T>& joint = model.joint(k);
    suspect_ = suspect_ || !(D > least_D_over_size<T>(order) * polar_[k].size(joint));
    if (joint.parent >= 0) polar_[joint.parent].add_child(polar_[k], kin.phi[k].p);
    return D > T(0);
  }

  bool suspect() const { return suspect_; }

  // The first joint, tips to base as far as `first`, whose D is lost in rounding. Otherwise ok,
  // with a warning where one is nearly lost.
  Outcome look(const Model<T>& model, const LinkKinematics<T>& kin, int first,
               const Gains<T>& gains) {
    Outcome singular;
    if constexpr (in_float64) singular = exact_.look(contacts_, kin, first);
    NearestToSingular<T> nearest(order);
    begin_scale(model, contacts_, scale_);
    for (int k = model.nv() - 1; singular && k >= first; --k) {
      const T D = gains.D[k], scale = scale_.scale(model, k);
      const bool lost = in_float64 ? !(D > T(0)) : !(D > resolution() * scale);
      if (lost) {
        singular = outcome_at(k, D, scale);
        singular.status =
            D >= -resolution() * scale ? Outcome::Status::singular : Outcome::Status::indefinite;
        break;
      }
      nearest.see(k, D, scale);
      if (model.parent(k) >= 0) scale_.propagate(model, kin.phi[k], k, gains.g[k]);
    }
    if (!singular) return singular;
    Outcome out = nearest.warning();
    out.rung = Outcome::Rung::refined;
    return out;
  }

 private:
  static constexpr bool in_float64 = std::is_same_v<T, float> && order > 1;

  // The same mechanism in float64, by arrays.
  struct InFloat64 {
    Model<double> model;
    LinkKinematics<double> kin;
    ArrayMGS::Workspace<double> update;
    RoundingScale<double> scale;

    explicit InFloat64(const Model<T>& exact)
        : model(exact.template cast<double>()), kin(model), update(model), scale(model) {}

    Outcome look(std::span<const ContactRow<T>> contacts, const LinkKinematics<T>& exact,
                 int first) {
      constexpr double resolution = 0x1p-96;  // (32 u)^2
      set_position(model, exact.q, kin);      // phi of float32 is rounded, and moves D
      ArrayMGS::start(model, kin, update);
      std::vector<ContactRow<double>> rows;
      for (const ContactRow<T>& row : contacts) rows.push_back(row.template cast<double>());
      for (const ContactRow<double>& row : rows) ArrayMGS::add_contact(row, update);
      begin_scale(model, std::span<const ContactRow<double>>(rows), scale);
      Vector6<double> g;
      for (int k = model.nv() - 1; k >= first; --k) {
        const double D = ArrayMGS::measure(model, k, update, g), size = scale.scale(model, k);
        if (!(D > resolution * size)) {
          Outcome singular = outcome_at(k, D, size);
          singular.status = Outcome::Status::singular;
          return singular;
        }
        if (model.parent(k) < 0) continue;
        ArrayMGS::propagate(model, kin, k, update);
        scale.propagate(model, kin.phi[k], k, g);
      }
      return {};
    }
  };
  struct Nothing {
    explicit Nothing(const Model<T>&) {}
  };

  // S-(k) with M(k) as contacts make it.
  template <class U>
  static void begin_scale(const Model<U>& model, std::span<const ContactRow<U>> contacts,
                          RoundingScale<U>& scale) {
    scale.begin(model);
    for (const ContactRow<U>& row : contacts) {
      const Matrix6<U> added = Vector6<U>(row.d * row.e) * row.e.transpose();
      scale.P[row.link] += added;
      scale.S[row.link] += added;
    }
  }

  static T resolution() { return least_D_over_scale<T>(order); }

  std::vector<PolarMoment<T>> polar_, body_polar_;  // of the outboard side, of the link alone
  RoundingScale<T> scale_;
  [[no_unique_address]] std::conditional_t<in_float64, InFloat64, Nothing> exact_;
  std::span<const ContactRow<T>> contacts_;  // of the state
  bool suspect_ = false, looks_always_ = false;
};

}  // namespace kalmarm
