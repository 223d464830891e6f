#include "kalmarm/load.hpp"

#include <algorithm>
#include <filesystem>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <utility>

#include "algorithms/model/plain.hpp"
#include "robots/loader/actuators.hpp"
#include "robots/loader/constraints.hpp"
#include "robots/loader/files/constraint_file.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_model.hpp"
#include "robots/loader/mujoco_shim.hpp"
#include "robots/loader/names.hpp"
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
  for (const auto& [name, at] : model.frames())
    out.push_back({name, {at.link, plain(at.R), plain(at.p)}});
  return out;
}

LoadedRobot loaded(const MujocoModel& model, const std::string& name, const LoadOptions& options) {
  Driven driven = model.driven();
  std::optional<RobotModel> compensated;
  if (const auto weights = model.compensated()) compensated = plain(*weights);
  LoadedRobot out = {
      .name = name,
      .model = plain(model.lower()),
      .home = {model.home().q.begin(), model.home().q.end()},
      .home_velocity = {model.home().qd.begin(), model.home().qd.end()},
      .range = model.ranges(),
      .terms = std::move(driven.terms),
      .torque = std::move(driven.torque),
      .actuators = model.actuators(),
      .force_range = force_ranges(model.get()),
      .constraints = options.takes_constraints ? model.constraints() : std::vector<Constraint>(),
      .compensated = std::move(compensated),
      .frames = named_frames(model),
      .notes = model.notes()};
  if (!options.constraints.empty())
    for (Constraint& one : read_constraints(options.constraints, out.model, out.frames))
      out.constraints.push_back(std::move(one));
  if (const std::string open = open_at_home(model, out); !open.empty())
    out.notes.push_back("open at home [m, of turns rad]: " + open);
  return out;
}

}  // namespace

LoadedRobot load_robot(const std::string& path, const LoadOptions& options) {
  const Handlers handlers;
  return loaded(*MujocoModel::load(path, options, Frames::kept),
                std::filesystem::path(path).stem().string(), options);
}

LoadedRobot robot_of(const mjModel* model, const std::string& name,
                     const std::vector<double>& controls, const LoadOptions& options) {
  const Handlers handlers;
  const Eigen::Map<const VectorX<double>> ctrl(controls.data(),
                                               static_cast<Eigen::Index>(controls.size()));
  try {
    return loaded(*MujocoModel::copy_of(model, ctrl, options), name, options);
  } catch (const InputError& e) {
    throw InputError(name + ": " + e.what());
  }
}

const Frame& LoadedRobot::frame(const std::string& frame_name) const {
  for (const NamedFrame& one : frames)
    if (one.name == frame_name) return one.frame;
  std::vector<std::string> names;
  for (const NamedFrame& one : frames) names.push_back(one.name);
  throw std::invalid_argument("robot '" + name + "': " + unknown_name("frame", frame_name, names));
}

int LoadedRobot::dof(const std::string& joint) const {
  for (int k = 0; k < model.nv(); ++k)
    if (model.names[k] == joint || model.names[k].starts_with(joint + ":")) return k;
  throw std::invalid_argument("robot '" + name + "': " + unknown_name("joint", joint, model.names));
}

}  // namespace kalmarm
