// Fixed tendons of files and their actuators as rows of implicit steps, against MuJoCo's own and, where
// MuJoCo leaves out entries of its matrix, against dense matrices.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <string>
#include <utility>
#include <vector>

#include "kalmarm/load.hpp"
#include "robots/loader/test/refusal.hpp"
#include "robots/loader/test/steps_of_mujoco.hpp"

namespace kalmarm {
namespace {

// Of two joints, with coefficients 1.5 and -2.
std::string tendon(const std::string& attributes, const std::string& one, const std::string& other,
                   const std::string& name = "t") {
  return "<fixed name='" + name + "' " + attributes + "><joint joint='" + one +
         "' coef='1.5'/><joint joint='" + other + "' coef='-2'/></fixed>";
}

std::string tendons(const std::string& inside) { return "<tendon>" + inside + "</tendon>"; }

TEST(Tendons, StepAsMujocoStepsThem) {
  for (const char* attributes :
       {"damping='7'", "stiffness='700'", "stiffness='700' springlength='.3'", "armature='.4'",
        "armature='.4' damping='70' stiffness='1e5' springlength='-.2'"}) {
    SCOPED_TRACE(attributes);
    expect_steps_of_mujoco(arm(tendons(tendon(attributes, "shoulder", "slide"))));
    expect_steps_of_mujoco(arm(tendons(tendon(attributes, "shoulder", "slide") +
                                       tendon("damping='3'", "slide", "shoulder", "other"))));
  }
}

TEST(Tendons, TakeTheirActuators) {
  for (const char* one : {
           "<position name='u' tendon='t' gear='3' kp='200' kv='5'/>",
           "<velocity name='u' tendon='t' gear='-.2' kv='500'/>",
           "<motor name='u' tendon='t' gear='-30' armature='.1' damping='.3'/>",
           "<general name='u' tendon='t' gear='2' gaintype='affine' gainprm='11 -50 -6' "
           "biastype='affine' biasprm='4 -300 -6'/>",
           "<position name='u' tendon='t' kp='100' kv='3'/><motor tendon='t' gear='2'/>"
           "<velocity tendon='t' kv='8'/><position joint='slide' kp='30'/>",
           "<general name='v' tendon='t' dyntype='filter' dynprm='.1' gear='2' armature='.3' "
           "damping='4'/><motor name='u' tendon='t'/>",
       })
    for (const char* attributes : {"", "armature='.4' damping='7' stiffness='700'"}) {
      SCOPED_TRACE(std::string(one) + attributes);
      expect_steps_of_mujoco(arm(tendons(tendon(attributes, "shoulder", "slide")) + actuators(one)),
                             {.controls = {{"u", .7}}, .takes_steps = true});
    }
}

// MuJoCo's matrix has no entries between branches: then ours is that of the equation, and where MuJoCo
// is said to solve it, both are the same.
TEST(Tendons, CoupleBranchesThatMujocoDoesNot) {
  const double h = 0.002;
  const std::string driven = actuators("<position tendon='t' gear='2' kp='90' kv='4'/>");
  for (const auto& [attributes, actuator] :
       std::vector<std::pair<std::string, std::string>>{{"damping='7'", ""},
                                                        {"stiffness='700' springlength='.3'", ""},
                                                        {"armature='.4'", ""},
                                                        {"", driven}}) {
    SCOPED_TRACE(attributes + actuator);
    const Scene scene =
        read(arm(tendons(tendon(attributes, "shoulder", "tail")) + actuator), ".xml", steps);
    const RobotModel robot = plain(scene.model);
    const int nv = robot.nv();
    const bool is_armature = attributes.starts_with("armature"),
               is_damping = attributes.starts_with("damping") || !actuator.empty();
    for (const Integrator integrator : all_integrators) {
      SCOPED_TRACE(to_string(integrator));
      const StepTerms terms(scene, integrator);
      const std::string why = left_out_of_rows(scene.model, terms.terms().rows, integrator);
      const bool leaves_out = is_armature || (is_damping && integrator == Integrator::implicitfast);
      EXPECT_EQ(why.empty(), !leaves_out) << why;
      const double apart = distance_of_steps(scene, integrator);
      EXPECT_EQ(apart > 1e-6, leaves_out) << apart;
      EXPECT_TRUE(leaves_out || apart <= 1e-11) << apart;

      const double ahead = terms.scheme() == Scheme::springs_at_end ? h : 0;
      ImplicitStep<double> step(robot, h, terms.terms(), terms.scheme());
      Dynamics<double> dynamics(robot);
      for (const State& state : random_states(scene, 5, 3)) {
        VectorX<double> a(nv), right(nv);
        MatrixX<double> M(nv, nv);
        dynamics.mass(state.q, M);
        dynamics.bias(state.q, state.qd, right);
        const VectorX<double> tau = state.tau + terms.torque<double>(state.q, state.qd);
        right = tau - right;
        ASSERT_EQ(terms.terms().rows.size(), 1);
        const CoupledRow& row = terms.terms().rows[0];
        const Eigen::Map<const VectorX<double>> J(row.jacobian.data(), nv);
        const double rate = J.dot(state.qd),
                     length = J[0] * state.q[0] + J[nv - 1] * state.q[scene.model.nq() - 1];
        M += J * (row.armature + h * row.damping + h * ahead * row.stiffness) * J.transpose();
        right -= J * (row.damping * rate + row.stiffness * (length - row.reference + ahead * rate));
        for (int k = 0; k < nv; ++k) {
          const double b = terms.terms().damping[k], s = terms.terms().stiffness[k];
          M(k, k) += h * (b + ahead * s);
          right[k] -= b * state.qd[k];
          if (s > 0)
            right[k] -= s * (state.q[robot.links[k].q_index] - terms.terms().reference[k] +
                             ahead * state.qd[k]);
        }
        ASSERT_TRUE(step.acceleration(state.q, state.qd, tau, a));
        EXPECT_LE((a - M.llt().solve(right)).norm(), 1e-11 * a.norm());
      }
    }
  }
}

TEST(Tendons, AreRowsOfTheLoadedRobot) {
  const TemporaryFile file(
      arm(tendons("<fixed name='idle'><joint joint='slide' coef='1'/></fixed>" +
                  tendon("stiffness='700' springlength='.3' damping='5'", "shoulder", "slide")) +
          actuators("<position name='p' tendon='t' gear='2' kp='25' kv='3'/>"
                    "<motor name='m' tendon='t' gear='5'/>")),
      ".xml");
  const LoadedRobot robot =
      load_robot(file.path(), {.controls = {{"p", .4}, {"m", 2}}, .takes_steps = true});
  EXPECT_EQ(robot.notes, Notes{"ignored: 1 tendon"});
  ASSERT_EQ(robot.terms.rows.size(), 1);
  const CoupledRow& row = robot.terms.rows[0];
  std::vector<double> J(robot.model.nv(), 0);
  J[0] = 1.5, J[1] = -2;
  EXPECT_EQ(row.jacobian, J);
  EXPECT_EQ(row.stiffness, 700 + 100);
  EXPECT_EQ(row.damping, 5 + 12);
  EXPECT_NEAR(row.reference, (700 * .3 + 50 * .4) / 800, 1e-16);
  ASSERT_EQ(robot.actuators.size(), 2);
  EXPECT_EQ(robot.actuators[0].dof, -1);
  EXPECT_EQ(robot.actuators[0].row, 0);
  EXPECT_EQ(robot.actuators[1].gain, 5);
  EXPECT_EQ(robot.torque[0], 15);
  EXPECT_EQ(robot.torque[1], -20);
}

TEST(Tendons, WithoutRowsAreNamed) {
  const std::string rest =
      tendons(tendon("stiffness='3' springlength='.1 .3'", "shoulder", "slide", "band") +
              tendon("stiffness='3' springyield='2'", "shoulder", "slide", "soft") +
              tendon("stiffness='3 1'", "shoulder", "slide", "bent") +
              tendon("damping='-3'", "shoulder", "slide", "odd") +
              tendon("damping='3' frictionloss='1'", "shoulder", "slide", "rough") +
              "<spatial name='sites' damping='1'><site site='s'/><site site='r'/></spatial>"
              "<spatial name='idle'><site site='s'/><site site='r'/></spatial>");
  std::string text = arm(rest + actuators("<motor tendon='band'/>"));
  text.insert(text.find("<joint name='slide'"), "<site name='s'/>");
  text.insert(text.find("<joint name='shoulder'"), "<site name='r' pos='.1 0 0'/>");
  const Scene scene = read(text, ".xml", steps);
  EXPECT_EQ(scene.mujoco->notes(),
            Notes{"ignored: 1 actuator of a tendon with a dead band, 1 tendon with a dead band, "
                  "1 plastic tendon, 1 tendon with nonlinear springs or damping, "
                  "1 tendon with negative stiffness or damping, 1 tendon with friction, "
                  "1 spatial tendon, 1 tendon"});
  EXPECT_EQ(joint_terms_of(scene).rows.size(), 1);
  expect_steps_of_mujoco(text);
}

TEST(Tendons, ThatAddToMAreRefusedWhereNoStepIsTaken) {
  const std::string heavy = tendons(tendon("armature='.4'", "shoulder", "slide"));
  expect_refused([&] { read(arm(heavy), ".xml"); }, {"'t'", "armature 0.4", "implicit steps"});
  EXPECT_NO_THROW(read(arm(heavy), ".xml", steps));
  std::string text =
      arm(tendons("<spatial name='wire' armature='.2'><site site='s'/><site site='r'/></spatial>"));
  text.insert(text.find("<joint name='slide'"), "<site name='s'/>");
  text.insert(text.find("<joint name='shoulder'"), "<site name='r' pos='.1 0 0'/>");
  expect_refused([&] { read(text, ".xml", steps); }, {"'wire'", "spatial tendon"});
}

TEST(Tendons, OfNoNumbersAreRefusedInOneLine) {
  for (const char* bad : {"stiffness='nan'", "damping='inf'", "stiffness='1' springlength='nan'"}) {
    SCOPED_TRACE(bad);
    const std::string text = arm(tendons(tendon(bad, "shoulder", "slide")));
    expect_refused([&] { read(text, ".xml", steps); }, {"tendon 't'", "not finite"});
  }
  std::string text = arm(tendons(tendon("damping='1'", "shoulder", "slide")));
  text.replace(text.find("'1.5'"), 5, "'nan'");
  expect_refused([&] { read(text, ".xml", steps); }, {"tendon 't'", "not finite"});
}

// `discrete` solves beside tendons by iterations.
TEST(Tendons, StepToTheLastDigitWhateverSolverTheFileNames) {
  const std::string few = "<option iterations='1' tolerance='1e-3' solver='PGS'/>";
  expect_steps_of_mujoco(arm(few + tendons(tendon("stiffness='1e5'", "shoulder", "tail"))));
}

// Of all dampers Euler takes those of joints alone at the end of a step, and none where the file says so.
TEST(Tendons, AndJointsAreDampedAtTheStartWithoutEulerdamp) {
  const std::string flag = "<option><flag eulerdamp='disable'/></option>";
  expect_steps_of_mujoco(arm(flag + tendons(tendon("damping='7'", "shoulder", "slide")) +
                             actuators("<position joint='slide' kp='90' kv='8'/>")));
}

}  // namespace
}  // namespace kalmarm
