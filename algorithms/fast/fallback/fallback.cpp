#include "algorithms/fast/fallback/fallback.hpp"

#include <algorithm>
#include <cmath>

#include "algorithms/inverse_mass/factored_bias.hpp"
#include "algorithms/inverse_mass/refinement/wide_refined.hpp"
#include "algorithms/inverse_mass/sequential.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/riccati/array.hpp"
#include "algorithms/riccati/conventional.hpp"

namespace kalmarm {
namespace {

template <class T, class V>
class FallbackBy final : public Fallback<T> {
 public:
  explicit FallbackBy(const RobotModel& robot)
      : model_(model_of(robot).cast<T>()),
        rm_(model_),
        ws_(model_),
        tau_(model_.nv()),
        a_(model_.nv()) {
    if constexpr (requires { ws_.factors; }) ws_.factors.test.look_always();
  }

  Outcome acceleration(const T* q, const T* qd, const T* tau, T* a) override {
    set_position(model_, q, rm_);
    set_velocity(model_, qd, rm_);  // V may factor the bias with M
    Outcome out = factor();
    if (!out) return out;
    std::copy_n(tau, model_.nv(), tau_.data());
    V::acceleration(model_, rm_, tau_, ws_, a_);
    report_refinement(ws_, out);
    std::copy_n(a_.data(), model_.nv(), a);
    return checked(a_, out);
  }

  Outcome factor(const T* q) override {
    set_position(model_, q, rm_);
    return factor();
  }

  Outcome inverse(const T* q, T* X) override {
    const Outcome out = factor(q);
    if (!out) return out;
    if (X_.size() == 0) X_.resize(model_.nv(), model_.nv());
    V::inverse(model_, rm_, ws_, X_);
    std::copy_n(X_.data(), X_.size(), X);
    return checked(X_, out);
  }

  Outcome diagonal(const T* q, T* x) override {
    const Outcome out = factor(q);
    if (!out) return out;
    kept_diagonal(x);
    return checked(Eigen::Map<const VectorX<T>>(x, model_.nv()), out);
  }

  Outcome log_det(const T* q, T& x) override {
    const Outcome out = factor(q);
    if (!out) return out;
    x = kept_log_det();
    return std::isfinite(x) ? out : Outcome{.status = Outcome::Status::not_finite};
  }

  void select(const Selection& selection) override {
    dofs_ = selection.dofs;
    sites_.clear();
    for (const Frame& frame : selection.frames) sites_.push_back(site_of(frame).cast<T>());
    J_.resize(6 * sites_.size(), model_.nv());
    B_.resize(model_.nv(), selection.size());
    x_.resize(model_.nv(), selection.size());
  }

  Outcome selected(const T* q, T* X) override {
    const Outcome out = factor(q);
    if (!out) return out;
    B_.setZero();
    for (int i = 0; i < static_cast<int>(dofs_.size()); ++i) B_(dofs_[i], i) = T(1);
    site_jacobian<T>(model_, rm_, sites_, J_);
    B_.rightCols(J_.rows()) = J_.transpose();
    solve(static_cast<int>(B_.cols()), B_.data(), x_.data());
    Eigen::Map<MatrixX<T>> result(X, B_.cols(), B_.cols());
    for (int j = 0; j < B_.cols(); ++j)
      for (int i = j; i < B_.cols(); ++i) result(i, j) = result(j, i) = B_.col(i).dot(x_.col(j));
    return checked(result, out);
  }

  void solve(int columns, const T* taus, T* X) override {
    const int nv = model_.nv();
    for (int j = 0; j < columns; ++j) {
      std::copy_n(taus + std::ptrdiff_t(j) * nv, nv, tau_.data());
      V::solve(model_, rm_, tau_, ws_, a_);
      std::copy_n(a_.data(), nv, X + std::ptrdiff_t(j) * nv);
    }
  }

  void kept_diagonal(T* x) override {
    for (int k = 0; k < model_.nv(); ++k) {
      tau_.setZero();
      tau_[k] = T(1);
      V::solve(model_, rm_, tau_, ws_, a_);
      x[k] = a_[k];
    }
  }

  T kept_log_det() const override {
    using std::log;
    T sum = T(0);
    for (const T& D : gains(ws_).D) sum += log(D);
    return sum;
  }

 private:
  template <class Result>
  static Outcome checked(const Result& result, const Outcome& out) {
    return result.allFinite() ? out : Outcome{.status = Outcome::Status::not_finite};
  }

  // D and g of a filter, or of the one that is refined.
  template <class Workspace>
  static const Gains<T>& gains(const Workspace& ws) {
    if constexpr (requires { ws.factors; })
      return ws.factors;
    else
      return ws.inner.factors;
  }

  Outcome factor() {
    Outcome out = V::factor(model_, rm_, ws_);
    out.suspect = static_cast<bool>(out);
    return out;
  }

  Model<T> model_;
  RandomModel<T> rm_;
  typename V::template Workspace<T> ws_;
  VectorX<T> tau_, a_;
  std::vector<int> dofs_;
  std::vector<Site<T>> sites_;
  MatrixX<T> J_, B_, x_, X_;
};

}  // namespace

template <class T>
std::unique_ptr<Fallback<T>> make_fallback(const RobotModel& robot, Form form) {
  if (form == Form::square_root)
    return std::make_unique<FallbackBy<T, WideRefined<FactoredBias<ArrayGivens>>>>(robot);
  return std::make_unique<FallbackBy<T, Sequential<Conventional>>>(robot);
}

template std::unique_ptr<Fallback<float>> make_fallback(const RobotModel&, Form);
template std::unique_ptr<Fallback<double>> make_fallback(const RobotModel&, Form);

}  // namespace kalmarm
