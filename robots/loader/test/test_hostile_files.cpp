// Files that are none, never end, or attach themselves, and numbers that no memory holds: each is
// refused with one line, and nothing ends the program or waits.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "kalmarm/load.hpp"
#include "robots/loader/files/text_file.hpp"
#include "robots/loader/test/refusal.hpp"
#include "robots/loader/test/temporary_file.hpp"
#include "robots/scene/couplings.hpp"
#include "robots/scene/file_options.hpp"
#include "robots/scene/json_file.hpp"
#include "robots/scene/question.hpp"
#include "robots/scene/scene.hpp"
#include "robots/scene/state_file.hpp"

namespace kalmarm {
namespace {

namespace fs = std::filesystem;

// A folder that lives as long as its object.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "kalmarm-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() { fs::remove_all(path_); }

  std::string with(const std::string& name) const { return (path_ / name).string(); }
  std::string file(const std::string& name, const std::string& text) const {
    std::ofstream(with(name)) << text;
    return with(name);
  }

 private:
  fs::path path_;
};

// What a name may stand for but a file, and a word of the refusal.
class NoFiles {
 public:
  NoFiles() {
    mkfifo(folder_.with("pipe").c_str(), 0600);
    fs::create_symlink("loop", folder_.with("loop"));
    fs::create_directory(folder_.with("folder"));
    folder_.file("closed", "{}");
    fs::permissions(folder_.with("closed"), fs::perms::none);
  }

  template <class Read>
  void expect_refused_by(const Read& read) const {
    const auto expect = [&](const std::string& path, const std::string& word) {
      SCOPED_TRACE(path);
      expect_refused([&] { read(path); }, {word});
    };
    expect(folder_.with("pipe"), "pipe");
    expect(folder_.with("loop"), "symbolic links");
    expect(folder_.with("folder"), "folder");
    expect("/dev/zero", "device");
    if (fs::exists("/proc/kmsg")) expect("/proc/kmsg", "device");
    expect(folder_.with(std::string(300, 'n')), "name too long");
    if (geteuid() != 0) expect(folder_.with("closed"), "permission denied");  // root may read all
  }

 private:
  TemporaryFolder folder_;
};

TEST(HostileFile, IsReadByNoReader) {
  const NoFiles none;
  const Scene scene = load_scene("two_link");
  none.expect_refused_by([](const std::string& path) { read_text(path); });
  none.expect_refused_by([](const std::string& path) { load_scene(path); });
  none.expect_refused_by([](const std::string& path) { static_cast<void>(load_robot(path)); });
  none.expect_refused_by([&](const std::string& path) { read_states(scene, path); });
  none.expect_refused_by([](const std::string& path) { read_numbers(path); });
}

TEST(HostileFile, IsMissing) {
  expect_refused([] { read_text("nowhere.json"); }, {"nowhere.json: no such file"});
  expect_refused([] { read_text(""); }, {"'': no such file"});
}

TEST(HostileFile, TextIsReadWhole) {
  std::string text(200'000, 'x');
  text += '\0';
  text += "\r\n";
  EXPECT_EQ(read_text(TemporaryFile(text, ".txt").path()), text);
  EXPECT_EQ(read_text_or_stream(TemporaryFile(text, ".txt").path()), text);
}

// --- JSON

void expect_json_refused(const std::string& text, std::vector<std::string> words) {
  const TemporaryFile file(text, ".json");
  words.push_back(file.path());
  expect_refused([&] { read_json(file.path()); }, words);
}

TEST(HostileJson, IsNestedTooDeep) {
  const std::size_t deep = 1'000'000;
  expect_json_refused(std::string(deep, '['), {"nested more than 32 deep"});
  expect_json_refused(std::string(deep, '[') + std::string(deep, ']'), {"nested"});
  std::string objects;
  for (int i = 0; i < 100'000; ++i) objects += "{\"a\":";
  expect_json_refused(objects, {"nested"});
  EXPECT_EQ(read_json(TemporaryFile("[[[[1]]]]", ".json").path()).dump(), "[[[[1]]]]");
}

TEST(HostileJson, HasAKeyTwice) {
  expect_json_refused("{\"a\": 1, \"b\": {\"a\": 2}, \"a\": 3}", {"key \"a\" twice"});
  expect_json_refused("[{}, {\"b\": {\"c\": 1, \"c\": 1}}]", {"key \"c\" twice"});
  EXPECT_EQ(read_json(TemporaryFile("{\"a\": [{\"a\": 1}, {\"a\": 1}]}", ".json").path()).size(),
            1);
}

TEST(HostileJson, IsNone) {
  expect_json_refused("", {"not a JSON file"});
  expect_json_refused("{\"a\": 1", {"not a JSON file"});
  expect_json_refused("{\"a\": 1}}", {"not a JSON file"});
  expect_json_refused("[1e999]", {"not a JSON file"});
  expect_json_refused("[\"\xff\"]", {"not a JSON file"});
  expect_json_refused(std::string(3, '\0'), {"not a JSON file"});
}

TEST(HostileStates, HoldNestedValuesAndQuaternionsBeyondAllNumbers) {
  const Scene scene = load_scene("two_link");
  const TemporaryFile nested(
      "{\"states\": [{\"qpos\": [0, [[[[1]]]]], \"qvel\": [0, 0], \"tau\": [0, 0]}]}", ".json");
  expect_refused([&] { read_states(scene, nested.path()); }, {"qpos[1]", "not a finite number"});
  const TemporaryFile robot(
      "<mujoco><worldbody><body><joint type='ball'/>"
      "<inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/></body></worldbody></mujoco>",
      ".xml");
  const TemporaryFile large(
      "{\"states\": [{\"qpos\": [1e200, 1e200, 0, 0], \"qvel\": [0, 0, 0], \"tau\": [0, 0, 0]}]}",
      ".json");
  expect_refused([&] { read_states(load_scene(robot.path()), large.path()); }, {"length inf"});
}

TEST(HostileArmature, HoldsNoNumbers) {
  for (const char* value : {"null", "\"a\"", "[[1]]", "{}", "true"}) {
    const TemporaryFile file(std::string("{\"j\": ") + value + "}", ".json");
    expect_refused([&] { read_numbers(file.path()); }, {"'j'", "is not a finite number"});
  }
}

// --- robots that attach files

std::string with_assets(const std::string& assets) {
  return "<mujoco><asset>" + assets +
         "</asset><worldbody><body><joint name='j'/>"
         "<inertial pos='0 0 .1' mass='1' diaginertia='.1 .1 .1'/></body></worldbody></mujoco>";
}

TEST(HostileRobot, AttachesItself) {
  const TemporaryFolder folder;
  const std::string own = folder.file("own.xml", with_assets("<model name='m' file='own.xml'/>"));
  expect_refused([&] { load_scene(own); }, {"own.xml", "attaches itself"});
  const std::string ring = folder.file("a.xml", with_assets("<model name='b' file='b.xml'/>"));
  folder.file("b.xml", with_assets("<model name='c' file='./c.xml'/>"));
  folder.file("c.xml", "<mujoco><include file='part.xml'/></mujoco>");
  folder.file("part.xml",
              "<mujocoinclude><asset><model name='a' file='a.xml'/></asset></mujocoinclude>");
  expect_refused([&] { load_scene(ring); }, {"attaches itself"});
  const std::string plain = folder.file("plain.xml", with_assets("<model name='d' file='d.xml'/>"));
  folder.file("d.xml", with_assets(""));
  EXPECT_EQ(load_scene(plain).model.nv(), 1) << "one that does not";
}

// Each of 12 models attaches the next three times: half a million to read.
TEST(HostileRobot, AttachesModelsWithoutEnd) {
  const TemporaryFolder folder;
  for (int i = 0; i < 12; ++i) {
    const std::string next = "' file='" + std::to_string(i + 1) + ".xml'/>";
    folder.file(std::to_string(i) + ".xml", with_assets("<model name='x" + next + "<model name='y" +
                                                        next + "<model name='z" + next));
  }
  folder.file("12.xml", with_assets(""));
  expect_refused([&] { load_scene(folder.with("0.xml")); }, {"more than 1000 models"});
}

TEST(HostileRobot, IncludesOrShowsAPipe) {
  const TemporaryFolder folder;
  mkfifo(folder.with("pipe").c_str(), 0600);
  mkfifo(folder.with("pipe.stl").c_str(), 0600);
  const std::string includes =
      folder.file("includes.xml", "<mujoco><include file='pipe'/></mujoco>");
  expect_refused([&] { load_scene(includes); }, {"pipe"});
  const std::string shows =
      folder.file("shows.xml",
                  "<mujoco><asset><mesh name='m' file='pipe.stl'/></asset><worldbody><body>"
                  "<joint/><geom type='mesh' mesh='m'/></body></worldbody></mujoco>");
  expect_refused([&] { load_scene(shows); }, {"pipe.stl", "mesh 'm'"});
}

// Left out is only what is empty for want of what draws.
TEST(HostileRobot, IncludesWhatIsEmptyOrNoXml) {
  const TemporaryFolder folder;
  const std::string robot =
      folder.file("robot.xml",
                  "<mujoco><include file='part.xml'/><worldbody><body><joint/><geom size='.1'/>"
                  "</body></worldbody></mujoco>");
  for (const char* part : {"", " \n", "version https://git-lfs.github.com/spec/v1\noid sha256:0\n",
                           "<mujocoinclude/>", "<mujocoinclude><visual>"}) {
    SCOPED_TRACE(part);
    folder.file("part.xml", part);
    expect_refused([&] { load_scene(robot); }, {"robot.xml"});
  }
  folder.file("part.xml", "<mujocoinclude><visual><globe/></visual></mujocoinclude>");
  EXPECT_EQ(load_scene(robot).mujoco->notes().size(), 1);
}

TEST(HostileRobot, IncludesAFileOfTheKernel) {
  const TemporaryFolder folder;
  for (const char* endless : {"/proc/kmsg", "/proc/self/environ", "/sys/kernel/notes"}) {
    SCOPED_TRACE(endless);
    const std::string include = std::string("<include file='") + endless + "'/>";
    const std::string robot = folder.file("robot.xml", "<mujoco>" + include + "</mujoco>");
    if (fs::exists(endless)) expect_refused([&] { load_scene(robot); }, {endless, "device"});
  }
}

TEST(HostileRobot, HasTagsThatDoNotEnd) {
  for (const char* tag : {"<!--", "<![CDATA[", "<a b='", "<", "<a "}) {
    std::string text = "<mujoco>";
    for (int i = 0; i < 100'000; ++i) text += tag;
    const TemporaryFile file(text, ".xml");
    expect_refused([&] { load_scene(file.path()); }, {file.path()});
  }
}

// --- sizes

std::string arm_and(const std::string& more, const std::string& in_world = "") {
  return "<mujoco>" + more + "<worldbody>" + in_world +
         "<body name='b'><joint/><geom size='.1'/></body></worldbody></mujoco>";
}

TEST(HostileSize, OfWhatTheReaderMakesIsRefused) {
  const std::string body = "<body><joint/><geom size='.1'/></body>";
  const auto copies = [](const char* count, const std::string& of) {
    return "<replicate count='" + std::string(count) + "' offset='1 0 0'>" + of + "</replicate>";
  };
  for (const auto& [text, word] : std::vector<std::pair<std::string, std::string>>{
           {arm_and("<asset><hfield name='h' nrow='2000000000' ncol='2000000000' size='1 1 1 1'/>"
                    "</asset>"),
            "hfield"},
           {arm_and("", copies("2000000000", body)), "replicate"},
           {arm_and("", copies("1000", copies("1000", body))), "replicate"},
           {arm_and("",
                    "<body name='f'><flexcomp name='f' type='grid' count='20000 20000 20000' "
                    "spacing='.1 .1 .1' dim='3'/></body>"),
            "flexcomp"}}) {
    const TemporaryFile file(text, ".xml");
    expect_refused([&] { load_scene(file.path()); }, {file.path(), word, "at most"});
  }
  const TemporaryFile some(arm_and("", copies("3", copies("2", body)) + copies("4", body)), ".xml");
  EXPECT_EQ(load_scene(some.path()).model.nv(), 3 * 2 + 4 + 1);
}

TEST(HostileSize, OfASimulationIsPassedOver) {
  for (const char* size :
       {"nuser_body", "nuser_jnt", "nuser_geom", "nuser_site", "nuser_cam", "nuser_tendon",
        "nuser_actuator", "nuser_sensor", "nuserdata", "nkey", "njmax", "nconmax", "nstack"}) {
    SCOPED_TRACE(size);
    const TemporaryFile file(arm_and("<size " + std::string(size) + "='2000000000'/>"), ".xml");
    EXPECT_EQ(load_scene(file.path()).model.nv(), 1);
  }
}

// To delete them one by one took MuJoCo ten minutes. No size of theirs counts.
TEST(HostileSize, OfKeyframesCountsOnce) {
  std::string keys;
  for (int i = 0; i < 20'000; ++i) keys += "<key name='k" + std::to_string(i) + "' qpos='1 2'/>";
  const TemporaryFile file(arm_and("<keyframe>" + keys + "</keyframe>"), ".xml");
  EXPECT_EQ(load_scene(file.path()).model.nv(), 1);
  expect_refused([&] { load_scene(file.path(), {.key = "k7"}); }, {"2 positions"});
}

// --- names

std::string urdf(const std::string& first, const std::string& second) {
  const std::string inertia =
      "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' "
      "iyz='0'/></inertial>";
  const auto joint = [](const std::string& name, const std::string& child,
                        const std::string& rest) {
    return "<joint name='" + name + "' type='continuous'><parent link='base'/><child link='" +
           child + "'/><axis xyz='0 1 0'/>" + rest + "</joint>";
  };
  return "<robot name='r'><link name='base'/><link name='l'>" + inertia + "</link><link name='r'>" +
         inertia + "</link>" + joint("left", "l", "") + joint(first, "r", second) + "</robot>";
}

TEST(HostileNames, TwoJointsOfAName) {
  const TemporaryFile file(urdf("left", ""), ".urdf");
  expect_refused([&] { load_scene(file.path()); }, {"two joints are called 'left'"});
  const TemporaryFile good(urdf("right", ""), ".urdf");
  EXPECT_EQ(load_scene(good.path()).model.nv(), 2);
}

TEST(HostileNames, LinkOfAJointThatIsNotThere) {
  const std::string fine = urdf("right", "");
  for (const auto& [given, lost] : std::vector<std::pair<std::string, std::string>>{
           {"<parent link='base'/><child link='r'/>", "<parent link='base'/><child link='rr'/>"},
           {"<parent link='base'/><child link='r'/>", "<parent link='rr'/><child link='r'/>"}}) {
    std::string text = fine;
    text.replace(text.find(given), given.size(), lost);
    const TemporaryFile file(text, ".urdf");
    expect_refused([&] { load_scene(file.path()); },
                   {file.path(), "joint 'right': its ", "link 'rr' is not in the file"});
  }
}

TEST(HostileNames, TwoLinksOfAName) {
  std::string text = urdf("right", "");
  text.replace(text.find("<link name='r'>"), 15, "<link name='l'>");
  const TemporaryFile file(text, ".urdf");
  expect_refused([&] { load_scene(file.path()); }, {"two links are called 'l'"});
}

TEST(HostileNames, AreNoText) {
  for (const char* name :
       {"\xe9paule", "\xc0\xaf", "\xed\xa0\x80", "a\xf4\x90\x80\x80", "\xe2\x82"}) {
    const TemporaryFile file(urdf(name, ""), ".urdf");
    expect_refused([&] { load_scene(file.path()); }, {"joint '", "not UTF-8"});
  }
  const TemporaryFile file(urdf("épaule ü €", ""), ".urdf");
  EXPECT_EQ(load_scene(file.path()).model.nv(), 2);
}

TEST(HostileNames, MimicOfAJointThatIsNotThere) {
  const TemporaryFile file(urdf("right", "<mimic joint='lost' multiplier='2'/>"), ".urdf");
  const Scene scene = load_scene(file.path());
  const std::vector<std::string>& notes = scene.mujoco->notes();
  EXPECT_TRUE(std::any_of(notes.begin(), notes.end(), [](const std::string& note) {
    return note.find("not there or fixed: 'lost'") != std::string::npos;
  }));
}

TEST(HostileNames, MimicOfAFixedJoint) {
  std::string text = urdf("right", "<mimic joint='left'/>");
  text.replace(text.find("'continuous'"), 12, "'fixed'");
  const Scene scene = load_scene(TemporaryFile(text, ".urdf").path());
  EXPECT_EQ(
      scene.mujoco->notes(),
      std::vector<std::string>{"ignored: <mimic> of joints that are not there or fixed: 'left'"});
}

TEST(HostileNames, CouplingToAJointThatIsNotThere) {
  const TemporaryFile file(
      "<mujoco><worldbody><body><joint name='j'/>"
      "<inertial pos='0 0 .1' mass='1' diaginertia='.1 .1 .1'/></body></worldbody>"
      "<equality><joint joint1='j' joint2='lost'/></equality></mujoco>",
      ".xml");
  const Scene scene = load_scene(file.path());
  EXPECT_NE(scene.mujoco->notes().front().find("not there: 'lost'"), std::string::npos);
  expect_refused([&] { Couplings{scene}; }, {"'j'", "'lost'", "not there"});
}

TEST(HostileQuestion, LocksAJointAtTwoValues) {
  const Scene scene = load_scene("two_link");
  const auto locked = [&](const std::vector<std::string>& at) {
    QuestionOptions options;
    options.locked = at;
    return question_of(scene, options);
  };
  expect_refused([&] { locked({"joint1=1", "joint1=2"}); }, {"'joint1' is locked at two values"});
  expect_refused([&] { locked({"joint1=1", "joint[1]=2"}); }, {"'joint1' is locked at two values"});
  EXPECT_EQ(locked({"joint1=1", "joint1=1", "joint1"}).q[0], 1);
}

// --- memory

TEST(HostileCount, OfStatesIsRefusedBeforeMemoryIsTaken) {
  expect_refused([] { random_states(load_scene("chain:100"), 2'000'000'000, 1); },
                 {"chain:100: 2000000000 states take", "the limit is 8 GB"});
}

}  // namespace
}  // namespace kalmarm
