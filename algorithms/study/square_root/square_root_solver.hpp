// AxisFrames<SquareRoot>: the square-root form on the fast path's frames as a variant of the study, with the
// fast path's columns for M^-1 and solves. Of its accuracy it knows nothing but its D: where one is
// below 32 u of what it is made of, Sequential<ArrayGivens> says whether M is singular.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "algorithms/fast/factors/inverse.hpp"
#include "algorithms/fast/factors/solve.hpp"
#include "algorithms/study/inverse_mass/sequential.hpp"
#include "algorithms/study/riccati/array.hpp"
#include "algorithms/study/solver_of.hpp"
#include "algorithms/study/square_root/square_root.hpp"

namespace kalmarm {

template <class T>
class SquareRootSolver final : public Solver<T> {
 public:
  explicit SquareRootSolver(const Model<T>& model)
      : model_(model),
        ws_(model_),
        resting_(model_),
        factors_(model_),
        solver_(model_),
        inverse_(model_, Triangles::both),
        zeros_(model.nv(), T(0)),
        by_arrays_(model) {}

  Outcome acceleration(const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau,
                       VectorX<T>& a) override {
    square_root_acceleration(model_, q.data(), qd.data(), tau.data(), ws_, a.data());
    return outcome(q, ws_.margin, a.allFinite());
  }

  Outcome factor(const VectorX<T>& q) override {
    square_root_factor(model_, q.data(), zeros_, resting_, factors_);
    return outcome(q, factors_.margin, true);
  }

  void solve(const VectorX<T>& tau, VectorX<T>& x) override {
    solver_.solve(model_, factors_, 1, 1, tau.data(), x.data());
  }

  Outcome inverse(const VectorX<T>& q, MatrixX<T>& X) override {
    const Outcome out = factor(q);
    if (out) inverse_.fill(model_, factors_, X.data());
    return out && !X.allFinite() ? Outcome{.status = Outcome::Status::not_finite} : out;
  }

  void mass(const VectorX<T>& q, MatrixX<T>& M) override { by_arrays_.mass(q, M); }

 private:
  Outcome outcome(const VectorX<T>& q, const T& margin, bool finite) {
    Outcome out;
    if (!(margin > T(0))) {
      out = by_arrays_.factor(q);
      out.rung = Outcome::Rung::refined;
    }
    return out && !finite ? Outcome{.status = Outcome::Status::not_finite} : out;
  }

  SquareRootModel<T> model_;
  SquareRootWorkspace<T> ws_, resting_;  // resting_ has never seen a velocity
  FastFactors<T> factors_;
  FactorSolver<T> solver_;
  InverseColumns<T> inverse_;
  std::vector<T> zeros_;
  SolverOf<Sequential<ArrayGivens>, T> by_arrays_;
};

}  // namespace kalmarm
