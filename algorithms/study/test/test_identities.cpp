// The paper's operator identities, dense and in 50 digits, and closed forms of the straight chain.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/study/inverse_mass/factors.hpp"
#include "algorithms/study/riccati/array.hpp"
#include "algorithms/study/riccati/conventional.hpp"
#include "algorithms/study/riccati/in_world_frame.hpp"
#include "algorithms/study/riccati/ud.hpp"
#include "algorithms/study/solver.hpp"
#include "algorithms/test/dense_mechanics.hpp"
#include "algorithms/test/models.hpp"

namespace kalmarm::test {
namespace {

const Mp rounding = 1e-42;  // leaves room for kappa, which is up to 1e5 here

void expect_near(const MatrixX<Mp>& a, const MatrixX<Mp>& b) {
  EXPECT_LE((a - b).norm(), rounding * b.norm());
}

// Factors by one update, and the operators that they stand for.
template <class Update>
struct Filter {
  Model<Mp> model;
  LinkKinematics<Mp> kin;
  Factors<Mp, Update> f;
  VectorX<Mp> D;
  MatrixX<Mp> M;  // by world-frame Jacobians

  Filter(const Model<double>& parameters, const VectorX<double>& at)
      : model(parameters.cast<Mp>()), kin(model), f(model) {
    const VectorX<Mp> q = at.cast<Mp>();
    set_position(model, q, kin);
    EXPECT_TRUE(factor(model, kin, f));
    D = Eigen::Map<const VectorX<Mp>>(f.D.data(), model.nv());
    M = World(model, q, VectorX<Mp>::Zero(model.nv())).mass_matrix();
  }

  int axis(int k) const { return model.joint(k).axis(); }
  MatrixX<Mp> identity() const { return MatrixX<Mp>::Identity(model.nv(), model.nv()); }

  // phi(m-,j+) g(j), or psi(m-,j+) g(j) for the loop closed at every joint between.
  Vector6<Mp> reach(int m, int j, bool closed) const {
    Vector6<Mp> x = f.g[j];
    for (int k = j;;) {
      x = kin.phi[k].force_to_parent(x);
      k = model.parent(k);
      if (k == m) return x;
      if (closed) x -= f.g[k] * x[axis(k)];
    }
  }

  // K, or L for the closed loop.
  MatrixX<Mp> gain_operator(bool closed) const {
    MatrixX<Mp> out = MatrixX<Mp>::Zero(model.nv(), model.nv());
    for (int j = 0; j < model.nv(); ++j)
      for (int m = model.parent(j); m >= 0; m = model.parent(m))
        out(m, j) = reach(m, j, closed)[axis(m)];
    return out;
  }

  Matrix6<Mp> P_plus(int k) const {
    Matrix6<Mp> P;
    for (int i = 0; i < 6; ++i)
      P.col(i) = Update::P_plus_times(k, Vector6<Mp>(Vector6<Mp>::Unit(i)), f.update);
    return P;
  }
};

template <class Update>
class EveryUpdate : public testing::Test {
 protected:
  static void for_each_family(void (*check)(const Filter<Update>&)) {
    for (const Family& family : families()) {
      SCOPED_TRACE(family.name);
      const Model<double> model = family.make(41);
      check(Filter<Update>(model, random_state(model, 42).q));
    }
  }
};

using Updates = testing::Types<Conventional, Zeroed, Joseph, ArrayMGS, ArrayGivens,
                               ArrayHouseholder, ArrayPivoted, Potter, UD, WorldAxes<ArrayGivens>,
                               WorldOrigin<Conventional>, WorldOrigin<UD>>;

struct UpdateName {
  template <class Update>
  static std::string GetName(int) {
    std::string name = Update::name();
    std::erase_if(name, [](char x) { return x == '<' || x == '>'; });
    return name;
  }
};

TYPED_TEST_SUITE(EveryUpdate, Updates, UpdateName);

TYPED_TEST(EveryUpdate, FactorsTheMassMatrix) {  // M = (I + K) D (I + K*), (3.3)
  this->for_each_family([](const auto& filter) {
    const MatrixX<Mp> I_plus_K = filter.identity() + filter.gain_operator(false);
    expect_near(I_plus_K * filter.D.asDiagonal() * I_plus_K.transpose(), filter.M);
  });
}

TYPED_TEST(EveryUpdate, ClosedLoopFactorsTheInverse) {  // M^-1 = (I - L*) D^-1 (I - L), (3.3)
  this->for_each_family([](const auto& filter) {
    const MatrixX<Mp> I_plus_K = filter.identity() + filter.gain_operator(false);
    const MatrixX<Mp> I_minus_L = filter.identity() - filter.gain_operator(true);
    const VectorX<Mp> D_inverse = filter.D.cwiseInverse();
    expect_near(I_plus_K * I_minus_L, filter.identity());
    expect_near(I_minus_L.transpose() * D_inverse.asDiagonal() * I_minus_L * filter.M,
                filter.identity());
  });
}

TYPED_TEST(EveryUpdate, InnovationsMultiplyToTheDeterminant) {
  this->for_each_family([](const auto& filter) {
    const Mp determinant = filter.M.partialPivLu().determinant();
    EXPECT_LE(abs(filter.D.prod() / determinant - 1), rounding);
  });
}

TYPED_TEST(EveryUpdate, LeavesAMeasuredJointOnlyItsNoise) {  // HP+ = r g', zero without noise
  this->for_each_family([](const auto& filter) {
    for (int k = 0; k < filter.model.nv(); ++k) {
      const Matrix6<Mp> P = filter.P_plus(k);
      const Vector6<Mp> left = P.row(filter.axis(k)).transpose();
      const Mp size = P.norm() + filter.D[k] * filter.f.g[k].squaredNorm();  // of P-
      EXPECT_LE((left - filter.model.joint(k).r * filter.f.g[k]).norm(), rounding * size) << k;
      EXPECT_LE((P - P.transpose()).norm(), rounding * size) << k;
    }
  });
}

template <class Update>
class ExactUpdate : public testing::Test {};

using ExactUpdates =
    testing::Types<Zeroed, ArrayMGS, ArrayGivens, ArrayHouseholder, ArrayPivoted, UD>;

TYPED_TEST_SUITE(ExactUpdate, ExactUpdates, UpdateName);

TYPED_TEST(ExactUpdate, LeavesNothingOfAMeasuredJoint) {
  static_assert(TypeParam::exact_constraint);
  const Model<float> model = chain(43).cast<float>();
  LinkKinematics<float> kin(model);
  Factors<float, TypeParam> f(model);
  set_position(model, random_state(chain(43), 44).q.cast<float>(), kin);
  ASSERT_TRUE(factor(model, kin, f));
  for (int k = 0; k < model.nv(); ++k) {
    const Vector6<float> H = Vector6<float>::Unit(model.joint(k).axis());
    EXPECT_EQ(TypeParam::P_plus_times(k, H, f.update).norm(), 0) << k;
  }
}

// Result 6.1, corrected, as it is written: Lambda by (5.6) and (5.7), every entry from its formula.
MatrixX<Mp> result_6_1(const Filter<Conventional>& filter) {
  const int nv = filter.model.nv();
  std::vector<Matrix6<Mp>> L_minus(nv);
  std::vector<Vector6<Mp>> n(nv);
  std::vector<std::vector<int>> path(nv);  // joints from k to the base
  MatrixX<Mp> X(nv, nv);
  for (int k = 0; k < nv; ++k) {
    const Vector6<Mp>& g = filter.f.g[k];
    const Vector6<Mp> H = Vector6<Mp>::Unit(filter.axis(k));
    const Matrix6<Mp> I_gH = Matrix6<Mp>::Identity() - g * H.transpose();
    const int parent = filter.model.parent(k);
    Matrix6<Mp> L_plus = Matrix6<Mp>::Zero();
    path[k] = {k};
    if (parent >= 0) {
      L_plus = filter.kin.phi[k].dual_congruence(L_minus[parent]);
      path[k].insert(path[k].end(), path[parent].begin(), path[parent].end());
    }
    L_minus[k] = I_gH.transpose() * L_plus * I_gH + H * H.transpose() / filter.D[k];
    n[k] = I_gH.transpose() * L_plus * g - H / filter.D[k];
    X(k, k) = 1 / filter.D[k] + g.dot(L_plus * g);
  }
  for (int j = 0; j < nv; ++j)
    for (int i = 0; i < j; ++i) {
      const auto common = std::ranges::find_first_of(path[j], path[i]);
      if (common == path[j].end())
        X(i, j) = 0;
      else if (*common == i)
        X(i, j) = n[i].dot(filter.reach(i, j, true));
      else
        X(i, j) =
            filter.reach(*common, i, true).dot(L_minus[*common] * filter.reach(*common, j, true));
      X(j, i) = X(i, j);
    }
  return X;
}

class Result61 : public testing::TestWithParam<Family> {};

TEST_P(Result61, IsTheInverseOfTheMassMatrix) {
  const Model<double> model = GetParam().make(45);
  const VectorX<double> q = random_state(model, 46).q;
  const Filter<Conventional> filter(model, q);
  const MatrixX<Mp> inverse = filter.M.partialPivLu().inverse();
  expect_near(result_6_1(filter), inverse);

  MatrixX<Mp> X(model.nv(), model.nv());
  const auto solver = make_solver<Mp>("ClosedForm<Conventional>", filter.model);
  ASSERT_TRUE(solver && solver->inverse(q.cast<Mp>(), X));
  expect_near(X, inverse);
}

INSTANTIATE_TEST_SUITE_P(Models, Result61, testing::ValuesIn(families()),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(StraightChain, SettlesAtTheSteadyStateOfItsRiccatiEquation) {
  // Unit masses and lengths, com in mid-link. With a = 1/2 + sqrt(I_cm):
  // D = a^2,  g = (0, 0, 1; 0, 1/a, 0),  closed loop 1 - 1/a
  const int n = 64;
  const Filter<Conventional> filter(straight_chain(n), VectorX<double>::Zero(n));
  const Mp a = sqrt(filter.model.joint(0).body.moments[2]) + 0.5;
  Vector6<Mp> g = Vector6<Mp>::Zero();
  g[2] = 1;
  g[4] = 1 / a;
  EXPECT_LE(abs(filter.D[0] - a * a), rounding);
  EXPECT_LE((filter.f.g[0] - g).norm(), rounding);
  const Mp loop = filter.reach(0, 3, true)[4] / filter.reach(0, 2, true)[4];
  EXPECT_LE(abs(loop - (1 - 1 / a)), rounding);
}

TEST(StraightChain, HasTheSpectrumOfABendingBeam) {
  // lambda_min -> I_cm / 4 as n^-2, lambda_max -> n^4 / 1.87510^4 as n^-1
  const int n = 64;
  const Model<double> model = straight_chain(n);
  LinkKinematics<double> kin(model);
  CompositeInertia<double> composite(model);
  MatrixX<double> M(n, n);
  set_position(model, VectorX<double>::Zero(n), kin);
  mass_matrix(model, kin, composite, Eigen::Ref<MatrixX<double>>(M));
  const VectorX<double> w = Eigen::SelfAdjointEigenSolver<MatrixX<double>>(M).eigenvalues();
  EXPECT_NEAR(w[0] / (1.015 / 48), 1, 10.0 / (n * n));
  EXPECT_NEAR(w[n - 1] / std::pow(n / 1.87510, 4), 1, 2.1 / n);
}

}  // namespace
}  // namespace kalmarm::test
