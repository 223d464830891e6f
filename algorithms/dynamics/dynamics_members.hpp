// The members of Dynamics<T>, for the files that instantiate it: dynamics.cpp for float and double,
// the study for multi-precision.
#pragma once

#include <functional>

#include "algorithms/dynamics/check_model.hpp"
#include "algorithms/dynamics/execution.hpp"
#include "algorithms/model/plain.hpp"
#include "kalmarm/dynamics.hpp"

namespace kalmarm {

template <class T>
Dynamics<T>::Dynamics(const RobotModel& model, const DynamicsOptions& options,
                      const MakeEngine<T>& make)
    : nq_(model.nq), nv_(model.nv()), tolerance_(options.tolerance.value_or(default_tolerance<T>)) {
  check_tolerance(tolerance_);
  check_model(model, std::is_same_v<T, float> ? std::numeric_limits<float>::max()
                                              : std::numeric_limits<double>::max());
  execution_ =
      std::make_unique<Execution<T>>(make_plan(model_of(model), options.question, options.rules),
                                     nq_, tolerance_, options.triangles, make);
  asked_ = static_cast<int>(execution_->width().n);
  rows_ = static_cast<int>(execution_->width().k);
  forces_ = static_cast<int>(execution_->width().f);
  contacts_ = static_cast<int>(execution_->width().c);
  loads_ = static_cast<int>(execution_->width().l);
}

template <class T>
Dynamics<T>::~Dynamics() = default;
template <class T>
Dynamics<T>::Dynamics(Dynamics&&) noexcept = default;
template <class T>
Dynamics<T>& Dynamics<T>::operator=(Dynamics&&) noexcept = default;

template <class T>
Execution<T>& Dynamics<T>::execution() const {
  if (!execution_) throw std::logic_error("Dynamics: was moved from, and answers nothing");
  return *execution_;
}

template <class T>
const Plan& Dynamics<T>::plan() const {
  return execution().plan();
}

template <class T>
void Dynamics<T>::refuse(const char* call, const char* what, const std::string& given,
                         const std::string& needed) {
  throw std::invalid_argument(std::string(call) + ": " + what + " has size " + given + ", " +
                              needed + " is needed");
}

template <class T>
int Dynamics<T>::checked_columns(const char* call, const char* name, const MatrixView<const T>& B,
                                 const char* result, const MatrixView<T>& X,
                                 std::ptrdiff_t rows) const {
  const std::ptrdiff_t columns = B.columns_of(asked_);
  if (!B.fits(asked_, columns) || B.is_row_major())
    refuse(call, name, B.shape(), std::to_string(asked_) + " x any, column-major,");
  if (!X.fits(asked_, rows * columns) || X.is_row_major())
    refuse(call, result, X.shape(), detail::shape(asked_, rows * columns) + ", column-major,");
  refuse_overlap(call, name, B.data(), columns * asked_, result, X.data(), rows * columns * asked_);
  return static_cast<int>(columns);
}

// What its sweep does not vouch for is solved again from B.
template <class T>
void Dynamics<T>::refuse_overlap(const char* call, const char* name, const T* B,
                                 std::ptrdiff_t of_B, const char* result, const T* X,
                                 std::ptrdiff_t of_X) {
  const std::less<const T*> before;
  if (of_X > 0 && before(X, B + of_B) && before(B, X + of_X))
    throw std::invalid_argument(std::string(call) + ": " + name + " and " + result + " overlap");
}

template <class T>
void Dynamics<T>::check_derivatives(std::ptrdiff_t count, const DerivativeRows<T>& out) const {
  const std::pair<const char*, const std::optional<RowsView<T>>*> all[] = {
      {"dq", &out.dq}, {"dqd", &out.dqd}, {"dtau", &out.dtau}};
  for (const auto& [name, rows] : all)
    if (*rows)
      check("derivatives", name, count, RowsView<const T>(**rows), std::ptrdiff_t(asked_) * asked_);
}

template <class T>
void Dynamics<T>::check_derivatives(const Derivatives<T>& out) const {
  const std::pair<const char*, const MatrixView<T>*> all[] = {
      {"dq", &out.dq}, {"dqd", &out.dqd}, {"dtau", &out.dtau}};
  for (const auto& [name, X] : all)
    if (*X && (!X->fits(asked_, asked_) || (X->is_row_major() && X != &out.dtau)))
      refuse("derivatives", name, X->shape(), detail::shape(asked_, asked_) + ", column-major,");
}

template <class T>
void Dynamics<T>::check_turning(bool act, Axes axes) {
  if (act && axes != Axes::local)
    throw std::invalid_argument(
        "derivatives: forces that do not turn with their frames: Axes::local is needed");
}

template <class T>
Outcome Dynamics<T>::answer(const Call<T>& call) {
  return execution().answer(call);
}
template <class T>
int Dynamics<T>::answer_rows(std::ptrdiff_t count, const Call<T>& call, Outcome* outcomes,
                             int threads) {
  return execution().answer_rows(static_cast<int>(count), call, outcomes, std::max(threads, 1));
}
template <class T>
Outcome Dynamics<T>::factor(const Call<T>& call) {
  return execution().factor(call);
}
template <class T>
Outcome Dynamics<T>::solve(int columns, const T* taus, T* X) {
  return execution().solve(columns, taus, X);
}

}  // namespace kalmarm
