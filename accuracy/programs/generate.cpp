// generate: C code for one robot (algorithms/generate/), with a program that compares it with the truth.
//
// Answers that the code is compared with are those of its own parameters, which are the robot's rounded to the
// precision asked for, at home and in random states; truth is proven (truth.hpp). A bound is 16 times the error of the
// same operations done here, one by one, and 64 units of roundoff: what a compiler may contract, and another sine.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "accuracy/measures/measures.hpp"
#include "accuracy/programs/common/command_line.hpp"
#include "accuracy/programs/common/open_scene.hpp"
#include "accuracy/programs/common/output_file.hpp"
#include "accuracy/programs/common/ranges.hpp"
#include "accuracy/truth/truth.hpp"
#include "accuracy/truth/world_mechanics.hpp"
#include "algorithms/generate/package.hpp"

namespace kalmarm {
namespace {

constexpr std::uint64_t qdd_seed = 1987;  // of accelerations, apart from those of the states
constexpr std::uint64_t range_seed = 61;  // of states in which errors are told

struct Options {
  std::string scene, out, precision = "float64";
  std::vector<std::string> tasks = {"forward_dynamics", "inverse_dynamics", "mass", "inverse_mass"};
  LoadOptions read;
  bool rows = false;
  int random = 3, ranges = 1000;
  std::uint64_t seed = 1;
};

std::vector<std::string> names_of_tasks() {
  std::vector<std::string> out;
  for (const GeneratedTask task : generated_tasks) out.push_back(to_string(task));
  return out;
}

GeneratedTask task_of(const std::string& name) {
  for (const GeneratedTask task : generated_tasks)
    if (to_string(task) == name) return task;
  throw InputError("no task '" + name + "'");
}

bool inverts(GeneratedTask task) {
  return task != GeneratedTask::inverse_dynamics && task != GeneratedTask::mass;
}

template <class Matrix>
std::vector<double> listed(const Matrix& X) {
  std::vector<double> out;
  for (Eigen::Index i = 0; i < X.rows(); ++i)
    for (Eigen::Index j = 0; j < X.cols(); ++j) out.push_back(static_cast<double>(X(i, j)));
  return out;
}

// Of what the record gives by operations done one by one.
template <class S>
double error_of(const TaskRecord& record, const std::vector<std::vector<double>>& inputs,
                const std::vector<double>& truth) {
  std::vector<S> given;
  for (const std::vector<double>& input : inputs)
    given.insert(given.end(), input.begin(), input.end());
  const std::vector<S> x = record.graph.evaluate<S>(record.results, given);
  double error = 0, size = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    error += (x[i] - truth[i]) * (x[i] - truth[i]);
    size += truth[i] * truth[i];
  }
  return quotient(std::sqrt(error), std::sqrt(size));
}

// What a state is to give.
template <class S>
class Answers {
 public:
  Answers(const Model<S>& model, const State& state, const VectorX<double>& qdd, bool inverse,
          const std::string& scene)
      : q_(state.q.cast<S>()),
        qd_(state.qd.cast<S>()),
        tau_(state.tau.cast<S>()),
        qdd_(qdd.cast<S>()),
        exact_(truth_of(model, inverse, scene)) {
    const Digits digits(std::max(exact_.digits, 50U));
    const Model<Real> real = model.template cast<Real>();
    const WorldMechanics<Real> mechanics(real, q_.template cast<Real>());
    M_ = mechanics.mass();
    torque_ =
        mechanics.torque(qd_.template cast<Real>(), qdd_.template cast<Real>(), real.gravity());
  }

  TaskCheck check(const TaskRecord& record) const {
    TaskCheck out{record.task, {listed(q_)}, {}, 0};
    switch (record.task) {
      case GeneratedTask::forward_dynamics:
      case GeneratedTask::judged_forward_dynamics:
        out.inputs.insert(out.inputs.end(), {listed(qd_), listed(tau_)});
        out.truth = listed(exact_.responses[0].a);
        break;
      case GeneratedTask::inverse_dynamics:
        out.inputs.insert(out.inputs.end(), {listed(qd_), listed(qdd_)});
        out.truth = listed(torque_);
        break;
      case GeneratedTask::mass:
        out.truth = listed(M_);
        break;
      case GeneratedTask::inverse_mass:
      case GeneratedTask::judged_inverse_mass:
        out.truth = listed(exact_.X);
        break;
      case GeneratedTask::diagonal:
      case GeneratedTask::judged_diagonal:
        out.truth = listed(VectorX<Real>(exact_.X.diagonal()));
        break;
      case GeneratedTask::solve:
      case GeneratedTask::judged_solve:
        out.inputs.push_back(listed(tau_));
        out.truth = listed(VectorX<Real>(exact_.X * tau_.template cast<Real>()));
        break;
    }
    out.bound = 16 * error_of<S>(record, out.inputs, out.truth) + 64 * unit_roundoff<S>();
    return out;
  }

 private:
  Truth<S> truth_of(const Model<S>& model, bool inverse, const std::string& scene) const {
    if (!inverse) return {};
    Truth<S> out = truth<S>(model, q_, {Task<S>{tau_, qd_}});
    if (!out.outcome)
      throw InputError("scene '" + scene + "': singular mechanism: joint '" +
                       model.name(out.outcome.joint) + "' moves no inertia");
    return out;
  }

  VectorX<S> q_, qd_, tau_, qdd_;
  Truth<S> exact_;
  MatrixX<Real> M_;
  VectorX<Real> torque_;
};

// Of a judged function: its outputs are the result, its error and its margin.
template <class S>
ErrorsTold errors_told(const TaskRecord& record, const std::vector<State>& states) {
  ErrorsTold out{.task = record.task, .states = static_cast<int>(states.size())};
  std::vector<double> errors;
  for (const State& state : states) {
    std::vector<S> given;
    for (const Argument& input : record.inputs) {
      const VectorX<double>& x = input.name == "q"    ? state.q
                                 : input.name == "qd" ? state.qd
                                                      : state.tau;
      given.insert(given.end(), x.begin(), x.end());
    }
    const std::vector<S> told = record.graph.evaluate<S>(record.results, given);
    const S error = told[told.size() - 2], margin = told.back();
    if (margin > 0) errors.push_back(error);
  }
  out.refused = out.states - static_cast<int>(errors.size());
  if (errors.empty()) return out;
  std::sort(errors.begin(), errors.end());
  out.median = errors[errors.size() / 2];
  out.largest = errors.back();
  return out;
}

std::vector<State> states_of(const Scene& scene, const Options& options) {
  std::vector<State> out = random_states(scene, options.random, options.seed);
  out.insert(out.begin(), home_state(scene));
  return out;
}

template <class S>
std::map<std::string, std::string> files(const Scene& scene, const Options& options,
                                         const std::string& name) {
  PackageOptions how{.name = name, .tasks = {}, .rows = options.rows};
  bool inverse = false;
  for (const std::string& task : options.tasks) {
    how.tasks.push_back(task_of(task));
    inverse |= inverts(how.tasks.back());
  }
  const Package<S> package(scene.model, listed(home_position(scene)), how);
  const std::vector<State> states = states_of(scene, options);
  const std::vector<State> drawn =
      random_states(scene, static_cast<int>(states.size()), options.seed + qdd_seed);
  std::vector<TaskCheck> checks;
  for (std::size_t i = 0; i < states.size(); ++i) {
    const Answers<S> answers(scene.model.cast<S>(), states[i], drawn[i].tau, inverse,
                             options.scene);
    for (const TaskRecord& record : package.records()) checks.push_back(answers.check(record));
  }
  const std::vector<State> in_ranges =
      random_states(scene, options.ranges, options.seed + range_seed);
  std::vector<ErrorsTold> errors;
  for (const TaskRecord& record : package.records())
    if (is_judged(record)) errors.push_back(errors_told<S>(record, in_ranges));
  return package.files(checks, errors);
}

// The file name of a path that includes and code may have.
std::string plain_name(const std::string& path) {
  const std::string name = std::filesystem::path(path).filename();
  const bool is_plain = !name.empty() && name.find_first_not_of(
                                             "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                             "0123456789_-") == std::string::npos;
  if (!is_plain)
    throw InputError("--out: '" + path + "' does not end with a name of letters, digits, - and _");
  return name;
}

int run(const Options& options) {
  const std::string name = plain_name(options.out);
  const Scene scene = open_scene(options.scene, options.read);
  if (scene.model.nv() == 0) throw InputError("scene '" + options.scene + "' has no joints");
  std::vector<std::string> endings = {".h", ".c", "_test.c", ".md"};
  if (options.rows) endings.push_back("_rows.c");
  std::map<std::string, OutputFile> outputs;  // whether they can be written is seen first
  for (const std::string& ending : endings)
    outputs.emplace(name + ending, OutputFile(options.out + ending));
  try {
    const auto texts = options.precision == "float32" ? files<float>(scene, options, name)
                                                      : files<double>(scene, options, name);
    for (const auto& [file, text] : texts) outputs.at(file).write(text);
  } catch (const TooLarge& e) {
    throw InputError("scene '" + options.scene + "': " + e.what());
  }
  return 0;
}

}  // namespace
}  // namespace kalmarm

int main(int argc, char** argv) {
  using namespace kalmarm;
  CLI::App app("C code for one robot, with a program that compares it with the truth.", "generate");
  Options options;
  add_scene(app, options.scene, options.read)->required();
  app.add_option("--task", options.tasks, "any of " + CLI::detail::join(names_of_tasks(), ", "))
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember(names_of_tasks()))
      ->capture_default_str();
  app.add_option("--precision", options.precision, "float32 or float64")
      ->check(CLI::IsMember({"float32", "float64"}))
      ->capture_default_str();
  app.add_flag("--rows", options.rows, "also code for rows of states, one in every lane");
  app.add_option("--out", options.out, "PATH of PATH.h, PATH.c, PATH_test.c, PATH.md, PATH_rows.c")
      ->required();
  app.add_option("--random", options.random, "random states of the test")
      ->check(between(1, 1000))
      ->capture_default_str();
  app.add_option("--ranges", options.ranges,
                 "random states in the joints' ranges, of whose errors, as judged tasks tell them, "
                 "PATH.md has the median and the largest")
      ->check(between(1, 1'000'000))
      ->capture_default_str();
  app.add_option("--seed", options.seed, "of these states")
      ->check(any_seed())
      ->capture_default_str();
  return run_program(app, argc, argv, [&] { return run(options); });
}
