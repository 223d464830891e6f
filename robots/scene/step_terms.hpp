// The implicit step of a scene's file by one of MuJoCo's integrators: springs, dampers and actuators as
// terms, and what is added to tau where a step begins,
//   tau^ = tau + torque - B_e v + c(q) - B v - K (q - q0 [+ h v])                          (1)
// with the torque of actuators without stiffness, c(q) that compensates gravity, and B_e the damping that
// an integrator takes at the start of a step: `Euler` alone has some, of actuators and tendons, and of
// joints too where the file has eulerdamp="disable". Tendons are rows of the terms.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "algorithms/model/inverse_dynamics.hpp"
#include "kalmarm/implicit_step.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm {

enum class Integrator { euler, implicitfast, discrete };

inline constexpr Integrator all_integrators[] = {Integrator::euler, Integrator::implicitfast,
                                                 Integrator::discrete};

const char* to_string(Integrator integrator);  // as MJCF names it

// Springs and dampers of joints, for every DoF; those of every hinge and slide as given, where they are.
JointTerms with_terms(JointTerms joints, const Model<double>& model, std::optional<double> damping,
                      std::optional<double> stiffness);

class StepTerms {
 public:
  // joints: in the place of the file's springs and dampers. Actuators are the file's.
  StepTerms(const Scene& scene, Integrator integrator, const JointTerms& joints);
  StepTerms(const Scene& scene, Integrator integrator);

  Scheme scheme() const { return scheme_; }
  const JointTerms& terms() const { return terms_; }  // every DoF

  // What (1) adds to tau at q (nq) and v (nv).
  template <class T>
  VectorX<T> torque(const VectorX<T>& q, const VectorX<T>& v) const {
    VectorX<T> out = torque_.cast<T>() - damping_.cast<T>().cwiseProduct(v);
    for (std::size_t i = 0; i < terms_.rows.size(); ++i) {
      if (row_damping_[i] == 0) continue;
      const VectorX<T> J =
          Eigen::Map<const VectorX<double>>(terms_.rows[i].jacobian.data(), v.size()).cast<T>();
      out -= J * (T(row_damping_[i]) * J.dot(v));
    }
    if (!compensated_) return out;
    const Model<T> weights = compensated_->cast<T>();
    LinkKinematics<T> kin(weights);
    InverseDynamics<T> ws(weights);
    VectorX<T> c(v.size());
    set_position(weights, q, kin);
    set_velocity(weights, VectorX<T>::Zero(v.size()).eval(), kin);
    inverse_dynamics(weights, kin, VectorX<T>::Zero(v.size()).eval(), ws,
                     Eigen::Ref<VectorX<T>>(c));
    return out + c;
  }

  StepTerms rounded() const;  // as float32 holds the numbers of (1)

  // How many DoF have them.
  int springs() const;
  int dampers() const;

 private:
  Scheme scheme_;
  JointTerms terms_;
  VectorX<double> torque_, damping_;  // damping: B_e,
  std::vector<double> row_damping_;   // and of the rows
  std::optional<Model<double>> compensated_;
};

}  // namespace kalmarm
