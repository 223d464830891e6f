// Section 5 by recursion: the whole covariances of the state's estimation error and of the
// co-state, of which covariances.hpp has the diagonal blocks.
//
// psi(k-,m+) takes the state from joint m, after its measurement, to joint k before its own, for
// k inboard of m with the joints p, …, q between them:
//   psi(k-,m+) = phi(k,p) (I - g(p) H(p)) phi … (I - g(q) H(q)) phi(q,m)          Psi of (3.14)
// Blocks (k,m) and (m,k)* with k inboard of m:
//   E (X-Z)(X-Z)*:  psi(k-,m+) P+(m)                                              (5.2), corrected
//   E l+ l+*:       L+(k) (I - g(k) H(k)) psi(k-,m+)                              (5.5), corrected
// On different branches, errors have nothing in common, but co-states come from the deepest common
// joint c, if there is one:
//   E l+ l+*:       psi*(c-,k+) L-(c) psi(c-,m+)
// l-(p) before the measurement of joint p is independent of what e(p) adds, and l+(m) depends on
// the joints inboard of m alone. So column m of E l+ l+* is carried base to tips by
//   E l-(p) l+*(m) = L-(p) psi(p-,m+)                      for p inboard of m     (1)
//   E l-(p) l+*(m) = (I - g(p) H(p))' E l+(p) l+*(m)       for all other p        (2)
//   E l+(k) l+*(m) = phi'(p,k) E l-(p) l+*(m)              p the parent of k      (3)
#pragma once

#include <vector>

#include "algorithms/study/estimation/covariances.hpp"

namespace kalmarm {

// Cov (X - Z) with Z = z-, 6N x 6N, after set_state_covariances. O(N depth).
template <class T>
void state_error_covariance(const Process<T>& process, const Covariances<T>& cov, MatrixX<T>& out) {
  out.setZero(6 * process.size(), 6 * process.size());
  for (int m = 0; m < process.size(); ++m) {
    out.template block<6, 6>(6 * m, 6 * m) = cov.P_minus[m];
    Matrix6<T> psi_P = cov.P_plus[m];
    for (int k = m; process.parent[k] >= 0;) {
      psi_P = process.phi[k] * psi_P;
      k = process.parent[k];
      out.template block<6, 6>(6 * k, 6 * m) = psi_P;
      out.template block<6, 6>(6 * m, 6 * k) = psi_P.transpose();
      psi_P = across_joint(process, cov, k) * psi_P;
    }
  }
}

// Cov l+, 6N x 6N, after set_co_state_covariances. O(N^2).
template <class T>
void co_state_covariance(const Process<T>& process, const Covariances<T>& cov, MatrixX<T>& out) {
  const int n = process.size();
  out.resize(6 * n, 6 * n);
  std::vector<Matrix6<T>> l_minus(n);  // E l-(p) l+*(m)
  std::vector<bool> inboard(n);        // of m
  for (int m = 0; m < n; ++m) {
    inboard.assign(n, false);
    Matrix6<T> psi = Matrix6<T>::Identity();
    for (int p = m; process.parent[p] >= 0;) {
      psi = process.phi[p] * psi;
      p = process.parent[p];
      inboard[p] = true;
      l_minus[p] = cov.L_minus[p] * psi;  // (1)
      psi = across_joint(process, cov, p) * psi;
    }
    for (int k = 0; k < n; ++k) {
      const int p = process.parent[k];
      auto l_plus = out.template block<6, 6>(6 * k, 6 * m);
      if (p < 0)
        l_plus.setZero();
      else
        l_plus = process.phi[k].transpose() * l_minus[p];                                // (3)
      if (!inboard[k]) l_minus[k] = across_joint(process, cov, k).transpose() * l_plus;  // (2)
    }
  }
}

}  // namespace kalmarm
