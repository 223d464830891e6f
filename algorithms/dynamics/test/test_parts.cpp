// What a question leaves out changes nothing of what it asks: parts of a robot against the whole
// robot, locked joints against mechanics in the world frame.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "algorithms/dynamics/test/door_support.hpp"

namespace kalmarm::test {
namespace {

// Everything that a robot answers about one state, asked in some precision.
struct Answers {
  int asked = 0;
  VectorX<double> a, tau, bias, gravity, x, diagonal, operational_diagonal;
  MatrixX<double> M, X, operational;
  AccelerationDerivatives<double> derivatives{0};
  double log_det = 0;
};

// load: of `solve`, as many as are asked about. qdd stands in tau of the state.
template <class T>
Answers answers(const Model<double>& model, const DynamicsOptions& options,
                const State<double>& state, const VectorX<double>& load) {
  Dynamics<T> robot = dynamics_of<T>(model, options);
  const State<T> s = state.cast<T>();
  const int n = robot.asked(), rows = 6 * static_cast<int>(options.question.frames.size());
  const auto vector_of = [n](const auto& call) {
    VectorX<T> x = poisoned<T>(n);
    call(x);
    return VectorX<double>(x.template cast<double>());
  };
  const auto matrix_of = [](int size, const auto& call) {
    MatrixX<T> X = poisoned<T>(size, size);
    call(X);
    return MatrixX<double>(X.template cast<double>());
  };
  const auto ok = [](const Outcome& outcome) { EXPECT_TRUE(outcome); };
  Answers out;
  out.asked = n;
  out.a = vector_of([&](auto& a) { ok(robot.forward_dynamics(s.q, s.qd, s.tau, a)); });
  out.tau = vector_of([&](auto& tau) { robot.inverse_dynamics(s.q, s.qd, s.tau, tau); });
  out.bias = vector_of([&](auto& tau) { robot.bias(s.q, s.qd, tau); });
  out.gravity = vector_of([&](auto& tau) { robot.gravity(s.q, tau); });
  out.M = matrix_of(n, [&](auto& M) { robot.mass(s.q, M); });
  out.X = matrix_of(n, [&](auto& X) { ok(robot.inverse_mass(s.q, X)); });
  ok(robot.factor(s.q));
  out.x = vector_of([&](auto& x) { ok(robot.solve(VectorX<T>(load.cast<T>()), x)); });
  out.diagonal = vector_of([&](auto& x) { ok(robot.diagonal(s.q, x)); });
  out.operational = matrix_of(rows, [&](auto& X) { ok(robot.operational(s.q, X)); });
  VectorX<T> of_frames = poisoned<T>(rows);
  ok(robot.operational_diagonal(s.q, of_frames));
  out.operational_diagonal = of_frames.template cast<double>();
  T log_det = std::numeric_limits<T>::quiet_NaN();
  ok(robot.log_det(s.q, log_det));
  out.log_det = log_det;
  AccelerationDerivatives<T> d(n);
  ok(robot.derivatives(s.q, s.qd, s.tau, {.dq = d.dq, .dqd = d.dqd, .dtau = d.dtau}, d.a));
  out.derivatives = d.template cast<double>();
  return out;
}

double relative(const MatrixX<double>& is, const MatrixX<double>& should) {
  const double size = should.norm(), d = (is - should).norm();
  return size > 0 ? d / size : d;
}

#define EXPECT_SAME(is, should) EXPECT_LE(relative(is, should), tolerance) << #is

struct Precision {
  const char* name;
  double u;
  Answers (*answers)(const Model<double>&, const DynamicsOptions&, const State<double>&,
                     const VectorX<double>&);
  Model<double> (*rounded)(const Model<double>&);
  State<double> (*rounded_state)(const State<double>&);
};

class Parts : public testing::TestWithParam<Precision> {
 protected:
  const Precision& precision = GetParam();

  Model<double> model_of(const Family& family) const { return precision.rounded(family.make(3)); }
  State<double> state_of(const Model<double>& model) const {
    return precision.rounded_state(random_state(model, 4));
  }
};

template <class T>
Precision precision(const char* name) {
  return {name, static_cast<double>(unit_roundoff<T>()), answers<T>, rounded<T, Model<double>>,
          rounded<T, State<double>>};
}
INSTANTIATE_TEST_SUITE_P(, Parts,
                         testing::Values(precision<float>("float32"), precision<double>("float64")),
                         [](const auto& info) { return std::string(info.param.name); });

std::set<Rule> all_or_none(bool all) { return all ? all_rules() : std::set<Rule>(); }

VectorX<double> some_of(const VectorX<double>& x, const std::vector<int>& dofs) { return x(dofs); }
MatrixX<double> some_of(const MatrixX<double>& X, const std::vector<int>& dofs) {
  return X(dofs, dofs);
}

// Rows and columns of the whole robot's answers.
void expect_part(const Answers& part, const Answers& whole, const std::vector<int>& dofs,
                 double tolerance) {
  ASSERT_EQ(part.asked, static_cast<int>(dofs.size()));
  EXPECT_SAME(part.a, some_of(whole.a, dofs));
  EXPECT_SAME(part.tau, some_of(whole.tau, dofs));
  EXPECT_SAME(part.bias, some_of(whole.bias, dofs));
  EXPECT_SAME(part.gravity, some_of(whole.gravity, dofs));
  EXPECT_SAME(part.x, some_of(whole.x, dofs));
  EXPECT_SAME(part.diagonal, some_of(whole.diagonal, dofs));
  EXPECT_SAME(part.M, some_of(whole.M, dofs));
  EXPECT_SAME(part.X, some_of(whole.X, dofs));
  EXPECT_SAME(part.operational, whole.operational);
  EXPECT_SAME(part.operational_diagonal, whole.operational.diagonal());
  EXPECT_SAME(part.derivatives.a, some_of(whole.a, dofs));
  EXPECT_SAME(part.derivatives.dq, some_of(whole.derivatives.dq, dofs));
  EXPECT_SAME(part.derivatives.dqd, some_of(whole.derivatives.dqd, dofs));
  EXPECT_SAME(part.derivatives.dtau, some_of(whole.derivatives.dtau, dofs));
  EXPECT_LE(std::abs(part.log_det - whole.log_det),
            tolerance * std::max(1.0, std::abs(whole.log_det)));
}

// Of DoF here and there, and of one branch alone.
TEST_P(Parts, AnswerAsTheWholeRobotDoes) {
  const double tolerance = 1e4 * precision.u;
  for (const Family& family : robots())
    for (const Tolerance within : tolerances)
      for (const bool few : {false, true})
        for (const bool rules : {true, false}) {
          SCOPED_TRACE(std::string(family.name) + " " + name_of(within) +
                       (few ? ", two DoF" : ", most DoF") + (rules ? "" : ", no rules"));
          const Model<double> model = model_of(family);
          const State<double> state = state_of(model);
          const int nv = model.nv();
          const std::vector<int> dofs =
              few ? std::vector<int>{nv / 2, nv - 1} : all_but(nv, {0, nv / 3});
          const VectorX<double> load = some_of(state.tau, dofs);
          VectorX<double> whole_load = VectorX<double>::Zero(nv);
          whole_load(dofs) = load;
          DynamicsOptions options{within, about({}, model), all_or_none(rules)};
          const Answers whole = precision.answers(model, options, state, whole_load);
          options.question = about(dofs, model);
          expect_part(precision.answers(model, options, state, load), whole, dofs, tolerance);

          // and with each other
          EXPECT_SAME(whole.x, whole.X * whole_load);
          EXPECT_SAME(whole.diagonal, whole.X.diagonal());
          EXPECT_SAME(whole.derivatives.dtau, whole.X);
          const MatrixX<double> J = frame_jacobian(model, state.q, some_frames(model));
          EXPECT_SAME(whole.operational, J * whole.X * J.transpose());
        }
}

// A mechanism whose joints stand still: its M is a block of M, its bias that of the others' motion.
void expect_mechanics(const Answers& is, const Model<double>& model, State<double> stands,
                      const std::vector<int>& free, double tolerance) {
  ASSERT_EQ(is.asked, static_cast<int>(free.size()));
  const DenseMechanics dense = dense_mechanics(model, stands);
  const MatrixX<double> M = some_of(dense.M, free), X = M.inverse();
  const VectorX<double> bias = some_of(dense.bias, free), tau = some_of(stands.tau, free);
  EXPECT_SAME(is.M, M);
  EXPECT_SAME(is.X, X);
  EXPECT_SAME(is.bias, bias);
  EXPECT_SAME(is.tau, M * tau + bias);
  EXPECT_SAME(is.a, X * (tau - bias));
  EXPECT_SAME(is.x, X * tau);
  EXPECT_SAME(is.diagonal, X.diagonal());
  EXPECT_SAME(is.derivatives.a, is.a);
  EXPECT_SAME(is.derivatives.dtau, X);
  const double log_det = std::log(M.determinant());
  EXPECT_LE(std::abs(is.log_det - log_det), tolerance * std::max(1.0, std::abs(log_det)));
  stands.qd.setZero();
  EXPECT_SAME(is.gravity, some_of(dense_mechanics(model, stands).bias, free));
  const MatrixX<double> J = frame_jacobian(model, stands.q, some_frames(model))(Eigen::all, free);
  EXPECT_SAME(is.operational, J * X * J.transpose());
  EXPECT_SAME(is.operational_diagonal, is.operational.diagonal());
}

// By differences of the same question in double.
void expect_derivatives(const Answers& is, const Model<double>& model,
                        const DynamicsOptions& options, const State<double>& state,
                        const std::vector<int>& free, double tolerance) {
  Dynamics<double> robot = dynamics_of<double>(model, options);
  const double h = 1e-6;
  const int n = static_cast<int>(free.size());
  const auto difference = [&](VectorX<double> State<double>::*part, int i) {
    State<double> more = state, less = state;
    (more.*part)[i] += h;
    (less.*part)[i] -= h;
    VectorX<double> a(n), b(n);
    EXPECT_TRUE(robot.forward_dynamics(more.q, more.qd, more.tau, a));
    EXPECT_TRUE(robot.forward_dynamics(less.q, less.qd, less.tau, b));
    return VectorX<double>((a - b) / (2 * h));
  };
  MatrixX<double> dq = is.derivatives.dq, dqd(n, n);
  for (int j = 0; j < n; ++j) {
    const int k = free[j];
    if (is_single(model, k)) dq.col(j) = difference(&State<double>::q, model.joint(k).q_index);
    dqd.col(j) = difference(&State<double>::qd, k);
  }
  EXPECT_SAME(is.derivatives.dq, dq);
  EXPECT_SAME(is.derivatives.dqd, dqd);
}

TEST_P(Parts, OfLockedJointsAreTheMechanismOfTheOthers) {
  const double bound = 2e5 * precision.u;
  for (const Family& family : robots())
    for (const Tolerance tolerance : tolerances)
      for (const bool rules : {true, false}) {
        SCOPED_TRACE(std::string(family.name) + " " + name_of(tolerance) +
                     (rules ? "" : ", no rules"));
        const Model<double> model = model_of(family);
        const std::vector<int> locked = some_locked(model), free = all_but(model.nv(), locked);
        ASSERT_FALSE(locked.empty());
        State<double> state = state_of(model), stands = state;
        DynamicsOptions options{tolerance, about({}, model), all_or_none(rules)};
        options.question.locked = locked;
        options.question.q.assign(stands.q.begin(), stands.q.end());
        // What the state says of a locked joint is not looked at.
        for (const int k : locked) {
          stands.qd[k] = 0;
          state.q[model.joint(k).q_index] = 7;
          state.qd[k] = 8;
          state.tau[k] = 9;
        }
        const Answers is = precision.answers(model, options, state, some_of(state.tau, free));
        expect_mechanics(is, model, stands, free, bound);
        expect_derivatives(is, model, options, state, free, std::max(bound, 1e-6));
      }
}

TEST_P(Parts, AtRestDoNotLookAtVelocities) {
  const double tolerance = 1e4 * precision.u;
  for (const Family& family : robots()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = model_of(family);
    State<double> state = state_of(model), still = state;
    still.qd.setZero();
    state.qd = poisoned<double>(model.nv());
    DynamicsOptions options{.question = about({}, model), .rules = all_rules()};
    const Answers moving = precision.answers(model, options, still, still.tau);
    options.question.at_rest = true;
    const Answers resting = precision.answers(model, options, state, state.tau);
    expect_part(resting, moving, all_but(model.nv(), {}), tolerance);
    EXPECT_SAME(resting.bias, moving.gravity);
  }
}

template <class T>
class Questions : public testing::Test {};

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Questions, Precisions, PrecisionName);

TYPED_TEST(Questions, RowsAtRestDoNotLookAtVelocities) {
  using T = TypeParam;
  for (const Family& family : robots()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = family.make(3);
    DynamicsOptions options = by_all_rules;
    options.question.want = {Want::acceleration, Want::inverse_dynamics};
    Dynamics<T> moving = dynamics_of<T>(model, options);
    options.question.at_rest = true;
    Dynamics<T> resting = dynamics_of<T>(model, options);
    Rows<T> rows(model, 19), of_zeros(model, 19);
    std::fill(rows.qd.begin(), rows.qd.end(), std::numeric_limits<T>::quiet_NaN());
    std::fill(of_zeros.qd.begin(), of_zeros.qd.end(), T(0));
    const auto expect_same = [&] {
      const Eigen::Map<const VectorX<T>> is(rows.a.data(), rows.a.size()),
          should(of_zeros.a.data(), rows.a.size());
      EXPECT_LE((is - should).norm(), 1e4 * unit_roundoff<T>() * should.norm());
    };
    EXPECT_EQ(rows.forward_dynamics(resting), 0);
    EXPECT_EQ(of_zeros.forward_dynamics(moving), 0);
    expect_same();
    rows.inverse_dynamics(resting);
    of_zeros.inverse_dynamics(moving);
    expect_same();
  }
}

// Each derivative is the same to the bit, whichever others are asked for.
TYPED_TEST(Questions, DerivativesThatAreLeftOutChangeNothing) {
  using T = TypeParam;
  for (const Family& family : robots()) {
    const Model<double> model = family.make(3);
    const int nv = model.nv();
    const State<T> s = random_state(model, 4).template cast<T>();
    for (const std::vector<int>& dofs : {all_but(nv, {}), all_but(nv, {1})}) {
      DynamicsOptions options = by_all_rules;
      options.question.want = {Want::derivatives};
      options.question.dofs = dofs;
      const int n = static_cast<int>(dofs.size());
      Dynamics<T> robot = dynamics_of<T>(model, options);
      AccelerationDerivatives<T> all(n);
      ASSERT_TRUE(robot.derivatives(s.q, s.qd, s.tau,
                                    {.dq = all.dq, .dqd = all.dqd, .dtau = all.dtau}, all.a));
      for (int asked = 0; asked < 8; ++asked) {
        AccelerationDerivatives<T> some(n);
        Derivatives<T> out;
        if (asked & 1) out.dq = some.dq;
        if (asked & 2) out.dqd = some.dqd;
        if (asked & 4) out.dtau = some.dtau;
        ASSERT_TRUE(robot.derivatives(s.q, s.qd, s.tau, out, some.a));
        EXPECT_TRUE(some.a == all.a) << family.name;
        if (asked & 1) {
          EXPECT_TRUE(some.dq == all.dq) << family.name;
        }
        if (asked & 2) {
          EXPECT_TRUE(some.dqd == all.dqd) << family.name;
        }
        if (asked & 4) {
          EXPECT_TRUE(some.dtau == all.dtau) << family.name;
        }
      }
    }
  }
}

}  // namespace
}  // namespace kalmarm::test
