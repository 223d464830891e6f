// The rows of an implicit step: what acts along lengths that several joints move together, by (5) to
// (8) of kalmarm/implicit_step.hpp.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <vector>

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
      : nv_(robot.nv()), solved_(0), B_(robot.nv(), rows.size()), Y_(robot.nv(), rows.size()) {
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
    const int p = solved_;
    J_ = B_.template cast<double>();
    G_.resize(p, p);
    llt_ = Eigen::LLT<MatrixX<double>>(p);
    f_.resize(rows.size());
    column_.resize(p);
  }

  int count() const { return static_cast<int>(at_.size()); }
  bool is_imposed() const {
    return std::any_of(at_.begin(), at_.begin() + solved_,
                       [](const Row& row) { return row.w == 0; });
  }
  MatrixView<const T> B() const { return {B_.data(), nv_, count()}; }
  MatrixView<T> Y() { return {Y_.data(), nv_, count()}; }

  // Adds the torques of the rows whose force is known to tau.
  void add_known(const T* q, const T* v, T* tau) {
    for (int i = solved_; i < count(); ++i) {
      f_[i] = at_[i].of_length * length(i, q) + at_[i].of_rate * along(i, v);
      Eigen::Map<VectorX<T>>(tau, nv_) -= B_.col(i) * T(f_[i]);
    }
  }

  // C + G of (6) of the columns Y, nv x count: J X J' and 1 / W. false where it is singular.
  bool factor(const T* Y) {
    for (int i = 0; i < solved_; ++i)
      for (int j = 0; j <= i; ++j)
        G_(i, j) = along(i, Y + std::ptrdiff_t(j) * nv_) + (i == j ? at_[i].compliance : 0);
    llt_.compute(G_);
    if (llt_.info() != Eigen::Success) return false;
    for (int i = 0; i < solved_; ++i) {
      const double left = llt_.matrixLLT()(i, i);
      if (!(left * left > digits_of_G * static_cast<double>(unit_roundoff<T>()) * G_(i, i)))
        return false;
    }
    return true;
  }

  // Of (6), where C + G is singular: of the row that depends on those before it.
  Outcome singular() const {
    Outcome out = {.status = Outcome::Status::singular};
    out.scale = solved_ > 0 ? G_.diagonal().maxCoeff() : 0;
    return out;
  }

  // (6): a0 becomes a, by what was factored.
  void impose(const T* q, const T* v, const T* Y, T* a) {
    for (int i = 0; i < solved_; ++i)
      column_[i] = at_[i].of_length * length(i, q) + at_[i].of_rate * along(i, v) + along(i, a);
    llt_.solveInPlace(column_);
    f_.head(solved_) = column_;
    take(Y, a);
  }

  // x of (7) from X tau.
  void project(const T* Y, T* x) {
    for (int i = 0; i < solved_; ++i) column_[i] = along(i, x);
    llt_.solveInPlace(column_);
    take(Y, x);
  }

  // (8) of all columns of dx (nv x nv), where c'(q, v) grows by of_length, or of_rate, along J.
  enum class By { position, velocity, torque };
  void derive(By by, const T* Y, T* dx) {
    for (int j = 0; j < nv_; ++j) {
      T* const x = dx + std::ptrdiff_t(j) * nv_;
      const auto grows = [&](int i) {
        const double c = by == By::position   ? at_[i].of_length
                         : by == By::velocity ? at_[i].of_rate
                                              : 0;
        return c * J_(j, i);
      };
      for (int i = solved_; i < count(); ++i)
        Eigen::Map<VectorX<T>>(x, nv_) -=
            Eigen::Map<const VectorX<T>>(Y + std::ptrdiff_t(i) * nv_, nv_) * T(grows(i));
      for (int i = 0; i < solved_; ++i) column_[i] = grows(i) + along(i, x);
      llt_.solveInPlace(column_);
      take(Y, x);
    }
  }

  // J' f of the forces that `impose` has found, from tau.
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
  // Beyond so many u of G(i,i) nothing is known of what is left of it.
  static constexpr double digits_of_G = 64;

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

  // x -= Y f of the forces in column_.
  void take(const T* Y, T* x) const {
    for (int i = 0; i < solved_; ++i)
      Eigen::Map<VectorX<T>>(x, nv_) -=
          Eigen::Map<const VectorX<T>>(Y + std::ptrdiff_t(i) * nv_, nv_) * T(column_[i]);
  }

  int nv_, solved_;
  std::vector<int> q_of_;  // of every DoF, its entry of q where it may have a length
  std::vector<Row> at_;
  MatrixX<T> B_, Y_;       // J', X J'
  MatrixX<double> J_, G_;  // J' too
  Eigen::LLT<MatrixX<double>> llt_;
  VectorX<double> f_, column_;
};

}  // namespace kalmarm
