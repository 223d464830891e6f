#include "accuracy/fits/friction_left.hpp"

#include <Eigen/QR>
#include <cmath>

#include "accuracy/fits/prediction.hpp"

namespace kalmarm {

FrictionLeft friction_left(const Mechanics<double>& robot, const Samples& samples) {
  constexpr double least_residual = 0.01, least_share = 0.5;
  FrictionLeft out;
  const int count = samples.count();
  const MatrixX<double> left = samples.tau - torques(robot, samples);
  const VectorX<double> sizes = row_sizes(samples.tau) * std::sqrt(static_cast<double>(count));
  for (int k = 0; k < robot.model.nv(); ++k) {
    const VectorX<double> e = left.row(k).transpose(), qd = samples.qd.row(k).transpose();
    MatrixX<double> friction(count, 2);
    friction << qd, qd.unaryExpr([](double v) { return coulomb_sign(v); });
    const VectorX<double> explained =
        friction * friction.completeOrthogonalDecomposition().solve(e);
    const bool looks_like_it = e.norm() > least_residual * sizes[k] &&
                               explained.squaredNorm() > least_share * e.squaredNorm();
    if (looks_like_it) (explained.dot(qd) > 0 ? out.missing : out.excessive).push_back(k);
  }
  return out;
}

}  // namespace kalmarm
