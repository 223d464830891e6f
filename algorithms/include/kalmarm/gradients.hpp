// Derivatives of a robot's dynamics in O(n), contracted with a vector (VJP, reverse mode) or along a direction (JVP, forward
// mode): what learning, identification and trajectory optimisation ask for, without a matrix. Of
//   a = M^-1 (tau - bias(q, qd)),  tau = ID(q, qd, qdd) = M qdd + bias,  x = M^-1 tau
// with w a vector of weights and lambda = M^-1 w,
//   forward_dynamics_vjp   w'da:   dtau = lambda,  the rest -d(lambda'ID(q, qd, a)) at fixed lambda and a     (1)
//   inverse_dynamics_vjp   w'dtau = d(w'ID)                                                                   (2)
//   solve_vjp              w'dx:   dtau = lambda,  dq = -d(lambda'M x)                                        (3)
//   forward_dynamics_jvp   da = M^-1 (dtau - dID(q, qd, a)),  dID along dq and dqd                            (4)
//   inverse_dynamics_jvp   dtau = dID along dq, dqd and dqdd
//   solve_jvp              dx = M^-1 (dtau - d(M x))
//   operational_vjp        d tr(W'X), X = J M^-1 J':  with J' of frames as forces' torques, ID(q, 0, x; f) = M x - J'f without
//                          weight, and, of every column e of the unit matrix, x = M^-1 J'e and y = M^-1 J'W e, a sum of
//                          -d(y'ID(q, 0, x; e)) - d(x'ID(q, 0, 0; W e)) at fixed x and y                           (5)
// a and lambda are those of the filter and smoother, with their outcome; d(lambda'ID) is one sweep outward and one inward,
// by the equations of algorithms/fast/derivatives/virtual_power.hpp, dID one each of dual numbers (tangent.hpp).
//
// dq is along the velocities of the joints, as in Derivatives (dynamics.hpp): of a ball joint a turn about its body's axes,
// of a free joint a shift along its parent's axes and such a turn. A change of q itself is the configuration's
// (configuration.hpp).
//
// Errors: outcomes are those of a and lambda, or of x and lambda, the worse of both; derivatives add some tens of roundoffs
// of the terms that they are sums of. Rows are as one state to rounding, and their bits do not depend on threads or on the
// other rows. Sizes are checked at every call: std::invalid_argument names the call and both sizes. Memory is taken by the
// first call of rows, and by one with more rows or threads than before. One thread at a time may use an object.
//
//   kalmarm::Gradients<double> robot(model);
//   outcome = robot.forward_dynamics_vjp(q, qd, tau, w, {.dq = dq, .dqd = dqd, .dtau = dtau});
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "kalmarm/dynamics.hpp"
#include "kalmarm/export.hpp"
#include "kalmarm/outcome.hpp"
#include "kalmarm/robot_model.hpp"
#include "kalmarm/views.hpp"

namespace kalmarm {

// Where the derivatives of w'a, w'tau or w'x go. Each may be left out.
template <class View>
struct VectorJacobian {
  View dq = {};    // nv
  View dqd = {};   // nv; not of solve
  View dtau = {};  // nv: by what is given beside q and qd: tau, of inverse dynamics qdd

  // nv x 10: by (m, m c, Ixx, Iyy, Izz, Ixy, Ixz, Iyz) of every link, about its origin in its axes, as of
  // Kinematics::regressor. Ten numbers of a link follow each other.
  View inertias = {};
  View armature = {};  // nv
  View forces = {};    // 6 of every frame of Question::acted_on, in its axes
  View loads = {};     // 10 of every frame of Question::loaded
  View gravity = {};   // 3; not of solve, nor operational

  View result = {};  // nv: a, or x, which is worked out anyway; not of inverse dynamics
};
template <class T>
using StateVectorJacobian = VectorJacobian<std::optional<VectorView<T>>>;
template <class T>
using RowsOfVectorJacobian = VectorJacobian<std::optional<RowsView<T>>>;

template <class T>
class GradientRows;
template <class T>
struct GradientCall;
template <class T>
struct OperationalRows;

template <class T>
class KALMARM_EXPORT Gradients {
 public:
  // Of the options' question the frames of acted_on and loaded count, and of operational_vjp its frames. Throws
  // std::invalid_argument where it leaves joints out or is at rest, where a frame of acted_on or loaded is on the fixed base,
  // and what Dynamics throws.
  explicit Gradients(const RobotModel& model, const DynamicsOptions& options = {});
  ~Gradients();
  Gradients(Gradients&&) noexcept;
  Gradients& operator=(Gradients&&) noexcept;

  int nq() const { return nq_; }
  int nv() const { return nv_; }

  // (1) of q (nq), qd, tau and w (nv each). Forces are in the axes of their frames and turn with them:
  // std::invalid_argument where they are in others. 1100 n, and 190 a link for inertias.
  Outcome forward_dynamics_vjp(VectorView<const T> q, VectorView<const T> qd,
                               VectorView<const T> tau, VectorView<const T> w,
                               const StateVectorJacobian<T>& out,
                               const StateForces<T>& forces = {});
  // Rows of states, one outcome each, on `threads` cores. Returns how many failed, whose rows are not to be used. w and
  // dtau do not overlap.
  [[nodiscard]] int forward_dynamics_vjp(RowsView<const T> q, RowsView<const T> qd,
                                         RowsView<const T> tau, RowsView<const T> w,
                                         const RowsOfVectorJacobian<T>& out,
                                         std::span<Outcome> outcomes, int threads = 1,
                                         const ForceRows<T>& forces = {});

  // da (nv) of (4) along dq, dqd and dtau (nv each). 1300 n.
  Outcome forward_dynamics_jvp(VectorView<const T> q, VectorView<const T> qd,
                               VectorView<const T> tau, VectorView<const T> dq,
                               VectorView<const T> dqd, VectorView<const T> dtau, VectorView<T> da,
                               const StateForces<T>& forces = {});
  [[nodiscard]] int forward_dynamics_jvp(RowsView<const T> q, RowsView<const T> qd,
                                         RowsView<const T> tau, RowsView<const T> dq,
                                         RowsView<const T> dqd, RowsView<const T> dtau,
                                         RowsView<T> da, std::span<Outcome> outcomes,
                                         int threads = 1, const ForceRows<T>& forces = {});

  // (2). 500 n.
  void inverse_dynamics_vjp(VectorView<const T> q, VectorView<const T> qd, VectorView<const T> qdd,
                            VectorView<const T> w, const StateVectorJacobian<T>& out,
                            const StateForces<T>& forces = {});
  void inverse_dynamics_vjp(RowsView<const T> q, RowsView<const T> qd, RowsView<const T> qdd,
                            RowsView<const T> w, const RowsOfVectorJacobian<T>& out, int threads,
                            const ForceRows<T>& forces = {});

  // dtau (nv) along dq, dqd and dqdd (nv each). 500 n.
  void inverse_dynamics_jvp(VectorView<const T> q, VectorView<const T> qd, VectorView<const T> qdd,
                            VectorView<const T> dq, VectorView<const T> dqd,
                            VectorView<const T> dqdd, VectorView<T> dtau,
                            const StateForces<T>& forces = {});
  void inverse_dynamics_jvp(RowsView<const T> q, RowsView<const T> qd, RowsView<const T> qdd,
                            RowsView<const T> dq, RowsView<const T> dqd, RowsView<const T> dqdd,
                            RowsView<T> dtau, int threads, const ForceRows<T>& forces = {});

  // (3). 1000 n.
  Outcome solve_vjp(VectorView<const T> q, VectorView<const T> tau, VectorView<const T> w,
                    const StateVectorJacobian<T>& out, const StateLoads<T>& loads = {});
  [[nodiscard]] int solve_vjp(RowsView<const T> q, RowsView<const T> tau, RowsView<const T> w,
                              const RowsOfVectorJacobian<T>& out, std::span<Outcome> outcomes,
                              int threads = 1, const LoadRows<T>& loads = {});

  // dx (nv) along dq and dtau (nv each). 1100 n.
  Outcome solve_jvp(VectorView<const T> q, VectorView<const T> tau, VectorView<const T> dq,
                    VectorView<const T> dtau, VectorView<T> dx, const StateLoads<T>& loads = {});
  [[nodiscard]] int solve_jvp(RowsView<const T> q, RowsView<const T> tau, RowsView<const T> dq,
                              RowsView<const T> dtau, RowsView<T> dx, std::span<Outcome> outcomes,
                              int threads = 1, const LoadRows<T>& loads = {});

  // (5) of X (k x k) of Dynamics::operational, k six times the question's frames, by the weights W (k x k, by columns) of its
  // entries: dq, inertias, armature and loads; std::invalid_argument where others are wanted. 1600 n k.
  Outcome operational_vjp(VectorView<const T> q, MatrixView<const T> W,
                          const StateVectorJacobian<T>& out, const StateLoads<T>& loads = {});
  // Rows of states, W of each in a row.
  [[nodiscard]] int operational_vjp(RowsView<const T> q, RowsView<const T> W,
                                    const RowsOfVectorJacobian<T>& out, std::span<Outcome> outcomes,
                                    int threads = 1, const LoadRows<T>& loads = {});

 private:
  GradientCall<T> checked(const char* call, std::ptrdiff_t count, bool moves,
                          const RowsOfVectorJacobian<T>& out) const;
  GradientRows<T>& sweeps() const;
  OperationalRows<T>& operational() const;  // throws std::logic_error where there is none
  // Of so many rows dx = M^-1 (dtau - dID), and how many failed; dID is written to.
  int changed(std::ptrdiff_t first, std::ptrdiff_t rows, RowsView<const T> q,
              RowsView<const T> dtau, T* dID, RowsView<T> dx, std::span<Outcome> outcomes,
              int threads, const LoadRows<T>& loads);

  int nq_ = 0, nv_ = 0;
  Dynamics<T> dynamics_;
  std::unique_ptr<GradientRows<T>> sweeps_;
  std::unique_ptr<OperationalRows<T>> operational_;  // null: of no frames, or of one on the base
  std::vector<Outcome> outcomes_;
};

}  // namespace kalmarm
