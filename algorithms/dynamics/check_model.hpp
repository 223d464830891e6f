// What Dynamics refuses to be made from. Each throws std::invalid_argument with the value.
#pragma once

#include "kalmarm/dynamics.hpp"

namespace kalmarm {

// With the DoF: a model that contradicts itself, what no robot can be, a number above `largest`.
void check_model(const RobotModel& model, double largest);

void check_tolerance(double tolerance);

// Whether float holds all numbers of the links.
bool fits_float(const RobotModel& model);

}  // namespace kalmarm
