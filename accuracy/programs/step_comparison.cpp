#include "accuracy/programs/step_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

#include "algorithms/dynamics/check_model.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/model/short_text.hpp"
#include "algorithms/study/inverse_mass/condition.hpp"
#include "kalmarm/implicit_step.hpp"
#include "robots/scene/memory_limit.hpp"
#include "robots/scene/mujoco_solver.hpp"
#include "robots/scene/mujoco_step.hpp"

namespace kalmarm {
namespace {

using nlohmann::json;

constexpr double least_bound = 1e-9;

struct Reference {
  const char* integrator;
  Scheme scheme;
  std::vector<VectorX<double>> a;
  double bound = least_bound;  // of a in float64
};

struct Row {
  std::string integrator, variant, precision;
  double worst = 0;
  int failures = 0;
  double bound;

  bool pass() const { return precision != "float64" || (failures == 0 && worst <= bound); }
};

JointTerms terms_of(const Scene& scene, const RobotModel& robot, const StepOptions& options) {
  JointTerms out = terms_of(scene);
  out.damping.resize(robot.nv());
  out.stiffness.resize(robot.nv());
  out.reference.resize(robot.nv());
  for (int k = 0; k < robot.nv(); ++k) {
    if (!takes_spring(robot.links[k])) continue;
    if (options.damping) out.damping[k] = *options.damping;
    if (options.stiffness) out.stiffness[k] = *options.stiffness;
  }
  return out;
}

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
Row compared(const Reference& reference, const RobotModel& robot, const JointTerms& terms,
             Form form, const std::vector<State>& states, double h) {
  Row row{.integrator = reference.integrator,
          .variant = std::string("Fast, ") + to_string(form),
          .precision = std::is_same_v<T, float> ? "float32" : "float64",
          .bound = reference.bound};
  ImplicitStep<T> step(robot, h, terms, reference.scheme, {.form = form});
  for (std::size_t i = 0; i < states.size(); ++i) {
    VectorX<T> a = VectorX<T>::Constant(robot.nv(), std::numeric_limits<T>::quiet_NaN());
    const VectorX<T> q = states[i].q.template cast<T>(), v = states[i].qd.template cast<T>(),
                     tau = states[i].tau.template cast<T>();
    if (!step.acceleration(q, v, tau, a)) {
      ++row.failures;
      continue;
    }
    const double error =
        (a.template cast<double>() - reference.a[i]).norm() / reference.a[i].norm();
    row.worst =
        std::isnan(error) ? std::numeric_limits<double>::infinity() : std::max(row.worst, error);
  }
  return row;
}

}  // namespace

json compare_steps(const Scene& scene, const StepOptions& options, bool quiet) {
  const RobotModel robot = plain(scene.model);
  refuse_large(scene.name + ": " + std::to_string(options.random) + " states",
               4.0 * options.random * (robot.nq + robot.nv()) * sizeof(double));
  const JointTerms terms = terms_of(scene, robot, options);
  const std::vector<State> states = random_states(scene, options.random, options.seed);
  const auto mujoco = mujoco_of(scene);
  const double h = options.h;
  std::vector<Row> rows;
  for (const auto& [name, integrator, scheme] :
       {std::tuple{"Euler", mjINT_EULER, Scheme::springs_at_start},
        {"implicitfast", mjINT_IMPLICITFAST, Scheme::springs_at_start},
        {"discrete", mjINT_DISCRETE, Scheme::springs_at_end}}) {
    Reference reference{name, scheme, {}};
    MujocoStep theirs(*mujoco, h, terms, integrator);
    ImplicitStep<double> step(robot, h, terms, scheme);
    reference.bound = std::max(reference.bound, amplified(step, states, robot.nv()));
    double lost = 0;
    for (const State& state : states) {
      theirs.step(state.q, state.qd, state.tau);
      reference.a.push_back((theirs.v() - state.qd) / h);
      const double largest = std::max(state.qd.norm(), theirs.v().norm());
      lost = std::max(lost, unit_roundoff<double>() * largest / h / reference.a.back().norm());
    }
    reference.bound += lost;
    for (const Form form : {Form::conventional, Form::certified}) {
      rows.push_back(compared<double>(reference, robot, terms, form, states, h));
      if (fits_float(robot))
        rows.push_back(compared<float>(reference, robot, terms, form, states, h));
    }
  }

  const int springs =
      static_cast<int>(std::ranges::count_if(terms.stiffness, [](double k) { return k > 0; }));
  const int dampers =
      static_cast<int>(std::ranges::count_if(terms.damping, [](double b) { return b > 0; }));
  if (!quiet) {
    std::printf("%s, %zu steps of %g s against MuJoCo %s: %d springs, %d dampers\n",
                scene.name.c_str(), states.size(), h, mujoco_version(), springs, dampers);
    std::printf("  %-14s %-22s %-9s %14s %9s %9s\n", "integrator", "variant", "precision",
                "acceleration", "bound", "failures");
    for (const Row& row : rows)
      std::printf("  %-14s %-22s %-9s %14.2e %9s %9d%s\n", row.integrator.c_str(),
                  row.variant.c_str(), row.precision.c_str(), row.worst,
                  row.precision == "float64" ? short_text("%.1e", row.bound).c_str() : "-",
                  row.failures, row.pass() ? "" : "  EXCEEDED");
  }
  json out = {{"scene", scene.name},     {"h", h},
              {"states", states.size()}, {"springs", springs},
              {"dampers", dampers},      {"variants", json::array()}};
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
