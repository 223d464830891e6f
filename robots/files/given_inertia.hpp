// Inertias that no solid body has, but a robot's file does: with principal moments A <= B < C - A.
//
// M(k) = [[m 1, m c^], [-m c^, I - m c^ c^]] is positive definite wherever m and the moments of I
// about the centre of mass are, and nothing here asks for more; MuJoCo's compiler does, although its
// dynamics do not. So it compiles a ball in the place of such a body and is given the moments
// afterwards.
#pragma once

#include <mujoco/mujoco.h>

#include <vector>

#include "algorithms/spatial/spatial.hpp"

namespace kalmarm {

struct GivenInertia {
  const mjsBody* body;
  Vector3<double> moments;  // principal, about the centre of mass
};

// Puts balls in the places of the bodies of a stripped specification whose moments are positive and
// break A + B >= C, unless the file asks MuJoCo to balance them.
std::vector<GivenInertia> take_out_inertias(mjSpec* spec);

// What was taken out of the specification, into the model compiled from it; scaled as the compiler
// has scaled the mass.
void put_back(const std::vector<GivenInertia>& taken, mjModel* model);

}  // namespace kalmarm
