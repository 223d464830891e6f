// Data of a fit: what is written is read back to the bit, and bad files are refused by one line.
#include <gtest/gtest.h>

#include "accuracy/fits/samples.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/test/temporary_file.hpp"

namespace kalmarm {
namespace {

Samples read_text(const Scene& scene, const std::string& text) {
  return read_samples(scene, TemporaryFile(text, ".csv").path());
}

Samples random_samples(const Scene& scene, int count) {
  const std::vector<State> states = random_states(scene, 2 * count, 3);
  Samples out;
  out.time = VectorX<double>::LinSpaced(count, -1.0 / 3, 2.0 / 7);
  out.q.resize(scene.model.nq(), count);
  for (MatrixX<double>* rows : {&out.qd, &out.qdd, &out.tau}) rows->resize(scene.model.nv(), count);
  for (int i = 0; i < count; ++i) {
    out.q.col(i) = states[i].q;
    out.qd.col(i) = states[i].qd;
    out.qdd.col(i) = states[count + i].qd * 1e-300;
    out.tau.col(i) = states[i].tau;
  }
  return out;
}

void expect_same(const Samples& a, const Samples& b) {
  EXPECT_EQ(a.time, b.time);
  EXPECT_EQ(a.q, b.q);
  EXPECT_EQ(a.tau, b.tau);
  ASSERT_EQ(a.has_velocities(), b.has_velocities());
  ASSERT_EQ(a.has_accelerations(), b.has_accelerations());
  if (a.has_velocities()) {
    EXPECT_EQ(a.qd, b.qd);
  }
  if (a.has_accelerations()) {
    EXPECT_EQ(a.qdd, b.qdd);
  }
}

TEST(Samples, WhatIsWrittenIsReadBackToTheBit) {
  for (const char* robot : {"two_link", "panda", "go2", "tree:5"}) {
    const Scene scene = load_scene(robot);
    Samples samples = random_samples(scene, 20);
    expect_same(samples, read_text(scene, to_csv(scene, samples)));
    samples.qdd.resize(0, 0);
    expect_same(samples, read_text(scene, to_csv(scene, samples)));
    samples.qd.resize(0, 0);
    expect_same(samples, read_text(scene, to_csv(scene, samples)));
  }
}

TEST(Samples, NamesOfAFreeJointsPositions) {
  const std::vector<std::string> names = position_names(load_scene("go2").model);
  const std::vector<std::string> base(names.begin(), names.begin() + 8);
  EXPECT_EQ(base, (std::vector<std::string>{"base_joint:x", "base_joint:y", "base_joint:z",
                                            "base_joint:r:qw", "base_joint:r:qx", "base_joint:r:qy",
                                            "base_joint:r:qz", "FL_hip_joint"}));
}

TEST(Samples, AStateIsOneColumn) {
  const Scene scene = load_scene("two_link");
  const Samples samples = random_samples(scene, 3);
  EXPECT_EQ(samples.state(1).qd, samples.qd.col(1));
  EXPECT_EQ(samples.state(2).tau, samples.tau.col(2));
}

constexpr const char* header = "time,q:joint1,q:joint2,qd:joint1,qd:joint2,tau:joint1,tau:joint2";

std::string two_link(const std::string& first, const std::string& second) {
  return std::string(header) + "\n" + first + "\n" + second + "\n";
}

constexpr const char *line2 = "0,1,2,3,4,5,6", *line3 = ".5,7,8,9,10,11,12";

TEST(Samples, ColumnsComeInAnyOrderAmongOthers) {
  const Scene scene = load_scene("two_link");
  const Samples samples =
      read_text(scene,
                "tau:joint2, note ,q:joint2,\"time\",qd:joint1,q:joint1,tau:joint1,qd:joint2\r\n"
                "6,slow,2,0,3,1,5,4\r\n"
                "\r\n"
                "12,\"fast, then slow\",8,+.5, 9 ,7,\"11\",1e1");
  expect_same(samples, read_text(scene, two_link(line2, line3)));
  EXPECT_EQ(samples.q(1, 1), 8);
  EXPECT_EQ(samples.tau(0, 0), 5);
}

TEST(Samples, QuaternionsAreNormalised) {
  const Scene scene = load_scene("go2");
  Samples samples = random_samples(scene, 3);
  const Samples unit = samples;
  samples.q.col(1).segment<4>(3) *= 2;
  const Samples back = read_text(scene, to_csv(scene, samples));
  EXPECT_EQ(back.normalized, 1);
  EXPECT_LT((back.q - unit.q).norm(), 1e-15);
  samples.q.col(1).segment<4>(3).setZero();
  try {
    read_text(scene, to_csv(scene, samples));
    ADD_FAILURE() << "was accepted";
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("line 3: the quaternion of 'base_joint:r:x'"),
              std::string::npos)
        << e.what();
  }
}

// The whole message after the file's name.
void expect_refused(const std::string& text, const std::string& message) {
  static const Scene scene = load_scene("two_link");
  const TemporaryFile file(text, ".csv");
  try {
    read_samples(scene, file.path());
    ADD_FAILURE() << "was accepted: " << text;
  } catch (const InputError& e) {
    EXPECT_EQ(e.what(), file.path() + ": " + message);
  }
}

TEST(BadSamples, NoFile) {
  EXPECT_THROW(read_samples(load_scene("two_link"), "nowhere.csv"), InputError);
}

TEST(BadSamples, TooFew) {
  expect_refused("", "0 samples, at least two are needed");
  expect_refused(header, "0 samples, at least two are needed");
  expect_refused(std::string(header) + "\n" + line2, "1 samples, at least two are needed");
}

TEST(BadSamples, MissingColumnNamesTheNearest) {
  expect_refused("time,q:joint1,q:joint2,qd:joint1,qd:joint2,tau:joint1,tau_joint2\n",
                 "line 1: no column 'tau:joint2'; the nearest is 'tau_joint2'");
  expect_refused("t,q:joint1,q:joint2,qd:joint1,qd:joint2,tau:joint1,tau:joint2\n",
                 "line 1: no column 'time'; the nearest is 't'");
}

TEST(BadSamples, AccelerationsOfSomeJointsOnly) {
  expect_refused(std::string(header) + ",qdd:joint1\n", "line 1: no column 'qdd:joint2'");
}

TEST(BadSamples, VelocitiesOfSomeJointsOnly) {
  expect_refused("time,q:joint1,q:joint2,qd:joint1,tau:joint1,tau:joint2\n",
                 "line 1: no column 'qd:joint2'");
  expect_refused("time,q:joint1,q:joint2,qdd:joint1,qdd:joint2,tau:joint1,tau:joint2\n",
                 "line 1: no column 'qd:joint1'");
}

TEST(BadSamples, DoubledColumn) {
  expect_refused(std::string(header) + ",q:joint2\n", "line 1: two columns 'q:joint2'");
}

TEST(BadSamples, ColumnOfAJointThatTheRobotDoesNotHave) {
  expect_refused(std::string(header) + ",tau:joint3\n",
                 "line 1: column 'tau:joint3' is of no joint of the robot; the nearest is "
                 "'tau:joint1'");
}

TEST(BadSamples, NumberOfFields) {
  expect_refused(two_link(line2, "1,2,3"), "line 3: 3 fields, the header has 7");
  expect_refused(two_link(line2, "\n\n.5,7,8,9,10,11,12,13"), "line 5: 8 fields, the header has 7");
}

TEST(BadSamples, NoFiniteNumber) {
  for (const std::string word :
       {"nan", "inf", "-inf", "", "x", "1e999", "0x10", "1 2", "1.5f", "+-1"})
    expect_refused(two_link(line2, ".5,7,8," + word + ",10,11,12"),
                   "line 3, column 'qd:joint1': '" + word + "' is not a finite number");
}

TEST(BadSamples, TimeThatDoesNotIncrease) {
  expect_refused(two_link(line2, "0,7,8,9,10,11,12"),
                 "line 3: time 0 is not after the time before it, 0");
  expect_refused(two_link(line3, line2), "line 3: time 0 is not after the time before it, 0.5");
}

TEST(BadSamples, OpenQuote) {
  expect_refused(two_link(line2, ".5,7,8,9,\"10,11,12"),
                 "line 3: a quote is not closed, or stands inside a field");
}

}  // namespace
}  // namespace kalmarm
