#include "algorithms/dynamics/dynamics_members.hpp"

namespace kalmarm {

template <class T>
Dynamics<T>::Dynamics(const RobotModel& model, const DynamicsOptions& options)
    : Dynamics(
          model,
          [&] {
            DynamicsOptions able = options;
            const std::set<Rule> rules =
                rules_for(options.tolerance.value_or(default_tolerance<T>));
            std::erase_if(able.rules, [&](Rule rule) { return !rules.contains(rule); });
            return able;
          }(),
          make_engine<T>) {}

template class Dynamics<float>;
template class Dynamics<double>;

}  // namespace kalmarm
