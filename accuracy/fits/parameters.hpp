// What a fit changes of a robot, and the coordinates that its solver sees.
//
//   columns, in which torque and M are linear:
//     theta (10) of every free body, then armature r, viscous friction and Coulomb friction of the
//     DoF where they are free
//   blocks, the solver's: the same, with every body in the log-Cholesky coordinates x of
//     inertial_parameters.hpp, which keep it physical; friction and armature have the bound 0
// Friction torque: viscous q' + Coulomb tanh(q' / 0.01), in rad/s or m/s.
#pragma once

#include <string>
#include <vector>

#include "algorithms/model/model.hpp"
#include "algorithms/study/derivatives/inertial_parameters.hpp"

namespace kalmarm {

template <class T>
struct Mechanics {
  Model<T> model;
  VectorX<T> viscous, coulomb;  // nv [N m s or N s/m], [N m or N]

  template <class U>
  Mechanics<U> cast() const {
    return {model.template cast<U>(), viscous.template cast<U>(), coulomb.template cast<U>()};
  }
};

// Smoothed sign of a velocity.
inline double coulomb_sign(double velocity) { return std::tanh(velocity / 0.01); }

struct FreeParameters {
  std::vector<int> bodies;                      // links
  std::vector<int> armature, viscous, coulomb;  // DoF

  int columns() const {
    return body_parameters * static_cast<int>(bodies.size()) +
           static_cast<int>(armature.size() + viscous.size() + coulomb.size());
  }
  std::vector<int> block_sizes() const {
    std::vector<int> sizes(bodies.size(), body_parameters);
    for (const auto* scalars : {&armature, &viscous, &coulomb})
      if (!scalars->empty()) sizes.push_back(static_cast<int>(scalars->size()));
    return sizes;
  }

  // The robot's values in the solver's coordinates, block after block. A body that is not physical
  // has NaN in its block.
  std::vector<VectorX<double>> blocks_of(const Mechanics<double>& robot) const {
    std::vector<VectorX<double>> out;
    for (const int k : bodies) out.push_back(to_log_cholesky(robot.model.M(k)));
    const auto add = [&](const std::vector<int>& dofs, const auto& value) {
      if (dofs.empty()) return;
      VectorX<double> block(static_cast<int>(dofs.size()));
      for (int i = 0; i < block.size(); ++i) block[i] = value(dofs[i]);
      out.push_back(block);
    };
    add(armature, [&](int k) { return robot.model.joint(k).r; });
    add(viscous, [&](int k) { return robot.viscous[k]; });
    add(coulomb, [&](int k) { return robot.coulomb[k]; });
    return out;
  }

  // Its columns.
  VectorX<double> values_of(const Mechanics<double>& robot) const {
    VectorX<double> out(columns());
    int i = 0;
    for (const int k : bodies) {
      out.segment<body_parameters>(i) = inertial_parameters(robot.model.M(k));
      i += body_parameters;
    }
    for (const int k : armature) out[i++] = robot.model.joint(k).r;
    for (const int k : viscous) out[i++] = robot.viscous[k];
    for (const int k : coulomb) out[i++] = robot.coulomb[k];
    return out;
  }

  // Sets the free parameters of a robot from the solver's blocks.
  template <class T>
  void apply(T const* const* blocks, Mechanics<T>& robot) const {
    for (const int k : bodies) {
      const InertialVector<T> x = Eigen::Map<const InertialVector<T>>(*blocks++);
      robot.model.set_inertia(k, spatial_inertia<T>(from_log_cholesky(x)));
    }
    const auto set = [&](const std::vector<int>& dofs, const auto& put) {
      if (dofs.empty()) return;
      for (std::size_t i = 0; i < dofs.size(); ++i) put(dofs[i], (*blocks)[i]);
      ++blocks;
    };
    set(armature, [&](int k, const T& r) { robot.model.set_noise(k, r); });
    set(viscous, [&](int k, const T& v) { robot.viscous[k] = v; });
    set(coulomb, [&](int k, const T& c) { robot.coulomb[k] = c; });
  }
};

}  // namespace kalmarm
