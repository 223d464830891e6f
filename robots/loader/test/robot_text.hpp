// Robots as the text of their files, and whether two are the same.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "robots/loader/test/temporary_file.hpp"
#include "robots/scene/mujoco_solver.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm {

using Notes = std::vector<std::string>;

inline Scene read(const std::string& text, const std::string& ending,
                  const LoadOptions& options = {}) {
  return load_scene(TemporaryFile(text, ending).path(), options);
}

inline std::string link(const std::string& name, const std::string& inside) {
  return "<link name='" + name + "'>" + inside + "</link>";
}

inline std::string body_of(double mass) {
  return "<inertial><origin xyz='0.1 0 0.2'/><mass value='" + std::to_string(mass) +
         "'/><inertia ixx='.3' iyy='.4' izz='.5' ixy='.1' ixz='0' iyz='0'/></inertial>";
}

inline std::string joint(const std::string& name, const std::string& type,
                         const std::string& parent, const std::string& child,
                         const std::string& rest = "") {
  return "<joint name='" + name + "' type='" + type + "'><parent link='" + parent +
         "'/><child link='" + child + "'/><origin xyz='0.1 0.2 0.3' rpy='0.3 0 0.7'/>" +
         "<axis xyz='0 1 0'/><limit lower='-1' upper='1' effort='1' velocity='1'/>" + rest +
         "</joint>";
}

inline std::string urdf(const std::string& inside) {
  return "<robot name='r'>" + inside + "</robot>";
}

inline MatrixX<double> mass_of(const Scene& scene, const VectorX<double>& q) {
  MatrixX<double> M(scene.model.nv(), scene.model.nv());
  MujocoSolver(mujoco_of(scene)).mass(q, M);
  return M;
}

// Same M and bias in random states, by MuJoCo.
inline void expect_same_robot(const Scene& a, const Scene& b, double bound = 1e-13) {
  ASSERT_EQ(a.model.nv(), b.model.nv());
  MujocoSolver one(mujoco_of(a)), other(mujoco_of(b));
  VectorX<double> x(a.model.nv()), y(a.model.nv());
  for (const State& state : random_states(a, 5, 3)) {
    const MatrixX<double> M = mass_of(a, state.q);
    EXPECT_LE((M - mass_of(b, state.q)).norm(), bound * M.norm());
    one.inverse_dynamics(state.q, state.qd, state.tau, x);
    other.inverse_dynamics(state.q, state.qd, state.tau, y);
    EXPECT_LE((x - y).norm(), bound * x.norm());
  }
}

}  // namespace kalmarm
