// Angles of any size through the door, by every form and precision, in one state and in rows: as
// accurate as where nothing has turned yet.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "algorithms/dynamics/test/door_support.hpp"

namespace kalmarm::test {
namespace {

// Sizes of angles, by their decimal logarithms.
struct Sizes {
  double least, largest;
};

// Some hinges of every state at angles of such a size.
template <class T>
State<T> far_state(const Model<double>& model, std::uint64_t seed, const Sizes& sizes) {
  Random random(seed);
  State<double> state = random_state(model, seed);
  for (int k = 0; k < model.nv(); ++k)
    if (model.joint(k).coordinate == Coordinate::angle && random.chance(0.6))
      state.q[model.joint(k).q_index] *= std::pow(10, random.uniform(sizes.least, sizes.largest));
  return state.template cast<T>();
}

template <class T>
class FarAngles : public testing::Test {
 protected:
  static constexpr double u = std::is_same_v<T, float> ? 0x1p-24 : 0x1p-53;

  // The worst error of a row, and of one state at a time, in units of u.
  static double worst(const Model<double>& drawn, const DynamicsOptions& options,
                      const Sizes& sizes) {
    const Model<double> model = rounded<T>(drawn);
    const int nv = model.nv(), count = 17;  // more than a pack of any precision
    Dynamics<T> robot = dynamics_of<T>(model, options);
    std::vector<T> q, qd, tau, a(count * nv, std::numeric_limits<T>::quiet_NaN());
    std::vector<Truth> truths;
    double worst = 0;
    for (int i = 0; i < count; ++i) {
      const State<T> state =
          i % 3 == 2 ? random_state(drawn, i).template cast<T>() : far_state<T>(drawn, i, sizes);
      q.insert(q.end(), state.q.begin(), state.q.end());
      qd.insert(qd.end(), state.qd.begin(), state.qd.end());
      tau.insert(tau.end(), state.tau.begin(), state.tau.end());
      truths.emplace_back(model, state.template cast<double>());
      VectorX<T> one = poisoned<T>(nv);
      const Outcome out = robot.forward_dynamics(state.q, state.qd, state.tau, one);
      EXPECT_TRUE(out) << to_string(out.status);
      EXPECT_FALSE(out.warns());
      worst = std::max(worst, truths.back().acceleration(one) / u);
    }
    std::vector<Outcome> outcomes(count);
    EXPECT_EQ(robot.forward_dynamics(q, qd, tau, RowsView<T>(a.data(), count, nv), outcomes, 1), 0);
    for (int i = 0; i < count; ++i)
      worst = std::max(
          worst,
          truths[i].acceleration(VectorX<T>(Eigen::Map<const VectorX<T>>(&a[i * nv], nv))) / u);
    return worst;
  }
};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(FarAngles, Precisions, PrecisionName);

// The bound of ordinary angles in test_forward_dynamics.cpp. Beyond 2^20 quarters of a turn, 2^13 in
// float, every angle is reduced exactly; nearer, angle and offset of a hinge are summed first, as if
// q were off by half a unit in its last place.
TYPED_TEST(FarAngles, AccelerationsAreAsAccurateAsElsewhere) {
  const Sizes sizes = std::is_same_v<TypeParam, float> ? Sizes{4.7, 37} : Sizes{6.8, 300};
  for (const Family& family : {Family{"chain", [](std::uint64_t seed) { return chain(seed); }},
                               {"tree", tree},
                               {"floating_base", [](std::uint64_t s) { return floating_base(s); }},
                               {"creature", creature},
                               {"planar_two_link", planar_two_link},
                               {"planar_chain", [](std::uint64_t s) { return planar_chain(s); }},
                               {"planar_tree", planar_tree}})
    for (const Tolerance tolerance : tolerances)
      EXPECT_LE(this->worst(family.make(3), {.tolerance = tolerance}, sizes), 110)
          << family.name << " " << name_of(tolerance);
}

TYPED_TEST(FarAngles, ThatAreNotFiniteAreSaidToBe) {
  using T = TypeParam;
  for (const Model<double>& model : {chain(3), planar_chain(3)})
    for (const Tolerance tolerance : tolerances)
      for (const T x : {std::numeric_limits<T>::infinity(), std::numeric_limits<T>::quiet_NaN()}) {
        Dynamics<T> robot = dynamics_of<T>(model, {.tolerance = tolerance});
        State<T> state = random_state(model, 1).template cast<T>();
        state.q[2] = x;
        VectorX<T> a = poisoned<T>(model.nv());
        EXPECT_EQ(robot.forward_dynamics(state.q, state.qd, state.tau, a).status,
                  Outcome::Status::not_finite)
            << name_of(tolerance) << " " << x;
      }
}

// One state and rows alike: the answer at the quaternion of unit length, or a refusal.
TYPED_TEST(FarAngles, QuaternionsWhoseSquareOverflowsAreNoOtherTurn) {
  using T = TypeParam;
  const Model<double> model = floating_base(1);
  const int nv = model.nv(), count = 3;
  Dynamics<T> robot = dynamics_of<T>(model, {});
  const State<T> state = random_state(model, 1).template cast<T>();
  State<T> far = state;
  for (int k = 0; k < nv; ++k)
    if (model.joint(k).coordinate == Coordinate::quaternion)
      for (int i = 0; i < 4; ++i)
        far.q[model.joint(k).q_index + i] *= std::sqrt(std::numeric_limits<T>::max()) * T(2);
  VectorX<T> a = poisoned<T>(nv), b = poisoned<T>(nv);
  ASSERT_TRUE(robot.forward_dynamics(state.q, state.qd, state.tau, a));
  const auto is_right = [&](const Outcome& outcome, const VectorX<T>& x) {
    if (outcome.status == Outcome::Status::not_finite) return true;
    return outcome && (x - a).norm() < T(1e-4) * a.norm();
  };
  EXPECT_TRUE(is_right(robot.forward_dynamics(far.q, far.qd, far.tau, b), b));

  std::vector<T> q, qd, tau, rows(count * nv), M(count * nv * nv);
  std::vector<Outcome> outcomes(count);
  for (int i = 0; i < count; ++i) {
    q.insert(q.end(), far.q.begin(), far.q.end());
    qd.insert(qd.end(), far.qd.begin(), far.qd.end());
    tau.insert(tau.end(), far.tau.begin(), far.tau.end());
  }
  (void)robot.forward_dynamics(q, qd, tau, rows, outcomes);
  for (int i = 0; i < count; ++i)
    EXPECT_TRUE(is_right(outcomes[i], Eigen::Map<const VectorX<T>>(&rows[i * nv], nv))) << i;
  MatrixX<T> right(nv, nv);
  robot.mass(state.q, right);
  (void)robot.mass(q, M, outcomes);
  for (int i = 0; i < count; ++i)
    EXPECT_TRUE(outcomes[i].status == Outcome::Status::not_finite ||
                (Eigen::Map<const MatrixX<T>>(&M[i * nv * nv], nv, nv) - right).norm() <
                    T(1e-4) * right.norm())
        << i;
}

}  // namespace
}  // namespace kalmarm::test
