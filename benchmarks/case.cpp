#include "benchmarks/case.hpp"

#include <cstdio>

#include "algorithms/model/inverse_dynamics.hpp"
#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/study/inverse_mass/condition.hpp"

namespace kalmarm {

std::string describe(const Scene& scene, const Outcome& outcome) {
  const std::string status = to_string(outcome.status);
  return outcome.joint < 0 ? status : status + " at joint " + scene.model.name(outcome.joint);
}

std::string wrong(double error, double bound) {
  char text[80];
  std::snprintf(text, sizeof text, "wrong: error %.2g, bound %.2g", error, bound);
  return text;
}

VectorX<double> torque(const Model<double>& model, const State& state) {
  LinkKinematics<double> kin(model);
  InverseDynamics<double> ws(model);
  VectorX<double> out(model.nv());
  set_position(model, state.q, kin);
  set_velocity(model, state.qd, kin);
  inverse_dynamics(model, kin, state.tau, ws, Eigen::Ref<VectorX<double>>(out));
  return out;
}

Case::Case(Scene what, std::uint64_t seed)
    : scene(std::move(what)), states(random_states(scene, batch_size, seed)) {
  const int nv = scene.model.nv();
  const auto solver = make_solver<double>("Sequential<ArrayMGS>", scene.model);
  LinkKinematics<double> kin(scene.model);
  CompositeInertia<double> composite(scene.model);
  const int verified = nv <= 100 ? 5 : 1;
  for (int i = 0; i < verified; ++i) {
    a.emplace_back(nv);
    M.emplace_back(nv, nv);
    X.emplace_back(nv, nv);
    set_position(scene.model, states[i].q, kin);
    mass_matrix(scene.model, kin, composite, Eigen::Ref<MatrixX<double>>(M.back()));
    Outcome outcome = solver->acceleration(states[i].q, states[i].qd, states[i].tau, a.back());
    if (outcome) outcome = solver->inverse(states[i].q, X.back());
    if (!outcome) flaw = std::string("reference: ") + describe(scene, outcome);
    condition.push_back(scaled_condition_bound(M.back(), X.back()));
  }
}

}  // namespace kalmarm
