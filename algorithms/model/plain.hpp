// Between Model<T> and the plain numbers of RobotModel, number by number: nothing is worked out, so
// that there and back again changes no bit.
#pragma once

#include <cmath>

#include "algorithms/model/model.hpp"
#include "algorithms/model/site.hpp"
#include "kalmarm/robot_model.hpp"

namespace kalmarm {

inline Eigen::Quaternion<double> quaternion_of(const std::array<double, 4>& wxyz) {
  return {wxyz[0], wxyz[1], wxyz[2], wxyz[3]};
}
// Whether its square of length is a number to divide by; a turn needs no more.
inline bool is_turn(const Eigen::Quaternion<double>& q) { return std::isnormal(q.squaredNorm()); }
inline std::array<double, 4> plain(const Eigen::Quaternion<double>& q) {
  return {q.w(), q.x(), q.y(), q.z()};
}
inline std::array<double, 3> plain(const Vector3<double>& v) { return {v[0], v[1], v[2]}; }

inline RobotModel plain(const Model<double>& model) {
  RobotModel out;
  for (int k = 0; k < model.nv(); ++k) {
    const Joint<double>& joint = model.joint(k);
    out.links.push_back({.parent = joint.parent,
                         .coordinate = joint.coordinate,
                         .slides = joint.slides,
                         .q_index = joint.q_index,
                         .reference = joint.ref,
                         .rotation = plain(joint.rotation),
                         .translation = plain(joint.translation),
                         .armature = joint.r,
                         .mass = joint.body.mass,
                         .center_of_mass = plain(joint.body.com),
                         .inertia_axes = plain(joint.body.axes),
                         .principal_moments = plain(joint.body.moments)});
  }
  out.names = model.names();
  out.nq = model.nq();
  out.gravity = plain(model.gravity());
  return out;
}

inline Model<double> model_of(const RobotModel& robot) {
  std::vector<Joint<double>> joints;
  joints.reserve(robot.links.size());
  for (const LinkParameters& link : robot.links)
    joints.push_back(
        {link.parent,
         link.slides,
         link.coordinate,
         link.q_index,
         link.reference,
         quaternion_of(link.rotation),
         Vector3<double>(link.translation.data()),
         link.armature,
         {link.mass, Vector3<double>(link.center_of_mass.data()), quaternion_of(link.inertia_axes),
          Vector3<double>(link.principal_moments.data())}});
  return {std::move(joints), robot.names, robot.nq, Vector3<double>(robot.gravity.data())};
}

inline Site<double> site_of(const Frame& frame) {
  return {frame.link, quaternion_of(frame.rotation), Vector3<double>(frame.translation.data())};
}
inline Frame plain(const Site<double>& site) {
  return {site.link, plain(site.rotation), plain(site.translation)};
}

}  // namespace kalmarm
