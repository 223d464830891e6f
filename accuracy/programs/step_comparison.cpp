#include "accuracy/programs/step_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

#include "accuracy/programs/common/command_line.hpp"
#include "algorithms/dynamics/check_model.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/model/short_text.hpp"
#include "algorithms/study/inverse_mass/condition.hpp"
#include "kalmarm/implicit_step.hpp"
#include "robots/scene/memory_limit.hpp"
#include "robots/scene/mujoco_solver.hpp"
#include "robots/scene/mujoco_step.hpp"
#include "robots/scene/step_terms.hpp"

namespace kalmarm {
namespace {

using nlohmann::json;

constexpr double least_bound = 1e-9;

struct Steps {
  Integrator integrator;
  StepTerms terms;
  VectorX<double> compared;        // 1, or 0 for a DoF that is not
  std::vector<VectorX<double>> a;  // zero where it is not compared
  double bound = least_bound;      // of a in float64
};

struct Row {
  std::string integrator, variant, precision;
  double worst = 0;
  int failures = 0;
  double bound;

  bool pass() const { return precision != "float64" || (failures == 0 && worst <= bound); }
};

// nv u kappa of M^ in the states, from the step's own M^.
double amplified(ImplicitStep<double>& step, const std::vector<State>& states, int nv) {
  double out = 0;
  MatrixX<double> M(nv, nv), X(nv, nv);
  for (const State& state : states) {
    step.dynamics().mass(state.q, M);
    if (!step.dynamics().inverse_mass(state.q, X)) continue;
    out = std::max(out, nv * unit_roundoff<double>() * scaled_condition_bound(M, X));
  }
  return out;
}

template <class T>
Row compared(const Steps& reference, const RobotModel& robot, std::optional<double> tolerance,
             const std::vector<State>& states, double h) {
  Row row{.integrator = to_string(reference.integrator),
          .variant = tolerance ? "Fast, last bits" : "Fast",
          .precision = std::is_same_v<T, float> ? "float32" : "float64",
          .bound = reference.bound};
  const StepTerms& terms = reference.terms;
  ImplicitStep<T> step(robot, h, terms.terms(), terms.scheme(), {.tolerance = tolerance});
  for (std::size_t i = 0; i < states.size(); ++i) {
    VectorX<T> a = VectorX<T>::Constant(robot.nv(), std::numeric_limits<T>::quiet_NaN());
    const VectorX<T> q = states[i].q.template cast<T>(), v = states[i].qd.template cast<T>(),
                     tau = states[i].tau.template cast<T>() + terms.torque<T>(q, v);
    if (!step.acceleration(q, v, tau, a)) {
      ++row.failures;
      continue;
    }
    const double error =
        (reference.compared.cwiseProduct(a.template cast<double>()) - reference.a[i]).norm() /
        reference.a[i].norm();
    row.worst =
        std::isnan(error) ? std::numeric_limits<double>::infinity() : std::max(row.worst, error);
  }
  return row;
}

}  // namespace

json to_json(const Reference& reference) {
  const std::string& why = reference.why_touched;
  return {{"untouched", why.empty()}, {"reason", why.empty() ? json(nullptr) : json(why)}};
}

json compare_steps(const Scene& scene, const StepOptions& options, bool quiet) {
  const RobotModel robot = plain(scene.model);
  refuse_large(scene.name + ": " + std::to_string(options.random) + " states",
               4.0 * options.random * (robot.nq + robot.nv()) * sizeof(double));
  const JointTerms joints =
      with_terms(joint_terms_of(scene), scene.model, options.damping, options.stiffness);
  const std::vector<State> states = random_states(scene, options.random, options.seed);
  const Reference mujoco = step_reference_of(scene);
  const JointTerms of_mujoco =
      with_terms(mujoco.model->joint_terms(), scene.model, options.damping, options.stiffness);
  const double h = options.h;
  const std::vector<bool> lone = lone_free_dofs(scene.model);
  const auto left_out = std::ranges::count(lone, true);
  const VectorX<double> all = VectorX<double>::Ones(robot.nv());
  VectorX<double> held = all;
  for (int k = 0; k < robot.nv(); ++k) held[k] = lone[k] ? 0 : 1;
  if (left_out > 0)
    add_note(scene.name + ": " + std::to_string(left_out) +
             " DoF of bodies that float alone are compared by Euler only: of these MuJoCo takes "
             "gyroscopic torques at the end of a step");
  std::vector<Row> rows;
  json not_compared = json::object();
  int springs = 0, dampers = 0;
  const std::size_t coupled = joints.rows.size();
  for (const Integrator integrator : all_integrators) {
    const bool euler = integrator == Integrator::euler;
    if (!euler && left_out == robot.nv()) {
      not_compared[to_string(integrator)] = "gyroscopic torques at the end of a step";
      continue;
    }
    Steps reference{integrator, StepTerms(scene, integrator, joints), euler ? all : held, {}};
    const StepTerms& terms = reference.terms;
    if (const std::string why = left_out_of_rows(scene.model, terms.terms().rows, integrator);
        !why.empty()) {
      add_note(scene.name + ": not compared by " + to_string(integrator) +
               ", of which MuJoCo leaves out " + why);
      not_compared[to_string(integrator)] = why;
      continue;
    }
    springs = terms.springs(), dampers = terms.dampers();
    MujocoStep theirs(*mujoco.model, h, of_mujoco, integrator);
    ImplicitStep<double> step(robot, h, terms.terms(), terms.scheme());
    reference.bound = std::max(reference.bound, amplified(step, states, robot.nv()));
    double lost = 0;
    for (const State& state : states) {
      theirs.step(state.q, state.qd, state.tau);
      reference.a.push_back(reference.compared.cwiseProduct(theirs.v() - state.qd) / h);
      const double largest = std::max(state.qd.norm(), theirs.v().norm());
      lost = std::max(lost, unit_roundoff<double>() * largest / h / reference.a.back().norm());
    }
    reference.bound += lost;
    for (const std::optional<double> tolerance : {std::optional<double>(), {last_bits}}) {
      rows.push_back(compared<double>(reference, robot, tolerance, states, h));
      if (fits_float(robot))
        rows.push_back(compared<float>(reference, robot, tolerance, states, h));
    }
  }

  if (!quiet) {
    const std::string tendons = coupled > 0 ? ", " + std::to_string(coupled) + " tendons" : "";
    std::printf("%s, %zu steps of %g s against MuJoCo %s of %s: %d springs, %d dampers%s\n",
                scene.name.c_str(), states.size(), h, mujoco_version(), mujoco.words().c_str(),
                springs, dampers, tendons.c_str());
    std::printf("  %-14s %-22s %-9s %14s %9s %9s\n", "integrator", "variant", "precision",
                "acceleration", "bound", "failures");
    for (const Row& row : rows)
      std::printf("  %-14s %-22s %-9s %14.2e %9s %9d%s\n", row.integrator.c_str(),
                  row.variant.c_str(), row.precision.c_str(), row.worst,
                  row.precision == "float64" ? short_text("%.1e", row.bound).c_str() : "-",
                  row.failures, row.pass() ? "" : "  EXCEEDED");
  }
  json out = {{"scene", scene.name},          {"h", h},
              {"states", states.size()},      {"springs", springs},
              {"dampers", dampers},           {"tendons", coupled},
              {"not_compared", not_compared}, {"reference", to_json(mujoco)},
              {"variants", json::array()}};
  bool pass = true;
  for (const Row& row : rows) {
    pass = pass && row.pass();
    out["variants"].push_back(
        {{"integrator", row.integrator},
         {"variant", row.variant},
         {"precision", row.precision},
         {"acceleration", std::isfinite(row.worst) ? json(row.worst) : json(nullptr)},
         {"bound", row.precision == "float64" ? json(row.bound) : json(nullptr)},
         {"failures", row.failures}});
  }
  out["pass"] = pass;
  return out;
}

}  // namespace kalmarm
