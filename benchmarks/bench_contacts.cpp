// bench_contacts: time of H^-1 b, H = M + J'DJ of a robot that stands on points, by every way of
// carrying contacts that bin/contacts measures, and by the library of one state and of rows of
// states, with and without contacts.
//
// Names are contacts/variant/scene/precision; of rows rows_of_contacts, M^-1 b is solve and
// rows_of_solves. MuJoCo: M from q, J'DJ of rows J that are there (its collisions make them), a dense
// Cholesky factor of their sum, a solve, all by its own functions. Everything is verified before it is
// timed, against Gram-Schmidt arrays in float64.
#include <benchmark/benchmark.h>

#include <CLI/CLI.hpp>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "accuracy/programs/common/ranges.hpp"
#include "algorithms/study/contact_variants.hpp"
#include "algorithms/study/contacts/standing_ladder.hpp"
#include "benchmarks/case.hpp"
#include "benchmarks/driver.hpp"
#include "robots/scene/mujoco_solver.hpp"
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
    return solve_standing<V>(model_, kin_, std::span<const ContactRow<T>>(contacts_), b, ws_, x);
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

// "" where call(q, b, x) of the first states is near enough to H^-1 b, of stiffness d.
template <class T, class Call>
std::string verify(const Robot& robot, const Pool<T>& pool, double d, Call&& call) {
  const Model<double>& model = robot.c->scene.model;
  StandingSolver<double, Sequential<ArrayMGS>> right(model, stiffened<double>(robot.contacts, d));
  VectorX<double> y(model.nv());
  VectorX<T> x(model.nv());
  for (int i = 0; i < robot.c->verified(); ++i) {
    const State& state = robot.c->states[i];
    if (const Outcome outcome = right(state.q, state.tau, y); !outcome)
      return describe(robot.c->scene, outcome);
    if (const Outcome outcome = call(pool.q[i], pool.tau[i], x); !outcome)
      return describe(robot.c->scene, outcome);
    const double error = (x.template cast<double>() - y).norm() / y.norm();
    if (!(error <= most_wrong)) return wrong(error, most_wrong);
  }
  return "";
}

template <class T, class V>
void add(const Robot& robot, std::shared_ptr<const Pool<T>> pool) {
  const Model<double>& model = robot.c->scene.model;
  auto call =
      std::make_shared<StandingSolver<T, V>>(model, stiffened<T>(robot.contacts, robot.stiffness));
  auto x = std::make_shared<VectorX<T>>(model.nv());
  add_benchmark(
      name_of<T>("contacts", V::name(), *robot.c),
      [=] { return verify(robot, *pool, robot.stiffness, *call); },
      [=](int i) {
        benchmark::DoNotOptimize((*call)(pool->q[i], pool->tau[i], *x));
        benchmark::DoNotOptimize(x->data());
      });
}

// By the library: of one state, and of rows, all of them with the same contacts.
template <class T>
void add_ladder(const Robot& robot, std::shared_ptr<const Pool<T>> pool, double tolerance) {
  const Model<double>& model = robot.c->scene.model;
  auto ladder = std::make_shared<StandingLadder<T>>(
      model, stiffened<T>(robot.contacts, robot.stiffness), tolerance);
  auto x = std::make_shared<VectorX<T>>(model.nv());
  const std::string name = ladder->name(tolerance);
  const auto verify_contacts = [=] { return verify(robot, *pool, robot.stiffness, *ladder); };
  const auto verify_none = [=] {
    return verify(robot, *pool, 0, [=](const auto& q, const auto& b, auto& x) {
      return ladder->without_contacts(q, b, x);
    });
  };
  add_benchmark(name_of<T>("contacts", name, *robot.c), verify_contacts, [=](int i) {
    benchmark::DoNotOptimize((*ladder)(pool->q[i], pool->tau[i], *x));
    benchmark::DoNotOptimize(x->data());
  });
  add_benchmark(name_of<T>("solve", name, *robot.c), verify_none, [=](int i) {
    benchmark::DoNotOptimize(ladder->without_contacts(pool->q[i], pool->tau[i], *x));
    benchmark::DoNotOptimize(x->data());
  });
  const auto count = static_cast<std::ptrdiff_t>(pool->q.size());
  auto w = std::make_shared<std::vector<T>>();
  for (std::ptrdiff_t i = 0; i < count; ++i)
    w->insert(w->end(), ladder->rows().begin(), ladder->rows().end());
  auto out = std::make_shared<std::vector<T>>(count * model.nv());
  auto outcomes = std::make_shared<std::vector<Outcome>>(count);
  const auto rows = [=](const ContactRows<T>& contacts) {
    benchmark::DoNotOptimize(
        ladder->dynamics().solve(pool->q_rows, pool->tau_rows, *out, *outcomes, 1, contacts));
    benchmark::DoNotOptimize(out->data());
  };
  add_benchmark(
      name_of<T>("rows_of_contacts", name, *robot.c), verify_contacts,
      [=](int) {
        rows({RowsView<const T>(*w), Axes::local});
      },
      0, batch_size);
  add_benchmark(
      name_of<T>("rows_of_solves", name, *robot.c), verify_none, [=](int) { rows({}); }, 0,
      batch_size);
}

class MujocoStanding {
 public:
  MujocoStanding(const Robot& robot)
      : solver_(mujoco_of(robot.c->scene)),
        H_(robot.c->scene.model.nv(), robot.c->scene.model.nv()) {
    const Model<double>& model = robot.c->scene.model;
    const auto contacts = stiffened<double>(robot.contacts, robot.stiffness);
    LinkKinematics<double> kin(model);
    VectorX<double> J(model.nv());
    for (const ContactRow<double>& row : contacts) d_.push_back(row.d);
    for (const State& state : robot.c->states) {
      set_position(model, state.q, kin);
      MatrixX<double>& rows = J_.emplace_back(model.nv(), contacts.size());  // a row a column
      for (std::size_t i = 0; i < contacts.size(); ++i) {
        contact_jacobian(model, kin, contacts[i], J);
        rows.col(i) = J;
      }
    }
    JDJ_ = H_;
  }

  // x = H^-1 b of state i.
  Outcome operator()(int i, const VectorX<double>& q, const VectorX<double>& b,
                     VectorX<double>& x) {
    const int nv = static_cast<int>(H_.rows()), rows = static_cast<int>(d_.size());
    solver_.mass(q, H_);
    mju_sqrMatTD(JDJ_.data(), J_[i].data(), d_.data(), rows, nv);
    H_ += JDJ_;
    const bool whole = mju_cholFactor(H_.data(), nv, 0) == nv;
    mju_cholSolve(x.data(), H_.data(), b.data(), nv);
    return {.status = whole ? Outcome::Status::ok : Outcome::Status::indefinite};
  }

 private:
  MujocoSolver solver_;
  MatrixX<double> H_, JDJ_;
  std::vector<double> d_;
  std::vector<MatrixX<double>> J_;  // of every state
};

void add_mujoco(const Robot& robot) {
  const auto pool = std::make_shared<const Pool<double>>(robot.c->states);
  auto mujoco = std::make_shared<MujocoStanding>(robot);
  auto x = std::make_shared<VectorX<double>>(robot.c->scene.model.nv());
  add_benchmark(
      name_of<double>("contacts", "MuJoCo", *robot.c),
      [=] {
        int i = 0;
        return verify(robot, *pool, robot.stiffness, [&](const auto& q, const auto& b, auto& x) {
          return (*mujoco)(i++, q, b, x);
        });
      },
      [=](int i) {
        benchmark::DoNotOptimize((*mujoco)(i, pool->q[i], pool->tau[i], *x));
        benchmark::DoNotOptimize(x->data());
      });
}

template <class T>
void add_all(const Robot& robot) {
  const auto pool = std::make_shared<const Pool<T>>(robot.c->states);
  for_each_contact_variant([&]<class V>() { add<T, V>(robot, pool); });
  add_ladder<T>(robot, pool, default_tolerance<T>);
  if (std::is_same_v<T, double>) add_ladder<T>(robot, pool, last_bits);
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
      add_mujoco(robot);
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
