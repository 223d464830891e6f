// The fast path as a variant (solver.hpp), so that programs, benchmarks and tests judge it like any
// other. Its factors are those of frames of its own (structured_model.hpp) and are not shown.
#pragma once

#include <string>

#include "algorithms/partial_solver.hpp"
#include "algorithms/structured/dynamics.hpp"
#include "algorithms/structured/inverse.hpp"

namespace kalmarm {

template <class T, class Form>
class StructuredSolver final : public PartialSolver<T> {
 public:
  explicit StructuredSolver(const Model<T>& model, Zeros zeros = Zeros::left_out)
      : dynamics_(model, zeros), inverse_(model, zeros) {}

  Outcome acceleration(const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau,
                       VectorX<T>& a) override {
    return dynamics_.acceleration(q, qd, tau, a);
  }
  Outcome factor(const VectorX<T>& q) override { return inverse_.factor(q); }
  void solve(const VectorX<T>& tau, VectorX<T>& x) override { inverse_.solve(tau, x); }
  Outcome inverse(const VectorX<T>& q, MatrixX<T>& X) override { return inverse_.inverse(q, X); }

  Outcome diagonal(const VectorX<T>& q, VectorX<T>& x) override { return inverse_.diagonal(q, x); }
  Outcome log_det(const VectorX<T>& q, T& x) override { return inverse_.log_det(q, x); }
  void select(const Selection<T>& selection) override { inverse_.select(selection); }
  Outcome selected(const VectorX<T>& q, MatrixX<T>& X) override { return inverse_.selected(q, X); }

 private:
  StructuredDynamics<T, Form> dynamics_;
  StructuredInverse<T, Form> inverse_;
};

}  // namespace kalmarm
