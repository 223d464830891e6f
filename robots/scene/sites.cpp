#include "robots/scene/sites.hpp"

#include "robots/loader/mujoco_model.hpp"

namespace kalmarm {

std::vector<NamedSite> sites_of(const Scene& scene) {
  std::vector<NamedSite> out;
  if (scene.file.empty()) {
    for (int k = 0; k < scene.model.nv(); ++k)
      out.push_back({scene.model.name(k), Site<double>{.link = k}});
    return out;
  }
  for (const auto& [name, at] : MujocoModel::load(scene.file, scene.read, Frames::kept)->frames())
    out.push_back({name, Site<double>{at.link, at.R, at.p}});
  return out;
}

}  // namespace kalmarm
