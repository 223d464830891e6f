// M and M^-1 of which the lower triangle alone is wanted.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "algorithms/dynamics/test/door_support.hpp"

namespace kalmarm::test {
namespace {

template <class T>
class LowerTriangle : public testing::Test {};

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(LowerTriangle, Precisions, PrecisionName);

// A square of numbers that no call gives, with guards behind it.
template <class T>
struct Guarded {
  static constexpr T untouched = T(-77);
  static constexpr int guard = 64;
  int n;
  std::vector<T> numbers;

  explicit Guarded(int size) : n(size), numbers(size * size + guard, untouched) {}
  MatrixView<T> view() { return {numbers.data(), n, n}; }
  MatrixX<T> matrix() const { return Eigen::Map<const MatrixX<T>>(numbers.data(), n, n); }
  bool guard_is_whole() const {
    return std::all_of(numbers.end() - guard, numbers.end(), [](T x) { return x == untouched; });
  }
};

template <class T>
void expect_the_same_below(const Model<double>& model, DynamicsOptions options) {
  options.question.frames = some_frames(model);
  Dynamics<T> both = dynamics_of<T>(model, options);
  options.triangles = Triangles::lower;
  Dynamics<T> lower = dynamics_of<T>(model, options);
  const State<T> s = random_state(model, 5).template cast<T>();
  const int n = both.asked();
  Guarded<T> M(n), X(n), lower_M(n), lower_X(n);
  both.mass(s.q, M.view());
  lower.mass(s.q, lower_M.view());
  EXPECT_TRUE(both.inverse_mass(s.q, X.view()));
  EXPECT_TRUE(lower.inverse_mass(s.q, lower_X.view()));
  for (int j = 0; j < n; ++j) {
    EXPECT_TRUE(M.matrix().col(j).tail(n - j) == lower_M.matrix().col(j).tail(n - j)) << j;
    EXPECT_TRUE(X.matrix().col(j).tail(n - j) == lower_X.matrix().col(j).tail(n - j)) << j;
  }
  EXPECT_TRUE(lower_M.guard_is_whole() && lower_X.guard_is_whole());

  // Of rows both are, of one too.
  std::vector<Outcome> outcome(1);
  EXPECT_EQ(lower.mass(s.q, RowsView<T>(lower_M.numbers.data(), 1, n * n), outcome), 0);
  EXPECT_EQ(lower.inverse_mass(s.q, RowsView<T>(lower_X.numbers.data(), 1, n * n), outcome), 0);
  EXPECT_TRUE(lower_M.matrix() == lower_M.matrix().transpose());
  EXPECT_TRUE(lower_X.matrix() == lower_X.matrix().transpose());

  // What else is read off M or M^-1 is what it was.
  VectorX<T> d = poisoned<T>(n), lower_d = d;
  MatrixX<T> L = poisoned<T>(18, 18), lower_L = L;
  T det = 0, lower_det = 1;
  EXPECT_TRUE(both.diagonal(s.q, d) && lower.diagonal(s.q, lower_d));
  EXPECT_TRUE(both.operational(s.q, L) && lower.operational(s.q, lower_L));
  EXPECT_TRUE(both.log_det(s.q, det) && lower.log_det(s.q, lower_det));
  EXPECT_TRUE(d == lower_d && L == lower_L);
  EXPECT_EQ(det, lower_det);
}

TYPED_TEST(LowerTriangle, IsThatOfBoth) {
  for (const Family& family : families_and_robots())
    for (const Tolerance tolerance : tolerances)
      for (const std::set<Rule>& rules : {all_rules(), std::set<Rule>{}}) {
        SCOPED_TRACE(std::string(family.name) + " " + name_of(tolerance));
        expect_the_same_below<TypeParam>(family.make(3), {.tolerance = tolerance, .rules = rules});
      }
}

// Registers that are full and not, and chains that go by blocks.
TYPED_TEST(LowerTriangle, IsThatOfBothInEverySize) {
  for (int n = 1; n <= 250; n += n < 40 ? 1 : 30) expect_the_same_below<TypeParam>(chain(5, n), {});
}

// What is not wanted is left out, but for squares on the diagonal: else the option is for nothing. One
// chain goes by columns, the other by blocks.
TYPED_TEST(LowerTriangle, LeavesTheUpperOneAlone) {
  using T = TypeParam;
  for (const int n : {80, 250}) {
    const Model<double> model = chain(5, n);
    Dynamics<T> robot = dynamics_of<T>(model, {.triangles = Triangles::lower});
    Guarded<T> M(n), X(n);
    const VectorX<T> q = random_state(model, 5).q.template cast<T>();
    robot.mass(q, M.view());
    EXPECT_TRUE(robot.inverse_mass(q, X.view()));
    EXPECT_EQ(M.matrix()(0, n - 1), Guarded<T>::untouched);
    EXPECT_EQ(X.matrix()(0, n - 1), Guarded<T>::untouched);
  }
}

TYPED_TEST(LowerTriangle, OfRowsBothAreThere) {
  using T = TypeParam;
  const Model<double> model = creature(3);
  Dynamics<T> robot = dynamics_of<T>(model, {.triangles = Triangles::lower});
  const VectorX<T> q = random_state(model, 5).q.template cast<T>();
  MatrixX<T> X = poisoned<T>(model.nv(), model.nv());
  std::vector<Outcome> outcomes(1);
  EXPECT_EQ(robot.inverse_mass(RowsView<const T>(q.data(), 1, model.nq()),
                               RowsView<T>(X.data(), 1, X.size()), outcomes),
            0);
  EXPECT_TRUE(X == X.transpose());
}

}  // namespace
}  // namespace kalmarm::test
