// What only a renderer or a middleware reads refuses no robot.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "robots/loader/files/drawn_parts.hpp"
#include "robots/loader/test/refusal.hpp"
#include "robots/loader/test/robot_text.hpp"

namespace kalmarm {
namespace {

// A base, and an arm with `parts` beside its inertia and `rest` beside the links.
std::string arm(const std::string& parts, const std::string& rest) {
  return urdf(link("base", "") + link("arm", body_of(2) + parts) +
              joint("j", "revolute", "base", "arm") + rest);
}

void expect_note(const Scene& scene) {
  ASSERT_FALSE(scene.mujoco->notes().empty());
  EXPECT_TRUE(
      scene.mujoco->notes()[0].starts_with("read without what only draws or collides, which"))
      << scene.mujoco->notes()[0];
}

TEST(DrawnParts, OfAUrdfRefuseNothing) {
  const Scene plain = read(arm("", ""), ".urdf");
  for (const char* parts :
       {"<visual><geometry><box size='1 2 3'/></geometry><material name='a'/><material name='b'/>"
        "</visual>",
        "<visual><material name=''/></visual>", "<visual/>",
        "<visual><geometry><ball radius='1'/></geometry></visual>",
        "<visual><!-- </visual> --><geometry><box size='a b'/></geometry></visual>"}) {
    SCOPED_TRACE(parts);
    expect_same_robot(read(arm(parts, ""), ".urdf"), plain);
  }
  const Scene twice = read(arm("<visual><material name='a'/><material name='b'/></visual>",
                               "<material/><material name='c'><color rgba='x'/></material>"),
                           ".urdf");
  expect_note(twice);
  expect_same_robot(twice, plain);
}

constexpr const char* scaled_wrongly =
    "<collision><geometry><mesh filename='a.stl' scale='1 1 1 1'/></geometry></collision>";

TEST(DrawnParts, CollisionsOfALinkWithAnInertiaRefuseNothing) {
  const Scene scene = read(arm(scaled_wrongly, ""), ".urdf");
  expect_note(scene);
  expect_same_robot(scene, read(arm("", ""), ".urdf"));
}

TEST(DrawnParts, CollisionsThatWeighAreNotLeftOut) {
  const auto refused = [](const std::string& text) {
    const TemporaryFile file(text, ".urdf");
    expect_refused([&] { load_scene(file.path()); }, {"scale"});
  };
  refused(
      urdf(link("base", "") + link("arm", scaled_wrongly) + joint("j", "revolute", "base", "arm")));
  refused(arm(scaled_wrongly, "<mujoco><compiler inertiafromgeom='true'/></mujoco>"));
}

TEST(DrawnParts, DoNotHideWhatIsWrongElsewhere) {
  const TemporaryFile twisted(
      urdf(link("base", "") + link("arm", body_of(2) + "<visual><material/><material/></visual>") +
           joint("j", "twisting", "base", "arm")),
      ".urdf");
  const std::string message = complaint([&] { load_scene(twisted.path()); });
  EXPECT_NE(message.find("joint"), std::string::npos) << message;
  EXPECT_EQ(message.find("material"), std::string::npos) << message;
}

TEST(DrawnParts, WeighNothingInAUrdf) {
  const char* painted =
      "<visual><geometry><box size='1 2 3'/></geometry><material name='a'/><material name='b'/>"
      "</visual>";
  const auto with_hand = [&](const std::string& hand) {
    return urdf(link("base", "") + link("arm", body_of(2)) + link("hand", hand) +
                joint("j", "revolute", "base", "arm") + joint("f", "fixed", "arm", "hand"));
  };
  expect_same_robot(read(with_hand(painted), ".urdf"), read(with_hand(""), ".urdf"));
}

constexpr const char* pendulum =
    "<worldbody><body><joint axis='0 1 0'/><geom size='0.1' pos='0.2 0 0' material='steel'/>"
    "</body></worldbody>";

TEST(DrawnParts, OfAnMjcfRefuseNothing) {
  const Scene plain =
      read(std::string("<mujoco><asset><material name='steel'/></asset>") + pendulum + "</mujoco>",
           ".xml");
  for (const char* parts :
       {"<visual><globe/></visual>", "<visual><map shine='x'/></visual>",
        "<asset><texture name='t' type='sphere'/></asset>",
        "<asset><material name='steel' sheen='1'><layer texture='t' role='none'/></material>"
        "</asset>",
        "<default><material roughness='a'/></default>",
        "<worldbody><light name='l' colour='1'/><camera lens='2'/></worldbody>"}) {
    SCOPED_TRACE(parts);
    const Scene drawn = read(std::string("<mujoco>") + parts + pendulum + "</mujoco>", ".xml");
    expect_note(drawn);
    expect_same_robot(drawn, plain);
  }
}

TEST(DrawnParts, OfWhatAFileIncludesAndAttachesRefuseNothing) {
  namespace fs = std::filesystem;
  const fs::path folder = fs::temp_directory_path() / ("kalmarm-drawn-" + std::to_string(getpid()));
  fs::create_directories(folder / "parts");
  const auto write = [&](const char* name, const std::string& text) {
    std::ofstream(folder / name) << text;
  };
  write("robot.xml",
        std::string("<mujoco><include file='parts/look.xml'/><asset>"
                    "<model name='m' file='parts/hand.xml'/></asset><worldbody>"
                    "<body name='arm'><joint axis='0 1 0'/><geom size='0.1' pos='0.2 0 0'/>"
                    "<attach model='m' body='hand' prefix='a_'/></body></worldbody></mujoco>"));
  write("parts/look.xml", "<mujoco><include file='paint.xml'></include></mujoco>");
  write("parts/paint.xml", "<mujoco><visual><fog/></visual></mujoco>");
  write("parts/hand.xml",
        "<mujoco><asset><texture kind='none'/></asset><worldbody><body name='hand'>"
        "<joint axis='0 0 1'/><geom size='0.1' pos='0.3 0 0'/></body></worldbody></mujoco>");
  const Scene scene = load_scene((folder / "robot.xml").string());
  expect_note(scene);
  EXPECT_EQ(scene.model.nv(), 2);
  fs::remove_all(folder);
}

TEST(DrawnParts, LeaveLinesAndAllElseWhereTheyAre) {
  const std::string text =
      "<robot>\n<!-- <visual> -->\n<link name='a'><visual name='>' >\r\n<visual/>\n</visual></link>"
      "<material/></robot>\n";
  const std::string left = without_drawn_parts(text);
  EXPECT_EQ(left.size(), text.size());
  EXPECT_EQ(left,
            "<robot>\n<!-- <visual> -->\n<link name='a'>                  \r\n         \n"
            "         </link>           </robot>\n");
  EXPECT_EQ(without_drawn_parts(left), left);
  const std::string open = "<robot><visual><a></robot>";
  EXPECT_EQ(without_drawn_parts(open), open);
  for (std::size_t n = 0; n <= text.size(); ++n)
    EXPECT_EQ(without_drawn_parts(text.substr(0, n)).size(), n);
}

}  // namespace
}  // namespace kalmarm
