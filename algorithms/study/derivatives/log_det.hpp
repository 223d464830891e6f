// log det M and the score of the random model T ~ N(H phi b, M), with their gradients in O(N).
//
//   log det M = sum of log D(k)                                              from (3.1)
//   d log det M   = tr(dM(k) L-(k)) for a change dM(k) of link k's inertia   L-: (5.6), Result 5.4
//   d log p(T)    = 1/2 tr(dM(k) (l-(k) l-'(k) - L-(k)))                     the score, l-: (4.11)
// since d M = H phi dQ phi* H*, phi* H* M^-1 H phi has the blocks L- on its diagonal, and
// l- = phi* H* a with a = M^-1 (T - H phi b). For a joint's noise, with a(k) of the smoother and
// (M^-1)(k,k) = 1/D + g'L+g of Result 6.1:
//   d log det M   = (M^-1)(k,k) dr(k)
//   d log p(T)    = 1/2 (a(k)^2 - (M^-1)(k,k)) dr(k)
//
// M(k) = [I_o h~; -h~ m 1] is linear in a body's ten parameters (inertial_parameters.hpp): a
// symmetric weight S = [A B; B' C] turns tr(dM S) into
//   tr C dm + 2 (vee B)' dh + A : dI_o,   vee B = (B_21 - B_12, B_02 - B_20, B_10 - B_01)
#pragma once

#include <vector>

#include "algorithms/study/derivatives/inertial_parameters.hpp"
#include "algorithms/study/estimation/filter_smoother.hpp"

namespace kalmarm {

// The gradient of tr(M(k) S) over the ten parameters, for a symmetric S.
template <class T>
InertialVector<T> inertial_gradient(const Matrix6<T>& S) {
  const auto A = S.template topLeftCorner<3, 3>();
  const auto B = S.template topRightCorner<3, 3>();
  InertialVector<T> out;
  out << S.template bottomRightCorner<3, 3>().trace(),                                     //
      T(2) * (B(2, 1) - B(1, 2)), T(2) * (B(0, 2) - B(2, 0)), T(2) * (B(1, 0) - B(0, 1)),  //
      A(0, 0), A(1, 1), A(2, 2), T(2) * A(0, 1), T(2) * A(0, 2), T(2) * A(1, 2);
  return out;
}

template <class T>
struct LogDetGradient {
  std::vector<InertialVector<T>> inertia;  // of every link
  std::vector<T> r;                        // of every joint's noise
};

// log det M, after set_state_covariances.
template <class T>
T log_det(const Covariances<T>& cov) {
  using std::log;
  T sum = T(0);
  for (const T& D : cov.D) sum += log(D);
  return sum;
}

// (M^-1)(k,k), after set_co_state_covariances.
template <class T>
T inverse_diagonal(const Covariances<T>& cov, int k) {
  return T(1) / cov.D[k] + cov.g[k].dot(cov.L_plus[k] * cov.g[k]);
}

// Gradient of log det M, after set_co_state_covariances. About 150 flops a link.
template <class T>
LogDetGradient<T> log_det_gradient(const Covariances<T>& cov) {
  LogDetGradient<T> out;
  for (int k = 0; k < static_cast<int>(cov.D.size()); ++k) {
    out.inertia.push_back(inertial_gradient<T>(cov.L_minus[k]));
    out.r.push_back(inverse_diagonal(cov, k));
  }
  return out;
}

// Gradient of log p(T), after smooth. About 200 flops a link.
template <class T>
LogDetGradient<T> score(const Covariances<T>& cov, const FilterSmoother<T>& fs) {
  LogDetGradient<T> out;
  for (int k = 0; k < static_cast<int>(cov.D.size()); ++k) {
    const Vector6<T>& l = fs.l_minus[k];
    out.inertia.push_back(inertial_gradient<T>((l * l.transpose() - cov.L_minus[k]) / T(2)));
    out.r.push_back((fs.a[k] * fs.a[k] - inverse_diagonal(cov, k)) / T(2));
  }
  return out;
}

}  // namespace kalmarm
