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

// A body's distance from its prior, whatever its axes and units: half the sum of squares is
// weight^2 / 2 times the divergence of the pseudo-inertias (Lee, Wensing and Park, T-RO 2020)
//   d(J, J0) = tr(J0^-1 J) - log det(J0^-1 J) - 4 = |V|^2 - 2 sum of log V_ii - 4,   V = U0^-1 U
//   V = e^(alpha - alpha0) [S0^-1 S  S0^-1 (t - t0); 0 1]
std::unique_ptr<ceres::CostFunction> make_body_prior(const InertialVector<double>& x0,
                                                     double weight);

// weight (x - x0) / x0 of armature or friction; where x0 is zero, weight x.
std::unique_ptr<ceres::CostFunction> make_scalar_prior(const VectorX<double>& x0, double weight);

}  // namespace kalmarm
