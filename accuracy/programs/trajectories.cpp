// trajectories: error of a simulated motion at its end against the time that it took, by integrator,
// step, precision and dynamics (accuracy/motion/motion.hpp, simulate.hpp) -> one CSV, a simulation a row.
//   robot,nv,seed,T,stiffness,damping_ratio,damping,integrator,precision,dynamics,h,tolerance,steps,calls,
//   status,error_q,error_v,seconds_per_second,truth_q,truth_v
// status: ok; unstable; given_up; or no_truth, one row of a motion that is left out since its true end
// cannot be proven. What is empty does not apply. truth_q and truth_v bound the error of the truth.
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "accuracy/motion/simulate.hpp"
#include "accuracy/motion/truth.hpp"
#include "accuracy/programs/common/command_line.hpp"
#include "accuracy/programs/common/csv.hpp"
#include "accuracy/programs/common/open_scene.hpp"
#include "accuracy/programs/common/output_file.hpp"
#include "accuracy/programs/common/progress.hpp"
#include "accuracy/programs/common/ranges.hpp"
#include "algorithms/dynamics/check_model.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/model/short_text.hpp"

namespace kalmarm::motion {
namespace {

const char* const head =
    "robot,nv,seed,T,stiffness,damping_ratio,damping,integrator,precision,dynamics,h,tolerance,"
    "steps,"
    "calls,status,error_q,error_v,seconds_per_second,truth_q,truth_v\n";

const char* const by_default = "default";
const char* const to_last_bits = "last_bits";

struct Options {
  std::vector<std::string> scenes;
  LoadOptions read;
  std::vector<std::string> integrators;
  std::vector<std::string> precisions = {"float32", "float64"};
  std::vector<std::string> dynamics = {by_default};
  std::vector<double> steps = {1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5};
  std::vector<double> tolerances = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10};
  std::vector<double> stiffness = {1e3, 1e5};
  std::vector<double> ratios = {1}, dampings;
  std::string out;
  MotionOptions motion;
  Effort effort;
};

// Of one robot that float32 holds or not.
std::vector<Method> methods_of(const Options& options, bool fits) {
  const auto asked = [](const std::vector<std::string>& all, const std::string& name) {
    return std::ranges::find(all, name) != all.end();
  };
  std::vector<Method> out;
  for (const Integrator& integrator : integrators()) {
    if (!options.integrators.empty() && !asked(options.integrators, integrator.name)) continue;
    const auto& steps = integrator.adaptive ? options.tolerances : options.steps;
    for (const bool float32 : {true, false}) {
      if (!asked(options.precisions, float32 ? "float32" : "float64")) continue;
      if (float32 && !(integrator.float32 && fits)) continue;
      for (const std::string& dynamics : options.dynamics) {
        if (integrator.of_mujoco && dynamics != options.dynamics.front()) continue;
        for (const double step : steps)
          out.push_back({integrator.name, float32, dynamics == to_last_bits, step});
      }
    }
  }
  return out;
}

// Up to its integrator.
std::string begin_of(const Scene& scene, const MotionOptions& options) {
  const auto number_or_none = [](double x) { return std::isnan(x) ? std::string() : number(x); };
  const double ratio = std::isnan(options.damping) ? options.damping_ratio : NAN;
  return field(scene.name) + ',' + std::to_string(scene.model.nv()) + ',' +
         std::to_string(options.seed) + ',' + number(options.duration) + ',' +
         number(options.stiffness) + ',' + number_or_none(ratio) + ',' +
         number_or_none(options.damping) + ',';
}

std::string row(const Integrator& integrator, const Method& method, const Motion& motion,
                const Truth& truth, const Simulation& simulation) {
  Errors error{NAN, NAN};
  Status status = simulation.status;
  if (status == Status::ok) {
    error = errors(motion.robot, simulation.q, simulation.v, truth.q, truth.v);
    status = judged(status, error);
  }
  const std::string of_ok =
      number(error.q) + ',' + number(error.v) + ',' + number(simulation.seconds / motion.duration);
  return method.integrator + ',' + (method.float32 ? "float32" : "float64") + ',' +
         (integrator.of_mujoco ? ""
          : method.last_bits   ? to_last_bits
                               : by_default) +
         ',' + (integrator.adaptive ? "," + number(method.step) : number(method.step) + ",") + ',' +
         std::to_string(simulation.steps) + ',' + std::to_string(simulation.calls) + ',' +
         to_string(status) + ',' + (status == Status::ok ? of_ok : ",,") + ',' +
         number(truth.difference.q) + ',' + number(truth.difference.v) + '\n';
}

// Every motion that is asked for of a robot.
std::vector<MotionOptions> motions_of(const Options& options) {
  std::vector<MotionOptions> out;
  for (const double stiffness : options.stiffness) {
    MotionOptions one = options.motion;
    one.stiffness = stiffness;
    for (const double damping : options.dampings) {
      one.damping = damping;
      out.push_back(one);
    }
    for (const double ratio : options.ratios) {
      if (!options.dampings.empty()) break;
      one.damping_ratio = ratio;
      out.push_back(one);
    }
  }
  return out;
}

int run(const Options& options) {
  for (const double h : options.steps) steps_of(options.motion.duration, h);
  std::vector<Scene> scenes;
  for (const std::string& what : options.scenes) scenes.push_back(open_scene(what, options.read));
  OutputFile file(options.out);
  const std::vector<MotionOptions> motions = motions_of(options);
  std::string text = head;
  int count = 0;
  for (const Scene& scene : scenes)
    count += static_cast<int>(motions.size() *
                              (1 + methods_of(options, fits_float(plain(scene.model))).size()));
  Progress progress(count);
  for (const Scene& scene : scenes) {
    const std::vector<Method> methods = methods_of(options, fits_float(plain(scene.model)));
    for (const MotionOptions& one : motions) {
      const std::string begin = begin_of(scene, one);
      const std::string what = scene.name + ", k = " + short_text("%g", one.stiffness);
      progress.step(what + ", the truth");
      const Motion motion = make_motion(scene, one);
      std::optional<Truth> truth;
      try {
        truth = true_end(motion);
      } catch (const NoTruth& e) {
        add_note(what + ": left out, since its motion " + e.what());
        text += begin + ",,,,,,,no_truth,,,,,\n";
      }
      for (const Method& method : methods) {
        progress.step(what + ", " + method.integrator);
        if (!truth) continue;
        const auto integrator =
            std::ranges::find(integrators(), method.integrator, &Integrator::name);
        text += begin +
                row(*integrator, method, motion, *truth, simulate(motion, method, options.effort));
      }
    }
  }
  file.write(text);
  return 0;
}

std::vector<std::string> integrator_names() {
  std::vector<std::string> out;
  for (const Integrator& integrator : integrators()) out.push_back(integrator.name);
  return out;
}

}  // namespace
}  // namespace kalmarm::motion

int main(int argc, char** argv) {
  using namespace kalmarm;
  CLI::App app(
      "Error of a simulated motion at its end, under stiff position controllers whose targets "
      "move, "
      "against the time of the simulation, as CSV",
      "trajectories");
  motion::Options options;
  add_scene(app, options.scenes, options.read)->required();
  app.add_option("--T", options.motion.duration, "of the motion [s]")
      ->check(between(1e-6, 1e3))
      ->capture_default_str();
  app.add_option("--h", options.steps, "steps [s], each a whole part of T")
      ->delimiter(',')
      ->check(positive())
      ->capture_default_str();
  app.add_option("--tolerance", options.tolerances,
                 "of a step of adaptive methods, relative and absolute")
      ->delimiter(',')
      ->check(between(1e-15, 1.0))
      ->capture_default_str();
  app.add_option("--stiffness", options.stiffness, "of every hinge and slide [N m/rad or N/m]")
      ->delimiter(',')
      ->check(not_negative())
      ->capture_default_str();
  auto* ratio = app.add_option("--damping-ratio", options.ratios,
                               "zeta of their damping, 2 zeta sqrt(stiffness M(k,k)) at home")
                    ->delimiter(',')
                    ->check(not_negative())
                    ->capture_default_str();
  app.add_option("--damping", options.dampings,
                 "of every hinge and slide [N m s/rad or N s/m], in the place of ratios")
      ->delimiter(',')
      ->check(not_negative())
      ->excludes(ratio);
  app.add_option("--sweep", options.motion.sweep,
                 "by which targets move at most, up and down [rad or m]")
      ->check(not_negative())
      ->capture_default_str();
  app.add_option("--frequency", options.motion.frequency, "at which they do [Hz]")
      ->check(not_negative())
      ->capture_default_str();
  app.add_option("--precision", options.precisions, "float32, float64 or both")
      ->delimiter(',')
      ->check(CLI::IsMember({"float32", "float64"}))
      ->capture_default_str();
  app.add_option("--dynamics", options.dynamics,
                 "by the default tolerance, to the last bits or both")
      ->delimiter(',')
      ->check(CLI::IsMember({motion::by_default, motion::to_last_bits}))
      ->capture_default_str();
  app.add_option("--integrator", options.integrators, "default: all")
      ->delimiter(',')
      ->check(CLI::IsMember(motion::integrator_names()));
  app.add_option("--repetitions", options.effort.repetitions, "of a timing, at least")
      ->check(between(1, 1000))
      ->capture_default_str();
  app.add_option("--seed", options.motion.seed, "of the state in which the motion begins")
      ->check(any_seed())
      ->capture_default_str();
  app.add_option("--out", options.out, "CSV file to write")->required();
  return run_program(app, argc, argv, [&] { return motion::run(options); });
}
