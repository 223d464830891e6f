// Inverse dynamics of the fast path against truth of the world frame, against the forward dynamics
// that it inverts, and against itself in lanes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "algorithms/fast/test/plain_filter.hpp"
#include "algorithms/fast/test/support.hpp"

namespace kalmarm::test {
namespace {

const DynamicsOptions torques = spatial({Want::inverse_dynamics});

// qdd stands in tau of a state.
template <class T>
VectorX<T> fast_torque(const Model<double>& model, const State<T>& state) {
  Dynamics<T> robot = dynamics_of<T>(model, torques);
  VectorX<T> tau = poisoned<T>(model.nv());
  robot.inverse_dynamics(state.q, state.qd, state.tau, tau);
  return tau;
}

template <class T>
void expect_accurate_torques(int seeds) {
  const double u = static_cast<double>(unit_roundoff<T>());
  for (const Family& family : all_families()) {
    double sum = 0, plain_sum = 0, worst = 0;
    for (int seed = 0; seed < seeds; ++seed) {
      const Model<double> drawn = family.make(seed), model = rounded<T>(drawn);
      const State<T> state = random_state(drawn, seed + 1000).cast<T>();
      const Truth truth(model, state.template cast<double>());
      const double error = truth.torque(fast_torque(model, state)) / u;
      const double plain = truth.torque(plain_torque<T>(model, state)) / u;
      EXPECT_LE(error, 110) << family.name << " seed " << seed;
      sum += std::log(error + 0.1);
      plain_sum += std::log(plain + 0.1);
      worst = std::max(worst, error);
    }
    const double ratio = std::exp((sum - plain_sum) / seeds);
    EXPECT_LE(ratio, 1.5) << family.name;
    testing::Test::RecordProperty(std::string(family.name) + "_worst_in_u", std::to_string(worst));
    testing::Test::RecordProperty(std::string(family.name) + "_ratio", std::to_string(ratio));
  }
}

TEST(InverseDynamics, Float64AgreesWithTruthAsWellAsNewtonAndEuler) {
  expect_accurate_torques<double>(40);
}
TEST(InverseDynamics, Float32AgreesWithTruthAsWellAsNewtonAndEuler) {
  expect_accurate_torques<float>(40);
}

TEST(InverseDynamics, ForwardDynamicsGiveTheAccelerationBack) {
  for (const Family& family : all_families()) {
    if (std::string(family.name) == "massless_links") continue;  // M has a large condition there
    const Model<double> model = family.make(5);
    State<double> state = random_state(model, 6);
    const VectorX<double> qdd = state.tau;
    state.tau = fast_torque(model, state);
    Dynamics<double> forward = dynamics_of<double>(model, spatial({Want::acceleration}));
    VectorX<double> a = poisoned<double>(model.nv());
    ASSERT_TRUE(forward.forward_dynamics(state.q, state.qd, state.tau, a));
    EXPECT_LE((a - qdd).norm(), 1e-10 * qdd.norm()) << family.name;
  }
}

template <class T>
class TorqueBatches : public testing::Test {};

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(TorqueBatches, Precisions, PrecisionName);

TYPED_TEST(TorqueBatches, LanesAgreeWithOneStateOnEveryFamily) {
  using T = TypeParam;
  for (const Family& family : all_families())
    for (const int count : {1, 19}) {
      SCOPED_TRACE(family.name);
      const Model<double> drawn = family.make(2);
      const int nv = drawn.nv();
      Rows<T> rows(drawn, count);  // tau of a state is qdd here, a is tau
      Dynamics<T> batch = dynamics_of<T>(drawn, torques);
      rows.inverse_dynamics(batch);
      for (int i = 0; i < count; ++i) {
        const VectorX<T> tau = fast_torque(drawn, random_state(drawn, i).template cast<T>());
        const Eigen::Map<const VectorX<T>> row(&rows.a[i * nv], nv);
        EXPECT_LE((row - tau).norm(), 100 * unit_roundoff<T>() * tau.norm()) << "state " << i;
      }
      for (int i = 0; i < Rows<T>::guard; ++i) EXPECT_EQ(rows.a[count * nv + i], T(-77));
    }
}

}  // namespace
}  // namespace kalmarm::test
