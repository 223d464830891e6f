// Guarded iterative refinement of M x + bias = tau or of M x = tau. With M^ the mass matrix as
// factored and the residual r by Newton and Euler about centres of mass (inverse_dynamics.hpp),
//   d(i)   = M^^-1 r(x(i)),   r(x) = tau - ID(x)
//   x(i+1) = x(i) + d(i)      if |d(0)| <= 0.1 |x(0)| and |d(i+1)| <= 0.3 |d(i)|
// A correction is kept only if the next one confirms it: where the factors are too wrong to help,
// or the residual is nothing but its own rounding, the result stays as it was. So one step costs
// two residuals and two solutions. The correction that was worked out for the result and not
// applied estimates its error: |d| / |x|.
#pragma once

#include "algorithms/model/inverse_dynamics.hpp"

namespace kalmarm {

struct Refinement {
  int steps = 0;
  double error = 0;      // |d| / |x|
  bool widened = false;  // by factors of a wider precision (wide_refined.hpp)
};

template <class T>
struct RefinementWorkspace {
  VectorX<T> d, next, before;

  explicit RefinementWorkspace(const Model<T>& model)
      : d(model.nv()), next(model.nv()), before(model.nv()) {}
};

// correct(x, d) writes the correction that x calls for. At most `most` steps, none once |d| is
// `enough` units of rounding.
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

// The equations that are refined: how a variant V solves them, and the torque that x takes.
struct EquationOfMotion {  // M x + bias = tau
  static constexpr bool linear = false;

  template <class V, class T, class Workspace>
  static void solve(const Model<T>& model, const LinkKinematics<T>& kin, const VectorX<T>& tau,
                    Workspace& ws, VectorX<T>& x) {
    V::acceleration(model, kin, tau, ws, x);
  }

  template <class T>
  static void torque(const Model<T>& model, const LinkKinematics<T>& kin, const VectorX<T>& x,
                     InverseDynamics<T>& ws, Eigen::Ref<VectorX<T>> tau) {
    inverse_dynamics(model, kin, x, ws, tau);
  }
};

struct MassEquation {  // M x = tau
  static constexpr bool linear = true;

  template <class V, class T, class Workspace>
  static void solve(const Model<T>& model, const LinkKinematics<T>& kin, const VectorX<T>& tau,
                    Workspace& ws, VectorX<T>& x) {
    V::solve(model, kin, tau, ws, x);
  }

  template <class T>
  static void torque(const Model<T>& model, const LinkKinematics<T>& kin, const VectorX<T>& x,
                     InverseDynamics<T>& ws, Eigen::Ref<VectorX<T>> tau) {
    mass_times(model, kin, x, ws, tau);
  }
};

template <class T>
struct Residual {
  InverseDynamics<T> newton_euler;
  VectorX<T> r;

  explicit Residual(const Model<T>& model) : newton_euler(model), r(model.nv()) {}
};

// r = tau - ID(x), in the precision of all that it is given.
template <class Equation, class T>
void set_residual(const Model<T>& model, const LinkKinematics<T>& kin, const VectorX<T>& tau,
                  const VectorX<T>& x, Residual<T>& ws) {
  Equation::torque(model, kin, x, ws.newton_euler, Eigen::Ref<VectorX<T>>(ws.r));
  ws.r = tau - ws.r;
}

// d = M^^-1 r by solve(rhs, x) in another scalar N. The residual is scaled to 1, where N has its
// full range.
template <class R, class N, class D, class Solve>
void solve_scaled(const VectorX<R>& r, const Solve& solve, VectorX<N>& rhs, VectorX<N>& x,
                  VectorX<D>& d) {
  const R size = r.cwiseAbs().maxCoeff();
  if (size == R(0)) {
    d.setZero();
    return;
  }
  rhs = (r / size).template cast<N>();
  solve(rhs, x);
  d = (size * x.template cast<R>()).template cast<D>();
}

}  // namespace kalmarm
