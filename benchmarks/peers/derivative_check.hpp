// Checks derivatives of forward dynamics by differences of it along random directions: an error
// anywhere in a matrix shows in its product with a random vector.
#pragma once

#include <cmath>
#include <random>
#include <string>

#include "algorithms/model/model.hpp"
#include "algorithms/solver.hpp"
#include "robots/scene.hpp"

namespace kalmarm {

// q moved by dt along the tangents of the DoF: a turn of a ball is about the body's axes.
inline void move(const Model<double>& model, const VectorX<double>& tangent, double dt,
                 VectorX<double>& q) {
  for (int k = 0; k < model.nv(); ++k) {
    const Joint<double>& joint = model.joint(k);
    const int at = joint.q_index;
    switch (joint.coordinate) {
      case Coordinate::angle:
      case Coordinate::distance:
        q[at] += dt * tangent[k];
        break;
      case Coordinate::position:
        q.segment<3>(at) += dt * tangent.segment<3>(k);
        break;
      case Coordinate::quaternion: {
        const Vector3<double> turn = dt * tangent.segment<3>(k);
        const double angle = turn.norm();
        const Eigen::Quaterniond before(q[at], q[at + 1], q[at + 2], q[at + 3]);
        const Eigen::Quaterniond after =
            before * Eigen::Quaterniond(Eigen::AngleAxisd(angle, turn / angle));
        q.segment<4>(at) << after.w(), after.x(), after.y(), after.z();
        break;
      }
      case Coordinate::follower:
        break;
    }
  }
}

// The worst relative error of dq d, dqd d, dtau d over random d, against fourth-order central
// differences; NaN where the solver fails. Good to about 1e-9.
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
    VectorX<double> slope = VectorX<double>::Zero(nv), a(nv);
    for (const double step : {-2.0, -1.0, 1.0, 2.0}) {
      State moved = state;
      if (J == &dq) move(model, d, step * h, moved.q);
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

}  // namespace kalmarm
