// Every genome is a mechanism that can be, and its file gives it again.
#include <gtest/gtest.h>

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/uniform_real_distribution.hpp>
#include <cmath>
#include <map>
#include <numbers>

#include "accuracy/adversary/record.hpp"
#include "algorithms/fast/translational/translational.hpp"
#include "robots/loader/test/temporary_file.hpp"
#include "robots/scene/write_mjcf.hpp"

namespace kalmarm::adversary {
namespace {

Genome drawn(int bodies, boost::random::mt19937_64& random) {
  Genome out{bodies, std::vector<double>(static_cast<std::size_t>(length_of(bodies)))};
  for (double& x : out.x) x = boost::random::uniform_real_distribution<double>(0, 1)(random);
  return out;
}

// Every number at an end of its range, and mechanisms drawn at random.
std::vector<Genome> genomes(int each) {
  std::vector<Genome> out;
  boost::random::mt19937_64 random(1);
  for (int bodies = 1; bodies <= most_dofs; ++bodies) {
    for (const double x : {0.0, 1.0})
      out.push_back({bodies, std::vector<double>(static_cast<std::size_t>(length_of(bodies)), x)});
    for (int i = 0; i < each; ++i) out.push_back(drawn(bodies, random));
  }
  return out;
}

TEST(Genome, IsAMechanismThatCanBe) {
  for (const Genome& genome : genomes(200)) {
    const auto [model, state] = decode(genome);
    ASSERT_GE(model.nv(), genome.bodies);
    ASSERT_LE(model.nv(), most_dofs);
    ASSERT_TRUE(state.q.allFinite() && state.qd.allFinite() && state.tau.allFinite());
    int massive = 0;
    for (int k = 0; k < model.nv(); ++k) {
      const Joint<double>& joint = model.joint(k);
      const Vector3<double>& J = joint.body.moments;
      ASSERT_LT(joint.parent, k);
      ASSERT_GE(joint.r, 0);
      ASSERT_GE(J.minCoeff(), 0);
      ASSERT_LE(J.maxCoeff(), (1 + 1e-15) * (J.sum() - J.maxCoeff()));  // triangle inequality
      ASSERT_NEAR(joint.rotation.norm(), 1, 1e-14);
      ASSERT_NEAR(joint.body.axes.norm(), 1, 1e-14);
      massive += joint.body.mass > 0;
    }
    ASSERT_EQ(massive, genome.bodies);
  }
}

TEST(Genome, DrawsEveryJointTypeAndTrees) {
  int slides = 0, balls = 0, free = 0, branches = 0, noisy = 0, weightless = 0;
  for (const Genome& genome : genomes(200)) {
    const auto [model, state] = decode(genome);
    weightless += model.gravity().isZero();
    for (int k = 0; k < model.nv(); ++k) {
      const Joint<double>& joint = model.joint(k);
      slides += joint.coordinate == Coordinate::distance;
      balls += joint.coordinate == Coordinate::quaternion;
      free += joint.coordinate == Coordinate::position;
      branches += joint.parent >= 0 && joint.parent < k - 1;
      noisy += joint.r > 0;
    }
  }
  for (const int count : {slides, balls, free, branches, noisy, weightless}) EXPECT_GT(count, 20);
}

// Angles of hinges that stand at k quarter turns, and those that are near, beside all others.
TEST(Genome, StandsAtAndBesideEveryQuarterTurn) {
  std::map<int, int> at, near;
  for (const Genome& genome : genomes(1000)) {
    const auto [model, state] = decode(genome);
    for (int k = 0; k < model.nv(); ++k) {
      if (model.joint(k).coordinate != Coordinate::angle) continue;
      const double angle = state.q[model.joint(k).q_index], quarter = std::numbers::pi / 2;
      const int turns = static_cast<int>(std::lround(angle / quarter));
      const double off = std::abs(angle - turns * quarter);
      at[turns] += off == 0;
      near[turns] += off > 0 && off < 1e-2;
    }
  }
  for (int k = -4; k <= 4; ++k) {
    EXPECT_GT(at[k], 50) << k;
    EXPECT_GT(near[k], 50) << k;
  }
  EXPECT_EQ(at.size(), 9);
}

TEST(Genome, OfAKernelIsWhatItAnswers) {
  for (const Genome& genome : genomes(50)) {
    ASSERT_TRUE(is_translational(decode(genome, Kernel::translational).model));
    ASSERT_TRUE(decode(genome, Kernel::spatial_at_rest).state.qd.isZero(0));
  }
}

TEST(Genome, ItsFileGivesTheSameMechanismToTheLastBit) {
  for (const Genome& genome : genomes(20))
    for (const Kernel kernel : {Kernel::spatial, Kernel::translational}) {
      const Mechanism mechanism = decode(genome, kernel);
      const TemporaryFile file(to_mjcf(mechanism.model, "m"), ".xml");
      ASSERT_EQ(difference(load_scene(file.path()).model, mechanism.model), "")
          << to_mjcf(mechanism.model, "m");
    }
}

TEST(Genome, DifferenceNamesWhatDiffers) {
  const Model<double> model = decode(genomes(1)[2]).model;
  std::vector<Joint<double>> joints;
  for (int k = 0; k < model.nv(); ++k) joints.push_back(model.joint(k));
  joints[0].body.com[1] += 1e-300;
  const Model<double> other(joints, model.names(), model.nq(), model.gravity());
  EXPECT_EQ(difference(model, model), "");
  EXPECT_EQ(difference(model, other), "j0: centre of mass");
}

}  // namespace
}  // namespace kalmarm::adversary
