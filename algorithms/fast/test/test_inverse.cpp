// M^-1, M and solves of the fast path against truth of the world frame, as accurate as the
// conventional form, symmetric, of every size; and their promises: flops, outcomes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "algorithms/inverse_mass/sequential.hpp"
#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/structured/inverse.hpp"
#include "algorithms/structured/mass.hpp"
#include "algorithms/structured/test/support.hpp"
#include "algorithms/test/singular.hpp"

namespace kalmarm::test {
namespace {

template <class T>
MatrixX<T> poisoned_matrix(int rows, int columns) {
  return MatrixX<T>::Constant(rows, columns, std::numeric_limits<T>::quiet_NaN());
}

MatrixX<Mp> true_mass(const Model<Mp>& model, const VectorX<Mp>& q) {
  return World(model, q, VectorX<Mp>::Zero(model.nv())).mass_matrix();
}

MatrixX<Mp> true_inverse(const MatrixX<Mp>& M) {
  return Eigen::LDLT<MatrixX<Mp>>(M).solve(MatrixX<Mp>::Identity(M.rows(), M.cols()));
}

// Largest |X - exact| / sqrt(diagonal diagonal): joints may have any units.
template <class T>
double error(const MatrixX<T>& X, const MatrixX<Mp>& exact) {
  Mp worst = 0;
  for (int i = 0; i < X.rows(); ++i)
    for (int j = 0; j < X.cols(); ++j) {
      const Mp d = Mp(X(i, j)) - exact(i, j);
      const Mp relative = abs(d) / sqrt(Mp(exact(i, i) * exact(j, j)));
      if (!(relative <= worst)) worst = relative;
    }
  return worst.convert_to<double>();
}

template <class T>
MatrixX<T> conventional_inverse(const Model<T>& model, const VectorX<T>& q) {
  RandomModel<T> rm(model);
  typename Sequential<Conventional>::template Workspace<T> ws(model);
  MatrixX<T> X(model.nv(), model.nv());
  set_position(model, q, rm);
  EXPECT_TRUE((Sequential<Conventional>::factor(model, rm, ws)));
  Sequential<Conventional>::inverse(model, rm, ws, X);
  return X;
}

template <class T>
MatrixX<T> conventional_mass(const Model<T>& model, const VectorX<T>& q) {
  RandomModel<T> rm(model);
  CompositeInertia<T> composite(model);
  MatrixX<T> M(model.nv(), model.nv());
  set_position(model, q, rm);
  mass_matrix(model, rm, composite, Eigen::Ref<MatrixX<T>>(M));
  return M;
}

template <class T>
MatrixX<T> structured_inverse(const Model<T>& model, const VectorX<T>& q) {
  StructuredInverse<T> structured(model);
  MatrixX<T> X = poisoned_matrix<T>(model.nv(), model.nv());
  EXPECT_TRUE(structured.inverse(q, X));
  return X;
}

template <class T>
MatrixX<T> structured_mass(const Model<T>& model, const VectorX<T>& q) {
  StructuredMass<T> structured(model);
  MatrixX<T> M = poisoned_matrix<T>(model.nv(), model.nv());
  structured.mass(q, M);
  return M;
}

// A chain that is taken by blocks in both precisions, with joints of all kinds.
Model<double> long_chain(std::uint64_t seed) {
  Random random(seed);
  Builder builder;
  int link = builder.add_free(random_joint(random, -1));
  while (builder.nv() < 201) {
    const double kind = random.uniform(0, 1);
    Joint<double> joint =
        random_joint(random, link, kind < 0.2 ? Coordinate::distance : Coordinate::angle);
    joint.translation *= 0.3;
    if (random.chance(0.2)) joint.r = random.uniform(0.01, 0.1);
    link = kind > 0.95 ? builder.add_ball(joint) : builder.add(joint);
  }
  return builder.build();
}

std::vector<Family> families_and_long_chain() {
  std::vector<Family> all = all_families();
  all.push_back({"long_chain", long_chain});
  return all;
}

// Geometric mean of the ratio of the errors, and the largest error in units of the roundoff.
struct Judgement {
  double log_ratio = 0, worst = 0;

  template <class T>
  void see(const MatrixX<T>& X, const MatrixX<T>& conventional, const MatrixX<Mp>& exact) {
    const double u = static_cast<double>(unit_roundoff<T>());
    const double mine = error(X, exact) / u, theirs = error(conventional, exact) / u;
    log_ratio += std::log((mine + 0.1) / (theirs + 0.1));
    worst = std::max(worst, mine);
  }
};

template <class T>
void expect_accurate(int seeds) {
  for (const Family& family : families_and_long_chain()) {
    const bool is_long = std::string(family.name) == "long_chain";
    const int count = is_long ? 1 : seeds;
    Judgement inverse, mass;
    for (int seed = 0; seed < count; ++seed) {
      const Model<double> drawn = family.make(seed);
      const Model<T> model = drawn.cast<T>();
      const VectorX<T> q = random_state(drawn, seed + 1000).template cast<T>().q;
      const MatrixX<Mp> M = true_mass(model.template cast<Mp>(), q.template cast<Mp>());
      inverse.see(structured_inverse(model, q), conventional_inverse(model, q), true_inverse(M));
      mass.see(structured_mass(model, q), conventional_mass(model, q), M);
    }
    // Near gimbal lock (massless_links) M^-1 loses what the condition of M allows.
    const bool locks = std::string(family.name) == "massless_links";
    EXPECT_LE(inverse.worst, locks ? 1600 : is_long ? 500 : 80) << family.name;
    EXPECT_LE(mass.worst, is_long ? 250 : 80) << family.name;
    EXPECT_LE(std::exp(inverse.log_ratio / count), 1.7) << family.name;
    EXPECT_LE(std::exp(mass.log_ratio / count), 1.7) << family.name;
    const std::string name = family.name;
    testing::Test::RecordProperty(name + "_inverse_in_u", std::to_string(inverse.worst));
    testing::Test::RecordProperty(name + "_mass_in_u", std::to_string(mass.worst));
    testing::Test::RecordProperty(name + "_inverse_ratio",
                                  std::to_string(std::exp(inverse.log_ratio / count)));
    testing::Test::RecordProperty(name + "_mass_ratio",
                                  std::to_string(std::exp(mass.log_ratio / count)));
  }
}

TEST(StructuredInverse, Float64AgreesWithTruthAsWellAsConventional) { expect_accurate<double>(5); }
TEST(StructuredInverse, Float32AgreesWithTruthAsWellAsConventional) { expect_accurate<float>(5); }

TEST(StructuredInverse, EquationsHoldInMultiPrecision) {
  for (const Family& family : all_families()) {
    SCOPED_TRACE(family.name);
    const Model<double> drawn = family.make(3);
    const int nv = drawn.nv();
    const Model<Mp> model = drawn.cast<Mp>();
    const State<Mp> state = random_state(drawn, 4).cast<Mp>();
    const MatrixX<Mp> M = true_mass(model, state.q), X = true_inverse(M);
    const StructuredModel<Mp> structured(model);

    StructuredFactors<Mp> factors(structured);
    structured_factor(structured, state.q.data(), factors);
    ColumnsWorkspace<Mp> ws(structured);
    const std::vector<char> all(nv, 1);
    MatrixX<Mp> solved(nv, 1);
    detail::sweep_inward(
        structured, factors, nv - 1, all.data(), [&](int k) { return state.tau[k]; }, ws);
    detail::sweep_outward(structured, factors, nv - 1, ws,
                          [&](int k, const Mp& a) { solved(k, 0) = a; });
    EXPECT_LE(Mp((M * solved - state.tau).norm() / state.tau.norm()), 1e-38);

    LambdaWorkspace<Mp> lambda(structured);
    structured_lambda(structured, factors, lambda);
    for (int k = 0; k < nv; ++k) EXPECT_LE(Mp(abs(lambda.alpha[k] / X(k, k) - 1)), 1e-38) << k;

    CompositeForces<Mp> composite(structured);
    structured_composite(structured, state.q.data(), composite);
    for (int j = 0; j < nv; ++j) {
      detail::sweep_composite_forces(structured, composite, j, j, all.data(), ws);
      for (int k = 0; k <= j; ++k)
        EXPECT_LE(Mp(abs(ws.e[k] - M(k, j)) / sqrt(Mp(M(k, k) * M(j, j)))), 1e-40) << k << ' ' << j;
    }
  }
}

template <class T>
class Inverses : public testing::Test {};

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Inverses, Precisions, PrecisionName);

template <class T>
void expect_whole_and_symmetric(const Model<double>& drawn) {
  const Model<T> model = drawn.cast<T>();
  const VectorX<T> q = random_state(drawn, 5).template cast<T>().q;
  const MatrixX<T> X = structured_inverse(model, q), M = structured_mass(model, q);
  EXPECT_TRUE(X == X.transpose());
  EXPECT_TRUE(M == M.transpose());
  const T tolerance = 4000 * unit_roundoff<T>();
  const MatrixX<T> X_slow = conventional_inverse(model, q), M_slow = conventional_mass(model, q);
  EXPECT_LE((X - X_slow).norm(), tolerance * X_slow.norm());
  EXPECT_LE((M - M_slow).norm(), tolerance * M_slow.norm());
}

TYPED_TEST(Inverses, ChainsOfEverySizeAreWrittenWholeAndSymmetric) {
  for (int n = 1; n <= 70; ++n) {
    SCOPED_TRACE("chain:" + std::to_string(n));
    expect_whole_and_symmetric<TypeParam>(chain(7, n));
  }
  for (int n = 95; n <= 113; ++n) {
    SCOPED_TRACE("chain:" + std::to_string(n));
    expect_whole_and_symmetric<TypeParam>(chain(7, n));
  }
  expect_whole_and_symmetric<TypeParam>(chain(7, 192));
}

TYPED_TEST(Inverses, TreesAreWrittenWholeAndSymmetric) {
  for (const Family& family : families_and_long_chain()) {
    if (std::string(family.name) == "massless_links") continue;  // errors there are not a few u
    SCOPED_TRACE(family.name);
    for (int seed = 0; seed < 5; ++seed) expect_whole_and_symmetric<TypeParam>(family.make(seed));
  }
}

// Nothing is left from one state in another.
TYPED_TEST(Inverses, StatesDoNotDisturbEachOther) {
  using T = TypeParam;
  for (const Family& family : families_and_long_chain()) {
    const Model<double> drawn = family.make(6);
    const Model<T> model = drawn.template cast<T>();
    const VectorX<T> q = random_state(drawn, 1).template cast<T>().q;
    const VectorX<T> other = random_state(drawn, 2).template cast<T>().q;
    StructuredInverse<T> inverse(model);
    StructuredMass<T> mass(model);
    MatrixX<T> X = poisoned_matrix<T>(model.nv(), model.nv()), M = X;
    EXPECT_TRUE(inverse.inverse(other, X));
    EXPECT_TRUE(inverse.inverse(q, X));
    mass.mass(other, M);
    mass.mass(q, M);
    EXPECT_TRUE(X == structured_inverse(model, q)) << family.name;
    EXPECT_TRUE(M == structured_mass(model, q)) << family.name;
  }
}

TYPED_TEST(Inverses, SolvesOnKeptFactorsAgreeWithInverse) {
  using T = TypeParam;
  for (const Family& family : all_families()) {
    if (std::string(family.name) == "massless_links") continue;  // errors there are not a few u
    SCOPED_TRACE(family.name);
    const Model<double> drawn = family.make(2);
    const Model<T> model = drawn.template cast<T>();
    const int nv = model.nv();
    const VectorX<T> q = random_state(drawn, 5).template cast<T>().q;
    const MatrixX<T> X = structured_inverse(model, q);
    StructuredInverse<T> structured(model);
    EXPECT_TRUE(structured.factor(q));
    const T tolerance = 4000 * unit_roundoff<T>();

    VectorX<T> diagonal = poisoned<T>(nv);
    structured.diagonal(diagonal);
    EXPECT_LE((diagonal - X.diagonal()).norm(), tolerance * X.diagonal().norm());
    for (int columns : {1, 5, 16, 19, 33}) {
      MatrixX<T> tau(nv, columns), x = poisoned_matrix<T>(nv, columns);
      for (int j = 0; j < columns; ++j) tau.col(j) = random_state(drawn, j).template cast<T>().tau;
      structured.solve(tau, x);
      EXPECT_LE((x - X * tau).norm(), tolerance * X.norm() * tau.norm()) << columns;
      VectorX<T> one = poisoned<T>(nv);
      structured.solve(VectorX<T>(tau.col(columns - 1)), one);
      EXPECT_LE((one - x.col(columns - 1)).norm(), tolerance * X.norm() * tau.norm());
    }
  }
}

TYPED_TEST(Inverses, SingularMechanismIsReportedAndRegularOneIsNot) {
  using T = TypeParam;
  const auto outcomes_of = [](const Mechanism& mechanism) {
    const Model<T> model = mechanism.model.template cast<T>();
    const VectorX<T> q = mechanism.q.template cast<T>();
    StructuredInverse<T> structured(model);
    MatrixX<T> X(model.nv(), model.nv());
    return std::vector<Outcome>{structured.inverse(q, X), structured.factor(q)};
  };
  for (int seed = 0; seed < 20; ++seed) {
    for (const Mechanism& mechanism : singular_mechanisms(seed))
      for (const Outcome& outcome : outcomes_of(mechanism)) {
        EXPECT_EQ(outcome.status, Outcome::Status::singular) << mechanism.name << " seed " << seed;
        EXPECT_TRUE(std::ranges::count(mechanism.joints, outcome.joint)) << mechanism.name;
      }
    for (const Mechanism& mechanism : regular_mechanisms(seed))
      for (const Outcome& outcome : outcomes_of(mechanism))
        EXPECT_TRUE(outcome) << mechanism.name << " seed " << seed;
  }
}

TYPED_TEST(Inverses, NanInTheStateIsReported) {
  using T = TypeParam;
  for (int n : {7, 100, 200}) {
    const Model<double> drawn = chain(3, n);
    StructuredInverse<T> structured(drawn.template cast<T>());
    VectorX<T> q = random_state(drawn, 5).template cast<T>().q;
    MatrixX<T> X(n, n);
    q[n / 2] = std::numeric_limits<T>::quiet_NaN();
    EXPECT_FALSE(structured.inverse(q, X)) << n;
    EXPECT_FALSE(structured.factor(q)) << n;
  }
}

// Of a hinge of a chain.
struct Flops {
  double factor, solve, lambda, composite, mass_entry;

  explicit Flops(int n) {
    const Model<double> drawn = chain(1, n);
    const StructuredModel<double> model(drawn);
    const VectorX<double> q = random_state(drawn, 3).q;
    const std::vector<Count> angles(q.begin(), q.end());
    const std::vector<char> all(n, 1);
    const auto per_joint = [n](const auto& work) {
      Count::flops = 0;
      work();
      return static_cast<double>(Count::flops) / n;
    };
    StructuredFactors<Count> factors(model);
    ColumnsWorkspace<Count> ws(model);
    LambdaWorkspace<Count> lambda_of(model);
    CompositeForces<Count> composite_of(model);
    factor = per_joint([&] { structured_factor(model, angles.data(), factors); });
    solve = per_joint([&] {
      detail::sweep_inward(
          model, factors, n - 1, all.data(), [](int) { return Count(1); }, ws);
      detail::sweep_outward(model, factors, n - 1, ws, [](int, const Count&) {});
    });
    lambda = per_joint([&] { structured_lambda(model, factors, lambda_of); });
    composite = per_joint([&] { structured_composite(model, angles.data(), composite_of); });
    mass_entry = per_joint(
        [&] { detail::sweep_composite_forces(model, composite_of, n - 1, n - 1, all.data(), ws); });
  }
};

void expect_between(double least, double flops, double most, const char* what) {
  EXPECT_GE(flops, least) << what << ": does it count?";
  EXPECT_LE(flops, most) << what;
  testing::Test::RecordProperty(what, std::to_string(flops));
}

TEST(StructuredInverse, HingeOfAChainCostsNoMoreFlopsThanIsSaid) {
  for (int n : {31, 100}) {
    const Flops flops(n);
    expect_between(150, flops.factor, 210, "factor");
    expect_between(50, flops.solve, 95, "solve");
    expect_between(200, flops.lambda, 270, "lambda");
    expect_between(50, flops.composite, 110, "composite");
    expect_between(30, flops.mass_entry, 50, "mass_entry");
  }
}

}  // namespace
}  // namespace kalmarm::test
