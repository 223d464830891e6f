// What is particular to URDF: links without <inertial>, packages, transmissions.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "robots/loader/files/xml_tags.hpp"
#include "robots/loader/test/refusal.hpp"
#include "robots/loader/test/robot_text.hpp"

namespace kalmarm {
namespace {

// Of 6 kg: 0.1 m by 0.2 m by 0.3 m at 1000 kg/m^3.
constexpr const char* box_inertia =
    "<inertial><mass value='6'/><inertia ixx='0.065' iyy='0.05' izz='0.025' ixy='0' ixz='0' "
    "iyz='0'/></inertial>";

std::string geometry(const std::string& shape) {
  return "<collision><geometry>" + shape + "</geometry></collision>";
}
constexpr const char* box = "<box size='0.1 0.2 0.3'/>";

// An arm with a hand fixed to it.
std::string arm(const std::string& hand) {
  return urdf(link("base", geometry(box)) + link("arm", body_of(2)) + link("hand", hand) +
              joint("j", "revolute", "base", "arm") + joint("f", "fixed", "arm", "hand"));
}

TEST(UrdfInertia, IsTheGeometrysOrNoneAsAsked) {
  const Scene by_default = read(arm(geometry(box)), ".urdf");
  EXPECT_EQ(by_default.mujoco->notes(),
            Notes{"without <inertial>: weighed by geometry at 1000 kg/m^3: 'hand'"});
  expect_same_robot(by_default, read(arm(box_inertia), ".urdf"));
  expect_same_robot(read(arm(geometry(box)), ".urdf", {.urdf_inertia = UrdfInertia::geometry}),
                    by_default);
  const Scene massless = read(arm(geometry(box)), ".urdf", {.urdf_inertia = UrdfInertia::none});
  EXPECT_EQ(massless.mujoco->notes(), Notes{"without <inertial>: massless: 'hand'"});
  const Scene bare = read(arm(""), ".urdf");
  EXPECT_EQ(bare.mujoco->notes(), Notes{});
  expect_same_robot(massless, bare);
}

TEST(UrdfInertia, IsNoneWhereAMeshIsMissingUnlessGeometryIsAskedFor) {
  for (const char* mesh : {"<mesh filename='nowhere.stl'/>", "<mesh filename='/dev/null/a.dae'/>",
                           "<mesh filename='package://none/a.stl'/>"}) {
    const Scene scene = read(arm(geometry(mesh)), ".urdf");
    EXPECT_EQ(scene.mujoco->notes(),
              Notes{"without <inertial>: massless, as a mesh is not found or not STL, OBJ or MSH: "
                    "'hand'"});
    expect_same_robot(scene, read(arm(""), ".urdf"));
    const TemporaryFile file(arm(geometry(mesh)), ".urdf");
    expect_refused([&] { load_scene(file.path(), {.urdf_inertia = UrdfInertia::geometry}); },
                   {"'hand'", "package_path"});
  }
}

// A folder that lives as long as its object.
class TemporaryFolder {
 public:
  TemporaryFolder()
      : path_(std::filesystem::temp_directory_path() /
              ("kalmarm-packages-" + std::to_string(getpid()))) {
    std::filesystem::create_directories(path_);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }

  std::string add(const std::string& file, const std::string& text) const {
    std::filesystem::create_directories((path_ / file).parent_path());
    std::ofstream(path_ / file) << text;
    return path_ / file;
  }
  std::string operator/(const std::string& folder) const { return path_ / folder; }

 private:
  std::filesystem::path path_;
};

class Variable {
 public:
  Variable(const char* name, const std::string& value) : name_(name) {
    setenv(name, value.c_str(), 1);
  }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;
  ~Variable() { unsetenv(name_); }

 private:
  const char* name_;
};

// The box as Wavefront OBJ.
std::string box_mesh() {
  std::string out;
  for (const char* x : {"-0.05", "0.05"})
    for (const char* y : {"-0.1", "0.1"})
      for (const char* z : {"-0.15", "0.15"})
        out += std::string("v ") + x + " " + y + " " + z + "\n";
  for (const char* face : {"1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "2 6 8 4"})
    out += std::string("f ") + face + "\n";
  return out;
}

TEST(PackagePath, FindsMeshesThatAnInertiaNeeds) {
  const TemporaryFolder folder;
  const std::string text = arm(geometry("<mesh filename='package://parts/mesh/box.obj'/>"));
  folder.add("ws/parts/mesh/box.obj", box_mesh());
  folder.add("install/share/parts/mesh/box.obj", box_mesh());
  const std::string elsewhere = folder.add("robot.urdf", text);
  const Scene right = read(arm(box_inertia), ".urdf");
  const auto expect_found = [&](const std::string& file, const LoadOptions& options = {}) {
    const Scene scene = load_scene(file, options);
    EXPECT_EQ(scene.mujoco->notes(),
              Notes{"without <inertial>: weighed by geometry at 1000 kg/m^3: 'hand'"});
    ASSERT_EQ(scene.model.nv(), 1);
    const VectorX<double> q = VectorX<double>::Zero(1);
    EXPECT_NEAR(mass_of(scene, q)(0, 0), mass_of(right, q)(0, 0), 1e-6);  // floats of the mesh
  };
  for (const char* path : {"ws", "ws/", "ws/parts", "ws/parts/"})
    expect_found(elsewhere, {.package_path = {folder / "install", folder / path}});
  expect_found(folder.add("ws/parts/urdf/robot.urdf", text));
  {
    const Variable ros("ROS_PACKAGE_PATH", "/nowhere:" + (folder / "ws"));
    expect_found(elsewhere);
  }
  {
    const Variable ament("AMENT_PREFIX_PATH", folder / "install");
    expect_found(elsewhere);
  }
  EXPECT_EQ(load_scene(elsewhere).mujoco->notes().size(), 1);  // massless, as above
  expect_refused([&] { load_scene(elsewhere, {.package_path = {folder / "nowhere"}}); },
                 {"nowhere", "no such folder"});
  std::string by_file = text;
  const std::string package = "package://parts/";
  by_file.replace(by_file.find(package), package.size(), "file://" + (folder / "ws/parts/"));
  expect_found(folder.add("by_file.urdf", by_file));
}

TEST(Transmissions, AreNamedWithAHintAtArmature) {
  const std::string actuator =
      "<transmission name='t'><actuator name='a'><drake:gear_ratio value='50'/>"
      "<drake:rotor_inertia value='1e-4'/></actuator></transmission>";
  const std::string robot =
      link("base", "") + link("arm", body_of(1)) + joint("j", "revolute", "base", "arm");
  EXPECT_EQ(
      read(urdf(robot + actuator + "<transmission name='u'/>"), ".urdf").mujoco->notes(),
      Notes{"ignored: 2 transmissions, 1 gear ratio, 1 rotor inertia; option armature gives joints "
            "what they add to M"});
}

TEST(XmlTags, SkipsWhatIsNoTagAndTakesAnyText) {
  const std::vector<XmlTag> tags = xml_tags(
      "<?xml version='1.0'?><!DOCTYPE r><!-- <no a='1'> --><r a = \"x > y\" "
      "b='\"'><![CDATA[] <no/>]]>"
      "<drake:s/></r>");
  ASSERT_EQ(tags.size(), 2);
  EXPECT_EQ(tags[0].name, "r");
  EXPECT_EQ(tags[0].attribute("a"), "x > y");
  EXPECT_EQ(tags[0].attribute("b"), "\"");
  EXPECT_EQ(tags[0].attribute("c"), "");
  EXPECT_EQ(tags[1].name, "drake:s");
  const std::string text = "<a b='c'><!-- d --><![CDATA[ e ]]></a>";
  for (std::size_t n = 0; n <= text.size(); ++n) xml_tags(text.substr(0, n));
}

}  // namespace
}  // namespace kalmarm
