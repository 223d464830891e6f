// What a plan costs a call, by the fast path in one of its forms.
#pragma once

#include "algorithms/dynamics/plan.hpp"

namespace kalmarm {

// Additions, multiplications and divisions of one call for one kind of answer. Forward dynamics,
// factors and the diagonal are counted by running them; columns of M^-1 and chosen blocks are what
// their headers say, a link and column.
double flops(const Plan& plan, Want want, Form form = Form::conventional);

// The same of a whole robot, by the default rules that the form can follow.
double flops_of(const Model<double>& model, Want want, Form form);

}  // namespace kalmarm
