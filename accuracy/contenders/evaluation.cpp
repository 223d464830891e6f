#include "accuracy/contenders/evaluation.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "accuracy/measures/real.hpp"
#include "algorithms/study/solver.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/scene/mujoco_solver.hpp"

namespace kalmarm {
namespace {

using nlohmann::json;

template <class T>
json to_json(const VectorX<T>& x) {
  json out = json::array();
  for (const T& entry : x) out.push_back(static_cast<double>(entry));
  return out;
}

template <class T>
json to_json(const MatrixX<T>& X) {
  json rows = json::array();
  for (int i = 0; i < X.rows(); ++i) rows.push_back(to_json<T>(VectorX<T>(X.row(i))));
  return rows;
}

// What is not cannot be said in JSON.
bool is_finite(const json& value) {
  if (value.is_structured()) return std::ranges::all_of(value, is_finite);
  return !value.is_number_float() || std::isfinite(value.get<double>());
}

// Empty where the outcome is of no joint: two answers by different factors may disagree.
std::string at_joint(const Outcome& outcome, const Scene& scene) {
  if (outcome.joint < 0) return "";
  char text[96];
  std::snprintf(text, sizeof text, ", D = %.3g against a scale of %.3g", outcome.D, outcome.scale);
  return " at joint '" + scene.model.name(outcome.joint) + "'" + text;
}

}  // namespace

std::string describe(const Outcome& outcome, const Scene& scene) {
  if (!outcome && outcome.joint < 0) return "the result is not finite";
  if (!outcome)
    return std::string("mass matrix ") + to_string(outcome.status) + at_joint(outcome, scene);
  if (outcome.near_singular) return "mass matrix nearly singular" + at_joint(outcome, scene);
  if (std::isinf(outcome.error)) return "its error cannot be estimated";
  char text[64];
  std::snprintf(text, sizeof text, "the estimated error is %.2g", outcome.error);
  return text;
}

void add_outcome(const Outcome& outcome, const Scene& scene, json& entry) {
  if (outcome.warns()) {
    json& warning = entry["warning"];
    warning["kind"] = outcome.near_singular ? "near_singular" : "inaccurate";
    if (outcome.near_singular && outcome.joint >= 0)
      warning.update(
          {{"joint", scene.model.name(outcome.joint)}, {"D", outcome.D}, {"scale", outcome.scale}});
  }
  if (std::isnan(outcome.error)) return;
  entry["error_estimate"] = outcome.error;
  entry["refinement_steps"] = outcome.steps;
  if (outcome.widened) entry["widened"] = true;
}

bool Result::take(Outcome next) {
  if (std::isnan(next.error)) {
    next.error = outcome.error;
    next.steps = outcome.steps;
    next.widened = outcome.widened;
  }
  if (!next || !outcome.near_singular) outcome = next;
  outcome.error = next.error;
  outcome.steps = next.steps;
  outcome.widened = next.widened;
  return bool(next);
}

namespace {

template <class T>
class Evaluation {
 public:
  Evaluation(const Contender& by, const QuestionOptions& question, const Scene& scene,
             const DynamicsOptions& asked, const AskedStep* step)
      : step_(step),
        want_(question.want.begin(), question.want.end()),
        robot_(std::make_shared<Dynamics<T>>(make_robot<T>(by, scene, asked))),
        rows_(6 * static_cast<int>(asked.question.frames.size())) {
    if (by.variant == mujoco_variant) mujoco_ = std::make_shared<MujocoSolver>(mujoco_of(scene));
    if (!wants("factors")) return;
    if (question.selects()) throw InputError("factors are those of the whole robot");
    factored_ = make_contender<T>(by, scene, scene.model.cast<T>());
    if (!factored_->has_factors())
      throw InputError("variant '" + by.variant + "' has no factors D and g");
  }

  Result operator()(const State& state) {
    Result out = answer(state);
    if (out.outcome && !is_finite(out.entry)) out.outcome.status = Outcome::Status::not_finite;
    return out;
  }

 private:
  Result answer(const State& state) {
    const VectorX<T> q = state.q.cast<T>(), qd = state.qd.cast<T>();
    VectorX<T> tau = state.tau.cast<T>();
    if (step_) tau = step_->torque<T>(q, qd, tau);
    const int asked = robot_->asked(), nv = static_cast<int>(tau.size());
    Result out;
    out.entry = {
        {"qpos", to_json(state.q)}, {"qvel", to_json(state.qd)}, {"tau", to_json(state.tau)}};
    if (wants("mass")) out.entry["mass"] = to_json(mass(state.q, q));
    if (rows()) return coupled(std::move(out), q, qd, tau);
    if (wants("inverse")) {
      MatrixX<T> X = poisoned(asked, asked);
      if (!out.take(robot_->inverse_mass(q, X))) return out;
      out.entry["inverse"] = to_json(X);
    }
    if (wants("diagonal")) {
      VectorX<T> x = poisoned(asked, 1);
      if (!out.take(robot_->diagonal(q, x))) return out;
      out.entry["diagonal"] = to_json(x);
    }
    if (wants("log_det")) {
      T x = std::numeric_limits<T>::quiet_NaN();
      if (!out.take(robot_->log_det(q, x))) return out;
      out.entry["log_det"] = static_cast<double>(x);
    }
    if (wants("operational")) {
      MatrixX<T> X = poisoned(rows_, rows_);
      if (!out.take(robot_->operational(q, X))) return out;
      out.entry["operational"] = to_json(X);
    }
    if (wants("acceleration")) {
      VectorX<T> a = poisoned(asked, 1);
      if (!out.take(robot_->forward_dynamics(q, qd, tau, a))) return out;
      add_acceleration(q, qd, a, out.entry);
    }
    if (wants("factors")) {
      VectorX<T> D = poisoned(nv, 1);
      MatrixX<T> g = poisoned(6, nv);
      if (!out.take(factored_->factors(q, D, g))) return out;
      out.entry["factors"] = {{"D", to_json(D)}, {"g", to_json<T>(MatrixX<T>(g.transpose()))}};
    }
    return out;
  }

  bool wants(const char* what) const { return want_.contains(what); }

  // Where the step has some that are solved for.
  const AskedRows* rows() const {
    return step_ && step_->rows().solves() ? &step_->rows() : nullptr;
  }

  // M^^-1 and a of a step with rows.
  Result coupled(Result out, const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau) {
    const int nv = static_cast<int>(tau.size());
    MatrixX<T> X = poisoned(nv, nv);
    VectorX<T> a = poisoned(nv, 1);
    if (!out.take(robot_->inverse_mass(q, X))) return out;
    if (wants("acceleration") && !out.take(robot_->forward_dynamics(q, qd, tau, a))) return out;
    if (!rows()->template solve<T>(q, qd, X, wants("acceleration") ? &a : nullptr)) {
      out.outcome = {.status = Outcome::Status::singular};
      return out;
    }
    if (wants("inverse")) out.entry["inverse"] = to_json(X);
    if (wants("acceleration")) add_acceleration(q, qd, a, out.entry);
    return out;
  }

  void add_acceleration(const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& a,
                        json& entry) const {
    entry["acceleration"] = to_json(a);
    if (!step_) return;
    VectorX<T> next_q = q, next_qd = qd;
    step_->advance<T>(a, next_q, next_qd);
    entry["next"] = {{"qpos", to_json(next_q)}, {"qvel", to_json(next_qd)}};
  }

  static MatrixX<T> poisoned(int rows, int columns) {
    return MatrixX<T>::Constant(rows, columns, std::numeric_limits<T>::quiet_NaN());
  }

  MatrixX<T> mass(const VectorX<double>& position, const VectorX<T>& q) {
    MatrixX<T> M = poisoned(robot_->asked(), robot_->asked());
    if (mujoco_) {
      MatrixX<double> theirs(M.rows(), M.cols());
      mujoco_->mass(position, theirs);
      return theirs.cast<T>();
    }
    robot_->mass(q, M);
    if (rows()) rows()->add_mass(M);
    return M;
  }

  const AskedStep* step_;
  std::set<std::string> want_;
  std::shared_ptr<Dynamics<T>> robot_;    // shared: std::function wants to copy
  int rows_;                              // of J
  std::shared_ptr<Solver<T>> factored_;   // for the factors of the whole robot
  std::shared_ptr<MujocoSolver> mujoco_;  // for its M
};

}  // namespace

Evaluator make_evaluator(const Contender& by, const QuestionOptions& asked, const Scene& scene,
                         const Question& question, const AskedStep* step) {
  const DynamicsOptions options = asked_of(by, asked, question);
  if (step && by.variant == mujoco_variant)
    throw InputError(
        "--step is for variants of Kalmarm; compare_mujoco --step has MuJoCo's own steps");
  if (step && step->rows().imposes() && std::ranges::find(asked.want, "mass") != asked.want.end())
    throw InputError(scene.name +
                     ": imposed couplings have no finite mass: --want inverse,acceleration");
  if (step && step->rows().solves())
    for (const std::string& want : asked.want)
      if (want != "mass" && want != "inverse" && want != "acceleration")
        throw InputError(scene.name +
                         ": a step with tendons or imposed couplings gives mass, inverse and "
                         "acceleration, no " +
                         want);
  if (by.precision == "float32") return Evaluation<float>(by, asked, scene, options, step);
  if (by.precision == "float64") return Evaluation<double>(by, asked, scene, options, step);
  return Evaluation<Real>(by, asked, scene, options, step);
}

}  // namespace kalmarm
