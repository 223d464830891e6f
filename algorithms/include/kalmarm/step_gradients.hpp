// Derivatives of an implicit step's acceleration (implicit_step.hpp) in O(n), contracted with a vector (VJP) or along a
// direction (JVP), by the state, torques, gains, targets and inertias: what learns through a stiff controller asks for.
//
// With B and K the diagonal matrices of damping b and stiffness k, q0 the springs' references, h' = h, or 0 where springs are
// at the start, and p = q - q0 + h' v, the step
//   M^ a = tau - B v - K p - bias(q, v),  M^ = M + diag(r),  r = armature + h b + h h' k                     (1)
// is ID(q, v, a) = tau - B (v + h a) - K (p + h h' a). For weights w and lambda = M^^-1 w therefore, per DoF,
//   w'da:  dtau = lambda,  db = -lambda (v + h a),  dk = -lambda (p + h h' a),  dq0 = k lambda               (2)
//          dq = -k lambda - d(lambda'ID)/dq,  dv = -(b + h' k) lambda - d(lambda'ID)/dv                      (3)
// and inertias, armatures (-lambda a), forces, loads and gravity by -d(lambda'ID) alone. Along a direction
//   M^ da = dtau - B dv - K (dq - dq0 + h' dv) - db (v + h a) - dk (p + h h' a) - d(armature) a - dID        (4)
// with dID of fast/derivatives/virtual_power.hpp and tangent.hpp. M^^-1 w is the step's own acceleration of a robot that
// neither weighs anything nor moves, with its springs at ease.
//
// Axes, outcomes, rows, threads and memory are as of Gradients (gradients.hpp).
//
//   kalmarm::StepGradients<double> robot(model, h, {.damping = kv, .stiffness = kp, .reference = q0});
//   outcome = robot.acceleration_vjp(q, v, tau, w, {.dq = dq, .dv = dv, .reference = dq0});
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "kalmarm/export.hpp"
#include "kalmarm/implicit_step.hpp"
#include "kalmarm/outcome.hpp"
#include "kalmarm/robot_model.hpp"
#include "kalmarm/views.hpp"

namespace kalmarm {

// Where the derivatives of w'a go, nv numbers each unless said. Each may be left out.
template <class View>
struct StepVectorJacobian {
  View dq = {};
  View dv = {};
  View dtau = {};
  View damping = {};
  View stiffness =
      {};  // zero at balls and free joints, which have no springs, as those by references
  View reference = {};
  View inertias = {};  // nv x 10, as of VectorJacobian
  View armature = {};
  View forces = {};   // 6 of every frame of Question::acted_on, in its axes
  View loads = {};    // 10 of every frame of Question::loaded
  View gravity = {};  // 3

  View result = {};  // a, which is worked out anyway
};
template <class T>
using StateStepVectorJacobian = StepVectorJacobian<std::optional<VectorView<T>>>;
template <class T>
using RowsOfStepVectorJacobian = StepVectorJacobian<std::optional<RowsView<T>>>;

template <class T>
class GradientRows;
template <class T>
struct GradientCall;

template <class T>
class KALMARM_EXPORT StepGradients {
 public:
  // As ImplicitStep. Throws std::invalid_argument where terms couple joints, where a frame that is acted on or loaded is on
  // the fixed base, and what ImplicitStep throws.
  StepGradients(const RobotModel& model, double h, const JointTerms& terms,
                Scheme scheme = Scheme::springs_at_end, const DynamicsOptions& options = {});
  ~StepGradients();
  StepGradients(StepGradients&&) noexcept;
  StepGradients& operator=(StepGradients&&) noexcept;

  // (2), (3) of q (nq), v, tau and w (nv each). Forces as those of Gradients. 1450 n, and 190 a link for inertias.
  Outcome acceleration_vjp(VectorView<const T> q, VectorView<const T> v, VectorView<const T> tau,
                           VectorView<const T> w, const StateStepVectorJacobian<T>& out,
                           const StateForces<T>& forces = {});
  // Rows of states, with gains of their own where `gains` has them. Returns how many failed, whose rows are not to be used.
  [[nodiscard]] int acceleration_vjp(RowsView<const T> q, RowsView<const T> v,
                                     RowsView<const T> tau, RowsView<const T> w,
                                     const RowsOfStepVectorJacobian<T>& out,
                                     std::span<Outcome> outcomes, int threads = 1,
                                     const GainRows<T>& gains = {},
                                     const ForceRows<T>& forces = {});

  // da (nv) of (4) along dq, dv and dtau (nv each), and, where they are given, along gains, targets and armatures. 1450 n.
  Outcome acceleration_jvp(VectorView<const T> q, VectorView<const T> v, VectorView<const T> tau,
                           VectorView<const T> dq, VectorView<const T> dv, VectorView<const T> dtau,
                           VectorView<T> da, const StateForces<T>& forces = {});
  [[nodiscard]] int acceleration_jvp(RowsView<const T> q, RowsView<const T> v,
                                     RowsView<const T> tau, RowsView<const T> dq,
                                     RowsView<const T> dv, RowsView<const T> dtau, RowsView<T> da,
                                     std::span<Outcome> outcomes, int threads = 1,
                                     const GainRows<T>& gains = {}, const GainRows<T>& along = {},
                                     const ForceRows<T>& forces = {});

 private:
  GradientRows<T>& sweeps() const;
  void check(const char* call, std::ptrdiff_t count, const GainRows<T>& gains) const;
  GainRows<T> part(const GainRows<T>& gains, std::ptrdiff_t first, std::ptrdiff_t rows) const;
  // x = M^^-1 w, and the worse outcomes of those before and of these; says how many are not ok.
  int solve(RowsView<const T> q, RowsView<const T> w, RowsView<T> x, std::span<Outcome> outcomes,
            int threads, GainRows<T> gains, const LoadRows<T>& loads);

  int nq_ = 0, nv_ = 0;
  T h_ = T(0), h_of_springs_ = T(0);
  std::vector<int> q_index_;  // of every DoF, -1: it takes no spring
  std::vector<T> damping_, stiffness_, reference_;
  ImplicitStep<T> step_, still_;
  std::unique_ptr<GradientRows<T>> sweeps_;
  std::vector<T> zeros_, at_ease_;
  std::vector<Outcome> outcomes_;
};

}  // namespace kalmarm
