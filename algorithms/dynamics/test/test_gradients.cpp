// Products of Jacobians with vectors, from either side, against differences of truth in 50 digits, against each other and
// against what is linear; rows against one state.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "algorithms/dynamics/test/door_support.hpp"
#include "algorithms/spatial/inertia.hpp"
#include "algorithms/test/refusal.hpp"
#include "algorithms/test/singular.hpp"
#include "kalmarm/configuration.hpp"
#include "kalmarm/gradients.hpp"
#include "kalmarm/kinematics.hpp"

namespace kalmarm::test {
namespace {

template <class T>
class GradientsOf : public testing::Test {};

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(GradientsOf, Precisions, PrecisionName);

template <class T>
Gradients<T> gradients_of(const Model<double>& model, const Question& question = {}) {
  return Gradients<T>(plain(rounded<T>(model)), {.question = question});
}

template <class T>
VectorX<T> weights(int n, std::uint64_t seed) {
  Random random(seed);
  return random.vector(n).template cast<T>();
}

// What a call fills, poisoned before.
template <class T>
struct Products {
  VectorX<T> dq, dqd, dtau, inertias, armature, forces, loads, result;

  explicit Products(int n, int frames = 0, int loaded = 0)
      : dq(poisoned<T>(n)),
        dqd(dq),
        dtau(dq),
        inertias(poisoned<T>(10 * n)),
        armature(dq),
        forces(poisoned<T>(6 * frames)),
        loads(poisoned<T>(10 * loaded)),
        result(dq) {}

  // All of forward dynamics; those of inverse dynamics and solve are less.
  StateVectorJacobian<T> all() {
    return {.dq = dq, .dqd = dqd, .dtau = dtau, .inertias = inertias, .armature = armature};
  }
};

// Of x relative to what it is a sum of, in u of T.
template <class T, class V>
double roundoffs(const V& x, const VectorX<double>& exact, double size) {
  const double u = static_cast<double>(unit_roundoff<T>());
  return (x.template cast<double>() - exact).norm() / (u * size);
}

// Derivatives against truth have the bound of those of matrices (fast/test/test_derivatives.cpp). Those by q and qd are sums
// of terms in the order of a, and may all be zero.
double bound_of(double condition) { return 4 * (40 + 2 * std::sqrt(condition)); }

TYPED_TEST(GradientsOf, ProductsWithWeightsAgreeWithDifferencesOfTruth) {
  using T = TypeParam;
  for (const Family& family : families_and_robots()) {
    const Model<double> model = rounded<T>(family.make(3));
    const int n = model.nv();
    const State<T> state = random_state(model, 4).template cast<T>();
    const VectorX<T> w = weights<T>(n, 5);
    const TrueDerivatives truth(model, state.template cast<double>());
    const AccelerationDerivatives<double> exact = truth.rounded();
    const VectorX<double> wide = w.template cast<double>();
    const double bound = bound_of(truth.condition());
    Gradients<T> robot = gradients_of<T>(model);

    Products<T> of_a(n);
    StateVectorJacobian<T> out = of_a.all();
    out.result = of_a.result;
    ASSERT_TRUE(robot.forward_dynamics_vjp(state.q, state.qd, state.tau, w, out)) << family.name;
    const auto error = [&](const VectorX<T>& x, const MatrixX<double>& A,
                           const VectorX<double>& by) {
      return roundoffs<T>(x, A.transpose() * by, (A.norm() + exact.a.norm()) * by.norm());
    };
    EXPECT_LE(error(of_a.dq, exact.dq, wide), bound) << family.name;
    EXPECT_LE(error(of_a.dqd, exact.dqd, wide), bound) << family.name;
    EXPECT_LE(error(of_a.dtau, exact.dtau, wide), bound) << family.name;
    EXPECT_LE(roundoffs<T>(of_a.result, exact.a, exact.a.norm()), bound) << family.name;

    // d ID = -M da at qdd = a, and M for what is given.
    const DenseMechanics dense = dense_mechanics(model, state.template cast<double>());
    const VectorX<T> a = exact.a.cast<T>();
    const VectorX<double> Mw = dense.M * wide;
    Products<T> of_tau(n);
    robot.inverse_dynamics_vjp(state.q, state.qd, a, w, of_tau.all());
    EXPECT_LE(error(-of_tau.dq, exact.dq, Mw), bound) << family.name;
    EXPECT_LE(error(-of_tau.dqd, exact.dqd, Mw), bound) << family.name;
    EXPECT_LE(roundoffs<T>(of_tau.dtau, Mw, dense.M.norm() * wide.norm()), 100) << family.name;
  }
}

// x is the acceleration of a robot that neither moves nor weighs anything.
TYPED_TEST(GradientsOf, SolvesAreDerivedAsAccelerationsWithoutBias) {
  using T = TypeParam;
  for (const Family& family : families_and_robots()) {
    Model<double> model = rounded<T>(family.make(6));
    const int n = model.nv();
    State<T> state = random_state(model, 7).template cast<T>();
    state.qd.setZero();
    const VectorX<T> w = weights<T>(n, 8);
    Gradients<T> robot = gradients_of<T>(model);
    RobotModel weightless = plain(model);
    weightless.gravity = {0, 0, 0};
    const TrueDerivatives truth(model_of(weightless), state.template cast<double>());
    const AccelerationDerivatives<double> exact = truth.rounded();
    const VectorX<double> wide = w.template cast<double>();
    const double bound = bound_of(truth.condition());
    Products<T> of_x(n);
    ASSERT_TRUE(robot.solve_vjp(state.q, state.tau, w,
                                {.dq = of_x.dq, .dtau = of_x.dtau, .result = of_x.result}));
    EXPECT_LE(roundoffs<T>(of_x.dq, exact.dq.transpose() * wide,
                           (exact.dq.norm() + exact.a.norm()) * wide.norm()),
              bound)
        << family.name;
    EXPECT_LE(roundoffs<T>(of_x.dtau, exact.dtau * wide, exact.dtau.norm() * wide.norm()), bound)
        << family.name;
    EXPECT_LE(roundoffs<T>(of_x.result, exact.a, exact.dtau.norm() * state.tau.norm()), bound)
        << family.name;
  }
}

// <w, J v> = <J'w, v> of each call.
TYPED_TEST(GradientsOf, ProductsFromEitherSideAreAdjoint) {
  using T = TypeParam;
  for (const Family& family : families_and_robots()) {
    const Model<double> model = rounded<T>(family.make(9));
    const int n = model.nv();
    const State<T> state = random_state(model, 10).template cast<T>();
    const VectorX<T> w = weights<T>(n, 11), dq = weights<T>(n, 12), dqd = weights<T>(n, 13),
                     dtau = weights<T>(n, 14);
    const TrueDerivatives truth(model, state.template cast<double>());
    const double bound = bound_of(truth.condition()), u = static_cast<double>(unit_roundoff<T>());
    Gradients<T> robot = gradients_of<T>(model);
    const auto dot = [](const VectorX<T>& a, const VectorX<T>& b) {
      return a.template cast<double>().dot(b.template cast<double>());
    };
    const auto expect = [&](double one, double other, double size, const char* call) {
      EXPECT_LE(std::abs(one - other), bound * u * size) << family.name << " " << call;
    };
    const double size_of_v = (dq.norm() + dqd.norm() + dtau.norm()) * static_cast<double>(w.norm());
    VectorX<T> along = poisoned<T>(n);
    Products<T> by(n);
    ASSERT_TRUE(robot.forward_dynamics_vjp(state.q, state.qd, state.tau, w, by.all()));
    ASSERT_TRUE(robot.forward_dynamics_jvp(state.q, state.qd, state.tau, dq, dqd, dtau, along));
    const AccelerationDerivatives<double> exact = truth.rounded();
    const double size = exact.dq.norm() + exact.dqd.norm() + exact.dtau.norm();
    expect(dot(w, along), dot(by.dq, dq) + dot(by.dqd, dqd) + dot(by.dtau, dtau), size * size_of_v,
           "forward_dynamics");

    const double inertia = dense_mechanics(model, state.template cast<double>()).M.norm();
    robot.inverse_dynamics_vjp(state.q, state.qd, state.tau, w, by.all());
    robot.inverse_dynamics_jvp(state.q, state.qd, state.tau, dq, dqd, dtau, along);
    const double terms = std::abs(dot(by.dq, by.dq)) + dot(by.dqd, by.dqd) + dot(by.dtau, by.dtau);
    expect(dot(w, along), dot(by.dq, dq) + dot(by.dqd, dqd) + dot(by.dtau, dtau),
           inertia * size_of_v + std::sqrt(terms) * size_of_v, "inverse_dynamics");

    ASSERT_TRUE(robot.solve_vjp(state.q, state.tau, w, {.dq = by.dq, .dtau = by.dtau}));
    ASSERT_TRUE(robot.solve_jvp(state.q, state.tau, dq, dtau, along));
    expect(dot(w, along), dot(by.dq, dq) + dot(by.dtau, dtau),
           (exact.dtau.norm() + std::sqrt(dot(by.dq, by.dq) + dot(by.dtau, by.dtau))) * size_of_v,
           "solve");
  }
}

// tau = Y pi + r qdd, so that w'tau has the derivatives Y'w and w qdd; those of w'a are of -M^-1 w.
TYPED_TEST(GradientsOf, ParametersHaveTheRegressor) {
  using T = TypeParam;
  for (const Family& family : families_and_robots()) {
    const Model<double> model = rounded<T>(family.make(15));
    const int n = model.nv();
    const State<T> state = random_state(model, 16).template cast<T>();
    const VectorX<T> w = weights<T>(n, 17);
    Gradients<T> robot = gradients_of<T>(model);
    Kinematics<T> kinematics(plain(model));
    MatrixX<T> Y = MatrixX<T>::Zero(n, 10 * n);
    const auto check = [&](const VectorX<T>& qdd, const VectorX<T>& by, const Products<T>& found,
                           const char* call) {
      kinematics.compute(state.q, state.qd, qdd, {.regressor = Y});
      const MatrixX<double> wide = Y.template cast<double>();
      const VectorX<double> exact = wide.transpose() * by.template cast<double>();
      EXPECT_LE(roundoffs<T>(found.inertias, exact, wide.norm() * by.norm()), 40)
          << family.name << " " << call;
      for (int k = 0; k < n; ++k) EXPECT_EQ(found.armature[k], by[k] * qdd[k]) << family.name;
    };
    Products<T> of_tau(n), of_a(n);
    robot.inverse_dynamics_vjp(state.q, state.qd, state.tau, w, of_tau.all());
    check(state.tau, w, of_tau, "inverse_dynamics");
    StateVectorJacobian<T> out = of_a.all();
    out.result = of_a.result;
    ASSERT_TRUE(robot.forward_dynamics_vjp(state.q, state.qd, state.tau, w, out));
    check(of_a.result, -of_a.dtau, of_a, "forward_dynamics");
  }
}

Question on_last_link(const Model<double>& model) {
  const int last = end_of_joint(model, model.nv() - 1), other = end_of_joint(model, model.nv() / 2);
  return {.acted_on = {{last, {1, 0.25, -0.5, 0.125}, {0.25, 0.5, 0}}, {other}},
          .loaded = {{last, {1, -0.5, 0.25, 0}, {0.125, 0, 0.25}}, {other}}};
}

template <class T>
VectorX<T> two_loads() {
  VectorX<double> loads(20);
  loads << 1.25, .125, .25, -.25, .5, .625, .75, .03125, .0625, .03125,  //
      0.75, -.125, .0625, .25, .375, .25, .3125, .03125, -.015625, .015625;
  return loads.cast<T>();
}

// Torques are linear in forces and loads, accelerations through them.
TYPED_TEST(GradientsOf, ForcesAndLoadsAreGivenAndDerivedBy) {
  using T = TypeParam;
  for (const Family& family : families_and_robots()) {
    const Model<double> model = rounded<T>(family.make(18));
    const int n = model.nv();
    const State<T> state = random_state(model, 19).template cast<T>();
    const VectorX<T> w = weights<T>(n, 20), f = weights<T>(12, 21), loads = two_loads<T>();
    const Question question = on_last_link(model);
    Gradients<T> robot = gradients_of<T>(model, question);
    const StateForces<T> given{
        .on = VectorView<const T>(f), .axes = Axes::local, .loads = VectorView<const T>(loads)};
    Products<T> by(n, 2, 2);
    StateVectorJacobian<T> out = by.all();
    out.forces = by.forces;
    out.loads = by.loads;
    robot.inverse_dynamics_vjp(state.q, state.qd, state.tau, w, out, given);
    Dynamics<T> dynamics(plain(model), {.question = question});
    VectorX<T> with(n), without(n);
    dynamics.inverse_dynamics(state.q, state.qd, state.tau, with, given);
    dynamics.inverse_dynamics(state.q, state.qd, state.tau, without);
    const auto wide = [](const auto& x) { return x.template cast<double>().eval(); };
    const double change = wide(w).dot(wide(with) - wide(without)),
                 linear = wide(by.forces).dot(wide(f)) + wide(by.loads).dot(wide(loads)),
                 u = static_cast<double>(unit_roundoff<T>());
    EXPECT_LE(std::abs(change - linear), 40 * u * wide(w).norm() * (with.norm() + without.norm()))
        << family.name;

    // Of accelerations the same at a, by -M^-1 w.
    out.result = by.result;
    ASSERT_TRUE(robot.forward_dynamics_vjp(state.q, state.qd, state.tau, w, out, given));
    Products<T> same(n, 2, 2);
    StateVectorJacobian<T> of_tau = same.all();
    of_tau.forces = same.forces;
    of_tau.loads = same.loads;
    const VectorX<T> lambda = -by.dtau;
    robot.inverse_dynamics_vjp(state.q, state.qd, by.result, lambda, of_tau, given);
    for (const auto member : {&Products<T>::dq, &Products<T>::dqd, &Products<T>::inertias,
                              &Products<T>::forces, &Products<T>::loads})
      EXPECT_TRUE((by.*member).isApprox(same.*member, 4 * unit_roundoff<T>())) << family.name;

    // Along a direction they stay as they are.
    const VectorX<T> dq = weights<T>(n, 22), dqd = weights<T>(n, 23), zero = VectorX<T>::Zero(n);
    VectorX<T> along = poisoned<T>(n);
    ASSERT_TRUE(
        robot.forward_dynamics_jvp(state.q, state.qd, state.tau, dq, dqd, zero, along, given));
    EXPECT_LE(
        std::abs(wide(w).dot(wide(along)) - wide(by.dq).dot(wide(dq)) -
                 wide(by.dqd).dot(wide(dqd))),
        4000 * u *
            (wide(w).norm() * along.norm() + by.dq.norm() * dq.norm() + by.dqd.norm() * dqd.norm()))
        << family.name;
  }
}

// Of S = tr(W'J M^-1 J'): by q as differences of fourth order of S itself have it, of step h = 2^-10, wrong by h^4 / 30 of
// its fifth derivative and by u / h. M is linear in inertias and armatures together, so that S is homogeneous of degree -1.
TYPED_TEST(GradientsOf, OperationalProductsAreDerivativesOfTheirTrace) {
  using T = TypeParam;
  for (const Family& family : families_and_robots()) {
    const Model<double> model = rounded<T>(family.make(30));
    const RobotModel robot = plain(model);
    const int n = model.nv();
    const State<T> state = random_state(model, 31).template cast<T>();
    Question question = on_last_link(model);
    std::swap(question.frames, question.acted_on);
    const VectorX<T> loads = two_loads<T>(), weight = weights<T>(144, 32);
    const Eigen::Map<const MatrixX<T>> W(weight.data(), 12, 12);
    Gradients<T> gradients = gradients_of<T>(model, question);
    Products<T> by(n, 0, 2);
    ASSERT_TRUE(gradients.operational_vjp(
        state.q, W,
        {.dq = by.dq, .inertias = by.inertias, .armature = by.armature, .loads = by.loads},
        VectorView<const T>(loads)));

    // Of rows of the same state they are the same.
    MatrixX<T> dq_of_rows = MatrixX<T>::Constant(n, 2, std::numeric_limits<T>::quiet_NaN());
    const MatrixX<T> twice_q = state.q.replicate(1, 2), twice_W = weight.replicate(1, 2),
                     twice_loads = loads.replicate(1, 2);
    const auto rows = [](auto& X) {
      return RowsView<std::remove_pointer_t<decltype(X.data())>>(X.data(), X.cols(), X.rows());
    };
    std::vector<Outcome> outcomes(2);
    ASSERT_EQ(gradients.operational_vjp(rows(twice_q), rows(twice_W), {.dq = rows(dq_of_rows)},
                                        outcomes, 2, rows(twice_loads)),
              0);
    EXPECT_EQ(dq_of_rows.col(0), dq_of_rows.col(1)) << family.name;

    Dynamics<double> dynamics(robot, {.question = question});
    const VectorX<double> given = loads.template cast<double>(),
                          q = state.q.template cast<double>();
    const MatrixX<double> wide = W.template cast<double>();
    MatrixX<double> X(12, 12);
    const auto trace = [&](const VectorX<double>& at) {
      EXPECT_TRUE(dynamics.operational(at, X, {.loads = VectorView<const double>(given)}));
      return wide.cwiseProduct(X).sum();
    };
    const double S = trace(q), size = wide.norm() * X.norm(), h = 0x1p-10;
    VectorX<double> exact(n), moved(model.nq());
    for (int k = 0; k < n; ++k) {
      const auto at = [&](double step) {
        integrate(robot, q, VectorX<double>(step * VectorX<double>::Unit(n, k)), moved);
        return trace(moved);
      };
      exact[k] = (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h);
    }
    const double condition = TrueDerivatives(model, state.template cast<double>()).condition(),
                 u = static_cast<double>(unit_roundoff<T>());
    EXPECT_LE(roundoffs<T>(by.dq, exact, size + exact.norm()), bound_of(condition) + 1e-11 / u)
        << family.name;
    double sum = S + by.loads.template cast<double>().dot(given), terms = std::abs(S);
    for (int k = 0; k < n; ++k) {
      const SpatialInertia<double> body(model.joint(k).body);
      VectorX<double> pi(10);
      pi << body.m, body.h, body.I.diagonal(), body.I(0, 1), body.I(0, 2), body.I(1, 2);
      const VectorX<double> by_pi = by.inertias.segment(10 * k, 10).template cast<double>();
      sum += by_pi.dot(pi) + by.armature[k] * model.joint(k).r;
      terms +=
          by_pi.cwiseProduct(pi).cwiseAbs().sum() + std::abs(by.armature[k] * model.joint(k).r);
    }
    EXPECT_LE(roundoffs<T>(dq_of_rows.col(0), exact, size + exact.norm()),
              bound_of(condition) + 1e-11 / u)
        << family.name;
    EXPECT_LE(std::abs(sum), bound_of(condition) * u * (terms + size)) << family.name;
  }
}

// Galileo: neither where a free robot is nor how fast it travels matters, to the bit.
TYPED_TEST(GradientsOf, TravellingChangesNothing) {
  using T = TypeParam;
  const Model<double> model = floating_base(11);
  const int n = model.nv();
  State<T> state = random_state(model, 12).template cast<T>();
  const VectorX<T> w = weights<T>(n, 13);
  Gradients<T> robot = gradients_of<T>(model);
  Products<T> here(n), there(n);
  ASSERT_TRUE(robot.forward_dynamics_vjp(state.q, state.qd, state.tau, w, here.all()));
  state.q.template head<3>() += Vector3<T>(T(1e6), T(-3e5), T(7e7));
  state.qd.template head<3>() += Vector3<T>(T(1e4), T(2e3), T(-5e3));
  ASSERT_TRUE(robot.forward_dynamics_vjp(state.q, state.qd, state.tau, w, there.all()));
  for (const auto member :
       {&Products<T>::dq, &Products<T>::dqd, &Products<T>::dtau, &Products<T>::inertias})
    EXPECT_TRUE(((here.*member).array() == (there.*member).array()).all());
  EXPECT_TRUE(here.dqd.template head<3>().isZero(0));
}

// Rows of states with what a call fills, and guards behind.
template <class T>
struct ManyStates {
  static constexpr int guard = 64;
  static constexpr T untouched = T(-77);

  int n, nq, count, failed = 0;
  std::vector<T> q, qd, tau, w, dq, dqd, dtau, inertias;
  std::vector<Outcome> outcomes;

  ManyStates(const Model<double>& model, int states)
      : n(model.nv()), nq(model.nq()), count(states), outcomes(states) {
    for (int i = 0; i < count; ++i) {
      const State<T> s = random_state(model, i).template cast<T>();
      q.insert(q.end(), s.q.begin(), s.q.end());
      qd.insert(qd.end(), s.qd.begin(), s.qd.end());
      tau.insert(tau.end(), s.tau.begin(), s.tau.end());
      const VectorX<T> one = weights<T>(n, 100 + i);
      w.insert(w.end(), one.begin(), one.end());
    }
  }

  RowsOfVectorJacobian<T> cleared() {
    const auto rows = [&](std::vector<T>& x, int width) {
      x.assign(std::size_t(count) * width, std::numeric_limits<T>::quiet_NaN());
      x.insert(x.end(), guard, untouched);
      return RowsView<T>(x.data(), count, width);
    };
    return {.dq = rows(dq, n),
            .dqd = rows(dqd, n),
            .dtau = rows(dtau, n),
            .inertias = rows(inertias, 10 * n)};
  }
  std::vector<const std::vector<T>*> all() const { return {&dq, &dqd, &dtau, &inertias}; }

  void ask(Gradients<T>& robot, int threads = 1) {
    const RowsOfVectorJacobian<T> out = cleared();
    failed = robot.forward_dynamics_vjp(q, qd, tau, w, out, outcomes, threads);
    for (const std::vector<T>* x : all())
      EXPECT_TRUE(std::all_of(x->end() - guard, x->end(), [](T y) { return y == untouched; }));
    EXPECT_EQ(failed, std::ranges::count_if(outcomes, [](const Outcome& one) { return !one; }));
  }
};

TYPED_TEST(GradientsOf, RowsAreAsOneStateAndBitsDoNotDependOnThreads) {
  using T = TypeParam;
  for (const Family& family : families_and_robots())
    for (const int count : {3, 70}) {
      const Model<double> model = rounded<T>(family.make(24));
      const int n = model.nv();
      Gradients<T> robot = gradients_of<T>(model);
      ManyStates<T> rows(model, count), threaded(model, count);
      rows.ask(robot);
      threaded.ask(robot, 3);
      EXPECT_EQ(rows.failed, 0) << family.name;
      for (std::size_t i = 0; i < rows.all().size(); ++i)
        EXPECT_EQ(*rows.all()[i], *threaded.all()[i]) << family.name;
      for (const int i : {0, count - 1}) {
        Products<T> one(n);
        const auto state = [&](const std::vector<T>& x, int width) {
          return VectorView<const T>(&x[std::size_t(i) * width], width);
        };
        const Outcome outcome =
            robot.forward_dynamics_vjp(state(rows.q, model.nq()), state(rows.qd, n),
                                       state(rows.tau, n), state(rows.w, n), one.all());
        ASSERT_TRUE(outcome);
        // As far as a and M^-1 w of both are apart, and these are sums of terms as large.
        const double tolerance =
            outcome.error + rows.outcomes[i].error + 2000 * static_cast<double>(unit_roundoff<T>());
        const auto apart = [&](const std::vector<T>& x, const VectorX<T>& of_one, int width) {
          const Eigen::Map<const VectorX<T>> row(&x[std::size_t(i) * width], width);
          return static_cast<double>((row - of_one).norm() / (of_one.norm() + T(1e-30)));
        };
        EXPECT_LE(apart(rows.dq, one.dq, n), 10 * tolerance) << family.name;
        EXPECT_LE(apart(rows.dqd, one.dqd, n), 10 * tolerance) << family.name;
        EXPECT_LE(apart(rows.dtau, one.dtau, n), 10 * tolerance) << family.name;
        EXPECT_LE(apart(rows.inertias, one.inertias, 10 * n), 10 * tolerance) << family.name;
      }
    }
}

TYPED_TEST(GradientsOf, AFailureStaysInItsRow) {
  using T = TypeParam;
  const Model<double> model = floating_base(25);
  const int n = model.nv();
  Gradients<T> robot = gradients_of<T>(model);
  ManyStates<T> sound(model, 40), flawed(model, 40);
  flawed.q[7 * model.nq() + 9] = std::numeric_limits<T>::quiet_NaN();
  flawed.w[21 * n + 2] = std::numeric_limits<T>::infinity();
  sound.ask(robot);
  flawed.ask(robot);
  EXPECT_EQ(sound.failed, 0);
  EXPECT_EQ(flawed.failed, 2);
  for (int i = 0; i < 40; ++i) {
    EXPECT_EQ(bool(flawed.outcomes[i]), i != 7 && i != 21) << i;
    if (!flawed.outcomes[i]) continue;
    for (std::size_t x = 0; x < sound.all().size(); ++x) {
      const std::ptrdiff_t width = x == 3 ? 10 * n : n;
      const auto row = [&](const ManyStates<T>& rows) {
        return rows.all()[x]->begin() + i * width;
      };
      EXPECT_TRUE(std::equal(row(sound), row(sound) + width, row(flawed))) << i;
    }
  }
}

// Two rows of several blocks, as many as are kept at once and some more.
TYPED_TEST(GradientsOf, ManyRowsAreRowsOfFewer) {
  using T = TypeParam;
  const Model<double> model = chain(26, 3);
  Gradients<T> robot = gradients_of<T>(model);
  ManyStates<T> all(model, 1100);
  all.ask(robot);
  EXPECT_EQ(all.failed, 0);
  ManyStates<T> first(model, 32);
  first.ask(robot);
  EXPECT_TRUE(std::equal(first.dq.begin(), first.dq.end() - first.guard, all.dq.begin()));
  const int last = 1099;
  const auto state = [&](const std::vector<T>& x) { return VectorView<const T>(&x[last * 3], 3); };
  Products<T> one(3);
  ASSERT_TRUE(robot.forward_dynamics_vjp(state(all.q), state(all.qd), state(all.tau), state(all.w),
                                         one.all()));
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(all.dq[last * 3 + k], one.dq[k], 5000 * unit_roundoff<T>() * one.dq.norm());
}

// More rows than are worked on at once; a row that fails is named, and moves no other.
TYPED_TEST(GradientsOf, OperationalProductsOfARowAreItsOwn) {
  using T = TypeParam;
  constexpr int n = 3, k = 6, count = 1100, bad = 1050;
  const Model<double> model = chain(33, n);
  Gradients<T> robot = gradients_of<T>(model, {.frames = {{n - 1}}});
  ManyStates<T> states(model, count);
  states.q[bad * n] = std::numeric_limits<T>::quiet_NaN();
  const VectorX<T> W = weights<T>(count * k * k, 34);
  std::vector<T> dq(count * n);
  std::vector<Outcome> outcomes(count);
  EXPECT_EQ(robot.operational_vjp(states.q, W, {.dq = RowsView<T>(dq.data(), count, n)}, outcomes),
            1);
  EXPECT_FALSE(outcomes[bad]);
  for (const int row : {0, bad - 1, bad + 1, count - 1}) {
    VectorX<T> one = poisoned<T>(n);
    ASSERT_TRUE(robot.operational_vjp(VectorView<const T>(&states.q[row * n], n),
                                      MatrixView<const T>(&W[row * k * k], k, k), {.dq = one}));
    for (int i = 0; i < n; ++i)
      EXPECT_NEAR(dq[row * n + i], one[i], 5000 * unit_roundoff<T>() * one.norm()) << row;
  }
}

TEST(GradientsInput, IsRefusedByName) {
  const Model<double> model = chain(27, 4);
  const RobotModel robot = plain(model);
  const auto make = [&](const Question& question) {
    return message_of([&] { Gradients<double>(robot, {.question = question}); });
  };
  EXPECT_EQ(make({.dofs = {0, 1}}), "gradients: of a question that leaves joints out");
  EXPECT_EQ(make({.locked = {0}, .q = {0, 0, 0, 0}}),
            "gradients: of a question that leaves joints out");
  EXPECT_EQ(make({.at_rest = true}), "gradients: of a question that is at rest");
  EXPECT_EQ(make({.acted_on = {{-1}}}),
            "gradients: a frame on the fixed base, where forces and loads do nothing");
  EXPECT_EQ(make({.loaded = {{-1}}}),
            "gradients: a frame on the fixed base, where forces and loads do nothing");

  Gradients<double> gradients(robot, {.question = {.acted_on = {{3}}}});
  const VectorX<double> x = VectorX<double>::Zero(4), few = VectorX<double>::Zero(3);
  VectorX<double> out(4), six = VectorX<double>::Zero(6);
  EXPECT_EQ(message_of([&] { (void)gradients.forward_dynamics_vjp(x, x, x, few, {.dq = out}); }),
            "forward_dynamics_vjp: w has size 1 x 3, 1 x 4 is needed");
  EXPECT_EQ(
      message_of([&] { (void)gradients.forward_dynamics_vjp(x, x, x, x, {.inertias = out}); }),
      "forward_dynamics_vjp: inertias has size 1 x 4, 1 x 40 is needed");
  EXPECT_EQ(message_of([&] { (void)gradients.solve_vjp(x, x, x, {.dqd = out}); }),
            "solve_vjp: dqd: of what does not move");
  const MatrixX<double> W = MatrixX<double>::Zero(6, 6), less = MatrixX<double>::Zero(5, 6);
  EXPECT_THROW((void)gradients.operational_vjp(x, W, {.dq = out}), std::logic_error);
  Gradients<double> framed(robot, {.question = {.frames = {{3}}}});
  EXPECT_EQ(message_of([&] { (void)framed.operational_vjp(x, less, {.dq = out}); }),
            "operational_vjp: W has size 5 x 6, 6 x 6, column-major, is needed");
  EXPECT_EQ(message_of([&] { (void)framed.operational_vjp(x, W, {.dtau = out}); }),
            "operational_vjp: of dq, inertias, armature and loads alone");
  EXPECT_EQ(message_of([&] { gradients.inverse_dynamics_vjp(x, x, x, x, {.result = out}); }),
            "inverse_dynamics_vjp: result: is not worked out");
  EXPECT_EQ(message_of([&] {
              (void)gradients.forward_dynamics_vjp(
                  x, x, x, x, {.dq = out},
                  {.on = VectorView<const double>(six), .axes = Axes::aligned});
            }),
            "forward_dynamics_vjp: forces that do not turn with their frames: Axes::local is "
            "needed");
}

TEST(GradientsInput, OfASingularRobotFails) {
  const Model<double> model = chain(28, 4);
  RobotModel robot = plain(model);
  robot.links[3].mass = 0;
  robot.links[3].principal_moments = {0, 0, 0};
  Gradients<double> gradients(robot);
  const State<double> state = random_state(model, 29);
  VectorX<double> out = poisoned<double>(4);
  EXPECT_EQ(
      gradients.forward_dynamics_vjp(state.q, state.qd, state.tau, state.tau, {.dq = out}).status,
      Outcome::Status::singular);
}

}  // namespace
}  // namespace kalmarm::test
