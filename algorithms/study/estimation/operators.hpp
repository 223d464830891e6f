// The paper's composite operators as they are written: dense, O(N^3). To be read and checked, for
// mechanisms of up to `largest_dense` joints; the recursions (covariances.hpp, filter_smoother.hpp)
// do the same in O(N).
//
//   phi(k,m) = phi(k,c) ... phi(.,m) for m outboard of k, phi(k,k) = 1       (1.7)
//   Phi = phi - I,  Q = diag M(k),  H = diag H(k),  b = col b(k)             (1.5), (1.6), 3.1
//   R = phi Q phi*,  M = H R H* + diag r(k)                                  (2.2), (2.8)
//
// Closed loop, from g, D and P-, P+ of the Riccati equation:
//   psi(k-,m+) = phi(k,c) (I - g(c)H(c)) phi(c,.) ... phi(.,m)               (3.9)
//   Psi = [psi(k-,m+)], m outboard of k, zero on the diagonal                (3.11)
//   K = H Phi P- H* D^-1 = H Phi g                                           (3.8)
//   L = H Psi P- H* D^-1 = H Psi g                                           (3.14)
// The paper writes one Psi. The one that (3.11) to (3.14), (4.3) and (4.8) need is this one, from
// the + side of joint m to the - side of joint k.
//
// Blocks of joints on different branches are zero. 6N x 6N unless stated.
#pragma once

#include <cassert>
#include <vector>

#include "algorithms/study/estimation/covariances.hpp"

namespace kalmarm {

inline constexpr int largest_dense = 60;

// diag(A(1) ... A(N)) of equal blocks.
template <class T, class Block>
MatrixX<T> block_diagonal(const std::vector<Block>& blocks) {
  const auto n = static_cast<Eigen::Index>(blocks.size());
  constexpr int rows = Block::RowsAtCompileTime, cols = Block::ColsAtCompileTime;
  MatrixX<T> out = MatrixX<T>::Zero(rows * n, cols * n);
  for (Eigen::Index k = 0; k < n; ++k)
    out.template block<rows, cols>(rows * k, cols * k) = blocks[k];
  return out;
}

template <class T>
struct Operators {
  MatrixX<T> phi, Phi, Q;
  MatrixX<T> H;  // N x 6N
  VectorX<T> b;  // 6N
  VectorX<T> r;  // N, joint noise
  MatrixX<T> R;
  MatrixX<T> M;  // N x N

  explicit Operators(const Process<T>& process) {
    const int n = process.size();
    assert(n <= largest_dense);
    phi = MatrixX<T>::Identity(6 * n, 6 * n);
    for (int m = 0; m < n; ++m)
      for (int c = m, k = process.parent[m]; k >= 0; c = k, k = process.parent[k])
        phi.template block<6, 6>(6 * k, 6 * m) =
            process.phi[c] * phi.template block<6, 6>(6 * c, 6 * m);  // (1.7)
    Phi = phi - MatrixX<T>::Identity(6 * n, 6 * n);
    Q = block_diagonal<T>(process.M);
    H = block_diagonal<T>(process.H).transpose();
    b.resize(6 * n);
    r.resize(n);
    for (int k = 0; k < n; ++k) {
      b.template segment<6>(6 * k) = process.b[k];
      r[k] = process.r[k];
    }
    R = phi * Q * phi.transpose();  // (2.2)
    M = H * R * H.transpose();      // (2.8)
    M.diagonal() += r;
  }
};

template <class T>
struct ClosedLoop {
  MatrixX<T> P_minus, P_plus, L_plus, L_minus;  // diag P-(k), P+(k), Lambda+(k), Lambda-(k)
  MatrixX<T> g;                                 // 6N x N, diag g(k)
  VectorX<T> D;                                 // N
  MatrixX<T> I_gH;                              // I - gH
  MatrixX<T> Psi;
  MatrixX<T> K, L;  // N x N

  ClosedLoop(const Process<T>& process, const Operators<T>& op, const Covariances<T>& cov)
      : P_minus(block_diagonal<T>(cov.P_minus)),
        P_plus(block_diagonal<T>(cov.P_plus)),
        L_plus(block_diagonal<T>(cov.L_plus)),
        L_minus(block_diagonal<T>(cov.L_minus)),
        g(block_diagonal<T>(cov.g)),
        D(Eigen::Map<const VectorX<T>>(cov.D.data(), process.size())) {
    const int n = process.size();
    I_gH = MatrixX<T>::Identity(6 * n, 6 * n) - g * op.H;
    Psi = MatrixX<T>::Zero(6 * n, 6 * n);
    for (int m = 0; m < n; ++m) {
      Matrix6<T> psi = Matrix6<T>::Identity();  // psi(c+,m+)
      for (int c = m, k = process.parent[m]; k >= 0; c = k, k = process.parent[k]) {
        psi = process.phi[c] * psi;
        Psi.template block<6, 6>(6 * k, 6 * m) = psi;  // (3.11)
        psi = across_joint(process, cov, k) * psi;     // (3.9)
      }
    }
    K = op.H * op.Phi * g;  // (3.8)
    L = op.H * Psi * g;     // (3.14)
  }
};

}  // namespace kalmarm
