// Couplings of joints against MuJoCo's constraints and closed forms.
#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <Eigen/LU>
#include <memory>
#include <string>

#include "robots/loader/test/refusal.hpp"
#include "robots/loader/test/robot_text.hpp"
#include "robots/scene/couplings.hpp"

namespace kalmarm {
namespace {

std::string body(const std::string& joint, const std::string& inside = "") {
  return "<body pos='.1 .2 .3' quat='.8 .1 -.3 .5'><joint " + joint +
         "/><inertial pos='.1 0 .2' mass='2' diaginertia='.3 .4 .5'/>" + inside + "</body>";
}

std::string mjcf(const std::string& worldbody, const std::string& equality) {
  return "<mujoco><compiler angle='radian'/><worldbody>" + worldbody + "</worldbody><equality>" +
         equality + "</equality></mujoco>";
}

// c follows b, which follows a; d stands still; the constraint on e is not active. All references
// but one are not zero.
constexpr const char* hard = " solimp='.9999 .9999 .001'";
std::string gripper() {
  const auto coupling = [](const std::string& words) { return "<joint " + words + hard + "/>"; };
  return mjcf(
      body("name='a' axis='0 1 0' ref='.3'",
           body("name='c' axis='1 0 0' ref='-.2'", body("name='d' axis='0 0 1' ref='.5'")) +
               body("name='b' type='slide' axis='0 0 1' ref='.1'", body("name='e' axis='0 1 0'"))),
      coupling("joint1='c' joint2='b' polycoef='.05 -1.5 0 0 0'") +
          coupling("joint1='b' joint2='a' polycoef='.02 .7 0 0 0'") +
          coupling("joint1='d' polycoef='.4 0 0 0 0'") +
          coupling("joint1='e' joint2='a' active='false'"));
}

struct Answer {
  MatrixX<double> M, X;
  VectorX<double> a, bias;
};

Answer answer_of(const Scene& scene, const State& state) {
  const int nv = scene.model.nv();
  Answer out{mass_of(scene, state.q), {}, VectorX<double>(nv), VectorX<double>(nv)};
  MujocoSolver mujoco(mujoco_of(scene));
  mujoco.inverse_dynamics(state.q, state.qd, VectorX<double>::Zero(nv), out.bias);
  out.X = out.M.inverse();
  out.a = out.X * (state.tau - out.bias);
  return out;
}

// The compiled file with its constraints, in a state.
class Constrained {
 public:
  Constrained(const std::string& file, const State& state)
      : model_(mj_loadXML(file.c_str(), nullptr, error_, sizeof error_), mj_deleteModel),
        data_(mj_makeData(model_.get()), mj_deleteData) {
    std::copy(state.q.begin(), state.q.end(), data_->qpos);
    std::copy(state.qd.begin(), state.qd.end(), data_->qvel);
    std::copy(state.tau.begin(), state.tau.end(), data_->qfrc_applied);
    mj_forward(model_.get(), data_.get());
  }

  double violation() const {
    return VectorX<double>(Eigen::Map<const VectorX<double>>(data_->efc_pos, data_->nefc)).norm() +
           VectorX<double>(Eigen::Map<const VectorX<double>>(data_->efc_vel, data_->nefc)).norm();
  }
  int constraints() const { return data_->nefc; }
  VectorX<double> acceleration() const {
    return Eigen::Map<const VectorX<double>>(data_->qacc, model_->nv);
  }

 private:
  char error_[500] = "";
  std::unique_ptr<mjModel, void (*)(mjModel*)> model_;
  std::unique_ptr<mjData, void (*)(mjData*)> data_;
};

// MuJoCo's constraints are soft: here by one part in ten thousand, times ratios of inertias.
TEST(Couplings, AreMujocosConstraintsMadeHard) {
  const TemporaryFile file(gripper(), ".xml");
  const Scene scene = load_scene(file.path());
  const Couplings couplings(scene);
  EXPECT_EQ(couplings.left(), (std::vector<int>{0, 4}));
  for (const State& given : random_states(scene, 10, 3)) {
    const State state = couplings.imposed(given);
    const Constrained mujoco(file.path(), state);
    EXPECT_EQ(mujoco.constraints(), 3);
    EXPECT_LE(mujoco.violation(), 1e-14);
    const Answer free = answer_of(scene, state);
    const VectorX<double> ours = couplings.acceleration(free.X, free.a);
    const VectorX<double> theirs = mujoco.acceleration()(couplings.left());
    EXPECT_LE((ours - theirs).norm(), 1e-2 * theirs.norm());
  }
}

// G from (1) by hand: rows a, c, d, b, e.
TEST(Couplings, GiveTheReducedEquationsOfMotion) {
  const TemporaryFile file(gripper(), ".xml");
  const Scene scene = load_scene(file.path());
  const Couplings couplings(scene);
  MatrixX<double> G(5, 2);
  G << 1, 0, -1.5 * .7, 0, 0, 0, .7, 0, 0, 1;
  for (const State& given : random_states(scene, 10, 3)) {
    const State state = couplings.imposed(given);
    EXPECT_NEAR(state.q[3], .1 + .02 + .7 * (state.q[0] - .3), 1e-15);
    EXPECT_NEAR(state.q[1], -.2 + .05 - 1.5 * (state.q[3] - .1), 1e-15);
    EXPECT_NEAR(state.q[2], .9, 1e-15);
    EXPECT_EQ(state.q[4], given.q[4]);
    EXPECT_LE((state.qd - G * state.qd(couplings.left())).norm(), 1e-15);
    const Answer free = answer_of(scene, state);
    const MatrixX<double> M = G.transpose() * free.M * G;
    EXPECT_LE((couplings.mass(free.M) - M).norm(), 1e-14 * M.norm());
    EXPECT_LE((couplings.inverse(free.X) * M - MatrixX<double>::Identity(2, 2)).norm(), 1e-12);
    const VectorX<double> right = G.transpose() * (state.tau - free.bias);
    EXPECT_LE((M * couplings.acceleration(free.X, free.a) - right).norm(), 1e-11 * right.norm());
  }
}

// Fingers on slides that a URDF's mimic moves apart: two masses as one.
TEST(Couplings, OfAMimicJointAddItsMass) {
  const auto finger = [](const std::string& name, const std::string& mimic) {
    return link(name, body_of(3)) + joint(name + "_j", "prismatic", "base", name, mimic);
  };
  const TemporaryFile file(
      urdf(link("base", "") + finger("left", "") +
           finger("right", "<mimic joint='left_j' multiplier='-2' offset='.1'/>")),
      ".urdf");
  const Scene scene = load_scene(file.path(), {.imposes_couplings = true});
  EXPECT_EQ(scene.mujoco->notes(), std::vector<std::string>{});
  const Couplings couplings(scene);
  State state = couplings.imposed(random_states(scene, 1, 1)[0]);
  EXPECT_NEAR(state.q[1], .1 - 2 * state.q[0], 1e-15);
  const Answer free = answer_of(scene, state);
  EXPECT_NEAR(couplings.mass(free.M)(0, 0), 3 + 4 * 3, 1e-13);
  EXPECT_NEAR(couplings.inverse(free.X)(0, 0), 1.0 / 15, 1e-15);
  EXPECT_NO_THROW(couplings.checked(state, ""));
  state.q[1] += 1e-6;
  expect_refused([&] { couplings.checked(state, "state 3: "); },
                 {"state 3", "'right_j' is coupled", "qpos[1]"});
}

TEST(Couplings, AreRefusedWhereTheyCannotBeImposed) {
  const std::string arm = body("name='a'", body("name='b'", body("name='ball' type='ball'")));
  const auto refused = [&](const std::string& equality, const std::vector<std::string>& words) {
    const TemporaryFile file(mjcf(arm, equality), ".xml");
    const Scene scene = load_scene(file.path());
    expect_refused([&] { Couplings couplings(scene); }, words);
  };
  refused("", {"has no couplings"});
  refused("<joint joint1='a' joint2='b' active='false'/>", {"has no couplings"});
  refused("<joint joint1='b' joint2='a' polycoef='0 1 .5 0 0'/>", {"'b'", "not linear"});
  refused("<joint joint1='b' joint2='a'/><joint joint1='b'/>", {"'b'", "not the only one"});
  refused("<joint joint1='b' joint2='a'/><joint joint1='a' joint2='b'/>", {"coupled to itself"});
  refused("<joint joint1='a' joint2='a'/>", {"'a'", "to itself"});
  refused("<joint joint1='ball' joint2='a'/>", {"'ball'", "hinges and slides"});
  expect_refused([] { Couplings couplings(load_scene("chain:3")); }, {"chain:3", "no couplings"});
}

}  // namespace
}  // namespace kalmarm
