// One variant on one model behind a run-time interface: what programs, benchmarks and tests hold. A
// peer (MuJoCo …) implements the same interface. The virtual call costs about a nanosecond.
#pragma once

#include <memory>
#include <string>

#include "algorithms/model/random_model.hpp"
#include "algorithms/outcome.hpp"

namespace kalmarm {

template <class T>
class Solver {
 public:
  virtual ~Solver() = default;

  // a = M^-1 (tau - bias): forward dynamics with gravity, velocity terms and armature. From the
  // state to a, kinematics included. q: nq, qd, tau and a: nv. On failure a is not to be used.
  virtual Outcome acceleration(const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau,
                               VectorX<T>& a) = 0;

  // M^-1, both triangles (nv x nv), kinematics included. On failure X is not to be used.
  virtual Outcome inverse(const VectorX<T>& q, MatrixX<T>& X) = 0;

  // D(k) (nv) and g(k) (6 x nv) of M = (I + K) D (I + K*). False where the variant has no such
  // factors.
  virtual bool has_factors() const = 0;
  virtual Outcome factors(const VectorX<T>& q, VectorX<T>& D, MatrixX<T>& g) = 0;
};

template <class V, class T>
class SolverOf final : public Solver<T> {
 public:
  explicit SolverOf(const Model<T>& model) : model_(model), rm_(model_), ws_(model_) {}

  Outcome acceleration(const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau,
                       VectorX<T>& a) override {
    set_position(model_, q, rm_);
    set_velocity(model_, qd, rm_);
    const Outcome outcome = V::factor(model_, rm_, ws_);
    if (outcome) V::acceleration(model_, rm_, tau, ws_, a);
    return outcome;
  }

  Outcome inverse(const VectorX<T>& q, MatrixX<T>& X) override {
    set_position(model_, q, rm_);
    const Outcome outcome = V::factor(model_, rm_, ws_);
    if (outcome) V::inverse(model_, rm_, ws_, X);
    return outcome;
  }

  bool has_factors() const override { return filters; }

  Outcome factors(const VectorX<T>& q, VectorX<T>& D, MatrixX<T>& g) override {
    set_position(model_, q, rm_);
    const Outcome outcome = V::factor(model_, rm_, ws_);
    if constexpr (filters) {
      for (int k = 0; k < model_.nv(); ++k) {
        D[k] = ws_.factors.D[k];
        g.col(k) = ws_.factors.g[k];
      }
    }
    return outcome;
  }

 private:
  static constexpr bool filters = requires(typename V::template Workspace<T> ws) { ws.factors.D; };

  Model<T> model_;
  RandomModel<T> rm_;
  typename V::template Workspace<T> ws_;
};

}  // namespace kalmarm
