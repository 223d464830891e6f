// Constrained dynamics: a robot whose frames or joints are held together, as by the loops of a four-bar, a Stewart
// platform or Cassie's legs, contacts that neither slip nor part, welds, gears.
//
//   kalmarm::ConstrainedDynamics<double> robot(model, {{.name = "rod", .first = tip, .second = crank}});
//   kalmarm::Outcome outcome = robot.forward_dynamics(q, qd, tau, a, forces);
//
// With J of all m rows, e' = J qd, the accelerations a and the forces lambda of the rows are those of
//   M a + bias = tau + J' lambda + f                                                          (1)
//   J a + R lambda = a_ref,  a_ref = -dJ/dt qd - b e' - d k e                                 (2)
// (e, b, k, d, R: constraint.hpp; f: J' forces of what acts from outside, as in Dynamics), which minimise |a - a0|^2_M +
// |J a - a_ref|^2_(R^-1) over a, a0 = M^-1 (tau + f - bias). R = 0 is
// an exact constraint. By W = M^-1, X = W J' and a Cholesky factor,
//   (A + mu S) delta = a_ref - J a - R lambda,  A = J X + R                                   (3)
//   lambda += delta,  a += X delta,  from lambda = 0 and a = a0                               (4)
// until X delta is rounding, with S the diagonal of A, its mean over the three rows of turning or moving. With mu = 0 the second step is a refinement. mu > 0 is the proximal method: rows may repeat
// each other, forces are then the least ones in the units of S (a is unique still), and the same steps converge where
// constraints agree. An impulse is (4) from a0 = qd with a_ref = 0,
//   qd+ = qd - X A^-1 J qd                                                                    (5)
// and so is, from x0 = M^-1 b, with R = D^-1
//   (M + J' D J)^-1 b = x0 - X A^-1 J x0                                                      (6)
//
// Errors. Of |x| = max over j of |x(j)| / W(j,j)^1/2, which is at most |x|_M, Outcome::error estimates |delta a| / |a|:
//   eps0 |a0| + eps |W^1/2| |J'| |lambda| + sum over i of r(i) (A + mu S)^-1(i,i)^1/2         (7)
// with eps0 that of a0, eps of W, r(i) what (2) is missed by and 4 u times its terms, and in place of an |a| below a hundredth
// of |a0|, or of gravity's on the whole robot, that hundredth. So the condition of A counts in r alone: where J a is a_ref, errors of lambda move a along
// nothing that the constraints leave free. It is an estimate: nothing of it is proven, and a0 that falls while constraints
// hold it is counted in full. Constraints that contradict each other leave r: `error` is at least r beside its terms, and where that is above
// 1 per cent there is no answer.
//   ok               a may be used; warns() where (7) is above 1 per cent
//   singular         joint: nv + the constraint at which a pivot D of (3) cannot be told from 0 beside `scale`, or, with mu > 0,
//                    which is missed by most; or a DoF, of M itself
// Costs: those of forward dynamics, of M^-1, and of J; 2 n times the DoF between a constraint and the base for a row; m^3.
// M^-1 is 44 n^2 flops, against 127 n m for X by solves: faster from m = n / 3 on, and of rows of states.
//
// Forces. lambda of a point is the force on frame 1 in the base's axes, its opposite acts on frame 2; of a pose (s = 1, e = 0)
// before that the torque, in the axes of frame 2. They do the work lambda' e'.
//
// Threads and memory as Dynamics.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "kalmarm/constraint.hpp"
#include "kalmarm/dynamics.hpp"
#include "kalmarm/export.hpp"
#include "kalmarm/outcome.hpp"
#include "kalmarm/robot_model.hpp"
#include "kalmarm/views.hpp"

namespace kalmarm {

struct ConstrainedOptions {
  std::optional<double> tolerance = {};  // of Dynamics
  double proximal = 0;               // mu of (3); 1e-8 is a good one where rows repeat each other
  int iterations = 20;               // of (4), at most
  std::vector<Frame> acted_on = {};  // on which forces act from outside
};

// Of one state, each may be left out.
template <class T>
struct ConstraintState {
  MatrixView<T> error = {};     // m: e
  MatrixView<T> rate = {};      // m: e' = J qd
  MatrixView<T> jacobian = {};  // nv x m: the transpose of J
};

template <class T>
class KALMARM_EXPORT ConstrainedDynamics {
 public:
  // Throws std::invalid_argument, with the constraint's name and the value, where there is none, where a frame is on a link
  // that is not there or both are on one link, a coupling is of no joint or of one that is no hinge or slide, k, b, R or mu are negative
  // or not finite, an impedance is none; and what Dynamics throws.
  ConstrainedDynamics(const RobotModel& model, const std::vector<Constraint>& constraints,
                      const ConstrainedOptions& options = {});
  ~ConstrainedDynamics();
  ConstrainedDynamics(ConstrainedDynamics&&) noexcept;
  ConstrainedDynamics& operator=(ConstrainedDynamics&&) noexcept;

  int nq() const { return nq_; }
  int nv() const { return nv_; }
  int rows() const { return m_; }  // m
  // Of the DoF or the constraint that an outcome is about; "" where it is about none.
  const std::string& name_of(const Outcome& outcome) const;

  // e, e' and J at q and, for e', qd.
  void evaluate(VectorView<const T> q, const ConstraintState<T>& out) { evaluate(q, nullptr, out); }
  void evaluate(VectorView<const T> q, VectorView<const T> qd, const ConstraintState<T>& out) {
    evaluate(q, &qd, out);
  }

  // a (nv) and lambda (m). outside: on the frames that are acted on (dynamics.hpp).
  Outcome forward_dynamics(VectorView<const T> q, VectorView<const T> qd, VectorView<const T> tau,
                           VectorView<T> a, VectorView<T> forces,
                           const StateForces<T>& outside = {}) {
    return of_state({.what = What::accelerations, .name = "tau"}, q, &qd, tau, a, forces, outside);
  }
  // qd+ (nv) of (5) and the impulses (m) [N s].
  Outcome impulse(VectorView<const T> q, VectorView<const T> qd, VectorView<T> after,
                  VectorView<T> impulses) {
    return of_state({.what = What::impulses, .name = "qd"}, q, nullptr, qd, after, impulses);
  }
  // x (nv) of (6) and -D J x (m); of exact constraints the a of a torque b without bias, at rest.
  Outcome solve(VectorView<const T> q, VectorView<const T> b, VectorView<T> x,
                VectorView<T> forces) {
    return of_state({.what = What::solutions, .name = "b"}, q, nullptr, b, x, forces);
  }

  // The same of rows of states, one outcome each, on `threads` cores. Return how many failed, whose rows are NaN.
  [[nodiscard]] int forward_dynamics(RowsView<const T> q, RowsView<const T> qd,
                                     RowsView<const T> tau, RowsView<T> a, RowsView<T> forces,
                                     std::span<Outcome> outcomes, int threads = 1,
                                     const ForceRows<T>& outside = {}) {
    return of_rows({.what = What::accelerations, .name = "tau"}, q, &qd, tau, a, forces, outcomes,
                   threads, outside);
  }
  [[nodiscard]] int impulse(RowsView<const T> q, RowsView<const T> qd, RowsView<T> after,
                            RowsView<T> impulses, std::span<Outcome> outcomes, int threads = 1) {
    return of_rows({.what = What::impulses, .name = "qd"}, q, nullptr, qd, after, impulses,
                   outcomes, threads);
  }
  [[nodiscard]] int solve(RowsView<const T> q, RowsView<const T> b, RowsView<T> x,
                          RowsView<T> forces, std::span<Outcome> outcomes, int threads = 1) {
    return of_rows({.what = What::solutions, .name = "b"}, q, nullptr, b, x, forces, outcomes,
                   threads);
  }

 private:
  struct Memory;
  enum class What { accelerations, impulses, solutions };
  struct Asked {
    What what;
    const char* name;  // of what it is given beside q and qd
  };

  void evaluate(const VectorView<const T>& q, const VectorView<const T>* qd,
                const ConstraintState<T>& out);
  Outcome of_state(const Asked& asked, const VectorView<const T>& q, const VectorView<const T>* qd,
                   const VectorView<const T>& given, const VectorView<T>& x,
                   const VectorView<T>& forces, const StateForces<T>& outside = {});
  int of_rows(const Asked& asked, const RowsView<const T>& q, const RowsView<const T>* qd,
              const RowsView<const T>& given, const RowsView<T>& x, const RowsView<T>& forces,
              std::span<Outcome> outcomes, int threads, const ForceRows<T>& outside = {});
  Memory& memory() const;  // throws std::logic_error where it was moved away

  int nq_, nv_, m_;
  std::unique_ptr<Memory> memory_;
};

}  // namespace kalmarm
