// The filter as a scan against the sequential filter, in many digits, and its promises of bits.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "algorithms/study/scan/counting.hpp"
#include "algorithms/study/scan/covariance_element.hpp"
#include "algorithms/study/scan/divide_and_conquer.hpp"
#include "algorithms/study/scan/scan.hpp"
#include "algorithms/study/scan/square_root_element.hpp"
#include "algorithms/test/dense_mechanics.hpp"
#include "algorithms/test/models.hpp"
#include "algorithms/test/singular.hpp"

namespace kalmarm::test {
namespace {

using scan::Order;

template <class T>
struct Answer {
  Outcome outcome;
  std::vector<T> D;
  std::vector<Vector6<T>> g;
  VectorX<T> a, x;
};

template <class V, class T, class Workspace>
Answer<T> answer(const Model<T>& model, const State<T>& state, Workspace& ws) {
  LinkKinematics<T> kin(model);
  set_position(model, state.q, kin);
  set_velocity(model, state.qd, kin);
  Answer<T> out;
  out.a = out.x = VectorX<T>::Constant(model.nv(), T(std::numeric_limits<double>::quiet_NaN()));
  out.outcome = V::factor(model, kin, ws);
  if (!out.outcome) return out;
  out.D = ws.factors.D;
  out.g = ws.factors.g;
  V::acceleration(model, kin, state.tau, ws, out.a);
  V::solve(model, kin, state.tau, ws, out.x);
  return out;
}

template <class V, class T>
Answer<T> answer(const Model<T>& model, const State<T>& state, const scan::Options& options) {
  typename V::template Workspace<T> ws(model, options);
  return answer<V>(model, state, ws);
}

template <class T>
double largest_difference(const Answer<T>& x, const Answer<T>& y) {
  T out = (x.a - y.a).norm() / y.a.norm() + (x.x - y.x).norm() / y.x.norm();
  for (std::size_t k = 0; k < y.D.size(); ++k)
    out += abs(T(x.D[k] - y.D[k])) / y.D[k] + (x.g[k] - y.g[k]).norm() / y.g[k].norm();
  return out.template convert_to<double>();
}

// Long enough for blocks in blocks; branches of all sizes.
Model<double> bush(std::uint64_t seed, int n = 60) {
  Random random(seed);
  Builder builder;
  for (int k = 0; k < n; ++k) {
    const int back = random.chance(0.3) ? random.below(20) + 1 : 1;
    builder.add(random_joint(random, std::max(k - back, k == 0 ? -1 : 0)));
  }
  return builder.build();
}

std::vector<Family> scanned_families() {
  std::vector<Family> all = families();
  all.push_back({"bush", [](std::uint64_t seed) { return bush(seed); }});
  all.push_back({"long_chain", [](std::uint64_t seed) { return chain(seed, 120); }});
  all.push_back({"long_straight_chain", [](std::uint64_t) { return straight_chain(90); }});
  return all;
}

template <class Form>
class ScanOf : public testing::Test {};

using Forms = testing::Types<scan::Conventional, scan::SquareRoot>;
struct FormName {
  template <class Form>
  static std::string GetName(int) {
    return Form::name();
  }
};
TYPED_TEST_SUITE(ScanOf, Forms, FormName);

TYPED_TEST(ScanOf, EqualsTheSequentialFilterToAllDigits) {
  using Filter = Sequential<typename TypeParam::Update>;
  for (const Family& family : scanned_families())
    for (const int links : {1, 3, 10})
      for (const Order order : {Order::balanced, Order::tips_first, Order::base_first}) {
        SCOPED_TRACE(family.name + std::string(", blocks of ") + std::to_string(links) +
                     ", order " + std::to_string(static_cast<int>(order)));
        const Model<double> model = family.make(3);
        const Model<Mp> exact = model.cast<Mp>();
        const State<Mp> state = random_state(model, 4).cast<Mp>();
        typename Filter::template Workspace<Mp> ws(exact);
        const Answer<Mp> filtered = answer<Filter>(exact, state, ws);
        const Answer<Mp> scanned =
            answer<Scan<TypeParam>>(exact, state, {.links_of_block = links, .order = order});
        ASSERT_TRUE(filtered.outcome && scanned.outcome);
        EXPECT_LE(largest_difference(scanned, filtered), 1e-41);
      }
}

TYPED_TEST(ScanOf, HasTheSameBitsOnAnyNumberOfThreads) {
  for (const Model<double>& model : {chain(5, 700), bush(6, 900), tree(7), floating_base(8)}) {
    const State<double> state = random_state(model, 9);
    const auto on = [&](int threads) {
      return answer<Scan<TypeParam>>(model, state, {.links_of_block = 8, .threads = threads});
    };
    const Answer<double> one = on(1);
    for (const int threads : {2, 4}) {
      const Answer<double> many = on(threads);
      EXPECT_EQ(many.outcome.joint, one.outcome.joint);
      EXPECT_EQ(many.outcome.scale, one.outcome.scale);
      EXPECT_EQ(many.a, one.a);
      EXPECT_EQ(many.x, one.x);
      EXPECT_EQ(many.D, one.D);
    }
  }
}

template <class Form, class T>
void expect_refusals_of_the_sequential_filter() {
  using Filter = Sequential<typename Form::Update>;
  for (int seed = 0; seed < 20; ++seed)
    for (const Mechanism& mechanism : singular_mechanisms(seed)) {
      SCOPED_TRACE(mechanism.name + ", seed " + std::to_string(seed));
      const Model<T> model = mechanism.model.template cast<T>();
      State<double> state = random_state(mechanism.model, seed);
      state.q = mechanism.q;
      const State<T> at = state.template cast<T>();
      typename Filter::template Workspace<T> ws(model);
      const Outcome filtered = answer<Filter>(model, at, ws).outcome;
      for (const int links : {1, 2})
        for (const int threads : {1, 2, 4}) {
          const Outcome scanned =
              answer<Scan<Form>>(model, at, {.links_of_block = links, .threads = threads}).outcome;
          EXPECT_FALSE(scanned);
          EXPECT_EQ(scanned.joint, filtered.joint);
          EXPECT_EQ(scanned.status, filtered.status);
          EXPECT_EQ(scanned.D, filtered.D);
          EXPECT_EQ(scanned.scale, filtered.scale);
        }
    }
}

TYPED_TEST(ScanOf, SingularMechanismIsReportedAtTheJointOfTheSequentialFilter) {
  expect_refusals_of_the_sequential_filter<TypeParam, double>();
}

TYPED_TEST(ScanOf, SingularMechanismIsReportedAtTheJointOfTheSequentialFilterInFloat) {
  expect_refusals_of_the_sequential_filter<TypeParam, float>();
}

// The sizes that D is compared with when it is looked at twice are those of one link after another.
TYPED_TEST(ScanOf, SecondLookComparesWithTheSizesOfTheSequentialOne) {
  for (const Family& family : scanned_families())
    for (const int links : {1, 3, 10}) {
      SCOPED_TRACE(family.name + std::string(", blocks of ") + std::to_string(links));
      const Model<double> parameters = family.make(3);
      const Model<Mp> model = parameters.cast<Mp>();
      LinkKinematics<Mp> kin(model);
      set_position(model, random_state(parameters, 4).cast<Mp>().q, kin);
      typename Scan<TypeParam>::template Workspace<Mp> ws(model, {.links_of_block = links});
      ASSERT_TRUE(Scan<TypeParam>::factor(model, kin, ws));
      ASSERT_TRUE(ws.test.second_look(model, kin, Mp(0), NearestToSingular<Mp>(1), ws));
      RoundingScale<Mp> sequential(model);
      sequential.begin(model);
      for (int k = model.nv() - 1; k >= 0; --k) {
        const Mp scale = sequential.scale(model, k);
        EXPECT_LE(abs(Mp(ws.test.scale(k) - scale)), Mp(1e-40) * scale) << "link " << k;
        if (model.parent(k) >= 0) sequential.propagate(model, kin.phi[k], k, ws.factors.g[k]);
      }
    }
}

TYPED_TEST(ScanOf, FirstLookComparesWithTheOutboardSideStretchedOut) {
  for (const Model<double>& model : {bush(6, 200), chain(5, 200), tree(7)}) {
    const int nv = model.nv();
    LinkKinematics<double> kin(model);
    set_position(model, random_state(model, 9).q, kin);
    typename Scan<TypeParam>::template Workspace<double> ws(model, {.links_of_block = 5});
    ASSERT_TRUE(Scan<TypeParam>::factor(model, kin, ws));
    std::vector<double> m(nv, 0), J(nv, 0);
    for (int i = 0; i < nv; ++i) {  // every body, and the way from it inwards
      const SpatialInertia<double>& body = model.M(i);
      const double own = body.I.trace() / 2;
      double way = 0;
      for (int k = i; k >= 0; way += kin.phi[k].p.norm(), k = model.parent(k)) {
        m[k] += body.m;
        J[k] += own + way * (2 * std::sqrt(body.m * own) + body.m * way);
      }
    }
    for (int k = 0; k < nv; ++k) {
      EXPECT_NEAR(ws.test.stretched(k).m, m[k], 1e-13 * m[k]) << "link " << k;
      EXPECT_NEAR(ws.test.stretched(k).J, J[k], 1e-13 * J[k]) << "link " << k;
    }
  }
}

// What is not in a task, such as the limits of the test, does not grow with N.
TYPED_TEST(ScanOf, NoLinkIsWorkedOnOutsideATask) {
  for (const int n : {400, 800}) {
    const Model<double> parameters = chain(5, n);
    const State<double> state = random_state(parameters, 9);
    const Model<Count> model = parameters.cast<Count>();
    LinkKinematics<Count> kin(model);
    set_position(model, state.q.cast<Count>(), kin);
    set_velocity(model, state.qd.cast<Count>(), kin);
    typename Scan<TypeParam>::template Workspace<Count> ws(model, {.links_of_block = 8});
    VectorX<Count> a(n);
    const VectorX<Count> tau = state.tau.cast<Count>();
    const long before = Count::flops;
    const Outcome outcome = Scan<TypeParam>::factor(model, kin, ws);
    Scan<TypeParam>::acceleration(model, kin, tau, ws, a);
    EXPECT_TRUE(outcome);
    EXPECT_TRUE(ws.test.second_look(model, kin, Count(0), NearestToSingular<Count>(1), ws));
    EXPECT_NEAR(static_cast<double>(Count::flops - before), scan::work(ws.tasks.phases), 100);
  }
}

// Three blocks of a chain, combined from either end.
TYPED_TEST(ScanOf, CombinationIsAssociative) {
  const Model<Mp> model = chain(10, 40).cast<Mp>();
  const State<Mp> state = random_state(chain(10, 40), 11).cast<Mp>();
  LinkKinematics<Mp> kin(model);
  set_position(model, state.q, kin);
  typename Scan<TypeParam>::template Workspace<Mp> ws(model, {.links_of_block = 10});
  ASSERT_TRUE(Scan<TypeParam>::factor(model, kin, ws));
  using Element = typename TypeParam::template Element<Mp>;
  std::vector<Element> e;
  for (const scan::Block& block : ws.blocks.blocks())
    if (block.open()) e.push_back(ws.runs[block.node].element);
  ASSERT_EQ(e.size(), 3u);
  Element e01, e12, from_tips, from_base;
  TypeParam::combine(e[0], e[1], e01);
  TypeParam::combine(e01, e[2], from_tips);
  TypeParam::combine(e[1], e[2], e12);
  TypeParam::combine(e[0], e12, from_base);
  EXPECT_FALSE(from_tips.closed || from_base.closed);
  const auto difference = [](const Matrix6<Mp>& x, const Matrix6<Mp>& y) {
    return Mp((x - y).norm() / y.norm()).convert_to<double>();
  };
  EXPECT_LE(difference(from_tips.A, from_base.A), 1e-45);
  EXPECT_LE(difference(TypeParam::covariance(from_tips), TypeParam::covariance(from_base)), 1e-45);
  EXPECT_LE(difference(TypeParam::information(from_tips), TypeParam::information(from_base)),
            1e-45);
}

template <class Form>
class DivideAndConquerOf : public testing::Test {};
using Joins = testing::Types<DivideAndConquer<false>, DivideAndConquer<true>>;
TYPED_TEST_SUITE(DivideAndConquerOf, Joins, FormName);

TYPED_TEST(DivideAndConquerOf, EqualsTheSequentialFilterToAllDigits) {
  using Filter = Sequential<Conventional>;
  for (const Model<double>& model :
       {one_hinge(1), one_slide(1), slides(2), armature(3), chain(4, 37), straight_chain(20)})
    for (const Order order : {Order::balanced, Order::tips_first, Order::base_first}) {
      const Model<Mp> exact = model.cast<Mp>();
      const State<Mp> state = random_state(model, 5).cast<Mp>();
      LinkKinematics<Mp> kin(exact);
      set_position(exact, state.q, kin);
      set_velocity(exact, state.qd, kin);
      Filter::Workspace<Mp> filter(exact);
      typename TypeParam::template Workspace<Mp> ws(exact, order);
      ASSERT_TRUE(TypeParam::applies(exact));
      ASSERT_TRUE(Filter::factor(exact, kin, filter) && TypeParam::factor(exact, kin, ws));
      VectorX<Mp> a(model.nv()), joined(model.nv());
      joined.setConstant(Mp(std::numeric_limits<double>::quiet_NaN()));
      Filter::acceleration(exact, kin, state.tau, filter, a);
      TypeParam::acceleration(exact, kin, state.tau, ws, joined);
      EXPECT_LE(Mp((joined - a).norm() / a.norm()).convert_to<double>(), 1e-44);
    }
}

TYPED_TEST(DivideAndConquerOf, TakesChainsOfBodiesWithFullInertiaAlone) {
  EXPECT_TRUE(TypeParam::applies(chain(1, 5)));
  EXPECT_FALSE(TypeParam::applies(tree(1)));
  EXPECT_FALSE(TypeParam::applies(ball_in_chain(1)));
}

}  // namespace
}  // namespace kalmarm::test
