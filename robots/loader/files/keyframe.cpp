#include "robots/loader/files/keyframe.hpp"

#include <utility>

#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_spec.hpp"

namespace kalmarm {
namespace {

VectorX<double> numbers(const mjDoubleVec* from) {
  int size = 0;
  const double* data = mjs_getDouble(from, &size);
  return Eigen::Map<const VectorX<double>>(data, size);
}

void check(const VectorX<double>& x, int size, const char* what) {
  if (x.size() != size)
    throw InputError("the keyframe has " + std::to_string(x.size()) + " " + what +
                     ", the robot has " + std::to_string(size));
  if (!x.allFinite())
    throw InputError(std::string("one of the keyframe's ") + what + " is not finite");
}

}  // namespace

Keyframe keyframe_called(mjSpec* spec, const std::string& name) {
  std::string known;
  for (mjsElement* e : elements(spec, mjOBJ_KEY)) {
    if (name_of(e) == name) return {numbers(mjs_asKey(e)->qpos), numbers(mjs_asKey(e)->qvel)};
    if (!name_of(e).empty()) known += (known.empty() ? "" : ", ") + name_of(e);
  }
  throw InputError("no keyframe is called '" + name + "' (" +
                   (known.empty() ? "there is none with a name" : "known: " + known) + ")");
}

Keyframe completed(Keyframe given, const mjModel* model) {
  const int nq = static_cast<int>(model->nq), nv = static_cast<int>(model->nv);
  if (given.q.size() == 0) given.q = Eigen::Map<const VectorX<double>>(model->qpos0, nq);
  if (given.qd.size() == 0) given.qd = VectorX<double>::Zero(nv);
  check(given.q, nq, "positions");
  check(given.qd, nv, "velocities");
  for (int j = 0; j < model->njnt; ++j) {
    if (model->jnt_type[j] != mjJNT_FREE && model->jnt_type[j] != mjJNT_BALL) continue;
    const int first = model->jnt_qposadr[j] + (model->jnt_type[j] == mjJNT_FREE ? 3 : 0);
    auto quaternion = given.q.segment<4>(first);
    if (!(quaternion.norm() > 1e-10 && std::isfinite(quaternion.norm())))
      throw InputError("the keyframe's quaternion at qpos[" + std::to_string(first) +
                       "] has no length to divide by");
    quaternion.normalize();
  }
  return given;
}

}  // namespace kalmarm
