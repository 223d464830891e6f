// Mechanisms whose mass matrix is singular, and their regular neighbours.
//
// M is singular where some q' other than zero moves no mass and no rotor. What makes it so here
// does not depend on rounding: the parameters that matter are exact in float, or do not matter.
#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/test/models.hpp"

namespace kalmarm::test {

struct Mechanism {
  std::string name;
  Model<double> model;
  VectorX<double> q;
  std::vector<int> joints;  // that move while no mass does: the support of the null space of M
};

// A mechanism grown on a random chain of three hinges, so that the rest of the factorisation has
// something to do.
class Grown : public Builder {
 public:
  static constexpr int root = 2;  // last link of the chain

  explicit Grown(std::uint64_t seed) : random_(seed), seed_(seed) {
    for (int k = 0; k <= root; ++k) add(random_joint(random_, k - 1));
  }

  Joint<double> joint(int parent, Coordinate coordinate = Coordinate::angle) {
    return random_joint(random_, parent, coordinate);
  }

  // Another link whose axis is the parent's.
  Joint<double> coaxial(int parent) {
    Joint<double> joint = random_joint(random_, parent);
    joint.rotation = {0.7, 0, 0, 0.3};
    joint.translation = {0, 0, 0.4};
    return joint;
  }

  // At q = ref the axis is the parent's z axis turned by `turn`, and meets it in the origin.
  Joint<double> gimbal(int parent, const Eigen::Quaterniond& turn) {
    Joint<double> joint = random_joint(random_, parent);
    joint.rotation = turn;
    joint.translation.setZero();
    return joint;
  }

  // At random positions, or with hinges at their placement.
  Mechanism mechanism(std::string name, std::vector<int> joints, bool at_ref = false) const {
    const Model<double> model = build();
    VectorX<double> q = random_state(model, seed_ + 1).q;
    for (int k = 0; at_ref && k < model.nv(); ++k) q[model.joint(k).q_index] = model.joint(k).ref;
    return {std::move(name), model, q, std::move(joints)};
  }

  Random& random() { return random_; }

 private:
  Random random_;
  std::uint64_t seed_;
};

inline const Eigen::Quaterniond z_to_x(1, 1, 1, 1), x_to_z(1, -1, -1, -1);
inline const Eigen::Quaterniond ninths(1, 2, 2, 0);  // a rotation with entries in ninths

inline std::vector<Mechanism> singular_mechanisms(std::uint64_t seed) {
  std::vector<Mechanism> all;
  {
    Grown m(seed);
    m.add_massless(m.joint(m.root));
    all.push_back(m.mechanism("massless_tip", {3}));
  }
  {
    Grown m(seed);
    Joint<double> tip = m.joint(m.root);
    tip.body = point_mass(0.7, {0, 0, 0.3});
    m.add(tip);
    all.push_back(m.mechanism("point_mass_on_its_joint_axis", {3}));
  }
  {
    Grown m(seed);
    Joint<double> tip = m.joint(m.root);
    tip.body = {0.7, {0, 0, 0.3}, {1, 0, 0, 0}, {0.01, 0.01, 0}};
    m.add(tip);
    all.push_back(m.mechanism("rod_along_its_joint_axis", {3}));
  }
  {
    Grown m(seed);
    m.add(m.coaxial(m.add_massless(m.joint(m.root))));
    all.push_back(m.mechanism("massless_link_between_coaxial_hinges", {3, 4}));
  }
  {
    Grown m(seed);
    Joint<double> middle = m.joint(m.root);
    middle.body = point_mass(0.7, {0, 0, 0.2});
    const int tip = m.add(m.coaxial(m.add(middle)));
    m.add(m.joint(m.add(m.joint(tip))));
    all.push_back(m.mechanism("point_mass_between_coaxial_hinges", {3, 4}));
  }
  {
    Grown m(seed);
    Joint<double> outer = m.coaxial(m.add_massless(m.joint(m.root, Coordinate::distance)));
    outer.slides = true;
    outer.coordinate = Coordinate::distance;
    m.add(outer);
    all.push_back(m.mechanism("massless_link_between_parallel_slides", {3, 4}));
  }
  {
    Grown m(seed);
    const int middle = m.add_massless(m.gimbal(m.add_massless(m.joint(m.root)), z_to_x));
    m.add(m.gimbal(middle, x_to_z));
    all.push_back(m.mechanism("gimbal_lock", {3, 5}, true));
  }
  {
    Grown m(seed);
    const int middle = m.add_massless(m.gimbal(m.add_massless(m.joint(m.root)), ninths));
    m.add(m.gimbal(middle, ninths.conjugate()));
    all.push_back(m.mechanism("oblique_gimbal_lock", {3, 5}, true));
  }
  {
    Grown m(seed);
    const int middle = m.add_massless(m.gimbal(m.add_massless(m.joint(m.root)), z_to_x));
    Joint<double> tip = m.gimbal(middle, z_to_x);
    tip.body = point_mass(0.7, {0.1, 0.2, 0.3});
    m.add(tip);
    all.push_back(m.mechanism("point_mass_on_three_hinges_that_meet", {3, 4, 5}));
  }
  {
    Grown m(seed);
    Joint<double> ball = m.joint(m.root);
    ball.body = point_mass(0.7, {0.1, 0.2, 0.3});
    m.add_ball(ball);
    all.push_back(m.mechanism("point_mass_on_a_ball_joint", {3, 4, 5}));
  }
  {
    Builder m;
    Random random(seed);
    Joint<double> free = random_joint(random, -1);
    free.body = point_mass(0.7, {0.1, 0.2, 0.3});
    m.add_free(free);
    const Model<double> model = m.build();
    all.push_back({"free_point_mass", model, random_state(model, seed + 1).q, {0, 1, 2, 3, 4, 5}});
  }
  {
    Grown m(seed);
    Joint<double> hinge = m.joint(m.add_massless(m.joint(m.root, Coordinate::distance)));
    hinge.r = 0.1;
    m.add_massless(hinge);
    all.push_back(m.mechanism("slide_with_massless_outboard_side", {3}));
  }
  {
    // The tip's point mass lies on the axis of joint 3. All lengths are integers and M(3,3) = 0,
    // but it comes out as the rounding error of a sum of terms that cancel.
    Grown m(seed);
    const auto integer = [&m] { return m.random().below(17) - 8.0; };
    const Vector3<double> origin(1 + m.random().below(8), 1 + m.random().below(8), integer());
    const Vector3<double> on_axis(0, 0, integer());
    Matrix3<double> nine_R;
    nine_R << 1, 8, 4, 8, 1, -4, -4, 4, -7;
    Joint<double> tip = m.joint(m.add_massless(m.joint(m.root)));
    tip.rotation = ninths;
    tip.translation = 9 * origin;
    tip.body = point_mass(0.7, nine_R.transpose() * (on_axis - origin));
    m.add(tip);
    all.push_back(m.mechanism("point_mass_on_an_inner_axis", {3}, true));
  }
  return all;
}

// The same joints, all with armature.
inline Mechanism with_armature(const Mechanism& mechanism, double r) {
  std::vector<Joint<double>> joints;
  for (int k = 0; k < mechanism.model.nv(); ++k) {
    joints.push_back(mechanism.model.joint(k));
    joints.back().r = r;
  }
  const Model<double>& model = mechanism.model;
  return {mechanism.name, {joints, model.names(), model.nq(), model.gravity()}, mechanism.q, {}};
}

inline std::vector<Mechanism> regular_mechanisms(std::uint64_t seed) {
  std::vector<Mechanism> all;
  for (const Mechanism& mechanism : singular_mechanisms(seed))
    all.push_back(with_armature(mechanism, 0.1));
  {
    Grown m(seed);
    m.add(m.joint(m.add_massless(m.joint(m.root))));
    all.push_back(m.mechanism("massless_link_between_oblique_hinges", {}));
  }
  {
    Grown m(seed);
    Joint<double> tip = m.joint(m.root);
    tip.body = point_mass(0.7, {0.01, 0, 0.3});
    m.add(tip);
    all.push_back(m.mechanism("point_mass_off_its_joint_axis", {}));
  }
  {
    Grown m(seed);
    const Eigen::Quaterniond nearly(std::cos(0.01), std::sin(0.01), 0, 0);
    m.add(m.gimbal(m.add_massless(m.joint(m.root)), nearly));
    all.push_back(m.mechanism("massless_link_between_nearly_parallel_hinges", {}));
  }
  return all;
}

}  // namespace kalmarm::test
