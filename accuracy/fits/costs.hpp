// The residuals of samples as Ceres cost functions over the blocks of parameters.hpp: with the
// factored derivatives, with Jets, and with central differences of the same templates.
#pragma once

#include <ceres/cost_function.h>

#include <memory>

#include "accuracy/fits/fit.hpp"
#include "accuracy/fits/parameters.hpp"
#include "accuracy/fits/residuals.hpp"

namespace kalmarm {

// Samples first to first + count - 1. `samples` has to outlive it.
std::unique_ptr<ceres::CostFunction> make_cost(const Mechanics<double>& robot,
                                               const FreeParameters& free, const Samples& samples,
                                               int first, int count, const ResidualOptions& options,
                                               Differentiation differentiation);

// R p - y over the columns p of the blocks: what a linear residual is reduced to.
std::unique_ptr<ceres::CostFunction> make_linear_cost(const FreeParameters& free,
                                                      const MatrixX<double>& R,
                                                      const VectorX<double>& y);

// weight (x - x0) of one block.
std::unique_ptr<ceres::CostFunction> make_prior(const VectorX<double>& x0, double weight);

}  // namespace kalmarm
