// H = M + J'DJ by every covariance update that takes contacts.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <span>
#include <vector>

#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/study/contacts/conjugate_gradient.hpp"
#include "algorithms/study/inverse_mass/batch.hpp"
#include "algorithms/study/inverse_mass/eigen_cholesky.hpp"
#include "algorithms/study/inverse_mass/sequential.hpp"
#include "algorithms/study/riccati/array.hpp"
#include "algorithms/study/riccati/conventional.hpp"
#include "algorithms/study/riccati/rows_beside.hpp"
#include "algorithms/study/riccati/ud.hpp"
#include "algorithms/test/models.hpp"
#include "algorithms/test/multiprecision.hpp"

namespace kalmarm::test {
namespace {

using Exact = FixedReal<60>;

template <class T>
std::vector<ContactRow<T>> rounded(const std::vector<ContactRow<double>>& rows, double d) {
  std::vector<ContactRow<T>> out;
  for (ContactRow<double> row : rows) {
    row.d *= d;
    out.push_back(row.template cast<T>());
  }
  return out;
}

// A free body with two limbs of hinges, armature on some, and ten contacts: two on its body, one on a
// link between, seven at the tip of a limb.
struct Standing {
  Model<double> model;
  VectorX<double> q, b;
  std::vector<ContactRow<double>> rows;

  explicit Standing(std::uint64_t seed) : model(robot(seed)) {
    Random random(seed + 100);
    q = random.vector(model.nq());
    b = random.vector(model.nv());
    const int base = 5, middle = 8, tip = model.nv() - 1;
    for (const int link : {base, tip, tip, middle, tip, tip, tip, tip, tip, base}) {
      ContactRow<double> row{link, Vector6<double>::Zero(), random.uniform(0.3, 1)};
      const Vector3<double> p = 0.2 * random.vector3(), f = random.vector3().normalized();
      row.e << p.cross(f), f;
      rows.push_back(row);
    }
  }

  static Model<double> robot(std::uint64_t seed) {
    Random random(seed);
    Builder builder;
    const int body = builder.add_free(random_joint(random, -1));
    for (int limb = 0; limb < 2; ++limb)
      for (int i = 0, parent = body; i < 5; ++i) {
        Joint<double> joint = random_joint(random, parent);
        if (i % 2 == 0) joint.r = 0.02;
        parent = builder.add(joint);
      }
    return builder.build();
  }
};

template <class T, class V>
Outcome solve(const Standing& standing, double d, VectorX<T>& x, T* log_det = nullptr) {
  // Rounded to float first: exact in every precision from there.
  const Model<T> model = standing.model.cast<float>().cast<T>();
  LinkKinematics<T> kin(model);
  set_position(model, VectorX<T>(standing.q.cast<float>().template cast<T>()), kin);
  std::vector<ContactRow<T>> rows;
  for (const ContactRow<float>& row : rounded<float>(standing.rows, d))
    rows.push_back(row.template cast<T>());
  typename V::template Workspace<T> ws(model);
  const Outcome outcome = V::factor(model, kin, std::span<const ContactRow<T>>(rows), ws);
  if (!outcome) return outcome;
  V::solve(model, kin, VectorX<T>(standing.b.cast<float>().template cast<T>()), ws, x);
  if constexpr (requires { ws.factors.D; }) {
    if (log_det) {
      using std::log;
      *log_det = T(0);
      for (const T& D : ws.factors.D) *log_det += log(D);
    }
  }
  return outcome;
}

// M + J'DJ, dense.
MatrixX<Exact> dense(const Standing& standing, double d) {
  const Model<Exact> model = standing.model.cast<float>().cast<Exact>();
  LinkKinematics<Exact> kin(model);
  set_position(model, VectorX<Exact>(standing.q.cast<float>().cast<Exact>()), kin);
  CompositeInertia<Exact> composite(model);
  MatrixX<Exact> H(model.nv(), model.nv());
  mass_matrix(model, kin, composite, Eigen::Ref<MatrixX<Exact>>(H));
  // J by what a unit rate of a joint moves, outward, where contact_jacobian goes inward.
  for (const ContactRow<float>& row : rounded<float>(standing.rows, d)) {
    VectorX<Exact> J(model.nv());
    for (int j = 0; j < model.nv(); ++j) {
      std::vector<Vector6<Exact>> v(model.nv(), Vector6<Exact>::Zero());
      for (int k = 0; k < model.nv(); ++k) {
        if (model.parent(k) >= 0) v[k] = kin.phi[k].motion_from_parent(v[model.parent(k)]);
        if (k == j) v[k][model.joint(k).axis()] += Exact(1);
      }
      J[j] = row.e.cast<Exact>().dot(v[row.link]);
    }
    H += Exact(row.d) * J * J.transpose();
  }
  return H;
}

VectorX<Exact> truth(const Standing& standing, double d) {
  return dense(standing, d).llt().solve(VectorX<Exact>(standing.b.cast<float>().cast<Exact>()));
}

template <class T>
double error(const VectorX<T>& x, const VectorX<Exact>& exact) {
  return static_cast<double>(Exact((x.template cast<Exact>() - exact).norm() / exact.norm()));
}

template <class Update>
class ContactUpdates : public testing::Test {};
using Updates = testing::Types<Conventional, Joseph, Zeroed, RowsBeside, UD, Potter, ArrayMGS,
                               ArrayGivens, ArrayHouseholder, ArrayPivoted>;
TYPED_TEST_SUITE(ContactUpdates, Updates);

TYPED_TEST(ContactUpdates, FactorTheMatrixThatIsNeverFormed) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Standing standing(seed);
    VectorX<Exact> x(standing.model.nv());
    Exact log_det;
    const Outcome outcome = solve<Exact, Sequential<TypeParam>>(standing, 1e3, x, &log_det);
    ASSERT_TRUE(outcome);
    EXPECT_LT(error(x, truth(standing, 1e3)), 1e-45);
    const Exact det = dense(standing, 1e3).determinant();
    EXPECT_LT(static_cast<double>(Exact(abs(log_det - log(det)))), 1e-45);
  }
}

// The same workspace with and without contacts.
TYPED_TEST(ContactUpdates, AreForgottenByTheNextState) {
  using V = Sequential<TypeParam>;
  const Standing standing(4);
  const Model<double>& model = standing.model;
  LinkKinematics<double> kin(model);
  set_position(model, standing.q, kin);
  typename V::template Workspace<double> used(model), fresh(model);
  VectorX<double> x(model.nv()), y(model.nv());
  ASSERT_TRUE(V::factor(model, kin, std::span<const ContactRow<double>>(standing.rows), used));
  ASSERT_TRUE(V::factor(model, kin, used));
  ASSERT_TRUE(V::factor(model, kin, fresh));
  V::solve(model, kin, standing.b, used, x);
  V::solve(model, kin, standing.b, fresh, y);
  EXPECT_LT((x - y).norm(), 1e-12 * y.norm());  // rows without weight may change the order of sums
}

// NaN where there is no answer, or, of what may warn, where it warns.
template <class V>
double error_in_float(double d, std::uint64_t seed, bool may_warn = false) {
  const Standing standing(seed);
  VectorX<float> x(standing.model.nv());
  const Outcome outcome = solve<float, V>(standing, d, x);
  return outcome && !(may_warn && outcome.warns()) ? error(x, truth(standing, d)) : std::nan("");
}

// kS of these mechanisms is up to some hundreds. Gram-Schmidt and rotations round each row to itself.
TEST(Contacts, ArraysKeepFloatsDigitsAtAnyStiffness) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed)
    for (const double d : {1e2, 1e5, 1e8}) {
      EXPECT_LT(error_in_float<Sequential<ArrayMGS>>(d, seed), 2e-4) << d;
      EXPECT_LT(error_in_float<Sequential<ArrayGivens>>(d, seed), 2e-4) << d;
      EXPECT_LT(error_in_float<Sequential<UD>>(d, seed), 2e-4) << d;
    }
}

// Reflections round every row to the largest; so does R2 of rows_beside.hpp.
TEST(Contacts, ReflectionsLoseTheRootOfTheStiffness) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed)
    for (const double d : {1e2, 1e4, 1e6, 1e8}) {
      EXPECT_LT(error_in_float<Sequential<RowsBeside>>(d, seed), 2e-4 + 1e-6 * std::sqrt(d)) << d;
      EXPECT_LT(error_in_float<Sequential<ArrayHouseholder>>(d, seed), 2e-4 + 1e-6 * std::sqrt(d))
          << d;
    }
}

// Where P holds them in float32, 1e9 is refused or warned of, never wrong in silence by more than
// a hundredth.
TEST(Contacts, CovariancesAndCholeskySayWhereTheyAreLost) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    EXPECT_FALSE(error_in_float<Sequential<Conventional>>(1e9, seed, true) > 0.01);
    EXPECT_FALSE(error_in_float<Sequential<Joseph>>(1e9, seed, true) > 0.01);
    EXPECT_FALSE(error_in_float<Batch<EigenLLT>>(1e9, seed, true) > 0.01);
  }
}

TEST(Contacts, CholeskyOfTheSumIsTheSameSystem) {
  const Standing standing(1);
  VectorX<double> x(standing.model.nv());
  ASSERT_TRUE((solve<double, Batch<EigenLLT>>(standing, 10.0, x)));
  EXPECT_LT(error(x, truth(standing, 10.0)), 1e-12);
}

// With M^-1 by the filter before them, conjugate gradients take a step for each of J's rows and one.
TEST(ConjugateGradients, TakeAsManyStepsAsThereAreContacts) {
  using V = ConjugateGradient<InverseOfM<Sequential<Conventional>>>;
  const Standing standing(4);
  const Model<Exact> model = standing.model.cast<float>().cast<Exact>();
  LinkKinematics<Exact> kin(model);
  set_position(model, VectorX<Exact>(standing.q.cast<float>().cast<Exact>()), kin);
  std::vector<ContactRow<Exact>> rows;
  for (const ContactRow<float>& row : rounded<float>(standing.rows, 1e3))
    rows.push_back(row.cast<Exact>());
  rows.resize(4);
  V::Workspace<Exact> ws(model);
  ASSERT_TRUE(V::factor(model, kin, std::span<const ContactRow<Exact>>(rows), ws));
  VectorX<Exact> x(model.nv());
  ws.loop.setTolerance(Exact(1e-40));
  const VectorX<Exact> b = standing.b.cast<Exact>();
  const Outcome outcome = V::solve(model, kin, b, ws, x);
  EXPECT_FALSE(outcome.warns());
  EXPECT_LE(outcome.steps, static_cast<int>(rows.size()) + 1);
  EXPECT_LT(static_cast<double>(Exact((ws.H * x - b).norm() / b.norm())), 1e-38);
}

}  // namespace
}  // namespace kalmarm::test
