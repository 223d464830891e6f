// What the fast path answers without the whole of M^-1, and forward dynamics at rest, against truth
// of the world frame, in every form; their outcomes and what they read.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "algorithms/fast/engine/engine.hpp"
#include "algorithms/fast/test/support.hpp"
#include "algorithms/test/singular.hpp"

namespace kalmarm::test {
namespace {

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

template <class T>
Selection rounded_to(Selection selection) {
  for (Frame& frame : selection.frames) {
    for (double& x : frame.rotation) x = T(x);
    for (double& x : frame.translation) x = T(x);
  }
  return selection;
}

// Selections may name a DoF twice and in any order, which a question may not: the engine itself.
template <class T>
class Partial : public testing::Test {
 public:
  static Dynamics<T> robot_of(const Model<double>& model) {
    return dynamics_of<T>(model, spatial({Want::diagonal, Want::log_det}));
  }
  static std::unique_ptr<Engine<T>> selecting(const Model<double>& model,
                                              const Selection& selection) {
    EngineOptions options;
    options.selection = selection;
    options.want = {Want::operational, Want::operational_diagonal};
    return make_engine<T>(plain(rounded<T>(model)), options);
  }
  static Outcome ask(Engine<T>& selecting, const VectorX<T>& q, MatrixX<T>& X) {
    return selecting.answer({.want = Want::operational, .q = q.data(), .out = X.data()});
  }
  static Outcome ask(Engine<T>& selecting, const VectorX<T>& q, VectorX<T>& diagonal) {
    return selecting.answer(
        {.want = Want::operational_diagonal, .q = q.data(), .out = diagonal.data()});
  }
};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Partial, Precisions, PrecisionName);

TYPED_TEST(Partial, EveryAnswerIsThatOfFiftyDigits) {
  using T = TypeParam;
  for (const Family& family : families_and_single_bodies()) {
    double diagonal_error = 0, log_det_error = 0, selected_error = 0;
    for (int seed = 0; seed < 2; ++seed) {
      const Model<double> drawn = family.make(seed), model = rounded<T>(drawn);
      const int nv = model.nv();
      const State<T> state = random_state(drawn, seed + 1000).template cast<T>();
      const VectorX<T>& q = state.q;
      const Selection selection = rounded_to<T>(random_selection(drawn, seed));
      const Truth truth(model, state.template cast<double>());
      const double u = static_cast<double>(unit_roundoff<T>());

      Dynamics<T> robot = TestFixture::robot_of(model);
      VectorX<T> diagonal = poisoned<T>(nv);
      EXPECT_TRUE(robot.diagonal(q, diagonal));
      diagonal_error = std::max(diagonal_error, truth.diagonal(diagonal) / u);
      EXPECT_TRUE(diagonal.allFinite());
      T log_det = std::numeric_limits<T>::quiet_NaN();
      EXPECT_TRUE(robot.log_det(q, log_det));
      EXPECT_TRUE(std::isfinite(log_det));
      log_det_error = std::max(log_det_error, truth.log_det(log_det) / (u * nv));

      MatrixX<T> X = poisoned<T>(selection.size(), selection.size());
      const auto engine = TestFixture::selecting(model, selection);
      EXPECT_TRUE(TestFixture::ask(*engine, q, X));
      EXPECT_TRUE(X == X.transpose());
      // Sums of the same squares in another order.
      VectorX<T> of_X = poisoned<T>(selection.size());
      EXPECT_TRUE(TestFixture::ask(*engine, q, of_X));
      EXPECT_TRUE(((of_X - X.diagonal()).array().abs() <= 2 * T(nv * u) * of_X.array()).all());
      selected_error = std::max(selected_error, truth.selected(selection, X) / u);
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
  using T = TypeParam;
  constexpr int n = 1000;
  const Model<double> drawn = chain(5, n);
  const VectorX<T> q = random_state(drawn, 6).template cast<T>().q;
  const auto log_det_of = [&](int exponent) {
    std::vector<Joint<double>> joints;
    for (int k = 0; k < n; ++k) {
      joints.push_back(drawn.joint(k).template cast<T>().template cast<double>());
      RigidBody<double>& body = joints.back().body;
      body.mass = std::ldexp(body.mass, exponent);
      body.moments *= std::ldexp(1.0, exponent);
    }
    Dynamics<T> robot = TestFixture::robot_of(
        Model<double>(joints, drawn.names(), drawn.nq(), Vector3<double>::Zero()));
    T out = std::numeric_limits<T>::quiet_NaN();
    EXPECT_TRUE(robot.log_det(q, out));
    return static_cast<double>(out);
  };
  const double as_it_is = log_det_of(0), u = static_cast<double>(unit_roundoff<T>());
  for (int exponent : {-40, 40}) {
    const double more = n * exponent * std::numbers::ln2;
    EXPECT_NEAR(log_det_of(exponent), as_it_is + more, 4 * u * n * std::abs(exponent));
  }
}

// Nothing is left of another state.
TYPED_TEST(Partial, CallsDoNotDisturbEachOther) {
  using T = TypeParam;
  for (const Family& family : all_families()) {
    const Model<double> drawn = family.make(6);
    const VectorX<T> q = random_state(drawn, 1).template cast<T>().q;
    const VectorX<T> other = random_state(drawn, 2).template cast<T>().q;
    const Selection selection = random_selection(drawn, 3);
    const int size = selection.size();
    MatrixX<T> fresh = poisoned<T>(size, size), used = fresh;
    EXPECT_TRUE(TestFixture::ask(*TestFixture::selecting(drawn, selection), q, fresh));
    const auto engine = TestFixture::selecting(drawn, selection);
    EXPECT_TRUE(TestFixture::ask(*engine, other, used));
    used = poisoned<T>(size, size);
    EXPECT_TRUE(TestFixture::ask(*engine, q, used));
    EXPECT_TRUE(used == fresh) << family.name;

    VectorX<T> x = poisoned<T>(drawn.nv()), y = x;
    T log_det(0), again(0);
    Dynamics<T> robot = TestFixture::robot_of(drawn), unused = TestFixture::robot_of(drawn);
    EXPECT_TRUE(robot.diagonal(other, x));
    EXPECT_TRUE(robot.log_det(other, log_det));
    EXPECT_TRUE(robot.diagonal(q, x));
    EXPECT_TRUE(robot.log_det(q, log_det));
    EXPECT_TRUE(unused.diagonal(q, y));
    EXPECT_TRUE(unused.log_det(q, again));
    EXPECT_TRUE(x == y) << family.name;
    EXPECT_EQ(log_det, again) << family.name;
  }
}

// A tip so heavy that no sweep is accepted, and so light that the answer can be used.
Mechanism suspect(std::uint64_t seed) {
  Grown m(seed);
  int link = m.root;
  for (int i = 0; i < 8; ++i) link = m.add(m.joint(link));
  Joint<double> tip = m.joint(link);
  tip.body.mass *= 1.5e13;
  tip.body.moments *= 1.5e13;
  m.add(tip);
  return m.mechanism("heavy_tip", {});
}

TYPED_TEST(Partial, SingularMechanismIsReportedAndSuspectsAreAnswered) {
  using T = TypeParam;
  struct Answers {
    Selection selection;
    VectorX<T> diagonal;
    T log_det = std::numeric_limits<T>::quiet_NaN();
    MatrixX<T> selected;
    VectorX<T> selected_diagonal;
    std::vector<Outcome> outcomes;

    Answers(const Model<double>& drawn, const VectorX<double>& at)
        : selection(rounded_to<T>(random_selection(drawn, 3))),
          diagonal(poisoned<T>(drawn.nv())),
          selected(poisoned<T>(selection.size(), selection.size())),
          selected_diagonal(poisoned<T>(selection.size())) {
      const VectorX<T> q = at.cast<T>();
      Dynamics<T> robot = TestFixture::robot_of(drawn);
      const auto engine = TestFixture::selecting(drawn, selection);
      outcomes = {robot.diagonal(q, diagonal), robot.log_det(q, log_det),
                  TestFixture::ask(*engine, q, selected),
                  TestFixture::ask(*engine, q, selected_diagonal)};
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
    regular.push_back(suspect(seed));
    for (const Mechanism& mechanism : regular) {
      const Answers answers(mechanism.model, mechanism.q);
      for (const Outcome& outcome : answers.outcomes) EXPECT_TRUE(outcome) << mechanism.name;
      const bool refined = answers.outcomes[0].rung > Outcome::Rung::float64;
      suspects += refined;
      if (!refined || answers.outcomes[0].warns()) continue;
      State<double> state = random_state(mechanism.model, 1);
      state.q = rounded<T>(mechanism.q);
      const Truth truth(rounded<T>(mechanism.model), state);
      constexpr double percent = 0.01;  // without a warning
      EXPECT_LE(truth.selected(answers.selection, answers.selected), percent) << mechanism.name;
      EXPECT_TRUE(answers.selected_diagonal == answers.selected.diagonal()) << mechanism.name;
      EXPECT_LE(truth.diagonal(answers.diagonal), percent) << mechanism.name;
      EXPECT_LE(truth.log_det(answers.log_det), percent) << mechanism.name;
    }
  }
  EXPECT_GT(suspects, 0);
}

TYPED_TEST(Partial, NanInTheStateIsReported) {
  using T = TypeParam;
  const Model<double> drawn = chain(3, 12);
  Dynamics<T> robot = TestFixture::robot_of(drawn);
  const auto engine = TestFixture::selecting(drawn, {{3}, {Frame{11}}});
  VectorX<T> q = random_state(drawn, 5).template cast<T>().q, x(12);
  q[6] = std::numeric_limits<T>::quiet_NaN();
  T log_det;
  MatrixX<T> X(7, 7);
  EXPECT_FALSE(robot.diagonal(q, x));
  EXPECT_FALSE(robot.log_det(q, log_det));
  EXPECT_FALSE(TestFixture::ask(*engine, q, X));
}

template <class T>
class Rest : public testing::Test {};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Rest, Precisions, PrecisionName);

DynamicsOptions resting() {
  DynamicsOptions options = spatial({Want::acceleration});
  options.question.at_rest = true;
  return options;
}

TYPED_TEST(Rest, AccelerationIsThatWithoutVelocityWhateverItIsGiven) {
  using T = TypeParam;
  constexpr int count = 19;
  for (const Family& family : families_and_single_bodies()) {
    const Model<double> drawn = family.make(2), model = rounded<T>(drawn);
    const int nv = model.nv();
    Dynamics<T> dynamics = dynamics_of<T>(model, resting());
    Rows<T> rows(drawn, count);
    std::fill(rows.qd.begin(), rows.qd.end(), std::numeric_limits<T>::quiet_NaN());
    EXPECT_EQ(rows.forward_dynamics(dynamics), 0);
    for (int seed = 0; seed < count; ++seed) {
      State<T> state = random_state(drawn, seed).template cast<T>();
      state.qd.setZero();
      VectorX<T> a = poisoned<T>(nv);
      EXPECT_TRUE(dynamics.forward_dynamics(state.q, poisoned<T>(nv), state.tau, a));
      const VectorX<T> in_lanes = Eigen::Map<const VectorX<T>>(rows.a.data() + seed * nv, nv);
      if (seed > 1) continue;  // truth takes its time
      const Truth truth(model, state.template cast<double>());
      const double u = static_cast<double>(unit_roundoff<T>());
      EXPECT_LE(truth.acceleration(a), bound(family) * u) << family.name;
      EXPECT_LE(truth.acceleration(in_lanes), bound(family) * u) << family.name;
    }
  }
}

// A second look, and an answer, without a velocity too.
TYPED_TEST(Rest, SingularMechanismIsReported) {
  using T = TypeParam;
  const auto outcome_of = [](const Mechanism& mechanism) {
    const VectorX<T> q = mechanism.q.template cast<T>();
    const VectorX<T> none = poisoned<T>(mechanism.model.nv()), ones = VectorX<T>::Ones(none.size());
    VectorX<T> a = none;
    return dynamics_of<T>(mechanism.model, resting()).forward_dynamics(q, none, ones, a);
  };
  for (const Mechanism& mechanism : singular_mechanisms(1))
    EXPECT_EQ(outcome_of(mechanism).status, Outcome::Status::singular) << mechanism.name;
  for (const Mechanism& mechanism : regular_mechanisms(1))
    EXPECT_TRUE(outcome_of(mechanism)) << mechanism.name;
}

}  // namespace
}  // namespace kalmarm::test
