// Bad files are refused with one line that names what is wrong; nothing crashes.
#include <gtest/gtest.h>

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/uniform_int_distribution.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "robots/loader/input_error.hpp"
#include "robots/loader/test/refusal.hpp"
#include "robots/loader/test/temporary_file.hpp"
#include "robots/scene/scene.hpp"
#include "robots/scene/state_file.hpp"

namespace kalmarm {
namespace {

void expect_file_refused(const std::string& xml, std::vector<std::string> words) {
  const TemporaryFile file(xml, ".xml");
  words.push_back(file.path());
  expect_refused([&] { load_scene(file.path()); }, words);
}

std::string arm(const std::string& inertial, const std::string& rest = "") {
  return "<mujoco><worldbody><body name='upper'><joint name='shoulder' axis='0 1 0'/>" + inertial +
         "</body></worldbody>" + rest + "</mujoco>";
}

constexpr const char* good = "<inertial pos='0 0 .1' mass='1' diaginertia='.1 .1 .1'/>";

TEST(BadFile, Missing) {
  expect_refused([] { load_scene("nowhere.xml"); }, {"nowhere.xml"});
}

TEST(BadFile, NotXml) { expect_file_refused("this is no XML", {}); }

TEST(BadFile, Empty) { expect_file_refused("", {}); }

TEST(BadFile, UnknownElementIsNamed) {
  expect_file_refused("<mujoco><worldbody><bdoy/></worldbody></mujoco>", {"bdoy"});
}

TEST(BadFile, NamesWithLineEndsDoNotBreakTheLine) {
  expect_file_refused("<mujoco><worldbody><body><joint name='el&#10;bow' armature='-.5'/>" +
                          std::string(good) + "</body></worldbody></mujoco>",
                      {"el bow"});
}

// MuJoCo's reader would end the program.
TEST(BadFile, ModelToAttachWithoutAFile) {
  expect_file_refused(arm(good, "<asset><model name='gripper'/></asset>"), {"gripper", "no file"});
}

TEST(BadFile, XacroIsToBeExpandedFirst) {
  expect_file_refused(
      "<robot name='r' xmlns:xacro='http://wiki.ros.org/xacro'><xacro:property name='m' value='1'/>"
      "<link name='base'/></robot>",
      {"macros", "xacro "});
}

TEST(BadFile, XacroThatIsLeftOverInWhatOnlyDrawsIsNot) {
  const std::string left = "<xacro:left name='over'/>";
  const std::string robot =
      "<robot name='r' xmlns:xacro='http://wiki.ros.org/xacro'><material name='m'>" + left +
      "</material><gazebo>" + left + "</gazebo><sensor name='s'>" + left +
      "</sensor><link name='base'/><link name='arm'><visual><geometry><box size='1 1 "
      "1'/></geometry>"
      "<material name='n'>" +
      left + "</material></visual><inertial><mass value='1'/>" +
      "<inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>"
      "<joint name='j' type='continuous'><parent link='base'/><child link='arm'/></joint>";
  EXPECT_EQ(load_scene(TemporaryFile(robot + "</robot>", ".urdf").path()).model.nv(), 1);
  expect_file_refused(robot + left + "</robot>", {"macros"});
}

TEST(BadFile, WithoutAJointMayFloat) {
  const TemporaryFile file(
      "<robot name='r'><link name='base'><inertial><mass value='1'/><inertia ixx='1' iyy='1' "
      "izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>",
      ".urdf");
  expect_refused([&] { load_scene(file.path()); }, {"no degree of freedom", "option floating"});
  EXPECT_EQ(load_scene(file.path(), {.floating = ""}).model.nv(), 6);
}

TEST(BadFile, OtherFormatsAreToBeConverted) {
  expect_file_refused(
      "<?xml version='1.0'?><!-- <mujoco> --><sdf version='1.9'><model name='m'/></sdf>",
      {"SDF", "sdf2mjcf "});
  expect_file_refused("#usda 1.0\ndef Xform \"robot\" {}\n", {"USD", "usd_to_urdf "});
  expect_file_refused("PXR-USDC binary", {"USD", "usd_to_urdf "});
  expect_file_refused("<mujocoinclude><body name='b'/></mujocoinclude>", {"<include file="});
}

TEST(BadFile, UrdfWithSeveralRoots) {
  expect_file_refused(
      "<robot name='r'><link name='a'/><link name='b'/><link name='c'/>"
      "<joint name='j' type='revolute'><parent link='a'/><child link='c'/></joint>"
      "</robot>",
      {"several links have no parent", "'a', 'b'"});
}

TEST(BadFile, NoJoint) {
  expect_file_refused("<robot name='r'><link name='a'/></robot>", {"no degree of freedom"});
  expect_file_refused(
      "<mujoco><worldbody><body name='a'>" + std::string(good) + "</body></worldbody></mujoco>",
      {"no degree of freedom"});
}

TEST(BadFile, GravityThatIsNotFinite) {
  expect_file_refused("<mujoco><option gravity='-inf 1 -9.81'/><worldbody><body name='a'>" +
                          ("<joint axis='0 1 0'/>" + std::string(good)) +
                          "</body></worldbody></mujoco>",
                      {"gravity", "not finite"});
}

// Its norm overflows.
TEST(BadFile, QuaternionThatIsTooLong) {
  expect_file_refused("<mujoco><worldbody><body name='a' quat='.7 .1 1e308 0'>" +
                          ("<joint axis='0 1 0'/>" + std::string(good)) +
                          "</body></worldbody></mujoco>",
                      {"out of range"});
}

// An angle of 1e30 is no angle in float64, and the square of 1e307 m overflows.
TEST(RandomStates, JointWithAnEndlessRangeIsDrawnAsOneWithoutALimit) {
  for (const std::string type : {"hinge", "slide"}) {
    const TemporaryFile file(
        "<mujoco><compiler angle='radian'/><worldbody><body><joint axis='0 1 0' type='" + type +
            "' limited='true' range='0 1e307'/>" + good + "</body></worldbody></mujoco>",
        ".xml");
    for (const State& state : random_states(load_scene(file.path()), 20, 1))
      EXPECT_LE(std::abs(state.q[0]), type == "hinge" ? 3.2 : 0.5);
  }
}

TEST(BadFile, NegativeMass) {
  expect_file_refused(arm("<inertial pos='0 0 0' mass='-1' diaginertia='1 1 1'/>"),
                      {"'upper'", "negative mass"});
}

TEST(BadFile, InertiaWithANegativeMoment) {
  for (const char* moments : {"diaginertia='1 1 -1'", "fullinertia='1 1 1 2 0 0'"})
    expect_file_refused(arm("<inertial pos='0 0 0' mass='1' " + std::string(moments) + "/>"),
                        {"upper", "inertia=balanced"});
}

// Random states would be drawn from it.
TEST(BadFile, RangeWhoseWidthOverflows) {
  for (const char* type : {"hinge", "slide"})
    expect_file_refused("<mujoco><compiler angle='radian'/><worldbody><body>" +
                            std::string("<joint name='elbow' type='") + type +
                            "' limited='true' range='-1e308 1e308'/>" + good +
                            "</body></worldbody></mujoco>",
                        {"elbow", "range"});
}

TEST(BadFile, NotANumber) {
  expect_file_refused(arm("<inertial pos='0 nan 0' mass='1' diaginertia='1 1 1'/>"), {});
  expect_file_refused(arm("<inertial pos='0 0 0' mass='inf' diaginertia='1 1 1'/>"), {});
}

TEST(BadFile, NegativeArmature) {
  expect_file_refused("<mujoco><worldbody><body><joint name='elbow' armature='-.5'/>" +
                          std::string(good) + "</body></worldbody></mujoco>",
                      {"elbow", "-0.5"});
}

TEST(BadFile, ActuatorArmatureOnABallJoint) {
  expect_file_refused("<mujoco><worldbody><body><joint type='ball' name='hip'/>" +
                          std::string(good) +
                          "</body></worldbody><actuator><motor joint='hip' armature='.1'/>"
                          "</actuator></mujoco>",
                      {"hip"});
}

TEST(BadFile, MissingMeshThatTheInertiaNeeds) {
  expect_file_refused(
      arm("<geom type='mesh' mesh='m'/>", "<asset><mesh name='m' file='nowhere.stl'/></asset>"),
      {"nowhere.stl"});
}

TEST(BadFile, TendonArmatureCouplesJoints) {
  expect_file_refused(
      arm(good,
          "<tendon><fixed name='belt' armature='.1'><joint joint='shoulder' coef='1'/>"
          "</fixed></tendon>"),
      {"belt"});
}

TEST(BadScene, FamilySize) {
  for (const char* what : {"chain:0", "chain:-3", "chain:x", "chain:", "chain:3.5", "chain:1001"})
    expect_refused([&] { load_scene(what); }, {what});
}

TEST(BadScene, SizeOfAShippedRobot) {
  expect_refused([] { load_scene("panda:8"); }, {"panda:8", "panda"});
}

TEST(BadScene, Unknown) {
  expect_refused([] { load_scene("pandda"); }, {"pandda", "panda", "chain"});
}

TEST(BadScene, MujocoTakesNoBreadthFirstModel) {
  Model<double> chain = load_scene("chain:3").model;
  std::vector<Joint<double>> joints;
  for (const int parent : {-1, 0, 0, 1}) {
    joints.push_back(chain.joint(1));
    joints.back().parent = parent;
    joints.back().q_index = static_cast<int>(joints.size()) - 1;
  }
  const Model<double> model(joints, {"a", "b", "c", "d"}, 4, chain.gravity());
  expect_refused([&] { MujocoModel::from(model, "m"); }, {"depth first"});
}

class StateFileTest : public testing::Test {
 protected:
  void expect_refused_states(const std::string& json, const std::vector<std::string>& words) const {
    const TemporaryFile file(json, ".json");
    expect_refused([&] { read_states(scene, file.path()); }, words);
  }

  Scene scene = load_scene("two_link");
};

TEST_F(StateFileTest, BadFiles) {
  expect_refused([&] { read_states(scene, "nowhere.json"); }, {"nowhere.json"});
  expect_refused_states("{", {"not a JSON file"});
  expect_refused_states("[1, 2]", {"states"});
  expect_refused_states(R"({"states": []})", {"no states"});
  expect_refused_states(R"({"states": [3]})", {"state 0"});
}

TEST_F(StateFileTest, WrongNumberOfValues) {
  expect_refused_states(R"({"states": [{"qpos": [1], "qvel": [0, 0], "tau": [0, 0]}]})",
                        {"qpos", "1", "2"});
  expect_refused_states(R"({"states": [{"qpos": [1, 2], "qvel": [0, 0]}]})", {"tau"});
}

TEST_F(StateFileTest, ValuesThatAreNotFinite) {
  expect_refused_states(R"({"states": [{"qpos": [1, 1e999], "qvel": [0, 0], "tau": [0, 0]}]})", {});
  expect_refused_states(R"({"states": [{"qpos": [1, null], "qvel": [0, 0], "tau": [0, 0]}]})",
                        {"qpos[1]", "null"});
  expect_refused_states(R"({"states": [{"qpos": [1, "nan"], "qvel": [0, 0], "tau": [0, 0]}]})",
                        {"qpos[1]", "nan"});
}

TEST(StateFile, QuaternionsAreNormalised) {
  const Scene scene = load_scene("go2");
  std::string text = R"({"states": [{"qpos": [0,0,0, 0,2,0,0, 0,0,0,0,0,0,0,0,0,0,0,0],)";
  text +=
      R"("qvel": [0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0], "tau": [0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0,0]}]})";
  const StateFile file = read_states(scene, TemporaryFile(text, ".json").path());
  EXPECT_EQ(file.normalized, 1);
  EXPECT_EQ(file.states[0].q[4], 1);
  const std::size_t two = text.find("0,2,0,0");
  expect_refused(
      [&] { read_states(scene, TemporaryFile(text.replace(two, 7, "0,0,0,0"), ".json").path()); },
      {"quaternion", "qpos[3]"});
}

TEST(RandomStates, AreWithinLimitsAndReproducible) {
  const Scene scene = load_scene("go2");
  const std::vector<State> states = random_states(scene, 200, 5);
  const std::vector<State> again = random_states(scene, 200, 5);
  const std::vector<State> other = random_states(scene, 200, 6);
  for (std::size_t i = 0; i < states.size(); ++i) {
    EXPECT_EQ(states[i].q, again[i].q);
    EXPECT_NE(states[i].q, other[i].q);
    EXPECT_NEAR(states[i].q.segment<4>(3).norm(), 1, 1e-15);
    for (int j = 7; j < scene.model.nq(); ++j) {
      EXPECT_GE(states[i].q[j], scene.range[j][0]);
      EXPECT_LE(states[i].q[j], scene.range[j][1]);
    }
  }
}

// Files with random bytes changed, lost or doubled either load or are refused.
TEST(MutatedFiles, LoadOrAreRefused) {
  boost::random::mt19937 random(11);
  const auto below = [&](std::size_t n) {
    return boost::random::uniform_int_distribution<std::size_t>(0, n - 1)(random);
  };
  int loaded = 0, refused = 0;
  for (const std::string& name : shipped_robots()) {
    std::ifstream file(std::filesystem::path(KALMARM_ROBOTS_DIR) / name / (name + ".xml"));
    const std::string original((std::istreambuf_iterator<char>(file)), {});
    for (int trial = 0; trial < 40; ++trial) {
      std::string text = original;
      for (std::size_t i = 0, changes = 1 + below(4); i < changes; ++i) {
        const std::size_t at = below(text.size()), length = 1 + below(8);
        switch (below(4)) {
          case 0:
            text[at] = static_cast<char>(32 + below(95));
            break;
          case 1:
            text.erase(at, length);
            break;
          case 2:
            text.insert(at, text.substr(at, length));
            break;
          case 3:
            text.replace(at, 1, "9e99");
            break;
        }
      }
      const TemporaryFile mutated(text, ".xml");
      try {
        const Scene scene = load_scene(mutated.path());
        EXPECT_GT(scene.model.nv(), 0);
        ++loaded;
      } catch (const InputError&) {
        ++refused;
      }
    }
  }
  EXPECT_GT(loaded, 0);
  EXPECT_GT(refused, 0);
}

}  // namespace
}  // namespace kalmarm
