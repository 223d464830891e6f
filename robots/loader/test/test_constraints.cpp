// Equality constraints of files, against MuJoCo's own forward dynamics.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "algorithms/test/models.hpp"
#include "kalmarm/constrained_dynamics.hpp"
#include "kalmarm/load.hpp"
#include "robots/loader/mujoco_shim.hpp"
#include "robots/loader/robot_of.hpp"
#include "robots/loader/test/refusal.hpp"
#include "robots/loader/test/robot_text.hpp"

namespace kalmarm {
namespace {

const LoadOptions taken = {.takes_constraints = true};

// MuJoCo's qacc by its Newton solver, without contacts, limits, actuators and passive forces.
class Reference {
 public:
  explicit Reference(const std::string& path)
      : model_(mj_loadXML(path.c_str(), nullptr, error_, sizeof error_), mj_deleteModel),
        data_(model_ ? mj_makeData(model_.get()) : nullptr, mj_deleteData) {
    if (!model_) throw std::runtime_error(error_);
    model_->opt.disableflags |= mjDSBL_CONTACT | mjDSBL_LIMIT | mjDSBL_FRICTIONLOSS |
                                mjDSBL_SPRING | mjDSBL_DAMPER | mjDSBL_ACTUATION | mjDSBL_WARMSTART;
    model_->opt.solver = mjSOL_NEWTON;
    model_->opt.tolerance = 0;
    model_->opt.iterations = 50;
  }

  mjModel* get() { return model_.get(); }
  VectorX<double> home() const {
    return Eigen::Map<const VectorX<double>>(model_->qpos0, model_->nq);
  }
  VectorX<double> acceleration(const VectorX<double>& q, const VectorX<double>& qd,
                               const VectorX<double>& tau) {
    mj_resetData(model_.get(), data_.get());
    std::copy(q.begin(), q.end(), data_->qpos);
    std::copy(qd.begin(), qd.end(), data_->qvel);
    std::copy(tau.begin(), tau.end(), data_->qfrc_applied);
    mj_forward(model_.get(), data_.get());
    return Eigen::Map<const VectorX<double>>(data_->qacc, model_->nv);
  }

 private:
  char error_[1000] = "";
  std::unique_ptr<mjModel, void (*)(mjModel*)> model_;
  std::unique_ptr<mjData, void (*)(mjData*)> data_;
};

// In states near home, that are open by a few thousandths of a metre, where shares of the impedance lie between least and most; and farther.
void expect_accelerations_of_mujoco(const std::string& path) {
  SCOPED_TRACE(path);
  const LoadedRobot robot = load_robot(path, taken);
  ASSERT_FALSE(robot.constraints.empty());
  Reference reference(path);
  ConstrainedDynamics<double> constrained(robot.model, robot.constraints);
  const int nv = robot.model.nv();
  test::Random random(7);
  for (const double away : {0.0, 1e-3, 0.05})
    for (const double speed : {0.0, 1.0}) {
      VectorX<double> q = reference.home();
      q += away * random.vector(static_cast<int>(q.size()));
      for (const LinkParameters& link : robot.model.links)
        if (link.coordinate == Coordinate::quaternion) q.segment<4>(link.q_index).normalize();
      const VectorX<double> qd = speed * random.vector(nv), tau = random.vector(nv);
      VectorX<double> a(nv), forces(constrained.rows());
      const Outcome outcome = constrained.forward_dynamics(q, qd, tau, a, forces);
      ASSERT_TRUE(outcome) << constrained.name_of(outcome);
      const VectorX<double> theirs = reference.acceleration(q, qd, tau);
      EXPECT_LE((a - theirs).norm(), 1e-9 * theirs.norm()) << away << " " << speed;
    }
}

std::string bodies() {
  const std::string inertia = "<inertial pos='.01 .02 .1' mass='.7' diaginertia='.01 .02 .015'/>";
  return "<body name='trunk' pos='0 0 1'><freejoint/>" + inertia +
         "<body name='arm' pos='.2 0 0'><joint name='elbow' axis='0 1 0'/>" + inertia +
         "<site name='hand' pos='.1 0 .02' euler='.2 .3 .4'/></body></body>"
         "<body name='lever' pos='0 .5 .6'><joint name='hinge' axis='1 0 0' ref='.2'/>" +
         inertia + "<body name='wrist' pos='.1 0 .1'><joint name='ball' type='ball'/>" + inertia +
         "<site name='knob' pos='.05 0 .01' euler='.1 0 0'/></body></body>"
         "<body name='rail' pos='1 0 0'><joint name='slide' type='slide' axis='1 1 0'/>" +
         inertia + "</body>";
}
std::string file_of(const std::string& equalities, const std::string& option = "") {
  return "<mujoco><compiler angle='radian'/><option timestep='.001'>" + option +
         "</option><worldbody>" + bodies() + "</worldbody><equality>" + equalities +
         "</equality></mujoco>";
}

TEST(Constraints, OfEveryKindAccelerateAsMuJoCoSays) {
  for (const char* equality :
       {"<connect body1='arm' body2='lever' anchor='.1 0 .02'/>",
        "<connect body1='arm' body2='wrist' anchor='.1 0 .02' solref='.03 .6' solimp='.3 .9 .02 .4 "
        "3'/>",
        "<connect body1='rail' anchor='0 0 .1' solref='-400 -12' solimp='.6 .9 .01 .5 1'/>",
        "<connect site1='hand' site2='knob'/>",
        "<weld body1='arm' body2='rail' torquescale='.4' solimp='.2 .97 .03 .3 2'/>",
        "<weld body1='wrist' relpose='.1 .2 .9 .9 .1 .2 .3' anchor='.1 0 .1'/>",
        "<weld site1='knob' site2='hand' solref='.0001 1'/>",
        "<joint joint1='hinge' polycoef='.1 0 0 0 0'/>",
        "<joint joint1='slide' joint2='elbow' polycoef='.1 -.7 .3 .2 .1' solimp='.2 .9 .3 .6 2'/>",
        "<connect body1='arm' body2='lever' anchor='.1 0 .02'/><weld body1='rail' body2='wrist'/>"
        "<joint joint1='hinge' joint2='elbow' polycoef='0 2 0 0 0'/>"}) {
    const TemporaryFile file(file_of(equality), ".xml");
    expect_accelerations_of_mujoco(file.path());
  }
}

TEST(Constraints, OfRepeatedRowsAndWithoutRefsafeAccelerateAsMuJoCoSays) {
  const std::string twice =
      "<connect body1='arm' body2='lever' anchor='.1 0 .02' solref='.0011 1'/>";
  expect_accelerations_of_mujoco(TemporaryFile(file_of(twice + twice), ".xml").path());
  expect_accelerations_of_mujoco(
      TemporaryFile(file_of(twice, "<flag refsafe='disable'/>"), ".xml").path());
}

TEST(Constraints, OfShippedRobotsAccelerateAsMuJoCoSays) {
  const std::filesystem::path robots = KALMARM_ROBOTS_DIR;
  for (const char* robot :
       {"cassie/cassie.xml", "loops/four_bar.xml", "loops/gripper.xml", "loops/stewart.xml"})
    expect_accelerations_of_mujoco((robots / robot).string());
}

TEST(Constraints, AreLeftOutAndNamedUnlessTheyAreTaken) {
  const TemporaryFile file(
      file_of("<connect body1='arm' body2='lever' anchor='0 0 0'/>"
              "<connect body1='rail' body2='lever' anchor='0 0 0' active='false'/>"
              "<joint joint1='hinge' joint2='elbow'/>"),
      ".xml");
  const LoadedRobot plain = load_robot(file.path());
  EXPECT_TRUE(plain.constraints.empty());
  EXPECT_EQ(plain.notes, Notes{"ignored: 1 connect constraint, 1 coupling of joints"});
  const LoadedRobot robot = load_robot(file.path(), taken);
  ASSERT_EQ(robot.constraints.size(), 2u);
  EXPECT_EQ(robot.constraints[0].name, "arm-lever");
  EXPECT_EQ(robot.constraints[1].name, "hinge-elbow");
  LoadOptions both = taken;
  both.imposes_couplings = true;
  EXPECT_EQ(load_robot(file.path(), both).constraints.size(), 1u);
  const TemporaryFile off(
      file_of("<connect body1='arm' body2='lever' anchor='0 0 0'/>", "<flag equality='disable'/>"),
      ".xml");
  EXPECT_TRUE(load_robot(off.path(), taken).constraints.empty());
}

TEST(Constraints, ThatAreOpenAtHomeAreNamedWithTheirDistance) {
  const TemporaryFile file(file_of("<joint name='gear' joint1='slide' polycoef='.03 0 0 0 0'/>"
                                   "<connect body1='arm' body2='lever' anchor='0 0 0'/>"),
                           ".xml");
  EXPECT_EQ(load_robot(file.path(), taken).notes,
            Notes{"open at home [m, of turns rad]: 'gear' by 0.03"});
}

TEST(Constraints, OfACompiledModelAreThoseOfItsFile) {
  const TemporaryFile file(file_of("<weld body1='arm' body2='rail'/>"), ".xml");
  Reference reference(file.path());
  const LoadedRobot copied = robot_of(reference.get(), "copied", {}, taken),
                    loaded = load_robot(file.path(), taken);
  ASSERT_EQ(copied.constraints.size(), 1u);
  EXPECT_EQ(copied.constraints[0].first.translation, loaded.constraints[0].first.translation);
  EXPECT_EQ(copied.constraints[0].compliance, loaded.constraints[0].compliance);
  EXPECT_TRUE(robot_of(reference.get(), "copied", {}, {}).constraints.empty());
}

TEST(Constraints, OfAMimicCoupleTheJointsOfAUrdf) {
  const std::string text =
      urdf(link("base", "") + link("one", body_of(1)) + link("two", body_of(1)) +
           joint("a", "revolute", "base", "one") +
           joint("b", "revolute", "base", "two", "<mimic joint='a' multiplier='-2' offset='.1'/>"));
  const LoadedRobot robot = load_robot(TemporaryFile(text, ".urdf").path(), taken);
  ASSERT_EQ(robot.constraints.size(), 1u);
  const Constraint& gear = robot.constraints[0];
  EXPECT_EQ(gear.kind, Constraint::Kind::coupling);
  EXPECT_EQ(gear.polynomial[0], 0.1);
  EXPECT_EQ(gear.polynomial[1], -2);
}

}  // namespace
}  // namespace kalmarm
