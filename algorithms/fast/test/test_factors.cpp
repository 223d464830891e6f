// What no question shows of the factors' rooms: which limbs go into lanes, and a selection that
// replaces another.
#include <gtest/gtest.h>

#include "algorithms/fast/engine/instances.hpp"
#include "algorithms/fast/factors/limbs.hpp"
#include "algorithms/fast/test/support.hpp"

namespace kalmarm::test {
namespace {

TEST(LimbsInLanes, TakeTheLimbsOfATreeAndNoOthers) {
  const Model<double> drawn = creature(1);
  const LimbsInLanes<double> limbs{LoweredModel<double>(drawn)};
  for (int k = 0; k < 8; ++k) EXPECT_FALSE(limbs.have(k)) << k;
  for (int k = 8; k < drawn.nv(); ++k) EXPECT_TRUE(limbs.have(k)) << k;
  const LimbsInLanes<double> none{LoweredModel<double>(chain(1, 12))};
  for (int k = 0; k < 12; ++k) EXPECT_FALSE(none.have(k)) << k;
}

template <class T>
class Selected : public testing::Test {};

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Selected, Precisions, PrecisionName);

// Nothing is left of another selection.
TYPED_TEST(Selected, SelectionsDoNotDisturbEachOther) {
  using T = TypeParam;
  for (const Family& family : all_families()) {
    const Model<double> drawn = family.make(6);
    const LoweredModel<T> model(drawn.template cast<T>());
    FastFactors<T> factors(model);
    const VectorX<T> q = random_state(drawn, 1).template cast<T>().q;
    covariance_factor(model, q.data(), factors);
    const Selection selection = random_selection(drawn, 3), other = random_selection(drawn, 4);
    const int size = selection.size();
    MatrixX<T> fresh = poisoned<T>(size, size), used = fresh;
    SelectedColumns<T> one, two;
    one.select(model, selection);
    EXPECT_EQ(one.answer(Want::operational, model, factors, fresh.data()), T(0));
    two.select(model, other);
    EXPECT_EQ(two.answer(Want::operational, model, factors, used.data()), T(0));
    two.select(model, selection);
    used = poisoned<T>(size, size);
    EXPECT_EQ(two.answer(Want::operational, model, factors, used.data()), T(0));
    EXPECT_TRUE(used == fresh) << family.name;
  }
}

}  // namespace
}  // namespace kalmarm::test
