// Mechanisms close to those that can move without moving any mass, and some that only look so.
#include "accuracy/stress/parts.hpp"
#include "robots/scene/families.hpp"

namespace kalmarm::stress {
namespace {

// A body of that mass and com, and of the same radius of gyration about every axis.
RigidBody<double> ball(double mass, const Vector3<double>& com, double gyration) {
  return {mass, com, {1, 0, 0, 0}, Vector3<double>::Constant(mass * gyration * gyration)};
}

void point_on_axis(Joints& joints, double off) { joints[11].body = ball(1, {off, 0, 0.5}, 0); }

void rod_on_axis(Joints& joints, double tilt) {
  joints[11].body = {1, {0, 0, 0.5}, {1, tilt / 2, 0, 0}, {0.1, 0.1, 0}};
}

void coaxial(Joints& joints, double gap) {
  joints[5].body = {};
  joints[6].rotation = {1, 0, 0, 0};
  joints[6].translation = {gap, 0, 0.4};
}

// Joint k turns about a point on its parent's axis, at a right angle to it; no mass between.
void meet(Joints& joints, int k, const Eigen::Quaternion<double>& turn) {
  joints[k - 1].body = {};
  joints[k].rotation = turn;
  joints[k].translation.setZero();
}

void point_on_ball(Joints& joints, double gyration) {
  meet(joints, 10, z_to_x);
  meet(joints, 11, z_to_x);
  joints[11].body = ball(1, joints[11].body.com, gyration);
}

void massless_slide(Joints& joints, double mass) {
  joints[10].slides = true;
  joints[10].coordinate = Coordinate::distance;
  make_heavy(joints[10].body, mass);
  make_heavy(joints[11].body, mass);
  joints[11].r = 0.1;
}

// The middle joint tells how far the outer two axes are from being one.
Case gimbal_lock(double angle, std::uint64_t seed) {
  Case out = at_random(changed(random_chain(base_links, seed, 1),
                               [](Joints& joints) {
                                 meet(joints, 6, z_to_x);
                                 meet(joints, 7, x_to_z);
                               }),
                       seed);
  out.q[6] = angle;
  return out;
}

}  // namespace

std::vector<Family> singular_families() {
  Sweep sweep = {{0, 1e-16, 1e-8, 1e-4, 0.1}, decades(-16, -1, 1)};
  sweep.full.insert(sweep.full.begin(), 0);
  std::vector<Family> all = on_chain({
      {FamilyKind::singular,
       "point_on_axis",
       "distance from the axis [m]",
       "The last link is a point on its own axis.",
       sweep,
       point_on_axis,
       {11}},
      {FamilyKind::singular,
       "rod_on_axis",
       "tilt [rad]",
       "The last link is a rod along its own axis.",
       sweep,
       rod_on_axis,
       {11}},
      {FamilyKind::singular,
       "coaxial",
       "gap [m]",
       "Two axes in one line, no mass between them.",
       sweep,
       coaxial,
       {5, 6}},
      {FamilyKind::singular,
       "point_on_ball",
       "radius of gyration [m]",
       "A point mass on three axes that meet.",
       sweep,
       point_on_ball,
       {9, 10, 11}},
      {FamilyKind::singular,
       "massless_tip",
       "mass [kg]",
       "The last link has no mass.",
       sweep,
       [](Joints& joints, double mass) { make_heavy(joints[11].body, mass); },
       {11}},
      {FamilyKind::singular,
       "massless_slide",
       "mass [kg]",
       "A slide that carries no mass.",
       sweep,
       massless_slide,
       {10}},
      {FamilyKind::singular, "massless_oblique", "mass [kg]",
       "No mass between two oblique axes, which is no harm.", sweep,
       [](Joints& joints, double mass) { make_heavy(joints[5].body, mass); }},
      {FamilyKind::singular, "point_off_axis", "radius of gyration [m]",
       "The last link is a point off its axis, which is no harm.", sweep,
       [](Joints& joints, double gyration) {
         joints[11].body = ball(1, joints[11].body.com, gyration);
       }},
  });
  all.push_back({FamilyKind::singular,
                 "gimbal_lock",
                 "angle from lock [rad]",
                 "Three axes that meet, the outer two in line, no mass between them.",
                 true,
                 sweep.quick,
                 sweep.full,
                 gimbal_lock,
                 {5, 7}});
  return all;
}

}  // namespace kalmarm::stress
