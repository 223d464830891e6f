// What any file does to the loader, under clang's libFuzzer and sanitizers: scripts/fuzz.
//
// A file is refused with one line, or gives a model of finite numbers. Then M is finite and
// symmetric unless its numbers are astronomic, and an acceleration that is said to be right is
// finite. Half of the files are read with options. Anything else, and any report of a sanitizer, is a finding. KALMARM_FUZZ_MUJOCO_ALONE: the
// file goes to MuJoCo's own reader and compiler and nowhere else, which tells its faults from ours.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>

#include "algorithms/model/plain.hpp"
#include "kalmarm/dynamics.hpp"
#include "kalmarm/load.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_shim.hpp"
#include "robots/loader/test/fuzz/reader.hpp"
#include "robots/loader/test/fuzz/xml_mutator.hpp"
#include "robots/loader/test/temporary_file.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm {
namespace {

// The largest of the numbers that M is made of.
double largest(const RobotModel& model) {
  double out = 0;
  const auto look = [&](double x) {
    if (!std::isfinite(x)) found("a model with a number that is not finite");
    out = std::max(out, std::abs(x));
  };
  for (const LinkParameters& link : model.links) {
    for (const double x : link.rotation) look(x);
    for (const double x : link.translation) look(x);
    for (const double x : link.center_of_mass) look(x);
    for (const double x : link.inertia_axes) look(x);
    for (const double x : link.principal_moments) look(x);
    look(link.reference), look(link.armature), look(link.mass);
  }
  for (const double x : model.gravity) look(x);
  return out;
}

void use(const Scene& scene) {
  const RobotModel model = plain(scene.model);
  const double size = largest(model);
  constexpr int most_dofs = 60;  // no time for more
  if (model.nv() > most_dofs) return;
  Dynamics<double> robot(model);
  MatrixX<double> M(model.nv(), model.nv());
  VectorX<double> a(model.nv());
  for (const State& state : random_states(scene, 3, 1)) {
    M.setConstant(NAN);
    robot.mass(state.q, M);
    if (size < 1e50 && !(M.allFinite() && M == M.transpose()))
      found("M is not finite or not symmetric");
    if (robot.forward_dynamics(state.q, state.qd, state.tau, a) && !a.allFinite())
      found("an acceleration that is not finite and said to be right");
  }
}

// Of what a file's text sums up to, so that it is read in the same way again.
LoadOptions options_for(const std::string& text) {
  std::uint32_t sum = 2166136261;
  for (const char c : text) sum = (sum ^ static_cast<unsigned char>(c)) * 16777619;
  sum >>= 8;
  LoadOptions out;
  const auto one_in = [&](std::uint32_t n) {
    const bool yes = sum % n == 0;
    sum /= n;
    return yes;
  };
  if (one_in(2)) return out;
  if (one_in(2)) out.floating = one_in(2) ? "" : "base";
  if (one_in(3)) out.inertia = InertiaPolicy::balanced;
  if (one_in(3)) out.urdf_inertia = one_in(2) ? UrdfInertia::none : UrdfInertia::geometry;
  if (one_in(4)) out.key = "home";
  if (one_in(4)) out.controls = {{"motor", 0.5}};
  if (one_in(4)) out.armature = {{"elbow", 0.1}, {"shoulder", 0}};
  return out;
}

void load(const std::string& path, const LoadOptions& options) {
  try {
    use(load_scene(path, options));
    static_cast<void>(load_robot(path, options));
  } catch (const InputError& e) {
    expect_one_line(e.what());
  }
}

void load_by_mujoco_alone(const std::string& path) {
  install_mujoco_handlers();
  char error[1024] = "";
  try {
    mj_deleteModel(mj_loadXML(path.c_str(), nullptr, error, sizeof error));
  } catch (const InputError&) {
  }
}

}  // namespace
}  // namespace kalmarm

// A random element, attribute or number is changed; now and then bytes, by libFuzzer's own mutator,
// which is the one that knows the dictionary.
extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t most);
extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t most, unsigned seed) {
  kalmarm::XmlMutator mutator(seed);
  if (mutator.below(4) == 0) return LLVMFuzzerMutate(data, size, most);
  const std::string text = mutator.mutated(std::string(reinterpret_cast<const char*>(data), size));
  if (text.size() > most) return LLVMFuzzerMutate(data, size, most);
  std::memcpy(data, text.data(), text.size());
  return text.size();
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const bool alone = std::getenv("KALMARM_FUZZ_MUJOCO_ALONE") != nullptr;
  const std::string text(reinterpret_cast<const char*>(data), size);
  const kalmarm::TemporaryFile file(text, ".xml");
  if (alone)
    kalmarm::load_by_mujoco_alone(file.path());
  else
    kalmarm::load(file.path(), kalmarm::options_for(text));
  return 0;
}
