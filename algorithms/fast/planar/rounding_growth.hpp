// Do errors grow along this robot from joint to joint? The test of the planar sweep compares D(k)
// with what the step before has put in (planar_filter.hpp). Errors that grow over many joints, each of which looks
// well, show in S of rounding_scale.hpp alone, which costs more than a sweep. But masses and lengths
// decide whether they grow, more than the position does. So S is worked out once a robot, in
// float64, at home and at eight random positions, tips to base, as far as one of
//   D(k) <= threshold J(k)            this position is seen by the sweep, however rounding errs
//   D(k) <= 2^14 u scale(k)           grows(): 64 times what is called nearly singular
// Whether the sweep sees it is not asked of a sweep in S: once all digits are lost its D are noise,
// singular in one program and well in another. Every state of a robot on which errors grow gets a
// second look. It is none of those that ship (test_scenes), and no chain of 1000 links, random or
// straight (test_rounding_growth).
//
// A robot on which errors grow only far from all nine positions is not found. About 7 us a joint.
#pragma once

#include <numbers>
#include <random>
#include <vector>

#include "algorithms/model/rounding_scale.hpp"

namespace kalmarm {

template <class S>
class RoundingGrowth {
 public:
  explicit RoundingGrowth(const Model<S>& model)
      : model_(model.template cast<double>()),
        rm_(model_),
        scale_(model_),
        body_polar_(body_polar_moments(model_)),
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
        q_[joint.q_index + i] = joint.ref + range * draw();
      if (home && joint.coordinate == Coordinate::quaternion) q_[joint.q_index] = 1;
    }
  }

  bool grows_here();

  Model<double> model_;
  RandomModel<double> rm_;
  RoundingScale<double> scale_;
  std::vector<PolarMoment<double>> body_polar_, polar_;  // of the link alone, of all it carries
  VectorX<double> q_;
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
  set_position(model_, q_, rm_);
  scale_.begin(model_);
  polar_ = body_polar_;
  const auto threshold = static_cast<double>(least_D_over_size<S>(1));
  const double bound = 0x1p14 * static_cast<double>(unit_roundoff<S>());
  for (int k = model_.nv() - 1; k >= 0; --k) {
    const Joint<double>& joint = model_.joint(k);
    const double D = scale_.P[k](joint.axis(), joint.axis()) + joint.r;
    if (D <= threshold * polar_[k].size(joint)) return false;
    if (!(D > bound * scale_.scale(model_, k))) return true;
    if (joint.parent < 0) continue;
    Vector6<double> g = scale_.P[k].col(joint.axis()) / D;
    if (joint.r == 0) g[joint.axis()] = 1;
    scale_.propagate(model_, rm_.phi[k], k, g);
    polar_[joint.parent].add_child(polar_[k], rm_.phi[k].p);
  }
  return false;
}

}  // namespace kalmarm
