// What the model builder takes: the order of its numbers, armature, massless bodies; and each refusal
// with its message.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/dynamics/test/bodies.hpp"
#include "algorithms/fast/lowering/zero_terms.hpp"
#include "algorithms/fast/test/support.hpp"

namespace kalmarm::test {
namespace {

TEST(ModelBuilder, ReferenceAndArmatureAreTheJoints) {
  Random random(5);
  for (const JointType joint : {JointType::hinge, JointType::slide}) {
    Robot given{
        {random_parameters(random, -1, JointType::hinge), random_parameters(random, 0, joint)}};
    given.bodies[1].armature = 0;
    Asked asked(given);
    const MatrixX<double> M = asked.mass();
    given.bodies[1].armature = 0.25;
    MatrixX<double> with_rotor = M;
    with_rotor(1, 1) += 0.25;
    EXPECT_LE((Asked(given).mass() - with_rotor).norm(), 1e-15 * M.norm());
    given.bodies[1].reference += 0.7;
    Asked moved(given);
    moved.state.q[1] += 0.7;
    EXPECT_LE((moved.mass() - with_rotor).norm(), 1e-14 * M.norm());
  }
}

TEST(ModelBuilder, JointsOfSeveralDofHaveArmatureInEach) {
  Random random(6);
  for (const JointType joint : {JointType::ball, JointType::free}) {
    Robot given{{random_parameters(random, -1, joint)}};
    given.bodies[0].armature = 0;
    const MatrixX<double> M = Asked(given).mass();
    given.bodies[0].armature = 0.25;
    const MatrixX<double> more = Asked(given).mass() - M;
    EXPECT_LE((more - 0.25 * MatrixX<double>::Identity(M.rows(), M.rows())).norm(), 1e-14);
  }
}

TEST(ModelBuilder, NumbersDofAndPositionsInTheOrderOfTheBodies) {
  Random random(7);
  Robot given;
  for (const auto& [name, joint] :
       {std::pair{"base", JointType::fixed}, std::pair{"arm", JointType::hinge},
        std::pair{"hand", JointType::fixed}, std::pair{"ball", JointType::ball},
        std::pair{"rail", JointType::slide}, std::pair{"drone", JointType::free}}) {
    given.bodies.push_back(
        random_parameters(random, static_cast<int>(given.bodies.size()) - 1, joint));
    given.bodies.back().name = name;
  }
  const ModelBuilder builder = given.builder();
  EXPECT_EQ(builder.nv(), 11);
  EXPECT_EQ(builder.nq(), 13);
  const int dofs[] = {-1, 0, -1, 1, 4, 5}, positions[] = {-1, 0, -1, 1, 5, 6};
  for (int b = 0; b < 6; ++b) {
    EXPECT_EQ(builder.first_dof(b), dofs[b]) << b;
    EXPECT_EQ(builder.first_q(b), positions[b]) << b;
  }
  const RobotModel model = builder.build();
  EXPECT_EQ(model.nq, 13);
  EXPECT_EQ(model.names,
            (std::vector<std::string>{"arm", "ball_rx", "ball_ry", "ball_rz", "rail", "drone_x",
                                      "drone_y", "drone_z", "drone_rx", "drone_ry", "drone_rz"}));
  EXPECT_EQ(model.gravity, given.gravity);
  EXPECT_EQ(ModelBuilder().build().gravity, (std::array<double, 3>{0, 0, -9.81}));
  EXPECT_THROW((void)builder.first_dof(6), std::out_of_range);
  EXPECT_THROW((void)builder.frame(-1), std::out_of_range);
}

// Frames without mass may be fixed anywhere, also to a link that has none yet, or no mass at all
// but a rotor's inertia.
TEST(ModelBuilder, BodiesWithoutMassMayBeFixedToEachOther) {
  Random random(8);
  BodyParameters hinge = random_parameters(random, -1, JointType::hinge);
  const BodyParameters given_mass = random_parameters(random, 0, JointType::fixed);
  hinge.mass = 0;
  hinge.inertia = {};
  BodyParameters site = hinge;
  site.joint = JointType::fixed;
  site.parent = 0;
  {
    const Robot given{{hinge, site, given_mass, site}};
    Asked asked(given);
    const VectorX<double>& qd = asked.state.qd;
    EXPECT_NEAR(qd.dot(asked.mass() * qd) / 2 / kinetic_energy(given, asked.state.q, qd), 1, 1e-13);
  }
  hinge.inertia = {0.1, 0.2, 0.25, 0, 0, 0};
  site.inertia = {0.3, 0.2, 0.2, 0.01, 0, 0};
  {
    const Robot given{{hinge, site}};
    Asked asked(given);
    const VectorX<double>& qd = asked.state.qd;
    EXPECT_NEAR(qd.dot(asked.mass() * qd) / 2 / kinetic_energy(given, asked.state.q, qd), 1, 1e-13);
  }
}

TEST(ModelBuilder, MayBeMovedAndGoesOnAfterItHasBuilt) {
  Random random(9);
  ModelBuilder first;
  first.add_body(random_parameters(random, -1, JointType::hinge));
  const RobotModel small = first.build();
  ModelBuilder second(std::move(first));
  second.add_body(random_parameters(random, 0, JointType::ball));
  first = std::move(second);
  EXPECT_EQ(first.nv(), 4);
  EXPECT_EQ(small.nv(), 1);
  EXPECT_EQ(first.build().nv(), 4);
}

TEST(ModelBuilder, WasMovedFromAndHoldsNoRobot) {
  ModelBuilder first;
  first.add_body({.name = "arm"});
  const ModelBuilder second(std::move(first));
  const std::function<void(ModelBuilder&)> calls[] = {
      [](ModelBuilder& b) { b.add_body({.name = "hand"}); },
      [](ModelBuilder& b) {
        b.set_gravity({0, 0, 0});
      },
      [](ModelBuilder& b) { (void)b.nq(); },
      [](ModelBuilder& b) { (void)b.nv(); },
      [](ModelBuilder& b) { (void)b.first_dof(0); },
      [](ModelBuilder& b) { (void)b.first_q(0); },
      [](ModelBuilder& b) { (void)b.frame(0); },
      [](ModelBuilder& b) { (void)b.build(); }};
  for (const auto& call : calls) EXPECT_THROW(call(first), std::logic_error);
  EXPECT_EQ(second.nv(), 0);
}

TEST(ModelBuilder, RefusesGravityThatIsNotFinite) {
  ModelBuilder builder;
  EXPECT_THROW(builder.set_gravity({0, NAN, 0}), std::invalid_argument);
  EXPECT_THROW(builder.set_gravity({0, 0, -INFINITY}), std::invalid_argument);
  EXPECT_EQ(builder.build().gravity, (std::array<double, 3>{0, 0, -9.81}));
}

TEST(ModelBuilder, RefusesWhatNoBodyCanBe) {
  BodyParameters good;
  good.name = "arm";
  good.joint = JointType::hinge;
  good.mass = 2;
  good.inertia = {0.1, 0.1, 0.1, 0, 0, 0};
  const auto refusal = [&](const auto& change) -> std::string {
    ModelBuilder builder;
    builder.add_body(good);
    BodyParameters body = good;
    change(body);
    try {
      builder.add_body(body);
    } catch (const std::invalid_argument& error) {
      EXPECT_EQ(builder.nv(), 1) << "nothing was added";
      return error.what();
    }
    return "";
  };
  using B = BodyParameters;
  const double nan = std::numeric_limits<double>::quiet_NaN(),
               infinite = std::numeric_limits<double>::infinity();
  EXPECT_EQ(refusal([](B&) {}), "");
  EXPECT_EQ(refusal([](B& b) { b.parent = 1; }), "body 'arm': parent 1 is not there");
  EXPECT_EQ(refusal([](B& b) { b.parent = -2; }), "body 'arm': parent -2 is not there");
  EXPECT_EQ(refusal([](B& b) { b.joint = static_cast<JointType>(77); }),
            "body 'arm': joint type 77 is none");
  EXPECT_EQ(refusal([](B& b) {
              b.rotation = {1e200, 0, 0, 0};
            }),
            "body 'arm': the quaternion has length 1e200");
  EXPECT_EQ(refusal([](B& b) {
              b.axis = {0, 1e-200, 0};
            }),
            "body 'arm': the axis has length 1e-200");
  EXPECT_EQ(refusal([](B& b) { b.mass = -1; }), "body 'arm': mass is -1");
  EXPECT_EQ(refusal([](B& b) { b.armature = -0.5; }), "body 'arm': armature is -0.5");
  EXPECT_EQ(refusal([](B& b) { b.axis = {0, 0, 0}; }), "body 'arm': the axis has length 0");
  EXPECT_EQ(refusal([](B& b) {
              b.rotation = {0, 0, 0, 0};
            }),
            "body 'arm': the quaternion has length 0");
  EXPECT_EQ(refusal([&](B& b) { b.axis[1] = nan; }), "body 'arm': axis holds nan");
  EXPECT_EQ(refusal([&](B& b) { b.position[2] = infinite; }), "body 'arm': position holds inf");
  EXPECT_EQ(refusal([&](B& b) { b.rotation[0] = nan; }), "body 'arm': rotation holds nan");
  EXPECT_EQ(refusal([&](B& b) { b.center_of_mass[0] = -infinite; }),
            "body 'arm': centre of mass holds -inf");
  EXPECT_EQ(refusal([&](B& b) { b.inertia[5] = nan; }), "body 'arm': inertia holds nan");
  for (double B::*number : {&B::reference, &B::armature, &B::mass})
    EXPECT_EQ(refusal([&](B& b) { b.*number = nan; }),
              "body 'arm': reference, armature and mass holds nan");
  EXPECT_EQ(refusal([](B& b) { b.inertia = {-0.1, 0.1, 0.1, 0, 0, 0}; }),
            "body 'arm': a principal moment of inertia is -0.1");
  EXPECT_EQ(refusal([](B& b) { b.inertia = {0.1, 0.1, 0.1, 0.2, 0, 0}; }),
            "body 'arm': a principal moment of inertia is -0.1");
  EXPECT_EQ(refusal([](B& b) { b.inertia = {0.1, 0.5, 0.2, 0, 0, 0}; }),
            "body 'arm': no body has the principal moments of inertia 0.1, 0.2, "
            "0.5: the largest is more than the sum of the others");
  // A flat body's largest moment is the sum of the others, but for rounding.
  EXPECT_EQ(refusal([](B& b) { b.inertia = {0.1, 0.2, 0.3, 0, 0, 0}; }), "");
  EXPECT_EQ(refusal([](B& b) { b.inertia = {0.1, 0.2, 0.1 + 0.2, 0, 0, 0}; }), "");
}

}  // namespace
}  // namespace kalmarm::test
