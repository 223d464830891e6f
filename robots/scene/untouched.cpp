#include "robots/scene/untouched.hpp"

#include "robots/loader/files/model_files.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_shim.hpp"

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

}  // namespace

Untouched load_untouched(const std::string& path, const LoadOptions& read) {
  install_mujoco_handlers();
  model_files(path);
  if (const std::string option = changed_by(read); !option.empty())
    return {nullptr, option + " makes another robot of the file"};
  char error[1024] = "";
  try {
    if (mjModel* model = mj_loadXML(path.c_str(), nullptr, error, sizeof error))
      return {std::make_shared<const MujocoModel>(model), ""};
    return {nullptr, one_line(error)};
  } catch (const InputError& e) {
    return {nullptr, e.what()};
  }
}

}  // namespace kalmarm
