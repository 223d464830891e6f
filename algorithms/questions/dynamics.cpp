#include <cmath>

#include "algorithms/questions/dynamics_members.hpp"

namespace kalmarm {

// Throws std::invalid_argument, with the DoF and the value.
void check_model(const RobotModel& model) {
  const int nv = model.nv();
  if (static_cast<int>(model.names.size()) != nv)
    throw std::invalid_argument("robot model: " + std::to_string(model.names.size()) +
                                " names for " + std::to_string(nv) + " DoF");
  int nq = 0;
  for (int k = 0; k < nv; ++k) {
    const LinkParameters& link = model.links[k];
    const auto refuse = [&](const std::string& why) {
      throw std::invalid_argument("robot model: DoF '" + model.names[k] + "': " + why);
    };
    if (link.parent < -1 || link.parent >= k)
      refuse("parent " + std::to_string(link.parent) + " does not come before it");
    if (link.coordinate == Coordinate::follower && (k == 0 || link.parent != k - 1))
      refuse("a follower that follows nothing");
    nq += q_entries(link.coordinate);
    if (link.q_index < 0 || link.q_index + q_entries(link.coordinate) > model.nq)
      refuse("q[" + std::to_string(link.q_index) + "] of " + std::to_string(model.nq));
    const auto finite = [&](const char* what, const double* x, int count) {
      for (int i = 0; i < count; ++i)
        if (!std::isfinite(x[i])) refuse(std::string(what) + " is " + std::to_string(x[i]));
    };
    finite("reference", &link.reference, 1);
    finite("rotation", link.rotation.data(), 4);
    finite("translation", link.translation.data(), 3);
    finite("armature", &link.armature, 1);
    finite("mass", &link.mass, 1);
    finite("centre of mass", link.center_of_mass.data(), 3);
    finite("inertia axes", link.inertia_axes.data(), 4);
    finite("principal moment", link.principal_moments.data(), 3);
    if (link.armature < 0) refuse("armature is " + std::to_string(link.armature));
    if (link.mass < 0) refuse("mass is " + std::to_string(link.mass));
  }
  if (nq != model.nq)
    throw std::invalid_argument("robot model: nq is " + std::to_string(model.nq) +
                                ", its joints read " + std::to_string(nq));
}

template <class T>
Dynamics<T>::Dynamics(const RobotModel& model, const DynamicsOptions& options)
    : Dynamics(
          model,
          [&] {
            DynamicsOptions able = options;
            const std::set<Rule> rules = rules_for(options.form);
            std::erase_if(able.rules, [&](Rule rule) { return !rules.contains(rule); });
            return able;
          }(),
          make_engine<T>) {}

template class Dynamics<float>;
template class Dynamics<double>;

}  // namespace kalmarm
