#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "accuracy/measures/measures.hpp"
#include "accuracy/truth/enclosure.hpp"
#include "accuracy/truth/truth.hpp"
#include "algorithms/study/solver.hpp"
#include "algorithms/test/models.hpp"

namespace kalmarm {
namespace {

using test::Random;
using test::State;

constexpr double inf = std::numeric_limits<double>::infinity();

bool holds(const Ball& ball, const Real& x) { return arb_contains(ball.data(), Ball(x).data()); }

TEST(Balls, HoldWhatMoreDigitsGive) {
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const double a = random.uniform(-3, 3), b = random.uniform(0.1, 2),
                 c = random.uniform(-1e9, 1e9);
    const auto f = [&](const auto& x, const auto& y, const auto& z) {
      using std::abs, std::cos, std::sin, std::sqrt;
      return (sin(x * z) - x / (y + cos(z))) * sqrt(y) - abs(z - x) / y;
    };
    Ball ball;
    {
      const Digits digits(25);
      const BallDigits centres;
      ball = f(Ball(a), Ball(b), Ball(c));
      EXPECT_LT(bound_of(radius(ball)), 1e-12);
      EXPECT_GT(bound_of(radius(ball)), 0);
    }
    const Digits digits(200);
    const BallDigits centres;
    EXPECT_TRUE(holds(ball, f(Real(a), Real(b), Real(c)))) << i;
  }
}

TEST(Balls, AreComparedWhereItIsCertain) {
  const Ball wide = widened(Ball(1), Ball(2)), nan = sqrt(Ball(-1));
  for (const Ball& x : {wide, nan}) {
    EXPECT_FALSE(x > Ball(0));
    EXPECT_FALSE(x < Ball(0));
    EXPECT_FALSE(x == Ball(1));
    EXPECT_FALSE(x <= Ball(-1));
  }
  EXPECT_TRUE(wide < Ball(4));
  EXPECT_GE(bound_of(wide), 3);
  EXPECT_LT(bound_of(wide), 3 + 1e-8);
  EXPECT_EQ(bound_of(Ball(1) / wide), inf);
  EXPECT_EQ(bound_of(nan), inf);
}

TEST(Balls, ProductsOfMatricesHoldTheirEntries) {
  Random random(2);
  for (const int n : {3, 60}) {
    MatrixX<double> A(n, n), B(n, n);
    for (double& x : A.reshaped()) x = random.uniform(-1, 1) * std::pow(10, random.uniform(-9, 9));
    for (double& x : B.reshaped()) x = random.uniform(-1, 1) * std::pow(10, random.uniform(-9, 9));
    const MatrixX<Ball> C = product(A.cast<Ball>(), B.cast<Ball>());
    const Digits digits(200);
    const MatrixX<Real> exact = A.cast<Real>() * B.cast<Real>();
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) EXPECT_TRUE(holds(C(i, j), exact(i, j)));
  }
}

// Truth by other algorithms, with many more digits.
struct Reference {
  VectorX<Real> a, D;
  MatrixX<Real> M, X, g;

  Reference(const Model<double>& model, const State<double>& state)
      : a(model.nv()), D(model.nv()), M(model.nv(), model.nv()), X(M), g(6, model.nv()) {
    const State<Real> s = state.cast<Real>();
    const auto batch = make_solver<Real>("Batch<EigenLDLT>", model.cast<Real>()),
               filter = make_solver<Real>("Sequential<Conventional>", model.cast<Real>());
    EXPECT_TRUE(batch->acceleration(s.q, s.qd, s.tau, a));
    EXPECT_TRUE(batch->inverse(s.q, X));
    batch->mass(s.q, M);
    EXPECT_TRUE(filter->factors(s.q, D, g));
  }
};

// The state, and an enclosure of it with `digits` in force.
struct Enclosed {
  Digits digits;
  BallDigits centres;
  Enclosure enclosure;

  Enclosed(const Model<double>& model, const State<double>& state, const VectorX<Real>& x,
           unsigned carried)
      : digits(carried), enclosure(model, state.q, x) {}
};

class EnclosureOf : public testing::TestWithParam<test::Family> {};

// Of truths as they come, and of what few digits give.
TEST_P(EnclosureOf, NoErrorIsLargerThanItsWidth) {
  for (const std::uint64_t seed : {1, 2, 3, 4}) {
    SCOPED_TRACE(seed);
    const Model<double> model = GetParam().make(seed);
    const State<double> state = test::random_state(model, seed);
    const Truth<double> t = truth(model, state.q, {{state.tau, state.qd}});
    ASSERT_TRUE(t.outcome);
    EXPECT_LE(t.largest_width(), 1e-25);

    const Digits digits(300);
    const Reference exact(model, state);
    const auto expect_within = [&](const AnswerWidths& width, const AccelerationWidth& a_width,
                                   const VectorX<Real>& a, const MatrixX<Real>& M,
                                   const MatrixX<Real>& X, const VectorX<Real>& D,
                                   const MatrixX<Real>& g) {
      const double slack = 1 + 1e-6;  // a width is relative to what is given, an error to the truth
      const AccelerationError e = acceleration_error(a, exact.a, exact.M);
      EXPECT_LE(e.relative, a_width.relative * slack);
      EXPECT_LE(e.energy, a_width.energy * slack);
      EXPECT_LE(e.componentwise, a_width.componentwise * slack);
      EXPECT_LE(matrix_error(M, exact.M).scaled, width.M * slack);
      EXPECT_LE(matrix_error(X, exact.X).scaled, width.X * slack);
      const FactorError f = factor_error(D, g, exact.D, exact.g);
      EXPECT_LE(f.D, width.D * slack);
      EXPECT_LE(f.g, width.g * slack);
    };
    expect_within(t.width, t.responses[0].width, t.responses[0].a, t.M, t.X, t.D, t.g);

    // in double, as it comes
    const VectorX<Real> a = exact.a.cast<double>().cast<Real>(),
                        D = exact.D.cast<double>().cast<Real>();
    const MatrixX<Real> M = exact.M.cast<double>().cast<Real>(),
                        X = exact.X.cast<double>().cast<Real>(),
                        g = exact.g.cast<double>().cast<Real>();
    const Enclosed at(model, state, X.diagonal(), 60);
    const AccelerationWidth a_width = at.enclosure.acceleration_width(
        state.qd.cast<Real>(), state.tau.cast<Real>(), model.gravity().cast<Real>(), a);
    EXPECT_LT(a_width.relative, 1e-6);
    EXPECT_GT(a_width.relative, 1e-18);
    expect_within({at.enclosure.mass_width(M), at.enclosure.inverse_width(X),
                   at.enclosure.D_width(D), at.enclosure.g_width(g)},
                  a_width, a, M, X, D, g);
  }
}

// One number of a truth, wrong by 1e-20 of its scale.
TEST_P(EnclosureOf, WhatIsWrongIsNotProven) {
  const Model<double> model = GetParam().make(5);
  const State<double> state = test::random_state(model, 5);
  const Truth<double> t = truth(model, state.q, {{state.tau, state.qd}});
  ASSERT_TRUE(t.outcome);
  const Enclosed at(model, state, t.X.diagonal(), 60);
  const Enclosure& enclosure = at.enclosure;
  ASSERT_TRUE(enclosure.definite());
  const Real error("1e-20");
  const double seen = 0.99e-20;
  for (int k = 0; k < model.nv(); ++k) {
    const int j = (k + 3) % model.nv();
    VectorX<Real> a = t.responses[0].a, D = t.D;
    MatrixX<Real> M = t.M, X = t.X, g = t.g;
    a[k] += error * a.norm();
    D[k] += error * D[k];
    M(j, k) += error * sqrt(M(j, j) * M(k, k));
    X(j, k) += error * sqrt(X(j, j) * X(k, k));
    g(k % 6, k) += error * g.col(k).norm();
    const AccelerationWidth width = enclosure.acceleration_width(
        state.qd.cast<Real>(), state.tau.cast<Real>(), model.gravity().cast<Real>(), a);
    EXPECT_GT(width.relative, seen);
    EXPECT_GT(width.componentwise, seen);
    EXPECT_GT(enclosure.D_width(D), seen);
    EXPECT_GT(enclosure.mass_width(M), seen);
    EXPECT_GT(enclosure.inverse_width(X), seen);
    EXPECT_GT(enclosure.g_width(g), seen);
  }
  MatrixX<Real> X = t.X;
  X(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(enclosure.inverse_width(X), inf);
}

// M >= diag(theta) is false where theta(k) = 2 / M^-1(k,k), and where it cannot be told from that.
TEST_P(EnclosureOf, NoFalseFloorIsProven) {
  const Model<double> model = GetParam().make(6);
  const State<double> state = test::random_state(model, 6);
  const Truth<double> t = truth(model, state.q, {{state.tau, state.qd}});
  ASSERT_TRUE(t.outcome);
  for (int k = 0; k < model.nv(); ++k) {
    VectorX<Real> x = t.X.diagonal();
    EXPECT_TRUE(Enclosed(model, state, x, 60).enclosure.definite());
    x[k] /= 4 * model.nv();
    const Enclosed at(model, state, x, 60);
    EXPECT_FALSE(at.enclosure.definite());
    EXPECT_EQ(at.enclosure.inverse_width(t.X), inf);
    const Response<double>& response = t.responses[0];
    const AccelerationWidth width = at.enclosure.acceleration_width(
        state.qd.cast<Real>(), state.tau.cast<Real>(), model.gravity().cast<Real>(), response.a);
    EXPECT_EQ(width.relative, inf);
    EXPECT_EQ(width.energy, inf);
    EXPECT_EQ(width.componentwise, inf);
  }
}

INSTANTIATE_TEST_SUITE_P(Families, EnclosureOf, testing::ValuesIn(test::families()),
                         [](const auto& info) { return std::string(info.param.name); });

// Two hinges on one axis, the massless link between them: M is singular, and nothing is proven of
// it with any digits.
TEST(Enclosure, SingularMechanismsAreNotDefinite) {
  Random random(3);
  test::Builder builder;
  builder.add(test::random_joint(random, -1));
  Joint<double> joint = test::random_joint(random, 0);
  const int link = builder.add_massless(joint);
  joint.parent = link;
  joint.rotation = {1, 0, 0, 0};
  joint.translation.setZero();
  builder.add(joint);
  const Model<double> model = builder.build();
  const State<double> state = test::random_state(model, 3);
  for (const unsigned digits : {30u, 300u, 1000u})
    for (const double x : {1e-3, 1.0, 1e20}) {
      const Digits in_force(digits);
      const Enclosed at(model, state, VectorX<Real>::Constant(3, x), digits);
      EXPECT_FALSE(at.enclosure.definite());
      EXPECT_EQ(at.enclosure.D_width(VectorX<Real>::Ones(3)), inf);
    }
}

// Every entry of M and of a torque, in link after link.
TEST_P(EnclosureOf, BallsOfTheWorldFrameHoldWhatMoreDigitsGive) {
  for (const std::uint64_t seed : {7, 8, 9}) {
    const Model<double> model = GetParam().make(seed);
    const State<double> state = test::random_state(model, seed);
    MatrixX<Ball> M;
    VectorX<Ball> tau;
    {
      const Digits digits(25);
      const BallDigits centres;
      const Model<Ball> exact = model.cast<Ball>();
      const WorldMechanics<Ball> world(exact, state.q.cast<Ball>());
      M = world.mass();
      tau =
          world.torque(state.qd.cast<Ball>(), state.tau.cast<Ball>(), model.gravity().cast<Ball>());
    }
    const Digits digits(200);
    const BallDigits centres;
    const Model<Real> exact = model.cast<Real>();
    const WorldMechanics<Real> world(exact, state.q.cast<Real>());
    const MatrixX<Real> true_M = world.mass();
    const VectorX<Real> true_tau =
        world.torque(state.qd.cast<Real>(), state.tau.cast<Real>(), model.gravity().cast<Real>());
    for (int k = 0; k < model.nv(); ++k) {
      EXPECT_TRUE(holds(tau[k], true_tau[k])) << k;
      for (int j = 0; j < model.nv(); ++j) EXPECT_TRUE(holds(M(j, k), true_M(j, k))) << j << k;
    }
  }
}

TEST(Enclosure, OrientationsHoldTheirProducts) {
  Random random(4);
  std::vector<Eigen::Quaternion<double>> turns;
  for (int k = 0; k < 3000; ++k)
    turns.emplace_back(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1),
                       random.uniform(-1, 1));
  std::vector<Orientation<Ball>> products;
  {
    const Digits digits(20);
    const BallDigits centres;
    Orientation<Ball> product;
    for (const auto& turn : turns) products.push_back(product = product.turned(turn.cast<Ball>()));
    EXPECT_LT(bound_of(product.s), 1e-15);
  }
  const Digits digits(200);
  const BallDigits centres;
  Orientation<Real> exact;
  for (std::size_t k = 0; k < turns.size(); ++k) {
    exact = exact.turned(turns[k].cast<Real>());
    for (int i = 0; i < 4; ++i)
      EXPECT_TRUE(holds(products[k].Q.coeffs()[i], exact.Q.coeffs()[i])) << k << ' ' << i;
  }
}

TEST(Enclosure, FactorsOfLongChainsLieInTheirBalls) {
  const int n = 300;
  const Model<double> model = test::chain(2, n);
  const State<double> state = test::random_state(model, 2);
  std::optional<FactorBalls> factors;
  {
    const Digits digits(20);
    const BallDigits centres;
    const Model<Ball> exact = model.cast<Ball>();
    LinkKinematics<Ball> kin(exact);
    set_position(exact, VectorX<Ball>(state.q.cast<Ball>()), kin);
    factors = factor_balls(exact, kin);
    ASSERT_TRUE(factors);
  }
  const Digits digits(200);
  const BallDigits centres;
  VectorX<Real> D(n);
  MatrixX<Real> g(6, n);
  ASSERT_TRUE(make_solver<Real>("Sequential<Conventional>", model.cast<Real>())
                  ->factors(state.q.cast<Real>(), D, g));
  for (int k = 0; k < n; ++k) {
    EXPECT_TRUE(holds(factors->D[k], D[k])) << k;
    for (int i = 0; i < 6; ++i) EXPECT_TRUE(holds(factors->g(i, k), g(i, k))) << k << ' ' << i;
  }
}

// Radii of orientations add up: 1000 links in random directions lose less than ten digits.
TEST(Enclosure, WidthsDoNotGrowExponentiallyWithLength) {
  const Model<double> model = test::chain(1, 1000);
  const State<double> state = test::random_state(model, 1);
  const Digits digits(40);
  const BallDigits centres;
  const Model<Ball> exact = model.cast<Ball>();
  const VectorX<Ball> q = state.q.cast<Ball>();
  const WorldMechanics<Ball> world(exact, q);
  const VectorX<Ball> tau =
      world.torque(state.qd.cast<Ball>(), state.tau.cast<Ball>(), model.gravity().cast<Ball>());
  Ball size = 0, radii = 0;
  for (const Ball& entry : tau) {
    size += abs(entry);
    radii += radius(entry);
  }
  EXPECT_LT(bound_of(radii / size), 1e-30);
  LinkKinematics<Ball> kin(exact);
  set_position(exact, q, kin);
  const auto factors = factor_balls(exact, kin);
  ASSERT_TRUE(factors);
  for (const Ball& D : factors->D) EXPECT_LT(bound_of(radius(D) / D), 1e-30);
}

}  // namespace
}  // namespace kalmarm
