#include "accuracy/fits/start.hpp"

#include <algorithm>
#include <boost/random/mersenne_twister.hpp>
#include <cmath>
#include <set>

#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

[[noreturn]] void refuse_free(const std::string& name, const std::vector<std::string>& known) {
  std::string names;
  for (const std::string& one : known) names += ", " + one;
  throw InputError("--free " + name + ": is none of armature, viscous, coulomb" + names);
}

bool is_physical(const SpatialInertia<double>& M) { return to_log_cholesky(M).allFinite(); }

}  // namespace

FreeParameters free_parameters(const std::vector<std::string>& names, const Model<double>& model,
                               const std::vector<std::string>& bodies) {
  FreeParameters out;
  std::vector<int> massive, physical, all;
  std::vector<std::string> known;
  for (int k = 0; k < model.nv(); ++k) {
    all.push_back(k);
    if (model.inertia(k).massless) continue;
    massive.push_back(k);
    if (is_physical(model.M(k))) physical.push_back(k);
    known.push_back(bodies[k]);
  }
  std::set<int> chosen;
  for (const std::string& name : names) {
    if (name == "armature") {
      out.armature = all;
    } else if (name == "viscous") {
      out.viscous = all;
    } else if (name == "coulomb") {
      out.coulomb = all;
    } else if (name == "bodies") {
      chosen.insert(physical.begin(), physical.end());
    } else {
      const auto it = std::find(known.begin(), known.end(), name);
      if (it == known.end()) refuse_free(name, known);
      chosen.insert(massive[it - known.begin()]);
    }
  }
  out.bodies.assign(chosen.begin(), chosen.end());
  return out;
}

void check_physical(const Mechanics<double>& robot, const FreeParameters& free,
                    const std::vector<std::string>& bodies, const std::string& name) {
  for (const int k : free.bodies)
    if (!is_physical(robot.model.M(k)))
      throw InputError(name + ": body '" + bodies[k] +
                       "' is not physical (mass and principal moments must be positive, and each "
                       "moment less than the sum of the others): leave it out of --free");
}

void spoil(const FreeParameters& free, double error, std::uint64_t seed, Mechanics<double>& robot) {
  boost::random::mt19937_64 random(seed);
  const auto factor = [&] { return random() % 2 ? 1 + error : 1 - error; };
  std::vector<VectorX<double>> blocks = free.blocks_of(robot);
  std::vector<double*> pointers;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    VectorX<double>& x = blocks[b];
    pointers.push_back(x.data());
    if (b >= free.bodies.size()) {
      for (double& value : x) value *= factor();
      continue;
    }
    x[0] += std::log(factor()) / 2;
    for (int i = 1; i < 4; ++i) x[i] += std::log(factor()) / 2;
    for (int i = 4; i < body_parameters; ++i) x[i] *= factor();
  }
  free.apply(pointers.data(), robot);
}

}  // namespace kalmarm
