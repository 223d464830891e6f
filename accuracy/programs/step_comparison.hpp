// Implicit steps against mj_step of MuJoCo, for compare_mujoco --step: of its own load of the file,
// untouched, without what has no terms here, or of what we read of it where there is none.
//
// a = (v+ - v) / h of every form of the fast path, in each precision, for random states; bound in
// float64: 1e-9, or nv u kappa of M^ where that is more, as for accelerations. A difference of velocities
// over h loses u |v| / h of its own, which the bound has too.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>

#include "robots/scene/scene.hpp"
#include "robots/scene/untouched.hpp"

namespace kalmarm {

struct StepOptions {
  double h = 0.002;  // [s]
  std::optional<double> damping,
      stiffness;  // of every hinge and slide, in the place of the file's joints
  int random = 100;
  std::uint64_t seed = 1;
};

// Where a reference is from.
nlohmann::json to_json(const Reference& reference);

// A record of the scene, with "pass"; its table is printed unless `quiet`. Throws InputError.
nlohmann::json compare_steps(const Scene& scene, const StepOptions& options, bool quiet);

}  // namespace kalmarm
