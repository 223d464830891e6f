// Positions on NumPy arrays: the calls of kalmarm/configuration.hpp, of one state or of as many as
// leading dimensions say. None of them fails: what is not finite passes.
#pragma once

#include "robot.hpp"

namespace kalmarm::python {

void bind_configuration(nb::class_<Robot>& robot);

}  // namespace kalmarm::python
