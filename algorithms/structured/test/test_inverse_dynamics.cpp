// Inverse dynamics of the fast path against truth of the world frame, against the forward dynamics
// that it inverts, against itself in lanes, and its flops.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "algorithms/model/inverse_dynamics.hpp"
#include "algorithms/structured/inverse_dynamics.hpp"
#include "algorithms/structured/test/support.hpp"

namespace kalmarm::test {
namespace {

// qdd stands in tau of a state.
template <class T>
VectorX<T> structured_torque(const Model<T>& model, const State<T>& state) {
  StructuredInverseDynamics<T> dynamics(model);
  VectorX<T> tau = poisoned<T>(model.nv());
  dynamics.inverse_dynamics(state.q, state.qd, state.tau, tau);
  return tau;
}

template <class T>
VectorX<T> plain_torque(const Model<T>& model, const State<T>& state) {
  RandomModel<T> rm(model);
  InverseDynamics<T> ws(model);
  VectorX<T> tau = poisoned<T>(model.nv());
  set_position(model, state.q, rm);
  set_velocity(model, state.qd, rm);
  inverse_dynamics(model, rm, state.tau, ws, Eigen::Ref<VectorX<T>>(tau));
  return tau;
}

// An error of tau(k) is measured by sqrt(M(k,k)) (|qdd|_M + |bias|_M^-1), of which |tau(k)| is no
// more.
struct TorqueTruth {
  VectorX<Mp> tau, scale;

  TorqueTruth(const Model<Mp>& model, const State<Mp>& state) {
    const World world(model, state.q, state.qd);
    const MatrixX<Mp> M = world.mass_matrix();
    const VectorX<Mp> bias = world.bias();
    tau = M * state.tau + bias;
    const Mp size = sqrt(Mp(state.tau.dot(M * state.tau))) +
                    sqrt(Mp(bias.dot(Eigen::LDLT<MatrixX<Mp>>(M).solve(bias))));
    scale = size * M.diagonal().cwiseSqrt();
  }

  template <class T>
  double error(const VectorX<T>& x) const {
    const VectorX<Mp> d = x.template cast<Mp>() - tau;
    return d.cwiseQuotient(scale).cwiseAbs().maxCoeff().template convert_to<double>();
  }
};

template <class T>
void expect_accurate_torques(int seeds) {
  const double u = static_cast<double>(unit_roundoff<T>());
  for (const Family& family : all_families()) {
    double sum = 0, plain_sum = 0, worst = 0;
    for (int seed = 0; seed < seeds; ++seed) {
      const Model<double> drawn = family.make(seed);
      const Model<T> model = drawn.cast<T>();
      const State<T> state = random_state(drawn, seed + 1000).cast<T>();
      const TorqueTruth truth(model.template cast<Mp>(), state.template cast<Mp>());
      const double error = truth.error(structured_torque(model, state)) / u;
      const double plain = truth.error(plain_torque(model, state)) / u;
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

TEST(StructuredInverseDynamics, Float64AgreesWithTruthAsWellAsNewtonAndEuler) {
  expect_accurate_torques<double>(10);
}
TEST(StructuredInverseDynamics, Float32AgreesWithTruthAsWellAsNewtonAndEuler) {
  expect_accurate_torques<float>(10);
}

TEST(StructuredInverseDynamics, EquationsHoldInMultiPrecision) {
  for (const Family& family : all_families()) {
    const Model<double> drawn = family.make(3);
    const Model<Mp> model = drawn.cast<Mp>();
    const State<Mp> state = random_state(drawn, 4).cast<Mp>();
    const TorqueTruth truth(model, state);
    EXPECT_LE(truth.error(structured_torque(model, state)), 1e-43) << family.name;
    EXPECT_LE(truth.error(plain_torque(model, state)), 1e-43) << family.name;
  }
}

TEST(StructuredInverseDynamics, ForwardDynamicsGiveTheAccelerationBack) {
  for (const Family& family : all_families()) {
    if (std::string(family.name) == "massless_links") continue;  // M has a large condition there
    const Model<double> model = family.make(5);
    State<double> state = random_state(model, 6);
    const VectorX<double> qdd = state.tau;
    state.tau = structured_torque(model, state);
    StructuredDynamics<double> forward(model);
    VectorX<double> a = poisoned<double>(model.nv());
    ASSERT_TRUE(forward.acceleration(state.q, state.qd, state.tau, a));
    EXPECT_LE((a - qdd).norm(), 1e-10 * qdd.norm()) << family.name;
  }
}

TEST(StructuredInverseDynamics, HingeOfAChainCostsAtMost200Flops) {
  for (int n : {7, 31, 100}) {
    const Model<double> model = chain(1, n);
    const State<double> state = random_state(model, 3);
    const StructuredModel<double> structured(model);
    InverseDynamicsWorkspace<Count> ws(structured);
    const std::vector<Count> q(state.q.begin(), state.q.end()),
        qd(state.qd.begin(), state.qd.end()), qdd(state.tau.begin(), state.tau.end());
    std::vector<Count> tau(n);
    Count::flops = 0;
    structured_inverse_dynamics(structured, q.data(), qd.data(), qdd.data(), ws, tau.data());
    const double flops = static_cast<double>(Count::flops) / n;
    EXPECT_LE(flops, 200) << n;
    EXPECT_GE(flops, 120) << n << ": does it count?";
    RecordProperty("flops_" + std::to_string(n), std::to_string(flops));
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
      const Model<T> model = drawn.cast<T>();
      const int nv = model.nv();
      Rows<T> rows(drawn, count);  // tau of a state is qdd here, a is tau
      StructuredInverseDynamicsBatch<T> batch(model);
      batch.inverse_dynamics(count, rows.q.data(), rows.qd.data(), rows.tau.data(), rows.a.data());
      for (int i = 0; i < count; ++i) {
        const VectorX<T> tau = structured_torque(model, random_state(drawn, i).template cast<T>());
        const Eigen::Map<const VectorX<T>> row(&rows.a[i * nv], nv);
        EXPECT_LE((row - tau).norm(), 100 * unit_roundoff<T>() * tau.norm()) << "state " << i;
      }
      for (int i = 0; i < Rows<T>::guard; ++i) EXPECT_EQ(rows.a[count * nv + i], T(-77));
    }
}

}  // namespace
}  // namespace kalmarm::test
