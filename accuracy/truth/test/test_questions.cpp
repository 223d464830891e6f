// Whatever rules are on, the answer is the same, to 10 u kS: kS is what an answer that is as good
// as its parameters may differ by, of every kind of answer worked out here by moving them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "accuracy/measures/real.hpp"
#include "accuracy/truth/move.hpp"
#include "algorithms/dynamics/plan.hpp"
#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/study/solver_engine.hpp"
#include "robots/scene/question.hpp"
#include "robots/scene/scene.hpp"
#include "robots/scene/sites.hpp"

namespace kalmarm {
namespace {

using Rules = std::set<Rule>;

// Options of Dynamics: the fast path's plain form, by these rules.
DynamicsOptions asking(const Question& question, const Rules& rules = {}) {
  return {.question = question, .rules = rules};
}

struct Answers {
  VectorX<double> a, x, tau, diagonal, of_frames;
  MatrixX<double> X, M, operational;
  double log_det = 0;

  // Of the fast path in T.
  template <class T>
  static Answers of(const Model<double>& model, const DynamicsOptions& options,
                    const State& state) {
    return of(Dynamics<T>(plain(model), options), state);
  }

  template <class T>
  static Answers of(Dynamics<T> robot, const State& state) {
    const VectorX<T> q = state.q.cast<T>(), qd = state.qd.cast<T>(), tau = state.tau.cast<T>();
    const Question& question = robot.plan().question;
    const int n = robot.asked(), rows = 6 * static_cast<int>(question.frames.size());
    VectorX<T> a(n), x(n), torque(n), diagonal(n), of_frames(rows);
    MatrixX<T> X(n, n), M(n, n), operational(rows, rows);
    T log_det(0);
    const auto wants = [&](Want want) { return question.wants(want); };
    const auto expect_ok = [](const Outcome& outcome) {
      EXPECT_TRUE(outcome) << to_string(outcome.status) << " at " << outcome.joint;
    };
    if (wants(Want::acceleration)) expect_ok(robot.forward_dynamics(q, qd, tau, a));
    if (wants(Want::solve)) {
      expect_ok(robot.factor(q));
      EXPECT_TRUE(robot.solve(VectorX<T>(tau(robot.plan().asked)), x));
    }
    if (wants(Want::inverse_dynamics)) robot.inverse_dynamics(q, qd, tau, torque);
    if (wants(Want::inverse)) expect_ok(robot.inverse_mass(q, X));
    if (wants(Want::diagonal)) expect_ok(robot.diagonal(q, diagonal));
    if (wants(Want::log_det)) expect_ok(robot.log_det(q, log_det));
    if (wants(Want::mass)) robot.mass(q, M);
    if (wants(Want::operational)) expect_ok(robot.operational(q, operational));
    if (wants(Want::operational_diagonal)) expect_ok(robot.operational_diagonal(q, of_frames));
    return {a.template cast<double>(),
            x.template cast<double>(),
            torque.template cast<double>(),
            diagonal.template cast<double>(),
            of_frames.template cast<double>(),
            X.template cast<double>(),
            M.template cast<double>(),
            operational.template cast<double>(),
            double(log_det)};
  }
};

// Of symmetric matrices, entries by the roots of their diagonals'.
double difference(const MatrixX<double>& X, const MatrixX<double>& right) {
  const VectorX<double> size = right.diagonal().cwiseAbs().cwiseSqrt().cwiseMax(1e-300);
  return (size.cwiseInverse().asDiagonal() * (X - right) * size.cwiseInverse().asDiagonal())
      .cwiseAbs()
      .maxCoeff();
}

double difference(Want want, const Answers& x, const Answers& right) {
  switch (want) {
    case Want::acceleration:
      return (x.a - right.a).norm() / right.a.norm();
    case Want::inverse:
      return difference(x.X, right.X);
    case Want::diagonal:
      return (x.diagonal - right.diagonal).cwiseQuotient(right.diagonal).cwiseAbs().maxCoeff();
    case Want::log_det:
      return std::abs(x.log_det - right.log_det) / std::max(1.0, std::abs(right.log_det));
    case Want::mass:
      return difference(x.M, right.M);
    case Want::operational:
      return difference(x.operational, right.operational);
    case Want::operational_diagonal:
      return difference(x.of_frames.asDiagonal(), right.of_frames.asDiagonal());
    case Want::solve:
      return (x.x - right.x).norm() / right.x.norm();
    case Want::inverse_dynamics:
      return (x.tau - right.tau).norm() / right.tau.norm();
    case Want::derivatives:
      break;  // test_dynamics.cpp
  }
  return 0;
}

// The largest trace(r-(k)) / D(k), and / M(k,k): turning P, and r- in the same way, by the double
// angle leaves errors of u times its trace in every entry, and so in D, and in M(k,k) = H r- H' + r.
struct Spread {
  double of_factors = 1, of_mass = 1;
};

Spread spread(const Plan& plan, const State& state) {
  Spread out;
  for (const Part& part : plan.parts) {
    const Model<double>& model = part.reduction.model;
    const VectorX<double> q = state.q(part.reduction.q_whole);
    LinkKinematics<double> kin(model);
    CompositeInertia<double> composite(model);
    set_position(model, q, kin);
    set_composite_inertia(model, kin, composite);
    VectorX<double> D(model.nv());
    MatrixX<double> g(6, model.nv());
    EXPECT_TRUE(make_solver<double>("Sequential<ArrayMGS>", model)->factors(q, D, g));
    for (int k = 0; k < model.nv(); ++k) {
      const SpatialInertia<double>& r = composite.r_minus[k];
      const Joint<double>& joint = model.joint(k);
      const double trace = joint.slides ? 3 * r.m : r.I.trace();
      out.of_factors = std::max(out.of_factors, trace / D[k]);
      out.of_mass = std::max(out.of_mass, trace / ((joint.slides ? r.m : r.I(2, 2)) + joint.r));
    }
  }
  return out;
}

// What an answer may be wrong by, in u: 10 times kS of its kind, and never below 10, since a result
// is rounded; where it is made of factors alone also 3 times the spread of what D is made of: once
// for D, and once each for the sums of P's two other blocks; M likewise.
std::vector<double> bounds(const Scene& scene, const Question& question, const State& state,
                           const Answers& right) {
  constexpr double delta = 1e-7;
  constexpr int draws = 6;
  std::vector<double> squares(question.want.size(), 0);
  for (int draw = 0; draw < draws; ++draw) {
    Move<double> move(delta, draw);
    const Model<double> moved = move.moved(scene.model);
    Question there = question;
    for (Frame& frame : there.frames) {
      for (double& x : frame.rotation) move(x);
      for (double& x : frame.translation) move(x);
    }
    for (double& x : there.q) move(x);
    const State at{move.moved(state.q), move.moved(state.qd), move.moved(state.tau)};
    const Answers answers = Answers::of<double>(moved, asking(there), at);
    std::size_t i = 0;
    for (const Want want : question.want) {
      const double d = difference(want, answers, right) / delta;
      squares[i++] += d * d / draws;
    }
  }
  const Spread lost = spread(make_plan(scene.model, question, {Rule::locked_joints}), state);
  std::vector<double> out;
  std::size_t i = 0;
  for (const Want want : question.want) {
    const bool by_factors = want != Want::acceleration && want != Want::inverse_dynamics;
    const double turned = want == Want::mass ? lost.of_mass : by_factors ? lost.of_factors : 0;
    out.push_back(std::max({10.0, 10 * std::sqrt(squares[i++]), 3 * turned}));
  }
  return out;
}

// All rules, none, all but one, one alone.
std::vector<Rules> selections() {
  std::vector<Rules> out{all_rules(), {}};
  for (const Rule rule : all_rules()) {
    out.push_back(all_rules());
    out.back().erase(rule);
    out.push_back({rule});
  }
  return out;
}

std::string names(const Rules& rules) {
  std::string out;
  for (const Rule rule : rules) out += std::string(" ") + to_string(rule);
  return out;
}

void expect_same_answers(const Scene& scene, const Question& question, int seed) {
  const State state = asked_state(scene, question, random_states(scene, 1, seed)[0]);
  const Digits digits(60);
  const Answers right = Answers::of(
      Dynamics<Real>(plain(scene.model), asking(question), engines_by<Real>([](const auto& model) {
                       return make_solver<Real>("Sequential<ArrayMGS>", model);
                     })),
      state);
  const std::vector<double> bound = bounds(scene, question, state, right);
  for (const Rules& rules : selections()) {
    const Answers float64 = Answers::of<double>(scene.model, asking(question, rules), state);
    const Answers float32 = Answers::of<float>(scene.model, asking(question, rules), state);
    std::size_t i = 0;
    for (const Want want : question.want) {
      EXPECT_LE(difference(want, float64, right), unit_roundoff<double>() * bound[i])
          << scene.name << " " << to_string(want) << ", bound " << bound[i] << " u, by"
          << names(rules);
      EXPECT_LE(difference(want, float32, right), unit_roundoff<float>() * bound[i])
          << scene.name << " " << to_string(want) << " float32, bound " << bound[i] << " u, by"
          << names(rules);
      ++i;
    }
  }
}

const std::vector<std::string> everything{"acceleration", "inverse", "diagonal", "log_det", "mass"};

class Questions : public testing::TestWithParam<std::string> {
 protected:
  Scene scene = load_scene(GetParam());

  void ask(const QuestionOptions& options) {
    Question question = question_of(scene, options);
    if (question.wants(Want::acceleration))
      question.want.insert({Want::solve, Want::inverse_dynamics});
    if (question.wants(Want::operational)) question.want.insert(Want::operational_diagonal);
    expect_same_answers(scene, question, 3);
  }
  QuestionOptions options(std::vector<std::string> want) {
    QuestionOptions out;
    out.want = std::move(want);
    return out;
  }
  // Its joints by name, without the axes of those of several DoF.
  std::vector<std::string> joints() const {
    std::vector<std::string> out;
    for (int k = 0; k < scene.model.nv(); ++k) {
      std::string name = scene.model.name(k);
      if (q_entries(scene.model.joint(k).coordinate) != 1) name = name.substr(0, name.find(':'));
      if (out.empty() || out.back() != name) out.push_back(name);
    }
    return out;
  }
};

TEST_P(Questions, OfNothingButTheQuestion) { ask(options(everything)); }

TEST_P(Questions, OfVelocities) {
  QuestionOptions rest = options({"acceleration"});
  rest.at_rest = true;
  ask(rest);
}

TEST_P(Questions, OfJointsNotAskedAbout) {
  QuestionOptions some = options({"acceleration", "inverse", "diagonal", "mass"});
  some.dofs = {joints().front(), joints().back()};
  ask(some);
}

TEST_P(Questions, OfLockedJoints) {
  QuestionOptions locked = options(everything);
  const std::vector<std::string> all = joints();
  for (std::size_t i = 1; i < all.size(); i += 2) locked.locked.push_back(all[i]);
  if (locked.locked.empty()) return;
  ask(locked);
  locked.locked = {all.front()};
  ask(locked);
}

TEST_P(Questions, OfAllButSlides) {
  QuestionOptions slides = options(everything);
  for (int k = 0; k < scene.model.nv(); ++k)
    if (scene.model.joint(k).coordinate == Coordinate::distance)
      slides.free.push_back(scene.model.name(k));
  if (slides.free.empty()) return;
  const Plan plan = make_plan(scene.model, question_of(scene, slides), all_rules());
  for (const Part& part : plan.parts) EXPECT_EQ(part.kernel, Kernel::translational);
  ask(slides);
}

TEST_P(Questions, OfAllButSites) {
  QuestionOptions sites = options({"operational"});
  const std::vector<NamedSite> known = sites_of(scene);
  sites.sites = {known.back().name, known[known.size() / 2].name};
  ask(sites);
}

INSTANTIATE_TEST_SUITE_P(Robots, Questions, testing::ValuesIn(shipped_robots()),
                         [](const auto& info) { return info.param; });
INSTANTIATE_TEST_SUITE_P(Scenes, Questions, testing::ValuesIn(shipped_scenes()),
                         [](const auto& info) { return info.param; });
INSTANTIATE_TEST_SUITE_P(Families, Questions, testing::Values("planar:10", "chain:12", "tree:12"),
                         [](const auto& info) {
                           return info.param.substr(0, info.param.find(':'));
                         });

// The rules act where they should.
TEST(Plans, NameTheRulesThatAct) {
  const auto acted = [](const std::string& scene_name, const QuestionOptions& options) {
    const Scene scene = load_scene(scene_name);
    const Plan plan = make_plan(scene.model, question_of(scene, options), all_rules());
    std::vector<std::string> out;
    for (const Acted& rule : plan.acted) out.push_back(to_string(rule.rule));
    return out;
  };
  using Names = std::vector<std::string>;
  QuestionOptions options;
  options.want = {"acceleration"};
  EXPECT_EQ(acted("g1", options), Names{"zero_terms"});
  EXPECT_EQ(acted("chain:12", options), Names{});
  EXPECT_EQ(acted("planar:10", options), Names{"zero_terms"});
  EXPECT_EQ(acted("table", options), Names{"zero_terms"});
  options.want = {"inverse"};
  EXPECT_EQ(acted("table", options), (Names{"separate_trees", "zero_terms"}));
  options.want = {"acceleration"};
  options.dofs = {"panda_joint*"};
  EXPECT_EQ(acted("table", options), (Names{"untouched_trees", "zero_terms"}));
  options.dofs = {};
  options.free = {"left_hip*", "left_knee*", "left_ankle*"};
  EXPECT_EQ(acted("g1", options), (Names{"locked_joints", "zero_terms"}));
  options.free = {"cart_x", "cart_y"};
  EXPECT_EQ(acted("moving_base", options), (Names{"locked_joints", "translations"}));
  options.free = {"cart_*"};
  options.want = {"inverse", "diagonal"};
  EXPECT_EQ(acted("moving_base", options),
            (Names{"locked_joints", "zero_terms", "partial_answers"}));
}

// Two hinges, of which the second carries a slide that moves nothing.
Scene with_massless_branch() {
  std::vector<Joint<double>> joints(3);
  for (int k = 0; k < 3; ++k) {
    joints[k].parent = k - 1;
    joints[k].q_index = k;
    joints[k].translation = {0.3, 0.1 * k, 0.2};
  }
  joints[0].body = {2, {0.1, 0, 0}, {1, 0, 0, 0}, {0.1, 0.2, 0.25}};
  joints[1].body = {1, {0.2, 0.1, 0}, {1, 0, 0, 0}, {0.1, 0.1, 0.1}};
  joints[2].slides = true;
  joints[2].coordinate = Coordinate::distance;
  return generated_scene("massless",
                         Model<double>(std::move(joints), {"a", "b", "nothing"}, 3, {0, 0, -9.81}));
}

TEST(Plans, ABranchThatMovesNothingIsDroppedOrSaidToBeSingular) {
  const Scene scene = with_massless_branch();
  const State state = random_states(scene, 1, 1)[0];
  Question question;
  question.want = {Want::acceleration};
  Dynamics<double> whole(plain(scene.model), asking(question, all_rules()));
  EXPECT_EQ(whole.plan().singular, std::vector<int>{2});
  VectorX<double> all(3);
  EXPECT_FALSE(whole.forward_dynamics(state.q, state.qd, state.tau, all));

  question.dofs = {0, 1};
  Dynamics<double> pruned(plain(scene.model), asking(question, all_rules()));
  EXPECT_TRUE(pruned.plan().singular.empty());
  EXPECT_EQ(pruned.plan().acted.front().rule, Rule::massless_branches);
  VectorX<double> a(2), right(2);
  EXPECT_TRUE(pruned.forward_dynamics(state.q, state.qd, state.tau, a));
  const Model<double>& model = scene.model;
  const Model<double> without({model.joint(0), model.joint(1)}, {"a", "b"}, 2, model.gravity());
  EXPECT_TRUE(make_solver<double>("Sequential<ArrayMGS>", without)
                  ->acceleration(state.q.head(2), state.qd.head(2), state.tau.head(2), right));
  EXPECT_LE((a - right).norm(), 1e-14 * right.norm());
}

TEST(Plans, ALegAloneIsAChainOfItsJoints) {
  const Scene scene = load_scene("g1");
  QuestionOptions options;
  options.want = {"acceleration"};
  options.free = {"left_hip*", "left_knee*", "left_ankle*"};
  const Plan plan = make_plan(scene.model, question_of(scene, options), {Rule::locked_joints});
  ASSERT_EQ(plan.parts.size(), 1u);
  EXPECT_EQ(plan.parts[0].reduction.model.nv(), 6);
  EXPECT_EQ(plan.parts[0].reduction.model.nq(), 6);
}

}  // namespace
}  // namespace kalmarm
