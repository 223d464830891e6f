// bench_pruning: time of an answer with and without what the question leaves out
// (dynamics/plan.hpp), in one run.
//
// Names are want/how/scene/precision; how is "whole" (no rule), "pruned" (all rules, or those left
// by --without), or "alone": the scene of --alone, asked the same of all of its joints. Pruned
// answers are verified against the whole one before they are timed. The context names the question
// and the rules that acted.
#include <benchmark/benchmark.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "accuracy/programs/common/open_scene.hpp"
#include "algorithms/dynamics/plan.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/study/flops/flops.hpp"
#include "benchmarks/case.hpp"
#include "benchmarks/driver.hpp"
#include "kalmarm/dynamics.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/scene/question.hpp"

namespace kalmarm {
namespace {

constexpr const char* timed_call =
    "From q, qd and tau of the whole scene to what is asked: the copies of what is needed, "
    "kinematics, factorisation and solution. Whole: J M^-1 J' by all of M^-1 and J; log det M by "
    "Cholesky of M by composite inertias. The plan is made before, once a model. Each call "
    "takes the next of a pool of random states.";

template <class T>
struct Result {
  VectorX<T> x;
  MatrixX<T> X;
  T number = T(0);

  // Everything as one vector.
  VectorX<double> all(Want want) const {
    if (want == Want::log_det) return VectorX<double>::Constant(1, double(number));
    if (want == Want::acceleration || want == Want::diagonal) return x.template cast<double>();
    return X.template cast<double>().reshaped();
  }
};

// One way to answer.
template <class T>
class Way {
 public:
  Way(const Scene& scene, Question question, const std::set<Rule>& rules, Want want)
      : robot_(plain(scene.model), {.question = of(std::move(question), want), .rules = rules}),
        want_(want) {
    const int n = want == Want::operational ? 6 * static_cast<int>(plan().question.frames.size())
                                            : robot_.asked();
    result_.x.setZero(n);
    if (want != Want::acceleration && want != Want::diagonal) result_.X.setZero(n, n);
  }

  const Plan& plan() const { return robot_.plan(); }
  const Result<T>& result() const { return result_; }

  Outcome operator()(const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau) {
    switch (want_) {
      case Want::acceleration:
        return robot_.forward_dynamics(q, qd, tau, result_.x);
      case Want::inverse:
        return robot_.inverse_mass(q, result_.X);
      case Want::diagonal:
        return robot_.diagonal(q, result_.x);
      case Want::log_det:
        return robot_.log_det(q, result_.number);
      case Want::operational:
        return robot_.operational(q, result_.X);
      default:
        robot_.mass(q, result_.X);
        return {};
    }
  }

 private:
  static Question of(Question question, Want want) {
    question.want = {want};
    if (want != Want::operational) question.frames.clear();
    return question;
  }

  Dynamics<T> robot_;
  Want want_;
  Result<T> result_;
};

template <class T>
void add(const std::string& how, const std::string& scene, std::shared_ptr<Way<T>> way,
         std::shared_ptr<Way<double>> right, Want want, std::shared_ptr<const Pool<T>> pool,
         std::shared_ptr<const Pool<double>> exact) {
  const int nv = right->plan().nv;
  const auto verify = [=]() -> std::string {
    for (int i = 0; i < 3; ++i) {
      if (!(*right)(exact->q[i], exact->qd[i], exact->tau[i])) return "the whole answer failed";
      if (!(*way)(pool->q[i], pool->qd[i], pool->tau[i])) return "failed";
      const VectorX<double> x = way->result().all(want), y = right->result().all(want);
      const double bound = 1000.0 * nv * static_cast<double>(unit_roundoff<T>());
      const double error = (x - y).norm() / y.norm();
      if (!(error <= bound)) return wrong(error, bound);
    }
    return "";
  };
  add_benchmark(
      name_of(to_string(want), how, scene, std::is_same_v<T, float>), verify,
      [=](int i) {
        benchmark::DoNotOptimize((*way)(pool->q[i], pool->qd[i], pool->tau[i]));
        benchmark::ClobberMemory();
      },
      flops(way->plan(), want));
}

template <class T>
void add_scene(const std::string& name, const Scene& scene, const Question& question,
               const std::set<Rule>& rules, const std::vector<std::string>& hows,
               std::uint64_t seed) {
  std::vector<State> states = random_states(scene, batch_size, seed);
  for (State& state : states) state = asked_state(scene, question, std::move(state));
  const auto pool = std::make_shared<const Pool<T>>(states);
  const auto exact = std::make_shared<const Pool<double>>(states);
  for (const Want want : question.want) {
    const auto right = std::make_shared<Way<double>>(scene, question, std::set<Rule>(), want);
    for (const std::string& how : hows)
      add<T>(how, name,
             std::make_shared<Way<T>>(scene, question, how == "whole" ? std::set<Rule>() : rules,
                                      want),
             right, want, pool, exact);
  }
}

std::string listed(const std::vector<std::string>& words) {
  std::string out;
  for (const std::string& word : words) out += (out.empty() ? "" : ",") + word;
  return out;
}

// What was asked, as the command line says it, and the rules that acted.
void add_question_context(const Scene& scene, const QuestionOptions& options, const Plan& plan) {
  std::string asked = "--want " + listed(options.want);
  for (const auto& [flag, values] :
       {std::pair{" --dofs ", &options.dofs}, std::pair{" --site ", &options.sites},
        std::pair{" --locked ", &options.locked}, std::pair{" --free ", &options.free},
        std::pair{" --without ", &options.without}})
    if (!values->empty()) asked += flag + listed(*values);
  if (options.at_rest) asked += " --at-rest";
  std::vector<std::string> rules;
  for (const Acted& acted : plan.acted) rules.push_back(to_string(acted.rule));
  int left = 0;
  for (const Part& part : plan.parts) left += part.reduction.model.nv();
  benchmark::AddCustomContext("question", asked);
  benchmark::AddCustomContext("rules", listed(rules));
  benchmark::AddCustomContext("dofs", std::to_string(scene.model.nv()));
  benchmark::AddCustomContext("dofs_left", std::to_string(left));
}

void add_scenes(const std::vector<Scene>& scenes, std::uint64_t seed,
                const QuestionOptions& options, const std::string& alone) {
  if (scenes.size() != 1) throw InputError("one scene at a time: a question names its joints");
  const Scene& scene = scenes[0];
  const Question question = question_of(scene, options);
  if (question.want.empty()) throw InputError("--want names nothing that can be timed");
  const std::set<Rule> rules = rules_of(options);
  add_question_context(scene, options, make_plan(scene.model, question, rules));
  add_scene<double>(scene.name, scene, question, rules, {"whole", "pruned"}, seed);
  add_scene<float>(scene.name, scene, question, rules, {"whole", "pruned"}, seed);
  if (alone.empty()) return;
  const Scene other = open_scene(alone, {});
  QuestionOptions all;
  all.want = options.want;
  all.at_rest = options.at_rest;
  add_scene<double>(scene.name, other, question_of(other, all), rules, {"alone"}, seed);
  add_scene<float>(scene.name, other, question_of(other, all), rules, {"alone"}, seed);
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  QuestionOptions options;
  std::string alone;
  options.want = {"acceleration"};
  return Driver{"bench_pruning", "Time of an answer with and without what a question leaves out.",
                timed_call, "[--want WHAT] [--dofs JOINTS] [--locked JOINTS] [--alone SCENE] "}
      .run(
          argc, argv,
          [&](const std::vector<Scene>& scenes, std::uint64_t seed) {
            add_scenes(scenes, seed, options, alone);
          },
          [&](CLI::App& app) {
            app.add_option("--want", options.want,
                           "any of acceleration, inverse, diagonal, log_det, mass, operational")
                ->delimiter(',')
                ->allow_extra_args(false)
                ->check(CLI::IsMember(
                    {"acceleration", "inverse", "diagonal", "log_det", "mass", "operational"}));
            options.add_to(app);
            app.add_option("--alone", alone, "a scene without the rest, to compare");
          });
}
