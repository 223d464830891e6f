// The rows of an implicit step: what acts along lengths that several joints move together, by (5) to
// (8) of kalmarm/implicit_step.hpp.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Dense>
#include <algorithm>
#include <vector>

#include "algorithms/fast/claims/constants.hpp"
#include "algorithms/spatial/spatial.hpp"
#include "kalmarm/implicit_step.hpp"

namespace kalmarm {

// Memory of one state. Rows that have W or are imposed come first, and are solved for; the force of
// the others is known at the start of the step.
template <class T>
class CoupledRows {
 public:
  // rows: checked. h_of_springs: h, or 0 where springs are at the start.
  CoupledRows(const RobotModel& robot, const std::vector<CoupledRow>& rows, double h,
              double h_of_springs)
      : nv_(robot.nv()), solved_(0), B_(robot.nv(), rows.size()) {
    std::vector<const CoupledRow*> order;
    const auto mass = [&](const CoupledRow& row) {
      return row.armature + h * row.damping + h * h_of_springs * row.stiffness;
    };
    for (const CoupledRow& row : rows)
      if (row.imposed || mass(row) > 0) order.push_back(&row);
    solved_ = static_cast<int>(order.size());
    for (const CoupledRow& row : rows)
      if (!row.imposed && !(mass(row) > 0)) order.push_back(&row);
    for (int k = 0; k < nv_; ++k)
      q_of_.push_back(takes_spring(robot.links[k]) ? robot.links[k].q_index : -1);
    for (const CoupledRow* row : order) {
      for (int k = 0; k < nv_; ++k) B_(k, at_.size()) = static_cast<T>(row->jacobian[k]);
      const double w = mass(*row), k = row->stiffness, b = row->damping + k * h_of_springs;
      if (row->imposed)
        at_.push_back({row->reference, 0, 1 / (h * h), 1 / h, 0});
      else if (w > 0)
        at_.push_back({row->reference, 1 / w, k / w, b / w, w});
      else
        at_.push_back({row->reference, 0, k, b, 0});
    }
    J_ = B_.template cast<double>();
    Y_.resize(nv_, solved_);
    G_.resize(solved_, solved_);
    llt_ = Eigen::LLT<MatrixX<double>>(solved_);
    f_.resize(solved_);
    column_.resize(solved_);
  }

  int solved() const { return solved_; }
  bool is_imposed() const {
    return std::any_of(at_.begin(), at_.begin() + solved_,
                       [](const Row& row) { return row.w == 0; });
  }
  // Of the rows that are solved for: J', and memory for X J'.
  MatrixView<const T> B() const { return {B_.data(), nv_, solved_}; }
  MatrixView<T> Y() { return {Y_.data(), nv_, solved_}; }
  void set_Y(const T* X) {
    Y_.noalias() = Eigen::Map<const MatrixX<T>>(X, nv_, nv_) * B_.leftCols(solved_);
  }

  // Adds the torques of the rows whose force is known to tau.
  void add_known(const T* q, const T* v, T* tau) const {
    for (int i = solved_; i < B_.cols(); ++i)
      Eigen::Map<VectorX<T>>(tau, nv_) -= B_.col(i) * T(sum_of_terms(i, q, v));
  }

  // Their share of da/dx, of X.
  enum class By { position, velocity, torque };
  void derive_known(By by, const T* X, T* dx) const {
    for (int i = solved_; i < B_.cols(); ++i)
      if (const double c = growth(by, i); c != 0)
        Eigen::Map<MatrixX<T>>(dx, nv_, nv_).noalias() -=
            (Eigen::Map<const MatrixX<T>>(X, nv_, nv_) * (B_.col(i) * T(c))).eval() *
            B_.col(i).transpose();
  }

  // C + G of (6) of the columns Y, nv x solved: J X J' and 1 / W. Singular where a row depends on
  // those before it.
  Outcome factor(const T* Y) {
    const double roundings = roundings_of_D * static_cast<double>(unit_roundoff<T>());
    for (int i = 0; i < solved_; ++i)
      for (int j = 0; j <= i; ++j)
        G_(i, j) = along(i, Y + std::ptrdiff_t(j) * nv_) + (i == j ? at_[i].compliance : 0);
    llt_.compute(G_);
    const bool positive = llt_.info() == Eigen::Success;
    for (int i = 0; i < solved_; ++i) {
      const double root = llt_.matrixLLT()(i, i), left = root * root;
      if (!positive || !(left > roundings * G_(i, i)))
        return {.status = Outcome::Status::singular, .D = positive ? left : 0, .scale = G_(i, i)};
    }
    return {};
  }

  // (6): a0 becomes a, by what was factored.
  void couple(const T* q, const T* v, const T* Y, T* a) {
    for (int i = 0; i < solved_; ++i) column_[i] = sum_of_terms(i, q, v) + along(i, a);
    llt_.solveInPlace(column_);
    f_ = column_;
    take(Y, a);
  }

  // x of (7) from X tau.
  void project(const T* Y, T* x) {
    for (int i = 0; i < solved_; ++i) column_[i] = along(i, x);
    llt_.solveInPlace(column_);
    take(Y, x);
  }

  // (8) of all columns of dx (nv x nv), which hold A.
  void derive(By by, const T* Y, T* dx) {
    for (int j = 0; j < nv_; ++j) {
      T* const x = dx + std::ptrdiff_t(j) * nv_;
      for (int i = 0; i < solved_; ++i) column_[i] = growth(by, i) * J_(j, i) + along(i, x);
      llt_.solveInPlace(column_);
      take(Y, x);
    }
  }

  // J' f of the forces that `couple` has found, from tau.
  void take_forces(T* tau) const {
    for (int i = 0; i < solved_; ++i) Eigen::Map<VectorX<T>>(tau, nv_) -= B_.col(i) * T(f_[i]);
  }

  // J' W J is added to M.
  void add_mass(T* M) const {
    Eigen::Map<MatrixX<T>> to(M, nv_, nv_);
    for (int i = 0; i < solved_; ++i)
      for (int k = 0; k < nv_; ++k)
        if (const T x = T(at_[i].w) * B_(k, i); x != T(0)) to.col(k) += x * B_.col(i);
  }

 private:
  // c' = of_length (J q - l0) + of_rate J v of a row that is solved for, else its force.
  struct Row {
    double reference, compliance, of_length, of_rate, w;
  };

  double along(int i, const T* x) const {
    return J_.col(i).dot(Eigen::Map<const VectorX<T>>(x, nv_).template cast<double>());
  }
  double length(int i, const T* q) const {
    double sum = -at_[i].reference;
    for (int k = 0; k < nv_; ++k)
      if (q_of_[k] >= 0) sum += J_(k, i) * static_cast<double>(q[q_of_[k]]);
    return sum;
  }

  // c' of a row that is solved for, else its force.
  double sum_of_terms(int i, const T* q, const T* v) const {
    return at_[i].of_length * length(i, q) + at_[i].of_rate * along(i, v);
  }
  // How it grows along J.
  double growth(By by, int i) const {
    return by == By::position ? at_[i].of_length : by == By::velocity ? at_[i].of_rate : 0;
  }

  // x -= Y f of the forces in column_.
  void take(const T* Y, T* x) const {
    for (int i = 0; i < solved_; ++i)
      Eigen::Map<VectorX<T>>(x, nv_) -=
          Eigen::Map<const VectorX<T>>(Y + std::ptrdiff_t(i) * nv_, nv_) * T(column_[i]);
  }

  int nv_, solved_;
  std::vector<int> q_of_;  // of every DoF, its entry of q where it may have a length
  std::vector<Row> at_;
  MatrixX<T> B_, Y_;       // J' of all rows; X J' of those that are solved for
  MatrixX<double> J_, G_;  // J' too
  Eigen::LLT<MatrixX<double>> llt_;
  VectorX<double> f_, column_;
};

}  // namespace kalmarm
