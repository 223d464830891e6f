// Everything that depends on MuJoCo's release, in one place: 3.10 and later.
#pragma once

#include <mujoco/mujoco.h>

static_assert(mjVERSION_HEADER >= 3010000, "MuJoCo 3.10 or later is needed: run scripts/setup");

namespace kalmarm {

// Makes MuJoCo's fatal errors exceptions (InputError) and keeps its warnings off the terminal.
// Called by every entry point of robots/; cheap.
void install_mujoco_handlers();

// Dense M (nv x nv, row-major) of the state in d, both triangles. The three-argument form since
// 3.10.
inline void full_mass_matrix(const mjModel* m, const mjData* d, mjtNum* M) { mj_fullM(m, d, M); }

// Number of actuators: its own field since 3.11, before that one control each.
inline int actuator_count(const mjModel* m) {
#if mjVERSION_HEADER >= 3011000
  return static_cast<int>(m->nactuator);
#else
  return static_cast<int>(m->nu);
#endif
}

}  // namespace kalmarm
