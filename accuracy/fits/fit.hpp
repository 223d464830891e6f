// Fits a robot's parameters to samples, with Ceres: Levenberg and Marquardt on the residuals of
// residuals.hpp in the coordinates of parameters.hpp.
//
// What the data do not see is held near the start, the prior, and all bodies inside of what is
// physical: the divergence of costs.hpp is added with a weight w that falls from 1e-1 to 1e-7 of
// the size of the data's rows, round by round. In the last round it is what was asked for; 0: none,
// and the steps of Levenberg and Marquardt, now quadratically convergent, move nothing that the
// data do not see. (From 1e-1 to none in one round, bodies end on the boundary, and hundreds of
// steps bring them back.) A residual that is linear in the columns is reduced to the triangle of
// its Jacobian before. The likelihood's sigma is estimated from w'w between rounds.
#pragma once

#include <string>
#include <vector>

#include "accuracy/fits/residuals.hpp"

namespace kalmarm {

enum class Differentiation { analytic, automatic, numeric };

struct FitOptions {
  Residual residual = Residual::inverse_dynamics;
  Differentiation differentiation = Differentiation::analytic;
  double prior = 0;        // weight of the start's values against the data, in the end
  double mass_within = 0;  // masses stay within this factor of the start; 0: any
  double com_within = 0;   // centres of mass stay this near to the start [m]; 0: anywhere
  int iterations = 200;    // at most, in a round
};

struct Iteration {
  int round;
  double cost, gradient, seconds;
  VectorX<double> values;  // columns
};

struct Fit {
  Mechanics<double> robot;
  std::vector<Iteration> iterations;
  bool usable = false, converged = false;
  std::string message;  // the solver's
  double seconds = 0;
  double sigma = 0;            // root mean square of the residuals
  MatrixX<double> R;           // triangle of J over the columns, at the solution
  MatrixX<double> covariance;  // of the columns, where the data see them
};

Fit fit(const Mechanics<double>& start, const FreeParameters& free, const Samples& samples,
        const FitOptions& options);

// Of the residuals, a row of them; of the likelihood's those of w alone.
double root_mean_square(const Mechanics<double>& robot, const Samples& samples,
                        const ResidualOptions& options);

}  // namespace kalmarm
