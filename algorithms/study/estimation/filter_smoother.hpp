// Kalman filter and Bryson-Frazier smoother on a process: sections 2 and 4 by recursion, O(N).
//
// Filter, tips to base, with the sum over the children c of k:
//   z-(k) = sum of phi(k,c) z+(c) + b(k)                                     (4.4)
//   e-(k) = tau(k) - H(k) z-(k)                                              innovation
//   z+(k) = z-(k) + g(k) e-(k)                                               (4.5)
//   e+(k) = e-(k) / D(k)                                                     (4.6)
// In operators e- = (I - L)(T - H phi b): where b enters (4.4), (4.2) holds for T less its mean.
//
// Smoother, base to tips, with l for the paper's lambda:
//   l+(k) = phi'(parent,k) l-(parent)                                        (4.10)
//   a(k)  = e+(k) - g'(k) l+(k)                                              (4.9)
//   l-(k) = l+(k) + H'(k) a(k)                                               (4.11), corrected
// l+ of a joint at the base is zero. (4.11) prints e+ for a, which is (4.8) without its loop. The
// co-state of (4.8) and (4.9) is l+, that of (2.9) is l-.
//
// The conditional means of section 2, from the smoothed co-state:
//   E(w(k)/T) = b(k) + M(k) l-(k)                                            (2.10)
//   E(x(k)/T) = sum of phi(k,c) E(x(c)/T) + E(w(k)/T)                        (2.1), through (1.1)
#pragma once

#include <vector>

#include "algorithms/study/estimation/covariances.hpp"

namespace kalmarm {

template <class T>
struct FilterSmoother {
  std::vector<Vector6<T>> z_minus, z_plus;
  VectorX<T> e_minus, e_plus;
  std::vector<Vector6<T>> l_plus, l_minus;
  VectorX<T> a;
  std::vector<Vector6<T>> w_mean, x_mean;  // E(w/T), E(x/T)

  explicit FilterSmoother(const Process<T>& process)
      : z_minus(process.size()),
        z_plus(process.size()),
        e_minus(process.size()),
        e_plus(process.size()),
        l_plus(process.size()),
        l_minus(process.size()),
        a(process.size()),
        w_mean(process.size()),
        x_mean(process.size()) {}
};

// z, e- and e+ from tau (one value a joint), after set_state_covariances.
template <class T>
void filter(const Process<T>& process, const Covariances<T>& cov, const VectorX<T>& tau,
            FilterSmoother<T>& ws) {
  ws.z_minus = process.b;
  for (int k = process.size() - 1; k >= 0; --k) {
    ws.e_minus[k] = tau[k] - process.H[k].dot(ws.z_minus[k]);
    ws.z_plus[k] = ws.z_minus[k] + cov.g[k] * ws.e_minus[k];  // (4.5)
    ws.e_plus[k] = ws.e_minus[k] / cov.D[k];                  // (4.6)
    if (const int parent = process.parent[k]; parent >= 0)
      ws.z_minus[parent] += process.phi[k] * ws.z_plus[k];  // (4.4)
  }
}

// l and a, after filter.
template <class T>
void smooth(const Process<T>& process, const Covariances<T>& cov, FilterSmoother<T>& ws) {
  for (int k = 0; k < process.size(); ++k) {
    const int parent = process.parent[k];
    if (parent < 0)
      ws.l_plus[k].setZero();
    else
      ws.l_plus[k] = process.phi[k].transpose() * ws.l_minus[parent];  // (4.10)
    ws.a[k] = ws.e_plus[k] - cov.g[k].dot(ws.l_plus[k]);               // (4.9)
    ws.l_minus[k] = ws.l_plus[k] + process.H[k] * ws.a[k];             // (4.11), corrected
  }
}

// E(w/T) and E(x/T), after smooth.
template <class T>
void set_conditional_means(const Process<T>& process, FilterSmoother<T>& ws) {
  for (int k = 0; k < process.size(); ++k)
    ws.w_mean[k] = process.b[k] + process.M[k] * ws.l_minus[k];  // (2.10)
  ws.x_mean = ws.w_mean;
  for (int k = process.size() - 1; k >= 0; --k)
    if (const int parent = process.parent[k]; parent >= 0)
      ws.x_mean[parent] += process.phi[k] * ws.x_mean[k];  // (2.1)
}

}  // namespace kalmarm
