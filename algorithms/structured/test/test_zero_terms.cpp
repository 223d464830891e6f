// Links whose axes are parallel, at a right angle or meet: counted, and left out without a change
// of any result.
#include <gtest/gtest.h>

#include <vector>

#include "algorithms/structured/inverse.hpp"
#include "algorithms/structured/inverse_dynamics.hpp"
#include "algorithms/structured/mass.hpp"
#include "algorithms/structured/test/support.hpp"
#include "algorithms/structured/zero_terms.hpp"

namespace kalmarm::test {
namespace {

const Eigen::Quaterniond same(1, 0, 0, 0), right(1, 1, 0, 0);  // of any length: exact

Joint<double> placed(Random& random, int parent, const Eigen::Quaterniond& rotation,
                     const Vector3<double>& translation) {
  Joint<double> joint = random_joint(random, parent);
  joint.rotation = rotation;
  joint.translation = translation;
  joint.ref = 0;
  return joint;
}

Model<double> chain_of(const Eigen::Quaterniond& rotation, const Vector3<double>& translation,
                       int n) {
  Random random(3);
  Builder builder;
  for (int k = 0; k < n; ++k) builder.add(placed(random, k - 1, rotation, translation));
  return builder.build();
}

// A tree of hinges and slides, one after another or not, with rotors or not, where any term may be
// zero.
Model<double> like_a_robot(std::uint64_t seed) {
  Random random(seed);
  Builder builder;
  const Eigen::Quaterniond rotations[] = {same,         right,        {1, -1, 0, 0},
                                          {0, 1, 0, 0}, {1, 1, 1, 1}, random.quaternion()};
  const Vector3<double> translations[] = {
      {0, 0, 0}, {0.3, 0, 0}, {0, 0, 0.4}, {0, -0.2, 0}, {0.1, 0.2, -0.3}};
  for (int k = 0; k < 12; ++k) {
    const int parent = k < 2 ? k - 1 : k - 1 - random.below(2);
    Joint<double> joint =
        placed(random, parent, rotations[random.below(6)], translations[random.below(5)]);
    if (random.chance(0.2)) {
      joint.coordinate = Coordinate::distance;
      joint.slides = true;
    }
    if (random.chance(0.3)) joint.r = 0.05;
    builder.add(joint);
  }
  return builder.build();
}

void expect_count(const Model<double>& model, const ZeroTerms& right) {
  const ZeroTerms got = count_zero_terms(StructuredModel<double>(model));
  EXPECT_EQ(got.links, right.links);
  EXPECT_EQ(got.parallel, right.parallel);
  EXPECT_EQ(got.right_angles, right.right_angles);
  EXPECT_EQ(got.meeting, right.meeting);
  EXPECT_EQ(got.without_offset, right.without_offset);
}

TEST(ZeroTerms, AreCountedOnMechanismsMadeByHand) {
  {
    SCOPED_TRACE("wrist");
    expect_count(chain_of(right, {0, 0, 0}, 3), {2, 0, 2, 2, 2});
  }
  {
    SCOPED_TRACE("plane");
    expect_count(chain_of(same, {0.5, 0, 0}, 4), {3, 3, 0, 0, 3});
  }
  {
    SCOPED_TRACE("one line");
    expect_count(chain_of(same, {0, 0, 0.5}, 4), {3, 3, 0, 3, 0});
  }
  {
    SCOPED_TRACE("right angles, common perpendiculars");
    expect_count(chain_of(right, {0.5, 0, 0}, 4), {3, 0, 3, 0, 3});
  }
  {
    SCOPED_TRACE("random");
    expect_count(chain(4, 6), {5, 0, 0, 0, 0});
  }
  {
    SCOPED_TRACE("nearly a right angle");
    expect_count(chain_of({1, 1 + 1e-12, 0, 0}, {0.5, 0, 0}, 3), {2, 0, 0, 0, 2});
  }
  {
    SCOPED_TRACE("nearly parallel");  // the cosine is 1, the sine is not 0
    expect_count(chain_of({1, 1e-13, 0, 0}, {0.5, 0, 0}, 3), {2, 0, 0, 0, 2});
  }
  {
    SCOPED_TRACE("antiparallel");
    expect_count(chain_of({0, 1, 0, 0}, {0.5, 0, 0}, 3), {2, 0, 0, 0, 2});
  }
  {
    SCOPED_TRACE("a free joint has none");
    Random random(1);
    Builder builder;
    builder.add_free(random_joint(random, -1));
    expect_count(builder.build(), {0, 0, 0, 0, 0});
  }
}

TEST(ZeroTerms, EquationsHoldInMultiPrecision) {
  for (int seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    const Model<double> drawn = like_a_robot(seed);
    const Model<Mp> model = drawn.cast<Mp>();
    State<Mp> state = random_state(drawn, seed).cast<Mp>();
    const Truth truth(model, state);
    const StructuredModel<Mp> structured(model);
    StructuredWorkspace<Mp> ws(structured);
    VectorX<Mp> a = poisoned<Mp>(model.nv()), tau = a;
    structured_acceleration(structured, state.q.data(), state.qd.data(), state.tau.data(), ws,
                            a.data());
    EXPECT_LE(truth.error(a), 1e-40);
    StructuredInverseDynamics<Mp> inverse(model);
    inverse.inverse_dynamics(state.q, state.qd, a, tau);
    EXPECT_LE((tau - state.tau).norm(), Mp(1e-40) * state.tau.norm());
  }
}

// Also in lanes, whose code is another.
TEST(ZeroTerms, EveryResultHasItsDigits) {
  for (int seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(seed);
    const Model<double> model = like_a_robot(seed);
    const int nv = model.nv();
    const State<double> state = random_state(model, seed);
    const Truth truth(model.cast<Mp>(), state.cast<Mp>());
    const MatrixX<double> M = truth.M.cast<double>();
    VectorX<double> a = poisoned<double>(nv);
    StructuredDynamics<double> one(model);
    ASSERT_TRUE(one.acceleration(state.q, state.qd, state.tau, a));
    EXPECT_LE(truth.error(a), 1e-14);
    std::vector<double> rows(nv);
    Outcome outcome;
    StructuredBatch<double> batch(model);
    EXPECT_EQ(batch.acceleration(1, state.q.data(), state.qd.data(), state.tau.data(), rows.data(),
                                 &outcome),
              0);
    EXPECT_LE(truth.error(Eigen::Map<const VectorX<double>>(rows.data(), nv).eval()), 1e-14);
    StructuredDynamics<double, SquareRootForm> root(model);
    ASSERT_TRUE(root.acceleration(state.q, state.qd, state.tau, a));
    EXPECT_LE(truth.error(a), 1e-14);
    MatrixX<double> X(nv, nv), product;
    StructuredInverse<double> inverse(model);
    ASSERT_TRUE(inverse.inverse(state.q, X));
    product = X * M;
    EXPECT_LE((product - MatrixX<double>::Identity(nv, nv)).norm(), 1e-9);
    StructuredMass<double> mass(model);
    mass.mass(state.q, X);
    EXPECT_LE((X - M).norm(), 1e-14 * M.norm());
  }
}

TEST(ZeroTerms, CostNoFlops) {
  const double any = flops_per_joint<CovarianceForm>(chain(1, 31));
  const double offset = flops_per_joint<CovarianceForm>(chain_of(right, {0.3, 0.4, 0.5}, 31));
  const double meeting = flops_per_joint<CovarianceForm>(chain_of(right, {0, 0, 0.5}, 31));
  EXPECT_LE(offset, any - 60);
  EXPECT_LE(meeting, any - 90);
  RecordProperty("flops_any", std::to_string(any));
  RecordProperty("flops_right_angles", std::to_string(offset));
  RecordProperty("flops_meeting", std::to_string(meeting));
}

}  // namespace
}  // namespace kalmarm::test
