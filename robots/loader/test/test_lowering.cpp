// The lowered model against MuJoCo's own dynamics, on files that use what MJCF and URDF offer.
#include <gtest/gtest.h>

#include <cmath>

#include "algorithms/model/inverse_dynamics.hpp"
#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/model/plain.hpp"
#include "kalmarm/dynamics.hpp"
#include "kalmarm/implicit_step.hpp"
#include "kalmarm/load.hpp"
#include "robots/loader/test/temporary_file.hpp"
#include "robots/scene/mujoco_solver.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm {
namespace {

constexpr const char* inertia =
    R"(<inertial pos=".1 -.05 .2" mass="1.3" quat=".8 .1 -.3 .5" diaginertia=".03 .04 .05"/>)";

std::string robot(const std::string& worldbody, const std::string& rest = "") {
  return "<mujoco><compiler angle='radian' autolimits='true'/><worldbody>" + worldbody +
         "</worldbody>" + rest + "</mujoco>";
}

std::string body(const std::string& joints, const std::string& inside = "") {
  return "<body pos='.3 .2 -.1' quat='.5 -.4 .7 .3'>" + joints + inertia + inside + "</body>";
}

Scene scene_of(const std::string& xml, const std::string& ending = ".xml") {
  return load_scene(TemporaryFile(xml, ending).path());
}

// Largest relative difference of M and of a over random states.
struct Difference {
  double mass = 0, acceleration = 0;
};

Difference against_mujoco(const Scene& scene, int count) {
  const Model<double>& model = scene.model;
  const int nv = model.nv();
  MujocoSolver mujoco(mujoco_of(scene));
  Dynamics<double> dynamics(plain(model));
  LinkKinematics<double> kin(model);
  CompositeInertia<double> composite(model);
  MatrixX<double> M(nv, nv), M_mujoco(nv, nv);
  VectorX<double> a(nv), a_mujoco(nv);
  Difference out;
  for (const State& state : random_states(scene, count, 7)) {
    set_position(model, state.q, kin);
    mass_matrix(model, kin, composite, Eigen::Ref<MatrixX<double>>(M));
    mujoco.mass(state.q, M_mujoco);
    EXPECT_TRUE(mujoco.acceleration(state.q, state.qd, state.tau, a_mujoco));
    EXPECT_TRUE(dynamics.forward_dynamics(state.q, state.qd, state.tau, a));
    out.mass = std::max(out.mass, (M - M_mujoco).norm() / M_mujoco.norm());
    out.acceleration = std::max(out.acceleration, (a - a_mujoco).norm() / a_mujoco.norm());
  }
  return out;
}

void expect_agreement(const Scene& scene, int nv) {
  ASSERT_EQ(scene.model.nv(), nv);
  const Difference difference = against_mujoco(scene, 20);
  EXPECT_LE(difference.mass, 1e-13);
  EXPECT_LE(difference.acceleration, 1e-10);
}

TEST(Gravity, IsWhatTheFileSaysAndNoneWhereItsFlagIsOff) {
  const std::string arm = body("<joint axis='0 1 0'/>");
  const Scene falls = scene_of(robot(arm, "<option gravity='1 2 -3'/>"));
  EXPECT_EQ(falls.model.gravity(), Vector3<double>(1, 2, -3));
  const Scene floats =
      scene_of(robot(arm, "<option gravity='1 2 -3'><flag gravity='disable'/></option>"));
  EXPECT_EQ(floats.model.gravity(), Vector3<double>::Zero());
  for (const Scene& scene : {falls, floats}) expect_agreement(scene, 1);
}

using Notes = std::vector<std::string>;

TEST(Ignored, NamesWhatNoSolverSees) {
  const std::string arm =
      body("<joint name='a' axis='0 1 0' damping='3'/>",
           "<body name='b' gravcomp='1'><joint name='b' axis='1 0 0' damping='1' stiffness='2'/>" +
               std::string(inertia) + "</body>");
  const Scene scene =
      scene_of(robot(arm + "<body name='free'><freejoint/>" + inertia + "</body>",
                     "<equality><joint joint1='a' joint2='b'/><connect body1='b' anchor='0 0 0'/>"
                     "<weld body1='b' active='false'/></equality>"
                     "<actuator><motor joint='a'/><position joint='b'/></actuator>"
                     "<option density='1.2'/>"));
  EXPECT_EQ(
      scene.mujoco->notes(),
      Notes{
          "ignored: 1 coupling of joints, 1 connect constraint, 2 actuators, damping of 2 joints, "
          "springs of 1 joint, gravity compensation of 1 body, drag of a medium"});
  const Scene plain_arm = scene_of(robot(body("<joint axis='0 1 0' armature='1' range='-1 1'/>")));
  EXPECT_EQ(plain_arm.mujoco->notes(), Notes{});
}

// As principal moments and as a whole tensor, turned; on a URDF too. MuJoCo's dynamics take them.
TEST(GivenInertia, IsTakenAsItIsWhereNoSolidBodyHasIt) {
  const std::string principal =
      "<inertial pos='.1 0 .2' mass='2' quat='.8 .1 -.3 .5' diaginertia='.01 .02 .09'/>";
  const std::string whole =
      "<inertial pos='0 .1 .2' mass='2' fullinertia='.055 .055 .03 .035 0 0'/>";  // .09, .02, .03
  for (const std::string& odd : {principal, whole}) {
    const Scene scene =
        scene_of(robot("<body name='odd'><joint axis='0 1 0'/><joint axis='1 0 0'/>" + odd +
                       "</body>" + body("<joint axis='0 0 1'/>")));
    expect_agreement(scene, 3);
    EXPECT_EQ(scene.mujoco->notes(),
              Notes{"taken as given, although no solid body has such moments of inertia: 'odd'"});
    Vector3<double> moments = scene.model.joint(1).body.moments;
    std::sort(moments.begin(), moments.end());
    EXPECT_LE(
        (moments - Vector3<double>(odd == whole ? .02 : .01, odd == whole ? .03 : .02, .09)).norm(),
        1e-15);
  }
}

// A URDF's link of 1 kg with the moments Ixx, 1 and 1, and a joint about z.
std::string urdf_link(const std::string& name, const std::string& Ixx = "1") {
  return "<link name='" + name + "'><inertial><mass value='1'/><inertia ixx='" + Ixx +
         "' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>";
}
std::string urdf_joint(const std::string& name, const std::string& type, const std::string& parent,
                       const std::string& child, const std::string& rest = "") {
  return "<joint name='" + name + "' type='" + type + "'><parent link='" + parent +
         "'/><child link='" + child + "'/><origin xyz='0.1 0.2 0.3' rpy='0.3 0 0.7'/>" +
         "<axis xyz='0 0 1'/><limit lower='-1' upper='1' effort='1' velocity='1'/>" + rest +
         "</joint>";
}

// MuJoCo would fuse what is fixed to a link with it.
TEST(GivenInertia, IsTakenWhereItIsFixedToAnother) {
  for (const auto& [arm, hand] : {std::pair{"3", "1"}, {"1", "3"}, {"3", "4"}}) {
    const Scene scene =
        scene_of("<robot name='r'>" + urdf_link("base") + urdf_link("arm", arm) +
                     urdf_link("hand", hand) + urdf_joint("j", "revolute", "base", "arm") +
                     urdf_joint("f", "fixed", "arm", "hand") + "</robot>",
                 ".urdf");
    expect_agreement(scene, 1);
    EXPECT_EQ(scene.mujoco->notes().size(), 1);
    // Izz of the arm, of the hand as it is turned, and its mass by the distance from the axis.
    MujocoSolver mujoco(scene.mujoco);
    MatrixX<double> M(1, 1);
    mujoco.mass(home_position(scene), M);
    const Eigen::AngleAxisd z(0.7, Vector3<double>::UnitZ()), x(0.3, Vector3<double>::UnitX());
    const Matrix3<double> R = (z * x).toRotationMatrix();
    const Vector3<double> of_hand(std::stod(hand), 1, 1);
    const double Izz = R.row(2).cwiseAbs2() * of_hand;
    EXPECT_NEAR(M(0, 0), 1 + Izz + 0.1 * 0.1 + 0.2 * 0.2, 1e-14);
  }
}

// A tensor of rank 1 as it is written, of which rounding makes a small negative moment.
TEST(GivenInertia, IsTakenWhereItsTensorIsSingularAsWritten) {
  for (const std::string x : {"0.001", "7000"}) {
    const std::string rod = "<inertial pos='0 0 0' mass='.1' fullinertia='" + x + " " + x + " " +
                            x + " " + x + " " + x + " " + x + "'/>";
    const Scene scene = scene_of(
        robot(body("<joint axis='0 1 0'/>", "<body name='rod' pos='.2 0 0'>" + rod + "</body>")));
    expect_agreement(scene, 1);
    EXPECT_EQ(scene.mujoco->notes(),
              Notes{"taken as given, although no solid body has such moments of inertia: 'rod'"});
  }
}

// A coupling of joints in MJCF's terms.
TEST(Ignored, NamesMimicJointsOfUrdf) {
  const Scene scene = scene_of(
      "<robot name='r'>" + urdf_link("base") + urdf_link("left") + urdf_link("right") +
          urdf_joint("l", "revolute", "base", "left", "<dynamics damping='0.5'/>") +
          urdf_joint("r", "revolute", "base", "right", "<mimic joint='l' multiplier='-1'/>") +
          "</robot>",
      ".urdf");
  EXPECT_EQ(scene.mujoco->notes(), Notes{"ignored: 1 coupling of joints, damping of 1 joint"});
}

// Our inverse dynamics by Newton and Euler against MuJoCo's M and bias.
TEST(InverseDynamics, AgreesWithMujoco) {
  for (const char* robot : {"panda", "go2", "shadow_hand", "tree:9"}) {
    const Scene scene = load_scene(robot);
    const Model<double>& model = scene.model;
    MujocoSolver mujoco(mujoco_of(scene));
    LinkKinematics<double> kin(model);
    InverseDynamics<double> ws(model);
    VectorX<double> tau(model.nv()), tau_mujoco(model.nv());
    for (const State& state : random_states(scene, 10, 5)) {
      const VectorX<double> qdd = 3 * state.tau;
      set_position(model, state.q, kin);
      set_velocity(model, state.qd, kin);
      inverse_dynamics(model, kin, qdd, ws, Eigen::Ref<VectorX<double>>(tau));
      mujoco.inverse_dynamics(state.q, state.qd, qdd, tau_mujoco);
      EXPECT_LE((tau - tau_mujoco).norm(), 1e-13 * tau.norm()) << robot;
    }
  }
}

// Dampers of every DoF, springs of hinges and slides with their references; the rest is noted.
TEST(Terms, AreThoseOfTheFile) {
  const std::string xml =
      robot(body("<joint type='ball' name='b' damping='.5' stiffness='9'/>",
                 body("<joint name='h' axis='0 1 0' damping='2' stiffness='300' springref='.3'/>"
                      "<joint name='s' type='slide' axis='1 0 0' stiffness='1e6'/>")));
  const TemporaryFile file(xml, ".xml");
  const LoadedRobot loaded = load_robot(file.path(), {.takes_steps = true});
  using Numbers = std::vector<double>;
  EXPECT_EQ(loaded.terms.damping, (Numbers{.5, .5, .5, 2, 0}));
  EXPECT_EQ(loaded.terms.stiffness, (Numbers{0, 0, 0, 300, 1e6}));
  EXPECT_EQ(loaded.terms.reference, (Numbers{0, 0, 0, .3, 0}));
  ASSERT_EQ(loaded.notes.size(), 1);
  EXPECT_NE(loaded.notes[0].find("ignored: springs of 1 joint"), std::string::npos)
      << loaded.notes[0];
  const LoadedRobot without = load_robot(file.path());
  ASSERT_EQ(without.notes.size(), 1);
  EXPECT_NE(without.notes[0].find("damping of 2 joints, springs of 3 joints"), std::string::npos)
      << without.notes[0];
  EXPECT_NO_THROW(ImplicitStep<double>(loaded.model, 0.001, loaded.terms));
}

// A URDF's <dynamics damping>.
TEST(Terms, AreAUrdfsDamping) {
  const std::string xml =
      "<robot name='r'><link name='a'/><link name='b'><inertial><mass value='1'/>"
      "<inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>"
      "<joint name='j' type='continuous'><parent link='a'/><child link='b'/>"
      "<dynamics damping='0.7'/></joint></robot>";
  const LoadedRobot loaded = load_robot(TemporaryFile(xml, ".urdf").path());
  EXPECT_EQ(loaded.terms.damping, std::vector<double>{0.7});
}

// Also where actuators have armature of their own.
TEST(InverseDynamics, UndoesMujocosAcceleration) {
  const Scene with_motor =
      scene_of(robot(body("<joint name='j' axis='0 0 1' armature='.1'/>"),
                     "<actuator><motor joint='j' gear='3' armature='.2'/></actuator>"));
  for (const Scene& scene : {load_scene("panda"), with_motor}) {
    MujocoSolver mujoco(scene.mujoco);
    VectorX<double> a(scene.model.nv()), tau(scene.model.nv());
    for (const State& state : random_states(scene, 10, 5)) {
      ASSERT_TRUE(mujoco.acceleration(state.q, state.qd, state.tau, a));
      mujoco.inverse_dynamics(state.q, state.qd, a, tau);
      EXPECT_LE((tau - state.tau).norm(), 1e-11 * state.tau.norm()) << scene.name;
    }
  }
}

TEST(JointFriction, IsWhatTheFileSays) {
  const Scene scene = scene_of(robot(body("<joint axis='1 0 0' damping='3' frictionloss='.5'/>",
                                          body("<joint type='ball' damping='2'/>"))));
  const JointFriction friction = friction_of(scene);
  EXPECT_EQ(friction.viscous, (VectorX<double>(4) << 3, 2, 2, 2).finished());
  EXPECT_EQ(friction.coulomb, (VectorX<double>(4) << 0.5, 0, 0, 0).finished());
  EXPECT_EQ(friction_of(load_scene("chain:3")).viscous, VectorX<double>::Zero(3));
}

TEST(LinkName, IsTheBodyThatCarriesTheJoint) {
  const Scene scene =
      scene_of(robot("<body name='arm'><joint name='a'/><joint name='b' axis='1 0 0'/>" +
                     std::string(inertia) + "<body name='tool'>" + inertia + "</body></body>"));
  EXPECT_EQ(link_name(scene, 0), "a");  // no body between the two joints
  EXPECT_EQ(link_name(scene, 1), "arm");
  const Scene go2 = load_scene("go2");
  EXPECT_EQ(link_name(go2, 5), "base");
  EXPECT_EQ(link_name(go2, 6), "FL_hip");
  const Scene chain = load_scene("chain:3");
  EXPECT_EQ(link_name(chain, 2), chain.model.name(2));
}

TEST(Lowering, HingeOffItsBodysOrigin) {
  expect_agreement(
      scene_of(robot(body("<joint type='hinge' axis='1 2 -1' pos='.4 .1 -.3' ref='.7'/>"))), 1);
}

TEST(Lowering, SlideWithReference) {
  const std::string hinge = body("<joint type='hinge' axis='0 1 0' pos='.1 .2 .3'/>");
  expect_agreement(
      scene_of(robot(body("<joint type='slide' axis='1 -1 1' pos='.4 .1 0' ref='.2'/>", hinge))),
      2);
}

TEST(Lowering, EveryCoordinateAxisAndItsOpposite) {
  std::string chain;
  for (const char* axis : {"1 0 0", "0 1 0", "0 0 1", "-1 0 0", "0 -1 0", "0 0 -1"})
    chain = body("<joint axis='" + std::string(axis) + "' pos='.1 0 .2'/>", chain);
  expect_agreement(scene_of(robot(chain)), 6);
}

// A turn by nearly half a circle must not lose digits.
TEST(Lowering, AxesNearACoordinateAxisOrItsOpposite) {
  for (const char* axis : {"1e-4 0 -1", "0 -1e-6 -1", "1e-9 1e-9 -1", "1e-7 0 1", "-1 1e-7 1e-8"})
    expect_agreement(
        scene_of(robot(body("<joint axis='" + std::string(axis) + "'/>", body("<joint/>")))), 2);
}

TEST(Lowering, BallOffItsBodysOrigin) {
  const std::string hinge = body("<joint type='hinge' axis='0 1 0' pos='.1 .2 .3'/>");
  expect_agreement(scene_of(robot(body("<joint axis='1 0 0'/>",
                                       body("<joint type='ball' pos='.2 -.1 .3'/>", hinge)))),
                   5);
}

TEST(Lowering, FreeBaseWithBranches) {
  const std::string arm = body("<joint axis='0 1 0'/>", body("<joint type='slide' axis='0 0 1'/>"));
  expect_agreement(scene_of(robot(body("<freejoint/>", arm + arm))), 10);
}

TEST(Lowering, FreeBaseAlignedWithItsInertia) {
  expect_agreement(scene_of("<mujoco><compiler alignfree='true'/><worldbody>" +
                            body("<freejoint/>") + "</worldbody></mujoco>"),
                   6);
}

TEST(Lowering, SeveralJointsOnOneBody) {
  expect_agreement(
      scene_of(robot(body("<joint type='slide' axis='1 0 0'/><joint axis='0 1 0' pos='.1 0 .1'/>"
                          "<joint axis='1 1 0' pos='0 .2 0'/>",
                          body("<joint axis='0 0 1'/><joint type='ball' pos='.1 .1 .1'/>")))),
      7);
}

TEST(Lowering, WeldedBodiesAddTheirInertia) {
  const std::string tool = body("", body("", body("<joint axis='0 1 1'/>")));
  expect_agreement(scene_of(robot(body("", body("<joint axis='1 0 0'/>", tool + body(""))))), 2);
}

TEST(Lowering, SeveralTrees) {
  expect_agreement(scene_of(robot(body("<joint axis='1 0 0'/>") + body("<freejoint/>") +
                                  body("<joint type='ball'/>"))),
                   10);
}

TEST(Lowering, ArmatureOfJointsAndActuators) {
  const Scene scene = scene_of(
      robot(body("<joint name='a' axis='1 0 0' armature='.3'/>",
                 body("<joint name='b' axis='0 1 0' armature='.1'/>")),
            "<actuator><motor joint='b' gear='3' armature='.2'/><motor joint='a'/></actuator>"));
  EXPECT_DOUBLE_EQ(scene.model.joint(0).r, 0.3);
  EXPECT_DOUBLE_EQ(scene.model.joint(1).r, 0.1 + 0.2 * 9);  // reflected by gear^2
  expect_agreement(scene, 2);
}

TEST(Lowering, InertiaFromGeometryKeepsTheGeometry) {
  const Scene scene =
      scene_of(robot("<geom type='plane' size='1 1 1'/><body><joint axis='0 1 0'/>"
                     "<geom type='box' size='.1 .2 .3' density='1000'/></body>"));
  EXPECT_NEAR(scene.model.joint(0).body.mass, 8 * 0.1 * 0.2 * 0.3 * 1000, 1e-12);
  expect_agreement(scene, 1);
}

TEST(Lowering, MissingMeshesDoNotMatterBesideExplicitInertias) {
  const std::string asset =
      "<asset><mesh name='shell' file='nowhere.stl'/><texture name='skin' type='2d' "
      "file='nowhere.png'/><material name='paint' texture='skin'/></asset>";
  const std::string geom = "<geom type='mesh' mesh='shell' material='paint'/>";
  expect_agreement(scene_of(robot(body("<joint axis='0 1 0'/>" + geom), asset)), 1);
}

TEST(Lowering, InertiasOfBodiesThatCannotMoveDoNotMatter) {
  const std::string bad = "<inertial pos='0 0 0' mass='1' diaginertia='1e-6 0 0'/>";
  expect_agreement(scene_of(robot("<body>" + bad + "<geom type='mesh' mesh='shell'/><body>" + bad +
                                      body("<joint axis='0 1 0'/>") + "</body></body>",
                                  "<asset><mesh name='shell' file='nowhere.stl'/></asset>")),
                   1);
}

TEST(Lowering, MemoryOfASimulationRefusesNothing) {
  expect_agreement(scene_of(robot(body("<freejoint/>"), "<size memory='64'/>")), 6);
}

TEST(Lowering, LimitsThatABallJointCannotHaveRefuseNothing) {
  expect_agreement(scene_of(robot(body("<joint type='ball' range='10 20'/>"))), 3);
}

TEST(Lowering, WhatDynamicsDoesNotAskForIsLeftOut) {
  const std::string extras =
      "<contact><exclude body1='u' body2='v'/></contact>"
      "<equality><joint joint1='a' joint2='b'/></equality>"
      "<tendon><fixed name='t'><joint joint='a' coef='1'/></fixed>"
      "<fixed name='idle'><joint joint='a' coef='1'/></fixed></tendon>"
      "<actuator><motor tendon='t'/><position joint='b' kp='3'/></actuator>"
      "<sensor><jointpos joint='a'/><framepos objtype='site' objname='s'/></sensor>"
      "<keyframe><key qpos='1 2'/></keyframe>";
  const Scene scene = scene_of(robot(
      "<light pos='0 0 1'/><camera pos='0 0 1'/><body name='u'><joint name='a' axis='0 1 0' "
      "damping='3' stiffness='5' frictionloss='1'/>" +
          std::string(inertia) + "<site name='s'/><body name='v' pos='0 0 1'><joint name='b'/>" +
          inertia + "</body></body>",
      extras));
  const mjModel* m = scene.mujoco->get();
  EXPECT_EQ(m->nsensor + m->neq + m->nsite + m->ncam + m->nlight, 0);
  EXPECT_EQ(m->ntendon, 1);  // that an actuator acts along: a row of steps
  expect_agreement(scene, 2);
}

TEST(Lowering, Urdf) {
  const std::string link =
      "<inertial><origin xyz='.1 0 .2' rpy='.1 .2 .3'/><mass value='2'/>"
      "<inertia ixx='.1' iyy='.12' izz='.08' ixy='.01' ixz='0' iyz='.005'/></inertial>"
      "<visual><geometry><mesh filename='package://robot/nowhere.dae'/></geometry></visual>";
  const Scene scene = scene_of(
      "<robot name='r'><link name='base'/><link name='a'>" + link + "</link><link name='b'>" +
          link +
          "</link><joint name='j1' type='continuous'><parent link='base'/><child link='a'/><origin "
          "xyz='0 0 .3' rpy='0 1 0'/><axis xyz='0 0 1'/></joint><joint name='j2' type='prismatic'>"
          "<parent link='a'/><child link='b'/><origin xyz='.2 0 0'/><axis xyz='0 1 0'/><limit "
          "lower='-.1' upper='.4' effort='1' velocity='1'/></joint></robot>",
      ".urdf");
  EXPECT_EQ(scene.model.names(), (std::vector<std::string>{"j1", "j2"}));
  EXPECT_EQ(scene.range[1], (std::array<double, 2>{-0.1, 0.4}));
  expect_agreement(scene, 2);
}

class ShippedRobot : public testing::TestWithParam<std::string> {};

TEST_P(ShippedRobot, AgreesWithMujoco) {
  const Scene scene = load_scene(GetParam());
  expect_agreement(scene, scene.mujoco->get()->nv);
  EXPECT_EQ(load_scene(scene.name).name, scene.name);  // "panda:9" is panda
}

INSTANTIATE_TEST_SUITE_P(All, ShippedRobot, testing::ValuesIn(shipped_robots()),
                         [](const auto& info) { return info.param; });

// M of the planar two-link arm as every textbook has it, with the parameters of robots/two_link.
TEST(TwoLink, MatchesTheTextbook) {
  const Scene scene = load_scene("two_link");
  const Model<double>& model = scene.model;
  const Joint<double>&first = model.joint(0), &second = model.joint(1);
  const double m1 = first.body.mass, m2 = second.body.mass;
  const double l1 = second.translation.norm();
  const double c1 = first.body.com.head<2>().norm(), c2 = second.body.com.head<2>().norm();
  const auto about_z = [](const RigidBody<double>& body) {
    const Matrix3<double> E = rotation(body.axes);
    return (E * body.moments.asDiagonal() * E.transpose())(2, 2);
  };
  const double I1 = about_z(first.body), I2 = about_z(second.body);
  LinkKinematics<double> kin(model);
  CompositeInertia<double> composite(model);
  MatrixX<double> M(2, 2);
  for (const State& state : random_states(scene, 20, 3)) {
    set_position(model, state.q, kin);
    mass_matrix(model, kin, composite, Eigen::Ref<MatrixX<double>>(M));
    const double c = std::cos(state.q[1]);
    EXPECT_NEAR(M(0, 0), m1 * c1 * c1 + m2 * (l1 * l1 + c2 * c2 + 2 * l1 * c2 * c) + I1 + I2,
                1e-13);
    EXPECT_NEAR(M(1, 0), m2 * (c2 * c2 + l1 * c2 * c) + I2, 1e-13);
    EXPECT_NEAR(M(1, 1), m2 * c2 * c2 + I2, 1e-13);
  }
}

TEST(Families, AgreeWithMujoco) {
  expect_agreement(load_scene("tree:21"), 21);
  expect_agreement(load_scene("chain:7"), 7);
  // kappa(M) = 3.8 N^4: 1e-10 would be too much to ask of longer ones
  expect_agreement(load_scene("straight:15"), 15);
}

TEST(Families, LongChainsNeedNoXml) {
  const Scene scene = load_scene("chain:300");
  EXPECT_LE(against_mujoco(scene, 1).mass, 1e-13);
}

TEST(Families, ALongerChainBeginsLikeAShorterOne) {
  const Model<double> five = load_scene("chain:5").model, nine = load_scene("chain:9").model;
  for (int k = 0; k < 5; ++k) {
    EXPECT_EQ(five.joint(k).body.moments, nine.joint(k).body.moments);
    EXPECT_EQ(five.joint(k).translation, nine.joint(k).translation);
  }
}

TEST(Families, TreeIsBinary) {
  const Model<double> model = load_scene("tree:31").model;
  std::vector<int> children(31, 0);
  for (int k = 1; k < 31; ++k) ++children[model.parent(k)];
  EXPECT_EQ(std::count(children.begin(), children.end(), 2), 15);
  EXPECT_EQ(std::count(children.begin(), children.end(), 0), 16);
}

}  // namespace
}  // namespace kalmarm
