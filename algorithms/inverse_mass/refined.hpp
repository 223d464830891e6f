// Guarded iterative refinement of any variant, in its own precision. With the residual by Newton
// and Euler about centres of mass (inverse_dynamics.hpp) and M^ the mass matrix as factored,
//   d(i)   = M^^-1 (tau - ID(x(i)))
//   x(i+1) = x(i) + d(i)      if |d(0)| <= 0.1 |x(0)| and |d(i+1)| <= 0.3 |d(i)|
// A correction is kept only if the next one confirms it: where the factors are too wrong to help,
// or the residual is nothing but its own rounding, the result stays as it was. So one step costs
// two residuals and two solutions. The correction that was worked out for the result and not
// applied estimates its error: outcome.error = |d| / |x|, which sees all but the rounding that
// factors and residual have in common, that of phi.
#pragma once

#include <string>

#include "algorithms/model/inverse_dynamics.hpp"
#include "algorithms/outcome.hpp"

namespace kalmarm {

struct Refinement {
  int steps = 0;
  double error = 0;      // |d| / |x|
  bool widened = false;  // by factors of a wider precision (wide_refined.hpp)
};

// What a workspace has to say of its last acceleration, if it refines.
template <class Workspace>
void report_refinement(const Workspace& ws, Outcome& out) {
  if constexpr (requires { ws.refinement; }) {
    out.error = ws.refinement.error;
    out.steps = ws.refinement.steps;
    out.widened = ws.refinement.widened;
  }
}

template <class T>
struct RefinementWorkspace {
  InverseDynamics<T> newton_euler;
  VectorX<T> residual, d, next, before;

  explicit RefinementWorkspace(const Model<T>& model)
      : newton_euler(model),
        residual(model.nv()),
        d(model.nv()),
        next(model.nv()),
        before(model.nv()) {}
};

// correct(x, d) writes the correction that x calls for. At most `most` steps.
template <class T, class Correct>
Refinement refine(int most, int enough, const Correct& correct, RefinementWorkspace<T>& ws,
                  VectorX<T>& x) {
  const T size = x.norm();
  const auto relative = [&size](const T& d) {
    return size > T(0) || d > T(0) ? static_cast<double>(T(d / size)) : 0.0;
  };
  correct(x, ws.d);
  T d = ws.d.norm();
  if (!(d <= T(0.1) * size)) return {0, relative(d)};
  for (int step = 0; step < most; ++step) {
    if (d <= T(enough) * unit_roundoff<T>() * size) return {step, relative(d)};
    ws.before = x;
    x += ws.d;
    correct(x, ws.next);
    const T next = ws.next.norm();
    if (!(next <= T(0.3) * d)) {
      x = ws.before;
      return {step, relative(d)};
    }
    ws.d = ws.next;
    d = next;
  }
  return {most, relative(d)};
}

// d = M^^-1 residual by solve(rhs, x) in a narrower scalar N. The residual is scaled to 1, where N
// has its full range.
template <class R, class N, class D, class Solve>
void solve_scaled(const VectorX<R>& residual, const Solve& solve, VectorX<N>& rhs, VectorX<N>& x,
                  VectorX<D>& d) {
  const R size = residual.cwiseAbs().maxCoeff();
  if (size == R(0)) {
    d.setZero();
    return;
  }
  rhs = (residual / size).template cast<N>();
  solve(rhs, x);
  d = (size * x.template cast<R>()).template cast<D>();
}

// M^-1 (nv x nv) column by column from solve(unit, x): the mean of both triangles.
template <class T, class Solve>
void inverse_by_solving(const Solve& solve, VectorX<T>& unit, VectorX<T>& x, MatrixX<T>& X) {
  for (int j = 0; j < X.cols(); ++j) {
    unit.setZero();
    unit[j] = T(1);
    solve(unit, x);
    X.col(j) = x;
  }
  for (int j = 0; j < X.cols(); ++j)
    for (int i = 0; i < j; ++i) X(i, j) = X(j, i) = (X(i, j) + X(j, i)) / T(2);
}

template <class V>
struct Refined {
  static std::string name() { return "Refined<" + V::name() + ">"; }
  static constexpr const char* equation = "guarded refinement, residual by Newton and Euler";
  template <class T>
  static constexpr bool supports = V::template supports<T>;
  static constexpr int most = 1, enough = 4;

  template <class T>
  struct Workspace {
    typename V::template Workspace<T> inner;
    RefinementWorkspace<T> refinement_workspace;
    Refinement refinement;  // of the last acceleration
    VectorX<T> unit, x;

    explicit Workspace(const Model<T>& model)
        : inner(model), refinement_workspace(model), unit(model.nv()), x(model.nv()) {}
  };

  template <class T>
  static Outcome factor(const Model<T>& model, const RandomModel<T>& rm, Workspace<T>& ws) {
    return V::factor(model, rm, ws.inner);
  }

  // a (nv) from tau (nv), with the bias of rm, after factor.
  template <class T>
  static void acceleration(const Model<T>& model, const RandomModel<T>& rm, const VectorX<T>& tau,
                           Workspace<T>& ws, VectorX<T>& a) {
    V::acceleration(model, rm, tau, ws.inner, a);
    RefinementWorkspace<T>& w = ws.refinement_workspace;
    ws.refinement = refine<T>(
        most, enough,
        [&](const VectorX<T>& x, VectorX<T>& d) {
          inverse_dynamics(model, rm, x, w.newton_euler, Eigen::Ref<VectorX<T>>(w.residual));
          w.residual = tau - w.residual;
          V::solve(model, rm, w.residual, ws.inner, d);
        },
        w, a);
  }

  // x = M^-1 tau, after factor.
  template <class T>
  static void solve(const Model<T>& model, const RandomModel<T>& rm, const VectorX<T>& tau,
                    Workspace<T>& ws, VectorX<T>& x) {
    V::solve(model, rm, tau, ws.inner, x);
    RefinementWorkspace<T>& w = ws.refinement_workspace;
    refine<T>(
        most, enough,
        [&](const VectorX<T>& y, VectorX<T>& d) {
          mass_times(model, rm, y, w.newton_euler, Eigen::Ref<VectorX<T>>(w.residual));
          w.residual = tau - w.residual;
          V::solve(model, rm, w.residual, ws.inner, d);
        },
        w, x);
  }

  // M^-1 (nv x nv), both triangles, after factor: every column refined.
  template <class T>
  static void inverse(const Model<T>& model, const RandomModel<T>& rm, Workspace<T>& ws,
                      MatrixX<T>& X) {
    inverse_by_solving(
        [&](const VectorX<T>& unit, VectorX<T>& x) { solve(model, rm, unit, ws, x); }, ws.unit,
        ws.x, X);
  }
};

}  // namespace kalmarm
