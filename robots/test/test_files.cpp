// What LoadOptions change of a file, and what is said of it, against MuJoCo's own reading of a file
// that says the same.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "robots/mujoco_solver.hpp"
#include "robots/scene.hpp"
#include "robots/test/refusal.hpp"
#include "robots/test/temporary_file.hpp"

namespace kalmarm {
namespace {

using Notes = std::vector<std::string>;

Scene read(const std::string& text, const std::string& ending, const LoadOptions& options = {}) {
  return load_scene(TemporaryFile(text, ending).path(), options);
}

std::string link(const std::string& name, const std::string& inside) {
  return "<link name='" + name + "'>" + inside + "</link>";
}

std::string body_of(double mass) {
  return "<inertial><origin xyz='0.1 0 0.2'/><mass value='" + std::to_string(mass) +
         "'/><inertia ixx='.3' iyy='.4' izz='.5' ixy='.1' ixz='0' iyz='0'/></inertial>";
}

std::string joint(const std::string& name, const std::string& type, const std::string& parent,
                  const std::string& child, const std::string& rest = "") {
  return "<joint name='" + name + "' type='" + type + "'><parent link='" + parent +
         "'/><child link='" + child + "'/><origin xyz='0.1 0.2 0.3' rpy='0.3 0 0.7'/>" +
         "<axis xyz='0 1 0'/><limit lower='-1' upper='1' effort='1' velocity='1'/>" + rest +
         "</joint>";
}

std::string urdf(const std::string& inside) { return "<robot name='r'>" + inside + "</robot>"; }

// A trunk on a base without mass, and three legs.
std::string quadruped() {
  std::string out =
      link("base", "") + link("trunk", body_of(5)) + joint("f", "fixed", "base", "trunk");
  for (const std::string leg : {"a", "b", "c"})
    out += link(leg, body_of(1)) + joint("hip_" + leg, "revolute", "trunk", leg);
  return urdf(out);
}

MatrixX<double> mass_of(const Scene& scene, const VectorX<double>& q) {
  MatrixX<double> M(scene.model.nv(), scene.model.nv());
  MujocoSolver(mujoco_of(scene)).mass(q, M);
  return M;
}

// Same M and bias in random states, by MuJoCo.
void expect_same_robot(const Scene& a, const Scene& b) {
  ASSERT_EQ(a.model.nv(), b.model.nv());
  MujocoSolver one(mujoco_of(a)), other(mujoco_of(b));
  VectorX<double> x(a.model.nv()), y(a.model.nv());
  for (const State& state : random_states(a, 5, 3)) {
    const MatrixX<double> M = mass_of(a, state.q);
    EXPECT_LE((M - mass_of(b, state.q)).norm(), 1e-13 * M.norm());
    one.inverse_dynamics(state.q, state.qd, state.tau, x);
    other.inverse_dynamics(state.q, state.qd, state.tau, y);
    EXPECT_LE((x - y).norm(), 1e-13 * x.norm());
  }
}

TEST(Floating, RootOfAUrdfIsAsOneThatAFloatingJointHangsOnTheWorld) {
  std::string hung = quadruped();
  hung.insert(hung.find("<link"), link("world", "") +
                                      "<joint name='root' type='floating'><parent link='world'/>"
                                      "<child link='base'/></joint>");
  for (const char* name : {"", "base"}) {
    const Scene scene = read(quadruped(), ".urdf", {.floating = name});
    EXPECT_EQ(scene.model.nv(), 9);
    EXPECT_EQ(scene.model.name(0), "floating_base:x");
    EXPECT_EQ(scene.mujoco->notes(), Notes{});
    expect_same_robot(scene, read(hung, ".urdf"));
  }
}

TEST(Floating, IsHintedAtWhereLimbsHangOnAWeldedBase) {
  const Scene scene = read(quadruped(), ".urdf");
  EXPECT_EQ(scene.model.nv(), 3);
  EXPECT_EQ(scene.mujoco->notes(),
            Notes{"3 limbs hang on 'base', which is welded to the world: --floating frees it"});
  for (const std::string& robot : shipped_robots())
    for (const std::string& note : load_scene(robot).mujoco->notes())
      EXPECT_EQ(note.find("--floating"), std::string::npos) << robot << ": " << note;
}

TEST(Floating, IsRefusedWhereThatIsNoRoot) {
  const auto refused = [](const std::string& text, const char* name,
                          const std::vector<std::string>& words) {
    const TemporaryFile file(text, ".xml");
    expect_refused([&] { load_scene(file.path(), {.floating = name}); }, words);
  };
  refused(quadruped(), "trunk", {"'trunk'", "no root", "'base'"});
  refused(quadruped(), "bas", {"'bas' is unknown", "base"});
  const std::string inertia = "<inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>";
  const auto world = [&](const std::string& inside) {
    return "<mujoco><worldbody>" + inside + "</worldbody></mujoco>";
  };
  const std::string hung = "<body name='hung'><joint name='j'/>" + inertia + "</body>";
  refused(world(hung), "hung", {"'hung' has a joint"});
  refused(world(hung), "", {"no link is welded"});
  const auto base = [&](const std::string& name) {
    return "<body name='" + name + "'><body><joint/>" + inertia + "</body></body>";
  };
  refused(world(base("left") + base("right")), "", {"several", "'left', 'right'"});
  expect_refused([] { load_scene("chain:3", {.floating = ""}); }, {"chain:3"});
}

}  // namespace
}  // namespace kalmarm
