// Outcomes as NumPy records, and as exceptions.
#pragma once

#include <kalmarm/outcome.hpp>
#include <string>
#include <vector>

#include "arrays.hpp"

namespace kalmarm::python {

// Makes the dtype and the exception, as attributes of the module.
void bind_outcomes(nb::module_& module);

// A record of one outcome, or an array of the inputs' leading dimensions.
nb::object record_of(const Inputs& inputs, const Outcome* outcomes);

// Raises DynamicsError.
[[noreturn]] void raise(const char* call, const Outcome& outcome,
                        const std::vector<std::string>& names);
// RuntimeWarning, of an outcome that warns.
void warn(const char* call, const Outcome& outcome, const std::vector<std::string>& names);

}  // namespace kalmarm::python
