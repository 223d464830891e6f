// Constraints of JSON files: loops that a URDF cannot say; and what is refused, in one line with the file and the constraint.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "algorithms/model/plain.hpp"
#include "kalmarm/constrained_dynamics.hpp"
#include "kalmarm/load.hpp"
#include "robots/loader/files/json.hpp"
#include "robots/loader/test/refusal.hpp"
#include "robots/loader/test/robot_text.hpp"

namespace kalmarm {
namespace {

// A four-bar of 1 m, a square in the plane of x and z: two cranks on the base, 1 m apart, and a rod on the first whose end is the
// second's.
std::string bars() {
  const auto hinge = [](const std::string& name, const std::string& parent,
                        const std::string& child, const std::string& at) {
    return "<joint name='" + name + "' type='continuous'><parent link='" + parent +
           "'/><child link='" + child + "'/><origin xyz='" + at + "'/><axis xyz='0 1 0'/></joint>";
  };
  return urdf(link("base", "") + link("crank", body_of(1)) + link("rod", body_of(1)) +
              link("rocker", body_of(1)) + hinge("hip", "base", "crank", "0 0 0") +
              hinge("knee", "crank", "rod", "0 0 1") +
              hinge("other_hip", "base", "rocker", "1 0 0"));
}

LoadedRobot with_constraints(const std::string& listed) {
  const TemporaryFile robot(bars(), ".urdf"), loops("{\"constraints\": [" + listed + "]}", ".json");
  return load_robot(robot.path(), {.constraints = loops.path()});
}

const std::string pin =
    R"({"name": "pin", "first": {"frame": "rod", "translation": [1, 0, 0]},
        "second": {"frame": "rocker", "translation": [0, 0, 1]}})";

TEST(ConstraintFiles, HaveTheLoopsOfAUrdf) {
  const LoadedRobot robot = with_constraints(pin);
  EXPECT_TRUE(robot.notes.empty());
  ASSERT_EQ(robot.constraints.size(), 1u);
  const Constraint& loop = robot.constraints[0];
  EXPECT_EQ(loop.kind, Constraint::Kind::point);
  EXPECT_EQ(loop.first.link, robot.frame("rod").link);
  ConstrainedDynamics<double> closed(robot.model, robot.constraints);
  const VectorX<double> q{{0.3, -0.3, 0.3}};  // a parallelogram
  VectorX<double> e(3);
  closed.evaluate(q, {.error = e});
  EXPECT_LE(e.norm(), 1e-15);
  closed.evaluate(VectorX<double>{{0.3, 0, 0.3}}, {.error = e});
  EXPECT_NEAR(e.norm(), 2 * std::sin(0.15), 1e-15);
}

// Frames in the axes of frames, joints by patterns, and every number in its place.
TEST(ConstraintFiles, HaveEveryField) {
  const LoadedRobot robot = with_constraints(
      R"({"name": "w\u00e9ld \"1\"", "kind": "pose", "first": {"frame": "rod", "translation": [1, 2, 3],
          "rotation": [2, 0, 0, 2]}, "turning": 0.5, "stiffness": 4e2, "damping": 40,
          "velocity_terms": false, "compliance": [1, 2], "impedance": [0.1, 0.9, 1e-3, 0.4, 3]},
         {"kind": "coupling", "name": "gear", "joints": {"*hip": 2, "knee": -1}, "other": [0, 1, 0],
          "reference": -0.25, "polynomial": [1, 2, 3]})");
  ASSERT_EQ(robot.constraints.size(), 2u);
  const Constraint &weld = robot.constraints[0], &gear = robot.constraints[1];
  EXPECT_EQ(weld.name, "w\xc3\xa9ld \"1\"");
  EXPECT_EQ(weld.kind, Constraint::Kind::pose);
  const Frame& rod = robot.frame("rod");
  const Eigen::Quaternion<double> R = quaternion_of(rod.rotation);
  const Vector3<double> p = Vector3<double>(rod.translation.data()) + R * Vector3<double>(1, 2, 3),
                        x = quaternion_of(weld.first.rotation) * Vector3<double>::UnitX();
  EXPECT_LE((Vector3<double>(weld.first.translation.data()) - p).norm(), 1e-15);
  EXPECT_LE((x - R * Vector3<double>::UnitY()).norm(), 1e-15);
  EXPECT_EQ(weld.second.link, -1);
  EXPECT_EQ(weld.turning, 0.5);
  EXPECT_EQ(weld.stiffness, 400);
  EXPECT_EQ(weld.damping, 40);
  EXPECT_FALSE(weld.velocity_terms);
  EXPECT_EQ(weld.compliance, (std::array<double, 2>{1, 2}));
  ASSERT_TRUE(weld.impedance);
  EXPECT_EQ(weld.impedance->width, 1e-3);
  EXPECT_EQ(weld.impedance->power, 3);
  EXPECT_EQ(gear.jacobian, (std::vector<double>{2, -1, 2}));
  EXPECT_EQ(gear.other, (std::vector<double>{0, 1, 0}));
  EXPECT_EQ(gear.reference, -0.25);
  EXPECT_EQ(gear.polynomial, (std::array<double, 5>{1, 2, 3, 0, 0}));
}

// Of a point, of a pose turned by 0.2 rad, and of a coupling.
TEST(ConstraintFiles, ThatAreOpenAtHomeAreNamedWithTheirDistance) {
  const LoadedRobot robot = with_constraints(
      R"({"name": "short", "first": {"frame": "rod", "translation": [1, 0, 0]}, "second":
          {"frame": "rocker", "translation": [0, 0, 0.75]}},
         {"name": "turned", "kind": "pose", "first": {"frame": "crank", "rotation":
          [0.9950041652780258, 0, 0, 0.09983341664682815]}},
         {"name": "gear", "kind": "coupling", "joints": {"hip": 1}, "other": {"knee": 1},
          "polynomial": [0.5, 1]})");
  EXPECT_EQ(robot.notes,
            std::vector<std::string>{"open at home [m, of turns rad]: 'short' by 0.25, "
                                     "'turned' by 0.2, 'gear' by 0.5"});
}

TEST(ConstraintFiles, WithBadConstraintsAreRefusedInOneLine) {
  const auto refused = [](const std::string& listed, const std::vector<std::string>& words) {
    expect_refused([&] { with_constraints(listed); }, words);
  };
  const auto field = [&](const std::string& text, const std::vector<std::string>& words) {
    std::vector<std::string> all = words;
    all.insert(all.end(), {".json: ", "constraint 'pin': "});
    refused(R"({"name": "pin", )" + text + "}", all);
  };
  field(R"("first": "rood")", {"frame 'rood' is unknown; nearest: rod"});
  field(R"("first": {"frame": "rood"})", {"frame 'rood' is unknown"});
  field(R"("first": 3)", {"first is neither a frame's name nor"});
  field(R"("first": {"translation": [1, 2, 3]})", {"first is neither a frame's name nor"});
  field(R"("first": {"frame": "rod", "translation": [1, 2]})",
        {"translation has 2 numbers, 3 are needed"});
  field(R"("first": {"frame": "rod", "rotation": [0, 0, 0, 0]})", {"rotation has no length"});
  field(R"("first": {"frame": "rod", "offset": [0, 0, 0]})", {"field 'offset' is unknown"});
  field(R"("frist": "rod")", {"field 'frist' is unknown; nearest: first"});
  field(R"("kind": "ball")", {"kind 'ball' is unknown"});
  field(R"("stiffness": "soft")", {"stiffness is no number"});
  field(R"("velocity_terms": 1)", {"velocity_terms is neither true nor false"});
  field(R"("compliance": 0)", {"compliance is no list"});
  field(R"("compliance": [0, null])", {"compliance is no number"});
  field(R"("polynomial": [1, 2, 3, 4, 5, 6])", {"polynomial has 6 numbers, 1 to 5 are needed"});
  field(R"("kind": "coupling")", {"a coupling needs joints"});
  field(R"("kind": "coupling", "joints": {"kne": 1})", {"joint 'kne' is unknown; nearest: knee"});
  field(R"("kind": "coupling", "joints": [1, 2])", {"joints has 2 numbers, 3 are needed"});
  refused(R"({"first": "rod"})", {".json: constraint 0 has no name"});
  refused(R"({"name": 3})", {"constraint 0: name is no text"});
  refused("7", {"constraint 0 has no name"});
  refused(pin + ", " + pin, {"constraint 'pin' is there twice"});
}

// What the file cannot know, the constructor of ConstrainedDynamics refuses, and a call by an outcome.
TEST(ConstraintFiles, WhoseConstraintsHoldNothingOrRepeatEachOtherAreRefusedByTheirNames) {
  const LoadedRobot same = with_constraints(R"({"name": "none", "first": "rod", "second": "rod"})");
  try {
    ConstrainedDynamics<double> made(same.model, same.constraints);
    FAIL() << "was accepted";
  } catch (const std::invalid_argument& e) {
    EXPECT_NE(std::string(e.what()).find("constraint 'none': both frames are on link"),
              std::string::npos)
        << e.what();
  }
  std::string again = pin;
  again.replace(again.find("pin"), 3, "again");
  const LoadedRobot twice = with_constraints(pin + "," + again);
  ConstrainedDynamics<double> robot(twice.model, twice.constraints);
  const VectorX<double> zero = VectorX<double>::Zero(3);
  VectorX<double> a(3), forces(6);
  const Outcome outcome =
      robot.forward_dynamics(VectorX<double>{{0.3, -0.2, 0.4}}, zero, zero, a, forces);
  EXPECT_EQ(outcome.status, Outcome::Status::singular);
  EXPECT_FALSE(robot.name_of(outcome).empty());
}

TEST(ConstraintFiles, ThatAreNoJsonAreRefusedWithTheLine) {
  const TemporaryFile robot(bars(), ".urdf");
  const auto refused = [&](const std::string& text, const std::string& why) {
    const TemporaryFile loops(text, ".json");
    expect_refused([&] { load_robot(robot.path(), {.constraints = loops.path()}); },
                   {loops.path() + ": ", why});
  };
  refused("", "line 1: a value is needed, not the end");
  refused("{", "line 1: a name in quotes is needed, not the end");
  refused("{}", "has no list \"constraints\"");
  refused("[1]", "has no list \"constraints\"");
  refused("{\"constraints\": {}}", "has no list \"constraints\"");
  refused("{\"constraints\":\n [1,]}", "line 2: a value is needed, not ']'");
  refused("{\"constraints\": [1}", "']' or ',' is needed, not '}'");
  refused("{\"constraints\": []} x", "the end is needed, not 'x'");
  refused("{\"a\": 1, \"a\": 2}", "an object has 'a' twice");
  refused("[NaN]", "a value is needed, not 'N'");
  refused("[-Infinity]", "a value is needed, not '-'");
  refused("[1e999]", "double does not hold 1e999");
  refused("[01]", "not '01'");
  refused("[1.]", "not '1.'");
  refused("[.5]", "not '.5'");
  refused("['a']", "not '''");
  refused("[\"a\n\"]", "control character");
  refused("[\"a", "text ends without a quote");
  refused(R"(["\x"])", "'\\x' stands for nothing");
  refused(R"(["\u12"])", "needs four digits");
  refused(R"(["\udc00"])", "half of a pair");
  refused(R"(["\ud83dx"])", "half of a pair");
  refused("[\"\xff\"]", "is not UTF-8");
  refused(std::string(100000, '['), "nested more than 32 deep");
  expect_refused([&] { load_robot(robot.path(), {.constraints = "none.json"}); },
                 {"none.json: no such"});
}

TEST(ConstraintFiles, HaveTextInEveryEscape) {
  EXPECT_EQ(json_of(R"("\" \\ \/ \b\f\n\r\t \u0041 \u00e9 \u20ac \ud83d\ude00")").text,
            "\" \\ / \b\f\n\r\t A \xc3\xa9 \xe2\x82\xac \xf0\x9f\x98\x80");
  const Json all = json_of(" [ true, false, null, -0.5e-3, 0, {\"k\": [] } ] ");
  ASSERT_EQ(all.list.size(), 6u);
  EXPECT_EQ(all.list[0].number, 1);
  EXPECT_EQ(all.list[2].kind, Json::Kind::null);
  EXPECT_EQ(all.list[3].number, -0.5e-3);
  EXPECT_EQ(all.list[5].find("k")->kind, Json::Kind::list);
}

}  // namespace
}  // namespace kalmarm
