// Inertias that no solid body has, but a robot's file does: with principal moments A <= B < C - A, of
// flat bodies (A + B = C) to rounding, of rods and points with zero moments, of rotors that have a
// tensor and no mass, of links with joints and without either.
//
// M(k) = [[m 1, m c^], [-m c^, I - m c^ c^]] is positive semidefinite wherever m and the moments of
// I about the centre of mass are not negative, and nothing here asks for more; MuJoCo's compiler does,
// although its dynamics do not. So it compiles a ball in the place of such a body and is given mass and
// moments afterwards. Where a joint moves no inertia at all, M is singular, and whoever asks is told.
//
// Balanced instead: with the second moments s_i = (A + B + C)/2 - moment_i, which a solid body has
// not negative, the nearest body has max(s_i, s_max/10^4) and from them its moments, on the same
// axes: a rod a hundred times as long as it is thick, where only one was positive.
#pragma once

#include <mujoco/mujoco.h>

#include <string>
#include <vector>

#include "algorithms/spatial/inertia.hpp"

namespace kalmarm {

struct GivenInertia {
  const mjsBody* body;
  RigidBody<double> given;  // in the inertial frame

  // Some solid body, which may be flat, has it, within the digits that files have.
  bool is_of_solid() const;
};

// Puts balls in the places of such bodies of a stripped specification; where there are any, or who asks
// keeps all bodies, none is fused. Throws InputError where a mass is
// negative, or a moment by more than rounding.
std::vector<GivenInertia> take_out_inertias(mjSpec* spec, bool keeps_bodies);

// What was taken out of the specification, into the model compiled from it, scaled to the total mass
// that the file sets. Throws InputError where it sets one and no body has a mass.
void put_back(const std::vector<GivenInertia>& taken, const mjSpec* spec, mjModel* model);

// Makes the inertias of moving bodies those of the nearest solid bodies. Returns a line that says
// which and how, "" where there is none.
std::string balance_inertias(mjSpec* spec);

}  // namespace kalmarm
