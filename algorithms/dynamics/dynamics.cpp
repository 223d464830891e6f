#include "algorithms/dynamics/dynamics_members.hpp"
#include "algorithms/generate/generated_engine.hpp"

namespace kalmarm {
namespace {

DynamicsOptions with_rules_for(DynamicsOptions options, double tolerance) {
  const std::set<Rule> rules = rules_for(tolerance);
  std::erase_if(options.rules, [&](Rule rule) { return !rules.contains(rule); });
  return options;
}

// Engines of the options' kernels, and what they note when they are made.
template <class T>
MakeEngine<T> engines_of(const DynamicsOptions& options, std::vector<std::string>& notes) {
  if (options.kernels == Kernels::loops) return make_engine<T>;
  return [&notes, code = options.code](const RobotModel& robot, const EngineOptions& of_part) {
    return with_generated_code(make_engine<T>(robot, of_part), robot, of_part, code, notes);
  };
}

}  // namespace

template <class T>
Dynamics<T>::Dynamics(const RobotModel& model, const DynamicsOptions& options)
    : Dynamics(model, options, std::vector<std::string>()) {}

template <class T>
Dynamics<T>::Dynamics(const RobotModel& model, const DynamicsOptions& options,
                      std::vector<std::string>&& notes)
    : Dynamics(model, with_rules_for(options, options.tolerance.value_or(default_tolerance<T>)),
               engines_of<T>(options, notes)) {
  notes_ = std::move(notes);
}

template class Dynamics<float>;
template class Dynamics<double>;

}  // namespace kalmarm
