#include "robots/scene/scene.hpp"

#include <algorithm>
#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>
#include <boost/random/uniform_real_distribution.hpp>
#include <charconv>
#include <filesystem>
#include <numbers>
#include <optional>

#include "robots/loader/files/text_file.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/names.hpp"
#include "robots/scene/families.hpp"
#include "robots/scene/memory_limit.hpp"

namespace kalmarm {
namespace {

namespace fs = std::filesystem;

const fs::path robots_folder = KALMARM_ROBOTS_DIR;

std::string joined(const std::vector<std::string>& words) {
  std::string out;
  for (const std::string& word : words) out += (out.empty() ? "" : ", ") + word;
  return out;
}

std::optional<Scene> load_family(const std::string& what) {
  const std::size_t colon = what.find(':');
  if (colon == std::string::npos) return std::nullopt;
  const std::string name = what.substr(0, colon), size = what.substr(colon + 1);
  for (const Family& family : families()) {
    if (family.name != name) continue;
    int links = 0;
    const auto [end, error] = std::from_chars(size.data(), size.data() + size.size(), links);
    if (error != std::errc() || end != size.data() + size.size() || links < 1 ||
        links > largest_family_member)
      throw InputError("scene '" + what + "': N must be a number from 1 to " +
                       std::to_string(largest_family_member));
    Scene scene = generated_scene(what, family.make(links));
    scene.at_rest = family.at_rest;
    return scene;
  }
  return std::nullopt;
}

// JSON has no other names; those in the file are refused when it is read.
void refuse_other_than_utf8(const std::string& file, std::string name) {
  if (is_utf8(name)) return;
  const auto is_beyond = [](char c) { return static_cast<unsigned char>(c) > 127; };
  std::replace_if(name.begin(), name.end(), is_beyond, '?');
  throw InputError(file + ": the file's name '" + name + "' is not UTF-8");
}

Scene from_file(const fs::path& path, const std::string& name, const LoadOptions& read) {
  Scene scene;
  scene.file = path.string();
  scene.read = read;
  scene.mujoco = MujocoModel::load(scene.file, read);
  scene.model = scene.mujoco->lower();
  scene.name = name + ":" + std::to_string(scene.model.nv());
  scene.range = scene.mujoco->ranges();
  refuse_other_than_utf8(scene.file, scene.name);
  return scene;
}

// MuJoCo's body that carries the joint of a link, and its frame in the link's axes.
struct Carrier {
  int body;
  LinkFrame frame;
};

std::optional<Carrier> carrier_of(const Scene& scene, int k) {
  if (!scene.mujoco) return std::nullopt;
  const std::vector<LinkFrame> bodies = scene.mujoco->body_frames();
  const auto found = std::find_if(bodies.begin(), bodies.end(),
                                  [&](const LinkFrame& body) { return body.link == k; });
  if (found == bodies.end()) return std::nullopt;
  return Carrier{static_cast<int>(found - bodies.begin()), *found};
}

// None where the folder is not there: programs of a Python wheel ship without robots.
fs::directory_iterator entries(const fs::path& folder) {
  std::error_code error;
  return fs::directory_iterator(folder, error);
}

}  // namespace

std::vector<std::string> shipped_robots() {
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : entries(robots_folder)) {
    const std::string name = entry.path().filename().string();
    if (fs::exists(entry.path() / (name + ".xml"))) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::vector<std::string> shipped_scenes() {
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : entries(robots_folder / "scenes"))
    if (entry.path().extension() == ".xml") names.push_back(entry.path().stem().string());
  std::sort(names.begin(), names.end());
  return names;
}

Scene generated_scene(const std::string& name, const Model<double>& model) {
  Scene scene;
  scene.name = name;
  scene.model = model;
  scene.range.assign(model.nq(), {-std::numbers::pi, std::numbers::pi});
  return scene;
}

Scene load_scene(const std::string& what, const LoadOptions& read) {
  if (std::optional<Scene> scene = load_family(what)) {
    LoadOptions changes = read;
    changes.adds_friction = changes.takes_steps = false;
    if (changes != LoadOptions())
      throw InputError("scene '" + what + "': has no file to be read otherwise");
    return *std::move(scene);
  }
  const std::vector<std::string> robots = shipped_robots(), scenes = shipped_scenes();
  const std::string name = what.substr(0, what.find(':'));
  const auto shipped = [&](const std::vector<std::string>& names, const fs::path& path) {
    if (std::find(names.begin(), names.end(), name) == names.end()) return std::optional<Scene>();
    Scene scene = from_file(path, name, read);
    if (what != name && what != scene.name)
      throw InputError("scene '" + what + "': the one that ships is " + scene.name);
    return std::optional<Scene>(std::move(scene));
  };
  if (auto scene = shipped(robots, robots_folder / name / (name + ".xml"))) return *scene;
  if (auto scene = shipped(scenes, robots_folder / "scenes" / (name + ".xml"))) return *scene;
  if (is_there(what)) return from_file(what, fs::path(what).stem().string(), read);
  std::vector<std::string> known;
  for (const Family& family : families()) known.push_back(family.name + ":N");
  const std::string ships = robots.empty() ? ""
                                           : ", a shipped robot (" + joined(robots) +
                                                 ") or scene (" + joined(scenes) + ")";
  throw InputError("scene '" + what + "' is neither a file" + ships + " nor a family (" +
                   joined(known) + ")");
}

VectorX<double> home_position(const Scene& scene) {
  if (scene.mujoco) return scene.mujoco->home().q;
  VectorX<double> q = VectorX<double>::Zero(scene.model.nq());
  for (int k = 0; k < scene.model.nv(); ++k) {
    const Joint<double>& joint = scene.model.joint(k);
    if (joint.coordinate == Coordinate::quaternion)
      q[joint.q_index] = 1;
    else if (joint.coordinate == Coordinate::angle || joint.coordinate == Coordinate::distance)
      q[joint.q_index] = joint.ref;
  }
  return q;
}

State home_state(const Scene& scene) {
  const int nv = scene.model.nv();
  return {home_position(scene),
          scene.mujoco ? scene.mujoco->home().qd : VectorX<double>::Zero(nv).eval(),
          VectorX<double>::Zero(nv)};
}

std::vector<State> random_states(const Scene& scene, int count, std::uint64_t seed) {
  boost::random::mt19937_64 random(seed);
  boost::random::normal_distribution<double> normal;
  const Model<double>& model = scene.model;
  refuse_large(
      scene.name + ": " + std::to_string(count) + " states",
      double(count) * double(sizeof(State) + (model.nq() + 2 * model.nv()) * sizeof(double)));
  std::vector<State> states(count);
  for (State& state : states) {
    state.q = VectorX<double>::Zero(model.nq());
    state.qd = VectorX<double>::Zero(model.nv());
    state.tau = VectorX<double>::Zero(model.nv());
    for (double& entry : state.tau) entry = normal(random);
    if (scene.at_rest) continue;
    for (int i = 0; i < model.nq(); ++i) {
      const auto [low, high] = scene.range[i];
      state.q[i] =
          low < high ? boost::random::uniform_real_distribution<double>(low, high)(random) : low;
    }
    for (int k = 0; k < model.nv(); ++k) {
      if (model.joint(k).coordinate != Coordinate::quaternion) continue;
      auto quaternion = state.q.segment<4>(model.joint(k).q_index);
      for (double& entry : quaternion) entry = normal(random);
      quaternion.normalize();
    }
    for (double& entry : state.qd) entry = normal(random);
  }
  return states;
}

JointFriction friction_of(const Scene& scene) {
  const int nv = scene.model.nv();
  if (!scene.mujoco) return {VectorX<double>::Zero(nv), VectorX<double>::Zero(nv)};
  const mjModel* m = scene.mujoco->get();
  using Values = Eigen::Map<const VectorX<double>>;
  return {Values(m->dof_damping, nv), Values(m->dof_frictionloss, nv)};
}

JointTerms joint_terms_of(const Scene& scene) {
  return scene.mujoco ? scene.mujoco->joint_terms() : JointTerms{};
}

std::string link_name(const Scene& scene, int k) {
  const std::optional<Carrier> carrier = carrier_of(scene, k);
  if (!carrier) return scene.model.name(k);
  const char* name = mj_id2name(scene.mujoco->get(), mjOBJ_BODY, carrier->body);
  return name && *name ? name : scene.model.name(k);
}

LinkFrame frame_of_body(const Scene& scene, int k) {
  const std::optional<Carrier> carrier = carrier_of(scene, k);
  return carrier ? carrier->frame : LinkFrame{.link = k};
}

std::shared_ptr<const MujocoModel> mujoco_of(const Scene& scene) {
  return scene.mujoco ? scene.mujoco : MujocoModel::from(scene.model, scene.name);
}

}  // namespace kalmarm
