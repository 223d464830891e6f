// Nothing in the timed path allocates.
#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <memory>
#include <random>
#include <set>
#include <vector>

#include "algorithms/fast/test/mechanisms_that_lose.hpp"
#include "algorithms/fast/test/planar_support.hpp"
#include "algorithms/study/derivatives/acceleration_jacobian.hpp"
#include "algorithms/study/derivatives/factor_gradient.hpp"
#include "algorithms/study/derivatives/innovation_jacobian.hpp"
#include "algorithms/study/derivatives/mass_jacobian.hpp"
#include "algorithms/study/inverse_mass/sequential.hpp"
#include "algorithms/study/riccati/conventional.hpp"
#include "algorithms/study/solver.hpp"
#include "algorithms/test/allocations.hpp"
#include "kalmarm/check.hpp"
#include "kalmarm/configuration.hpp"
#include "kalmarm/constrained_dynamics.hpp"

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

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Allocation, Precisions, PrecisionName);

TYPED_TEST(Allocation, SolversAllocateOnlyBeforeTheirSecondCall) {
  for (const int n : {36, 200})
    for (const RegisteredVariant<TypeParam>& variant : registered_variants<TypeParam>()) {
      if (variant.name == "Rung<generated>") continue;  // evaluates records, which takes memory
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

template <class F>
void expect_none(const char* what, const F& call) {
  EXPECT_EQ(allocations_of(call), 0) << what;
}

// Every rung: answers to the last bits, wrong ones, and of a mechanism that double cannot factor.
TEST(AnswerChecks, AllocateNothingOnceMade) {
  constexpr int count = 19;
  for (const Model<double>& model : {floating_base(61), chain(61, 12), wild(3)}) {
    const int nv = model.nv();
    std::vector<double> q, qd, tau, a(count * nv, 1.0), M(std::size_t(nv) * nv, 1.0);
    for (int i = 0; i < count; ++i) {
      const State<double> state = random_state(model, i);
      q.insert(q.end(), state.q.begin(), state.q.end());
      qd.insert(qd.end(), state.qd.begin(), state.qd.end());
      tau.insert(tau.end(), state.tau.begin(), state.tau.end());
    }
    std::vector<Outcome> outcomes(count);
    std::vector<AnswerError> errors(count);
    Dynamics<double> robot(plain(model));
    (void)robot.forward_dynamics(q, qd, tau, a, outcomes);
    AnswerCheck check(plain(model));
    const State<double> one = random_state(model, 0);
    expect_none("accelerations", [&] { check.forward_dynamics(q, qd, tau, a, errors); });
    expect_none("torques", [&] { check.inverse_dynamics(q, qd, tau, a, errors); });
    expect_none("solves", [&] { check.solve(q, tau, a, errors); });
    expect_none("mass", [&] { (void)check.mass(one.q, M); });
    expect_none("inverse", [&] { (void)check.inverse_mass(one.q, M); });
  }
}

// Every call that the question wants, from the first on, and with leave for what the header says.
template <class T>
void expect_no_allocation_once_made(const Model<double>& model, const DynamicsOptions& options) {
  constexpr int count = 19;
  const State<T> s = random_state(model, 62).template cast<T>();
  Dynamics<T> robot = dynamics_of<T>(model, options);
  const Question& question = options.question;
  const int nq = model.nq(), n = robot.asked(), rows = 6 * static_cast<int>(question.frames.size());
  VectorX<T> x(n), load = VectorX<T>::Ones(n);
  MatrixX<T> X(n, n), J(rows, rows), loads = load.replicate(1, 19), solved(n, 19);
  T log_det(0);
  Outcome a, inverse, factor, solve, derivatives, diagonal, of_log_det, operational;
  if (question.wants(Want::acceleration))
    expect_none("forward_dynamics", [&] { a = robot.forward_dynamics(s.q, s.qd, s.tau, x); });
  if (question.wants(Want::inverse_dynamics)) {
    expect_none("inverse_dynamics", [&] { robot.inverse_dynamics(s.q, s.qd, s.tau, x); });
    expect_none("bias", [&] { robot.bias(s.q, s.qd, x); });
    expect_none("gravity", [&] { robot.gravity(s.q, x); });
  }
  if (question.wants(Want::mass)) expect_none("mass", [&] { robot.mass(s.q, X); });
  if (question.wants(Want::inverse))
    expect_none("inverse_mass", [&] { inverse = robot.inverse_mass(s.q, X); });
  if (question.wants(Want::solve)) {
    expect_none("factor", [&] { factor = robot.factor(s.q); });
    expect_none("solve", [&] { solve = robot.solve(load, x); });
    expect_none("solve columns", [&] { solve = robot.solve(loads, solved); });
  }
  if (question.wants(Want::diagonal))
    expect_none("diagonal", [&] { diagonal = robot.diagonal(s.q, x); });
  if (question.wants(Want::log_det))
    expect_none("log_det", [&] { of_log_det = robot.log_det(s.q, log_det); });
  if (question.wants(Want::operational))
    expect_none("operational", [&] { operational = robot.operational(s.q, J); });
  VectorX<T> of_J(J.rows());
  if (question.wants(Want::operational_diagonal))
    expect_none("operational_diagonal", [&] { (void)robot.operational_diagonal(s.q, of_J); });
  if (question.wants(Want::solve))  // other factors stand there
    expect_none("solve again", [&] { solve = robot.solve(load, x); });
  if (question.wants(Want::derivatives)) {
    MatrixX<T> dq(n, n), dqd(n, n), dtau(n, n);
    expect_none("derivatives", [&] {
      derivatives = robot.derivatives(s.q, s.qd, s.tau, {.dq = dq, .dqd = dqd, .dtau = dtau}, x);
    });
    derivatives = robot.derivatives(s.q, s.qd, s.tau, {}, x);  // takes room for what is left out
    expect_none("derivatives, none of them",
                [&] { derivatives = robot.derivatives(s.q, s.qd, s.tau, {}, x); });
  }
  EXPECT_TRUE(a && inverse && factor && derivatives && diagonal && of_log_det && operational);

  Rows<T> states(model, count);
  states.q[3 * nq] = std::numeric_limits<T>::quiet_NaN();  // judged in full
  if (question.wants(Want::acceleration)) {
    (void)states.forward_dynamics(robot);  // the first takes memory
    expect_none("rows", [&] { (void)states.forward_dynamics(robot); });
  }
  if (question.wants(Want::inverse_dynamics)) {
    states.inverse_dynamics(robot);
    expect_none("rows of torques", [&] { states.inverse_dynamics(robot); });
  }
  std::vector<T> matrices(count * n * n), solutions(count * n);
  const RowsView<const T> taus(states.tau.data(), count, n);
  const auto expect_none_once_asked = [](const char* what, const auto& call) {
    call();  // the first takes memory
    expect_none(what, call);
  };
  if (question.wants(Want::mass))
    expect_none_once_asked("rows of M",
                           [&] { (void)robot.mass(states.q, matrices, states.outcomes); });
  if (question.wants(Want::inverse))
    expect_none_once_asked("rows of M^-1",
                           [&] { (void)robot.inverse_mass(states.q, matrices, states.outcomes); });
  if (question.wants(Want::solve))
    expect_none_once_asked("rows of M^-1 tau",
                           [&] { (void)robot.solve(states.q, taus, solutions, states.outcomes); });
}

TYPED_TEST(Allocation, DynamicsAllocateOnlyWhenTheyAreMade) {
  for (const Model<double>& model :
       {floating_base(61), chain(61, 36), chain(61, 53), chain(61, 200), creature(61)})
    for (const Tolerance tolerance : tolerances) {
      SCOPED_TRACE(testing::Message() << model.nv() << " DoF, " << name_of(tolerance));
      DynamicsOptions options{.tolerance = tolerance, .rules = all_rules()};
      options.question.frames = {{model.nv() - 1}, {model.nv() / 2}};
      expect_no_allocation_once_made<TypeParam>(model, options);
      if (model.nv() > 100) continue;
      options.question.dofs = {model.nv() / 2, model.nv() - 1};  // a block of M^-1
      expect_no_allocation_once_made<TypeParam>(model, options);
      options.question.dofs = {};
      options.question.at_rest = true;
      expect_no_allocation_once_made<TypeParam>(model, options);
    }
}

// Whichever kernels it takes, whatever is locked, with all rules and none.
TYPED_TEST(Allocation, QuestionsAllocateOnlyWhenTheyAreMade) {
  for (const Model<double>& model :
       {forest(3), tree(3), slides(3), armature(3), planar_everything(5), planar_chain(5, 40),
        slides_alone(5, 20)})
    for (const std::set<Rule>& rules : {all_rules(), std::set<Rule>()}) {
      SCOPED_TRACE(testing::Message() << model.nv() << " DoF, " << rules.size() << " rules");
      DynamicsOptions options{.rules = rules};
      options.question.frames = {{model.nv() - 1}};
      expect_no_allocation_once_made<TypeParam>(model, options);
      options.question.locked = {0, 2};
      options.question.q.assign(model.nq(), 0);
      expect_no_allocation_once_made<TypeParam>(model, options);
      options.question.dofs = {1, 4};
      expect_no_allocation_once_made<TypeParam>(model, options);
    }
}

TYPED_TEST(Allocation, ConstraintsAllocateOnlyWhenTheyAreMade) {
  using T = TypeParam;
  const Model<double> model = chain(61, 36);
  const int nv = model.nv();
  std::vector<Constraint> constraints = {
      {.name = "point", .first = {nv - 1}, .second = {nv / 2}},
      {.name = "pose", .kind = Constraint::Kind::pose, .first = {nv / 3}, .second = {-1}}};
  for (Constraint& one : constraints) one.compliance = {1, 1};
  ConstrainedDynamics<T> robot(plain(model), constraints, {.proximal = 1e-6});
  const State<T> s = random_state(model, 62).template cast<T>();
  VectorX<T> x(nv), forces(robot.rows());
  Outcome outcomes[3];
  EXPECT_EQ(allocations_of([&] {
              outcomes[0] = robot.forward_dynamics(s.q, s.qd, s.tau, x, forces);
              outcomes[1] = robot.impulse(s.q, s.qd, x, forces);
              outcomes[2] = robot.solve(s.q, s.tau, x, forces);
            }),
            0);
  for (const Outcome& outcome : outcomes) EXPECT_TRUE(outcome);
}

// What is not wanted is not made: no model in a wider precision, and nothing that judges M^-1.
TYPED_TEST(Allocation, DynamicsForMAloneMakeOneModel) {
  const Model<double> model = chain(61, 36);
  const auto taken = [&](std::set<Want> want) {
    return allocations_of(
        [&] { (void)dynamics_of<TypeParam>(model, {.question = {.want = std::move(want)}}); });
  };
  EXPECT_LT(taken({Want::mass}) + 300, taken({Want::mass, Want::inverse}));  // both take a plan
  EXPECT_LT(taken({Want::inverse}), taken({Want::inverse, Want::acceleration}));
}

TYPED_TEST(Allocation, PositionsTakeNone) {
  using T = TypeParam;
  const Model<double> model = everything(3);
  const RobotModel robot = plain(model);
  const State<T> state = random_state(model, 62).template cast<T>();
  VectorX<T> q = state.q, v = state.qd;
  const VectorX<T> lower = VectorX<T>::Zero(robot.nq), upper = VectorX<T>::Ones(robot.nq);
  MatrixX<T> A(robot.nv(), robot.nv()), B = A;
  std::mt19937_64 generator;
  EXPECT_EQ(allocations_of([&] {
              integrate(robot, state.q, state.qd, q);
              difference(robot, state.q, q, v);
              integrate_jacobians(robot, state.q, v, A, B);
              difference_jacobians(robot, state.q, q, A, B);
              neutral(robot, q);
              kalmarm::random(robot, lower, upper, generator, q);
            }),
            0);
}

TYPED_TEST(Allocation, ParameterDerivativesAllocateOnlyTheirWorkspaces) {
  using T = TypeParam;
  for (const Model<double>& parameters : {floating_base(61), chain(61, 36)}) {
    const Model<T> model = parameters.template cast<T>();
    const State<T> state = random_state(parameters, 62).template cast<T>();
    const int nv = model.nv();
    LinkKinematics<T> kin(model);
    set_position(model, state.q, kin);
    set_velocity(model, state.qd, kin);
    typename Sequential<Conventional>::template Workspace<T> ws(model);
    ASSERT_TRUE(factor(model, kin, ws.factors));
    VectorX<T> a(nv), w(nv);
    Sequential<Conventional>::acceleration(model, kin, state.tau, ws, a);

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
      regressor(model, kin, a, regressor_ws, by_theta);
      acceleration_jacobian(model, kin, ws.factors, a, acceleration_ws, by_theta, by_r, by_tau);
      innovations(model, kin, ws.factors, a, state.tau, innovation_ws, w);
      innovation_jacobian(model, kin, ws.factors, a, innovation_ws.sweeps.e, jacobian_ws, by_theta,
                          by_r, by_tau);
      mass_jacobian(model, kin, mass_ws, M_by_theta, M_by_r);
      factor_direction(model, kin, ws.factors, ws.sweeps, a, direction, forward);
      factor_gradient(model, kin, ws.factors, ws.sweeps, a, adjoint, reverse, gradient);
    });
    EXPECT_EQ(count, 0);
  }
}

}  // namespace
}  // namespace kalmarm::test
