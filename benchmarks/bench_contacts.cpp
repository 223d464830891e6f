// bench_contacts: time of H^-1 b, H = M + J'DJ of a robot that stands on points, by every way of
// carrying contacts that bin/contacts measures.
//
// Names are contacts/variant/scene/precision. Everything is verified before it is timed, against
// Gram-Schmidt arrays in float64.
#include <benchmark/benchmark.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "accuracy/programs/common/ranges.hpp"
#include "algorithms/study/contact_variants.hpp"
#include "benchmarks/case.hpp"
#include "benchmarks/driver.hpp"
#include "robots/scene/question.hpp"
#include "robots/scene/standing.hpp"

namespace kalmarm {
namespace {

constexpr const char* timed_call =
    "From q, contacts and b to H^-1 b: kinematics, factors, one solve, the test for singularity. "
    "Memory is taken before. Each call takes the next of a pool of random states.";
constexpr double most_wrong = 0.05;  // at 1e4 kg float32's Cholesky has 1 %

struct Options {
  std::vector<std::string> feet;
  int points = 4;
  double stiffness = 1e4;
};

template <class T, class V>
class StandingSolver {
 public:
  StandingSolver(const Model<double>& model, std::vector<ContactRow<T>> contacts)
      : model_(model.cast<T>()), kin_(model_), ws_(model_), contacts_(std::move(contacts)) {}

  Outcome operator()(const VectorX<T>& q, const VectorX<T>& b, VectorX<T>& x) {
    set_position(model_, q, kin_);
    const Outcome outcome = V::factor(model_, kin_, std::span<const ContactRow<T>>(contacts_), ws_);
    if (outcome) V::solve(model_, kin_, b, ws_, x);
    return outcome;
  }

 private:
  Model<T> model_;
  LinkKinematics<T> kin_;
  typename V::template Workspace<T> ws_;
  std::vector<ContactRow<T>> contacts_;
};

struct Robot {
  std::shared_ptr<const Case> c;
  std::vector<ContactRow<double>> contacts;  // of stiffness 1
  double stiffness;
};

template <class T, class V>
void add(const Robot& robot, std::shared_ptr<const Pool<T>> pool) {
  const Model<double>& model = robot.c->scene.model;
  auto call =
      std::make_shared<StandingSolver<T, V>>(model, stiffened<T>(robot.contacts, robot.stiffness));
  auto x = std::make_shared<VectorX<T>>(model.nv());
  const auto verify = [=]() -> std::string {
    StandingSolver<double, Sequential<ArrayMGS>> right(
        model, stiffened<double>(robot.contacts, robot.stiffness));
    VectorX<double> y(model.nv());
    for (int i = 0; i < robot.c->verified(); ++i) {
      const State& state = robot.c->states[i];
      if (const Outcome outcome = right(state.q, state.tau, y); !outcome)
        return describe(robot.c->scene, outcome);
      if (const Outcome outcome = (*call)(pool->q[i], pool->tau[i], *x); !outcome)
        return describe(robot.c->scene, outcome);
      const double error = (x->template cast<double>() - y).norm() / y.norm();
      if (!(error <= most_wrong)) return wrong(error, most_wrong);
    }
    return "";
  };
  add_benchmark(name_of<T>("contacts", V::name(), *robot.c), verify, [=](int i) {
    benchmark::DoNotOptimize((*call)(pool->q[i], pool->tau[i], *x));
    benchmark::DoNotOptimize(x->data());
  });
}

template <class T>
void add_all(const Robot& robot) {
  const auto pool = std::make_shared<const Pool<T>>(robot.c->states);
  for_each_contact_variant([&]<class V>() { add<T, V>(robot, pool); });
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  Options options;
  const auto add_scenes = [&](const std::vector<Scene>& scenes, std::uint64_t seed) {
    for (const Scene& scene : scenes) {
      Standing standing{standing_links(scene, options.feet), options.points};
      const Robot robot{std::make_shared<const Case>(scene, seed),
                        contacts_of(scene.model, standing, seed), options.stiffness};
      add_all<double>(robot);
      add_all<float>(robot);
    }
  };
  return Driver{"bench_contacts", "Time of (M + J'DJ)^-1 b of robots that stand on points.",
                timed_call, "[--feet JOINTS] [--points N] [--stiffness D]"}
      .run(argc, argv, add_scenes, [&](CLI::App& app) {
        app.add_option("--feet", options.feet, "joints whose links stand; all tips by default")
            ->delimiter(',');
        app.add_option("--points", options.points, "points of each")
            ->check(between(1, 100))
            ->capture_default_str();
        app.add_option("--stiffness", options.stiffness, "d along a contact's normal [kg]")
            ->check(positive())
            ->capture_default_str();
      });
}
