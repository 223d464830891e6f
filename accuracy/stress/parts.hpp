// What the families are made with.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "accuracy/stress/families.hpp"
#include "robots/scene/generate.hpp"

namespace kalmarm::stress {

inline constexpr int base_links = 12;

inline const Vector3<double> down(0, 0, -9.81), in_plane(0, -9.81, 0);  // gravity [m/s^2]

// Exact turns: the next axis along the parent's x axis, and the axis after it back along z.
inline const Eigen::Quaternion<double> z_to_x(1, 1, 1, 1), x_to_z(1, -1, -1, -1);

struct Sweep {
  std::vector<double> quick, full;
};

// 10^first, 10^(first + step), ..., 10^last.
std::vector<double> decades(int first, int last, int step);

// Masses of ratio 1 to 1e24.
Sweep mass_ratios();

// The model in a random position, or in the given one; qd is random in both.
Case at_random(const Model<double>& model, std::uint64_t seed);
Case at(const Model<double>& model, const VectorX<double>& q, std::uint64_t seed);

Joints joints_of(const Model<double>& model);

// The model with other parameters: `change` leaves every joint its entries of q.
template <class Change>
Model<double> changed(const Model<double>& model, const Change& change) {
  Joints joints = joints_of(model);
  change(joints);
  return {std::move(joints), model.names(), model.nq(), model.gravity()};
}

// Springs of k and dampers of 2 sqrt(k), critical for a unit of inertia, in an implicit step of h
// (kalmarm/implicit_step.hpp): r = armature + h b + h^2 k, at a joint or at every hinge and slide.
void hold(Joint<double>& joint, double h, double k);
Model<double> held(const Model<double>& model, double h, double k);

// m and J times `factor`.
void make_heavy(RigidBody<double>& body, double factor);

// l and com times `factor`, J times its square.
void make_long(Joints& joints, int k, double factor);

// make_long, with m as the cube of the length.
void make_large(Joints& joints, int k, double factor);

// Families of the base model at a random position: `change` is given its joints and the value.
struct OnChain {
  FamilyKind kind;
  std::string name, parameter, describes;
  Sweep sweep;
  std::function<void(Joints& joints, double value)> change;
  std::vector<int> singular = {};
};
std::vector<Family> on_chain(const std::vector<OnChain>& all);

// A free body with four limbs of `links` hinges each: DoF 0 to 5, then limb by limb.
Model<double> torso(int links, std::uint64_t seed);

// Of the family `wild`.
Case wild_mechanism(std::uint64_t seed);

std::vector<Family> length_families();
std::vector<Family> mass_families();
std::vector<Family> geometry_families();
std::vector<Family> singular_families();
std::vector<Family> tree_families();
std::vector<Family> step_families();

}  // namespace kalmarm::stress
