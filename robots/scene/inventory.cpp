#include "robots/scene/inventory.hpp"

#include <utility>

#include "robots/loader/files/read_file.hpp"
#include "robots/loader/mujoco_shim.hpp"
#include "robots/loader/mujoco_strip.hpp"

namespace kalmarm {
namespace {

constexpr std::pair<mjtObj, const char*> kinds[] = {
    {mjOBJ_GEOM, "geom"},           {mjOBJ_MESH, "mesh"},
    {mjOBJ_MATERIAL, "material"},   {mjOBJ_TEXTURE, "texture"},
    {mjOBJ_HFIELD, "height field"}, {mjOBJ_SKIN, "skin"},
    {mjOBJ_FLEX, "flex"},           {mjOBJ_LIGHT, "light"},
    {mjOBJ_CAMERA, "camera"},       {mjOBJ_SITE, "site"},
    {mjOBJ_SENSOR, "sensor"},       {mjOBJ_ACTUATOR, "actuator"},
    {mjOBJ_TENDON, "tendon"},       {mjOBJ_EQUALITY, "equality"},
    {mjOBJ_PAIR, "contact pair"},   {mjOBJ_EXCLUDE, "contact exclusion"},
    {mjOBJ_KEY, "keyframe"},        {mjOBJ_NUMERIC, "custom number"},
    {mjOBJ_TEXT, "custom text"},    {mjOBJ_TUPLE, "tuple"},
};

}  // namespace

Inventory inventory_of(const Scene& scene) {
  Inventory out;
  if (scene.file.empty()) {
    out.bodies = out.moving = scene.model.nv();
    return out;
  }
  install_mujoco_handlers();
  const SpecPtr spec = read_file(scene.file, scene.read).spec;
  for (const auto& [kind, name] : kinds)
    if (const int given = count(spec.get(), kind)) out.elements.push_back({name, given, 0});
  strip(spec.get());
  for (const auto& [kind, name] : kinds)
    for (Inventory::Element& element : out.elements)
      if (element.kind == name) element.kept = kind == mjOBJ_KEY ? 0 : count(spec.get(), kind);

  const mjModel* m = scene.mujoco->get();
  const std::vector<LinkFrame> frames = scene.mujoco->body_frames();
  out.bodies = m->nbody - 1;
  for (int i = 1; i < m->nbody; ++i)
    ++(m->body_jntnum[i] > 0 ? out.moving : frames[i].link >= 0 ? out.welded : out.fixed);
  return out;
}

}  // namespace kalmarm
