// What a stress does to a robot, in masses, inertias and lengths.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "accuracy/limits/stresses.hpp"
#include "algorithms/model/mass_matrix.hpp"
#include "robots/scene/generate.hpp"

namespace kalmarm::limits {
namespace {

const Stress& stress(const std::vector<Stress>& all, const std::string& name) {
  const auto found = std::ranges::find(all, name, &Stress::name);
  if (found == all.end()) throw std::runtime_error("no stress " + name);
  return *found;
}

std::vector<std::string> names(const std::string& scene) {
  std::vector<std::string> out;
  for (const Stress& one : stresses_of(load_scene(scene))) out.push_back(one.name);
  return out;
}

// M at q = 0.
MatrixX<double> mass(const Model<double>& model) {
  LinkKinematics<double> kin(model);
  CompositeInertia<double> composite(model);
  MatrixX<double> M(model.nv(), model.nv());
  set_position(model, VectorX<double>(VectorX<double>::Zero(model.nq())), kin);
  mass_matrix(model, kin, composite, Eigen::Ref<MatrixX<double>>(M));
  return M;
}

TEST(Stresses, AreThoseThatTheRobotHasPartsFor) {
  using Names = std::vector<std::string>;
  EXPECT_EQ(names("two_link"), Names({"poses", "payload", "light_wrist", "long_tool", "light_base",
                                      "contact", "gain", "step"}));
  // Fingers end on one link; armature.
  EXPECT_EQ(names("panda"), Names({"poses", "payload", "armature", "light_wrist", "long_tool",
                                   "light_base", "contact", "gain", "step"}));
  EXPECT_EQ(stress(stresses_of(load_scene("panda")), "payload").title, "Payload on link7");
  // Left and right are alike.
  EXPECT_EQ(names("g1"), Names({"poses", "payload:left_ankle_roll_link",
                                "payload:left_wrist_yaw_link", "armature", "light_wrist",
                                "long_tool", "light_base", "contact", "gain", "step"}));
  EXPECT_EQ(names("straight:1"), Names({"poses"}));  // to scale one body is to change the unit
}

TEST(Stresses, WhereAStressScalesTheRobotIsAsGivenAtOne) {
  const Scene scene = load_scene("panda");
  for (const Stress& one : stresses_of(scene)) {
    SCOPED_TRACE(one.name);
    EXPECT_EQ(mass(one.model(1)) == mass(scene.model), one.scales);
    EXPECT_NE(std::ranges::find(one.values, 1), one.values.end());
  }
}

TEST(Stresses, PayloadAddsMassAndInertiaInThePlaceOfTheLink) {
  const Scene scene = load_scene("iiwa14");
  const Model<double> loaded = stress(stresses_of(scene), "payload").model(100);
  for (int k = 0; k < scene.model.nv(); ++k) {
    const RigidBody<double>&before = scene.model.joint(k).body, &after = loaded.joint(k).body;
    const double factor = k == 6 ? 101 : 1;
    EXPECT_DOUBLE_EQ(after.mass, factor * before.mass);
    EXPECT_TRUE(after.moments.isApprox(factor * before.moments));
    EXPECT_EQ(after.com, before.com);
  }
}

TEST(Stresses, ArmatureCanBeSwitchedOff) {
  const Scene scene = load_scene("panda");
  const Stress armature = stress(stresses_of(scene), "armature");
  EXPECT_EQ(armature.values.back(), 0);
  EXPECT_GT(scene.model.joint(3).r, 0);
  for (int k = 0; k < scene.model.nv(); ++k) {
    EXPECT_EQ(armature.model(0).joint(k).r, 0);
    EXPECT_DOUBLE_EQ(armature.model(0.1).joint(k).r, 0.1 * scene.model.joint(k).r);
  }
}

TEST(Stresses, LightWristIsLightWithAllThatItCarries) {
  const Scene scene = load_scene("panda");
  const Model<double> light = stress(stresses_of(scene), "light_wrist").model(1e-4);
  for (int k = 0; k < scene.model.nv(); ++k)  // links 5 to 7 and two fingers
    EXPECT_DOUBLE_EQ(light.joint(k).body.mass / scene.model.joint(k).body.mass, k < 4 ? 1 : 1e-4);
}

TEST(Stresses, GainAndStepAddTheNoiseOfAnImplicitStep) {
  const Scene scene = load_scene("g1");
  const std::vector<Stress> all = stresses_of(scene);
  const Model<double> stiff = stress(all, "gain").model(1e6),
                      long_step = stress(all, "step").model(20);
  for (int k = 0; k < scene.model.nv(); ++k) {
    const double r = scene.model.joint(k).r;
    EXPECT_DOUBLE_EQ(stiff.joint(k).r, k < 6 ? r : r + 2e-3 * 2e3 + 4e-6 * 1e6);
    EXPECT_DOUBLE_EQ(long_step.joint(k).r, k < 6 ? r : r + 2e-2 * 2 * std::sqrt(1e5) + 4e-4 * 1e5);
  }
}

// Two thin rods of 1 m, which swing about their ends.
TEST(Stresses, ToolOfARodOfItsLengthIsOneHundredthOfTheRod) {
  Joint<double> rod;
  rod.body = {2, {0.5, 0, 0}, {1, 0, 0, 0}, {0, 2 / 12.0, 2 / 12.0}};
  Joint<double> second = rod;
  second.parent = 0;
  second.q_index = 1;
  second.translation = {1, 0, 0};
  const Scene scene = generated_scene("rods", assemble({rod, second}, {0, 0, -9.81}));
  const Model<double> armed = stress(stresses_of(scene), "long_tool").model(1);
  EXPECT_NEAR(mass(armed)(1, 1), 1.01 * 2 / 3, 1e-12);
  EXPECT_NEAR(armed.joint(1).body.com.x(), 0.5, 1e-12);
  // Ten times the length: moment about the end 0.02 * 10^2 / 3
  const Model<double> longer = stress(stresses_of(scene), "long_tool").model(10);
  EXPECT_NEAR(mass(longer)(1, 1), 2 / 3.0 + 0.02 * 100 / 3, 1e-12);
}

// M grows by J'J d of the rod's end, which resists along three directions alike: along two in its plane.
TEST(Stresses, AContactIsATermOfTheProcessNoise) {
  Joint<double> rod;
  rod.body = {2, {0.5, 0, 0}, {1, 0, 0, 0}, {0, 2 / 12.0, 2 / 12.0}};
  const Scene scene = generated_scene("rod", assemble({rod,
                                                       [&rod] {
                                                         Joint<double> second = rod;
                                                         second.parent = 0;
                                                         second.q_index = 1;
                                                         second.translation = {1, 0, 0};
                                                         return second;
                                                       }()},
                                                      {0, 0, -9.81}));
  const double d = 1e3;  // at 2 m from the first axis and 1 m from the second
  const MatrixX<double> more =
      mass(stress(stresses_of(scene), "contact").model(d)) - mass(scene.model);
  EXPECT_NEAR(more(0, 0), 4 * d, 1e-9);
  EXPECT_NEAR(more(0, 1), 2 * d, 1e-9);
  EXPECT_NEAR(more(1, 1), d, 1e-9);
}

TEST(Stresses, ValuesAreWrittenShort) {
  EXPECT_EQ(short_value(3000), "3000");
  EXPECT_EQ(short_value(0.02), "0.02");
  EXPECT_EQ(short_value(1e8), "1e8");
  EXPECT_EQ(short_value(3e4), "3e4");
  EXPECT_EQ(short_value(2e-6), "2e-6");
  EXPECT_EQ(short_value(0), "0");
}

}  // namespace
}  // namespace kalmarm::limits
