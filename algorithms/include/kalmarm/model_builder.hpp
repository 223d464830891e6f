// A robot built by hand: bodies, each on a joint on its parent.
//
//   kalmarm::ModelBuilder builder;
//   const int arm = builder.add_body({.name = "arm", .joint = kalmarm::JointType::hinge,
//                                     .axis = {0, 1, 0}, .mass = 2, .center_of_mass = {0, 0, 0.3},
//                                     .inertia = {0.06, 0.06, 0.002}});
//   kalmarm::RobotModel model = builder.build();
#pragma once

#include <array>
#include <memory>
#include <string>

#include "kalmarm/export.hpp"
#include "kalmarm/robot_model.hpp"

namespace kalmarm {

enum class JointType { fixed, hinge, slide, ball, free };

// A body and the joint on its inboard side. The body's frame has its origin on the joint; at
// q = reference it stands at `position` and `rotation` in its parent's frame.
struct BodyParameters {
  std::string name = {};
  int parent = -1;  // as add_body returned it; -1: the fixed base
  JointType joint = JointType::fixed;
  std::array<double, 3> axis = {0, 0, 1};         // of a hinge or slide, in the body's frame
  std::array<double, 3> position = {0, 0, 0};     // [m]
  std::array<double, 4> rotation = {1, 0, 0, 0};  // (w, x, y, z), of any length but zero
  double reference = 0;                           // of a hinge or slide [rad or m]
  double armature = 0;  // of each DoF: reflected rotor inertia [kg m^2 or kg]
  double mass = 0;      // [kg]
  std::array<double, 3> center_of_mass = {0, 0, 0};    // in the body's frame [m]
  std::array<double, 6> inertia = {0, 0, 0, 0, 0, 0};  // xx, yy, zz, xy, xz, yz about the
                                                       // centre of mass [kg m^2]
  bool solid = true;  // else moments A <= B < C - A, which no body has, are taken as given
};

class KALMARM_EXPORT ModelBuilder {
 public:
  ModelBuilder();
  ~ModelBuilder();
  ModelBuilder(ModelBuilder&&) noexcept;
  ModelBuilder& operator=(ModelBuilder&&) noexcept;

  // Returns the body's number. A body that is fixed becomes part of its parent. DoF and entries of
  // q are numbered in the order of the bodies. Throws std::invalid_argument, with the body and the
  // value: a number that is not finite, a mass or armature below zero, moments of inertia that no
  // body can have, an axis or quaternion of no length, a parent that is not there. Of a builder that
  // was moved from every call throws std::logic_error.
  int add_body(const BodyParameters& body);

  // (0, 0, -9.81) m/s^2 unless set. Throws std::invalid_argument where it is not finite.
  void set_gravity(const std::array<double, 3>& gravity);

  int nq() const;
  int nv() const;
  int first_dof(int body) const;  // of its joint; -1: it is fixed
  int first_q(int body) const;

  // The body's frame, for Question::frames.
  Frame frame(int body) const;

  [[nodiscard]] RobotModel build() const;

 private:
  struct State;
  State& state() const;  // throws std::logic_error where it was moved away
  std::unique_ptr<State> state_;
};

}  // namespace kalmarm
