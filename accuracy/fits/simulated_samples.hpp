// Samples of a hidden robot, which MuJoCo moves along an excitation.
#pragma once

#include "accuracy/fits/excitation.hpp"
#include "accuracy/fits/samples.hpp"

namespace kalmarm {

struct SimulationOptions {
  int count = 2000;
  double period = 10, speed = 2;  // excitation.hpp
  double noise = 0;               // standard deviation against the torque's root mean square
  std::uint64_t seed = 1;
};

struct SimulatedSamples {
  Samples train, test;  // test: a quarter as many along another motion, which is not optimised
  double condition;     // of the regressor along train
};

// Torques by MuJoCo's M and bias, with the file's friction; mass matrices as well.
SimulatedSamples simulate_samples(const Scene& hidden, const SimulationOptions& options);

// Throws InputError where two scenes do not have the same joints.
void check_same_joints(const Scene& robot, const Scene& hidden);

}  // namespace kalmarm
