// What LoadOptions change of a file, and what is said of it, against MuJoCo's own reading of a file
// that says the same.
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "robots/files/xml_tags.hpp"
#include "robots/mujoco_solver.hpp"
#include "robots/scene.hpp"
#include "robots/test/refusal.hpp"
#include "robots/test/temporary_file.hpp"

namespace kalmarm {
namespace {

using Notes = std::vector<std::string>;

Scene read(const std::string& text, const std::string& ending, const LoadOptions& options = {}) {
  return load_scene(TemporaryFile(text, ending).path(), options);
}

std::string link(const std::string& name, const std::string& inside) {
  return "<link name='" + name + "'>" + inside + "</link>";
}

std::string body_of(double mass) {
  return "<inertial><origin xyz='0.1 0 0.2'/><mass value='" + std::to_string(mass) +
         "'/><inertia ixx='.3' iyy='.4' izz='.5' ixy='.1' ixz='0' iyz='0'/></inertial>";
}

std::string joint(const std::string& name, const std::string& type, const std::string& parent,
                  const std::string& child, const std::string& rest = "") {
  return "<joint name='" + name + "' type='" + type + "'><parent link='" + parent +
         "'/><child link='" + child + "'/><origin xyz='0.1 0.2 0.3' rpy='0.3 0 0.7'/>" +
         "<axis xyz='0 1 0'/><limit lower='-1' upper='1' effort='1' velocity='1'/>" + rest +
         "</joint>";
}

std::string urdf(const std::string& inside) { return "<robot name='r'>" + inside + "</robot>"; }

// A trunk on a base without mass, and three legs.
std::string quadruped() {
  std::string out =
      link("base", "") + link("trunk", body_of(5)) + joint("f", "fixed", "base", "trunk");
  for (const std::string leg : {"a", "b", "c"})
    out += link(leg, body_of(1)) + joint("hip_" + leg, "revolute", "trunk", leg);
  return urdf(out);
}

MatrixX<double> mass_of(const Scene& scene, const VectorX<double>& q) {
  MatrixX<double> M(scene.model.nv(), scene.model.nv());
  MujocoSolver(mujoco_of(scene)).mass(q, M);
  return M;
}

// Same M and bias in random states, by MuJoCo.
void expect_same_robot(const Scene& a, const Scene& b) {
  ASSERT_EQ(a.model.nv(), b.model.nv());
  MujocoSolver one(mujoco_of(a)), other(mujoco_of(b));
  VectorX<double> x(a.model.nv()), y(a.model.nv());
  for (const State& state : random_states(a, 5, 3)) {
    const MatrixX<double> M = mass_of(a, state.q);
    EXPECT_LE((M - mass_of(b, state.q)).norm(), 1e-13 * M.norm());
    one.inverse_dynamics(state.q, state.qd, state.tau, x);
    other.inverse_dynamics(state.q, state.qd, state.tau, y);
    EXPECT_LE((x - y).norm(), 1e-13 * x.norm());
  }
}

TEST(Floating, RootOfAUrdfIsAsOneThatAFloatingJointHangsOnTheWorld) {
  std::string hung = quadruped();
  hung.insert(hung.find("<link"), link("world", "") +
                                      "<joint name='root' type='floating'><parent link='world'/>"
                                      "<child link='base'/></joint>");
  for (const char* name : {"", "base"}) {
    const Scene scene = read(quadruped(), ".urdf", {.floating = name});
    EXPECT_EQ(scene.model.nv(), 9);
    EXPECT_EQ(scene.model.name(0), "floating_base:x");
    EXPECT_EQ(scene.mujoco->notes(), Notes{});
    expect_same_robot(scene, read(hung, ".urdf"));
  }
}

TEST(Floating, IsHintedAtWhereLimbsHangOnAWeldedBase) {
  const Scene scene = read(quadruped(), ".urdf");
  EXPECT_EQ(scene.model.nv(), 3);
  EXPECT_EQ(scene.mujoco->notes(),
            Notes{"3 limbs hang on 'base', which is welded to the world: --floating frees it"});
  for (const std::string& robot : shipped_robots())
    for (const std::string& note : load_scene(robot).mujoco->notes())
      EXPECT_EQ(note.find("--floating"), std::string::npos) << robot << ": " << note;
}

TEST(Floating, IsRefusedWhereThatIsNoRoot) {
  const auto refused = [](const std::string& text, const char* name,
                          const std::vector<std::string>& words) {
    const TemporaryFile file(text, ".xml");
    expect_refused([&] { load_scene(file.path(), {.floating = name}); }, words);
  };
  refused(quadruped(), "trunk", {"'trunk'", "no root", "'base'"});
  refused(quadruped(), "bas", {"'bas' is unknown", "base"});
  const std::string inertia = "<inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>";
  const auto world = [&](const std::string& inside) {
    return "<mujoco><worldbody>" + inside + "</worldbody></mujoco>";
  };
  const std::string hung = "<body name='hung'><joint name='j'/>" + inertia + "</body>";
  refused(world(hung), "hung", {"'hung' has a joint"});
  refused(world(hung), "", {"no link is welded"});
  const auto base = [&](const std::string& name) {
    return "<body name='" + name + "'><body><joint/>" + inertia + "</body></body>";
  };
  refused(world(base("left") + base("right")), "", {"several", "'left', 'right'"});
  expect_refused([] { load_scene("chain:3", {.floating = ""}); }, {"chain:3"});
}

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
                   {"'hand'", "--package-path"});
    // A last link needs an inertia.
    const TemporaryFile last(urdf(link("base", "") + link("arm", geometry(mesh)) +
                                  joint("j", "revolute", "base", "arm")),
                             ".urdf");
    expect_refused([&] { load_scene(last.path()); }, {"'arm'", "massless, as a mesh is not found"});
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

TEST(XmlTags, SkipsWhatIsNoTagAndTakesAnyText) {
  const std::vector<XmlTag> tags = xml_tags(
      "<?xml version='1.0'?><!DOCTYPE r><!-- <no a='1'> --><r a = \"x > y\" "
      "b='\"'><![CDATA[<no/>]]>"
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
