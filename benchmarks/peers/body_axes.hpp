// Kalmarm's conventions against those of a library that takes a free joint's linear velocity, and
// the force that goes with it, in the body's axes. With R the body's rotation and T = R' on the
// linear part, 1 elsewhere, and the library's quantities marked by B:
//   vB = T v,  tauB = T tau,  a = T'(aB + c),  c = w x vB on the linear part             (1)
//   aB = T a - c,  tau = T' tauB, of inverse dynamics                                    (1')
//   M = T' MB T,  M^-1 = T' MB^-1 T                                                      (2)
// A step dt of the orientation turns T itself; with x~ the matrix of the cross product, on the
// linear rows and in the columns of dt
//   da/dq  = T'(AqB T + AvB vB~ + AtB tauB~ - (aB + c)~ + w~ vB~)                        (3)
//   da/dqd = T'(AvB T + dc),  dc = w~ R' on linear, -vB~ on angular columns              (4)
// The library may also number its DoF otherwise.
#pragma once

#include <Eigen/Dense>
#include <utility>
#include <vector>

#include "benchmarks/peers/peer.hpp"

namespace kalmarm {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;
using RowMajor = Eigen::Matrix<double, -1, -1, Eigen::RowMajor>;

inline Eigen::Quaterniond quaternion_at(const double* q) {
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
}

class BodyAxes {
 public:
  // DoF k is number order[k] of the library; no order: the same number.
  explicit BodyAxes(const Mechanism& mechanism, std::vector<int> order = {})
      : nv_(mechanism.nv), order_(std::move(order)) {
    for (int k = static_cast<int>(order_.size()); k < nv_; ++k) order_.push_back(k);
    for (const Mechanism::Joint& joint : mechanism.joints)
      if (joint.type == Mechanism::Type::free) free_.push_back({joint.q, joint.v});
  }

  // vB or tauB of the state q.  (1)
  Vector to_library(const double* q, const double* x) const {
    Vector y = Eigen::Map<const Vector>(x, nv_), out(nv_);
    for (const Free& at : free_)
      y.segment<3>(at.v) = quaternion_at(q + at.q + 3).conjugate() * linear(y, at);
    for (int k = 0; k < nv_; ++k) out[order_[k]] = y[k];
    return out;
  }

  // (1), qd in Kalmarm's conventions
  void acceleration(const double* q, const double* qd, const Vector& aB, double* a) const {
    Vector sum = in_order(aB);
    const Vector vB = T(q) * Eigen::Map<const Vector>(qd, nv_);
    for (const Free& at : free_) sum.segment<3>(at.v) += w(vB, at).cross(linear(vB, at));
    Eigen::Map<Vector>(a, nv_) = T(q).transpose() * sum;
  }

  // (1')
  Vector acceleration_to_library(const double* q, const double* qd, const double* a) const {
    const Vector vB = T(q) * Eigen::Map<const Vector>(qd, nv_);
    Vector y = T(q) * Eigen::Map<const Vector>(a, nv_), out(nv_);
    for (const Free& at : free_) y.segment<3>(at.v) -= w(vB, at).cross(linear(vB, at));
    for (int k = 0; k < nv_; ++k) out[order_[k]] = y[k];
    return out;
  }
  void torque(const double* q, const Vector& tauB, double* tau) const {
    Eigen::Map<Vector>(tau, nv_) = T(q).transpose() * in_order(tauB);
  }

  // (2)
  void matrix(const double* q, const Matrix& B, double* out) const {
    Eigen::Map<RowMajor>(out, nv_, nv_) = T(q).transpose() * in_order(B) * T(q);
  }

  // B T, of columns that take velocities to something in the base's axes
  void columns(const double* q, const Matrix& B, double* out) const {
    Matrix X(B.rows(), nv_);
    for (int k = 0; k < nv_; ++k) X.col(k) = B.col(order_[k]);
    Eigen::Map<RowMajor>(out, B.rows(), nv_) = X * T(q);
  }

  // (3), (4) and (2)
  void derivatives(const double* q, const double* qd, const double* tau, const Vector& aB,
                   const Matrix& AqB, const Matrix& AvB, const Matrix& AtB, double* dq, double* dqd,
                   double* dtau) const {
    const Matrix turn = T(q);
    const Vector vB = turn * Eigen::Map<const Vector>(qd, nv_);
    const Vector tauB = turn * Eigen::Map<const Vector>(tau, nv_);
    const Vector a = in_order(aB);
    Matrix v_turned = Matrix::Zero(nv_, nv_), tau_turned = v_turned, by_q = v_turned,
           by_v = v_turned;
    for (const Free& at : free_) {
      const auto block = [&](Matrix& x) { return x.block<3, 3>(at.v, at.v + 3); };
      const Eigen::Matrix3d wx = cross(w(vB, at)), vx = cross(linear(vB, at));
      block(v_turned) = vx;
      block(tau_turned) = cross(linear(tauB, at));
      block(by_q) = wx * vx - cross(linear(a, at) + wx * linear(vB, at));
      block(by_v) = -vx;
      by_v.block<3, 3>(at.v, at.v) = wx * turn.block<3, 3>(at.v, at.v);
    }
    const Matrix Av = in_order(AvB), At = in_order(AtB);
    Eigen::Map<RowMajor>(dq, nv_, nv_) =
        turn.transpose() * (in_order(AqB) * turn + Av * v_turned + At * tau_turned + by_q);
    Eigen::Map<RowMajor>(dqd, nv_, nv_) = turn.transpose() * (Av * turn + by_v);
    Eigen::Map<RowMajor>(dtau, nv_, nv_) = turn.transpose() * At * turn;
  }

 private:
  struct Free {
    int q, v;
  };

  static Eigen::Vector3d linear(const Vector& x, const Free& at) { return x.segment<3>(at.v); }
  static Eigen::Vector3d w(const Vector& x, const Free& at) { return x.segment<3>(at.v + 3); }
  static Eigen::Matrix3d cross(const Eigen::Vector3d& x) {
    Eigen::Matrix3d out;
    out << 0, -x[2], x[1], x[2], 0, -x[0], -x[1], x[0], 0;
    return out;
  }

  Matrix T(const double* q) const {
    Matrix out = Matrix::Identity(nv_, nv_);
    for (const Free& at : free_)
      out.block<3, 3>(at.v, at.v) = quaternion_at(q + at.q + 3).toRotationMatrix().transpose();
    return out;
  }
  Vector in_order(const Vector& x) const {
    Vector out(nv_);
    for (int k = 0; k < nv_; ++k) out[k] = x[order_[k]];
    return out;
  }
  Matrix in_order(const Matrix& x) const {
    Matrix out(nv_, nv_);
    for (int i = 0; i < nv_; ++i)
      for (int k = 0; k < nv_; ++k) out(i, k) = x(order_[i], order_[k]);
    return out;
  }

  int nv_;
  std::vector<int> order_;
  std::vector<Free> free_;
};

}  // namespace kalmarm
