// Mechanisms and states for the tests. Each seed gives another member of a family.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/model/model.hpp"

namespace kalmarm::test {

class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  double normal() { return std::normal_distribution<double>()(engine_); }
  int below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(engine_); }
  bool chance(double p) { return uniform(0, 1) < p; }
  VectorX<double> vector(int n) {
    return VectorX<double>::NullaryExpr(n, [this] { return normal(); });
  }
  Vector3<double> vector3() { return vector(3); }
  Eigen::Quaterniond quaternion() {  // of any length
    return Eigen::Quaterniond(Eigen::Vector4d(vector(4)));
  }

 private:
  std::mt19937_64 engine_;
};

// Gyration radii of 10 to 24 cm, so that the moments satisfy the triangle inequality with room to
// spare.
inline RigidBody<double> random_body(Random& random) {
  const double x = random.uniform(0.005, 0.03), y = random.uniform(0.005, 0.03),
               z = random.uniform(0.005, 0.03);
  const double mass = std::exp(random.uniform(-0.7, 0.7));
  return {mass, 0.2 * random.vector3(), random.quaternion(),
          mass * Vector3<double>(y + z, x + z, x + y)};
}

inline RigidBody<double> point_mass(double mass, const Vector3<double>& at) { return {mass, at}; }

inline Joint<double> random_joint(Random& random, int parent,
                                  Coordinate coordinate = Coordinate::angle) {
  Joint<double> joint;
  joint.parent = parent;
  joint.slides = coordinate == Coordinate::distance;
  joint.coordinate = coordinate;
  joint.ref = random.uniform(-1, 1);
  joint.rotation = random.quaternion();
  joint.translation = 0.3 * random.vector3();
  joint.body = random_body(random);
  return joint;
}

// Lowers joints to DoF as model.hpp says. Every function returns the link to which the next joint
// is attached.
class Builder {
 public:
  // A hinge or a slide.
  int add(Joint<double> joint) {
    joint.q_index = nq_++;
    return push(joint);
  }

  // A hinge or a slide to a massless link.
  int add_massless(Joint<double> joint) {
    joint.body = {};
    return add(joint);
  }

  int add_ball(Joint<double> joint) {
    joint.coordinate = Coordinate::quaternion;
    joint.q_index = nq_;
    nq_ += 4;
    return push_triple(joint);
  }

  int add_free(Joint<double> joint) {
    Joint<double> position = joint;
    position.coordinate = Coordinate::position;
    position.slides = true;
    position.q_index = nq_;
    position.body = {};
    nq_ += 3;
    Joint<double> ball;
    ball.parent = push_triple(position);
    ball.body = joint.body;
    return add_ball(ball);
  }

  int nv() const { return static_cast<int>(joints_.size()); }

  Model<double> build(const Vector3<double>& gravity = {0.3, 0.1, -9.81}) const {
    std::vector<std::string> names;
    for (int k = 0; k < nv(); ++k) names.push_back("dof" + std::to_string(k));
    return Model<double>(joints_, names, nq_, gravity);
  }

 private:
  int push(const Joint<double>& joint) {
    joints_.push_back(joint);
    return nv() - 1;
  }

  // A first DoF, which reads q, and two followers; the last link has the body.
  int push_triple(Joint<double> joint) {
    const RigidBody<double> body = std::exchange(joint.body, {});
    Joint<double> follower;
    follower.slides = joint.slides;
    follower.coordinate = Coordinate::follower;
    follower.parent = push(joint);
    follower.parent = push(follower);
    follower.body = body;
    return push(follower);
  }

  std::vector<Joint<double>> joints_;
  int nq_ = 0;
};

inline Model<double> chain(std::uint64_t seed, int n = 12) {
  Random random(seed);
  Builder builder;
  for (int k = 0; k < n; ++k) builder.add(random_joint(random, k - 1));
  return builder.build();
}

// Any earlier link may be the parent: the order is not depth-first.
inline Model<double> tree(std::uint64_t seed) {
  Random random(seed);
  Builder builder;
  for (int k = 0; k < 16; ++k) builder.add(random_joint(random, k == 0 ? -1 : random.below(k)));
  return builder.build();
}

// Three trees with interleaved links.
inline Model<double> forest(std::uint64_t seed) {
  Random random(seed);
  Builder builder;
  for (int k = 0; k < 15; ++k) builder.add(random_joint(random, k < 3 ? -1 : k - 3));
  return builder.build();
}

// A free body that carries a tree with slides, armature and a ball joint.
inline Model<double> floating_base(std::uint64_t seed,
                                   const Vector3<double>& gravity = {0.3, 0.1, -9.81}) {
  Random random(seed);
  Builder builder;
  std::vector<int> links{builder.add_free(random_joint(random, -1))};
  for (int k = 0; k < 9; ++k) {
    Joint<double> joint = random_joint(random, links[random.below(static_cast<int>(links.size()))],
                                       k % 3 == 2 ? Coordinate::distance : Coordinate::angle);
    if (k % 4 == 1) joint.r = random.uniform(0.01, 0.1);
    links.push_back(k == 4 ? builder.add_ball(joint) : builder.add(joint));
  }
  return builder.build(gravity);
}

inline Model<double> ball_in_chain(std::uint64_t seed) {
  Random random(seed);
  Builder builder;
  int link = -1;
  for (int k = 0; k < 7; ++k) {
    const Joint<double> joint = random_joint(random, link);
    link = k == 3 ? builder.add_ball(joint) : builder.add(joint);
  }
  return builder.build();
}

inline Model<double> slides(std::uint64_t seed) {
  Random random(seed);
  Builder builder;
  for (int k = 0; k < 12; ++k)
    builder.add(
        random_joint(random, k - 1, random.chance(0.5) ? Coordinate::distance : Coordinate::angle));
  return builder.build();
}

inline Model<double> armature(std::uint64_t seed) {
  Random random(seed);
  Builder builder;
  for (int k = 0; k < 12; ++k) {
    Joint<double> joint = random_joint(random, k - 1);
    if (random.chance(0.5)) joint.r = std::exp(random.uniform(-5, 2));
    builder.add(joint);
  }
  return builder.build();
}

// Bodies on one to three hinges whose axes meet, with massless links between.
inline Model<double> massless_links(std::uint64_t seed) {
  Random random(seed);
  Builder builder;
  int link = -1;
  for (int body = 0; body < 6; ++body) {
    Joint<double> joint = random_joint(random, link);
    for (int extra = random.below(3); extra > 0; --extra) {
      joint.parent = builder.add_massless(joint);
      joint.rotation = random.quaternion();
      joint.translation.setZero();
    }
    link = builder.add(joint);
  }
  return builder.build();
}

inline Model<double> one_hinge(std::uint64_t seed) { return chain(seed, 1); }

inline Model<double> one_slide(std::uint64_t seed) {
  Random random(seed);
  Builder builder;
  builder.add(random_joint(random, -1, Coordinate::distance));
  return builder.build();
}

// Lengths 1, centres of mass in mid-link, gravity along -y: the arm of the textbooks.
inline Model<double> planar_two_link(std::uint64_t) {
  Builder builder;
  for (int k = 0; k < 2; ++k) {
    Joint<double> joint;
    joint.parent = k - 1;
    if (k == 1) joint.translation = {1, 0, 0};
    joint.body = {2.0 - k, {0.5, 0, 0}, {1, 0, 0, 0}, {0.001, 0.1, 0.1}};
    builder.add(joint);
  }
  return builder.build({0, -9.81, 0});
}

// Featherstone's autoTree, unbranched: unit masses and lengths, parallel axes. At q = 0 it is
// stretched out.
inline Model<double> straight_chain(int n) {
  Builder builder;
  for (int k = 0; k < n; ++k) {
    Joint<double> joint;
    joint.parent = k - 1;
    if (k > 0) joint.translation = {1, 0, 0};
    joint.body = {1, {0.5, 0, 0}, {1, 0, 0, 0}, {0.0025, 1.015 / 12, 1.015 / 12}};
    builder.add(joint);
  }
  return builder.build({0, -9.81, 0});
}

struct Family {
  const char* name;
  Model<double> (*make)(std::uint64_t seed);
};

inline const std::vector<Family>& families() {
  static const std::vector<Family> all{
      {"chain", [](std::uint64_t seed) { return chain(seed); }},
      {"tree", tree},
      {"forest", forest},
      {"floating_base", [](std::uint64_t seed) { return floating_base(seed); }},
      {"ball_in_chain", ball_in_chain},
      {"slides", slides},
      {"armature", armature},
      {"massless_links", massless_links},
      {"one_hinge", one_hinge},
      {"one_slide", one_slide},
      {"planar_two_link", planar_two_link},
      {"straight_chain", [](std::uint64_t) { return straight_chain(24); }},
  };
  return all;
}

template <class T>
struct State {
  VectorX<T> q, qd, tau;

  template <class U>
  State<U> cast() const {
    return {q.template cast<U>(), qd.template cast<U>(), tau.template cast<U>()};
  }
};

// Quaternions of any length.
inline State<double> random_state(const Model<double>& model, std::uint64_t seed) {
  Random random(seed);
  State<double> state{random.vector(model.nq()), random.vector(model.nv()),
                      random.vector(model.nv())};
  for (int k = 0; k < model.nv(); ++k)
    if (model.joint(k).coordinate == Coordinate::angle)
      state.q[model.joint(k).q_index] = random.uniform(-std::numbers::pi, std::numbers::pi);
  return state;
}

}  // namespace kalmarm::test
