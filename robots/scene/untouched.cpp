#include "robots/scene/untouched.hpp"

#include <algorithm>
#include <cmath>

#include "robots/loader/files/model_files.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_shim.hpp"
#include "robots/loader/mujoco_spec.hpp"
#include "robots/loader/mujoco_strip.hpp"

namespace kalmarm {
namespace {

// An option that changes M or the joints, as the command line has it; "" where none does.
std::string changed_by(const LoadOptions& read) {
  if (read.floating) return "--floating";
  if (read.urdf_inertia != UrdfInertia::where_found) return "--urdf-inertia";
  if (read.inertia != InertiaPolicy::given) return "--inertia";
  if (!read.armature.empty()) return "--armature";
  return "";
}

// What MuJoCo makes of fused bodies that it does not make of them where they are not; "" where nothing.
std::string changed_by_fusing(const std::string& path) {
  char error[1024] = "";
  const SpecPtr spec(mj_parseXML(path.c_str(), nullptr, error, sizeof error), mj_deleteSpec);
  if (!spec || !spec->compiler.fusestatic) return "";
  const mjsCompiler& compiler = spec->compiler;
  if (compiler.inertiafromgeom == mjINERTIAFROMGEOM_TRUE &&
      (compiler.boundmass > 0 || compiler.boundinertia > 0))
    return "MuJoCo takes boundmass and boundinertia, with inertiafromgeom, of fused bodies "
           "together";
  for (mjsElement* e : elements(spec.get(), mjOBJ_BODY)) {
    mjsBody* body = mjs_asBody(e);
    const double* I = std::isnan(body->fullinertia[0]) ? body->inertia : body->fullinertia;
    if (body->explicitinertial && body->mass == 0 && I[0] + I[1] + I[2] > 0 && moves(body) &&
        !has_joint(body) && !inertia_from_geoms(spec.get(), body) && !(compiler.boundmass > 0))
      return "MuJoCo leaves out a fused body without mass, which has a tensor: '" + name_of(e) +
             "'";
  }
  return "";
}

// MuJoCo's ctrl: of the keyframe, else zero, but for actuators whose controls are given by name.
VectorX<double> controls_of(const mjModel* m, const LoadOptions& read) {
  VectorX<double> out = VectorX<double>::Zero(m->nu);
  const int key = read.key.empty() ? -1 : mj_name2id(m, mjOBJ_KEY, read.key.c_str());
  if (key >= 0)
    std::copy_n(m->key_ctrl + static_cast<std::ptrdiff_t>(key) * m->nu, m->nu, out.data());
  for (const auto& [name, control] : read.controls)
    if (const int i = mj_name2id(m, mjOBJ_ACTUATOR, name.c_str()); i >= 0)
      out[control_address(m, i)] = control;
  return out;
}

}  // namespace

Untouched load_untouched(const std::string& path, const LoadOptions& read) {
  install_mujoco_handlers();
  model_files(path);
  if (const std::string option = changed_by(read); !option.empty())
    return {nullptr, option + " makes another robot of the file"};
  char error[1024] = "";
  try {
    if (const std::string reason = changed_by_fusing(path); !reason.empty())
      return {nullptr, reason};
    if (mjModel* model = mj_loadXML(path.c_str(), nullptr, error, sizeof error))
      return {std::make_shared<const MujocoModel>(model), ""};
    return {nullptr, one_line(error)};
  } catch (const InputError& e) {
    return {nullptr, e.what()};
  }
}

Reference reference_of(const Scene& scene) {
  if (scene.file.empty()) return {mujoco_of(scene), "a family has no file"};
  Untouched untouched = load_untouched(scene.file, scene.read);
  if (!untouched.model) return {scene.mujoco, untouched.reason};
  const mjModel *m = untouched.model->get(), *read = scene.mujoco->get();
  if (m->nv != read->nv || m->nq != read->nq)
    throw InputError(scene.file + ": MuJoCo reads " + std::to_string(m->nv) + " DoF, we " +
                     std::to_string(read->nv));
  return {std::move(untouched.model), ""};
}

Reference step_reference_of(const Scene& scene) {
  const Reference out = reference_of(scene);
  if (!out.why_touched.empty()) return out;
  const mjModel* m = out.model->get();
  if (m->nflex > 0) return {scene.mujoco, "flexes have forces of their own"};
  if (m->nplugin > 0) return {scene.mujoco, "plugins have forces of their own"};
  return {MujocoModel::copy_of(m, controls_of(m, scene.read),
                               {.takes_steps = true, .limits_forces = true}),
          ""};
}

}  // namespace kalmarm
