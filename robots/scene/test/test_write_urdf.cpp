// A robot written as URDF is the same robot when it is read again, but for its armature.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "robots/loader/test/robot_text.hpp"
#include "robots/loader/test/temporary_file.hpp"
#include "robots/scene/generate.hpp"
#include "robots/scene/scene.hpp"
#include "robots/scene/write_mjcf.hpp"
#include "robots/scene/write_urdf.hpp"

namespace kalmarm {
namespace {

class WrittenUrdf : public testing::TestWithParam<std::string> {};

TEST_P(WrittenUrdf, HasTheMassMatrixAndTorquesOfItsRobot) {
  Model<double> model = load_scene(GetParam()).model;
  for (int k = 0; k < model.nv(); ++k) model.set_noise(k, 0.0);
  model.set_gravity(Vector3<double>(0, 0, -9.81));  // which is no part of a URDF
  std::string why_not;
  const auto urdf = to_urdf(model, "robot", why_not);
  ASSERT_TRUE(urdf) << why_not;
  const TemporaryFile given(to_mjcf(model, "robot"), ".xml"), written(urdf->text, ".urdf");
  LoadOptions read;
  if (model.joint(0).coordinate == Coordinate::position) read.floating = "";
  expect_same_robot(load_scene(given.path()), load_scene(written.path(), read));
}

INSTANTIATE_TEST_SUITE_P(Scenes, WrittenUrdf,
                         testing::Values("panda", "iiwa14", "ur10e", "puma560", "so101", "two_link",
                                         "shadow_hand", "go2", "g1", "hyq", "chain:31", "tree:15",
                                         "straight:7"),
                         [](const auto& test) {
                           std::string name = test.param;
                           for (char& letter : name)
                             if (letter == ':') letter = '_';
                           return name;
                         });

// At and about the angles where yaw and roll cannot be told apart.
TEST(UrdfAngles, GiveTheirRotationBackAtEveryPitch) {
  using Eigen::AngleAxis;
  const Vector3<double> x = Vector3<double>::UnitX(), y = Vector3<double>::UnitY(),
                        z = Vector3<double>::UnitZ();
  for (const double pitch : {0.0, 1.0, std::numbers::pi / 2, -std::numbers::pi / 2})
    for (const double off : {0.0, 1e-16, 1e-12, 1e-8, 1e-4}) {
      const Matrix3<double> E = (AngleAxis<double>(0.7, z) * AngleAxis<double>(pitch + off, y) *
                                 AngleAxis<double>(-2.1, x))
                                    .toRotationMatrix();
      const Vector3<double> rpy = urdf_angles(E);
      const Matrix3<double> again = (AngleAxis<double>(rpy[2], z) * AngleAxis<double>(rpy[1], y) *
                                     AngleAxis<double>(rpy[0], x))
                                        .toRotationMatrix();
      EXPECT_LE((E - again).norm(), 1e-15) << pitch << ' ' << off;
    }
}

TEST(UrdfText, NamesWhatItLeavesOut) {
  std::string why_not;
  const auto urdf = to_urdf(load_scene("ur10e").model, "robot", why_not);
  ASSERT_TRUE(urdf);
  ASSERT_EQ(urdf->left_out.size(), 6u);
  EXPECT_EQ(urdf->left_out[0], "armature of joint 'shoulder_pan_joint'");
}

TEST(UrdfText, RefusesJointsThatUrdfDoesNotHave) {
  Joints joints(1);
  joints[0].body = Draw(1).body(1);
  Joint<double> ball;
  ball.parent = 0;
  ball.coordinate = Coordinate::quaternion;
  ball.body = joints[0].body;
  add_three(joints, ball);
  std::string why_not;
  EXPECT_FALSE(to_urdf(assemble(joints, Vector3<double>::Zero()), "robot", why_not));
  EXPECT_TRUE(why_not.starts_with("ball joint")) << why_not;
  EXPECT_FALSE(to_urdf(load_scene("table").model, "robot", why_not));
  EXPECT_FALSE(why_not.empty());
}

}  // namespace
}  // namespace kalmarm
