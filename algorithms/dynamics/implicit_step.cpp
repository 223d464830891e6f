#include "kalmarm/implicit_step.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>

#include "algorithms/dynamics/coupled_rows.hpp"
#include "algorithms/dynamics/displacement.hpp"
#include "algorithms/dynamics/gain_rows.hpp"
#include "algorithms/dynamics/rows.hpp"
#include "algorithms/model/short_text.hpp"
#include "algorithms/spatial/spatial.hpp"

namespace kalmarm {
namespace {

[[noreturn]] void refuse(const std::string& what) {
  throw std::invalid_argument("implicit step: " + what);
}

// nv numbers, or as many zeros; those that are not to be negative, or that T does not hold, are refused.
template <class T>
std::vector<double> numbers(const RobotModel& model, const char* what,
                            const std::vector<double>& given, double least) {
  const auto nv = static_cast<std::size_t>(model.nv());
  if (given.empty()) return std::vector<double>(nv, 0);
  if (given.size() != nv)
    refuse(std::string(what) + " of " + std::to_string(given.size()) + " DoF, needed " +
           std::to_string(nv));
  for (std::size_t k = 0; k < nv; ++k)
    if (!(given[k] >= least && given[k] <= static_cast<double>(std::numeric_limits<T>::max())))
      refuse("DoF '" + model.names[k] + "': " + what + " " + short_text("%g", given[k]));
  return given;
}

// In T, once they are checked, of so many rows.
template <class T>
std::vector<T> held(const RobotModel& model, const std::vector<double>& given, int rows) {
  std::vector<T> out;
  for (int row = 0; row < rows; ++row)
    for (int k = 0; k < model.nv(); ++k)
      out.push_back(given.empty() ? T(0) : static_cast<T>(given[k]));
  return out;
}

// Whether entry k of q is that of DoF k.
bool is_as_velocity(const RobotModel& model) {
  for (int k = 0; k < model.nv(); ++k)
    if (!takes_spring(model.links[k]) || model.links[k].q_index != k) return false;
  return true;
}

// With r of (2) in the place of armature.
RobotModel with_noise(RobotModel model, double h, const std::vector<double>& b,
                      const std::vector<double>& k) {
  for (int dof = 0; dof < model.nv(); ++dof) model.links[dof].armature += h * (b[dof] + h * k[dof]);
  return model;
}

template <class T>
void check_rows(const RobotModel& model, double h, const std::vector<CoupledRow>& rows) {
  const double most = static_cast<double>(std::numeric_limits<T>::max());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const CoupledRow& row = rows[i];
    const std::string name = "row " + std::to_string(i);
    if (row.jacobian.empty()) refuse(name + ": has no jacobian");
    numbers<T>(model, (name + ": jacobian").c_str(), row.jacobian, -most);
    for (int dof = 0; dof < model.nv(); ++dof)
      if (row.jacobian[dof] != 0 && !takes_spring(model.links[dof]))
        refuse(name + ": couples DoF '" + model.names[dof] + "' of a ball or a free joint");
    const auto need = [&](const char* what, double given, double least) {
      if (!(given >= least && given <= most))
        refuse(name + ": " + what + " " + short_text("%g", given));
    };
    need("armature", row.armature, 0);
    need("damping", row.damping, 0);
    need("stiffness", row.stiffness, 0);
    need("reference", row.reference, -most);
    if (row.imposed && h == 0) refuse(name + ": imposed in a step of h = 0");
  }
}

// What rows, and contacts, want beside what the question does.
DynamicsOptions with_solve(DynamicsOptions options, bool rows) {
  std::set<Want>& want = options.question.want;
  const bool stands = !options.question.contacts.empty();
  if (want.empty()) return options;
  if (rows || stands) want.insert(Want::solve);
  if (stands) want.insert(Want::inverse_dynamics);
  return options;
}

template <class T>
RobotModel checked(const RobotModel& model, double h, const JointTerms& terms, Scheme scheme,
                   const DynamicsOptions& options) {
  if (static_cast<int>(model.names.size()) != model.nv())
    refuse(std::to_string(model.names.size()) + " names for " + std::to_string(model.nv()) +
           " DoF");
  if (!(h >= 0 && std::isfinite(h))) refuse("h = " + short_text("%g", h));
  if (!options.question.dofs.empty() || !options.question.locked.empty())
    refuse("of a question that leaves joints out");
  if (options.question.at_rest) refuse("of a question at rest");
  const double any = -static_cast<double>(std::numeric_limits<T>::max());
  const auto b = numbers<T>(model, "damping", terms.damping, 0);
  auto k = numbers<T>(model, "stiffness", terms.stiffness, 0);
  numbers<T>(model, "reference", terms.reference, any);
  check_rows<T>(model, h, terms.rows);
  for (int dof = 0; dof < model.nv(); ++dof)
    if (k[dof] > 0 && !takes_spring(model.links[dof]))
      refuse("DoF '" + model.names[dof] + "': a spring about a ball or a free joint");
  if (scheme == Scheme::springs_at_start) std::ranges::fill(k, 0);
  return with_noise(model, h, b, k);
}

template <class T>
void move(const RobotModel& model, double h, VectorView<const T> a, VectorView<T> q,
          VectorView<T> v) {
  const int nv = model.nv();
  if (a.size() != nv || v.size() != nv || q.size() != model.nq)
    refuse("advance: q, v and a of " + std::to_string(q.size()) + ", " + std::to_string(v.size()) +
           " and " + std::to_string(a.size()) + ", needed " + std::to_string(model.nq) + " and " +
           std::to_string(nv));
  const T step = static_cast<T>(h);
  for (int k = 0; k < nv; ++k) v.data()[k] += step * a.data()[k];
  displace<T>(model, q.data(), v.data(), h, q.data());  // (3)
}

}  // namespace

void advance(const RobotModel& model, double h, VectorView<const double> a, VectorView<double> q,
             VectorView<double> v) {
  move<double>(model, h, a, q, v);
}
void advance(const RobotModel& model, double h, VectorView<const float> a, VectorView<float> q,
             VectorView<float> v) {
  move<float>(model, h, a, q, v);
}

template <class T>
ImplicitStep<T>::ImplicitStep(const RobotModel& model, double h, const JointTerms& terms,
                              Scheme scheme, const DynamicsOptions& options)
    : model_(model),
      h_(h),
      forces_(numbers_of_force * std::ssize(options.question.acted_on)),
      loads_(numbers_of_load * std::ssize(options.question.loaded)),
      contacts_(numbers_of_force * std::ssize(options.question.contacts)),
      dynamics_(checked<T>(model, h, terms, scheme, options),
                with_solve(options, !terms.rows.empty())),
      rows_of_terms_(is_as_velocity(model) ? repeated : 1),
      damping_(held<T>(model, terms.damping, rows_of_terms_)),
      stiffness_(held<T>(model, terms.stiffness, rows_of_terms_)),
      reference_(held<T>(model, terms.reference, rows_of_terms_)),
      h_of_springs_(scheme == Scheme::springs_at_end ? static_cast<T>(h) : T(0)),
      tau_(model.nv()) {
  const bool derived = options.question.wants(Want::derivatives);
  if (derived) X_.resize(static_cast<std::size_t>(model.nv()) * model.nv());
  if (!terms.rows.empty())
    coupled_ =
        std::make_unique<CoupledRows<T>>(model, terms.rows, h, static_cast<double>(h_of_springs_));
  const auto add = [&](std::vector<Springs>& springs, int k) {
    const int q = model.links[k].q_index;
    const bool next = !springs.empty() && springs.back().dof + springs.back().count == k &&
                      springs.back().q + springs.back().count == q;
    if (next)
      ++springs.back().count;
    else
      springs.push_back({k, q, 1});
  };
  for (int k = 0; k < model.nv(); ++k) {
    if (stiffness_[k] != T(0)) add(springs_, k);
    if (takes_spring(model.links[k])) add(all_springs_, k);
  }
  gains_ = std::make_unique<GainsOfRows<T>>(model, h, static_cast<double>(h_of_springs_),
                                            damping_.data(), stiffness_.data(), options);
}

template <class T>
ImplicitStep<T>::~ImplicitStep() = default;
template <class T>
ImplicitStep<T>::ImplicitStep(ImplicitStep&&) noexcept = default;
template <class T>
ImplicitStep<T>& ImplicitStep<T>::operator=(ImplicitStep&&) noexcept = default;

template <class T>
bool ImplicitStep<T>::solves_rows() const {
  return coupled_ && coupled_->solved() > 0;
}

template <class T>
void ImplicitStep<T>::require(const char* call, std::ptrdiff_t q, std::ptrdiff_t v,
                              std::ptrdiff_t tau) const {
  if (q == model_.nq && v == model_.nv() && tau == model_.nv()) return;
  refuse(std::string(call) + ": q, v and tau of " + std::to_string(q) + ", " + std::to_string(v) +
         " and " + std::to_string(tau) + ", needed " + std::to_string(model_.nq) + " and " +
         std::to_string(model_.nv()));
}

// tau^ of (2).
template <class T>
void ImplicitStep<T>::set_torque(std::ptrdiff_t rows, const T* q, const T* v, const T* tau,
                                 const Numbers& b, const Numbers& k, const Numbers& q0,
                                 const std::vector<Springs>& springs, T* out) const {
  using Given = Eigen::Map<const Eigen::Array<T, Eigen::Dynamic, 1>>;
  using Result = Eigen::Map<Eigen::Array<T, Eigen::Dynamic, 1>>;
  const std::ptrdiff_t nv = model_.nv(), nq = model_.nq, block = rows_of_terms_;
  for (std::ptrdiff_t first = 0; first < rows; first += block) {
    const std::ptrdiff_t n = std::min(block, rows - first) * nv, at = first * nv;
    const auto damped = Given(tau + at, n) - Given(b.from(at), n) * Given(v + at, n);
    const auto spring = [&](std::ptrdiff_t dof, std::ptrdiff_t in_q, std::ptrdiff_t count) {
      return Given(k.from(at) + dof, count) *
             ((Given(q + in_q, count) - Given(q0.from(at) + dof, count)) +
              h_of_springs_ * Given(v + at + dof, count));
    };
    if (block > 1) {
      Result(out + at, n) = damped - spring(0, at, n);
      continue;
    }
    Result(out + at, n) = damped;
    for (const auto& [dof, in_q, count] : springs)
      Result(out + at + dof, count) -= spring(dof, first * nq + in_q, count);
  }
  if (!coupled_) return;
  for (std::ptrdiff_t i = 0; i < rows; ++i)
    coupled_->add_known(q + i * nq, v + i * nv, out + i * nv);
}

template <class T>
Outcome ImplicitStep<T>::acceleration(VectorView<const T> q, VectorView<const T> v,
                                      VectorView<const T> tau, VectorView<T> a,
                                      const StateForces<T>& forces,
                                      const StateContacts<T>& contacts) {
  require("acceleration", q.size(), v.size(), tau.size());
  set_torque(1, q.data(), v.data(), tau.data(), tau_.data());
  if (contacts.on) return standing(q, v, a, forces, contacts);
  if (!solves_rows()) return dynamics_.forward_dynamics(q, v, VectorView<const T>(tau_), a, forces);
  is_kept_ = false;
  const Outcome outcome = dynamics_.forward_dynamics(q, v, VectorView<const T>(tau_), a,
                                                     coupled_->B(), coupled_->Y(), forces);
  return outcome ? coupled(outcome, q.data(), v.data(), coupled_->Y().data(), a.data()) : outcome;
}

// (6): a0 becomes a.
template <class T>
Outcome ImplicitStep<T>::coupled(Outcome of_a0, const T* q, const T* v, const T* Y, T* a) const {
  if (const Outcome of_rows = coupled_->factor(Y); !of_rows) return of_rows;
  const Eigen::Map<const VectorX<T>> numbers(a, model_.nv());
  const double before = static_cast<double>(numbers.norm());
  coupled_->couple(q, v, Y, a);
  const double after = static_cast<double>(numbers.norm());
  if (!std::isfinite(after)) return {.status = Outcome::Status::not_finite};
  if (before > after) of_a0.error *= before / after;
  return of_a0;
}

// By solves of rows, which leave factors that are kept alone: of the torques, and of the columns of B.
template <class T>
Outcome ImplicitStep<T>::standing(VectorView<const T> q, VectorView<const T> v, VectorView<T> a,
                                  const StateForces<T>& forces, const StateContacts<T>& contacts) {
  const std::ptrdiff_t nv = model_.nv(), m = solves_rows() ? coupled_->solved() : 0, rows = 1 + m;
  is_kept_ = false;
  known_.resize(rows * nv);
  dynamics_.bias(q, v, VectorView<T>(known_.data(), nv), forces);
  for (std::ptrdiff_t k = 0; k < nv; ++k) known_[k] = tau_[k] - known_[k];
  if (m > 0) std::copy_n(coupled_->B().data(), m * nv, known_.data() + nv);
  const auto repeated_in = [&](std::vector<T>& to, const T* from, std::ptrdiff_t size) {
    to.resize(rows * size);
    for (std::ptrdiff_t i = 0; i < rows; ++i) std::copy_n(from, size, to.data() + i * size);
    return RowsView<const T>(to.data(), rows, size);
  };
  ContactRows<T> of_rows{.axes = contacts.axes};
  of_rows.on = repeated_in(again_[1], contacts.on->data(), contacts.on->size());
  if (forces.loads)
    of_rows.loads = repeated_in(again_[2], forces.loads->data(), forces.loads->size());
  std::vector<T>& x = again_[3];
  x.resize(rows * nv);
  outcomes_.resize(rows);
  static_cast<void>(dynamics_.solve(repeated_in(again_[0], q.data(), q.size()),
                                    RowsView<const T>(known_.data(), rows, nv),
                                    RowsView<T>(x.data(), rows, nv), outcomes_, 1, of_rows));
  for (const Outcome& of_column : outcomes_)
    if (!of_column) return of_column;
  if (a.size() != nv) refuse("acceleration: a of " + std::to_string(a.size()));
  std::copy_n(x.data(), nv, a.data());
  return m > 0 ? coupled(outcomes_[0], q.data(), v.data(), x.data() + nv, a.data()) : outcomes_[0];
}

template <class T>
int ImplicitStep<T>::standing(RowsView<const T> q, RowsView<const T> v, RowsView<T> a,
                              std::span<Outcome> outcomes, int threads, const ForceRows<T>& forces,
                              const ContactRows<T>& contacts) {
  const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
  const std::ptrdiff_t nv = model_.nv(), nq = model_.nq;
  if (!contacts.on->fits(count, contacts_))
    refuse("acceleration: rows of contacts are " + contacts.on->shape() + ", needed " +
           detail::shape(count, contacts_));
  if (!a.fits(count, nv))
    refuse("acceleration: rows of the result are " + a.shape() + ", needed " +
           detail::shape(count, nv));
  if (!solves_rows()) {
    known_.resize(count * nv);
    zeros_.resize(std::max<std::size_t>(zeros_.size(), count * nv), T(0));
    dynamics_.inverse_dynamics(q, v, RowsView<const T>(zeros_.data(), count, nv),
                               RowsView<T>(known_.data(), count, nv), threads, forces);
    for (std::ptrdiff_t i = 0; i < count * nv; ++i) known_[i] = rows_[i] - known_[i];
    return dynamics_.solve(q, RowsView<const T>(known_.data(), count, nv), a, outcomes, threads,
                           {contacts.on, contacts.axes, forces.loads});
  }
  int failed = 0;
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    std::copy_n(rows_.data() + i * nv, nv, tau_.data());
    outcomes[i] = standing(
        VectorView<const T>(q.data() + i * nq, nq), VectorView<const T>(v.data() + i * nv, nv),
        VectorView<T>(a.data() + i * nv, nv), state_of(forces, i, forces_, loads_),
        {state_of(contacts.on, i, contacts_), contacts.axes});
    failed += !outcomes[i];
  }
  return failed;
}

template <class T>
int ImplicitStep<T>::acceleration(RowsView<const T> q, RowsView<const T> v, RowsView<const T> tau,
                                  RowsView<T> a, std::span<Outcome> outcomes, int threads,
                                  const ForceRows<T>& forces, const ContactRows<T>& contacts) {
  return acceleration(q, v, tau, GainRows<T>{}, a, outcomes, threads, forces, contacts);
}

template <class T>
int ImplicitStep<T>::acceleration(RowsView<const T> q, RowsView<const T> v, RowsView<const T> tau,
                                  const GainRows<T>& gains, RowsView<T> a,
                                  std::span<Outcome> outcomes, int threads,
                                  const ForceRows<T>& forces, const ContactRows<T>& contacts) {
  const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
  const std::ptrdiff_t nv = model_.nv(), nq = model_.nq;
  if (!q.fits(count, nq) || !v.fits(count, nv) || !tau.fits(count, nv))
    refuse("acceleration: rows of q, v and tau are " + q.shape() + ", " + v.shape() + " and " +
           tau.shape() + ", needed " + detail::shape(count, nq) + " and " +
           detail::shape(count, nv));
  if (forces.on && !forces.on->fits(count, forces_))
    refuse("acceleration: rows of forces are " + forces.on->shape() + ", needed " +
           detail::shape(count, forces_));
  if (forces.loads && !forces.loads->fits(count, loads_))
    refuse("acceleration: rows of loads are " + forces.loads->shape() + ", needed " +
           detail::shape(count, loads_));
  if (forces.gravity && !forces.gravity->fits(count, numbers_of_gravity))
    refuse("acceleration: rows of gravity are " + forces.gravity->shape() + ", needed " +
           detail::shape(count, numbers_of_gravity));
  const auto is_given = [&](const char* what, const RowsView<const T>& rows, bool positive) {
    if (!rows.data()) return false;
    if (!rows.fits(count, nv))
      refuse(std::string("acceleration: rows of ") + what + " are " + rows.shape() + ", needed " +
             detail::shape(count, nv));
    gains_->check(what, rows.data(), count, positive);
    return true;
  };
  const auto numbers_of = [&](const char* what, const RowsView<const T>& rows,
                              const std::vector<T>& own, bool positive) -> Numbers {
    if (is_given(what, rows, positive)) return {rows.data(), true};
    return {own.data(), false};
  };
  const Numbers b = numbers_of("damping", gains.damping, damping_, true);
  const Numbers k = numbers_of("stiffness", gains.stiffness, stiffness_, true);
  const Numbers q0 = numbers_of("reference", gains.reference, reference_, false);
  if (k.of_rows) gains_->check_springs(k.at, count);
  const bool has_armature = is_given("armature", gains.armature, true);
  const bool has_noise = b.of_rows || k.of_rows || has_armature;
  if (static_cast<std::ptrdiff_t>(rows_.size()) < count * nv) rows_.resize(count * nv);
  set_torque(count, q.data(), v.data(), tau.data(), b, k, q0, k.of_rows ? all_springs_ : springs_,
             rows_.data());
  if (contacts.on) {
    if (has_noise) refuse("acceleration: damping, stiffness or armature of rows beside contacts");
    return standing(q, v, a, outcomes, threads, forces, contacts);
  }
  if (has_noise) {
    if (coupled_)
      refuse(
          "acceleration: damping, stiffness or armature of rows beside terms that couple joints");
    if (!a.fits(count, nv))
      refuse("acceleration: rows of the result are " + a.shape() + ", needed " +
             detail::shape(count, nv));
    return gains_->acceleration(count,
                                {.want = Want::acceleration,
                                 .q = q.data(),
                                 .qd = v.data(),
                                 .tau = rows_.data(),
                                 .out = a.data(),
                                 .forces = data_of(forces.on),
                                 .loads = data_of(forces.loads),
                                 .gravity = data_of(forces.gravity),
                                 .axes = forces.axes},
                                gains, outcomes.data(), threads);
  }
  if (!solves_rows())
    return dynamics_.forward_dynamics(q, v, RowsView<const T>(rows_.data(), count, nv), a, outcomes,
                                      threads, forces);
  is_kept_ = false;
  const std::ptrdiff_t m = coupled_->solved(), size = nv * m;
  Y_.resize(std::max<std::size_t>(Y_.size(), std::min(count, rows_at_once) * size));
  int failed = 0;
  for (std::ptrdiff_t first = 0; first < count; first += rows_at_once) {
    const std::ptrdiff_t n = std::min(rows_at_once, count - first);
    const auto of = outcomes.subspan(first, n);
    // Those that failed are counted below.
    static_cast<void>(
        dynamics_.forward_dynamics(RowsView<const T>(q.data() + first * nq, n, nq),
                                   RowsView<const T>(v.data() + first * nv, n, nv),
                                   RowsView<const T>(rows_.data() + first * nv, n, nv),
                                   RowsView<T>(a.data() + first * nv, n, nv), coupled_->B(),
                                   MatrixView<T>(Y_.data(), nv, n * m), of, threads,
                                   part_of(forces, first, n, forces_, loads_)));
    for (std::ptrdiff_t i = 0; i < n; ++i) {
      const std::ptrdiff_t at = first + i;
      if (of[i])
        of[i] = coupled(of[i], q.data() + at * nq, v.data() + at * nv, Y_.data() + i * size,
                        a.data() + at * nv);
      failed += !of[i];
    }
  }
  return failed;
}

template <class T>
Outcome ImplicitStep<T>::step(VectorView<T> q, VectorView<T> v, VectorView<const T> tau,
                              VectorView<T> a, const StateForces<T>& forces,
                              const StateContacts<T>& contacts) {
  const Outcome outcome =
      acceleration(VectorView<const T>(q.data(), q.size()), VectorView<const T>(v.data(), v.size()),
                   tau, a, forces, contacts);
  if (outcome) advance(model_, h_, VectorView<const T>(a.data(), a.size()), q, v);
  return outcome;
}

template <class T>
Outcome ImplicitStep<T>::derivatives(VectorView<const T> q, VectorView<const T> v,
                                     VectorView<const T> tau, const Derivatives<T>& out,
                                     VectorView<T> a, const StateForces<T>& forces) {
  require("derivatives", q.size(), v.size(), tau.size());
  const int nv = model_.nv();
  Derivatives<T> all = out;
  if (!all.dtau) all.dtau = MatrixView<T>(X_.data(), nv, nv);  // (4) has X
  if (solves_rows()) {
    const Outcome of_a = acceleration(q, v, tau, a, forces);
    if (!of_a) return of_a;
    coupled_->take_forces(tau_.data());
  } else {
    set_torque(1, q.data(), v.data(), tau.data(), tau_.data());
  }
  const Outcome outcome = dynamics_.derivatives(q, v, VectorView<const T>(tau_), all, a, forces);
  if (!outcome) return outcome;
  const auto less = [&](const MatrixView<T>& by, int column, T c) {
    if (!by || c == T(0)) return;
    const T* const x = all.dtau.data() + static_cast<std::ptrdiff_t>(column) * nv;
    T* const to = by.data() + static_cast<std::ptrdiff_t>(column) * nv;
    for (int i = 0; i < nv; ++i) to[i] -= c * x[i];
  };
  for (int k = 0; k < nv; ++k) less(out.dqd, k, damping_[k]);
  for (int k = 0; k < nv; ++k) {
    less(out.dq, k, stiffness_[k]);
    less(out.dqd, k, h_of_springs_ * stiffness_[k]);
  }
  if (!coupled_) return outcome;
  using By = typename CoupledRows<T>::By;
  const auto derive = [&](By by, const MatrixView<T>& dx) {
    if (!dx) return;
    if (by != By::torque) coupled_->derive_known(by, all.dtau.data(), dx.data());
    if (solves_rows()) coupled_->derive(by, coupled_->Y().data(), dx.data());
  };
  derive(By::position, out.dq);
  derive(By::velocity, out.dqd);
  derive(By::torque, out.dtau);  // last: the others read X from it
  return outcome;
}

template <class T>
void ImplicitStep<T>::mass(VectorView<const T> q, MatrixView<T> M) {
  if (coupled_ && coupled_->is_imposed())
    throw std::logic_error("implicit step: mass: a row is imposed, and has no finite one");
  dynamics_.mass(q, M);
  if (coupled_) coupled_->add_mass(M.data());
}

template <class T>
Outcome ImplicitStep<T>::inverse_mass(VectorView<const T> q, MatrixView<T> X) {
  const Outcome outcome = dynamics_.inverse_mass(q, X);
  if (!outcome || !solves_rows()) return outcome;
  is_kept_ = false;
  coupled_->set_Y(X.data());
  if (const Outcome of_rows = coupled_->factor(coupled_->Y().data()); !of_rows) return of_rows;
  const std::ptrdiff_t nv = model_.nv();
  for (std::ptrdiff_t j = 0; j < nv; ++j)
    coupled_->project(coupled_->Y().data(), X.data() + j * nv);
  return outcome;
}

template <class T>
Outcome ImplicitStep<T>::factor(VectorView<const T> q) {
  if (!solves_rows()) return dynamics_.factor(q);
  factored_q_.assign(q.data(), q.data() + q.size());
  return keep_coupled();
}

template <class T>
Outcome ImplicitStep<T>::keep_coupled() {
  kept_ = factor_coupled(factored_q_.data());
  is_kept_ = true;
  return kept_;
}

// Factors of M^ without rows, Y by them, and C + G.
template <class T>
Outcome ImplicitStep<T>::factor_coupled(const T* q) {
  const Outcome of_D = dynamics_.factor(VectorView<const T>(q, model_.nq));
  if (!of_D) return of_D;
  const Outcome of_Y = dynamics_.solve(coupled_->B(), coupled_->Y());
  if (!of_Y) return of_Y;
  const Outcome of_rows = coupled_->factor(coupled_->Y().data());
  return of_rows ? of_Y : of_rows;
}

template <class T>
Outcome ImplicitStep<T>::solve(MatrixView<const T> tau, MatrixView<T> x) {
  if (!factored_q_.empty() && !is_kept_) static_cast<void>(keep_coupled());
  const Outcome outcome = dynamics_.solve(tau, x);
  if (!outcome || !solves_rows()) return outcome;
  const std::ptrdiff_t nv = model_.nv(), columns = tau.columns_of(nv);
  if (!kept_)
    std::fill_n(x.data(), nv * columns, std::numeric_limits<T>::quiet_NaN());
  else
    for (std::ptrdiff_t j = 0; j < columns; ++j)
      coupled_->project(coupled_->Y().data(), x.data() + j * nv);
  return kept_ ? outcome : kept_;
}

template class ImplicitStep<float>;
template class ImplicitStep<double>;

}  // namespace kalmarm
