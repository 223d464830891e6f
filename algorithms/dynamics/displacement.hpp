// q moved along a velocity for a time: what `integrate` and implicit steps share. It is defined in
// configuration.cpp.
#pragma once

#include "kalmarm/robot_model.hpp"

namespace kalmarm {

// q_next (nq) = q [+] h v by (1) and (2) of kalmarm/configuration.hpp; q_next may be q.
template <class T>
void displace(const RobotModel& model, const T* q, const T* v, double h, T* q_next);

}  // namespace kalmarm
