// Checks derivatives of forward dynamics by differences of it along random directions: an error
// anywhere in a matrix shows in its product with a random vector.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>

#include "algorithms/model/model.hpp"
#include "algorithms/study/solver.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm {

// q moved by h along the velocity of DoF k: that of a ball turns about the body's axes.
template <class T>
void move(const Model<T>& model, int k, const T& h, VectorX<T>& q) {
  int first = k;
  while (model.joint(first).coordinate == Coordinate::follower) --first;
  const int i = model.joint(first).q_index;
  if (model.joint(first).coordinate != Coordinate::quaternion) {
    q[i + k - first] += h;
    return;
  }
  Eigen::Quaternion<T> turn(std::cos(h / 2), T(0), T(0), T(0));
  turn.vec()[k - first] = std::sin(h / 2);
  const Eigen::Quaternion<T> turned =
      Eigen::Quaternion<T>(q[i], q[i + 1], q[i + 2], q[i + 3]) * turn;
  q.template segment<4>(i) << turned.w(), turned.x(), turned.y(), turned.z();
}

// The worst relative error of dq d, dqd d, dtau d over random d, against fourth-order central
// differences; NaN where the solver fails.
inline double derivative_error(const Model<double>& model, Solver<double>& solver,
                               const State& state, const MatrixX<double>& dq,
                               const MatrixX<double>& dqd, const MatrixX<double>& dtau) {
  constexpr double h = 1e-4;
  const int nv = model.nv();
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  double worst = 0;
  for (const MatrixX<double>* J : {&dq, &dqd, &dtau}) {
    VectorX<double> d(nv);
    for (double& x : d) x = normal(random);
    // The curve q(h) = turns one after the other is smooth with the right tangent at h = 0, which
    // is all that a fourth-order difference along it needs.
    VectorX<double> slope = VectorX<double>::Zero(nv), a(nv);
    for (const double step : {-2.0, -1.0, 1.0, 2.0}) {
      State moved = state;
      if (J == &dq)
        for (int k = 0; k < nv; ++k) move(model, k, step * h * d[k], moved.q);
      if (J == &dqd) moved.qd += step * h * d;
      if (J == &dtau) moved.tau += step * h * d;
      if (!solver.acceleration(moved.q, moved.qd, moved.tau, a)) return std::nan("");
      slope += (std::abs(step) == 1 ? 8 : -1) * (step > 0 ? 1 : -1) * a / (12 * h);
    }
    const double error = (*J * d - slope).norm() / slope.norm();
    if (!(error <= worst)) worst = error;  // NaN stays
  }
  return worst;
}

// Of derivative_error where the derivatives are right to `error`: differences are good to 1e-6 on
// long chains.
inline double derivative_bound(double error) { return std::max(1e-6, error); }

}  // namespace kalmarm
