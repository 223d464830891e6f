// What identify does: data, fit, and whether the fit is usable.
//
// --simulate makes the data with MuJoCo from a hidden model: torques (and mass matrices) along an
// optimised trajectory, with noise; the last fifth is along another, random one, and is held out.
// Of --data the last fifth is held out. A fit is usable where the solver ended well, the data see a
// parameter, and the error of held-out torques is at most a tenth above the start's; data that hold
// a number above 1e30 are not fitted.
//
// Of the robot's file the fit starts from what is free, and takes as known what is not: inertias of
// bodies, armature, and of every joint damping and friction.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "accuracy/fits/differentiate.hpp"
#include "accuracy/fits/fit.hpp"
#include "accuracy/fits/prediction.hpp"
#include "accuracy/fits/simulated_samples.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm {

struct IdentificationOptions {
  std::string robot, data, hidden, out, json_out, samples_out;
  LoadOptions read;
  std::vector<std::string> free;
  FitOptions fit;
  SimulationOptions simulation;
  LocalPolynomial filter;  // of data that lack accelerations, or velocities too
  double start_error = 0, hold_out = 0.2;
};

struct Identification {
  Scene scene;
  // Of every link; of the columns that are fitted, in the frames of the file's bodies.
  std::vector<std::string> bodies, names;
  FreeParameters free;
  Mechanics<double> start;
  std::optional<Mechanics<double>> truth;  // of simulated data
  Samples train, test;
  Fit fit;
  bool usable = false;
  std::vector<std::string> known;     // of the file, "viscous friction of 2 joints"
  std::vector<std::string> findings;  // why it is not usable, and what else to free
  TorqueError before, after;          // of the test; after: where the solver's answer is usable
};

// Throws InputError where options, robot or data do not fit together.
Identification identify(const IdentificationOptions& options);

// The robot's file with what was fitted; `note` becomes a comment.
std::string fitted_file(const Identification& done, const std::string& note);

}  // namespace kalmarm
