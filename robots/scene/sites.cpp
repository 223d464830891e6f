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
  const auto model = MujocoModel::load(scene.file, scene.read, Sites::kept);
  const mjModel* m = model->get();
  const std::vector<LinkFrame> bodies = model->body_frames();
  const auto add = [&](mjtObj kind, int i, const LinkFrame& at) {
    if (const char* name = mj_id2name(m, kind, i); name && *name)
      out.push_back({name, Site<double>{at.link, at.R, at.p}});
  };
  for (int i = 0; i < m->nsite; ++i) {
    const mjtNum *p = m->site_pos + 3 * i, *q = m->site_quat + 4 * i;
    add(mjOBJ_SITE, i,
        bodies[m->site_bodyid[i]].then({p[0], p[1], p[2]}, {q[0], q[1], q[2], q[3]}));
  }
  for (int i = 1; i < m->nbody; ++i) add(mjOBJ_BODY, i, bodies[i]);
  return out;
}

}  // namespace kalmarm
