// The covariances of the paper by recursion, O(N): of the state before and after the measurements,
// and of the co-state.
//
// Tips to base, with the sums over the children c of k, which stand for the body before:
//   r-(k) = M(k) + sum of phi(k,c) r+(c) phi'(k,c),   r+(k) = r-(k)          (3.5)
//   P-(k) = M(k) + sum of phi(k,c) P+(c) phi'(k,c)                           (3.6)
//   D(k)  = H(k) P-(k) H'(k) + r(k)                       (3.6), with joint noise
//   g(k)  = P-(k) H'(k) / D(k)                                               (3.10)
//   P+(k) = P-(k) - g(k) H(k) P-(k)                                          (3.6)
// The first r+ and P+ of a branch are zero: where (3.5) prints r-(k) = 0, r+(0) = 0 is meant.
//
// Base to tips, L for the paper's Lambda:
//   L+(k) = phi'(parent,k) L-(parent) phi(parent,k)                          (5.7)
//   L-(k) = (I - gH)' L+(k) (I - gH) + H'H / D                               (5.6)
// L+ of a joint at the base is zero.
//
// With all measurements used, the diagonal blocks of (2.5) and (2.11) follow link by link:
//   P(k)     = P-(k) - P-(k) L-(k) P-(k)                                     (2.5)
//   cov w(k) = M(k)  - M(k)  L-(k) M(k)                                      (2.11)
// since L- is the covariance of phi*H*a and X - E(X/T) is orthogonal to it.
//
// D(k) is called zero by the rule of factors.hpp: D(k) <= 32 u H S- H' with
//   S-(k) = M(k) + sum of phi S+(c) phi' + diagonal of |phi||P+(c)||phi'|
//   S+(k) = (I - gH) S- (I - gH)' + P-(k)
#pragma once

#include <vector>

#include "algorithms/study/estimation/process.hpp"
#include "kalmarm/outcome.hpp"

namespace kalmarm {

template <class T>
struct Covariances {
  std::vector<Matrix6<T>> r_minus;
  std::vector<Matrix6<T>> P_minus, P_plus;
  std::vector<T> D;
  std::vector<Vector6<T>> g;
  std::vector<Matrix6<T>> L_plus, L_minus;
  std::vector<Matrix6<T>> S;  // of the singularity test

  explicit Covariances(const Process<T>& process)
      : r_minus(process.size()),
        P_minus(process.size()),
        P_plus(process.size()),
        D(process.size()),
        g(process.size()),
        L_plus(process.size()),
        L_minus(process.size()),
        S(process.size()) {}
};

// I - g(k) H(k): across joint k with the loop closed, (3.9).
template <class T>
Matrix6<T> across_joint(const Process<T>& process, const Covariances<T>& cov, int k) {
  return Matrix6<T>::Identity() - cov.g[k] * process.H[k].transpose();
}

// r-, P-, P+, D and g of a process without flaw. On failure the outcome names the joint, and cov is
// not to be used. About 3500 flops a link.
template <class T>
Outcome set_state_covariances(const Process<T>& process, Covariances<T>& cov) {
  const T resolution = T(32) * unit_roundoff<T>();
  cov.r_minus = process.M;
  cov.P_minus = process.M;
  cov.S = process.M;
  for (int k = process.size() - 1; k >= 0; --k) {
    const Vector6<T>& H = process.H[k];
    const Matrix6<T>& P = cov.P_minus[k];
    const T D = H.dot(P * H) + process.r[k];  // (3.6)
    const T scale = H.dot(cov.S[k] * H) + process.r[k];
    if (!(D > resolution * scale)) {
      const bool lost = !(D >= -resolution * scale);
      return {.status = lost ? Outcome::Status::indefinite : Outcome::Status::singular,
              .joint = k,
              .D = static_cast<double>(D),
              .scale = static_cast<double>(scale)};
    }
    cov.D[k] = D;
    cov.g[k] = P * H / D;  // (3.10)
    const Vector6<T> HP = P.transpose() * H;
    cov.P_plus[k] = P - cov.g[k] * HP.transpose();  // (3.6)
    const int parent = process.parent[k];
    if (parent < 0) continue;
    const Matrix6<T>& phi = process.phi[k];
    const Matrix6<T> phi_abs = phi.cwiseAbs();
    const Matrix6<T> I_gH = across_joint(process, cov, k);
    const Matrix6<T> S_plus = I_gH * cov.S[k] * I_gH.transpose() + P;
    cov.r_minus[parent] += phi * cov.r_minus[k] * phi.transpose();  // (3.5)
    cov.P_minus[parent] += phi * cov.P_plus[k] * phi.transpose();   // (3.6)
    cov.S[parent] += phi * S_plus * phi.transpose();
    cov.S[parent].diagonal() +=
        (phi_abs * cov.P_plus[k].cwiseAbs() * phi_abs.transpose()).diagonal();
  }
  return {};
}

// L+ and L- of every joint, after set_state_covariances. About 1800 flops a link.
template <class T>
void set_co_state_covariances(const Process<T>& process, Covariances<T>& cov) {
  for (int k = 0; k < process.size(); ++k) {
    const int parent = process.parent[k];
    const Matrix6<T>& phi = process.phi[k];
    if (parent < 0)
      cov.L_plus[k].setZero();
    else
      cov.L_plus[k] = phi.transpose() * cov.L_minus[parent] * phi;  // (5.7)
    const Matrix6<T> I_gH = across_joint(process, cov, k);
    const Vector6<T>& H = process.H[k];
    cov.L_minus[k] =
        I_gH.transpose() * cov.L_plus[k] * I_gH + H * H.transpose() / cov.D[k];  // (5.6)
  }
}

// Diagonal block k of (2.5): covariance of x(k), given all measurements.
template <class T>
Matrix6<T> smoothed_state_covariance(const Covariances<T>& cov, int k) {
  return cov.P_minus[k] - cov.P_minus[k] * cov.L_minus[k] * cov.P_minus[k];
}

// Diagonal block k of (2.11): covariance of w(k), given all measurements.
template <class T>
Matrix6<T> smoothed_input_covariance(const Process<T>& process, const Covariances<T>& cov, int k) {
  return process.M[k] - process.M[k] * cov.L_minus[k] * process.M[k];
}

}  // namespace kalmarm
