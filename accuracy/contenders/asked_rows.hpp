// Rows of an asked step, tendons and imposed couplings of joints, added in T to what a variant answers
// without them: with X = (M + diag(r))^-1 and a0 of the variant, and (5) to (7) of
// kalmarm/implicit_step.hpp by a Cholesky factorisation in T,
//   Y = X J',  (C + J Y) f = c' + J a0,  a = a0 - Y f                                      (1)
//   M^^-1 = X - Y (C + J Y)^-1 Y',  M^ = M + diag(r) + J' W J                              (2)
// A row without W that is not imposed has the known force f = c', tau^ -= J' f.
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "algorithms/spatial/spatial.hpp"
#include "kalmarm/implicit_step.hpp"

namespace kalmarm {

class AskedRows {
 public:
  AskedRows() = default;

  // ahead: h, or 0 where springs are taken at the start of the step.
  // q_of: of every DoF, its entry of q.
  AskedRows(const std::vector<int>& q_of, const std::vector<CoupledRow>& rows, double h,
            double ahead)
      : h_(h), ahead_(ahead), q_of_(q_of) {
    for (const CoupledRow& row : rows)
      (row.imposed || mass(row) > 0 ? solved_ : known_).push_back(row);
  }

  bool empty() const { return solved_.empty() && known_.empty(); }
  bool solves() const { return !solved_.empty(); }
  bool imposes() const {
    for (const CoupledRow& row : solved_)
      if (row.imposed) return true;
    return false;
  }

  template <class T>
  void add_known(const VectorX<T>& q, const VectorX<T>& v, VectorX<T>& tau) const {
    for (const CoupledRow& row : known_) {
      const VectorX<T> J = jacobian<T>(row);
      const T rate = J.dot(v);
      tau -= J * (T(row.damping) * rate + T(row.stiffness) * (length(row, q) + T(ahead_) * rate));
    }
  }

  // (2)
  template <class T>
  void add_mass(MatrixX<T>& M) const {
    for (const CoupledRow& row : solved_) {
      const VectorX<T> J = jacobian<T>(row);
      M += (T(mass(row)) * J) * J.transpose();
    }
  }

  // (1) and (2), in place; false where the rows are not independent.
  template <class T>
  bool solve(const VectorX<T>& q, const VectorX<T>& v, MatrixX<T>& X, VectorX<T>* a) const {
    const int m = static_cast<int>(solved_.size());
    MatrixX<T> J(m, v.size());
    VectorX<T> C(m), c(m);
    for (int i = 0; i < m; ++i) {
      const CoupledRow& row = solved_[i];
      J.row(i) = jacobian<T>(row).transpose();
      const T rate = J.row(i).dot(v), at = length(row, q), h(h_);
      if (row.imposed) {
        C[i] = T(0);
        c[i] = (at + h * rate) / (h * h);
      } else {
        C[i] = T(1) / T(mass(row));
        c[i] = C[i] * (T(row.damping) * rate + T(row.stiffness) * (at + T(ahead_) * rate));
      }
    }
    const MatrixX<T> Y = X * J.transpose();
    MatrixX<T> G = J * Y;
    G.diagonal() += C;
    const Eigen::LLT<MatrixX<T>> llt(G);
    if (llt.info() != Eigen::Success) return false;
    if (a) *a -= Y * llt.solve(VectorX<T>(c + J * *a));
    X -= Y * llt.solve(MatrixX<T>(Y.transpose()));
    return true;
  }

 private:
  double mass(const CoupledRow& row) const {
    return row.armature + h_ * row.damping + h_ * ahead_ * row.stiffness;
  }
  template <class T>
  static VectorX<T> jacobian(const CoupledRow& row) {
    return Eigen::Map<const VectorX<double>>(row.jacobian.data(),
                                             static_cast<int>(row.jacobian.size()))
        .cast<T>();
  }
  template <class T>
  T length(const CoupledRow& row, const VectorX<T>& q) const {
    T sum(-row.reference);
    for (std::size_t k = 0; k < q_of_.size(); ++k)
      if (row.jacobian[k] != 0) sum += T(row.jacobian[k]) * q[q_of_[k]];
    return sum;
  }

  double h_ = 0, ahead_ = 0;
  std::vector<CoupledRow> solved_, known_;
  std::vector<int> q_of_;
};

}  // namespace kalmarm
