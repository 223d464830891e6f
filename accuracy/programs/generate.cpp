// generate: C code for one robot (algorithms/generate/), with a program that compares it with the truth.
//
// Joints that are locked are left out before: the robot is the one that has composite bodies there (reduction.hpp).
//
// Answers that the code is compared with are those of its own parameters, which are the robot's rounded to the
// precision asked for, at home and in random states; truth is proven (truth.hpp). A bound is 16 times the error of the
// same operations done here, one by one, and 64 units of roundoff: what a compiler may contract, and another sine.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "accuracy/measures/measures.hpp"
#include "accuracy/programs/common/command_line.hpp"
#include "accuracy/programs/common/open_scene.hpp"
#include "accuracy/programs/common/output_file.hpp"
#include "accuracy/programs/common/ranges.hpp"
#include "accuracy/truth/displaced.hpp"
#include "accuracy/truth/truth.hpp"
#include "accuracy/truth/world_mechanics.hpp"
#include "algorithms/dynamics/reduction.hpp"
#include "algorithms/generate/package.hpp"
#include "algorithms/model/plain.hpp"
#include "robots/scene/question.hpp"

namespace kalmarm {
namespace {

constexpr std::uint64_t qdd_seed = 1987;  // of accelerations, apart from those of the states
constexpr std::uint64_t range_seed = 61;  // of states in which errors are told

struct Options {
  std::string scene, out, precision = "float64";
  std::vector<std::string> tasks = {"forward_dynamics", "inverse_dynamics", "mass", "inverse_mass"};
  LoadOptions read;
  QuestionOptions question;
  bool rows = false, gravity = false;
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

template <class Matrix>
std::vector<double> listed(const Matrix& X) {
  std::vector<double> out;
  for (Eigen::Index i = 0; i < X.rows(); ++i)
    for (Eigen::Index j = 0; j < X.cols(); ++j) out.push_back(static_cast<double>(X(i, j)));
  return out;
}

bool inverts(GeneratedTask task) {
  return task != GeneratedTask::inverse_dynamics && task != GeneratedTask::mass;
}

// The robot without joints that are locked, what is asked of it, and its numbers among those of the whole.
struct Asked {
  Reduction robot;
  Question question;

  Asked(const Scene& scene, const Question& whole) : question(whole) {
    const Model<double>& model = scene.model;
    std::vector<Fate> fate(model.nv(), Fate::free);
    for (const int k : whole.locked) fate[k] = Fate::locked;
    std::vector<Standing> standing;
    robot = reduce(model, fate, Eigen::Map<const VectorX<double>>(whole.q.data(), model.nq()),
                   &standing);
    question.locked.clear();
    question.q.clear();
    for (int& k : question.dofs) k = standing[k].link;
    for (std::vector<Frame>* const frames : {&question.frames, &question.loaded})
      for (Frame& frame : *frames) {
        if (frame.link < 0) continue;
        const Site<long double> site = site_of(frame).cast<long double>();
        const Standing at = standing[frame.link].then(site.rotation, site.translation);
        frame = plain(Site<long double>{at.link, at.rotation, at.translation}.cast<double>());
      }
  }

  VectorX<double> position(const VectorX<double>& q) const { return q(robot.q_whole); }
  State state(const State& whole) const {
    State out{position(whole.q), whole.qd(robot.dofs), whole.tau(robot.dofs)};
    if (question.at_rest) out.qd.setZero();
    return out;
  }
};

// In tests of code that is given it.
const std::vector<double> other_gravity = {1.5, -2.25, -4.75};

// What every loaded frame carries in the test, and the robot with it and this gravity.
const RigidBody<double> carried{
    0.75, {0.0625, -0.03125, 0.125}, {1, 0, 0, 0}, {0.0078125, 0.00390625, 0.005859375}};

std::vector<double> loads_of(const Question& question) {
  const SpatialInertia<double> M(carried);
  std::vector<double> out;
  for (std::size_t i = 0; i < question.loaded.size(); ++i)
    out.insert(out.end(), {M.m, M.h[0], M.h[1], M.h[2], M.I(0, 0), M.I(1, 1), M.I(2, 2), M.I(0, 1),
                           M.I(0, 2), M.I(1, 2)});
  return out;
}
Model<double> laden(const Model<double>& model, const Question& question,
                    const Vector3<double>& gravity) {
  std::vector<Joint<long double>> joints;
  for (int k = 0; k < model.nv(); ++k) joints.push_back(model.joint(k).cast<long double>());
  for (const Frame& frame : question.loaded) {
    const Site<long double> site = site_of(frame).cast<long double>();
    RigidBody<long double> held = carried.cast<long double>();
    held.com = site.translation + rotation(site.rotation) * held.com;
    held.axes = site.rotation * held.axes;
    RigidBody<long double>& body = joints[frame.link].body;
    body = welded(body, held);
  }
  std::vector<Joint<double>> rounded;
  for (const Joint<long double>& joint : joints) rounded.push_back(joint.cast<double>());
  return {std::move(rounded), model.names(), model.nq(), gravity};
}

// Springs and dampers of the test, from slack to stiff.
struct Gains {
  double h = 1.0 / 64;
  VectorX<double> damping, stiffness, reference;

  explicit Gains(int nv) : damping(nv), stiffness(nv), reference(nv) {
    for (int k = 0; k < nv; ++k) {
      damping[k] = std::ldexp(1, k % 5 - 2);
      stiffness[k] = std::ldexp(1, k % 9);
      reference[k] = 0.25 * (k % 3 - 1);
    }
  }
};

// What a state is to give.
template <class S>
class Answers {
 public:
  Answers(const Model<double>& robot, const Question& question, const Vector3<double>& gravity,
          const State& state, const VectorX<double>& qdd, const std::string& scene)
      : question_(question),
        whole_(laden(robot, question, gravity)),
        gains_(robot.nv()),
        q_(state.q.cast<S>()),
        qd_(state.qd.cast<S>()),
        tau_(state.tau.cast<S>()),
        qdd_(qdd.cast<S>()),
        scene_(scene) {
    if (question_.dofs.empty())
      for (int k = 0; k < robot.nv(); ++k) question_.dofs.push_back(k);
  }

  TaskCheck check(const TaskRecord& record) {
    TaskCheck out{record.task, {}, {}};
    std::vector<S> given;
    for (const Argument& input : record.inputs) {
      out.inputs.push_back(number_of(input.name));
      given.insert(given.end(), out.inputs.back().begin(), out.inputs.back().end());
    }
    const std::vector<S> x = record.graph.evaluate<S>(record.results, given);
    auto first = x.begin();
    for (const std::vector<double>& truth : truths(record.task)) {
      const double most = bound(truth, first);
      out.results.push_back(is_zero(truth) ? TaskCheck::Result() : TaskCheck::Result{truth, most});
      first += static_cast<std::ptrdiff_t>(truth.size());
    }
    return out;
  }

 private:
  // As derivatives at rest may be, but for h^2 of their differences: there is no relative error of it.
  static bool is_zero(const std::vector<double>& x) {
    return std::all_of(x.begin(), x.end(), [](double number) { return std::abs(number) < 1e-30; });
  }

  // x: by operations done one by one.
  template <class Iterator>
  static double bound(const std::vector<double>& truth, Iterator x) {
    double error = 0, size = 0;
    for (const double exact : truth) {
      error += (*x - exact) * (*x - exact);
      size += exact * exact;
      ++x;
    }
    return 16 * quotient(std::sqrt(error), std::sqrt(size)) + 64 * unit_roundoff<S>();
  }

  std::vector<double> number_of(const std::string& input) const {
    if (input == "q") return listed(q_);
    if (input == "qd") return listed(qd_);
    if (input == "tau") return listed(tau_);
    if (input == "qdd") return listed(qdd_);
    if (input == "loads") return loads_of(question_);
    if (input == "gravity") return other_gravity;
    if (input == "damping") return listed(gains_.damping);
    if (input == "stiffness") return listed(gains_.stiffness);
    if (input == "reference") return listed(gains_.reference);
    return {gains_.h};
  }

  // Of a task's first results.
  std::vector<std::vector<double>> truths(GeneratedTask task) {
    const Digits digits(inverts(task) ? std::max(exact().digits, 50U) : 50U);
    switch (task) {
      case GeneratedTask::forward_dynamics:
      case GeneratedTask::judged_forward_dynamics:
        return {asked(exact().responses[0].a)};
      case GeneratedTask::inverse_dynamics:
        return {asked(torque(q(), qd(), qdd_.template cast<Real>()))};
      case GeneratedTask::mass:
        return {block(WorldMechanics<Real>(real(), q()).mass())};
      case GeneratedTask::inverse_mass:
      case GeneratedTask::judged_inverse_mass:
        return {block(exact().X)};
      case GeneratedTask::diagonal:
      case GeneratedTask::judged_diagonal:
        return {asked(VectorX<Real>(exact().X.diagonal()))};
      case GeneratedTask::solve:
      case GeneratedTask::judged_solve:
        return {asked(VectorX<Real>(exact().X * tau_.template cast<Real>()))};
      case GeneratedTask::operational: {
        const MatrixX<Real> J = jacobian();
        return {listed(MatrixX<Real>(J * exact().X * J.transpose()))};
      }
      case GeneratedTask::derivatives:
      case GeneratedTask::judged_derivatives:
        return derivatives();
      case GeneratedTask::implicit_step:
      case GeneratedTask::judged_implicit_step:
        return {asked(step().responses[0].a)};
    }
    return {};
  }

  // M da/dx = -d(M a + bias)/dx for an a that stands still.
  std::vector<std::vector<double>> derivatives() {
    const int nv = whole_.nv();
    const Real h("1e-20");
    const VectorX<Real> a = exact().responses[0].a;
    MatrixX<Real> dq(nv, nv), dqd(nv, nv);
    for (int k = 0; k < nv; ++k) {
      dq.col(k) = (torque(displaced(real(), q(), k, h), qd(), a) -
                   torque(displaced(real(), q(), k, -h), qd(), a)) /
                  (2 * h);
      VectorX<Real> faster = qd(), slower = qd();
      faster[k] += h;
      slower[k] -= h;
      dqd.col(k) = (torque(q(), faster, a) - torque(q(), slower, a)) / (2 * h);
    }
    const auto by_columns = [&](const MatrixX<Real>& X) {
      return block(MatrixX<Real>(X.transpose()));
    };
    return {asked(a), by_columns(-exact().X * dq), by_columns(-exact().X * dqd),
            by_columns(exact().X)};
  }

  // The robot with this joint noise at this torque, (2) of kalmarm/implicit_step.hpp.
  Truth<S> step() const {
    Model<S> stiff = whole_.cast<S>();
    VectorX<S> tau = tau_;
    const double h = gains_.h;
    for (int k = 0; k < stiff.nv(); ++k) {
      const Joint<S>& joint = stiff.joint(k);
      if (joint.coordinate != Coordinate::angle && joint.coordinate != Coordinate::distance)
        continue;
      const double b = gains_.damping[k], c = gains_.stiffness[k];
      tau[k] -= S(b * qd_[k] + c * (q_[joint.q_index] - gains_.reference[k] + h * qd_[k]));
      stiff.set_noise(k, joint.r + S(h * b + h * h * c));
    }
    return truth_of(stiff, tau);
  }

  MatrixX<Real> jacobian() {
    const Model<Real> model = real();
    LinkKinematics<Real> links(model);
    set_position(model, q(), links);
    std::vector<Site<Real>> sites;
    for (const Frame& frame : question_.frames)
      sites.push_back(site_of(frame).template cast<Real>());
    MatrixX<Real> J(6 * sites.size(), model.nv());
    site_jacobian<Real>(model, links, sites, J);
    return J;
  }

  VectorX<Real> torque(const VectorX<Real>& q, const VectorX<Real>& qd,
                       const VectorX<Real>& qdd) const {
    const Model<Real> model = real();
    return WorldMechanics<Real>(model, q).torque(qd, qdd, model.gravity());
  }

  const Truth<S>& exact() {
    if (!exact_) exact_ = truth_of(whole_.cast<S>(), tau_);
    return *exact_;
  }
  Truth<S> truth_of(const Model<S>& model, const VectorX<S>& tau) const {
    Truth<S> out = truth<S>(model, q_, {Task<S>{tau, qd_}});
    if (!out.outcome)
      throw InputError("scene '" + scene_ + "': singular mechanism: joint '" +
                       model.name(out.outcome.joint) + "' moves no inertia");
    return out;
  }

  Model<Real> real() const { return whole_.cast<S>().template cast<Real>(); }
  VectorX<Real> q() const { return q_.template cast<Real>(); }
  VectorX<Real> qd() const { return qd_.template cast<Real>(); }

  std::vector<double> asked(const VectorX<Real>& x) const {
    return listed(VectorX<Real>(x(question_.dofs)));
  }
  std::vector<double> block(const MatrixX<Real>& X) const {
    return listed(MatrixX<Real>(X(question_.dofs, question_.dofs)));
  }

  Question question_;
  Model<double> whole_;
  Gains gains_;
  VectorX<S> q_, qd_, tau_, qdd_;
  std::string scene_;
  std::optional<Truth<S>> exact_;
};

// Whether states are all that it takes: no loads and no gains.
bool is_of_states(const TaskRecord& record) {
  static const std::set<std::string> numbers = {"q", "qd", "tau"};
  return std::all_of(record.inputs.begin(), record.inputs.end(),
                     [](const Argument& input) { return numbers.contains(input.name); });
}

bool tells_error(const TaskRecord& record) {
  return std::any_of(record.outputs.begin(), record.outputs.end(),
                     [](const Argument& output) { return output.name == "error"; });
}

// Of a judged function of states: its outputs are the result, its error and its margin.
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

Question question_of(const Scene& scene, const Options& options) {
  QuestionOptions words = options.question;
  for (const std::string& task : options.tasks)
    if (task_of(task) == GeneratedTask::operational) words.want = {"operational"};
  return question_of(scene, words);
}

template <class S>
std::map<std::string, std::string> files(const Scene& scene, const Options& options,
                                         const std::string& name) {
  const Asked asked(scene, question_of(scene, options));
  const Model<double>& model = asked.robot.model;
  for (const Frame& frame : asked.question.loaded)
    if (frame.link < 0) throw InputError("--load: what stands still carries nothing");
  PackageOptions how{.name = name,
                     .tasks = {},
                     .rows = options.rows,
                     .question = asked.question,
                     .loaded = options.question.loaded,
                     .frames = options.question.sites,
                     .gravity = options.gravity ? Gravity::input : Gravity::constant};
  for (const std::string& task : options.tasks) how.tasks.push_back(task_of(task));
  const Package<S> package(model, listed(asked.position(home_position(scene))), how);
  const std::vector<State> states = states_of(scene, options);
  const std::vector<State> drawn =
      random_states(scene, static_cast<int>(states.size()), options.seed + qdd_seed);
  const Vector3<double> gravity =
      options.gravity ? Vector3<double>(other_gravity.data()) : model.gravity();
  std::vector<TaskCheck> checks;
  for (std::size_t i = 0; i < states.size(); ++i) {
    Answers<S> answers(model, asked.question, gravity, asked.state(states[i]),
                       asked.state(drawn[i]).tau, options.scene);
    for (const TaskRecord& record : package.records()) checks.push_back(answers.check(record));
  }
  std::vector<State> in_ranges = random_states(scene, options.ranges, options.seed + range_seed);
  for (State& state : in_ranges) state = asked.state(state);
  std::vector<ErrorsTold> errors;
  for (const TaskRecord& record : package.records())
    if (tells_error(record) && is_of_states(record))
      errors.push_back(errors_told<S>(record, in_ranges));
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
  options.question.add_parts_to(app);
  app.add_option("--load", options.question.loaded,
                 "sites, bodies or links that carry a body whose ten numbers are an input")
      ->delimiter(',')
      ->allow_extra_args(false);
  app.add_flag("--gravity", options.gravity, "gravity is an input");
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
