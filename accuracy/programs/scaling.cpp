// scaling: the error of every variant against truth, and the condition of the mass matrix. CSV,
// one measurement a row:
//   scene,n,variant,precision,task,state,measure,value,outcome
// Parameters and states are rounded to a precision first, and truth is exact for what was rounded.
// How far the truth may be from it at most is proven (truth.hpp): measure truth_width.
// With --ladder exhibits of the ladder are measured too, and the same states as rows of one call at
// every tolerance: tasks acceleration_batch and inverse_batch. With --generated so is code for one robot by the study's variants,
// worked out operation by operation.
// MuJoCo runs on its own parameters, from which the model's were lowered with rounding.
// Outputs hold NaN before every call. A failure keeps its rows, with value nan and its outcome. A
// scene that is singular once rounded to float32 has no truth there: all its rows are failures.
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "accuracy/measures/measures.hpp"
#include "accuracy/programs/common/command_line.hpp"
#include "accuracy/programs/common/csv.hpp"
#include "accuracy/programs/common/open_scene.hpp"
#include "accuracy/programs/common/output_file.hpp"
#include "accuracy/programs/common/progress.hpp"
#include "accuracy/programs/common/ranges.hpp"
#include "accuracy/truth/truth_cache.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/study/solver.hpp"
#include "kalmarm/dynamics.hpp"
#include "robots/scene/mujoco_solver.hpp"

namespace kalmarm {
namespace {

// M, M^-1 and a are held in multi-precision, some 100 bytes an entry.
constexpr int largest = 2000;

template <class T>
constexpr const char* precision_name = std::is_same_v<T, float> ? "float32" : "float64";

class Table {
 public:
  struct Measure {
    const char* name;
    double value;
  };

  // Rows to come are of this scene, precision and state.
  void select(const Scene& scene, const char* precision, int state) {
    scene_ = field(scene.name) + ',' + std::to_string(scene.model.nv()) + ',';
    precision_ = precision;
    state_ = std::to_string(state);
  }

  void add(const std::string& variant, const char* task, const Outcome& outcome,
           std::initializer_list<Measure> measures) {
    for (const Measure& measure : measures)
      text_ += scene_ + field(variant) + ',' + precision_ + ',' + task + ',' + state_ + ',' +
               measure.name + ',' + number(measure.value) + ',' + to_string(outcome.status) + '\n';
  }

  const std::string& text() const { return text_; }

 private:
  std::string scene_, precision_, state_;
  std::string text_ = "scene,n,variant,precision,task,state,measure,value,outcome\n";
};

template <class T>
struct Contender {
  std::string name;
  std::shared_ptr<Solver<T>> solver;
};

// All states, answered by the ladder at a tolerance in one call a task.
template <class T>
struct AnsweredRows {
  std::string name;
  std::vector<Outcome> of_a, of_X;
  std::vector<T> a, X;

  AnsweredRows(const RegisteredVariant<T>& variant, const Model<T>& model,
               const std::vector<State>& states)
      : name(variant.name),
        of_a(states.size()),
        of_X(states.size()),
        a(states.size() * model.nv(), std::numeric_limits<T>::quiet_NaN()),
        X(a.size() * model.nv(), std::numeric_limits<T>::quiet_NaN()) {
    Dynamics<T> robot(plain(model.template cast<double>()),
                      {.tolerance = variant.traits.tolerance,
                       .question = {.want = {Want::acceleration, Want::inverse}}});
    std::vector<T> q, qd, tau;
    for (const State& state : states) {
      q.insert(q.end(), state.q.begin(), state.q.end());
      qd.insert(qd.end(), state.qd.begin(), state.qd.end());
      tau.insert(tau.end(), state.tau.begin(), state.tau.end());
    }
    // Outcomes say which failed.
    (void)robot.forward_dynamics(q, qd, tau, a, of_a);
    (void)robot.inverse_mass(q, X, of_X);
  }
};

// What is measured beside the contenders.
struct Also {
  bool ladder = false, generated = false;
};

template <class T>
struct Contenders {
  std::vector<Contender<T>> mass, solvers;
  std::vector<AnsweredRows<T>> rows;

  Contenders(const Scene& scene, const Model<T>& model, const std::vector<State>& states,
             const Also& also) {
    for (const RegisteredVariant<T>& variant : registered_variants<T>(Want::mass))
      if (variant.traits.contender) mass.push_back({variant.name, variant.make(model)});
    for (const RegisteredVariant<T>& variant : registered_variants<T>())
      if (variant.traits.contender || (also.ladder && is_of_ladder(variant.traits.kind)))
        solvers.push_back({variant.name, variant.make(model)});
    if (also.generated)
      for (const RegisteredVariant<T>& variant : evaluated_variants<T>())
        if (variant.takes(model)) solvers.push_back({variant.name, variant.make(model)});
    if (also.ladder)
      for (const RegisteredVariant<T>& variant : ladder_variants<T>())
        rows.emplace_back(variant, model, states);
    if constexpr (std::is_same_v<T, double>) {
      const auto mujoco = std::make_shared<MujocoSolver>(mujoco_of(scene));
      mass.push_back({"MuJoCo", mujoco});
      solvers.push_back({"MuJoCo", mujoco});
    }
  }
};

template <class T>
Truth<T> truth_of(const Scene& scene, const Model<T>& model, const VectorX<T>& q,
                  const Task<T>& task, const std::string& where) {
  Truth<T> out;
  try {
    out = cached_truth<T>(model, q, {task});
  } catch (const std::runtime_error& e) {
    throw InputError(where + ": " + e.what());
  }
  if (!out.outcome && std::is_same_v<T, double>)
    throw InputError(where + ": singular mechanism: joint '" + scene.model.name(out.outcome.joint) +
                     "' moves no inertia, D = " + number(out.outcome.D));
  return out;
}

// The rows of a state without truth.
template <class T>
void add_failures(const Contenders<T>& contenders, const Outcome& outcome, Table& table) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Contender<T>& contender : contenders.mass)
    table.add(contender.name, "mass", outcome, {{"relative", nan}, {"scaled", nan}});
  for (const Contender<T>& contender : contenders.solvers) {
    table.add(contender.name, "acceleration", outcome, {{"relative", nan}, {"energy", nan}});
    table.add(contender.name, "inverse", outcome, {{"relative", nan}, {"scaled", nan}});
  }
  for (const AnsweredRows<T>& rows : contenders.rows) {
    table.add(rows.name, "acceleration_batch", outcome, {{"relative", nan}, {"energy", nan}});
    table.add(rows.name, "inverse_batch", outcome, {{"relative", nan}, {"scaled", nan}});
  }
}

// On failure the result counts as NaN.
template <class T>
void add_acceleration(const std::string& name, const char* task, const Outcome& outcome,
                      VectorX<T> a, const Truth<T>& exact, Table& table) {
  if (!outcome) a.setConstant(std::numeric_limits<T>::quiet_NaN());
  const AccelerationError e = acceleration_error(a, exact.responses[0].a, exact.M);
  table.add(name, task, outcome, {{"relative", e.relative}, {"energy", e.energy}});
}

template <class T>
void add_inverse(const std::string& name, const char* task, const Outcome& outcome, MatrixX<T> X,
                 const Truth<T>& exact, Table& table) {
  if (!outcome) X.setConstant(std::numeric_limits<T>::quiet_NaN());
  const MatrixError e = matrix_error(X, exact.X);
  table.add(name, task, outcome, {{"relative", e.relative}, {"scaled", e.scaled}});
}

template <class T>
void measure(const Scene& scene, const std::vector<State>& states, const Also& also,
             Progress& progress, Table& table) {
  constexpr T nan = std::numeric_limits<T>::quiet_NaN();
  const Model<T> model = scene.model.cast<T>();
  const int nv = model.nv();
  Contenders<T> contenders(scene, model, states, also);
  for (std::size_t i = 0; i < states.size(); ++i) {
    const std::string where = scene.name + " " + precision_name<T> + " state " + std::to_string(i);
    progress.step(where);
    table.select(scene, precision_name<T>, static_cast<int>(i));
    const VectorX<T> q = states[i].q.cast<T>(), qd = states[i].qd.cast<T>(),
                     tau = states[i].tau.cast<T>();
    const Truth<T> exact = truth_of(scene, model, q, Task<T>{tau, qd}, where);
    if (!exact.outcome) {
      add_failures(contenders, exact.outcome, table);
      continue;
    }

    table.add("", "model", {}, {{"truth_width", exact.largest_width()}});
    if constexpr (std::is_same_v<T, double>) {
      const Condition c = condition(exact.M, exact.X);
      table.add("", "model", {}, {{"kappa", c.kappa}, {"kappa_scaled", c.kappa_scaled}});
    }
    for (const Contender<T>& contender : contenders.mass) {
      MatrixX<T> M = MatrixX<T>::Constant(nv, nv, nan);
      contender.solver->mass(q, M);
      const MatrixError e = matrix_error(M, exact.M);
      table.add(contender.name, "mass", {}, {{"relative", e.relative}, {"scaled", e.scaled}});
    }
    for (const Contender<T>& contender : contenders.solvers) {
      VectorX<T> a = VectorX<T>::Constant(nv, nan);
      const Outcome of_a = contender.solver->acceleration(q, qd, tau, a);
      add_acceleration(contender.name, "acceleration", of_a, std::move(a), exact, table);
      MatrixX<T> X = MatrixX<T>::Constant(nv, nv, nan);
      const Outcome of_X = contender.solver->inverse(q, X);
      add_inverse(contender.name, "inverse", of_X, std::move(X), exact, table);
    }
    for (const AnsweredRows<T>& rows : contenders.rows) {
      add_acceleration<T>(rows.name, "acceleration_batch", rows.of_a[i],
                          Eigen::Map<const VectorX<T>>(&rows.a[i * nv], nv), exact, table);
      add_inverse<T>(rows.name, "inverse_batch", rows.of_X[i],
                     Eigen::Map<const MatrixX<T>>(&rows.X[i * nv * nv], nv, nv), exact, table);
    }
  }
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  CLI::App app(
      "Error of every variant against multi-precision truth, and condition numbers, as CSV",
      "scaling");
  std::vector<std::string> names;
  LoadOptions read;
  int count = 10;
  std::uint64_t seed = 1;
  Also also;
  std::string out;
  add_scene(app, names, read)->required();
  app.add_option("--states", count, "random states of each scene")
      ->check(between(1, 1000000))
      ->capture_default_str();
  app.add_option("--seed", seed, "of the states")->check(any_seed())->capture_default_str();
  app.add_flag("--ladder", also.ladder,
               "also every tolerance of the ladder, of one state and rows");
  app.add_flag("--generated", also.generated, "code for the robot by the study's variants");
  app.add_option("--out", out, "CSV file to write")->required();

  return run_program(app, argc, argv, [&] {
    std::vector<Scene> scenes;
    for (const std::string& name : names) {
      scenes.push_back(open_scene(name, read));
      if (const int nv = scenes.back().model.nv(); nv > largest)
        throw InputError("scene '" + name + "' has " + std::to_string(nv) +
                         " degrees of freedom; truth is worked out up to " +
                         std::to_string(largest));
    }
    OutputFile file(out);
    Progress progress(2 * count * static_cast<int>(scenes.size()));
    Table table;
    for (const Scene& scene : scenes) {
      const std::vector<State> states = random_states(scene, count, seed);
      measure<float>(scene, states, also, progress, table);
      measure<double>(scene, states, also, progress, table);
    }
    file.write(table.text());
    return 0;
  });
}
