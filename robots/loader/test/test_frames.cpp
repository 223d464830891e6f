// Frames of files by their names, against MuJoCo's own load of the file with nothing fused.
#include <gtest/gtest.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "algorithms/model/mass_matrix.hpp"
#include "kalmarm/dynamics.hpp"
#include "kalmarm/load.hpp"
#include "robots/loader/mujoco_shim.hpp"
#include "robots/loader/test/robot_text.hpp"
#include "robots/scene/sites.hpp"

namespace kalmarm {
namespace {

using Names = std::vector<std::string>;

// An arm on a welded base, with a tool on two welded links, one without inertia, and a finger beyond.
const std::string gripper =
    link("world", "") + link("base", body_of(3)) + link("arm", body_of(2)) + link("flange", "") +
    link("tool0", body_of(.5)) + link("finger", body_of(.1)) + link("tip", "") +
    joint("stand", "fixed", "world", "base") + joint("j", "revolute", "base", "arm") +
    joint("f", "fixed", "arm", "flange") + joint("t", "fixed", "flange", "tool0") +
    joint("g", "prismatic", "tool0", "finger") + joint("n", "fixed", "finger", "tip");

TEST(Frames, OfAUrdfAreAllItsLinks) {
  const LoadedRobot robot = load_robot(TemporaryFile(urdf(gripper), ".urdf").path());
  Names names;
  for (const NamedFrame& frame : robot.frames) names.push_back(frame.name);
  EXPECT_EQ(names, (Names{"world", "base", "arm", "flange", "tool0", "finger", "tip"}));
  EXPECT_EQ(robot.frame("base").link, -1);
  EXPECT_EQ(robot.frame("base").translation, (std::array<double, 3>{.1, .2, .3}));
  for (const char* name : {"arm", "flange", "tool0"}) EXPECT_EQ(robot.frame(name).link, 0);
  for (const char* name : {"finger", "tip"}) EXPECT_EQ(robot.frame(name).link, 1);
}

TEST(Frames, OfLinksThatMujocoFusesMoveAsWhereItDoesNot) {
  install_mujoco_handlers();
  const TemporaryFile file(urdf(gripper), ".urdf");
  const TemporaryFile unfused(urdf("<mujoco><compiler fusestatic='false'/></mujoco>" + gripper),
                              ".urdf");
  char error[1000] = "";
  const std::unique_ptr<mjModel, void (*)(mjModel*)> m(
      mj_loadXML(unfused.path().c_str(), nullptr, error, sizeof error), mj_deleteModel);
  ASSERT_TRUE(m) << error;
  const std::unique_ptr<mjData, void (*)(mjData*)> d(mj_makeData(m.get()), mj_deleteData);
  const Scene scene = load_scene(file.path());
  const auto nv = scene.model.nv();
  LinkKinematics<double> kin(scene.model);
  using Rows = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>;
  Rows linear(3, nv), angular(3, nv);
  MatrixX<double> J(6, nv);
  for (const State& state : random_states(scene, 3, 1)) {
    std::copy(state.q.begin(), state.q.end(), d->qpos);
    mj_kinematics(m.get(), d.get());
    mj_comPos(m.get(), d.get());
    set_position(scene.model, state.q, kin);
    for (const NamedSite& frame : sites_of(scene)) {
      const int body = mj_name2id(m.get(), mjOBJ_BODY, frame.name.c_str());
      ASSERT_GE(body, 0) << frame.name;
      mj_jacBody(m.get(), d.get(), linear.data(), angular.data(), body);
      const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(d->xmat + 9 * body);
      site_jacobian<double>(scene.model, kin, {frame.site}, J);
      EXPECT_LE((J.topRows(3) - R.transpose() * angular).norm(), 1e-14) << frame.name;
      EXPECT_LE((J.bottomRows(3) - R.transpose() * linear).norm(), 1e-14) << frame.name;
    }
  }
}

// By Pinocchio 4.1: J M^-1 J' of a flange on a fixed joint, in its axes, angular rows first.
TEST(Frames, OfAFixedJointHaveTheOperationalInertiaOfPinocchio) {
  const auto part = [](const char* z, const char* mass, const char* xx, const char* zz) {
    return std::string("<inertial><origin xyz='0 0 ") + z + "'/><mass value='" + mass +
           "'/><inertia ixx='" + xx + "' iyy='" + xx + "' izz='" + zz +
           "' ixy='0' ixz='0' iyz='0'/></inertial>";
  };
  const auto at = [](const char* type, const char* parent, const char* child, const char* z) {
    return std::string("<joint name='") + child + "' type='" + type + "'><parent link='" + parent +
           "'/><child link='" + child + "'/><origin xyz='0 0 " + z +
           "'/><axis xyz='0 1 0'/></joint>";
  };
  const TemporaryFile file(
      urdf(link("base", "") + link("upper", part(".15", "2", ".02", ".002")) +
           link("fore", part(".1", "1", ".01", ".001")) + link("tool0", "") +
           at("continuous", "base", "upper", "0") + at("continuous", "upper", "fore", ".3") +
           at("fixed", "fore", "tool0", ".25")),
      ".urdf");
  const LoadedRobot robot = load_robot(file.path());
  DynamicsOptions options;
  options.question.want = {Want::operational};
  options.question.frames = {robot.frame("tool0")};
  const std::vector<double> q = {-0.3065257993733411, -3.0094935305070263};
  MatrixX<double> L(6, 6);
  ASSERT_TRUE(Dynamics<double>(robot.model, options).operational(q, L));
  MatrixX<double> right = MatrixX<double>::Zero(6, 6);
  right(1, 1) = 69.95803356993017, right(1, 3) = right(3, 1) = 13.497901678496508;
  right(1, 5) = right(5, 1) = -0.5303763957946124, right(3, 3) = 3.174895083924825;
  right(3, 5) = right(5, 3) = -0.02651881978973062, right(5, 5) = 0.014094530918111262;
  EXPECT_LE((L - right).norm(), 1e-12 * right.norm());
}

TEST(Frames, ChangeNoNumberOfTheRobot) {
  for (const char* compiler : {"", "<mujoco><compiler boundinertia='.1'/></mujoco>",
                               "<mujoco><compiler settotalmass='7'/></mujoco>"}) {
    const TemporaryFile file(urdf(compiler + gripper), ".urdf");
    const Scene fused = load_scene(file.path());
    Scene unfused = fused;
    unfused.mujoco = MujocoModel::load(file.path(), {}, Frames::kept);
    expect_same_robot(fused, unfused);
  }
}

TEST(Frames, ThatAreUnknownSuggestTheNearest) {
  const LoadedRobot robot = load_robot(TemporaryFile(urdf(gripper), ".urdf").path());
  try {
    robot.frame("tool_0");
    FAIL();
  } catch (const std::invalid_argument& e) {
    EXPECT_NE(std::string(e.what()).find("frame 'tool_0' is unknown; nearest: tool0"),
              std::string::npos)
        << e.what();
  }
}

TEST(Names, OfJointsThatHaveNoneAreDistinct) {
  const std::string hinges = "<joint axis='0 1 0'/><joint type='slide' axis='1 0 0'/>",
                    weight = "<geom size='.1'/>";
  const Scene scene =
      read("<mujoco><worldbody><body>" + hinges + weight + "<body name='body1' pos='1 0 0'>" +
               hinges + weight + "<body name='tip'><joint type='ball'/>" + weight +
               "</body></body></body><body pos='0 1 0'><joint name='tip_joint'/>" + weight +
               "</body></worldbody></mujoco>",
           ".xml");
  Names names;
  for (int k = 0; k < scene.model.nv(); ++k) names.push_back(scene.model.name(k));
  EXPECT_EQ(names, (Names{"body1__joint1", "body1__joint2", "body1_joint1", "body1_joint2",
                          "tip_joint_:x", "tip_joint_:y", "tip_joint_:z", "tip_joint"}));
}

}  // namespace
}  // namespace kalmarm
