// Conditional means and their covariances from all measurements at once: section 2 as it is
// written, in dense operators, O(N^3). filter_smoother.hpp and covariances.hpp do the same by
// recursion.
//
//   G      = R H* M^-1,  M = H R H* + diag r                                 (2.2)
//   E(X/T) = phi b + G (T - H phi b)                                         (2.1)
//   P      = (I - GH) R (I - GH)* + G r G*                (2.5), with joint noise
//   a      = M^-1 (T - H phi b)                                              (2.8)
//   lambda = phi* H* a                                                       (2.9)
//   E(W/T) = b + Q phi* H* M^-1 (T - H phi b) = b + Q lambda          (2.7), (2.10)
//   cov W  = Q - Q phi* H* M^-1 H phi Q                                      (2.11)
// Without joint noise H P = 0: the estimate meets every measurement.
#pragma once

#include <Eigen/Cholesky>

#include "algorithms/study/estimation/operators.hpp"

namespace kalmarm {

template <class T>
struct BatchEstimate {
  MatrixX<T> G;          // 6N x N
  MatrixX<T> P;          // 6N x 6N
  MatrixX<T> W_cov;      // 6N x 6N
  VectorX<T> a;          // N
  VectorX<T> lambda;     // 6N
  VectorX<T> X_mean;     // 6N
  VectorX<T> W_mean;     // 6N
  VectorX<T> T_centred;  // N, T - H phi b

  // From T = tau (N).
  BatchEstimate(const Operators<T>& op, const VectorX<T>& tau) {
    const Eigen::LLT<MatrixX<T>> M(op.M);
    const MatrixX<T> HR = op.H * op.R, HphiQ = op.H * op.phi * op.Q;
    G = M.solve(HR).transpose();  // (2.2)
    const VectorX<T> phi_b = op.phi * op.b;
    T_centred = tau - op.H * phi_b;
    X_mean = phi_b + G * T_centred;  // (2.1)
    const MatrixX<T> I_GH = MatrixX<T>::Identity(op.R.rows(), op.R.cols()) - G * op.H;
    P = I_GH * op.R * I_GH.transpose() + G * op.r.asDiagonal() * G.transpose();  // (2.5)
    a = M.solve(T_centred);                                                      // (2.8)
    lambda = op.phi.transpose() * (op.H.transpose() * a);                        // (2.9)
    W_mean = op.b + op.Q * lambda;                                               // (2.10)
    W_cov = op.Q - HphiQ.transpose() * M.solve(HphiQ);                           // (2.11)
  }
};

}  // namespace kalmarm
