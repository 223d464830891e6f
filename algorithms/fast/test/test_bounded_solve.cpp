// The bound of a solve by kept factors against multi-precision: never below its error, finite on
// everything that the factors are right for.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "algorithms/fast/certified/bounded_solve.hpp"
#include "algorithms/fast/engine/instances.hpp"
#include "algorithms/fast/test/mechanisms_that_lose.hpp"
#include "algorithms/fast/test/support.hpp"

namespace kalmarm::test {
namespace {

template <class T>
class BoundedSolveOf : public testing::Test {
 protected:
  // M^-1 r, r random, on factors of a sweep whose D are right.
  void expect_bound(const Model<double>& drawn, int seed) {
    const State<T> state = random_state(drawn, seed).template cast<T>();
    const LoweredModel<T> model(drawn.cast<T>());
    FastFactors<T> factors(model);
    covariance_factor(model, state.q.data(), factors);
    if (!(factors.margin > T(0))) return;
    VectorX<T> d = poisoned<T>(model.nv());
    BoundedSolve<T> solve(model);
    const T eps(RoundingBound<T>(model).look(model, state.q.data()).bound);
    const double bound = root(solve.solve(model, factors, eps, state.tau.data(), d.data()));
    const Truth truth(rounded<T>(drawn), state.template cast<double>());
    const VectorX<double> exact = truth.solution();
    const double error = (d.template cast<double>() - exact).norm();
    EXPECT_LE(error, bound);
    above_.push_back(bound / exact.norm());
  }

  static double root(const T& square) { return std::sqrt(static_cast<double>(square)); }

  double median() {
    std::nth_element(above_.begin(), above_.begin() + above_.size() / 2, above_.end());
    return above_[above_.size() / 2];
  }

  std::vector<double> above_;  // bound / |d|
};

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(BoundedSolveOf, Precisions, PrecisionName);

TYPED_TEST(BoundedSolveOf, ErrorsOfAllFamiliesAreBelowIt) {
  for (const Family& family : all_families())
    for (int seed = 0; seed < 5; ++seed) {
      SCOPED_TRACE(std::string(family.name) + " seed " + std::to_string(seed));
      this->expect_bound(family.make(seed), seed);
    }
  EXPECT_GE(this->above_.size(), 90);
  EXPECT_LE(this->median(), 1);
}

// Here the errors of forces count: light links between heavy ones, and massless ones.
TYPED_TEST(BoundedSolveOf, ErrorsOfWildMechanismsAreBelowIt) {
  for (int seed = 0; seed < 400; ++seed) {
    SCOPED_TRACE(seed);
    this->expect_bound(wild(seed), seed);
  }
  EXPECT_GE(this->above_.size(), 50);
}

}  // namespace
}  // namespace kalmarm::test
