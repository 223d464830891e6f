// What evaluate --step asks: the implicit step of a robot and its file's terms by one of MuJoCo's
// integrators (robots/scene/step_terms.hpp), of any variant in any precision:
//   M^ a = tau^ - bias,  M^ = M + diag(h b + h^2 k)                                        (1)
//   tau^ = tau + torque(q, v) - B v - K (q - q0 + h v)                                     (2)
//   v+ = v + h a,  q+ = q moved along v+ for h, quaternions turned by exp(h w / 2)         (3)
// with h^2 k and h v where springs are taken at the end of the step alone, and rows of tendons and
// imposed couplings by asked_rows.hpp. h b + h^2 k is added to the
// armature in float64, as kalmarm::ImplicitStep does it; (2) and (3) are computed in T.
#pragma once

#include <cmath>

#include "accuracy/contenders/asked_rows.hpp"
#include "robots/scene/step_terms.hpp"

namespace kalmarm {

class AskedStep {
 public:
  // joints: in the place of the file's springs and dampers. Throws InputError where one is negative,
  // not finite or about a joint of several axes.
  AskedStep(const Scene& scene, Integrator integrator, double h, const JointTerms& joints);

  Integrator integrator() const { return integrator_; }
  double h() const { return h_; }

  Model<double> model(Model<double> given) const;  // whose M is M^ but for rows
  const AskedRows& rows() const { return rows_; }

  AskedStep rounded() const;  // with terms and h as float32 holds them

  // (2)
  template <class T>
  VectorX<T> torque(const VectorX<T>& q, const VectorX<T>& v, const VectorX<T>& tau) const {
    VectorX<T> out = tau + terms_.template torque<T>(q, v) - damping_.cast<T>().cwiseProduct(v);
    const T ahead(terms_.scheme() == Scheme::springs_at_end ? h_ : 0);
    for (int k = 0; k < v.size(); ++k)
      if (stiffness_[k] > 0)
        out[k] -= T(stiffness_[k]) * ((q[q_of_[k]] - T(reference_[k])) + ahead * v[k]);
    rows_.add_known(q, v, out);
    return out;
  }

  // (3), in place
  template <class T>
  void advance(const VectorX<T>& a, VectorX<T>& q, VectorX<T>& v) const {
    using std::cos, std::sin;
    const T h(h_);
    v += h * a;
    for (int k = 0; k < v.size(); ++k) {
      const int at = q_of_[k];
      if (coordinates_[k] == Coordinate::quaternion) {
        const Vector3<T> half = v.template segment<3>(k) * (h / T(2));
        const T angle = half.norm(), s = angle > T(0) ? T(sin(angle) / angle) : T(1);
        Eigen::Quaternion<T> turned(q[at], q[at + 1], q[at + 2], q[at + 3]);
        turned =
            turned * Eigen::Quaternion<T>(T(cos(angle)), s * half[0], s * half[1], s * half[2]);
        turned.normalize();
        q.template segment<4>(at) << turned.w(), turned.x(), turned.y(), turned.z();
      } else if (coordinates_[k] == Coordinate::position) {
        q.template segment<3>(at) += h * v.template segment<3>(k);
      } else if (coordinates_[k] != Coordinate::follower) {
        q[at] += h * v[k];
      }
    }
  }

 private:
  Integrator integrator_;
  double h_;
  StepTerms terms_;
  VectorX<double> damping_, stiffness_, reference_, noise_;  // noise: h b + h^2 k
  AskedRows rows_;
  std::vector<int> q_of_;
  std::vector<Coordinate> coordinates_;
};

}  // namespace kalmarm
