// Implicit steps: a robot with springs and dampers at its joints, however stiff, is moved by h.
//
// With B and K the diagonal matrices of damping b and stiffness k, and q0 the springs' references,
//   M (v+ - v) / h = tau - bias(q, v) - B v+ - K (q + h v+ - q0)                          (1)
// takes springs and dampers where the step ends, the rest where it begins. For a = (v+ - v) / h that is
//   M^ a = tau^ - bias,  M^ = M + diag(r),  r(k) = armature(k) + h b(k) + h^2 k(k)         (2)
//   tau^ = tau - B v - K (q - q0 + h v)                           and forces from outside in bias
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
// Terms that couple joints are rows. Of row i, along a length l(i) = J(i) q of hinges and slides, with
// armature w, damping b, stiffness k and reference l0,
//   M^ += J' W J,  W = diag(w + h b + h^2 k),  tau^ -= J' (b J v + k (J q - l0 + h J v))    (5)
// are a tendon, an actuator on several joints, or an equality of joints that gives way. With X, a0 of
// (2) without rows, Y = X J', G = J Y and C = W^-1, the force f of each row and then a are
//   (C + G) f = c' + J a0,  a = a0 - Y f,  c' = C (b J v + k (J q - l0 + h J v))           (6)
// An imposed row is that of infinite stiffness, C = 0 and c' = (J q - l0 + h J v) / h^2: its length is
// l0 at the end of the step. A row with W = 0 has a force that is known, tau^ -= J' f. By the same f
//   M^^-1 tau = x - Y (C + G)^-1 J x,  x = X tau                                            (7)
//   da/dx = A - Y (C + G)^-1 (dc'/dx + J A),  A of (4) at the torque tau^ - J' f            (8)
// a is as wrong as a0 is: where a row holds what would fall, |a0| may be far above |a|.
//
// Against MuJoCo without contacts, limits and constraints: (2) is its `discrete` integrator,
// Scheme::springs_at_start its `Euler` and `implicitfast` (robots/scene/test/test_implicit_step.cpp).
//
// Springs and dampers at bodies, as contacts are, resist along a line of a frame of Question::contacts: with d = h b +
// h^2 k and rows w = sqrt(d) e (dynamics.hpp), and what is known of their forces, -e (b e'l + k (x - x0 + h e'l)) of
// the frame's motion l, among `forces`,
//   (M^ + J' D J) a = tau^ - bias                                                         (9)
// which factors of M^ and these rows answer.
//
// A position controller with gains kp and kv is a spring and a damper, its target their reference. Of
// rows of states each may have its own gains and targets (GainRows): r(k) of (2) is then one of the
// row, for about the price of a step. So may its armature: with h = 0 these are forward dynamics of robots
// with armatures of their own.
#pragma once

#include <memory>
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

// A length J q that several hinges and slides move together, and what acts along it.
struct CoupledRow {
  std::vector<double> jacobian = {};  // J (nv) [m/rad or m/m]; zero at balls and free joints

  double armature = 0;   // w [kg, where the length is in m]
  double damping = 0;    // b [N s/m]
  double stiffness = 0;  // k [N/m]
  double reference = 0;  // l0 [m]
  bool imposed = false;  // J q = l0 at the end of the step, whatever force that takes
};

// Of every DoF, nv numbers each; none: all zero. A ball and a free joint may have damping, no springs;
// with it their DoF are swept one by one and looked at twice (docs/stiff.md has what that costs).
struct JointTerms {
  std::vector<double> damping = {};    // b [N m s/rad or N s/m]
  std::vector<double> stiffness = {};  // k [N m/rad or N/m]
  std::vector<double> reference = {};  // q0 [rad or m]
  std::vector<CoupledRow> rows = {};
};

// v (nv) and q (nq) of the robot after h, by (3): in place.
KALMARM_EXPORT void advance(const RobotModel& model, double h, VectorView<const double> a,
                            VectorView<double> q, VectorView<double> v);
KALMARM_EXPORT void advance(const RobotModel& model, double h, VectorView<const float> a,
                            VectorView<float> q, VectorView<float> v);

// Of rows of states, each (rows x nv): what is left out is the step's own.
template <class T>
struct GainRows {
  RowsView<const T> damping = {nullptr, 0, 0};    // b [N m s/rad or N s/m]
  RowsView<const T> stiffness = {nullptr, 0, 0};  // k [N m/rad or N/m]
  RowsView<const T> reference = {nullptr, 0, 0};  // q0 [rad or m]
  RowsView<const T> armature = {nullptr, 0, 0};   // the robot's, not the step's [kg m^2 or kg]
};

template <class T>
class CoupledRows;
template <class T>
class GainsOfRows;

template <class T>
class KALMARM_EXPORT ImplicitStep {
 public:
  // h >= 0 [s]. Throws std::invalid_argument with the DoF where h, b or k is negative, where a number is
  // not finite or too large for T, where a ball or free joint has a spring, and where the question
  // leaves joints out or is at rest; the same of a row, by its number, which needs h > 0 where it is
  // imposed; and what Dynamics throws. Rows want solve, beside what the question wants.
  ImplicitStep(const RobotModel& model, double h, const JointTerms& terms,
               Scheme scheme = Scheme::springs_at_end, const DynamicsOptions& options = {});
  ~ImplicitStep();
  ImplicitStep(ImplicitStep&&) noexcept;
  ImplicitStep& operator=(ImplicitStep&&) noexcept;

  double h() const { return h_; }

  // a (nv) = (v+ - v) / h by (2) and (6). Outcome::error is that of a for tau^ as T holds it, whose own
  // rounding, u k |q - q0|, moves a by M^^-1 times as much. Singular where imposed rows contradict each
  // other or what the robot can do, and where rows repeat each other so stiffly that T cannot tell
  // them from imposed ones. The time of forward dynamics, and of m rows with W 127 n m flops more.
  // forces: from outside, which act as they do where the step begins, and loads (dynamics.hpp). contacts: a by (9), in the
  // time of 171 n and solves, right for tau^ - bias as T holds it.
  Outcome acceleration(VectorView<const T> q, VectorView<const T> v, VectorView<const T> tau,
                       VectorView<T> a, const StateForces<T>& forces = {},
                       const StateContacts<T>& contacts = {});

  // Rows of states, as Dynamics::forward_dynamics. A call with more rows than any before takes memory.
  [[nodiscard]] int acceleration(RowsView<const T> q, RowsView<const T> v, RowsView<const T> tau,
                                 RowsView<T> a, std::span<Outcome> outcomes, int threads = 1,
                                 const ForceRows<T>& forces = {},
                                 const ContactRows<T>& contacts = {});

  // Rows of states with gains of their own. References cost nothing; dampers, springs and armatures 1.2 times
  // the time of a step; below a tolerance of 1e-12 every row is a robot that is made anew. Throws
  // std::invalid_argument with row and DoF where b, k or an armature is negative, where a number is not finite,
  // where a ball or free joint has a spring, and where dampers, springs or armatures of rows stand beside terms
  // that couple joints, or contacts.
  [[nodiscard]] int acceleration(RowsView<const T> q, RowsView<const T> v, RowsView<const T> tau,
                                 const GainRows<T>& gains, RowsView<T> a,
                                 std::span<Outcome> outcomes, int threads = 1,
                                 const ForceRows<T>& forces = {},
                                 const ContactRows<T>& contacts = {});

  // q and v are moved by h, in place, with a (nv) of the step. Not where the outcome is not ok.
  Outcome step(VectorView<T> q, VectorView<T> v, VectorView<const T> tau, VectorView<T> a,
               const StateForces<T>& forces = {}, const StateContacts<T>& contacts = {});

  // (4), each nv x nv, and a. Outcome as Dynamics::derivatives.
  Outcome derivatives(VectorView<const T> q, VectorView<const T> v, VectorView<const T> tau,
                      const Derivatives<T>& out, VectorView<T> a,
                      const StateForces<T>& forces = {});

  // M^ (nv x nv). std::logic_error where a row is imposed, which has no finite one.
  void mass(VectorView<const T> q, MatrixView<T> M);

  // M^^-1 (nv x nv) by (7).
  Outcome inverse_mass(VectorView<const T> q, MatrixView<T> X);

  // Factors of M^ at q, and M^^-1 tau of one or many (nv x m), as Dynamics::factor and solve.
  Outcome factor(VectorView<const T> q);
  Outcome solve(MatrixView<const T> tau, MatrixView<T> x);

  // Whose M is M^ but for rows: diagonal, log_det and all others.
  Dynamics<T>& dynamics() { return dynamics_; }

 private:
  // Springs at DoF that follow one another, as their entries of q do.
  struct Springs {
    int dof, q, count;
  };
  static constexpr std::ptrdiff_t rows_at_once = 1024;  // whose Y is kept
  static constexpr int repeated =
      32;  // rows whose terms lie side by side, where q(k) is that of DoF k

  // Numbers of every DoF: of each row, or of `repeated` rows, all the same.
  struct Numbers {
    const T* at;
    bool of_rows;

    const T* from(std::ptrdiff_t first) const { return of_rows ? at + first : at; }
  };

  Outcome coupled(Outcome of_a0, const T* q, const T* v, const T* Y, T* a) const;
  // (9), of one state that joints are coupled in, and of rows.
  Outcome standing(VectorView<const T> q, VectorView<const T> v, VectorView<T> a,
                   const StateForces<T>& forces, const StateContacts<T>& contacts);
  int standing(RowsView<const T> q, RowsView<const T> v, RowsView<T> a, std::span<Outcome> outcomes,
               int threads, const ForceRows<T>& forces, const ContactRows<T>& contacts);
  Outcome factor_coupled(const T* q);
  Outcome keep_coupled();
  bool solves_rows() const;
  void require(const char* call, std::ptrdiff_t q, std::ptrdiff_t v, std::ptrdiff_t tau) const;
  void set_torque(std::ptrdiff_t rows, const T* q, const T* v, const T* tau, T* out) const {
    set_torque(rows, q, v, tau, {damping_.data(), false}, {stiffness_.data(), false},
               {reference_.data(), false}, springs_, out);
  }
  void set_torque(std::ptrdiff_t rows, const T* q, const T* v, const T* tau, const Numbers& damping,
                  const Numbers& stiffness, const Numbers& reference,
                  const std::vector<Springs>& springs, T* out) const;

  RobotModel model_;
  double h_;
  std::ptrdiff_t forces_, loads_, contacts_;  // numbers of a row
  Dynamics<T> dynamics_;                      // what it is made of is checked before the rest
  int rows_of_terms_;                         // `repeated`, or 1 where q is not as v
  std::vector<T> damping_, stiffness_, reference_;
  std::vector<Springs> springs_, all_springs_;  // that the step has; where there may be some
  T h_of_springs_;                              // 0 where they are at the start
  std::vector<T> tau_, rows_, X_;
  // Of (9): tau^ - bias, no accelerations; q, contacts, loads and x of columns, and their outcomes.
  std::vector<T> known_, zeros_, again_[4];
  std::vector<Outcome> outcomes_;
  std::unique_ptr<CoupledRows<T>> coupled_;  // none where nothing is coupled
  std::vector<T> Y_;                         // of rows of states
  std::unique_ptr<GainsOfRows<T>> gains_;    // of rows of states
  std::vector<T> factored_q_;
  Outcome kept_;          // of factors at factored_q_,
  bool is_kept_ = false;  // whose Y and C + G coupled_ holds
};

}  // namespace kalmarm
