// Derivatives of forward dynamics against differences of truth in 50 digits, against physics, and
// against one column at a time in every size.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "algorithms/structured/derivatives.hpp"
#include "algorithms/structured/test/support.hpp"
#include "algorithms/test/singular.hpp"

namespace kalmarm::test {
namespace {

template <class T>
struct Derivatives {
  MatrixX<T> dq, dqd, dtau;
  VectorX<T> a;

  explicit Derivatives(int n)
      : dq(MatrixX<T>::Constant(n, n, std::numeric_limits<T>::quiet_NaN())),
        dqd(dq),
        dtau(dq),
        a(poisoned<T>(n)) {}
};

template <class T>
Derivatives<T> derivatives(const Model<T>& model, const State<T>& state) {
  StructuredDerivatives<T> solver(model);
  Derivatives<T> out(model.nv());
  EXPECT_TRUE(solver.derivatives(state.q, state.qd, state.tau, out.dq, out.dqd, out.dtau, out.a));
  return out;
}

// The same from the kernels, for a T in which columns are worked on one at a time.
template <class T>
Derivatives<T> one_at_a_time(const Model<T>& model, const State<T>& state) {
  static_assert(lanes_of<T> == 1);
  const StructuredModel<T> structured(model);
  DerivativeWorkspace<T> ws(structured);
  Derivatives<T> out(model.nv());
  structured_derivatives(structured, state.q.data(), state.qd.data(), state.tau.data(), ws,
                         out.dq.data(), out.dqd.data(), out.dtau.data(), out.a.data());
  return out;
}

// q moved by h along the velocity of DoF k.
State<Mp> moved(const Model<Mp>& model, State<Mp> state, int k, const Mp& h) {
  int first = k;
  while (model.joint(first).coordinate == Coordinate::follower) --first;
  const int i = model.joint(first).q_index;
  if (model.joint(first).coordinate != Coordinate::quaternion) {
    state.q[i + k - first] += h;
    return state;
  }
  Eigen::Quaternion<Mp> turn(cos(Mp(h / 2)), Mp(0), Mp(0), Mp(0));
  turn.vec()[k - first] = sin(Mp(h / 2));
  const auto& q = state.q;
  const Eigen::Quaternion<Mp> turned =
      Eigen::Quaternion<Mp>(q[i], q[i + 1], q[i + 2], q[i + 3]) * turn;
  state.q.segment<4>(i) << turned.w(), turned.x(), turned.y(), turned.z();
  return state;
}

VectorX<Mp> acceleration(const Model<Mp>& model, const State<Mp>& state) {
  const World world(model, state.q, state.qd);
  return world.mass_matrix().llt().solve(state.tau - world.bias());
}

// Central differences: their error is about the square of the step, 1e-34.
Derivatives<Mp> differences(const Model<Mp>& model, const State<Mp>& state) {
  const Mp h("1e-17");
  Derivatives<Mp> out(model.nv());
  out.a = acceleration(model, state);
  out.dtau = World(model, state.q, state.qd).mass_matrix().inverse();
  for (int k = 0; k < model.nv(); ++k) {
    out.dq.col(k) = (acceleration(model, moved(model, state, k, h)) -
                     acceleration(model, moved(model, state, k, -h))) /
                    (2 * h);
    State<Mp> faster = state, slower = state;
    faster.qd[k] += h;
    slower.qd[k] -= h;
    out.dqd.col(k) = (acceleration(model, faster) - acceleration(model, slower)) / (2 * h);
  }
  return out;
}

// Largest of the four relative errors. What ought to be zero is held against 1.
template <class T, class U>
double error(const Derivatives<T>& x, const Derivatives<U>& truth) {
  const auto relative = [](const auto& is, const auto& should) {
    const U size = should.norm(), d = (is.template cast<U>() - should).norm();
    return static_cast<double>(size > U(1e-20) ? U(d / size) : d);
  };
  return std::max({relative(x.dq, truth.dq), relative(x.dqd, truth.dqd),
                   relative(x.dtau, truth.dtau), relative(x.a, truth.a)});
}

double condition(const MatrixX<Mp>& inverse) {
  const VectorX<Mp> scale = inverse.diagonal().cwiseSqrt().cwiseInverse();
  const MatrixX<double> scaled = (scale.asDiagonal() * inverse * scale.asDiagonal()).cast<double>();
  const VectorX<double> lambda =
      Eigen::SelfAdjointEigenSolver<MatrixX<double>>(scaled).eigenvalues();
  return lambda.maxCoeff() / lambda.minCoeff();
}

// A chain that goes through tiles, the last of which is not full.
Model<double> long_chain(std::uint64_t seed, int n) {
  Random random(seed);
  Builder builder;
  for (int k = 0; k < n; ++k) {
    Joint<double> joint =
        random_joint(random, k - 1, random.chance(0.3) ? Coordinate::distance : Coordinate::angle);
    if (random.chance(0.4)) joint.r = random.uniform(0.01, 0.1);
    builder.add(joint);
  }
  return builder.build();
}

TEST(StructuredDerivatives, AgreeWithDifferencesOfTruth) {
  std::vector<Family> all = all_families();
  all.push_back({"long_chain", [](std::uint64_t seed) { return long_chain(seed, 19); }});
  for (const Family& family : all) {
    const Model<double> model = family.make(3);
    const State<double> state = random_state(model, 4);
    const Derivatives<Mp> truth = differences(model.cast<Mp>(), state.cast<Mp>());
    const double kappa = condition(truth.dtau), bound = 40 + 2 * std::sqrt(kappa);

    EXPECT_LE(error(one_at_a_time(model.cast<Mp>(), state.cast<Mp>()), truth), 1e-28)
        << family.name;
    const double float64 = error(derivatives(model, state), truth);
    const double float32 = error(derivatives(model.cast<float>(), state.cast<float>()), truth);
    EXPECT_LE(float64, unit_roundoff<double>() * bound) << family.name;
    EXPECT_LE(float32, unit_roundoff<float>() * bound) << family.name;
    RecordProperty(std::string(family.name) + "_float64", std::to_string(float64 * 0x1p53));
    RecordProperty(std::string(family.name) + "_float32", std::to_string(float32 * 0x1p24));
    RecordProperty(std::string(family.name) + "_condition", std::to_string(kappa));
  }
}

template <class T>
class DerivativesOf : public testing::Test {};

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(DerivativesOf, Precisions, PrecisionName);

TYPED_TEST(DerivativesOf, EverySizeAgreesWithOneColumnAtATime) {
  using T = TypeParam;
  for (int n = 1; n <= 70; n += n < 40 ? 1 : 7) {
    const Model<double> parameters = n % 3 == 0 ? long_chain(7, n) : chain(7, n);
    const State<double> state = random_state(parameters, 8);
    const Derivatives<long double> truth =
        one_at_a_time(parameters.cast<long double>(), state.cast<long double>());
    const Derivatives<T> out = derivatives(parameters.cast<T>(), state.template cast<T>());
    EXPECT_LE(error(out, truth), 1000 * unit_roundoff<T>()) << n;
  }
}

TYPED_TEST(DerivativesOf, NothingIsWrittenOutside) {
  using T = TypeParam;
  constexpr int guard = 32;
  for (int n : {1, 5, 8, 13, 16, 23, 37}) {
    const Model<T> model = chain(7, n).cast<T>();
    const State<T> state = random_state(chain(7, n), 8).template cast<T>();
    const StructuredModel<T> structured(model);
    DerivativeWorkspace<T> ws(structured);
    std::vector<T> out[3];
    for (auto& matrix : out) matrix.assign(n * n + 2 * guard, T(-77));
    VectorX<T> a(n);
    structured_derivatives(structured, state.q.data(), state.qd.data(), state.tau.data(), ws,
                           &out[0][guard], &out[1][guard], &out[2][guard], a.data());
    for (const auto& matrix : out)
      for (int i = 0; i < guard; ++i) {
        EXPECT_EQ(matrix[i], T(-77)) << n;
        EXPECT_EQ(matrix[guard + n * n + i], T(-77)) << n;
      }
  }
}

TYPED_TEST(DerivativesOf, TorqueGivesASymmetricMatrixToTheBit) {
  using T = TypeParam;
  std::vector<Family> all = all_families();
  all.push_back({"long_chain", [](std::uint64_t seed) { return long_chain(seed, 45); }});
  for (const Family& family : all) {
    const Model<double> model = family.make(5);
    const Derivatives<T> out =
        derivatives(model.cast<T>(), random_state(model, 6).template cast<T>());
    EXPECT_TRUE((out.dtau.array() == out.dtau.transpose().array()).all()) << family.name;
  }
}

// Galileo: neither where a free robot is nor how fast it travels matters, to the bit.
TYPED_TEST(DerivativesOf, TravellingChangesNothing) {
  using T = TypeParam;
  const Model<double> model = floating_base(11);
  const State<double> state = random_state(model, 12);
  State<double> far = state;
  far.q.head<3>() += Vector3<double>(1e6, -3e5, 7e7);
  far.qd.head<3>() += Vector3<double>(1e4, 2e3, -5e3);
  const Derivatives<T> here = derivatives(model.cast<T>(), state.cast<T>());
  const Derivatives<T> there = derivatives(model.cast<T>(), far.cast<T>());
  EXPECT_TRUE((here.dq.array() == there.dq.array()).all());
  EXPECT_TRUE((here.dqd.array() == there.dqd.array()).all());
  EXPECT_TRUE((here.dtau.array() == there.dtau.array()).all());
  EXPECT_TRUE(here.dq.leftCols(3).isZero(0));
  EXPECT_TRUE(here.dqd.leftCols(3).isZero(0));
}

// In a uniform field, a robot that nothing holds moves its joints alike in every attitude.
TYPED_TEST(DerivativesOf, TurningAFreeRobotDoesNotMoveItsJoints) {
  using T = TypeParam;
  const Model<double> model = floating_base(13);
  State<double> state = random_state(model, 14);
  state.tau.head<6>().setZero();
  const Derivatives<T> out = derivatives(model.cast<T>(), state.cast<T>());
  const auto turned = out.dq.template middleCols<3>(3);
  EXPECT_LE(turned.bottomRows(model.nv() - 3).norm(), 500 * unit_roundoff<T>() * out.dq.norm());
  // The base itself falls in another direction of its own axes, which are the world's: not at all.
  EXPECT_GE(out.dq.norm(), 1);
}

TYPED_TEST(DerivativesOf, TreesOfAForestDoNotTouch) {
  using T = TypeParam;
  const Model<double> model = forest(3);
  const Derivatives<T> out =
      derivatives(model.cast<T>(), random_state(model, 4).template cast<T>());
  for (int i = 0; i < model.nv(); ++i)
    for (int j = 0; j < model.nv(); ++j) {
      if (i % 3 == j % 3) continue;
      EXPECT_EQ(out.dq(i, j), T(0));
      EXPECT_EQ(out.dqd(i, j), T(0));
      EXPECT_EQ(out.dtau(i, j), T(0));
    }
}

TYPED_TEST(DerivativesOf, SingularMechanismIsRefusedAndItsNeighbourIsNot) {
  using T = TypeParam;
  const auto outcome = [](const Mechanism& mechanism) {
    const Model<T> model = mechanism.model.template cast<T>();
    StructuredDerivatives<T> solver(model);
    Derivatives<T> out(model.nv());
    const VectorX<T> ones = VectorX<T>::Ones(model.nv());
    return solver.derivatives(mechanism.q.template cast<T>(), ones, ones, out.dq, out.dqd, out.dtau,
                              out.a);
  };
  for (int seed = 0; seed < 10; ++seed) {
    for (const Mechanism& mechanism : singular_mechanisms(seed)) {
      const Outcome refused = outcome(mechanism);
      EXPECT_EQ(refused.status, Outcome::Status::singular) << mechanism.name << " seed " << seed;
      EXPECT_TRUE(std::ranges::count(mechanism.joints, refused.joint)) << mechanism.name;
    }
    for (const Mechanism& mechanism : regular_mechanisms(seed))
      EXPECT_TRUE(outcome(mechanism)) << mechanism.name << " seed " << seed;
  }
}

TYPED_TEST(DerivativesOf, StateThatIsNotANumberIsRefused) {
  using T = TypeParam;
  const Model<T> model = chain(3).cast<T>();
  const State<T> state = random_state(chain(3), 4).template cast<T>();
  for (int part = 0; part < 3; ++part) {
    State<T> bad = state;
    (part == 0 ? bad.q : part == 1 ? bad.qd : bad.tau)[4] = std::numeric_limits<T>::quiet_NaN();
    StructuredDerivatives<T> solver(model);
    Derivatives<T> out(model.nv());
    EXPECT_FALSE(solver.derivatives(bad.q, bad.qd, bad.tau, out.dq, out.dqd, out.dtau, out.a));
  }
}

// Joint by joint, and then for every pair of joints of a chain.
TEST(StructuredDerivatives, FlopsGrowAsTheirEquationsSay) {
  const auto flops = [](int n) {
    const Model<double> model = chain(1, n);
    const State<double> state = random_state(model, 3);
    const StructuredModel<double> structured(model);
    DerivativeWorkspace<Count> ws(structured);
    const auto counts = [](const VectorX<double>& x) {
      return std::vector<Count>(x.begin(), x.end());
    };
    const std::vector<Count> q = counts(state.q), qd = counts(state.qd), tau = counts(state.tau);
    std::vector<Count> dq(n * n, 0), dqd = dq, dtau = dq, a(n, 0);
    Count::flops = 0;
    structured_derivatives(structured, q.data(), qd.data(), tau.data(), ws, dq.data(), dqd.data(),
                           dtau.data(), a.data());
    return static_cast<double>(Count::flops);
  };
  const double small = flops(40), large = flops(80);
  const double pairs = (large - 2 * small) / (80 * 80 - 2 * 40 * 40);
  const double joints = small / 40 - 40 * pairs;
  EXPECT_LE(pairs, 140);
  EXPECT_GE(pairs, 80) << "does it count?";
  EXPECT_LE(joints, 1400);
  RecordProperty("flops_a_pair", std::to_string(pairs));
  RecordProperty("flops_a_joint", std::to_string(joints));
}

}  // namespace
}  // namespace kalmarm::test
