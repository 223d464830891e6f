// Where a fit starts from: what is free, whether it is physical, and how a start is spoilt to see
// whether the fit finds its way back.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "accuracy/fits/parameters.hpp"

namespace kalmarm {

// Of names of bodies, "bodies" for all that are physical, "armature", "viscous" and "coulomb";
// `bodies` are the names of the model's links. Throws InputError with all names where there is
// another.
FreeParameters free_parameters(const std::vector<std::string>& names, const Model<double>& model,
                               const std::vector<std::string>& bodies);

// Throws InputError where a free body has no log-Cholesky coordinates: `name` is the scene's.
void check_physical(const Mechanics<double>& robot, const FreeParameters& free,
                    const std::vector<std::string>& bodies, const std::string& name);

// Multiplies masses, centres of mass and the radii's squares, as well as armature and friction, by
// 1 + error or 1 - error, as a random number says.
void spoil(const FreeParameters& free, double error, std::uint64_t seed, Mechanics<double>& robot);

}  // namespace kalmarm
