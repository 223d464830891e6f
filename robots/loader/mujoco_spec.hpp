// What is done with MuJoCo's specifications (mjSpec) in more than one place.
#pragma once

#include <mujoco/mujoco.h>

#include <memory>
#include <string>
#include <vector>

#include "robots/loader/mujoco_model.hpp"

namespace kalmarm {

using SpecPtr = std::unique_ptr<mjSpec, void (*)(mjSpec*)>;

// Throws InputError with `what` and MuJoCo's reason.
std::shared_ptr<const MujocoModel> compile(mjSpec* spec, const std::string& what);

inline std::string name_of(const mjsElement* element) {
  return mjs_getString(mjs_getName(const_cast<mjsElement*>(element)));
}

inline std::vector<mjsElement*> elements(mjSpec* spec, mjtObj type) {
  std::vector<mjsElement*> out;
  for (mjsElement* e = mjs_firstElement(spec, type); e; e = mjs_nextElement(spec, e))
    out.push_back(e);
  return out;
}

inline int count(mjSpec* spec, mjtObj type) {
  return static_cast<int>(elements(spec, type).size());
}

inline bool has_joint(mjsBody* body) { return mjs_firstChild(body, mjOBJ_JOINT, 0) != nullptr; }

// False where it is welded to the world.
inline bool moves(mjsBody* body) {
  for (; body; body = mjs_getParent(body->element))
    if (has_joint(body)) return true;
  return false;
}

}  // namespace kalmarm
