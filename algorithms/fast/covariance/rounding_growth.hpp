// Do errors grow along this robot from joint to joint? The test of a sweep compares D(k) with what
// the step before has put in (filter.hpp). Errors that grow over many joints, each of which looks
// well, show in S of singularity.hpp alone, which costs more than a sweep. But masses and lengths
// decide whether they grow, more than the position does. So S is worked out once a robot, in
// float64, at home and at eight random positions: grows() where at one of them the sweep sees
// nothing although
//   D(k) <= 2^14 u scale(k)           64 times what is called nearly singular
// Every state of such a robot gets a second look. It is none of those that ship (test_scenes),
// and no chain of 1000 links, random or straight (test_rounding_growth).
//
// A robot on which errors grow only far from all nine positions is not found. About 7 us a joint.
#pragma once

#include <numbers>
#include <random>

#include "algorithms/fast/factors/factors.hpp"
#include "algorithms/inverse_mass/singularity.hpp"

namespace kalmarm {

template <class S>
class RoundingGrowth {
 public:
  RoundingGrowth(const Model<S>& model, const LoweredModel<S>& structured)
      : structured_(structured),
        model_(model.template cast<double>()),
        rm_(model_),
        scale_(model_),
        factors_(structured),
        q_(model.nq()) {}

  bool grows();

 private:
  // Angles all around; slides and the origins of free joints within 1 m.
  void draw_position(bool home) {
    const auto draw = [&] { return home ? 0 : static_cast<double>(random_()) * 0x1p-63 - 1; };
    for (int k = 0; k < model_.nv(); ++k) {
      const Joint<double>& joint = model_.joint(k);
      const double range = joint.coordinate == Coordinate::angle ? std::numbers::pi : 1;
      for (int i = 0; i < q_entries(joint.coordinate); ++i)
        q_[joint.q_index + i] = S(joint.ref + range * draw());
      if (home && joint.coordinate == Coordinate::quaternion) q_[joint.q_index] = S(1);
    }
  }

  bool grows_here();

  const LoweredModel<S>& structured_;
  Model<double> model_;
  RandomModel<double> rm_;
  RoundingScale<double> scale_;
  FastFactors<S> factors_;
  VectorX<S> q_;
  std::mt19937_64 random_;
};

template <class S>
bool RoundingGrowth<S>::grows() {
  constexpr int affordable = 10'000;  // joints, beyond which it is home alone
  const int positions = model_.nv() <= affordable ? 9 : 1;
  for (int i = 0; i < positions; ++i) {
    const bool home = i == 0;
    draw_position(home);
    if (grows_here()) return true;
  }
  return false;
}

template <class S>
bool RoundingGrowth<S>::grows_here() {
  covariance_factor(structured_, q_.data(), factors_);
  if (!(factors_.margin > S(0))) return false;
  set_position(model_, q_, rm_);
  scale_.begin(model_);
  const double bound = 0x1p14 * static_cast<double>(unit_roundoff<S>());
  for (int k = model_.nv() - 1; k >= 0; --k) {
    const Joint<double>& joint = model_.joint(k);
    const double D = scale_.P[k](joint.axis(), joint.axis()) + joint.r;
    if (!(D > bound * scale_.scale(model_, k))) return true;
    if (joint.parent < 0) continue;
    Vector6<double> g = scale_.P[k].col(joint.axis()) / D;
    if (joint.r == 0) g[joint.axis()] = 1;
    scale_.propagate(model_, rm_.phi[k], k, g);
  }
  return false;
}

}  // namespace kalmarm
