#include "robots/scene/step_terms.hpp"

#include <algorithm>
#include <utility>

namespace kalmarm {
namespace {

int positive(const std::vector<double>& numbers) {
  return static_cast<int>(std::ranges::count_if(numbers, [](double x) { return x > 0; }));
}

}  // namespace

const char* to_string(Integrator integrator) {
  switch (integrator) {
    case Integrator::euler:
      return "Euler";
    case Integrator::implicitfast:
      return "implicitfast";
    case Integrator::discrete:
      return "discrete";
  }
  return "";
}

JointTerms with_terms(JointTerms joints, const Model<double>& model, std::optional<double> damping,
                      std::optional<double> stiffness) {
  for (std::vector<double>* term : {&joints.damping, &joints.stiffness, &joints.reference})
    term->resize(model.nv());
  for (int k = 0; k < model.nv(); ++k) {
    const Coordinate coordinate = model.joint(k).coordinate;
    if (coordinate != Coordinate::angle && coordinate != Coordinate::distance) continue;
    if (damping) joints.damping[k] = *damping;
    if (stiffness) joints.stiffness[k] = *stiffness;
  }
  return joints;
}

StepTerms::StepTerms(const Scene& scene, Integrator integrator, const JointTerms& joints)
    : scheme_(integrator == Integrator::discrete ? Scheme::springs_at_end
                                                 : Scheme::springs_at_start),
      terms_(joints),
      torque_(VectorX<double>::Zero(scene.model.nv())),
      damping_(VectorX<double>::Zero(scene.model.nv())),
      row_damping_(joints.rows.size(), 0) {
  for (std::vector<double>* term : {&terms_.damping, &terms_.stiffness, &terms_.reference})
    term->resize(scene.model.nv());
  if (!scene.mujoco) return;
  std::vector<Actuator> actuators = scene.mujoco->actuators();
  if (integrator == Integrator::euler) {
    if ((scene.mujoco->get()->opt.disableflags & mjDSBL_EULERDAMP) != 0)
      for (int k = 0; k < scene.model.nv(); ++k) damping_[k] = std::exchange(terms_.damping[k], 0);
    for (std::size_t i = 0; i < row_damping_.size(); ++i)
      row_damping_[i] = std::exchange(terms_.rows[i].damping, 0);
    for (Actuator& actuator : actuators) {
      const double damping = std::exchange(actuator.damping, 0);
      if (actuator.row < 0)
        damping_[actuator.dof] += damping;
      else
        row_damping_[actuator.row] += damping;
    }
  }
  Driven all = driven(std::move(terms_), actuators);
  terms_ = std::move(all.terms);
  torque_ = Eigen::Map<const VectorX<double>>(all.torque.data(), scene.model.nv());
  compensated_ = scene.mujoco->compensated();
}

StepTerms::StepTerms(const Scene& scene, Integrator integrator)
    : StepTerms(scene, integrator, joint_terms_of(scene)) {}

StepTerms StepTerms::rounded() const {
  StepTerms out = *this;
  const auto hold = [](auto& numbers) {
    for (double& x : numbers) x = static_cast<float>(x);
  };
  for (auto* term : {&out.terms_.damping, &out.terms_.stiffness, &out.terms_.reference})
    hold(*term);
  for (CoupledRow& row : out.terms_.rows) {
    hold(row.jacobian);
    for (double* x : {&row.armature, &row.damping, &row.stiffness, &row.reference})
      *x = static_cast<float>(*x);
  }
  hold(out.torque_);
  hold(out.damping_);
  hold(out.row_damping_);
  if (compensated_) out.compensated_ = compensated_->cast<float>().cast<double>();
  return out;
}

int StepTerms::springs() const { return positive(terms_.stiffness); }

int StepTerms::dampers() const {
  std::vector<double> all = terms_.damping;
  for (std::size_t k = 0; k < all.size(); ++k) all[k] += damping_[static_cast<int>(k)];
  return positive(all);
}

}  // namespace kalmarm
