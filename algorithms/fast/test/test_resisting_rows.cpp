// Rows of contacts beside P0: what reflections keep, and the measurement of a joint against that of the whole P,
// dense, of one state and of one in every lane.
#include <gtest/gtest.h>

#include <vector>

#include "algorithms/fast/covariance/resisting_rows.hpp"
#include "algorithms/test/models.hpp"

namespace kalmarm::test {
namespace {

using Wide = Pack<double, 4>;

double number(double x, int) { return x; }
double number(const Wide& x, int lane) { return x[lane]; }

template <class T>
Vector6<double> vector(const Sixfold<T>& x, int lane = 0) {
  Vector6<double> out;
  for (int j = 0; j < 6; ++j) out[j] = number((&x.x)[j], lane);
  return out;
}

// The same in every lane but for the last, of which it is twice as much.
template <class T>
Sixfold<T> sixfold(const Vector6<double>& x) {
  Sixfold<T> out;
  for (int j = 0; j < 6; ++j) (&out.x)[j] = T(x[j]);
  if constexpr (Lanes<T>::count > 1)
    for (int j = 0; j < 6; ++j) (&out.x)[j].set(Lanes<T>::count - 1, 2 * x[j]);
  return out;
}

template <class T>
Matrix6<double> squared(const ResistingRows<T>& rows, int lane = 0) {
  std::vector<Sixfold<T>> all;
  rows.add_to(all);
  Matrix6<double> sum = Matrix6<double>::Zero();
  for (const Sixfold<T>& row : all) sum += vector(row, lane) * vector(row, lane).transpose();
  return sum;
}

template <class T>
int count(const ResistingRows<T>& rows) {
  std::vector<Sixfold<T>> all;
  rows.add_to(all);
  return static_cast<int>(all.size());
}

template <class T>
class ResistingRowsOf : public testing::Test {};
using Numbers = testing::Types<double, Wide>;
TYPED_TEST_SUITE(ResistingRowsOf, Numbers);

TYPED_TEST(ResistingRowsOf, KeepTheirSumOfSquaresWhereSixAreMadeOfMany) {
  Random random(1);
  for (const int many : {1, 5, 6, 7, 8, 9, 12, 16, 17, 40}) {
    ResistingRows<TypeParam> rows;
    Matrix6<double> sum = Matrix6<double>::Zero();
    for (int i = 0; i < many; ++i) {
      Vector6<double> w = random.vector(6);
      if (i % 3 == 2) w[i % 6] = 0;
      rows.add(sixfold<TypeParam>(w));
      sum += w * w.transpose();
    }
    rows.compress();
    EXPECT_EQ(count(rows), std::min(many, 6));
    const int last = Lanes<TypeParam>::count - 1;
    EXPECT_LE((squared(rows) - sum).norm(), 1e-14 * sum.norm()) << many;
    EXPECT_LE((squared(rows, last) - (last > 0 ? 4 : 1) * sum).norm(), 4e-14 * sum.norm()) << many;
  }
}

// Rows that repeat one another, and rows of nothing.
TYPED_TEST(ResistingRowsOf, MayRepeatEachOther) {
  const Vector6<double> w = Random(2).vector(6);
  ResistingRows<TypeParam> rows;
  for (int i = 0; i < 20; ++i)
    rows.add(sixfold<TypeParam>(i % 2 == 0 ? w : Vector6<double>(Vector6<double>::Zero())));
  rows.compress();
  const Matrix6<double> sum = 10 * w * w.transpose();
  EXPECT_LE((squared(rows) - sum).norm(), 1e-14 * sum.norm());
}

template <class T, bool slides, bool noise>
void expect_measured(std::uint64_t seed, int number_of_rows) {
  constexpr int h = slides ? 5 : 2;
  Random random(seed);
  const Matrix6<double> root =
      Eigen::Map<const Matrix6<double>>(VectorX<double>(random.vector(36)).data());
  const Matrix6<double> P0 = root * root.transpose();
  const double r = noise ? 0.3 : 0;
  ResistingRows<T> rows;
  Matrix6<double> P = P0;
  for (int i = 0; i < number_of_rows; ++i) {
    const Vector6<double> w = 10 * random.vector(6);
    rows.add(sixfold<T>(w));
    P += w * w.transpose();
  }
  const double D0 = P0(h, h) + r, D = P(h, h) + r;
  Sixfold<T> g = sixfold<T>(P0.col(h) / D0);
  if constexpr (Lanes<T>::count > 1)
    for (int j = 0; j < 6; ++j) (&g.x)[j] = T(P0(j, h) / D0);
  T inverse_D(1 / D0);
  rows.template measure<slides, noise>(g, inverse_D);
  const Vector6<double> right = P.col(h) / D;
  EXPECT_LE((vector(g) - right).norm(), 1e-14 * right.norm());
  EXPECT_NEAR(number(inverse_D, 0) * D, 1, 1e-14);
  const Matrix6<double> P0_plus = P0 - P0.col(h) * P0.col(h).transpose() / D0;
  const Matrix6<double> P_plus = P - P.col(h) * P.col(h).transpose() / D;
  EXPECT_LE((P0_plus + squared(rows) - P_plus).norm(), 1e-13 * P.norm());
}

TYPED_TEST(ResistingRowsOf, AreMeasuredAsTheWholeCovarianceIs) {
  for (const int rows : {1, 2, 6})
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      expect_measured<TypeParam, false, false>(seed, rows);
      expect_measured<TypeParam, false, true>(seed, rows);
      expect_measured<TypeParam, true, false>(seed, rows);
      expect_measured<TypeParam, true, true>(seed, rows);
    }
}

}  // namespace
}  // namespace kalmarm::test
