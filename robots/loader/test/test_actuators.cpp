// Actuators and compensated weights of files as terms of implicit steps, against MuJoCo's own.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "kalmarm/dynamics.hpp"
#include "kalmarm/load.hpp"
#include "robots/loader/test/refusal.hpp"
#include "robots/loader/test/steps_of_mujoco.hpp"

namespace kalmarm {
namespace {

TEST(Actuators, StepAsMujocoStepsThem) {
  for (const char* one : {
           "<position joint='shoulder' gear='3' kp='200' kv='5'/>",
           "<position joint='shoulder' gear='-3' kp='1e6' dampratio='.7'/>",
           "<velocity joint='slide' gear='.2' kv='500'/>",
           "<motor joint='shoulder' gear='-30' armature='.1' damping='.3'/>",
           "<motor jointinparent='shoulder' gear='2'/>",
           "<general joint='slide' gear='-3' gainprm='11' biastype='affine' biasprm='4 -300 -6'/>",
           "<general joint='slide' gear='2' gaintype='affine' gainprm='11 -50 -6' "
           "biastype='affine' biasprm='4 -300 -6'/>",
           "<damper joint='slide' gear='2' kv='5' ctrlrange='0 .5'/>",
           "<position joint='shoulder' kp='100' ctrlrange='-.1 .1'/>",
           "<position joint='shoulder' kp='100' kv='3'/><motor joint='shoulder' gear='2'/>"
           "<velocity joint='shoulder' kv='8'/>",
       }) {
    SCOPED_TRACE(one);
    std::string named = one;  // the first is called u
    named.insert(named.find(' '), " name='u'");
    expect_steps_of_mujoco(arm(actuators(named)), {.controls = {{"u", .7}}, .takes_steps = true});
    expect_steps_of_mujoco(arm(actuators(named)));
  }
}

// The ratio is one of the inertia that the file has, also where MuJoCo compiles another in its place.
TEST(Actuators, HaveTheDampingRatioOfTheFilesOwnInertia) {
  const auto text = [](const std::string& moments) {
    return mujoco_text(
        "<body name='odd'><joint name='j' axis='1 0 0'/>"
        "<inertial pos='0 0 0' mass='2' diaginertia='" +
            moments + "'/></body>",
        actuators("<position joint='j' kp='50' dampratio='2' gear='3'/>"));
  };
  for (const double other : {.02, .9}) {
    const Scene scene = read(text(".3 .02 " + std::to_string(other)), ".xml", steps);
    ASSERT_EQ(scene.mujoco->actuators().size(), 1);
    EXPECT_NEAR(scene.mujoco->actuators()[0].damping, 9 * 4 * std::sqrt(50 * .3 / 9), 1e-9);
  }
}

TEST(Actuators, AreTermsOfTheLoadedRobot) {
  const TemporaryFile file(
      arm(actuators("<position name='p' joint='slide' gear='2' kp='100' kv='3'/>"
                    "<motor name='m' joint='shoulder' gear='5'/>") +
          "<keyframe><key name='go' ctrl='.4 7'/></keyframe>"),
      ".xml");
  const LoadedRobot robot =
      load_robot(file.path(), {.key = "go", .controls = {{"m", 2}}, .takes_steps = true});
  EXPECT_EQ(robot.notes, Notes{});
  ASSERT_EQ(robot.actuators.size(), 2);
  EXPECT_EQ(robot.actuators[0].name, "p");
  EXPECT_EQ(robot.actuators[0].dof, 1);
  EXPECT_EQ(robot.actuators[0].control, .4);
  EXPECT_EQ(robot.actuators[0].gain, 200);
  EXPECT_EQ(robot.actuators[1].control, 2);
  EXPECT_EQ(robot.terms.stiffness[1], 300 + 400);
  EXPECT_EQ(robot.terms.damping[1], 2 + 12);
  EXPECT_NEAR(robot.terms.reference[1], (300 * .1 + 200 * .4) / 700, 1e-16);
  EXPECT_EQ(robot.terms.stiffness[0], 0);
  EXPECT_EQ(robot.torque[0], 10);
  EXPECT_EQ(robot.torque[1], 0);
}

TEST(Actuators, WithoutTermsAreNamed) {
  const std::string rest =
      "<tendon><spatial name='t'><site site='s'/><site site='r'/></spatial></tendon>" +
      actuators(
          "<motor tendon='t'/><motor tendon='t'/><position joint='slide' kp='9' timeconst='.1'/>"
          "<motor joint='wrist' gear='1 2 3'/><motor site='s'/><motor site='s'/>"
          "<muscle joint='slide' lengthrange='0 1'/><motor joint='slide' forcerange='-1 1'/>"
          "<general joint='slide' biastype='affine' biasprm='0 5 0'/>"
          "<motor joint='slide' group='3'/>");
  std::string text = arm("<option actuatorgroupdisable='3'/>" + rest);
  text.insert(text.find("<joint name='slide'"), "<site name='s'/>");
  text.insert(text.find("<joint name='shoulder'"), "<site name='r' pos='.1 0 0'/>");
  EXPECT_EQ(
      read(text, ".xml", steps).mujoco->notes(),
      (Notes{"ignored: 2 actuators of a spatial tendon, 2 actuators with activation dynamics, "
             "1 actuator of a joint of several axes, 2 actuators of a site, 1 tendon, "
             "force limits of 1 actuator",
             "ignored: 1 actuator with negative stiffness or damping"}));
  expect_steps_of_mujoco(text);
}

TEST(Actuators, HaveTheForceLimitsOfTheirJointsWhereAsked) {
  std::string text = arm(actuators("<motor joint='slide' gear='-2' forcerange='-1 3'/>"));
  text.replace(text.find("<joint name='slide'"), 6, "<joint actuatorfrcrange='-4 5'");
  const TemporaryFile file(text, ".xml");
  const LoadedRobot without = load_robot(file.path(), {.takes_steps = true});
  EXPECT_EQ(without.notes, Notes{"ignored: limits of actuators' forces of 1 joint, "
                                 "force limits of 1 actuator"});
  EXPECT_EQ(without.actuators[0].force_range[1], Actuator::limitless);
  const LoadedRobot robot = load_robot(file.path(), {.takes_steps = true, .limits_forces = true});
  EXPECT_EQ(robot.notes, Notes{});
  EXPECT_EQ(robot.actuators[0].force_range, (std::array{-6.0, 2.0}));
  EXPECT_EQ(robot.force_range[robot.dof("slide")], (std::array{-4.0, 5.0}));
}

// Without its force, what it adds to M and the damping of its joint stays.
TEST(Actuators, WithoutTermsAddTheirArmatureAndDamping) {
  const std::string filtered =
      "<general joint='shoulder' dyntype='filter' dynprm='.1' gear='2' armature='.3' damping='4'/>";
  const Scene scene = read(arm(actuators(filtered)), ".xml", steps);
  EXPECT_EQ(scene.model.joint(0).r, .02 + 4 * .3);
  EXPECT_EQ(joint_terms_of(scene).damping[0], 16);
  expect_steps_of_mujoco(arm(actuators(filtered)));
}

TEST(Actuators, ThatMujocoRefusesCostNoRobot) {
  const std::string bad = "<motor joint='slide' ctrllimited='true' ctrlrange='1 -1'/>";
  const Scene scene = read(arm(actuators(bad)), ".xml", steps);
  ASSERT_EQ(scene.mujoco->notes().size(), 1);
  EXPECT_TRUE(
      scene.mujoco->notes()[0].starts_with("ignored: all actuators, of which MuJoCo refuses"))
      << scene.mujoco->notes()[0];
  const std::string lost = "<motor joint='nowhere'/>";
  EXPECT_NO_THROW(read(arm(actuators(lost)), ".xml", steps));
}

TEST(Controls, AreRefusedInOneLine) {
  const auto refused = [](const std::map<std::string, double>& controls,
                          const std::vector<std::string>& words) {
    const TemporaryFile file(arm(actuators("<motor name='lift' joint='slide'/>"
                                           "<position name='slow' joint='slide' timeconst='1'/>")),
                             ".xml");
    expect_refused([&] { load_robot(file.path(), {.controls = controls}); }, words);
  };
  refused({{"lif", 1}}, {"actuator 'lif' is unknown", "lift"});
  refused({{"lift", std::numeric_limits<double>::quiet_NaN()}}, {"'lift'", "not finite"});
  refused({{"slow", 1}}, {"'slow'", "activation dynamics"});
  expect_refused([] { load_scene("chain:3", {.controls = {{"a", 1}}}); }, {"chain:3"});
}

// Every share; also of the slide's weight by its actuator, and with gravity that is no z axis.
TEST(Compensation, OfGravityIsThatOfMujoco) {
  for (const char* share : {"gravcomp='1'", "gravcomp='.4'", "gravcomp='2.5'"})
    for (const char* option : {"", "<option gravity='3 -2 -8'/>"}) {
      SCOPED_TRACE(share);
      expect_steps_of_mujoco(arm(option, share));
      expect_steps_of_mujoco(
          arm(option + actuators("<position joint='slide' kp='1e3' kv='10'/>"), share));
    }
}

// A robot whose every weight is compensated stays where it stands.
TEST(Compensation, BearsTheRobot) {
  const TemporaryFile file(
      mujoco_text("<body gravcomp='1'><joint axis='0 1 0'/><inertial pos='.3 0 "
                  "0' mass='2' diaginertia='1 1 1'/></body>"),
      ".xml");
  const LoadedRobot robot = load_robot(file.path(), steps);
  EXPECT_EQ(robot.notes, Notes{});
  ASSERT_TRUE(robot.compensated);
  Dynamics<double> weights(*robot.compensated), dynamics(robot.model);
  const std::vector<double> q = {.7}, rest = {0};
  std::vector<double> tau(1), a(1);
  weights.inverse_dynamics(q, rest, rest, tau);
  EXPECT_NEAR(tau[0], -2 * 9.81 * .3 * std::cos(.7), 1e-14);
  ASSERT_TRUE(dynamics.forward_dynamics(q, rest, tau, a));
  EXPECT_NEAR(a[0], 0, 1e-14);
  EXPECT_FALSE(load_robot(TemporaryFile(arm(""), ".xml").path(), steps).compensated);
}

TEST(Compensation, IsNamedWhereNegative) {
  const Scene scene = read(arm("", "gravcomp='-1'"), ".xml", steps);
  EXPECT_EQ(scene.mujoco->notes(), Notes{"ignored: negative gravity compensation of 3 bodies"});
  expect_steps_of_mujoco(arm("", "gravcomp='-1'"));
}

// A body that floats alone is not stepped as others are: MuJoCo takes its gyroscopic torque at the end.
TEST(Floating, AreTheDofOfBodiesWithoutJointsOnThem) {
  const std::string free =
      "<body pos='1 0 0'><freejoint/><inertial pos='.1 0 .2' mass='2' "
      "diaginertia='.03 .04 .05'/></body>";
  const Scene scene = read(mujoco_text("<body><joint/><inertial pos='.1 0 0' mass='1' "
                                       "diaginertia='1 1 1'/></body>" +
                                       free),
                           ".xml");
  EXPECT_EQ(lone_free_dofs(scene.model),
            (std::vector<bool>{false, true, true, true, true, true, true}));
  const std::vector<bool> none = lone_free_dofs(load_scene("g1").model);
  EXPECT_EQ(std::ranges::count(none, true), 0);
}

// Files may switch springs, dampers and actuators off.
TEST(Actuators, AreOffWhereTheFileSaysSo) {
  const Scene scene = read(arm("<option><flag actuation='disable' spring='disable'/></option>" +
                               actuators("<position joint='slide' kp='9' kv='8'/>")),
                           ".xml", steps);
  EXPECT_EQ(scene.mujoco->notes(), Notes{});
  EXPECT_TRUE(scene.mujoco->actuators().empty());
  EXPECT_EQ(joint_terms_of(scene).stiffness[1], 0);
  EXPECT_EQ(joint_terms_of(scene).damping[1], 2);
}

}  // namespace
}  // namespace kalmarm
