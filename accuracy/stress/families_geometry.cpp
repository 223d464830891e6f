// Lengths, axes and shapes; joint noise; units.
#include <cmath>
#include <numbers>
#include <utility>

#include "accuracy/stress/parts.hpp"
#include "robots/scene/families.hpp"

namespace kalmarm::stress {
namespace {

void taper(Joints& joints, double s) {
  const int n = static_cast<int>(joints.size());
  for (int k = 0; k < n; ++k) make_large(joints, k, std::pow(s, k / (n - 1.0)));
}

void short_links(Joints& joints, double length) {
  for (std::size_t k = 1; k < joints.size(); k += 2) make_long(joints, static_cast<int>(k), length);
}

void light_links(Joints& joints, double length) {
  for (std::size_t k = 1; k < joints.size(); k += 2)
    make_large(joints, static_cast<int>(k), length);
}

void base_offset(Joints& joints, double offset) {
  joints[0].translation = offset / 3 * Vector3<double>(1, 2, 2);
}

void axis_gap(Joints& joints, double gap) {
  make_heavy(joints[5].body, 1e-30);
  joints[6].rotation.setIdentity();
  joints[6].translation = {gap, 0, 0};
}

void point_masses(Joints& joints, double scale) {
  for (Joint<double>& joint : joints) joint.body.moments *= scale;
}

void rods(Joints& joints, double scale) {
  for (Joint<double>& joint : joints) {
    RigidBody<double>& body = joint.body;
    body.axes.setFromTwoVectors(Vector3<double>::UnitX(), body.com);
    body.moments = {scale * body.moments[0], body.moments[1], body.moments[1]};
  }
}

void armature(Joints& joints, double r) {
  for (Joint<double>& joint : joints) joint.r = r;
}

void armature_heavy_tip(Joints& joints, double r) {
  armature(joints, r);
  make_heavy(joints.back().body, 1e12);
}

void stiff(Joints& joints, double stiffness) {
  constexpr double step = 1e-3, rotor = 0.01;  // h [s], [kg m^2]
  const double damping = 2 * std::sqrt(stiffness);
  for (std::size_t k = 1; k < joints.size(); k += 2)
    joints[k].r = rotor + step * damping + step * step * stiffness;
}

Case far_com(double distance, std::uint64_t seed) {
  Joints joints(3);
  for (int k = 0; k < 3; ++k) {
    joints[k].parent = k - 1;
    joints[k].rotation = z_to_x;
  }
  joints[2].body = Draw(seed).body(1);
  joints[2].body.com *= 2 * distance;
  Case out = at_random(assemble(std::move(joints), down), seed);
  out.q /= std::numbers::pi;  // the three axes are in one plane only at q_2 = +-pi/2
  return out;
}

Case skew(double angle, std::uint64_t seed) {
  return at_random(auto_tree(base_links, 1, angle, down), seed);
}

Case mass_unit(double unit, std::uint64_t seed) {
  return at_random(changed(random_chain(base_links, seed, 1),
                           [&](Joints& joints) {
                             for (Joint<double>& joint : joints) make_heavy(joint.body, unit);
                           }),
                   seed);
}

Case length_unit(double unit, std::uint64_t seed) {
  Joints joints = joints_of(random_chain(base_links, seed, 1));
  for (int k = 0; k < base_links; ++k) make_long(joints, k, unit);
  return at_random(assemble(std::move(joints), unit * down), seed);
}

}  // namespace

std::vector<Family> geometry_families() {
  const Sweep large = {decades(0, 8, 2), decades(0, 16, 1)};
  const Sweep small = {decades(-16, 0, 4), decades(-24, 0, 2)};
  const Sweep noise = {decades(-9, 12, 7), decades(-9, 12, 3)};
  std::vector<Family> all = on_chain({
      {FamilyKind::heavy_inboard,
       "taper",
       "length of the last link [m]",
       "A chain that tapers off towards the tip.",
       {decades(-6, 0, 2), decades(-7, 0, 1)},
       taper},
      {FamilyKind::heavy_outboard,
       "inverse_taper",
       "length of the last link [m]",
       "A chain that grows towards the tip.",
       {decades(0, 6, 2), decades(0, 7, 1)},
       taper},
      {FamilyKind::uneven_lengths,
       "short_links",
       "length of every other link [m]",
       "A chain in which every other link is short, and as heavy as the others.",
       {decades(-8, 0, 2), decades(-16, 0, 2)},
       short_links},
      {FamilyKind::uneven_lengths,
       "light_links",
       "length of every other link [m]",
       "A chain in which every other link is small and light.",
       {decades(-6, 0, 2), decades(-7, 0, 1)},
       light_links},
      {FamilyKind::uneven_lengths, "base_offset", "offset [m]",
       "A chain far from the origin of the world.", large, base_offset},
      {FamilyKind::near_parallel_axes,
       "axis_gap",
       "gap [m]",
       "Two parallel axes close together, almost no mass between them.",
       {decades(-8, 0, 2), decades(-8, 0, 1)},
       axis_gap},
      {FamilyKind::point_masses, "point_masses", "scale of the inertias",
       "A chain of links that shrink to points.", small, point_masses},
      {FamilyKind::point_masses, "rods", "scale of the inertias",
       "A chain of links that shrink to rods.", small, rods},
      {FamilyKind::joint_noise, "armature", "armature [kg m^2]",
       "The same armature on every joint of a chain.", noise, armature},
      {FamilyKind::joint_noise, "armature_heavy_tip", "armature [kg m^2]",
       "The same armature on every joint of a chain whose last link weighs 1e12.", noise,
       armature_heavy_tip},
      {FamilyKind::joint_noise,
       "stiff",
       "stiffness [N m/rad]",
       "Springs and dampers on every other joint, in an implicit step of 1 ms.",
       {decades(0, 12, 3), decades(0, 12, 1)},
       stiff},
  });
  const auto add = [&](FamilyKind kind, const char* name, const char* parameter,
                       const char* describes, const Sweep& sweep, const auto& make) {
    all.push_back({kind, name, parameter, describes, true, sweep.quick, sweep.full, make});
  };
  add(FamilyKind::uneven_lengths, "far_com", "distance of the com [m]",
      "A body that turns about a point far from its com.", {decades(0, 8, 2), decades(0, 12, 1)},
      far_com);
  add(FamilyKind::near_parallel_axes, "skew", "angle between axes [rad]",
      "A chain whose axes are almost parallel.", small, skew);
  add(FamilyKind::units, "mass_unit", "kilograms in a unit", "A chain in other units of mass.",
      {decades(-30, 30, 15), decades(-160, 160, 20)}, mass_unit);
  add(FamilyKind::units, "length_unit", "metres in a unit", "A chain in other units of length.",
      {decades(-14, 14, 7), decades(-80, 80, 10)}, length_unit);
  return all;
}

}  // namespace kalmarm::stress
