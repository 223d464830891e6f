// What a file says of a body (a tensor, an inertial frame, a mass, geoms or none of them) against
// numbers worked out by hand and MuJoCo's own reading of the untouched file.
#include <gtest/gtest.h>

#include <memory>
#include <sstream>
#include <string>

#include "algorithms/model/mass_matrix.hpp"
#include "kalmarm/dynamics.hpp"
#include "kalmarm/load.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_shim.hpp"
#include "robots/loader/test/refusal.hpp"
#include "robots/loader/test/robot_text.hpp"
#include "robots/loader/test/temporary_file.hpp"

namespace kalmarm {
namespace {

// M at q = 0, the lowered model's and that of the compiled one.
MatrixX<double> mass(const Scene& scene) {
  const Model<double>& model = scene.model;
  LinkKinematics<double> kin(model);
  CompositeInertia<double> composite(model);
  MatrixX<double> M(model.nv(), model.nv());
  const VectorX<double> q = VectorX<double>::Zero(model.nq());
  set_position(model, q, kin);
  mass_matrix(model, kin, composite, Eigen::Ref<MatrixX<double>>(M));
  EXPECT_LE((M - mass_of(scene, q)).norm(), 1e-13 * M.norm());
  return M;
}

// M at q = 0 as MuJoCo alone has it of the file.
MatrixX<double> mass_by_mujoco(const std::string& text, const std::string& ending) {
  install_mujoco_handlers();
  const TemporaryFile file(text, ending);
  char error[1000] = "";
  mjModel* m = mj_loadXML(file.path().c_str(), nullptr, error, sizeof error);
  if (!m) throw InputError(error);
  MatrixX<double> M(m->nv, m->nv);
  const VectorX<double> q = VectorX<double>::Zero(m->nq);
  MujocoSolver(std::make_shared<const MujocoModel>(m)).mass(q, M);
  return M;
}

void expect_mass(const Scene& scene, const MatrixX<double>& right, double bound = 1e-13) {
  const MatrixX<double> M = mass(scene);
  ASSERT_EQ(M.rows(), right.rows());
  EXPECT_LE((M - right).norm(), bound * right.norm()) << M << "\nbut\n" << right;
}

void expect_as_mujoco(const std::string& text, const std::string& ending = ".xml") {
  SCOPED_TRACE(text);
  expect_mass(read(text, ending), mass_by_mujoco(text, ending));
}

// The tensor is "xx yy zz xy xz yz"; what is missing is zero.
std::string inertial(const std::string& mass, const std::string& tensor,
                     const std::string& origin = "") {
  std::string out = "<inertial>" + origin + "<mass value='" + mass + "'/><inertia";
  std::istringstream numbers(tensor);
  for (const char* name : {"ixx", "iyy", "izz", "ixy", "ixz", "iyz"}) {
    std::string number;
    out += std::string(" ") + name + "='" + (numbers >> number ? number : "0") + "'";
  }
  return out + "/></inertial>";
}

std::string hinge(const std::string& parent, const std::string& child, const std::string& axis) {
  return "<joint name='" + child + "' type='continuous'><parent link='" + parent +
         "'/><child link='" + child + "'/><axis xyz='" + axis + "'/></joint>";
}

std::string weld(const std::string& parent, const std::string& child) {
  return "<joint name='" + child + "' type='fixed'><parent link='" + parent + "'/><child link='" +
         child + "'/></joint>";
}

// A link that turns about an axis through its origin.
std::string wheel(const std::string& inertia, const std::string& axis,
                  const std::string& rest = "") {
  return urdf(link("base", "") + link("wheel", inertia) + hinge("base", "wheel", axis) + rest);
}

// M of a wheel.
double moment(const std::string& inertia, const std::string& axis,
              const LoadOptions& options = {}) {
  return mass(read(wheel(inertia, axis), ".urdf", options))(0, 0);
}

// No solid body has these moments. The x and y axes of the inertial frame are y and -x of the link.
TEST(Tensor, IsOfItsInertialFrame) {
  const std::string turned = "<origin rpy='0 0 1.5707963267948966'/>";
  for (const char* tensor : {"1 2 9", "1 2 9 .5", "1 2 9 .5 .3 .2"}) {
    SCOPED_TRACE(tensor);
    EXPECT_NEAR(moment(inertial("1", tensor, turned), "1 0 0"), 2, 1e-14);
    EXPECT_NEAR(moment(inertial("1", tensor, turned), "0 1 0"), 1, 1e-14);
    EXPECT_NEAR(moment(inertial("1", tensor, turned), "0 0 1"), 9, 1e-14);
  }
  // Second moments 5, 4 and -3 about x, y and z become 5, 4 and 0.0005.
  const LoadOptions balanced = {.inertia = InertiaPolicy::balanced};
  EXPECT_NEAR(moment(inertial("1", "1 2 9", turned), "1 0 0", balanced), 5.0005, 1e-14);
  EXPECT_NEAR(moment(inertial("1", "1 2 9", turned), "0 1 0", balanced), 4.0005, 1e-14);
}

TEST(Tensor, CountsWithoutAMass) {
  const std::string rotor = inertial("0", "2 2 3"), arm = inertial("1", "1 1 1");
  const std::string rotor_alone = link("base", "") + link("rotor", rotor);
  const Scene between = read(urdf(rotor_alone + link("arm", arm) + hinge("base", "rotor", "0 0 1") +
                                  hinge("rotor", "arm", "0 1 0")),
                             ".urdf");
  expect_mass(between, Eigen::Vector2d(4, 1).asDiagonal());
  EXPECT_EQ(moment(rotor, "0 0 1"), 3);  // also of a last link
  const std::string welded = wheel(arm, "0 0 1", link("rotor", rotor) + weld("wheel", "rotor"));
  expect_mass(read(welded, ".urdf"), MatrixX<double>::Constant(1, 1, 4));
  const std::string on_frame = wheel("", "0 0 1", link("rotor", rotor) + weld("wheel", "rotor"));
  expect_mass(read(on_frame, ".urdf"), MatrixX<double>::Constant(1, 1, 3));
}

// A negative moment is none that a link without mass could give.
TEST(Tensor, WithoutAMassRefusesNothing) {
  const Scene scene = read(urdf(link("base", "") + link("cross", inertial("0", "1 1 -1")) +
                                link("arm", inertial("1", "1 1 1")) +
                                hinge("base", "cross", "0 0 1") + hinge("cross", "arm", "0 1 0")),
                           ".urdf");
  expect_mass(scene, MatrixX<double>::Identity(2, 2));
}

// Nor does one of zeros refuse the frame that carries a body.
TEST(Tensor, MayBeZeroWhereAnotherBodyIsWelded) {
  for (const std::string& frame :
       {inertial("0", "0 0 0"), inertial("0", "0 0 0 0 1e-30"), inertial("0", "0 0 -1")})
    for (const std::string& tool : {inertial("1", "1 1 1"), inertial("0", "1 1 1")}) {
      const std::string text = wheel(frame, "0 0 1", link("tool", tool) + weld("wheel", "tool"));
      expect_mass(read(text, ".urdf"), MatrixX<double>::Identity(1, 1));
    }
}

TEST(Tensor, IsRefusedWhereAMassHasANegativeMoment) {
  for (const char* tensor : {"1 1 -1", "1 1 1 2", "-1 -1 -1"}) {
    const TemporaryFile file(wheel(inertial("1", tensor), "0 0 1"), ".urdf");
    expect_refused([&] { load_scene(file.path()); }, {"'wheel'", "inertia=balanced"});
  }
}

// Of a last link, one between joints, and one that is welded, where MuJoCo takes it from the others.
TEST(Mass, IsRefusedWhereItIsNegative) {
  const std::string bad = inertial("-1", "1 1 1"), good = link("arm", inertial("2", "1 1 1"));
  for (const std::string& rest :
       {std::string(), good + hinge("wheel", "arm", "0 1 0"), good + weld("wheel", "arm")}) {
    const TemporaryFile file(wheel(bad, "0 0 1", rest), ".urdf");
    expect_refused([&] { load_scene(file.path()); }, {"body 'wheel' has a negative mass"});
  }
}

// An arm of 0.02 kg m^2 with a fingertip on a joint, which carries nothing or a frame.
std::string with_tip(const std::string& rest = "") {
  return wheel(inertial("1", ".01 .01 .01", "<origin xyz='.1 0 0'/>"), "0 0 1",
               link("tip", "") + hinge("wheel", "tip", "0 0 1") + rest);
}

TEST(LastLink, WithoutInertiaRefusesWhatNeedsItsJointAlone) {
  for (const std::string& rest : {std::string(), link("nail", "") + weld("tip", "nail"),
                                  link("point", inertial("0", "0 0 0")) + weld("tip", "point")}) {
    SCOPED_TRACE(rest);
    const LoadedRobot robot = load_robot(TemporaryFile(with_tip(rest), ".urdf").path());
    const std::vector<double> q = {.1, .2}, zero = {0, 0}, tau = {.04, 0};
    std::vector<double> a(2), X(1);
    const Outcome all = Dynamics<double>(robot.model).forward_dynamics(q, zero, tau, a);
    EXPECT_EQ(all.status, Outcome::Status::singular);
    EXPECT_EQ(robot.model.names[all.joint], "tip");
    ASSERT_EQ(robot.notes.size(), 1);
    EXPECT_EQ(robot.notes[0], "no inertia (option armature gives some) is moved by: 'tip'");

    DynamicsOptions other, locked;
    other.question.dofs = {0};
    locked.question.locked = {1};
    locked.question.q = {0, .2};
    for (const DynamicsOptions& options : {other, locked}) {
      Dynamics<double> dynamics(robot.model, options);
      std::vector<double> of_arm(1);
      EXPECT_TRUE(dynamics.forward_dynamics(q, zero, tau, of_arm));
      EXPECT_NEAR(of_arm[0], 2, 1e-15);
    }
  }
}

TEST(LastLink, WithoutInertiaMovesItsArmature) {
  const Scene scene = read(with_tip(), ".urdf", {.armature = {{"tip", 1e-3}}});
  EXPECT_EQ(scene.mujoco->notes(), Notes{});
  expect_mass(scene, Eigen::Vector2d(.02, 1e-3).asDiagonal());
}

TEST(LastLink, MayBeAFrameThatCarriesAPointMass) {
  const std::string point = inertial("2", "0 0 0", "<origin xyz='.3 0 0'/>");
  const std::string text = wheel("", "0 0 1", link("point", point) + weld("wheel", "point"));
  expect_mass(read(text, ".urdf"), MatrixX<double>::Constant(1, 1, 2 * .09));
}

TEST(Tensor, MayBeOfAFlatBody) {
  for (const char* tensor : {"9e-6 1e-6 1e-5 -1e-6", "9e-6 1e-6 1e-5 1e-6", ".9 .1 1 .1",
                             "3e-4 .7e-4 3.7e-4 -.3e-5", ".1 .2 .3"})
    for (const InertiaPolicy policy : {InertiaPolicy::given, InertiaPolicy::balanced}) {
      SCOPED_TRACE(tensor);
      const Scene scene = read(wheel(inertial("1", tensor), "0 0 1"), ".urdf", {.inertia = policy});
      EXPECT_EQ(scene.mujoco->notes(), Notes{});
      std::string xx, yy, zz;
      std::istringstream(tensor) >> xx >> yy >> zz;
      EXPECT_NEAR(mass(scene)(0, 0), std::stod(zz), 1e-14 * std::stod(zz));
    }
}

// Of a diagonal tensor.
TEST(Tensor, KeepsAZeroExact) {
  const std::string rod = inertial("1", ".01 0 .01");
  const Scene scene = read(wheel(rod, "0 1 0"), ".urdf");
  EXPECT_EQ(scene.model.joint(0).body.moments.minCoeff(), 0);
  EXPECT_EQ(mass(scene)(0, 0), 0);
}

std::string mjcf(const std::string& compiler, const std::string& worldbody) {
  return "<mujoco><compiler " + compiler + "/><worldbody>" + worldbody + "</worldbody></mujoco>";
}

// An arm with what is given, and a box on it.
std::string loaded_arm(const std::string& inside) {
  return "<body><joint axis='0 1 0'/>" + inside +
         "<body pos='.3 0 0'><joint axis='0 1 0'/><geom type='box' size='.1 .1 .1' mass='1'/>"
         "</body></body>";
}

constexpr const char* arm_inertia = "<inertial pos='.1 0 0' mass='2' diaginertia='.02 .03 .04'/>";

TEST(Inertial, CountsWhereNoGeomWeighs) {
  const std::string light = "<geom size='.1' mass='0'/>", heavy = "<geom size='.1' mass='3'/>",
                    apart = "<geom size='.1' group='3' mass='3'/>";
  const std::string from_geoms = "inertiafromgeom='true' inertiagrouprange='0 1'";
  for (const std::string& geoms :
       {std::string(), light, heavy, apart, light + heavy, light + apart, heavy + apart})
    expect_as_mujoco(mjcf(from_geoms, loaded_arm(arm_inertia + geoms)));
  for (const std::string& geoms : {heavy, light + heavy, heavy + apart})
    expect_as_mujoco(mjcf("inertiagrouprange='0 1'", loaded_arm(geoms)));
  for (const std::string& geoms : {std::string(), light, apart, light + apart}) {
    SCOPED_TRACE(geoms);  // MuJoCo refuses a link without inertia between joints
    expect_same_robot(read(mjcf("inertiagrouprange='0 1'", loaded_arm(geoms)), ".xml"),
                      read(mjcf("", loaded_arm("")), ".xml"));
  }
}

// Also of a rod that is turned, whose tensor MuJoCo refuses before it balances or bounds it.
TEST(Bounds, AndBalanceAreOfWhatMujocoTakesNoTensorOf) {
  const auto arm = [](const std::string& compiler) {
    return mjcf(compiler,
                "<body><joint axis='0 1 0'/><inertial pos='0 0 0' mass='1' "
                "fullinertia='1 1 2 -1 0 0'/></body>");
  };
  expect_mass(read(arm("balanceinertia='true'"), ".xml"), MatrixX<double>::Constant(1, 1, 4. / 3));
  EXPECT_NEAR(mass(read(arm("boundinertia='.5'"), ".xml"))(0, 0), 1.25, 1e-14);
}

// In every way that we compile it: with a rod, and with all bodies kept, none is fused.
TEST(Inertial, IsLostInFusedBodiesAsMujocoLosesIt) {
  const auto arm = [](const std::string& moments, const std::string& welded) {
    return mjcf("inertiafromgeom='true' fusestatic='true'",
                "<body><joint axis='0 1 0'/><inertial pos='-.2 0 0' mass='2' diaginertia='" +
                    moments + "'/><body pos='0 0 -.1'>" + welded + "</body></body>");
  };
  for (const char* moments : {".001 .0016 .0016", "0 .0016 .0016"})
    for (const char* welded : {"<geom size='.02' pos='0 -.08 0'/>", arm_inertia}) {
      const TemporaryFile file(arm(moments, welded), ".xml");
      const Scene scene = load_scene(file.path());
      if (moments[0] != '0' || welded != arm_inertia) expect_as_mujoco(arm(moments, welded));
      Scene kept = scene;
      kept.mujoco = MujocoModel::load(file.path(), {}, Frames::kept);
      expect_same_robot(scene, kept);
    }
}

// Of a root called world, which is MuJoCo's own; no tensor of what cannot move is looked at.
TEST(Inertial, OfTheWorldCountsForNothing) {
  const std::string arm = link("arm", inertial("1", "1 1 1")) + hinge("world", "arm", "0 0 1");
  for (const char* tensor : {"1 1 1", "1 1 1 2", "0 0 0", "1 1 -1"})
    expect_mass(read(urdf(link("world", inertial("5", tensor)) + arm), ".urdf"),
                MatrixX<double>::Identity(1, 1));
}

TEST(TotalMass, HasToBeOfSomeBody) {
  const TemporaryFile file("<robot name='r'><mujoco><compiler settotalmass='7'/></mujoco>" +
                               link("base", "") + link("rotor", inertial("0", "1 1 1")) +
                               hinge("base", "rotor", "0 0 1") + "</robot>",
                           ".urdf");
  expect_refused([&] { load_scene(file.path()); },
                 {file.path(), "settotalmass", "no body has a mass"});
}

TEST(TotalMass, IsOfAllBodiesThatAreNotTheWorld) {
  const std::string moving = "<body><joint axis='0 1 0'/><inertial pos='.2 0 0' mass='5' ";
  const std::string solid = "diaginertia='.01 .05 .05'/></body>";
  const std::string ball = "<geom size='.1' mass='3'/>";
  const std::string static_bodies[] = {
      "<body>" + ball + moving + solid + "</body>",
      "<body><inertial pos='0 0 0' mass='3' diaginertia='1 1 1'/>" + ball + "</body>" + moving +
          solid,
      "<body mocap='true'>" + ball + "</body>" + ball + moving + solid};
  for (const std::string& bodies : static_bodies)
    for (const char* compiler : {"settotalmass='10'", "settotalmass='10' inertiafromgeom='true'",
                                 "settotalmass='10' fusestatic='true'"})
      expect_as_mujoco(mjcf(compiler, bodies));
  // Half of 10 kg each, and then the same factor for a tensor that MuJoCo does not take.
  const std::string bad = "<inertial pos='0 0 0' mass='5' diaginertia='1 1 -3'/>";
  const Scene scene = read(mjcf("settotalmass='20'", "<body>" + bad + "</body>" + moving +
                                                         "diaginertia='1 2 9'/></body>"),
                           ".xml");
  expect_mass(scene, MatrixX<double>::Constant(1, 1, 2 * (2 + 5 * .04)));
  expect_as_mujoco("<robot name='r'><mujoco><compiler settotalmass='50'/></mujoco>" +
                       link("base", inertial("20", ".1 .1 .1")) +
                       link("arm", inertial("5", ".1 .2 .2")) + hinge("base", "arm", "0 1 0") +
                       "</robot>",
                   ".urdf");
}

// MuJoCo knows no link without inertia: one of 1e-9 of the others' stands for it.
TEST(TotalMass, IsSetBesideLinksWithoutInertia) {
  const std::string set = "settotalmass='10'";
  const std::string light = "<inertial pos='0 0 0' mass='1e-9' diaginertia='1e-9 1e-9 1e-9'/>";
  expect_mass(read(mjcf(set, loaded_arm("")), ".xml"),
              mass_by_mujoco(mjcf(set, loaded_arm(light)), ".xml"), 1e-7);
}

TEST(TotalMass, IsThatOfMovingBodiesWhereStaticOnesHaveNone) {
  const std::string missing =
      "<mujoco><compiler settotalmass='10'/><asset><mesh name='m' file='nowhere.stl'/></asset>"
      "<worldbody><body><geom type='mesh' mesh='m'/></body>" +
      loaded_arm(arm_inertia) + "</worldbody></mujoco>";
  const Scene scene = read(missing, ".xml");
  ASSERT_EQ(scene.mujoco->notes().size(), 1);
  EXPECT_NE(scene.mujoco->notes()[0].find("nowhere.stl"), std::string::npos);
  expect_mass(scene, mass_by_mujoco(mjcf("settotalmass='10'", loaded_arm(arm_inertia)), ".xml"));
}

// Least mass and least moment, each by itself.
TEST(Bounds, RaiseWhatIsBelowAndNothingElse) {
  const auto arm = [](const std::string& bounds, const std::string& inertia) {
    return mjcf(bounds,
                "<body><joint axis='0 0 1'/><inertial pos='.5 0 0' " + inertia + "/></body>");
  };
  const auto expect_moment = [&](const std::string& bounds, const std::string& inertia, double m) {
    SCOPED_TRACE(bounds + " " + inertia);
    expect_mass(read(arm(bounds, inertia), ".xml"), MatrixX<double>::Constant(1, 1, m));
  };
  const std::string unsolid = "mass='.1' diaginertia='.01 .01 .03'";
  expect_moment("boundmass='.5'", unsolid, .03 + .5 * .25);
  expect_moment("boundinertia='.02'", unsolid, .03 + .1 * .25);
  expect_moment("boundinertia='.025'", unsolid, .03 + .1 * .25);
  expect_moment("boundmass='.5'", "mass='.1' diaginertia='.01 .01 0'", .5 * .25);
  expect_moment("boundmass='.5' settotalmass='1'", unsolid, 2 * (.03 + .5 * .25));
  for (const char* inertia : {"mass='.1' diaginertia='.01 .01 .01'", "mass='0' diaginertia='0 0 0'",
                              "mass='1' diaginertia='.3 .3 -.1'"})
    expect_as_mujoco(arm("boundmass='.5' boundinertia='.2'", inertia));
}

// Fused, a frame has no least moment; so neither beside a link of which MuJoCo would take no tensor.
TEST(Bounds, LeaveFramesAloneThatAreFused) {
  const auto arm = [](const std::string& tensor) {
    return "<robot name='r'><mujoco><compiler boundinertia='.1'/></mujoco>" + link("base", "") +
           link("wheel", inertial("1", tensor)) + hinge("base", "wheel", "0 0 1") +
           link("tool", "") + weld("wheel", "tool") + "</robot>";
  };
  expect_as_mujoco(arm("1 1 1"), ".urdf");
  EXPECT_EQ(read(arm("1 1 1"), ".urdf").mujoco->notes(), Notes{});
  expect_mass(read(arm("1 1 3"), ".urdf"), MatrixX<double>::Constant(1, 1, 3));
}

// MuJoCo takes no geom for the looks of a URDF where a mass comes from it.
TEST(Inertial, ComesFromAUrdfsCollisionsWhereItSaysSo) {
  const std::string ball = "<collision><geometry><sphere radius='.1'/></geometry></collision>";
  expect_as_mujoco("<robot name='r'><mujoco><compiler inertiafromgeom='true'/></mujoco>" +
                       link("base", "") + link("wheel", inertial("1", "1 1 1") + ball) +
                       hinge("base", "wheel", "0 0 1") + "</robot>",
                   ".urdf");
}

TEST(Shape, WithoutVolumeWeighsNothing) {
  const auto shape = [](const std::string& geometry) {
    return "<collision><geometry>" + geometry + "</geometry></collision>";
  };
  const std::string arm = inertial("1", "1 1 1"), tip = weld("wheel", "tip");
  const std::string sphere = shape("<sphere radius='.1'/>");
  for (const char* empty : {"<box size='0 0 0'/>", "<box size='0 1 1'/>", "<sphere radius='0'/>",
                            "<cylinder radius='0' length='1'/>"}) {
    SCOPED_TRACE(empty);
    const Scene scene = read(wheel(arm, "0 0 1", link("tip", shape(empty)) + tip), ".urdf");
    EXPECT_EQ(scene.mujoco->notes(), Notes{});
    expect_mass(scene, MatrixX<double>::Identity(1, 1));
    expect_same_robot(read(wheel(arm, "0 0 1", link("tip", shape(empty) + sphere) + tip), ".urdf"),
                      read(wheel(arm, "0 0 1", link("tip", sphere) + tip), ".urdf"));
  }
}

}  // namespace
}  // namespace kalmarm
