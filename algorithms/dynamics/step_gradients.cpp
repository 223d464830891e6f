#include "kalmarm/step_gradients.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "algorithms/dynamics/gradient_rows.hpp"

namespace kalmarm {
namespace {

[[noreturn]] void refuse(const std::string& what) {
  throw std::invalid_argument("step gradients: " + what);
}

DynamicsOptions of_steps(DynamicsOptions options, const JointTerms& terms) {
  if (!terms.rows.empty()) refuse("of terms that couple joints");
  if (!are_on_links(options.question))
    refuse("a frame on the fixed base, where forces and loads do nothing");
  options.question.want = {Want::acceleration};
  options.question.frames.clear();
  options.question.contacts.clear();
  options.kernels = Kernels::loops;
  return options;
}

RobotModel weightless(RobotModel model) {
  model.gravity = {0, 0, 0};
  return model;
}

// In T, zero where none are given.
template <class T>
std::vector<T> held(const std::vector<double>& given, int nv) {
  std::vector<T> out(nv);
  std::ranges::transform(given, out.begin(), [](double x) { return static_cast<T>(x); });
  return out;
}

// Numbers of every DoF of a row: its own, or what all have.
template <class T>
const T* of_row(const RowsView<const T>& given, const std::vector<T>& own, std::ptrdiff_t row) {
  return given.data() ? given.data() + row * std::ssize(own) : own.data();
}

template <class T>
T* of_row(const std::optional<RowsView<T>>& out, std::ptrdiff_t row, std::ptrdiff_t width) {
  return out ? out->data() + row * width : nullptr;
}

template <class T>
RowsOfStepVectorJacobian<T> row(const StateStepVectorJacobian<T>& out) {
  return {row(out.dq),        row(out.dv),        row(out.dtau),     row(out.damping),
          row(out.stiffness), row(out.reference), row(out.inertias), row(out.armature),
          row(out.forces),    row(out.loads),     row(out.gravity),  row(out.result)};
}

}  // namespace

template <class T>
StepGradients<T>::StepGradients(const RobotModel& model, double h, const JointTerms& terms,
                                Scheme scheme, const DynamicsOptions& options)
    : nq_(model.nq),
      nv_(model.nv()),
      h_(static_cast<T>(h)),
      h_of_springs_(scheme == Scheme::springs_at_end ? h_ : T(0)),
      step_(model, h, terms, scheme, of_steps(options, terms)),
      still_(weightless(model), h, terms, scheme, of_steps(options, terms)),
      sweeps_(std::make_unique<GradientRows<T>>(model, options.question)) {
  damping_ = held<T>(terms.damping, nv_);  // checked by the steps
  stiffness_ = held<T>(terms.stiffness, nv_);
  reference_ = held<T>(terms.reference, nv_);
  for (const LinkParameters& link : model.links)
    q_index_.push_back(takes_spring(link) ? link.q_index : -1);
}

template <class T>
StepGradients<T>::~StepGradients() = default;
template <class T>
StepGradients<T>::StepGradients(StepGradients&&) noexcept = default;
template <class T>
StepGradients<T>& StepGradients<T>::operator=(StepGradients&&) noexcept = default;

template <class T>
GradientRows<T>& StepGradients<T>::sweeps() const {
  if (!sweeps_) throw std::logic_error("StepGradients: was moved from, and answers nothing");
  return *sweeps_;
}

template <class T>
void StepGradients<T>::check(const char* call, std::ptrdiff_t count,
                             const GainRows<T>& gains) const {
  for (const auto& [name, rows] : {std::pair{"damping", gains.damping},
                                   {"stiffness", gains.stiffness},
                                   {"reference", gains.reference},
                                   {"armature", gains.armature}})
    if (rows.data()) check_size(call, name, rows, count, nv_);
}

template <class T>
GainRows<T> StepGradients<T>::part(const GainRows<T>& gains, std::ptrdiff_t first,
                                   std::ptrdiff_t rows) const {
  const auto some = [&](const RowsView<const T>& x) {
    return x.data() ? part_of(x, first, rows, nv_) : x;
  };
  return {some(gains.damping), some(gains.stiffness), some(gains.reference), some(gains.armature)};
}

template <class T>
int StepGradients<T>::solve(RowsView<const T> q, RowsView<const T> w, RowsView<T> x,
                            std::span<Outcome> outcomes, int threads, GainRows<T> gains,
                            const LoadRows<T>& loads) {
  const auto rows = static_cast<std::ptrdiff_t>(outcomes.size());
  const auto size = static_cast<std::size_t>(rows * nv_);
  zeros_.resize(std::max(zeros_.size(), size));
  at_ease_.resize(std::max(at_ease_.size(), size));
  outcomes_.resize(std::max(outcomes_.size(), outcomes.size()));
  for (std::ptrdiff_t i = 0; i < rows; ++i)
    for (int k = 0; k < nv_; ++k) {
      const T at = q_index_[k] < 0 ? T(0) : q.data()[i * nq_ + q_index_[k]];
      at_ease_[i * nv_ + k] = std::isfinite(at) ? at : T(0);  // else the row fails by its q
    }
  gains.reference = {at_ease_.data(), rows, nv_};
  const std::span<Outcome> of_x = std::span(outcomes_).first(rows);
  static_cast<void>(  // counted below
      still_.acceleration(q, RowsView<const T>(zeros_.data(), rows, nv_), w, gains, x, of_x,
                          threads, {.loads = loads}));
  int failed = 0;
  for (std::ptrdiff_t i = 0; i < rows; ++i) {
    outcomes[i] = worse(outcomes[i], of_x[i]);
    failed += !outcomes[i];
  }
  return failed;
}

template <class T>
int StepGradients<T>::acceleration_vjp(RowsView<const T> q, RowsView<const T> v,
                                       RowsView<const T> tau, RowsView<const T> w,
                                       const RowsOfStepVectorJacobian<T>& out,
                                       std::span<Outcome> outcomes, int threads,
                                       const GainRows<T>& gains, const ForceRows<T>& forces) {
  constexpr const char* name = "acceleration_vjp";
  const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
  const Widths& width = sweeps().width();
  const auto sized = [&](const char* what, const std::optional<RowsView<T>>& rows,
                         std::ptrdiff_t numbers) {
    if (rows) check_size(name, what, *rows, count, numbers);
    return data_of(rows);
  };
  check_sizes<T>(name, count, {{"q", q, nq_}, {"v", v, nv_}, {"tau", tau, nv_}, {"w", w, nv_}});
  check(name, count, gains);
  sweeps().check(name, count, forces);
  sized("damping", out.damping, nv_);
  sized("stiffness", out.stiffness, nv_);
  sized("reference", out.reference, nv_);
  GradientCall<T> call{.q = q.data(),
                       .qd = v.data(),
                       .by = {.q = sized("dq", out.dq, nv_),
                              .qd = sized("dv", out.dv, nv_),
                              .inertias = sized("inertias", out.inertias, numbers_of_load * nv_),
                              .armature = sized("armature", out.armature, nv_),
                              .forces = sized("forces", out.forces, width.f),
                              .loads = sized("loads", out.loads, width.l),
                              .gravity = sized("gravity", out.gravity, numbers_of_gravity)}};
  act(call, forces);
  const auto solved = [&](std::ptrdiff_t first, std::ptrdiff_t rows, RowsView<T> a,
                          RowsView<T> lambda) {
    const auto some = [&](const RowsView<const T>& x, int numbers) {
      return part_of(x, first, rows, numbers);
    };
    const GainRows<T> of_rows = part(gains, first, rows);
    const ForceRows<T> acting = sweeps().part(forces, first, rows);
    const std::span<Outcome> of_a = outcomes.subspan(first, rows);
    static_cast<void>(  // counted with those of lambda
        step_.acceleration(some(q, nq_), some(v, nv_), some(tau, nv_), of_rows, a, of_a, threads,
                           acting));
    return solve(some(q, nq_), some(w, nv_), lambda, of_a, threads, of_rows, acting.loads);
  };
  // (2), and what (3) has beside the sweeps.
  const auto added = [&](std::ptrdiff_t first, std::ptrdiff_t rows, const T* a, const T* lambda) {
    for (std::ptrdiff_t row = first; row < first + rows; ++row, a += nv_, lambda += nv_) {
      const T* const b = of_row(gains.damping, damping_, row);
      const T* const stiffness = of_row(gains.stiffness, stiffness_, row);
      const T* const reference = of_row(gains.reference, reference_, row);
      T* const dq = of_row(out.dq, row, nv_);
      T* const dv = of_row(out.dv, row, nv_);
      T* const by_b = of_row(out.damping, row, nv_);
      T* const by_k = of_row(out.stiffness, row, nv_);
      T* const by_reference = of_row(out.reference, row, nv_);
      for (int i = 0; i < nv_; ++i) {
        const bool springs = q_index_[i] >= 0;
        const T v_i = v.data()[row * nv_ + i], k = springs ? stiffness[i] : T(0);
        if (dq) dq[i] -= k * lambda[i];
        if (dv) dv[i] -= (b[i] + h_of_springs_ * k) * lambda[i];
        if (by_b) by_b[i] = -lambda[i] * (v_i + h_ * a[i]);
        if (by_reference) by_reference[i] = k * lambda[i];
        if (by_k)
          by_k[i] = springs ? -lambda[i] * (q.data()[row * nq_ + q_index_[i]] - reference[i] +
                                            h_of_springs_ * (v_i + h_ * a[i]))
                            : T(0);
      }
    }
  };
  return sweeps().contract(count, call, sized("result", out.result, nv_),
                           sized("dtau", out.dtau, nv_), threads, solved, added);
}

template <class T>
int StepGradients<T>::acceleration_jvp(RowsView<const T> q, RowsView<const T> v,
                                       RowsView<const T> tau, RowsView<const T> dq,
                                       RowsView<const T> dv, RowsView<const T> dtau, RowsView<T> da,
                                       std::span<Outcome> outcomes, int threads,
                                       const GainRows<T>& gains, const GainRows<T>& along,
                                       const ForceRows<T>& forces) {
  constexpr const char* name = "acceleration_jvp";
  const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
  check_sizes<T>(name, count,
                 {{"q", q, nq_},
                  {"v", v, nv_},
                  {"tau", tau, nv_},
                  {"dq", dq, nv_},
                  {"dv", dv, nv_},
                  {"dtau", dtau, nv_},
                  {"da", da, nv_}});
  check(name, count, gains);
  check(name, count, along);
  sweeps().check(name, count, forces);
  GradientCall<T> call{.q = q.data(), .qd = v.data()};
  act(call, forces);
  call.dq = dq.data();
  call.dqd = dv.data();
  int failed = 0;
  const auto moved = [&](std::ptrdiff_t first, std::ptrdiff_t rows, RowsView<T> a) {
    static_cast<void>(  // counted with those of da
        step_.acceleration(part_of(q, first, rows, nq_), part_of(v, first, rows, nv_),
                           part_of(tau, first, rows, nv_), part(gains, first, rows), a,
                           outcomes.subspan(first, rows), threads,
                           sweeps().part(forces, first, rows)));
  };
  // (4), whose right side takes the place of dID.
  const auto used = [&](std::ptrdiff_t first, std::ptrdiff_t rows, const T* a, RowsView<T> dID) {
    T* side = dID.data();
    for (std::ptrdiff_t row = first; row < first + rows; ++row, a += nv_, side += nv_) {
      const T* const b = of_row(gains.damping, damping_, row);
      const T* const stiffness = of_row(gains.stiffness, stiffness_, row);
      const T* const reference = of_row(gains.reference, reference_, row);
      for (int i = 0; i < nv_; ++i) {
        const std::ptrdiff_t at = row * nv_ + i;
        const T v_after = v.data()[at] + h_ * a[i];
        T x = dtau.data()[at] - side[i] - b[i] * dv.data()[at];
        if (along.damping.data()) x -= along.damping.data()[at] * v_after;
        if (along.armature.data()) x -= along.armature.data()[at] * a[i];
        if (q_index_[i] >= 0) {
          const T moved_by = along.reference.data() ? along.reference.data()[at] : T(0);
          x -= stiffness[i] * (dq.data()[at] - moved_by + h_of_springs_ * dv.data()[at]);
          if (along.stiffness.data())
            x -= along.stiffness.data()[at] *
                 (q.data()[row * nq_ + q_index_[i]] - reference[i] + h_of_springs_ * v_after);
        }
        side[i] = x;
      }
    }
    failed += solve(part_of(q, first, rows, nq_), RowsView<const T>(dID.data(), rows, nv_),
                    part_of(da, first, rows, nv_), outcomes.subspan(first, rows), threads,
                    part(gains, first, rows), sweeps().part(forces.loads, first, rows));
  };
  sweeps().tangents(count, call, threads, moved, used);
  return failed;
}

template <class T>
Outcome StepGradients<T>::acceleration_vjp(VectorView<const T> q, VectorView<const T> v,
                                           VectorView<const T> tau, VectorView<const T> w,
                                           const StateStepVectorJacobian<T>& out,
                                           const StateForces<T>& forces) {
  Outcome one;
  static_cast<void>(  // `one` says it, here and below
      acceleration_vjp(row(q), row(v), row(tau), row(w), row(out), std::span(&one, 1), 1, {},
                       row(forces)));
  return one;
}

template <class T>
Outcome StepGradients<T>::acceleration_jvp(VectorView<const T> q, VectorView<const T> v,
                                           VectorView<const T> tau, VectorView<const T> dq,
                                           VectorView<const T> dv, VectorView<const T> dtau,
                                           VectorView<T> da, const StateForces<T>& forces) {
  Outcome one;
  static_cast<void>(acceleration_jvp(row(q), row(v), row(tau), row(dq), row(dv), row(dtau), row(da),
                                     std::span(&one, 1), 1, {}, {}, row(forces)));
  return one;
}

template class StepGradients<float>;
template class StepGradients<double>;

}  // namespace kalmarm
