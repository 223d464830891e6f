// Rates of turning of an orientation q = u / |u|, in the body's own axes, from four numbers
// u = (w, v) and their derivatives; u need not have unit length:
//   omega = 2 Im(u* u') / |u|^2,   omega' = 2 Im(u* u'') / |u|^2 - 2 omega (u.u') / |u|^2
//   Im(u* d) = w d_v - d_w v - v x d_v
#pragma once

#include "algorithms/model/model.hpp"

namespace kalmarm {

struct QuaternionRates {
  Vector3<double> omega, omega_dot;
};

inline QuaternionRates quaternion_rates(const Eigen::Vector4d& u, const Eigen::Vector4d& ud,
                                        const Eigen::Vector4d& udd) {
  const double w = u[0], n = u.squaredNorm();
  const Vector3<double> v = u.tail<3>();
  const auto imaginary = [&](const Eigen::Vector4d& d) {
    const Vector3<double> d_v = d.tail<3>();
    return Vector3<double>(w * d_v - d[0] * v - v.cross(d_v));
  };
  const Vector3<double> omega = 2 / n * imaginary(ud);
  return {omega, 2 / n * imaginary(udd) - 2 / n * u.dot(ud) * omega};
}

}  // namespace kalmarm
