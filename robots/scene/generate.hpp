// Parts of mechanisms that programs make, from exact parameters or from a seed.
#pragma once

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/uniform_int_distribution.hpp>
#include <boost/random/uniform_on_sphere.hpp>
#include <boost/random/uniform_real_distribution.hpp>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "algorithms/model/model.hpp"

namespace kalmarm {

using Joints = std::vector<Joint<double>>;

// Names the joints and gives them their entries of q, in order.
Model<double> assemble(Joints joints, const Vector3<double>& gravity);

// Adds a joint of three DoF, a ball or the translations of a free body: `first` is its first DoF,
// two followers come after it, and the last of the three links has the body.
void add_three(Joints& joints, Joint<double> first);

// autoTree of Featherstone's spatial_v2 without taper: links of length and mass 1. The axes of a
// link and its parent are at an angle of `skew` [rad].
Model<double> auto_tree(int links, int branching, double skew, const Vector3<double>& gravity);

// Turns, offsets and inertias of the random mechanisms.
class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed) {}

  Eigen::Quaternion<double> turn() {  // Rz(beta) Rx(alpha)
    const double alpha = angle_(random_), beta = angle_(random_);
    return Eigen::Quaternion<double>(std::cos(beta / 2), 0, 0, std::sin(beta / 2)) *
           Eigen::Quaternion<double>(std::cos(alpha / 2), std::sin(alpha / 2), 0, 0);
  }

  Vector3<double> direction() {
    const std::vector<double> d = direction_(random_);
    return {d[0], d[1], d[2]};
  }

  // The com is at the middle of an offset of unit length; masses are log-uniform up to `heaviest`.
  RigidBody<double> body(double heaviest) {
    const Vector3<double> offset = direction();
    RigidBody<double> body;
    body.mass = heaviest == 1 ? 1 : std::pow(heaviest, share_(random_));
    body.com = offset / 2;
    do {
      for (double& entry : body.moments) entry = moment_(random_);
    } while (2 * body.moments.maxCoeff() > body.moments.sum());
    return body;
  }

  int below(int n) { return boost::random::uniform_int_distribution<int>(0, n - 1)(random_); }
  bool chance(double p) { return share_(random_) < p; }

  // 10^x with x uniform.
  double power_of_ten(double low, double high) {
    return std::pow(10, low + (high - low) * share_(random_));
  }

 private:
  boost::random::mt19937_64 random_;
  boost::random::uniform_real_distribution<double> angle_{-std::numbers::pi, std::numbers::pi};
  boost::random::uniform_real_distribution<double> moment_{0.04, 0.12};
  boost::random::uniform_real_distribution<double> share_{0, 1};
  boost::random::uniform_on_sphere<double, std::vector<double>> direction_{3};
};

}  // namespace kalmarm
