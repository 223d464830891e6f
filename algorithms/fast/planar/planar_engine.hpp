// Planar mechanisms (plane.hpp) behind the interface of every solver: what moves in the plane by
// planar_filter.hpp, what slides along its normal by translational.hpp.
//
// A suspect, of which some D is small beside what it is summed from, is looked into, and answered,
// by Sequential<Conventional> on the same model (structured/dynamics.hpp).
#pragma once

#include <cassert>
#include <cmath>
#include <vector>

#include "algorithms/partial_solver.hpp"
#include "algorithms/planar/planar_columns.hpp"
#include "algorithms/planar/planar_selection.hpp"
#include "algorithms/structured/dynamics.hpp"

namespace kalmarm {

template <class T>
class PlanarSolver final : public PartialSolver<T> {
 public:
  // Of a model that find_plane finds a plane of.
  explicit PlanarSolver(const Model<T>& model) : PlanarSolver(model, *find_plane(model)) {}

  PlanarSolver(const Model<T>& model, const Plane<Lowering<T>>& plane)
      : plane_(plane),
        along_(model.template cast<Lowering<T>>(), plane),
        along_factors_(along_.slides, Vector3<W>(plane.axes * model.gravity().template cast<W>()),
                       W(SingularityTest<T, 1>::net())),
        model_(model, plane),
        ws_(model_),
        one_(model_),
        many_(model_),
        paths_(model_, model_.nv(), lanes),
        all_(model_.nv(), 1),
        covariances_(model_.slots()),
        in_plane_(model_.nv(), model_.nv()),
        fallback_(model, StructuredModel<T>(model)) {
    assert(static_cast<int>(plane.home.size()) == model.nv());
  }

  Outcome acceleration(const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau,
                       VectorX<T>& a) override {
    planar_acceleration(model_, q.data(), qd.data(), tau.data(), ws_, a.data());
    T check = ws_.check;
    along_factors_.solve([&](int i) { return tau[along_.dofs[i]]; },
                         [&](int i, const T& x) {
                           a[along_.dofs[i]] = x + along_factors_.by_weight()[i];
                           check += x * T(0);
                         });
    if (!suspects(check)) return {};
    return fallback_.acceleration(q.data(), qd.data(), tau.data(), a.data());
  }

  Outcome factor(const VectorX<T>& q) override {
    planar_factor(model_, q.data(), ws_);
    T check = T(0);
    for (const auto& at : ws_.links) check += at.inverse_D * T(0);
    by_fallback_ = suspects(check);
    return by_fallback_ ? fallback_.factor(q.data()) : Outcome{};
  }

  // About 26 flops a hinge.
  void solve(const VectorX<T>& tau, VectorX<T>& x) override {
    if (by_fallback_) return fallback_.solve(tau, x);
    const int last = model_.nv() - 1;
    detail::sweep_inward(
        model_, ws_, last, all_.data(), [&](int k) { return tau[model_.link(k).dof]; }, one_);
    detail::sweep_outward(model_, ws_, last, one_,
                          [&](int k, const T& a) { x[model_.link(k).dof] = a; });
    along_factors_.solve([&](int i) { return tau[along_.dofs[i]]; },
                         [&](int i, const T& a) { x[along_.dofs[i]] = a; });
  }

  Outcome inverse(const VectorX<T>& q, MatrixX<T>& X) override {
    planar_factor(model_, q.data(), ws_);
    T check = T(0);
    if (along_.dofs.empty()) {
      check = columns(X.data());
    } else {
      check = columns(in_plane_.data());
      X.setZero();
      for (int j = 0; j < model_.nv(); ++j)
        for (int i = 0; i < model_.nv(); ++i)
          X(model_.link(i).dof, model_.link(j).dof) = in_plane_(i, j);
      for (int j = 0; j < along_factors_.nv(); ++j)
        for (int i = 0; i < along_factors_.nv(); ++i)
          X(along_.dofs[i], along_.dofs[j]) = along_factors_.inverse()(i, j);
    }
    return suspects(check) ? fallback_.inverse(q.data(), X) : Outcome{};
  }

  Outcome diagonal(const VectorX<T>& q, VectorX<T>& x) override {
    const Outcome out = factor(q);
    if (!out) return out;
    if (by_fallback_) {
      fallback_.diagonal(x);
      return out;
    }
    planar_diagonal(model_, ws_, covariances_,
                    [&](int k, const T& alpha) { x[model_.link(k).dof] = alpha; });
    for (int i = 0; i < along_factors_.nv(); ++i)
      x[along_.dofs[i]] = along_factors_.inverse()(i, i);
    return out;
  }

  Outcome log_det(const VectorX<T>& q, T& x) override {
    using std::log;
    const Outcome out = factor(q);
    if (!out) return out;
    if (by_fallback_) {
      x = fallback_.log_det();
      return out;
    }
    x = along_factors_.log_det();
    for (const auto& at : ws_.links) x += log(at.D);
    return out;
  }

  void select(const Selection<T>& selection) override {
    selection_ = PlanarSelection<T>(model_, along_, along_factors_, plane_, selection);
    fallback_.select(selection);
  }

  Outcome selected(const VectorX<T>& q, MatrixX<T>& X) override {
    const Outcome out = factor(q);
    if (by_fallback_) return fallback_.selected(q.data(), X);
    selection_.fill(model_, ws_, X);
    return out;
  }

 private:
  using W = Lowering<T>;
  using Many = WidePack<T>;
  static constexpr int lanes = Lanes<Many>::count;

  bool suspects(const T& check) const {
    return fallback_.suspects_all() || along_factors_.suspect() || check != T(0) ||
           !(ws_.margin > T(0));
  }

  // M^-1 of the DoF in the plane, column-major. Zero, or NaN where a number is not finite.
  T columns(T* X) {
    const int nv = model_.nv();
    Many check = T(0);
    int i = 0;
    for_each_chunk(nv, lanes, [&](int first, int count) {
      const int last = first + count - 1;
      detail::sweep_inward(
          model_, ws_, last, paths_[i++],
          [&](int k) { return detail::Unit<Many>::lane(k - first); }, many_);
      detail::sweep_outward(model_, ws_, last, many_, [&](int k, const Many& a) {
        check += a * T(0);
        store_rows(a, first, k, nv, X);
      });
    });
    mirror(nv, X);
    T sum = T(0);
    for (int lane = 0; lane < lanes; ++lane) sum += check[lane];
    return sum;
  }

  Plane<W> plane_;
  AlongNormal<W> along_;
  TranslationalFactors<T> along_factors_;
  PlanarModel<T> model_;
  PlanarWorkspace<T> ws_;
  PlanarColumns<T> one_;
  PlanarColumns<Many> many_;
  ColumnPaths paths_;
  std::vector<char> all_;  // links: a path for any tau
  std::vector<detail::PlanarCovariance<T>> covariances_;
  MatrixX<T> in_plane_;
  PlanarSelection<T> selection_;
  bool by_fallback_ = false;  // the factors that are kept
  detail::Fallback<T, CovarianceForm> fallback_;
};

}  // namespace kalmarm
