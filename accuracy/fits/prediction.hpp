// Torques that a robot needs for a motion, and how near they are to measured ones.
#pragma once

#include "accuracy/fits/parameters.hpp"
#include "accuracy/fits/samples.hpp"

namespace kalmarm {

// ID with friction of every sample, nv x count.
MatrixX<double> torques(const Mechanics<double>& robot, const Samples& samples);

// Normalised root mean square errors: of a joint against the root mean square of its measured
// torque (a joint that has less than a thousandth of the largest: against that), and over all.
struct TorqueError {
  double total = 0;
  VectorX<double> joints;
};
TorqueError torque_error(const Mechanics<double>& robot, const Samples& samples);

// Root mean square of every row, at least a thousandth of the largest; 1 where all are zero.
VectorX<double> row_sizes(const MatrixX<double>& measured);

// A scene's model with the friction of its file.
Mechanics<double> mechanics_of(const Scene& scene);

}  // namespace kalmarm
