// What LoadOptions change of a file, and what is said of it, against MuJoCo's own reading of a file
// that says the same.
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <tuple>
#include <vector>

#include "algorithms/model/plain.hpp"
#include "kalmarm/dynamics.hpp"
#include "kalmarm/load.hpp"
#include "robots/loader/names.hpp"
#include "robots/loader/test/refusal.hpp"
#include "robots/loader/test/robot_text.hpp"
#include "robots/loader/test/temporary_file.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm {
namespace {

// A trunk on a base without mass, and three legs.
std::string quadruped() {
  std::string out =
      link("base", "") + link("trunk", body_of(5)) + joint("f", "fixed", "base", "trunk");
  for (const std::string leg : {"a", "b", "c"})
    out += link(leg, body_of(1)) + joint("hip_" + leg, "revolute", "trunk", leg);
  return urdf(out);
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
  EXPECT_EQ(
      scene.mujoco->notes(),
      Notes{"3 limbs hang on 'base', which is welded to the world: option floating frees it"});
  for (const std::string& robot : shipped_robots()) {
    const Scene shipped = load_scene(robot);
    for (const std::string& note : shipped.mujoco->notes())
      EXPECT_EQ(note.find("option floating"), std::string::npos) << robot << ": " << note;
  }
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

std::string mjcf(const std::string& worldbody, const std::string& rest = "") {
  return "<mujoco><worldbody>" + worldbody + "</worldbody>" + rest + "</mujoco>";
}

std::string hinged(const std::string& inertia, const std::string& joint = "name='j'") {
  return "<body name='odd' quat='.8 .1 -.3 .5'><joint axis='0 1 0' " + joint + "/>" +
         "<joint axis='1 0 0'/>" + inertia + "</body>";
}

std::string principal(const std::string& moments) {
  return "<inertial pos='.1 0 .2' mass='2' quat='.6 0 .8 0' diaginertia='" + moments + "'/>";
}

// Rods and points; MuJoCo's dynamics take them, and a solid body that is a rod to 1e-9 of its size
// moves alike. Whole tensors are turned.
TEST(GivenInertia, MayHaveZeroMoments) {
  const std::string tip =
      "<body pos='.1 .2 .3'><joint axis='0 0 1'/>" + principal("1 1 1") + "</body>";
  const auto with = [&](const std::string& inertia) {
    return read(mjcf("<body name='thin'><joint axis='0 1 0'/>" + inertia + tip + "</body>"),
                ".xml");
  };
  const std::string full = "<inertial pos='.1 0 .2' mass='2' fullinertia='";
  for (const auto& [thin, thick] :
       {std::pair{principal("1 1 0"), principal("1 1 1e-9")},
        {principal("0 0 0"), principal("1e-9 1e-9 1e-9")},
        {full + "1 1 2 1 0 0'/>", full + "1.000000001 1 2 1 0 0'/>"},
        {full + "1e-20 -1e-20 0 0 0 0'/>", full + "1e-9 1e-9 1e-9 0 0 0'/>"}}) {
    const Scene scene = with(thin);
    EXPECT_EQ(scene.mujoco->notes(),
              Notes{"taken as given, although no solid body has such moments of inertia: 'thin'"});
    expect_same_robot(scene, with(thick), 1e-8);
    Dynamics<double> dynamics(plain(scene.model));
    MujocoSolver mujoco(scene.mujoco);
    VectorX<double> ours(2), theirs(2);
    for (const State& state : random_states(scene, 5, 3)) {
      ASSERT_TRUE(dynamics.forward_dynamics(state.q, state.qd, state.tau, ours));
      ASSERT_TRUE(mujoco.acceleration(state.q, state.qd, state.tau, theirs));
      EXPECT_LE((ours - theirs).norm(), 1e-11 * theirs.norm());
    }
  }
}

// A joint of two axes, as URDF writes it, is a hinge on a hinge in MJCF.
TEST(GivenInertia, MayBeNoneBetweenJoints) {
  const Scene apart =
      read(urdf(link("base", "") + link("cross", "") +
                link("fork",
                     "<inertial><mass value='0'/>"
                     "<inertia ixx='0' iyy='0' izz='0' ixy='0' ixz='0' iyz='0'/></inertial>") +
                link("arm", body_of(2)) + joint("a", "revolute", "base", "cross") +
                joint("b", "prismatic", "cross", "fork") + joint("c", "revolute", "fork", "arm")),
           ".urdf");
  EXPECT_EQ(apart.mujoco->notes(), Notes{});
  ASSERT_EQ(apart.model.nv(), 3);
  const std::string heavy =
      "<inertial><mass value='1e-9'/><inertia ixx='1e-9' iyy='1e-9' izz='1e-9' "
      "ixy='0' ixz='0' iyz='0'/></inertial>";
  expect_same_robot(
      apart,
      read(urdf(link("base", "") + link("cross", heavy) + link("fork", heavy) +
                link("arm", body_of(2)) + joint("a", "revolute", "base", "cross") +
                joint("b", "prismatic", "cross", "fork") + joint("c", "revolute", "fork", "arm")),
           ".urdf"),
      1e-7);
}

// By hand: second moments -0.5, -0.5, 1.5 become 0.00015, 0.00015, 1.5; and 0.05, 0.04, -0.03 have
// the last become 5e-6.
TEST(Balanced, IsTheNearestSolidBody) {
  const LoadOptions balanced = {.inertia = InertiaPolicy::balanced};
  for (const auto& [given, nearest, words] :
       {std::tuple{"1 1 -1", "1.50015 1.50015 .0003", "from 1, 1, -1 to 1.5, 1.5, 0.0003 kg m^2"},
        {".01 .02 .09", ".040005 .050005 .09",
         "from 0.01, 0.02, 0.09 to 0.04, 0.05, 0.09 kg m^2"}}) {
    const Scene scene = read(mjcf(hinged(principal(given))), ".xml", balanced);
    EXPECT_EQ(scene.mujoco->notes(),
              Notes{std::string("balanced moments of inertia: 'odd' ") + words});
    expect_same_robot(scene, read(mjcf(hinged(principal(nearest))), ".xml"));
  }
}

TEST(Balanced, TurnsWithAWholeTensorAndLeavesSolidBodiesAlone) {
  const LoadOptions balanced = {.inertia = InertiaPolicy::balanced};
  const std::string frame = "<inertial pos='0 0 0' mass='1' ";
  // Moments -1, 3 about (1, -1, 0), (1, 1, 0), and 1; second moments 2.5, -1.5, 0.5.
  const Scene scene = read(mjcf(hinged(frame + "fullinertia='1 1 1 2 0 0'/>")), ".xml", balanced);
  // 0.50025 and 3 about the same axes, and 2.50025.
  const Scene right =
      read(mjcf(hinged(frame + "fullinertia='1.750125 1.750125 2.50025 1.249875 0 0'/>")), ".xml");
  expect_same_robot(scene, right);
  const Scene solid = read(mjcf(hinged(principal("1 2 2.5"))), ".xml", balanced);
  EXPECT_EQ(solid.mujoco->notes(), Notes{});
  expect_same_robot(solid, read(mjcf(hinged(principal("1 2 2.5"))), ".xml"));
}

TEST(Key, IsWhereTheRobotStands) {
  const std::string free = "<body name='b'><freejoint/>" + principal("1 1 1") + "</body>";
  const std::string keys =
      "<keyframe><key name='up' qpos='1 2 3 0 0 2 0 .5 .6' qvel='1 2 3 4 5 6 7 8' ctrl='1'/>"
      "<key name='rest'/><key qpos='0 0 0 1 0 0 0 0 0'/></keyframe>";
  const std::string text =
      mjcf(free + hinged(principal("1 1 1")), keys + "<actuator><motor joint='j'/></actuator>");
  const TemporaryFile file(text, ".xml");
  const State up = home_state(load_scene(file.path(), {.key = "up"}));
  EXPECT_EQ(up.q, (VectorX<double>(9) << 1, 2, 3, 0, 0, 1, 0, .5, .6).finished());
  EXPECT_EQ(up.qd, (VectorX<double>(8) << 1, 2, 3, 4, 5, 6, 7, 8).finished());
  EXPECT_EQ(up.tau, VectorX<double>::Zero(8));
  const LoadedRobot loaded = load_robot(file.path(), {.key = "up"});
  EXPECT_EQ(loaded.home[8], .6);
  EXPECT_EQ(loaded.home_velocity[7], 8);
  const State rest = home_state(load_scene(file.path(), {.key = "rest"}));
  EXPECT_EQ(rest.q, home_position(load_scene(file.path())));
  EXPECT_EQ(rest.qd, VectorX<double>::Zero(8));
  expect_refused([&] { load_scene(file.path(), {.key = "dwn"}); },
                 {file.path(), "'dwn'", "known: up, rest"});
}

TEST(Key, IsRefusedWhereItIsNoStateOfTheRobot) {
  const auto refused = [](const std::string& key, const LoadOptions& options,
                          const std::vector<std::string>& words) {
    const TemporaryFile file(
        mjcf("<body name='base'>" + principal("1 1 1") + hinged(principal("1 1 1")) + "</body>",
             key),
        ".xml");
    expect_refused([&] { load_scene(file.path(), options); }, words);
  };
  refused("", {.key = "up"}, {"'up'", "none with a name"});
  const std::string up = "<keyframe><key name='up' qpos='1 2'/></keyframe>";
  refused(up, {.floating = "", .key = "up"}, {"2 positions", "robot has 9"});
  refused("<keyframe><key name='up' qvel='1'/></keyframe>", {.key = "up"}, {"1 velocities"});
  expect_refused([] { load_scene("chain:3", {.key = "up"}); }, {"chain:3"});
}

TEST(Armature, IsThatOfTheFileGiven) {
  const std::string inertia = principal("1 1 1");
  const std::string motor = "<actuator><motor joint='j' gear='3' armature='.2'/></actuator>";
  for (const std::string& rest : {std::string(), motor})
    expect_same_robot(read(mjcf(hinged(inertia), rest), ".xml", {.armature = {{"j", .7}}}),
                      read(mjcf(hinged(inertia, "name='j' armature='.7'")), ".xml"));
  const TemporaryFile file(mjcf(hinged(inertia)), ".xml");
  expect_refused(
      [&] {
        load_scene(file.path(), {.armature = {{"jj", .7}}});
      },
      {file.path(), "'jj' is unknown", "j"});
  for (const double wrong : {-1.0, std::numeric_limits<double>::infinity()})
    expect_refused([&] { load_scene(file.path(), {.armature = {{"j", wrong}}}); }, {"'j'"});
}

TEST(Counted, HasTheFieldsPlurals) {
  EXPECT_EQ(counted(1, "mesh"), "1 mesh");
  EXPECT_EQ(counted(2, "mesh"), "2 meshes");
  EXPECT_EQ(counted(2, "flex"), "2 flexes");
  EXPECT_EQ(counted(2, "body"), "2 bodies");
  EXPECT_EQ(counted(2, "equality"), "2 equalities");
  EXPECT_EQ(counted(2, "keyframe"), "2 keyframes");
  EXPECT_EQ(counted(3, "coupling of joints"), "3 couplings of joints");
}

}  // namespace
}  // namespace kalmarm
