// The random model simulated: from standard normal numbers to the quantities whose covariances are
// the matrices of section 5.
//
// xi(k), six numbers a link, and eta(k), one number a joint with r(k) > 0, are independent N(0,1):
//   w(k)   = W(k) xi(k)                                       (1.3) less its mean
//   x(k)   = sum over children c of phi(k,c) x(c) + w(k)      (1.1)
//   tau(k) = H(k) x(k) + sqrt(r(k)) eta(k)                    (1.4), with joint noise
// filter() and smooth() take tau as it is. What is observed, and its covariance:
//   M       T      H phi Q phi* H* + diag(r)                                     Result 5.1
//   P       X - Z  P- + Psi P+ + P+ Psi*,  Z = z-                         Result 5.2, corrected
//   D       e-     D                                                             Result 5.3
//   Lambda  l+     L+ + L+ (I - gH) Psi + Psi* (I - gH)* L+               Result 5.4, corrected
//                  and, on a tree, a term between branches
// Psi and the corrected results are those of covariance_analysis.hpp. Everything is linear in xi
// and eta, so a bias b only moves means: the process is simulated without it, all means are zero.
//
// y = A xi with cov xi = 1 has cov y = A A*. Over samples it is estimated without bias by
//   C = 1/S sum over samples of y y*,                the mean being known, not estimated,
// and the sigma points e_1, e_2, … give it exactly: sum over j of (A e_j)(A e_j)* = A A*. Through
// simulate() e_j is a column of one link's square root W(k), or sqrt(r(k)). A massless link has six
// columns of zeros, which are not left out: there are 6 N and one a joint with r(k) > 0.
//
// A sample costs O(N): about 150 flops a link for M, 320 for P and D, 410 for Lambda.
#pragma once

#include <cmath>
#include <vector>

#include "algorithms/study/estimation/filter_smoother.hpp"

namespace kalmarm {

enum class Quantity { M, P, D, Lambda };

// A process ready to be sampled, with the gains of its filter.
template <class T>
struct Simulation {
  Process<T> process;  // b = 0
  Covariances<T> cov;
  VectorX<T> sqrt_r;
  std::vector<int> eta;  // entry of the normal numbers that is eta(k); -1 where r(k) = 0
  int dimension;         // normal numbers of one sample: xi, link after link, then eta

  // cov: after set_state_covariances. M asks for none of it.
  Simulation(const Process<T>& any, const Covariances<T>& gains)
      : process(any),
        cov(gains),
        sqrt_r(any.size()),
        eta(any.size(), -1),
        dimension(6 * any.size()) {
    using std::sqrt;
    for (int k = 0; k < any.size(); ++k) {
      process.b[k].setZero();
      sqrt_r[k] = sqrt(any.r[k]);
      if (any.r[k] > T(0)) eta[k] = dimension++;
    }
  }

  // Entries of y.
  int size(Quantity quantity) const {
    const bool of_joints = quantity == Quantity::M || quantity == Quantity::D;
    return of_joints ? process.size() : 6 * process.size();
  }
};

// Memory for one sample.
template <class T>
struct Sample {
  std::vector<Vector6<T>> x;
  VectorX<T> tau;
  FilterSmoother<T> estimate;

  explicit Sample(const Simulation<T>& simulation)
      : x(simulation.process.size()),
        tau(simulation.process.size()),
        estimate(simulation.process) {}
};

// x and tau from the normal numbers of one sample (`dimension` values).
template <class T, class Normals>
void simulate(const Simulation<T>& simulation, const Normals& normals, Sample<T>& sample) {
  const Process<T>& process = simulation.process;
  for (int k = 0; k < process.size(); ++k)
    sample.x[k] = process.W[k] * normals.template segment<6>(6 * k);  // (1.3)
  for (int k = process.size() - 1; k >= 0; --k) {
    sample.tau[k] = process.H[k].dot(sample.x[k]);  // (1.4)
    if (const int i = simulation.eta[k]; i >= 0) sample.tau[k] += simulation.sqrt_r[k] * normals[i];
    if (const int parent = process.parent[k]; parent >= 0)
      sample.x[parent] += process.phi[k] * sample.x[k];  // (1.1)
  }
}

// y, the quantity in one sample: size(quantity) values, link after link.
template <class T, class Normals>
void observe(const Simulation<T>& simulation, Quantity quantity, const Normals& normals,
             Sample<T>& sample, Eigen::Ref<VectorX<T>> y) {
  const Process<T>& process = simulation.process;
  FilterSmoother<T>& estimate = sample.estimate;
  simulate(simulation, normals, sample);
  if (quantity != Quantity::M) filter(process, simulation.cov, sample.tau, estimate);
  switch (quantity) {
    case Quantity::M:
      y = sample.tau;
      break;
    case Quantity::P:
      for (int k = 0; k < process.size(); ++k)
        y.template segment<6>(6 * k) = sample.x[k] - estimate.z_minus[k];
      break;
    case Quantity::D:
      y = estimate.e_minus;
      break;
    case Quantity::Lambda:
      smooth(process, simulation.cov, estimate);
      for (int k = 0; k < process.size(); ++k) y.template segment<6>(6 * k) = estimate.l_plus[k];
      break;
  }
}

// The covariance from its sigma points, exact but for rounding.
template <class T>
MatrixX<T> sigma_point_covariance(const Simulation<T>& simulation, Quantity quantity) {
  const int size = simulation.size(quantity);
  Sample<T> sample(simulation);
  VectorX<T> normals = VectorX<T>::Zero(simulation.dimension);
  MatrixX<T> A(size, simulation.dimension);
  for (int j = 0; j < simulation.dimension; ++j) {
    normals[j] = T(1);
    observe(simulation, quantity, normals, sample, Eigen::Ref<VectorX<T>>(A.col(j)));
    normals[j] = T(0);
  }
  return A * A.transpose();
}

}  // namespace kalmarm
