// Implicit steps: a robot with springs and dampers at its joints, however stiff, is moved by h.
//
// With B and K the diagonal matrices of damping b and stiffness k, and q0 the springs' references,
//   M (v+ - v) / h = tau - bias(q, v) - B v+ - K (q + h v+ - q0)                          (1)
// takes springs and dampers where the step ends, the rest where it begins. For a = (v+ - v) / h that is
//   M^ a = tau^ - bias,  M^ = M + diag(r),  r(k) = armature(k) + h b(k) + h^2 k(k)         (2)
//   tau^ = tau - B v - K (q - q0 + h v)
// so that h b + h^2 k is joint noise of the paper: D(k) = H P-(k) H' + r(k) (3.6), at no cost, and the
// better conditioned the stiffer a joint is. Scheme::springs_at_start leaves springs where the step
// begins, r = armature + h b and tau^ = tau - B v - K (q - q0): stable for any b, not for any k. The next
// state is
//   v+ = v + h a,  q+ = q moved along v+ for h                                            (3)
// with quaternions turned by exp(h w / 2). By q, v and tau, from the derivatives of forward dynamics
// at M^ and tau^, X = M^^-1,
//   da/dq = da/dq|tau^ - X K,  da/dv = da/dv|tau^ - X (B + h K),  da/dtau = X              (4)
// without h K where springs are at the start.
//
// Against MuJoCo without contacts, limits and constraints: (2) is its `discrete` integrator,
// Scheme::springs_at_start its `Euler` and `implicitfast` (robots/scene/test/test_implicit_step.cpp).
//
// A position controller with gains kp and kv is a spring and a damper, its target their reference.
#pragma once

#include <span>
#include <vector>

#include "kalmarm/dynamics.hpp"
#include "kalmarm/export.hpp"
#include "kalmarm/outcome.hpp"
#include "kalmarm/robot_model.hpp"
#include "kalmarm/views.hpp"

namespace kalmarm {

enum class Scheme {
  springs_at_end,    // (1): MuJoCo's discrete
  springs_at_start,  // MuJoCo's Euler and implicitfast
};

// Whether a DoF may have a spring: hinges and slides.
constexpr bool takes_spring(const LinkParameters& link) {
  return link.coordinate == Coordinate::angle || link.coordinate == Coordinate::distance;
}

// Of every DoF, nv numbers each; none: all zero. A ball and a free joint may have damping, no springs;
// with it their DoF are swept one by one and looked at twice (docs/stiff.md has what that costs).
struct JointTerms {
  std::vector<double> damping = {};    // b [N m s/rad or N s/m]
  std::vector<double> stiffness = {};  // k [N m/rad or N/m]
  std::vector<double> reference = {};  // q0 [rad or m]
};

// v (nv) and q (nq) of the robot after h, by (3): in place.
KALMARM_EXPORT void advance(const RobotModel& model, double h, VectorView<const double> a,
                            VectorView<double> q, VectorView<double> v);
KALMARM_EXPORT void advance(const RobotModel& model, double h, VectorView<const float> a,
                            VectorView<float> q, VectorView<float> v);

template <class T>
class KALMARM_EXPORT ImplicitStep {
 public:
  // h >= 0 [s]. Throws std::invalid_argument with the DoF where h, b or k is negative, where a number is
  // not finite or too large for T, where a ball or free joint has a spring, and where the question
  // leaves joints out or is at rest; and what Dynamics throws.
  ImplicitStep(const RobotModel& model, double h, const JointTerms& terms,
               Scheme scheme = Scheme::springs_at_end, const DynamicsOptions& options = {});

  double h() const { return h_; }

  // a (nv) = (v+ - v) / h by (2). Outcome::error is that of a for tau^ as T holds it, whose own rounding,
  // u k |q - q0|, moves a by M^^-1 times as much. The time of forward dynamics.
  Outcome acceleration(VectorView<const T> q, VectorView<const T> v, VectorView<const T> tau,
                       VectorView<T> a);

  // Rows of states, as Dynamics::forward_dynamics. A call with more rows than any before takes memory.
  [[nodiscard]] int acceleration(RowsView<const T> q, RowsView<const T> v, RowsView<const T> tau,
                                 RowsView<T> a, std::span<Outcome> outcomes, int threads = 1);

  // q and v are moved by h, in place, with a (nv) of the step. Not where the outcome is not ok.
  Outcome step(VectorView<T> q, VectorView<T> v, VectorView<const T> tau, VectorView<T> a);

  // (4), each nv x nv, and a. Outcome as Dynamics::derivatives.
  Outcome derivatives(VectorView<const T> q, VectorView<const T> v, VectorView<const T> tau,
                      const Derivatives<T>& out, VectorView<T> a);

  // Whose M is M^: mass, inverse_mass, factor, solve, diagonal, log_det are of M^.
  Dynamics<T>& dynamics() { return dynamics_; }

 private:
  // Springs at DoF that follow one another, as their entries of q do.
  struct Springs {
    int dof, q, count;
  };
  static constexpr int repeated =
      32;  // rows whose terms lie side by side, where q(k) is that of DoF k

  void require(const char* call, std::ptrdiff_t q, std::ptrdiff_t v, std::ptrdiff_t tau) const;
  void set_torque(std::ptrdiff_t rows, const T* q, const T* v, const T* tau, T* out) const;

  RobotModel model_;
  double h_;
  Dynamics<T> dynamics_;  // what it is made of is checked before the rest
  int rows_of_terms_;     // `repeated`, or 1 where q is not as v
  std::vector<T> damping_, stiffness_, reference_;
  std::vector<Springs> springs_;
  T h_of_springs_;  // 0 where they are at the start
  std::vector<T> tau_, rows_, X_;
};

}  // namespace kalmarm
