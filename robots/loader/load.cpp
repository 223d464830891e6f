#include "kalmarm/load.hpp"

#include <algorithm>
#include <filesystem>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <utility>

#include "algorithms/model/plain.hpp"
#include "robots/loader/actuators.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_model.hpp"
#include "robots/loader/mujoco_shim.hpp"
#include "robots/loader/robot_of.hpp"

namespace kalmarm {
namespace {

// A program that uses MuJoCo itself keeps its own handlers. They are MuJoCo's for all threads, so that
// robots are loaded one after another.
class Handlers {
 public:
  Handlers() { install_mujoco_handlers(); }
  Handlers(const Handlers&) = delete;
  Handlers& operator=(const Handlers&) = delete;
  ~Handlers() {
    mju_user_error = error_;
    mju_user_warning = warning_;
  }

 private:
  static inline std::mutex one_at_a_time;
  const std::lock_guard<std::mutex> alone_{one_at_a_time};
  decltype(mju_user_error) error_ = mju_user_error;
  decltype(mju_user_warning) warning_ = mju_user_warning;
};

std::vector<NamedFrame> named_frames(const MujocoModel& model) {
  std::vector<NamedFrame> out;
  const mjModel* m = model.get();
  const std::vector<LinkFrame> bodies = model.body_frames();
  const auto add = [&](mjtObj kind, int i, const LinkFrame& at) {
    if (const char* name = mj_id2name(m, kind, i); name && *name)
      out.push_back({name, {at.link, plain(at.R), plain(at.p)}});
  };
  for (int i = 0; i < m->nsite; ++i) {
    const mjtNum *p = m->site_pos + 3 * i, *q = m->site_quat + 4 * i;
    add(mjOBJ_SITE, i,
        bodies[m->site_bodyid[i]].then({p[0], p[1], p[2]}, {q[0], q[1], q[2], q[3]}));
  }
  for (int i = 1; i < m->nbody; ++i) add(mjOBJ_BODY, i, bodies[i]);
  return out;
}

LoadedRobot loaded(const MujocoModel& model, const std::string& name) {
  Driven driven = model.driven();
  std::optional<RobotModel> compensated;
  if (const auto weights = model.compensated()) compensated = plain(*weights);
  return {.name = name,
          .model = plain(model.lower()),
          .home = {model.home().q.begin(), model.home().q.end()},
          .home_velocity = {model.home().qd.begin(), model.home().qd.end()},
          .range = model.ranges(),
          .terms = std::move(driven.terms),
          .torque = std::move(driven.torque),
          .actuators = model.actuators(),
          .force_range = force_ranges(model.get()),
          .compensated = std::move(compensated),
          .frames = named_frames(model),
          .notes = model.notes()};
}

}  // namespace

LoadedRobot load_robot(const std::string& path, const LoadOptions& options) {
  const Handlers handlers;
  return loaded(*MujocoModel::load(path, options, Sites::kept),
                std::filesystem::path(path).stem().string());
}

LoadedRobot robot_of(const mjModel* model, const std::string& name,
                     const std::vector<double>& controls, bool takes_steps) {
  const Handlers handlers;
  const Eigen::Map<const VectorX<double>> ctrl(controls.data(),
                                               static_cast<Eigen::Index>(controls.size()));
  try {
    return loaded(*MujocoModel::copy_of(model, ctrl, takes_steps), name);
  } catch (const InputError& e) {
    throw InputError(name + ": " + e.what());
  }
}

const Frame& LoadedRobot::frame(const std::string& frame_name) const {
  for (const NamedFrame& one : frames)
    if (one.name == frame_name) return one.frame;
  throw std::invalid_argument("robot '" + name + "': no site or body '" + frame_name + "'");
}

int LoadedRobot::dof(const std::string& joint) const {
  for (int k = 0; k < model.nv(); ++k)
    if (model.names[k] == joint || model.names[k].starts_with(joint + ":")) return k;
  throw std::invalid_argument("robot '" + name + "': no joint '" + joint + "'");
}

}  // namespace kalmarm
