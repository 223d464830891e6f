// What the fast path answers without the whole of M^-1, and forward dynamics at rest, against truth
// of the world frame, in every form; and their promises: flops, outcomes, what they read.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/structured/at_rest.hpp"
#include "algorithms/structured/structured_solver.hpp"
#include "algorithms/structured/test/support.hpp"
#include "algorithms/test/singular.hpp"

namespace kalmarm::test {
namespace {

template <class T>
MatrixX<T> poisoned_matrix(int n) {
  return MatrixX<T>::Constant(n, n, std::numeric_limits<T>::quiet_NaN());
}

// Eleven limbs of one to five hinges, with armature here and there, on a free trunk and on the
// base: more than there are lanes.
Model<double> creature(std::uint64_t seed) {
  Random random(seed);
  Builder builder;
  const auto add = [&](int parent) {
    Joint<double> joint = random_joint(random, parent);
    if (random.chance(0.3)) joint.r = random.uniform(0.01, 0.1);
    return builder.add(joint);
  };
  const int trunk = builder.add_free(random_joint(random, -1));
  const int chest = add(add(trunk));
  for (int limb = 0; limb < 11; ++limb) {
    int link = limb == 10 ? -1 : limb % 3 == 0 ? trunk : chest;
    for (int k = 0; k < 1 + (limb * 3) % 5; ++k) link = add(link);
  }
  return builder.build();
}

std::vector<Family> families_and_single_bodies() {
  std::vector<Family> all = all_families();
  all.push_back({"creature", creature});
  all.push_back({"hinge", [](std::uint64_t seed) { return chain(seed, 1); }});
  all.push_back({"free_body", [](std::uint64_t seed) {
                   Random random(seed);
                   Builder builder;
                   builder.add_free(random_joint(random, -1));
                   return builder.build();
                 }});
  all.push_back({"long_chain", [](std::uint64_t seed) { return chain(seed, 50); }});
  return all;
}

// Near gimbal lock M^-1 loses what the condition of M allows.
double bound(const Family& family) {
  const std::string name = family.name;
  return name == "massless_links" ? 1600 : name == "long_chain" ? 300 : 80;
}

// DoF of all branches, one of them twice, and sites on leaves, on a branch, two on one link, one on
// the base.
Selection<double> random_selection(const Model<double>& model, std::uint64_t seed) {
  Random random(seed);
  Selection<double> selection;
  const int nv = model.nv();
  for (int i = 0; i < std::min(nv, 9); ++i) selection.dofs.push_back(random.below(nv));
  selection.dofs.push_back(selection.dofs[0]);
  for (int link : {nv - 1, nv / 2, -1, nv / 2, random.below(nv), 0})
    selection.sites.push_back({link, random.quaternion(), random.vector3()});
  return selection;
}

template <class T>
Selection<T> cast(const Selection<double>& from) {
  Selection<T> to{from.dofs, {}};
  for (const Site<double>& site : from.sites) to.sites.push_back(site.template cast<T>());
  return to;
}

// M and B of a selection in 50 digits.
struct Exact {
  MatrixX<Mp> M, X, B;
  Mp log_det = 0;

  template <class T>
  Exact(const Model<T>& rounded, const VectorX<T>& q, const Selection<T>& selection) {
    const Model<Mp> model = rounded.template cast<Mp>();
    const int nv = model.nv(), dofs = static_cast<int>(selection.dofs.size());
    M = World(model, q.template cast<Mp>(), VectorX<Mp>::Zero(nv)).mass_matrix();
    const Eigen::LDLT<MatrixX<Mp>> ldlt(M);
    X = ldlt.solve(MatrixX<Mp>::Identity(nv, nv));
    for (int k = 0; k < nv; ++k) log_det += log(Mp(ldlt.vectorD()[k]));

    RandomModel<Mp> rm(model);
    set_position(model, q.template cast<Mp>(), rm);
    std::vector<Site<Mp>> sites;
    for (const Site<T>& site : selection.sites) sites.push_back(site.template cast<Mp>());
    MatrixX<Mp> J(6 * sites.size(), nv);
    site_jacobian<Mp>(model, rm, sites, J);
    B = MatrixX<Mp>::Zero(nv, selection.size());
    for (int i = 0; i < dofs; ++i) B(selection.dofs[i], i) = 1;
    B.rightCols(J.rows()) = J.transpose();
  }
};

// Largest |x - exact| / sqrt(diagonal diagonal) in units of the roundoff; where that is zero, x has
// to be zero too. NaN counts as infinite.
template <class T>
double error_in_u(const MatrixX<T>& x, const MatrixX<Mp>& exact) {
  double worst = 0;
  for (int i = 0; i < x.rows(); ++i)
    for (int j = 0; j < x.cols(); ++j) {
      const Mp d = abs(Mp(Mp(x(i, j)) - exact(i, j)));
      const Mp size = sqrt(Mp(exact(i, i) * exact(j, j)));
      if (d == 0) continue;
      const double own = Mp(d / size).template convert_to<double>();
      worst = own <= worst ? worst : own < 1e300 ? own : std::numeric_limits<double>::infinity();
    }
  return worst / static_cast<double>(unit_roundoff<T>());
}

template <class T_, class Form_>
struct Kind {
  using T = T_;
  using Form = Form_;
};
struct KindName {
  template <class K>
  static std::string GetName(int) {
    return std::string(std::is_same_v<typename K::T, float> ? "float32" : "float64") +
           (std::is_same_v<typename K::Form, CovarianceForm> ? "" : "InSquareRoots");
  }
};

template <class K>
class Partial : public testing::Test {
 public:
  using T = typename K::T;
  using Inverse = StructuredInverse<T, typename K::Form>;
};
using Kinds = testing::Types<Kind<float, CovarianceForm>, Kind<double, CovarianceForm>,
                             Kind<float, SquareRootForm>, Kind<double, SquareRootForm>>;
TYPED_TEST_SUITE(Partial, Kinds, KindName);

TYPED_TEST(Partial, EveryAnswerIsThatOfFiftyDigits) {
  using T = typename TestFixture::T;
  for (const Family& family : families_and_single_bodies()) {
    double diagonal_error = 0, log_det_error = 0, selected_error = 0;
    for (int seed = 0; seed < 2; ++seed) {
      const Model<double> drawn = family.make(seed);
      const Model<T> model = drawn.template cast<T>();
      const int nv = model.nv();
      const VectorX<T> q = random_state(drawn, seed + 1000).template cast<T>().q;
      const Selection<T> selection = cast<T>(random_selection(drawn, seed));
      const Exact exact(model, q, selection);
      const double u = static_cast<double>(unit_roundoff<T>());

      typename TestFixture::Inverse inverse(model);
      VectorX<T> diagonal = poisoned<T>(nv);
      EXPECT_TRUE(inverse.diagonal(q, diagonal));
      for (int k = 0; k < nv; ++k) {
        const Mp relative = abs(Mp(Mp(diagonal[k]) / exact.X(k, k) - 1)) / u;
        diagonal_error = std::max(diagonal_error, relative.convert_to<double>());
        EXPECT_TRUE(std::isfinite(diagonal[k]));
      }
      T log_det = std::numeric_limits<T>::quiet_NaN();
      EXPECT_TRUE(inverse.log_det(q, log_det));
      EXPECT_TRUE(std::isfinite(log_det));
      log_det_error = std::max(
          log_det_error, Mp(abs(Mp(Mp(log_det) - exact.log_det)) / (u * nv)).convert_to<double>());

      inverse.select(selection);
      MatrixX<T> X = poisoned_matrix<T>(selection.size());
      EXPECT_TRUE(inverse.selected(q, X));
      EXPECT_TRUE(X == X.transpose());
      selected_error = std::max(
          selected_error, error_in_u(X, MatrixX<Mp>(exact.B.transpose() * exact.X * exact.B)));
      const int base = static_cast<int>(selection.dofs.size()) + 12;
      EXPECT_TRUE(X.middleCols(base, 6).isZero(0));
    }
    EXPECT_LE(diagonal_error, bound(family)) << family.name;
    EXPECT_LE(selected_error, bound(family)) << family.name;
    EXPECT_LE(log_det_error, bound(family) / 4) << family.name;
    const std::string name = family.name;
    testing::Test::RecordProperty(name + "_diagonal_in_u", std::to_string(diagonal_error));
    testing::Test::RecordProperty(name + "_selected_in_u", std::to_string(selected_error));
    testing::Test::RecordProperty(name + "_log_det_in_nu", std::to_string(log_det_error));
  }
}

// Bodies lighter or heavier by powers of two: D is scaled exactly, and its product would leave the
// range of T a hundred times over.
TYPED_TEST(Partial, LogDetOfManyLinksDoesNotOverflow) {
  using T = typename TestFixture::T;
  constexpr int n = 1000;
  const Model<double> drawn = chain(5, n);
  const VectorX<T> q = random_state(drawn, 6).template cast<T>().q;
  const auto log_det_of = [&](int exponent) {
    std::vector<Joint<T>> joints;
    for (int k = 0; k < n; ++k) {
      joints.push_back(drawn.joint(k).template cast<T>());
      RigidBody<T>& body = joints.back().body;
      body.mass = std::ldexp(body.mass, exponent);
      body.moments *= std::ldexp(T(1), exponent);
    }
    typename TestFixture::Inverse inverse(
        Model<T>(joints, drawn.names(), drawn.nq(), Vector3<T>::Zero()));
    T out = std::numeric_limits<T>::quiet_NaN();
    EXPECT_TRUE(inverse.log_det(q, out));
    return static_cast<double>(out);
  };
  const double as_it_is = log_det_of(0), u = static_cast<double>(unit_roundoff<T>());
  for (int exponent : {-40, 40}) {
    const double more = n * exponent * std::numbers::ln2;
    EXPECT_NEAR(log_det_of(exponent), as_it_is + more, 4 * u * n * std::abs(exponent));
  }
}

// Nothing is left of another state or selection.
TYPED_TEST(Partial, CallsDoNotDisturbEachOther) {
  using T = typename TestFixture::T;
  for (const Family& family : all_families()) {
    const Model<double> drawn = family.make(6);
    const Model<T> model = drawn.template cast<T>();
    const VectorX<T> q = random_state(drawn, 1).template cast<T>().q;
    const VectorX<T> other = random_state(drawn, 2).template cast<T>().q;
    const Selection<T> selection = cast<T>(random_selection(drawn, 3));
    const int size = selection.size();
    MatrixX<T> fresh = poisoned_matrix<T>(size), used = fresh, more = poisoned_matrix<T>(size);
    typename TestFixture::Inverse one(model), two(model);
    one.select(selection);
    EXPECT_TRUE(one.selected(q, fresh));
    two.select(cast<T>(random_selection(drawn, 4)));
    EXPECT_TRUE(two.selected(other, more));
    two.select(selection);
    EXPECT_TRUE(two.selected(other, more));
    EXPECT_TRUE(two.selected(q, used));
    EXPECT_TRUE(used == fresh) << family.name;

    VectorX<T> x = poisoned<T>(model.nv()), tau = VectorX<T>::Unit(model.nv(), 0), y = x;
    EXPECT_TRUE(two.diagonal(other, x));
    EXPECT_TRUE(two.diagonal(q, x));
    EXPECT_TRUE(two.factor(q));
    two.diagonal(y);
    EXPECT_TRUE(x == y) << family.name;
  }
}

// So little off its joint's axis that a form looks twice, and so much that no digit is lost.
template <class K>
Mechanism suspect(std::uint64_t seed) {
  const bool is_float = std::is_same_v<typename K::T, float>;
  const bool square_roots = std::is_same_v<typename K::Form, SquareRootForm>;
  const double off = is_float ? (square_roots ? 2e-4 : 1e-3) : (square_roots ? 1e-8 : 3e-6);
  Grown m(seed);
  Joint<double> tip = m.joint(m.root);
  tip.body = point_mass(0.7, {off, 0, 0.3});
  m.add(tip);
  return m.mechanism("point_mass_hardly_off_its_joint_axis", {});
}

TYPED_TEST(Partial, SingularMechanismIsReportedAndSuspectsAreAnswered) {
  using T = typename TestFixture::T;
  struct Answers {
    Selection<T> selection;
    VectorX<T> diagonal;
    T log_det = std::numeric_limits<T>::quiet_NaN();
    MatrixX<T> selected;
    std::vector<Outcome> outcomes;

    Answers(const Model<double>& drawn, const VectorX<double>& q)
        : selection(cast<T>(random_selection(drawn, 3))),
          diagonal(poisoned<T>(drawn.nv())),
          selected(poisoned_matrix<T>(selection.size())) {
      typename TestFixture::Inverse inverse(drawn.cast<T>());
      inverse.select(selection);
      outcomes = {inverse.diagonal(q.cast<T>(), diagonal), inverse.log_det(q.cast<T>(), log_det),
                  inverse.selected(q.cast<T>(), selected)};
    }
  };
  int suspects = 0;
  for (int seed = 0; seed < 10; ++seed) {
    for (const Mechanism& mechanism : singular_mechanisms(seed))
      for (const Outcome& outcome : Answers(mechanism.model, mechanism.q).outcomes) {
        EXPECT_EQ(outcome.status, Outcome::Status::singular) << mechanism.name << " seed " << seed;
        EXPECT_TRUE(std::ranges::count(mechanism.joints, outcome.joint)) << mechanism.name;
      }
    std::vector<Mechanism> regular = regular_mechanisms(seed);
    regular.push_back(suspect<TypeParam>(seed));
    for (const Mechanism& mechanism : regular) {
      const Answers answers(mechanism.model, mechanism.q);
      for (const Outcome& outcome : answers.outcomes) EXPECT_TRUE(outcome) << mechanism.name;
      if (!answers.outcomes[0].suspect || answers.outcomes[0].warns()) continue;
      ++suspects;
      const VectorX<T> q = mechanism.q.template cast<T>();
      const Exact exact(mechanism.model.template cast<T>(), q, answers.selection);
      const MatrixX<Mp> X = exact.B.transpose() * exact.X * exact.B;
      constexpr double percent = 0.01;  // without a warning
      const double most = percent / static_cast<double>(unit_roundoff<T>());
      EXPECT_LE(error_in_u(answers.selected, X), most) << mechanism.name;
      for (int k = 0; k < mechanism.model.nv(); ++k)
        EXPECT_LE(Mp(abs(Mp(Mp(answers.diagonal[k]) / exact.X(k, k) - 1))), percent)
            << mechanism.name;
      EXPECT_LE(Mp(abs(Mp(Mp(answers.log_det) - exact.log_det))), percent) << mechanism.name;
    }
  }
  EXPECT_GT(suspects, 0);
}

TEST(LimbsInLanes, TakeTheLimbsOfATreeAndNoOthers) {
  const Model<double> drawn = creature(1);
  const LimbsInLanes<double> limbs{StructuredModel<double>(drawn)};
  for (int k = 0; k < 8; ++k) EXPECT_FALSE(limbs.have(k)) << k;
  for (int k = 8; k < drawn.nv(); ++k) EXPECT_TRUE(limbs.have(k)) << k;
  const LimbsInLanes<double> none{StructuredModel<double>(chain(1, 12))};
  for (int k = 0; k < 12; ++k) EXPECT_FALSE(none.have(k)) << k;
}

TYPED_TEST(Partial, NanInTheStateIsReported) {
  using T = typename TestFixture::T;
  const Model<double> drawn = chain(3, 12);
  typename TestFixture::Inverse inverse(drawn.template cast<T>());
  inverse.select({{3}, {Site<T>{11}}});
  VectorX<T> q = random_state(drawn, 5).template cast<T>().q, x(12);
  q[6] = std::numeric_limits<T>::quiet_NaN();
  T log_det;
  MatrixX<T> X(7, 7);
  EXPECT_FALSE(inverse.diagonal(q, x));
  EXPECT_FALSE(inverse.log_det(q, log_det));
  EXPECT_FALSE(inverse.selected(q, X));
}

template <class T>
class Rest : public testing::Test {};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Rest, Precisions, PrecisionName);

TYPED_TEST(Rest, AccelerationIsThatWithoutVelocityWhateverItIsGiven) {
  using T = TypeParam;
  constexpr int count = 19;
  for (const Family& family : families_and_single_bodies()) {
    const Model<double> drawn = family.make(2);
    const Model<T> model = drawn.template cast<T>();
    const int nv = model.nv();
    StructuredDynamics<T, AtRest> dynamics(model);
    StructuredBatch<T, AtRest> batch(model);
    Rows<T> rows(drawn, count);
    std::fill(rows.qd.begin(), rows.qd.end(), std::numeric_limits<T>::quiet_NaN());
    EXPECT_EQ(batch.acceleration(count, rows.q.data(), rows.qd.data(), rows.tau.data(),
                                 rows.a.data(), rows.outcomes.data()),
              0);
    for (int seed = 0; seed < count; ++seed) {
      State<T> state = random_state(drawn, seed).template cast<T>();
      state.qd.setZero();
      VectorX<T> a = poisoned<T>(nv);
      EXPECT_TRUE(dynamics.acceleration(state.q, poisoned<T>(nv), state.tau, a));
      const VectorX<T> in_lanes = Eigen::Map<const VectorX<T>>(rows.a.data() + seed * nv, nv);
      if (seed > 1) continue;  // truth takes its time
      const Truth truth(model.template cast<Mp>(), state.template cast<Mp>());
      const double u = static_cast<double>(unit_roundoff<T>());
      EXPECT_LE(truth.error(a), bound(family) * u) << family.name;
      EXPECT_LE(truth.error(in_lanes), bound(family) * u) << family.name;
    }
  }
}

// Looked into, and answered, without a velocity too.
TYPED_TEST(Rest, SingularMechanismIsReported) {
  using T = TypeParam;
  for (const Mechanism& mechanism : singular_mechanisms(1)) {
    const Model<T> model = mechanism.model.template cast<T>();
    const VectorX<T> q = mechanism.q.template cast<T>(), none = poisoned<T>(model.nv());
    StructuredSolver<T, AtRest> solver(model);
    VectorX<T> a = none;
    EXPECT_EQ(solver.acceleration(q, none, VectorX<T>::Ones(model.nv()), a).status,
              Outcome::Status::singular)
        << mechanism.name;
  }
  for (const Mechanism& mechanism : regular_mechanisms(1)) {
    const Model<T> model = mechanism.model.template cast<T>();
    const VectorX<T> q = mechanism.q.template cast<T>(), none = poisoned<T>(model.nv());
    StructuredSolver<T, AtRest> solver(model);
    VectorX<T> a = none;
    EXPECT_TRUE(solver.acceleration(q, none, VectorX<T>::Ones(model.nv()), a)) << mechanism.name;
  }
}

TEST(RestFlops, HingeOfAChainCostsNoMoreFlopsThanIsSaid) {
  for (int n : {31, 100}) {
    const double flops = flops_per_joint<AtRest>(chain(1, n));
    EXPECT_GE(flops, 230) << "does it count?";
    EXPECT_LE(flops, 300);
    testing::Test::RecordProperty("flops", std::to_string(flops));
  }
}

}  // namespace
}  // namespace kalmarm::test
