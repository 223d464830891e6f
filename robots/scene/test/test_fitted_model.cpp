// A robot saved with other parameters: what is loaded again has them, and all else is as it was.
#include <gtest/gtest.h>

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/uniform_real_distribution.hpp>
#include <filesystem>

#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/study/derivatives/inertial_parameters.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_spec.hpp"
#include "robots/loader/test/temporary_file.hpp"
#include "robots/scene/fitted_model.hpp"
#include "robots/scene/mujoco_solver.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm {
namespace {

std::string shipped_file(const std::string& name) {
  return (std::filesystem::path(KALMARM_ROBOTS_DIR) / name / (name + ".xml")).string();
}

// Every parameter that MuJoCo can hold, changed by about a third; a free joint and a ball joint
// have one armature and one friction for all of their DoF.
FittedParameters random_parameters(const Scene& scene) {
  boost::random::mt19937 random(5);
  const auto uniform = [&] {
    return boost::random::uniform_real_distribution<double>(-0.3, 0.3)(random);
  };
  const mjModel* m = scene.mujoco->get();
  FittedParameters out;
  for (int k = 0; k < scene.model.nv(); ++k) {
    if (k > 0 && m->dof_jntid[k] == m->dof_jntid[k - 1]) {
      out.armature[k] = out.armature[k - 1];
      out.viscous[k] = out.viscous[k - 1];
      out.coulomb[k] = out.coulomb[k - 1];
    } else {
      out.armature[k] = 0.1 + uniform() / 4;
      out.viscous[k] = 1 + uniform();
      out.coulomb[k] = 0.5 + uniform();
    }
    const SpatialInertia<double>& M = scene.model.M(k);
    if (scene.model.inertia(k).massless) continue;
    InertialVector<double> x = to_log_cholesky(M);
    if (!x.allFinite()) x << std::log(M.m) / 2, -3, -2.5, -2, 0, 0, 0, M.h / M.m;  // a rod, a point
    const double size = std::sqrt(M.I.trace() / M.m);
    for (int i = 0; i < 4; ++i) x[i] += uniform();
    for (int i = 4; i < body_parameters; ++i) x[i] += size * uniform();
    out.inertia[k] = spatial_inertia(from_log_cholesky(x));
  }
  return out;
}

Model<double> with(Model<double> model, const FittedParameters& fitted) {
  for (const auto& [k, M] : fitted.inertia) model.set_inertia(k, M);
  for (const auto& [k, r] : fitted.armature) model.set_noise(k, r);
  return model;
}

Scene saved_scene(const std::string& file, const FittedParameters& fitted) {
  return load_scene(TemporaryFile(save_fitted(file, fitted, "a note"), ".xml").path());
}

// Largest relative difference of M by MuJoCo on `saved` from M of `model`.
double mass_difference(const Scene& saved, const Model<double>& model) {
  const int nv = model.nv();
  MujocoSolver mujoco(saved.mujoco);
  LinkKinematics<double> kin(model);
  CompositeInertia<double> composite(model);
  MatrixX<double> M(nv, nv), M_mujoco(nv, nv);
  double worst = 0;
  for (const State& state : random_states(saved, 10, 7)) {
    set_position(model, state.q, kin);
    mass_matrix(model, kin, composite, Eigen::Ref<MatrixX<double>>(M));
    mujoco.mass(state.q, M_mujoco);
    worst = std::max(worst, (M - M_mujoco).norm() / M.norm());
  }
  return worst;
}

// Saves the file with random parameters and loads them again.
void expect_kept(const std::string& file) {
  const Scene scene = load_scene(file);
  const FittedParameters fitted = random_parameters(scene);
  const Scene saved = saved_scene(file, fitted);
  ASSERT_EQ(saved.model.names(), scene.model.names());
  for (const auto& [k, M] : fitted.inertia) {
    const auto theta = inertial_parameters(M);
    EXPECT_LE((inertial_parameters(saved.model.M(k)) - theta).norm(), 1e-9 * theta.norm());
  }
  const JointFriction friction = friction_of(saved);
  for (int k = 0; k < scene.model.nv(); ++k) {
    EXPECT_EQ(saved.model.joint(k).r, fitted.armature.at(k));
    EXPECT_EQ(friction.viscous[k], fitted.viscous.at(k));
    EXPECT_EQ(friction.coulomb[k], fitted.coulomb.at(k));
  }
  EXPECT_LE(mass_difference(saved, with(scene.model, fitted)), 1e-12);
}

void expect_unchanged(const std::string& file) {
  EXPECT_LE(mass_difference(saved_scene(file, {}), load_scene(file).model), 1e-13);
}

// Expects a one-line refusal with every word in it.
void expect_refused(const std::string& file, const FittedParameters& fitted,
                    std::vector<std::string> words) {
  words.push_back(file);
  try {
    save_fitted(file, fitted, "a note");
    ADD_FAILURE() << "was accepted";
  } catch (const InputError& e) {
    const std::string message = e.what();
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    for (const std::string& word : words)
      EXPECT_NE(message.find(word), std::string::npos) << message;
  }
}

class SavedRobot : public testing::TestWithParam<std::string> {};

TEST_P(SavedRobot, HasTheFittedParameters) { expect_kept(shipped_file(GetParam())); }

TEST_P(SavedRobot, WithNothingFittedIsUnchanged) { expect_unchanged(shipped_file(GetParam())); }

INSTANTIATE_TEST_SUITE_P(All, SavedRobot, testing::ValuesIn(shipped_robots()),
                         [](const auto& info) { return info.param; });

constexpr const char* inertia =
    R"(<inertial pos=".1 -.05 .2" mass="1.3" quat=".8 .1 -.3 .5" diaginertia=".03 .04 .05"/>)";

std::string body(const std::string& joints, const std::string& inside = "") {
  return "<body pos='.3 .2 -.1' quat='.5 -.4 .7 .3'>" + joints + inertia + inside + "</body>";
}

std::string robot(const std::string& options, const std::string& worldbody,
                  const std::string& rest = "") {
  return "<mujoco><compiler " + options + "/><worldbody>" + worldbody + "</worldbody>" + rest +
         "</mujoco>";
}

void expect_kept_and_unchanged(const std::string& text, const std::string& ending = ".xml") {
  const TemporaryFile file(text, ending);
  expect_kept(file.path());
  expect_unchanged(file.path());
}

TEST(SavedFile, WeldedBodiesShareOneInertia) {
  const std::string tool = body("", body("", body("<joint name='j2' axis='0 1 1'/>")));
  for (const char* options : {"", "fusestatic='true'"})
    expect_kept_and_unchanged(
        robot(options, body("", body("<joint name='j1' axis='1 0 0'/>", tool + body("")))));
}

TEST(SavedFile, JointsOfEveryKind) {
  expect_kept_and_unchanged(
      robot("angle='degree' eulerseq='zyx'",
            body("<freejoint/>", body("<joint type='ball' pos='.1 .2 .3'/>") +
                                     body("<joint name='a' type='slide' axis='1 0 0'/>"
                                          "<joint name='b' axis='0 1 0' pos='.1 0 .1' ref='30'/>"
                                          "<joint name='c' axis='1 1 0' range='-10 20'/>"))));
}

TEST(SavedFile, CompilerOptionsThatChangeInertias) {
  const std::string arm = body("<joint axis='1 0 0'/><geom size='.1'/>",
                               body("<joint axis='0 1 0'/><geom size='.2'/>"));
  for (const char* options :
       {"inertiafromgeom='true'", "boundmass='2' boundinertia='.2'", "balanceinertia='true'",
        "settotalmass='7'", "alignfree='true'", "autolimits='false'"})
    expect_kept_and_unchanged(robot(options, arm));
}

TEST(SavedFile, AFreeBodyAlignedWithItsInertiaKeepsIt) {
  const std::string child = body("<joint axis='1 0 0'/>");
  for (const std::string& base :
       {body("<freejoint name='base'/>"), body("<freejoint name='base' align='true'/>")}) {
    const TemporaryFile file(robot("alignfree='true'", base), ".xml");
    expect_unchanged(file.path());
    expect_refused(file.path(), {.inertia = {{5, load_scene(file.path()).model.M(5)}}},
                   {"base:r:z", "alignfree"});
  }
  for (const std::string& base : {body("<freejoint align='true'/>", child),
                                  body("<freejoint/>", child), body("<freejoint align='false'/>")})
    expect_kept_and_unchanged(robot("alignfree='true'", base));
}

TEST(SavedFile, DefaultsAndActuatorsThatHaveArmature) {
  expect_kept_and_unchanged(
      robot("", body("<joint name='a' axis='1 0 0'/>", body("<joint name='b' axis='0 1 0'/>")),
            "<default><joint armature='.3' damping='2' frictionloss='1'/></default>"
            "<actuator><motor joint='b' gear='3' armature='.2'/></actuator>"));
}

// At the boundary of what is physical rounding must not decide.
TEST(SavedFile, FlatBodies) {
  for (const double width : {0.1, 0.3, 1.0}) {
    const RigidBody<double> flat = {
        2.3, {0.7, -1.9, 3.1}, {0.8, 0.1, -0.3, 0.5}, {width, 0.2, width + 0.2}};
    const SpatialInertia<double> M(flat);
    const Scene saved = saved_scene(shipped_file("two_link"), {.inertia = {{1, M}}});
    EXPECT_LE((saved.model.M(1).I - M.I).norm(), 1e-12 * M.I.norm());
  }
}

TEST(SavedFile, SpringsGivenByTheirTimeConstant) {
  const TemporaryFile file(robot("", body("<joint axis='1 0 0' springdamper='.2 .7'/>")), ".xml");
  expect_kept(file.path());
  const auto stiffness = [](const Scene& scene) { return scene.mujoco->get()->jnt_stiffness[0]; };
  const Scene scene = load_scene(file.path());
  EXPECT_DOUBLE_EQ(stiffness(saved_scene(file.path(), random_parameters(scene))), stiffness(scene));
}

TEST(SavedFile, Urdf) {
  const std::string link =
      "<inertial><origin xyz='.1 0 .2' rpy='.1 .2 .3'/><mass value='2'/>"
      "<inertia ixx='.1' iyy='.12' izz='.08' ixy='.01' ixz='0' iyz='.005'/></inertial>"
      "<visual><geometry><mesh filename='package://robot/nowhere.dae'/></geometry></visual>";
  expect_kept_and_unchanged(
      "<robot name='r'><link name='base'/><link name='a'>" + link + "</link><link name='b'>" +
          link + "</link><link name='tool'>" + link +
          "</link><joint name='j1' type='continuous'><parent link='base'/><child link='a'/><origin "
          "xyz='0 0 .3' rpy='0 1 0'/><axis xyz='0 0 1'/></joint><joint name='j2' type='prismatic'>"
          "<parent link='a'/><child link='b'/><origin xyz='.2 0 0'/><axis xyz='0 1 0'/><limit "
          "lower='-.1' upper='.4' effort='1' velocity='1'/></joint><joint name='j3' type='fixed'>"
          "<parent link='b'/><child link='tool'/><origin xyz='0 0 .1'/></joint></robot>",
      ".urdf");
}

std::shared_ptr<const MujocoModel> whole(const std::string& text) {
  char error[1000] = "";
  const SpecPtr spec(mj_parseXMLString(text.c_str(), nullptr, error, sizeof error), mj_deleteSpec);
  EXPECT_TRUE(spec) << error;
  return compile(spec.get(), "saved");
}

std::string furnished(const std::string& mesh) {
  return robot("",
               "<light pos='0 0 1'/><geom type='mesh' mesh='m'/>" +
                   body("<joint name='a' axis='0 1 0'/><site name='s'/>"),
               "<asset><mesh name='m' file='" + mesh +
                   "'/></asset><actuator><position name='p' joint='a' kp='3'/></actuator>"
                   "<sensor><framepos objtype='site' objname='s'/></sensor>"
                   "<keyframe><key name='home' qpos='1'/></keyframe>");
}

TEST(SavedFile, KeepsAllElseAndLoadsFromAnotherFolder) {
  const TemporaryFile mesh("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4",
                           ".obj");
  const std::string name = std::filesystem::path(mesh.path()).filename();
  const TemporaryFile file(furnished(name), ".xml");
  const auto saved = whole(save_fitted(file.path(), {.armature = {{0, 0.7}}}, "a note"));
  const mjModel* m = saved->get();
  EXPECT_EQ(m->nmesh, 1);
  EXPECT_EQ(m->nlight, 1);
  EXPECT_EQ(m->nu, 1);
  EXPECT_EQ(m->nsensor, 1);
  ASSERT_EQ(m->nkey, 1);
  EXPECT_EQ(m->key_qpos[0], 1);
  EXPECT_EQ(m->dof_armature[0], 0.7);
}

TEST(SavedFile, IsTheStrippedRobotWhereAMeshIsMissing) {
  const TemporaryFile file(furnished("nowhere.obj"), ".xml");
  const auto saved = whole(save_fitted(file.path(), {.armature = {{0, 0.7}}}, "a note"));
  EXPECT_EQ(saved->get()->nsensor, 0);
  EXPECT_EQ(saved->get()->dof_armature[0], 0.7);
}

TEST(SavedFile, CarriesTheNoteWhateverItSays) {
  const std::string text = save_fitted(shipped_file("two_link"), {}, "rms -- 3 <&> \"x\" --- end-");
  EXPECT_NE(text.find("<!--rms - - 3 <&> \"x\" - - - end- -->"), std::string::npos)
      << text.substr(0, 200);
  whole(text);
}

TEST(SavedFile, RefusesWhatNoRobotHas) {
  const std::string file = shipped_file("two_link");
  SpatialInertia<double> M = load_scene("two_link").model.M(1);
  M.I(2, 2) += M.I.trace();  // breaks the triangle inequality
  expect_refused(file, {.inertia = {{1, M}}}, {"joint2", "mass distribution"});
  M.m = -1;
  expect_refused(file, {.inertia = {{1, M}}}, {"joint2", "mass distribution"});
  M.m = NAN;
  expect_refused(file, {.inertia = {{1, M}}}, {"joint2", "mass distribution"});
  expect_refused(file, {.inertia = {{1, {}}}}, {"link2"});  // MuJoCo's own words on zero mass
  expect_refused(file, {.armature = {{0, -1}}}, {"joint1", "armature", "-1"});
  expect_refused(file, {.viscous = {{0, -1}}}, {"joint1", "damping", "-1"});
  expect_refused(file, {.coulomb = {{1, NAN}}}, {"joint2", "frictionloss"});
  expect_refused("nowhere.xml", {}, {"no such file"});
}

TEST(SavedFile, RefusesWhatMujocoCannotHold) {
  const std::string file = shipped_file("go2");
  const SpatialInertia<double> M = load_scene("go2").model.M(5);
  expect_refused(file, {.inertia = {{2, M}}}, {"base_joint:z", "no body"});
  expect_refused(file, {.armature = {{0, 1}}}, {"base_joint:x", "armature"});
  std::map<int, double> viscous = {{0, 1}, {1, 1}, {2, 1}, {3, 1}, {4, 1}, {5, 2}};
  expect_refused(file, {.viscous = viscous}, {"base_joint:x", "damping"});
}

}  // namespace
}  // namespace kalmarm
