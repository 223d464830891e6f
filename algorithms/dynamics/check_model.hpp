// What Dynamics refuses to be made from. Each throws std::invalid_argument with the value.
#pragma once

#include "kalmarm/dynamics.hpp"

namespace kalmarm {

// With the DoF: a model that contradicts itself, what no robot can be, a number above `largest`.
void check_model(const RobotModel& model, double largest);

// A frame of a robot with nv links that is on none of them or has no pose; `what` begins the text.
void check_frame(const char* what, const Frame& frame, int nv);

void check_tolerance(double tolerance);

// Whether float holds all numbers of the links.
bool fits_float(const RobotModel& model);

}  // namespace kalmarm
