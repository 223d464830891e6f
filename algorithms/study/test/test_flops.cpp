// Flops that the fast path promises, counted by the scalar Count: all that is instantiated for it.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "algorithms/fast/derivatives/derivatives.hpp"
#include "algorithms/fast/factors/lambda.hpp"
#include "algorithms/fast/factors/solve.hpp"
#include "algorithms/fast/rigid/inverse_dynamics.hpp"
#include "algorithms/fast/rigid/mass.hpp"
#include "algorithms/fast/test/zero_terms_support.hpp"
#include "algorithms/study/flops/counted.hpp"

namespace kalmarm::test {
namespace {

using detail::counted;
using detail::counts;

struct Counted {
  LoweredModel<double> model;
  std::vector<Count> q, qd, tau, out;  // tau or qdd

  explicit Counted(const Model<double>& drawn) : model(drawn), out(drawn.nv()) {
    const State<double> state = random_state(drawn, 3);
    q = counts(state.q);
    qd = counts(state.qd);
    tau = counts(state.tau);
  }
};

void expect_between(double least, double flops, double most, const std::string& what) {
  EXPECT_GE(flops, least) << what << ": does it count?";
  EXPECT_LE(flops, most) << what;
  testing::Test::RecordProperty(what, std::to_string(flops));
}

template <class F>
double flops_per_joint(const Model<double>& model) {
  const State<double> state = random_state(model, 3);
  return acceleration_flops<F>(model, state.q, state.qd, state.tau) / model.nv();
}

// What the test of D (rounding_test.hpp) takes of a link that can lose one in some position: 15 for (1) with what
// is pending, 4 for traces, 3 for h, 16 for (2), 2 for (3) and 3 across the link. Of the chain of 31 two have to be tested
// where D has to be right to 2e-9.
double of_test(const Model<double>& model) {
  const LoweredModel<double> lowered(model);
  double tested = 0;
  for (int k = 0; k < lowered.nv(); ++k) tested += lowered.body(k).weights.tested;
  return 43 * tested / lowered.nv();
}

TEST(ForwardDynamicsFlops, HingeOfAChainCostsAtMost480) {
  for (int n : {7, 31, 100}) {
    const Model<double> model = chain(1, n);
    expect_between(350, flops_per_joint<CovarianceForm>(model), 480 + of_test(model),
                   "flops_" + std::to_string(n));
  }
  EXPECT_LE(of_test(chain(1, 31)), 2 * 43.0 / 31);
  EXPECT_LE(flops_per_joint<CovarianceForm>(nearly_parallel(1e-5)), 480);
}

// Crossed at once; its six DoF one by one took 1340.
TEST(ForwardDynamicsFlops, FreeJointCostsAtMost826) {
  Random random(5);
  Builder builder;
  builder.add_free(random_joint(random, -1));
  expect_between(400, 6 * flops_per_joint<CovarianceForm>(builder.build()), 826, "free_joint");
}

TEST(ForwardDynamicsFlops, HingeOfAChainAtRestCostsAtMost320) {
  for (int n : {31, 100}) {
    const Model<double> model = chain(1, n);
    expect_between(230, flops_per_joint<AtRest>(model), 320 + of_test(model),
                   "flops_" + std::to_string(n));
  }
}

TEST(ForwardDynamicsFlops, ZeroTermsCostNone) {
  const double any = flops_per_joint<CovarianceForm>(chain(1, 31));
  const double offset = flops_per_joint<CovarianceForm>(chain_of(right, {0.3, 0.4, 0.5}, 31));
  const double meeting = flops_per_joint<CovarianceForm>(chain_of(right, {0, 0, 0.5}, 31));
  EXPECT_LE(offset, any - 60);
  EXPECT_LE(meeting, any - 90);
  RecordProperty("flops_any", std::to_string(any));
  RecordProperty("flops_right_angles", std::to_string(offset));
  RecordProperty("flops_meeting", std::to_string(meeting));
}

// N, T and the scales of joints where no constant of the robot is known, beside N by constants.
TEST(ForwardDynamicsFlops, RoundingThatDependsOnTheStateCostsAtMost60ALink) {
  Counted at(massless_links(1));
  CovarianceWorkspace<Count> ws(at.model);
  const auto flops = [&] {
    return counted([&] {
      covariance_acceleration(at.model, at.q.data(), at.qd.data(), at.tau.data(), ws,
                              at.out.data());
    });
  };
  ASSERT_TRUE(ws.forces);
  const double by_state = flops();
  ws.forces.reset();
  expect_between(30, (by_state - flops()) / at.model.nv(), 60, "flops_a_link");
}

// One sweep after another; the filter beside that of the factors, which carries no forces.
struct Stages {
  double placements, velocity, covariance, forces, test_of_forces, smoother;

  explicit Stages(const Model<double>& drawn) {
    Counted at(drawn);
    const LoweredModel<double>& model = at.model;
    CovarianceWorkspace<Count> ws(model);
    FastFactors<Count> factors(model);
    placements = counted([&] { detail::set_placements(model, at.q.data(), ws); });
    velocity = counted([&] { detail::set_velocity(model, at.qd.data(), ws); });
    const double filter = counted([&] {
      detail::filter_forces(model, ws,
                            detail::BiasedForces<Count, double>{model, at.tau.data(), ws});
    });
    smoother = counted([&] { detail::smooth(model, ws, at.out.data()); });
    covariance = counted([&] { covariance_factor(model, at.q.data(), factors); }) - placements;
    test_of_forces = counted([&] { force_noise(model, ws.z); });
    forces = filter - covariance - test_of_forces;
  }
};

TEST(ForwardDynamicsFlops, StagesOfAHingeCostWhatIsSaid) {
  constexpr int n = 24;
  const Model<double> model = chain(1, n);
  const Stages stages(model);
  const State<double> state = random_state(model, 3);
  EXPECT_EQ(stages.placements + stages.velocity + stages.covariance + stages.forces +
                stages.test_of_forces + stages.smoother,
            acceleration_flops<CovarianceForm>(model, state.q, state.qd, state.tau));
  const auto expect = [](double said, double flops, const char* what) {
    expect_between(0.9 * said, flops / n, said, what);
  };
  expect(1, stages.placements, "placements");
  expect(48, stages.velocity, "velocity");
  expect(190, stages.covariance, "covariance");
  expect(155, stages.forces, "forces");
  expect(18, stages.test_of_forces, "test_of_forces");
  expect(75, stages.smoother, "smoother");
}

TEST(InverseDynamicsFlops, HingeOfAChainCostsAtMost200) {
  for (int n : {7, 31, 100}) {
    Counted at(chain(1, n));
    InverseDynamicsWorkspace<Count> ws(at.model);
    const double flops = counted([&] {
      fast_inverse_dynamics(at.model, at.q.data(), at.qd.data(), at.tau.data(), ws, at.out.data());
    });
    expect_between(120, flops / n, 200, "flops_" + std::to_string(n));
  }
}

TEST(InverseMassFlops, HingeOfAChainCostsNoMoreThanIsSaid) {
  for (int n : {31, 100}) {
    const Counted at(chain(1, n));
    const LoweredModel<double>& model = at.model;
    const std::vector<char> all(n, 1);
    FastFactors<Count> factors(model);
    ColumnsWorkspace<Count> ws(model);
    LambdaWorkspace<Count> lambda(model);
    CompositeForces<Count> composite(model);
    const auto expect = [n](double least, double most, const char* what, const auto& work) {
      expect_between(least, counted(work) / n, most, what);
    };
    expect(150, 210, "factor", [&] { covariance_factor(model, at.q.data(), factors); });
    expect(50, 95, "columns", [&] {
      detail::sweep_inward(
          model, factors, n - 1, all.data(), [](int) { return Count(1); }, ws);
      detail::sweep_outward(model, factors, n - 1, ws, [](int, const Count&) {});
    });
    expect(85, 135, "solve_watched", [&] {
      auto forces = detail::forces_of<Count>(model);
      detail::solve(
          model, factors, all.data(), [](int) { return Count(1); }, ws, forces,
          [](int, const Count&) {});
    });
    expect(200, 270, "lambda", [&] { fast_lambda(model, factors, lambda); });
    expect(50, 110, "composite", [&] { composite_forces(model, at.q.data(), composite); });
    expect(15, 36, "mass_entry", [&] {
      detail::sweep_composite_forces(
          model, composite, n - 1, n - 1, all.data(), [](int) { return Count(1); }, ws);
    });
  }
}

// (2) with (4), (3), and what a load at the tip of eight hinges adds to forward dynamics.
TEST(LoadFlops, AreWhatIsSaid) {
  constexpr int n = 8;
  const Model<double> drawn = chain(1, n);
  const LoweredModel<double> model(drawn, Zeros::left_out,
                                   accepted_error(default_tolerance<double>),
                                   {{}, {}, {{n - 1, {1, 0.2, 0.3, 0}, {0.1, 0, 0.2}}}});
  std::vector<Count> pi(numbers_of_load, Count(1));
  Load<Count> load;
  const double placed = counted([&] { load = detail::load_on_link(model.loaded()[0], pi.data()); });
  EXPECT_EQ(placed, 178);
  const Triple<Count> w = {Count(1), Count(2), Count(3)};
  const Sixfold<Count> a = {Count(1), Count(2), Count(3), Count(4), Count(5), Count(6)};
  Sixfold<Count> z = a;
  EXPECT_EQ(counted([&] { detail::add_force_of_load(load.body, w, a, z); }), 96);

  Counted at(drawn);
  CovarianceWorkspace<Count> ws(model);
  const auto flops = [&](const Acting<Count>& acting) {
    return counted([&] {
      covariance_acceleration(model, at.q.data(), at.qd.data(), at.tau.data(), ws, at.out.data(),
                              acting);
    });
  };
  expect_between(placed + 60, flops({.loads = pi.data()}) - flops({}), 320, "flops_a_load");
}

// Joint by joint, and then for every pair of joints of a chain.
TEST(DerivativeFlops, GrowAsTheirEquationsSay) {
  const auto flops = [](int n) {
    Counted at(chain(1, n));
    DerivativeWorkspace<Count> ws(at.model);
    std::vector<Count> dq(n * n, 0), dqd = dq, dtau = dq;
    return counted([&] {
      fast_derivatives(at.model, at.q.data(), at.qd.data(), at.tau.data(), ws, dq.data(),
                       dqd.data(), dtau.data(), at.out.data());
    });
  };
  const double small = flops(40), large = flops(80);
  const double pairs = (large - 2 * small) / (80 * 80 - 2 * 40 * 40);
  const double joints = small / 40 - 40 * pairs;
  expect_between(80, pairs, 140, "flops_a_pair");
  expect_between(0, joints, 1400, "flops_a_joint");
}

}  // namespace
}  // namespace kalmarm::test
