// Outcomes as NumPy records, and as exceptions.
#pragma once

#include <kalmarm/outcome.hpp>
#include <string>
#include <vector>

#include "arrays.hpp"

namespace kalmarm::python {

// Makes the dtype and the exception, as attributes of the module.
void bind_outcomes(nb::module_& module);

// What whoever called is given. With `status` the outcomes, as a record or an array of the inputs'
// leading dimensions, stand beside the result; else one state without an answer raises DynamicsError,
// and what warns is one RuntimeWarning, which says of rows how many and which. names: of the DoF.
nb::object answered(const Inputs& inputs, const nb::object& result, bool status,
                    const Outcome* outcomes, const std::vector<std::string>& names);

// Raises DynamicsError where there is no answer; a RuntimeWarning where it warns.
void check(const Inputs& inputs, const Outcome& outcome, const std::vector<std::string>& names);

}  // namespace kalmarm::python
