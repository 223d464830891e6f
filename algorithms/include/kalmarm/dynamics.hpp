// Dynamics: the one way to ask for what a robot's dynamics are.
//
//   kalmarm::Dynamics<double> robot(model, {.tolerance = 1e-12});
//   kalmarm::Outcome outcome = robot.forward_dynamics(q, qd, tau, a);   // a is filled
//
// q holds nq numbers, every velocity, acceleration and torque nv; results about chosen joints hold
// as many as were asked about. Vectors and matrices are anything that holds numbers side by side
// (views.hpp). Sizes are checked at every call: std::invalid_argument names the call and both
// sizes. An Outcome (outcome.hpp) says whether a result may be used; nothing is thrown for what the
// numbers are. Memory is taken when the object is made, for what the question wants; a call takes
// none, except the first for rows, the first on more threads than before, and the first that leaves
// a derivative out.
//
// Threads: an object has memory of its own that every call writes to, so that one thread at a time
// may use it, also of those that ask for the mass matrix alone. Different objects may be used on
// different threads freely; a thread each is what an object of its own is for. Calls for rows spread
// them over threads themselves. An object that was moved from throws std::logic_error.
//
// What is computed stands in fast/ with its equations: the filter and smoother of the paper,
// (3.6), (4.1) to (4.11), on frames that lie on the joints' axes. Costs are in flops of double for
// a chain of n hinges; trees cost less.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "kalmarm/call.hpp"
#include "kalmarm/export.hpp"
#include "kalmarm/kernels.hpp"
#include "kalmarm/outcome.hpp"
#include "kalmarm/question.hpp"
#include "kalmarm/robot_model.hpp"
#include "kalmarm/tolerance.hpp"
#include "kalmarm/views.hpp"

namespace kalmarm {

// Of M and M^-1 of one state, by columns. `lower`: what is above the diagonal is not to be read, and
// may be left as it was, which saves 28 to 42 per cent of the time of a chain of 500.
enum class Triangles { both, lower };

struct DynamicsOptions {
  std::optional<double> tolerance = {};   // from last_bits to 1; empty: default_tolerance<T>
  Question question = {};                 // empty: everything about the whole robot
  std::set<Rule> rules = all_rules();     // by which work may be left out
  Triangles triangles = Triangles::both;  // that calls of one state have to fill
  Kernels kernels = Kernels::loops;       // generated: by which calls answer that there is code for
  CodeOptions code = {};                  // how that comes about
};

// Derivatives of forward dynamics, nv x nv, column j for DoF j. Each may be left out. dq is for a
// change along DoF j's velocity, as joints of several DoF need it.
template <class T>
struct Derivatives {
  MatrixView<T> dq = {}, dqd = {}, dtau = {};
};

// The same of rows of states: a row has the columns of one state's matrix after each other.
template <class T>
struct DerivativeRows {
  std::optional<RowsView<T>> dq = {}, dqd = {}, dtau = {};
};

// What a state has on frames that a question names. `on`: six numbers of each, (moment; force) in these axes about
// their origin [N m; N]; `loads`: bodies that hang on the frames of Question::loaded, in their order, and change M, the
// bias and all that is made of them: of each ten numbers about the frame's origin and in its axes, as
// Kinematics::regressor has them,
//   (m, h_x, h_y, h_z, I_xx, I_yy, I_zz, I_xy, I_xz, I_yz),   h = m c                      [kg, kg m, kg m^2]
// of a body that can be: else what is made of factors is refused as indefinite. Left out: none. `gravity`: three
// numbers in the base's axes [m/s^2] in the place of the model's.
template <class View>
struct OnFrames {
  std::optional<View> on = {};
  Axes axes = Axes::aligned;
  std::optional<View> loads = {};
  std::optional<View> gravity = {};
};

// Forces from outside on the frames of Question::acted_on, in their order: with J of the same axes (kinematics.hpp)
// they do the work force' J qd.
template <class T>
using StateForces = OnFrames<VectorView<const T>>;
template <class T>
using ForceRows = OnFrames<RowsView<const T>>;  // of rows of states: these numbers in each

// Contacts with the world, which make H = M + J'DJ of M in what is made of factors alone: what contact simulators
// factor. Of each frame of Question::contacts, in their order, a row
//   w = sqrt(d) (p x f; f),  H = M + sum of (w'J)'(w'J)
// f: the direction in which the contact resists at p, d: its stiffness [kg] (of a step: h^2 times a spring's, h
// times a damper's), J: the frame's. Any 6 x 6 matrix L L' that a body's inertia grows by is the columns of L as rows.
// What stiffness costs of digits is in docs/contacts.md.
template <class T>
using StateContacts = StateForces<T>;
template <class T>
using ContactRows = ForceRows<T>;

// Of calls that take loads alone.
template <class T>
using StateLoads = std::optional<VectorView<const T>>;
template <class T>
using LoadRows = std::optional<RowsView<const T>>;

struct Plan;
struct EngineOptions;
template <class T>
class Engine;
template <class T>
class Execution;
// Makes what answers for one part of a robot; the study puts its own variants here.
template <class T>
using MakeEngine =
    std::function<std::unique_ptr<Engine<T>>(const RobotModel&, const EngineOptions&)>;

template <class T>
class KALMARM_EXPORT Dynamics {
 public:
  // Throws std::invalid_argument where model or question contradict themselves, and with the DoF and
  // the value where the model is what no robot can be: quaternions of no length, moments of inertia
  // or masses below zero, numbers that are not finite or that T does not hold.
  explicit Dynamics(const RobotModel& model, const DynamicsOptions& options = {});

  // The same by other engines (algorithms/study/solver_engine.hpp).
  Dynamics(const RobotModel& model, const DynamicsOptions& options, const MakeEngine<T>& make);

  ~Dynamics();
  Dynamics(Dynamics&&) noexcept;
  Dynamics& operator=(Dynamics&&) noexcept;

  int nq() const { return nq_; }
  int nv() const { return nv_; }
  int asked() const { return asked_; }  // DoF asked about: nv() unless the question leaves some out
  double tolerance() const { return tolerance_; }
  const Plan& plan() const;
  // Of Kernels::generated, a line for every part and task: what was compiled, by which compiler, in how many seconds, and
  // where it stands, or why the loops answer.
  const std::vector<std::string>& notes() const { return notes_; }

  // a (asked) = M^-1 (tau + J' forces - bias(q, qd)), gravity and armature included; Outcome::error says how
  // wrong it is. 465 n, and for a force 45, in other axes than its frame's 24 to 48 more a link of its way.
  Outcome forward_dynamics(VectorView<const T> q, VectorView<const T> qd, VectorView<const T> tau,
                           VectorView<T> a, const StateForces<T>& forces = {}) {
    check("forward_dynamics", q, qd, "tau", tau, a.size(), asked_);
    return answer(acted("forward_dynamics",
                        {.want = Want::acceleration,
                         .q = q.data(),
                         .qd = qd.data(),
                         .tau = tau.data(),
                         .out = a.data()},
                        forces));
  }

  // Rows of states, one outcome each, on `threads` cores. Returns how many failed, whose rows are
  // not to be used.
  [[nodiscard]] int forward_dynamics(RowsView<const T> q, RowsView<const T> qd,
                                     RowsView<const T> tau, RowsView<T> a,
                                     std::span<Outcome> outcomes, int threads = 1,
                                     const ForceRows<T>& forces = {}) {
    const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
    check("forward_dynamics", count, q, qd, "tau", tau, a, asked_);
    return answer_rows(count,
                       acted("forward_dynamics",
                             {.want = Want::acceleration,
                              .q = q.data(),
                              .qd = qd.data(),
                              .tau = tau.data(),
                              .out = a.data()},
                             forces, count),
                       outcomes.data(), threads);
  }

  // The same and X = M^-1 B (asked x m) of the columns of B, such as the transposed Jacobian of what is
  // to be constrained; by the factors of the same sweep, where none of it climbs to another rung. The
  // outcome is the worst of them all. Factors that were kept are made again when they are asked for. Wants acceleration and solve. 465 n + 127 n m.
  Outcome forward_dynamics(VectorView<const T> q, VectorView<const T> qd, VectorView<const T> tau,
                           VectorView<T> a, MatrixView<const T> B, MatrixView<T> X,
                           const StateForces<T>& forces = {}) {
    check("forward_dynamics", q, qd, "tau", tau, a.size(), asked_);
    const int m = checked_columns("forward_dynamics", "B", B, "X", X);
    return answer(acted("forward_dynamics",
                        {.want = Want::acceleration,
                         .q = q.data(),
                         .qd = qd.data(),
                         .tau = tau.data(),
                         .out = a.data(),
                         .m = m,
                         .B = B.data(),
                         .X = X.data()},
                        forces));
  }

  // Rows of states: X (asked x rows m) has the m columns of a row side by side. Those that are suspect
  // are answered one after another.
  [[nodiscard]] int forward_dynamics(RowsView<const T> q, RowsView<const T> qd,
                                     RowsView<const T> tau, RowsView<T> a, MatrixView<const T> B,
                                     MatrixView<T> X, std::span<Outcome> outcomes, int threads = 1,
                                     const ForceRows<T>& forces = {}) {
    const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
    check("forward_dynamics", count, q, qd, "tau", tau, a, asked_);
    const int m = checked_columns("forward_dynamics", "B", B, "X", X, count);
    return answer_rows(count,
                       acted("forward_dynamics",
                             {.want = Want::acceleration,
                              .q = q.data(),
                              .qd = qd.data(),
                              .tau = tau.data(),
                              .out = a.data(),
                              .m = m,
                              .B = B.data(),
                              .X = X.data()},
                             forces, count),
                       outcomes.data(), threads);
  }

  // Rows of states, each with a column of its own: x = M^-1 b (asked each), else the same. b and x do not overlap. 592 n.
  [[nodiscard]] int forward_dynamics_and_solve(RowsView<const T> q, RowsView<const T> qd,
                                               RowsView<const T> tau, RowsView<T> a,
                                               RowsView<const T> b, RowsView<T> x,
                                               std::span<Outcome> outcomes, int threads = 1,
                                               const ForceRows<T>& forces = {}) {
    const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
    check("forward_dynamics_and_solve", count, q, qd, "tau", tau, a, asked_);
    check("forward_dynamics_and_solve", "b", count, b, asked_);
    check("forward_dynamics_and_solve", "x", count, x, asked_);
    refuse_overlap("forward_dynamics_and_solve", "b", b.data(), b.size(), "x", x.data(), x.size());
    return answer_rows(count,
                       acted("forward_dynamics_and_solve",
                             {.want = Want::acceleration,
                              .q = q.data(),
                              .qd = qd.data(),
                              .tau = tau.data(),
                              .out = a.data(),
                              .m = 1,
                              .B = b.data(),
                              .X = x.data(),
                              .B_of_rows = true},
                             forces, count),
                       outcomes.data(), threads);
  }

  // tau (asked) = M qdd + bias(q, qd) - J' forces, gravity and armature included. 171 n, forces as there.
  void inverse_dynamics(VectorView<const T> q, VectorView<const T> qd, VectorView<const T> qdd,
                        VectorView<T> tau, const StateForces<T>& forces = {}) {
    check("inverse_dynamics", q, qd, "qdd", qdd, tau.size(), asked_);
    torques(q.data(), qd.data(), qdd.data(), tau.data(), "inverse_dynamics", forces);
  }

  // The same of rows of states, on `threads` cores.
  void inverse_dynamics(RowsView<const T> q, RowsView<const T> qd, RowsView<const T> qdd,
                        RowsView<T> tau, int threads, const ForceRows<T>& forces = {}) {
    const std::ptrdiff_t count = nq_ > 0 ? q.size() / nq_ : 0;
    check("inverse_dynamics", count, q, qd, "qdd", qdd, tau, asked_);
    (void)answer_rows(count,
                      acted("inverse_dynamics",
                            {.want = Want::inverse_dynamics,
                             .q = q.data(),
                             .qd = qd.data(),
                             .tau = qdd.data(),
                             .out = tau.data()},
                            forces, count),
                      nullptr, threads);
  }

  // tau (asked) = bias(q, qd) - J' forces: velocity terms and gravity, the torques of qdd = 0. 171 n.
  void bias(VectorView<const T> q, VectorView<const T> qd, VectorView<T> tau,
            const StateForces<T>& forces = {}) {
    check("bias", q, qd, "qd", qd, tau.size(), asked_);
    torques(q.data(), qd.data(), nullptr, tau.data(), "bias", forces);
  }

  // tau (asked): the torques that hold the robot against the model's gravity. 171 n.
  void gravity(VectorView<const T> q, VectorView<T> tau, const StateLoads<T>& loads = {}) {
    check("gravity", "q", q.size(), nq_);
    check("gravity", "tau", tau.size(), asked_);
    torques(q.data(), nullptr, nullptr, tau.data(), "gravity", {.loads = loads});
  }

  // M (asked x asked), symmetric to the last bit. 80 n + 16 n^2.
  void mass(VectorView<const T> q, MatrixView<T> M, const StateLoads<T>& loads = {}) {
    check("mass", "q", q.size(), nq_);
    check("mass", "M", M, asked_);
    (void)answer({.want = Want::mass,
                  .q = q.data(),
                  .out = M.data(),
                  .loads = checked_loads("mass", loads)});
  }

  // Rows of states, M (asked x asked) of each in a row of `M`, both triangles, one outcome each, on
  // `threads` cores. Returns how many are not finite.
  [[nodiscard]] int mass(RowsView<const T> q, RowsView<T> M, std::span<Outcome> outcomes,
                         int threads = 1, const LoadRows<T>& loads = {}) {
    const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
    check("mass", "q", count, q, nq_);
    check("mass", "M", count, M, std::ptrdiff_t(asked_) * asked_);
    return answer_rows(count,
                       {.want = Want::mass,
                        .q = q.data(),
                        .out = M.data(),
                        .loads = checked_loads("mass", loads, count)},
                       outcomes.data(), threads);
  }

  // M^-1 (asked x asked), symmetric to the last bit. 195 n + 44 n^2. Here and below, with contacts, that of
  // H, for 110 flops a contact, 390 a link of its way.
  Outcome inverse_mass(VectorView<const T> q, MatrixView<T> X,
                       const StateContacts<T>& contacts = {}) {
    check("inverse_mass", "q", q.size(), nq_);
    check("inverse_mass", "X", X, asked_);
    return answer("inverse_mass", {.want = Want::inverse, .q = q.data(), .out = X.data()},
                  contacts);
  }

  // Rows of states, M^-1 (asked x asked) of each in a row of X, both triangles, one outcome each, on
  // `threads` cores. Returns how many failed, whose rows are not to be used.
  [[nodiscard]] int inverse_mass(RowsView<const T> q, RowsView<T> X, std::span<Outcome> outcomes,
                                 int threads = 1, const ContactRows<T>& contacts = {}) {
    const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
    check("inverse_mass", "q", count, q, nq_);
    check("inverse_mass", "X", count, X, std::ptrdiff_t(asked_) * asked_);
    return answer_rows("inverse_mass", count,
                       {.want = Want::inverse, .q = q.data(), .out = X.data()}, contacts,
                       outcomes.data(), threads);
  }

  // Factors of M at q, which are kept for any number of solves. 195 n.
  Outcome factor(VectorView<const T> q, const StateContacts<T>& contacts = {}) {
    check("factor", "q", q.size(), nq_);
    return factor(resisted("factor", {.want = Want::solve, .q = q.data()}, contacts));
  }

  // x = M^-1 tau by the factors that are kept, of one vector (asked) or of every column of a matrix
  // (asked x m, column-major), which does not overlap x. The outcome is the worst of the factors',
  // made again where another call has overwritten them, and the columns': a column whose
  // estimated error is too large is answered by the next rung, and of such columns the outcome has the
  // worst error. After a factorisation that failed its outcome is returned, and x is filled with
  // NaN. Before any: std::logic_error. 127 n m.
  Outcome solve(MatrixView<const T> tau, MatrixView<T> x) {
    return solve(checked_columns("solve", "tau", tau, "x", x), tau.data(), x.data());
  }

  // x = M^-1 tau (asked each) of rows of states, each at its own q, one outcome each, on `threads`
  // cores; tau and x do not overlap. Returns how many failed, whose rows are not to be used. Factors
  // that were kept are made again when they are asked for. 322 n.
  [[nodiscard]] int solve(RowsView<const T> q, RowsView<const T> tau, RowsView<T> x,
                          std::span<Outcome> outcomes, int threads = 1,
                          const ContactRows<T>& contacts = {}) {
    const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
    check("solve", "q", count, q, nq_);
    check("solve", "tau", count, tau, asked_);
    check("solve", "x", count, x, asked_);
    refuse_overlap("solve", "tau", tau.data(), tau.size(), "x", x.data(), x.size());
    return answer_rows("solve", count,
                       {.want = Want::solve, .q = q.data(), .tau = tau.data(), .out = x.data()},
                       contacts, outcomes.data(), threads);
  }

  // Derivatives of forward dynamics, and a itself (asked). Outcome::error is NaN. Forces are in the axes of their
  // frames (Axes::local) and turn with them: std::invalid_argument where they are in others. 1300 n + 60 n^2.
  Outcome derivatives(VectorView<const T> q, VectorView<const T> qd, VectorView<const T> tau,
                      const Derivatives<T>& out, VectorView<T> a,
                      const StateForces<T>& forces = {}) {
    check("derivatives", q, qd, "tau", tau, a.size(), asked_);
    check_derivatives(out);
    check_turning(forces.on.has_value(), forces.axes);
    return answer(acted("derivatives",
                        {.want = Want::derivatives,
                         .q = q.data(),
                         .qd = qd.data(),
                         .tau = tau.data(),
                         .out = a.data(),
                         .derivatives = {out.dq.data(), out.dqd.data(), out.dtau.data()}},
                        forces));
  }

  // Rows of states, one outcome each, on `threads` cores; a (asked) of each in a row. Returns how many
  // failed, whose rows are not to be used.
  [[nodiscard]] int derivatives(RowsView<const T> q, RowsView<const T> qd, RowsView<const T> tau,
                                const DerivativeRows<T>& out, RowsView<T> a,
                                std::span<Outcome> outcomes, int threads = 1,
                                const ForceRows<T>& forces = {}) {
    const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
    check("derivatives", count, q, qd, "tau", tau, a, asked_);
    check_derivatives(count, out);
    check_turning(forces.on.has_value(), forces.axes);
    const auto data = [](const std::optional<RowsView<T>>& rows) {
      return rows ? rows->data() : nullptr;
    };
    return answer_rows(count,
                       acted("derivatives",
                             {.want = Want::derivatives,
                              .q = q.data(),
                              .qd = qd.data(),
                              .tau = tau.data(),
                              .out = a.data(),
                              .derivatives = {data(out.dq), data(out.dqd), data(out.dtau)}},
                             forces, count),
                       outcomes.data(), threads);
  }

  // x (asked) = the diagonal of M^-1. 445 n.
  Outcome diagonal(VectorView<const T> q, VectorView<T> x, const StateContacts<T>& contacts = {}) {
    check("diagonal", "q", q.size(), nq_);
    check("diagonal", "x", x.size(), asked_);
    return answer("diagonal", {.want = Want::diagonal, .q = q.data(), .out = x.data()}, contacts);
  }

  // Rows of states, x (asked) of each in a row, one outcome each, on `threads` cores; so are those of
  // log_det, one number each, of operational, a matrix in a row of X each, and of its diagonal.
  // Returns how many failed, whose rows are not to be used.
  [[nodiscard]] int diagonal(RowsView<const T> q, RowsView<T> x, std::span<Outcome> outcomes,
                             int threads = 1, const ContactRows<T>& contacts = {}) {
    const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
    check("diagonal", "q", count, q, nq_);
    check("diagonal", "x", count, x, asked_);
    return answer_rows("diagonal", count, {.want = Want::diagonal, .q = q.data(), .out = x.data()},
                       contacts, outcomes.data(), threads);
  }

  // x = log det M of the joints that are free. 195 n.
  Outcome log_det(VectorView<const T> q, T& x, const StateContacts<T>& contacts = {}) {
    check("log_det", "q", q.size(), nq_);
    return answer("log_det", {.want = Want::log_det, .q = q.data(), .out = &x}, contacts);
  }

  [[nodiscard]] int log_det(RowsView<const T> q, RowsView<T> x, std::span<Outcome> outcomes,
                            int threads = 1, const ContactRows<T>& contacts = {}) {
    const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
    check("log_det", "q", count, q, nq_);
    check("log_det", "x", count, x, 1);
    return answer_rows("log_det", count, {.want = Want::log_det, .q = q.data(), .out = x.data()},
                       contacts, outcomes.data(), threads);
  }

  // X = J M^-1 J' of the question's frames, 6 rows each: (angular; linear) in a frame's axes.
  Outcome operational(VectorView<const T> q, MatrixView<T> X,
                      const StateContacts<T>& contacts = {}) {
    check("operational", "q", q.size(), nq_);
    check("operational", "X", X, rows_);
    return answer("operational", {.want = Want::operational, .q = q.data(), .out = X.data()},
                  contacts);
  }

  [[nodiscard]] int operational(RowsView<const T> q, RowsView<T> X, std::span<Outcome> outcomes,
                                int threads = 1, const ContactRows<T>& contacts = {}) {
    const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
    check("operational", "q", count, q, nq_);
    check("operational", "X", count, X, std::ptrdiff_t(rows_) * rows_);
    return answer_rows("operational", count,
                       {.want = Want::operational, .q = q.data(), .out = X.data()}, contacts,
                       outcomes.data(), threads);
  }

  // x = its diagonal alone. A further frame of a link costs a quarter of what the first does.
  Outcome operational_diagonal(VectorView<const T> q, VectorView<T> x,
                               const StateContacts<T>& contacts = {}) {
    check("operational_diagonal", "q", q.size(), nq_);
    check("operational_diagonal", "x", x.size(), rows_);
    return answer("operational_diagonal",
                  {.want = Want::operational_diagonal, .q = q.data(), .out = x.data()}, contacts);
  }

  [[nodiscard]] int operational_diagonal(RowsView<const T> q, RowsView<T> x,
                                         std::span<Outcome> outcomes, int threads = 1,
                                         const ContactRows<T>& contacts = {}) {
    const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
    check("operational_diagonal", "q", count, q, nq_);
    check("operational_diagonal", "x", count, x, rows_);
    return answer_rows("operational_diagonal", count,
                       {.want = Want::operational_diagonal, .q = q.data(), .out = x.data()},
                       contacts, outcomes.data(), threads);
  }

 private:
  Dynamics(const RobotModel& model, const DynamicsOptions& options,
           std::vector<std::string>&& notes);  // empty

  static void refuse(const char* call, const char* what, const std::string& given,
                     const std::string& needed);

  static void check(const char* call, const char* what, std::ptrdiff_t given, int needed) {
    if (given != needed) refuse(call, what, std::to_string(given), std::to_string(needed));
  }
  static void check(const char* call, const char* what, const MatrixView<T>& X, int n) {
    if (!X.fits(n, n)) refuse(call, what, X.shape(), detail::shape(n, n));
  }
  void check(const char* call, const VectorView<const T>& q, const VectorView<const T>& qd,
             const char* name, const VectorView<const T>& tau_or_qdd, std::ptrdiff_t result,
             int needed) const {
    if (q.size() == nq_ && qd.size() == nv_ && tau_or_qdd.size() == nv_ && result == needed) return;
    check(call, "q", q.size(), nq_);
    check(call, "qd", qd.size(), nv_);
    check(call, name, tau_or_qdd.size(), nv_);
    check(call, "the result", result, needed);
  }
  void check(const char* call, std::ptrdiff_t count, const RowsView<const T>& q,
             const RowsView<const T>& qd, const char* name, const RowsView<const T>& tau_or_qdd,
             const RowsView<T>& result, int needed) const {
    check(call, "q", count, q, nq_);
    check(call, "qd", count, qd, nv_);
    check(call, name, count, tau_or_qdd, nv_);
    check(call, "the result", count, RowsView<const T>(result), needed);
  }
  static void check(const char* call, const char* what, std::ptrdiff_t count,
                    const RowsView<const T>& rows, std::ptrdiff_t width) {
    if (!rows.fits(count, width)) refuse(call, what, rows.shape(), detail::shape(count, width));
  }
  // m of B (asked x m); X has as many columns for each of the rows.
  int checked_columns(const char* call, const char* name, const MatrixView<const T>& B,
                      const char* result, const MatrixView<T>& X, std::ptrdiff_t rows = 1) const;
  static void refuse_overlap(const char* call, const char* name, const T* B, std::ptrdiff_t of_B,
                             const char* result, const T* X, std::ptrdiff_t of_X);
  void check_derivatives(const Derivatives<T>& out) const;
  static void check_turning(bool act, Axes axes);
  // Where they stand, `size` a state; null where there are none.
  static const T* checked(const char* call, const char* what, const StateLoads<T>& given, int size,
                          std::ptrdiff_t) {
    if (!given) return nullptr;
    check(call, what, given->size(), size);
    return given->data();
  }
  static const T* checked(const char* call, const char* what, const LoadRows<T>& given, int size,
                          std::ptrdiff_t count) {
    if (!given) return nullptr;
    check(call, what, count, *given, size);
    return given->data();
  }
  template <class Given>
  const T* checked_loads(const char* call, const Given& loads, std::ptrdiff_t count = 1) const {
    return checked(call, "loads", loads, loads_, count);
  }
  void check_derivatives(std::ptrdiff_t count, const DerivativeRows<T>& out) const;

  Execution<T>& execution() const;  // throws std::logic_error where it was moved away

  // The torques of qdd, the last two null where they are zero.
  void torques(const T* q, const T* qd, const T* qdd, T* tau, const char* call,
               const StateForces<T>& forces) {
    (void)answer(acted(
        call, {.want = Want::inverse_dynamics, .q = q, .qd = qd, .tau = qdd, .out = tau}, forces));
  }
  // With what acts from outside.
  template <class Given>
  Call<T> acted(const char* call, Call<T> given, const Given& forces,
                std::ptrdiff_t count = 1) const {
    given.forces = checked(call, "forces", forces.on, forces_, count);
    given.loads = checked_loads(call, forces.loads, count);
    given.gravity = checked(call, "gravity", forces.gravity, numbers_of_gravity, count);
    given.axes = forces.axes;
    return given;
  }
  // With contacts; what is made of M alone does not see gravity.
  template <class Given>
  Call<T> resisted(const char* call, Call<T> given, const Given& contacts,
                   std::ptrdiff_t count = 1) const {
    given.contacts = checked(call, "contacts", contacts.on, contacts_, count);
    given.loads = checked_loads(call, contacts.loads, count);
    given.axes = contacts.axes;
    return given;
  }
  Outcome answer(const char* call, const Call<T>& given, const StateContacts<T>& contacts) {
    return answer(resisted(call, given, contacts));
  }
  int answer_rows(const char* call, std::ptrdiff_t count, const Call<T>& given,
                  const ContactRows<T>& contacts, Outcome* outcomes, int threads) {
    return answer_rows(count, resisted(call, given, contacts, count), outcomes, threads);
  }
  Outcome answer(const Call<T>& call);
  int answer_rows(std::ptrdiff_t count, const Call<T>& call, Outcome* outcomes, int threads);
  Outcome factor(const Call<T>& call);
  Outcome solve(int columns, const T* taus, T* X);

  int nq_ = 0, nv_ = 0, asked_ = 0, rows_ = 0, forces_ = 0, contacts_ = 0, loads_ = 0;
  double tolerance_ = default_tolerance<T>;
  std::unique_ptr<Execution<T>> execution_;
  std::vector<std::string> notes_;
};

// The instruction set that the kernels of this process were compiled for: "native", or
// "x86-64-v2", "-v3" or "-v4", the best that the processor has unless the environment variable
// KALMARM_INSTRUCTION_SET names a lower one.
KALMARM_EXPORT const char* instruction_set();

}  // namespace kalmarm
