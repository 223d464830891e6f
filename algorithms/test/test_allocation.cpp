// Nothing in the timed path allocates.
#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <vector>

#include "algorithms/derivatives/acceleration_jacobian.hpp"
#include "algorithms/derivatives/factor_gradient.hpp"
#include "algorithms/derivatives/innovation_jacobian.hpp"
#include "algorithms/derivatives/mass_jacobian.hpp"
#include "algorithms/inverse_mass/sequential.hpp"
#include "algorithms/riccati/conventional.hpp"
#include "algorithms/solver.hpp"
#include "algorithms/structured/at_rest.hpp"
#include "algorithms/structured/derivatives.hpp"
#include "algorithms/structured/dynamics.hpp"
#include "algorithms/structured/inverse.hpp"
#include "algorithms/structured/inverse_dynamics.hpp"
#include "algorithms/structured/mass.hpp"
#include "algorithms/test/allocations.hpp"
#include "algorithms/test/models.hpp"

namespace kalmarm::test {
namespace {

template <class F>
long allocations_of(const F& f) {
  const long before = allocations;
  f();
  return allocations - before;
}

TEST(Counter, SeesEveryWayToAllocate) {
  EXPECT_GE(allocations_of([] { delete new int volatile(1); }), 1);
  EXPECT_GE(allocations_of([] { std::free(std::aligned_alloc(64, 64)); }), 1);
  EXPECT_GE(allocations_of([] { MatrixX<double>(40, 40).setZero(); }), 1);
  EXPECT_EQ(allocations_of([] {}), 0);
}

template <class T>
class Allocation : public testing::Test {};

struct PrecisionName {
  template <class T>
  static std::string GetName(int) {
    return std::is_same_v<T, float> ? "float32" : "float64";
  }
};

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Allocation, Precisions, PrecisionName);

TYPED_TEST(Allocation, SolversAllocateOnlyBeforeTheirSecondCall) {
  for (const int n : {36, 200})
    for (const RegisteredVariant<TypeParam>& variant : registered_variants<TypeParam>()) {
      SCOPED_TRACE(variant.name + " on chain:" + std::to_string(n));
      const Model<double> parameters = chain(61, n);
      const Model<TypeParam> model = parameters.template cast<TypeParam>();
      const State<TypeParam> state = random_state(parameters, 62).template cast<TypeParam>();
      const std::unique_ptr<Solver<TypeParam>> solver = variant.make(model);
      VectorX<TypeParam> a(n);
      MatrixX<TypeParam> X(n, n);
      Outcome solved, inverted;
      const auto solve = [&] { solved = solver->acceleration(state.q, state.qd, state.tau, a); };
      const auto invert = [&] { inverted = solver->inverse(state.q, X); };
      solve();
      invert();
      EXPECT_EQ(allocations_of(solve), 0) << "acceleration";
      EXPECT_EQ(allocations_of(invert), 0) << "inverse";
      EXPECT_TRUE(solved && inverted);
    }
}

template <class T, class Form>
void expect_no_allocation_once_made() {
  constexpr int count = 19;
  const Model<double> parameters = floating_base(61);
  const Model<T> model = parameters.template cast<T>();
  const State<T> state = random_state(parameters, 62).template cast<T>();
  const int nq = model.nq(), nv = model.nv();
  VectorX<T> q = state.q.replicate(count, 1), qd = state.qd.replicate(count, 1);
  VectorX<T> tau = state.tau.replicate(count, 1), a(nv), rows(count * nv);
  q[3 * nq] = std::numeric_limits<T>::quiet_NaN();  // judged in full
  std::vector<Outcome> outcomes(count);
  StructuredDynamics<T, Form> one(model);
  StructuredBatch<T, Form> batch(model);
  Outcome solved;
  int failed = 0;
  EXPECT_EQ(allocations_of([&] { solved = one.acceleration(state.q, state.qd, state.tau, a); }), 0);
  EXPECT_EQ(allocations_of([&] {
              failed = batch.acceleration(count, q.data(), qd.data(), tau.data(), rows.data(),
                                          outcomes.data());
            }),
            0);
  EXPECT_TRUE(solved);
  EXPECT_EQ(failed, 1);
}

TYPED_TEST(Allocation, StructuredDynamicsAllocatesOnlyWhenItIsMade) {
  expect_no_allocation_once_made<TypeParam, CovarianceForm>();
  expect_no_allocation_once_made<TypeParam, SquareRootForm>();
  expect_no_allocation_once_made<TypeParam, AtRest>();
}

TYPED_TEST(Allocation, StructuredInverseDynamicsAllocateOnlyWhenTheyAreMade) {
  using T = TypeParam;
  const Model<double> parameters = floating_base(61);
  const Model<T> model = parameters.template cast<T>();
  const State<T> state = random_state(parameters, 62).template cast<T>();
  VectorX<T> tau(model.nv()), row = tau;
  StructuredInverseDynamics<T> one(model);
  StructuredInverseDynamicsBatch<T> batch(model);
  EXPECT_EQ(allocations_of([&] {
              one.inverse_dynamics(state.q, state.qd, state.tau, tau);
              batch.inverse_dynamics(1, state.q.data(), state.qd.data(), state.tau.data(),
                                     row.data());
            }),
            0);
}

TYPED_TEST(Allocation, StructuredInverseAndMassAllocateOnlyWhenTheyAreMade) {
  using T = TypeParam;
  for (const Model<double>& parameters : {floating_base(61), chain(61, 36), chain(61, 200)}) {
    const Model<T> model = parameters.cast<T>();
    const int nv = model.nv();
    const State<T> state = random_state(parameters, 62).template cast<T>();
    StructuredInverse<T> inverse(model);
    StructuredMass<T> mass(model);
    VectorX<T> x(nv);
    MatrixX<T> X(nv, nv), taus = state.tau.replicate(1, 19), xs(nv, 19);
    Outcome inverted, factored;
    EXPECT_EQ(allocations_of([&] { inverted = inverse.inverse(state.q, X); }), 0);
    EXPECT_EQ(allocations_of([&] { factored = inverse.factor(state.q); }), 0);
    EXPECT_EQ(allocations_of([&] { inverse.solve(state.tau, x); }), 0);
    EXPECT_EQ(allocations_of([&] { inverse.solve(taus, xs); }), 0);
    EXPECT_EQ(allocations_of([&] { inverse.diagonal(x); }), 0);
    Outcome of_diagonal, of_log_det, of_selected;
    T log_det = T(0);
    const Selection<T> selection{{0, nv - 1, nv / 2}, {Site<T>{nv - 1}, Site<T>{nv / 2}}};
    inverse.select(selection);
    MatrixX<T> block(selection.size(), selection.size());
    EXPECT_EQ(allocations_of([&] { of_diagonal = inverse.diagonal(state.q, x); }), 0);
    EXPECT_EQ(allocations_of([&] { of_log_det = inverse.log_det(state.q, log_det); }), 0);
    EXPECT_EQ(allocations_of([&] { of_selected = inverse.selected(state.q, block); }), 0);
    EXPECT_TRUE(of_diagonal && of_log_det && of_selected);
    EXPECT_EQ(allocations_of([&] { mass.mass(state.q, X); }), 0);
    EXPECT_TRUE(inverted && factored);
  }
}

TYPED_TEST(Allocation, StructuredDerivativesAllocateOnlyWhenTheyAreMade) {
  using T = TypeParam;
  for (const Model<double>& parameters : {floating_base(61), chain(61, 53)}) {
    const Model<T> model = parameters.template cast<T>();
    const State<T> state = random_state(parameters, 62).template cast<T>();
    StructuredDerivatives<T> solver(model);
    MatrixX<T> dq(model.nv(), model.nv()), dqd = dq, dtau = dq;
    VectorX<T> a(model.nv());
    Outcome outcome;
    EXPECT_EQ(allocations_of([&] {
                outcome = solver.derivatives(state.q, state.qd, state.tau, dq, dqd, dtau, a);
              }),
              0);
    EXPECT_TRUE(outcome);
  }
}

TYPED_TEST(Allocation, ParameterDerivativesAllocateOnlyTheirWorkspaces) {
  using T = TypeParam;
  for (const Model<double>& parameters : {floating_base(61), chain(61, 36)}) {
    const Model<T> model = parameters.template cast<T>();
    const State<T> state = random_state(parameters, 62).template cast<T>();
    const int nv = model.nv();
    RandomModel<T> rm(model);
    set_position(model, state.q, rm);
    set_velocity(model, state.qd, rm);
    typename Sequential<Conventional>::template Workspace<T> ws(model);
    ASSERT_TRUE(factor(model, rm, ws.factors));
    VectorX<T> a(nv), w(nv);
    Sequential<Conventional>::acceleration(model, rm, state.tau, ws, a);

    RowMatrixX<T> by_theta(nv, body_parameters * nv), by_r(nv, nv), by_tau(nv, nv);
    RowMatrixX<T> M_by_theta(lower_triangle_size(nv), by_theta.cols());
    RowMatrixX<T> M_by_r(M_by_theta.rows(), nv);
    Regressor<T> regressor_ws(model);
    AccelerationJacobian<T> acceleration_ws(model);
    Innovations<T> innovation_ws(model);
    InnovationJacobian<T> jacobian_ws(model);
    MassJacobian<T> mass_ws(model);
    const ParameterVector<T> direction(model);
    FactorDirection<T> forward(model);
    const FactorAdjoint<T> adjoint(model);
    FactorGradient<T> reverse(model);
    ParameterVector<T> gradient(model);
    const long count = allocations_of([&] {
      regressor(model, rm, a, regressor_ws, by_theta);
      acceleration_jacobian(model, rm, ws.factors, a, acceleration_ws, by_theta, by_r, by_tau);
      innovations(model, rm, ws.factors, a, state.tau, innovation_ws, w);
      innovation_jacobian(model, rm, ws.factors, a, innovation_ws.sweeps.e, jacobian_ws, by_theta,
                          by_r, by_tau);
      mass_jacobian(model, rm, mass_ws, M_by_theta, M_by_r);
      factor_direction(model, rm, ws.factors, ws.sweeps, a, direction, forward);
      factor_gradient(model, rm, ws.factors, ws.sweeps, a, adjoint, reverse, gradient);
    });
    EXPECT_EQ(count, 0);
  }
}

}  // namespace
}  // namespace kalmarm::test
