// A variant on one model, asked for accelerations alone. The ladder is then made in half the
// time of its Solver, which is asked for M^-1 and M as well, and gives the same accelerations.
#pragma once

#include <memory>
#include <optional>

#include "algorithms/model/plain.hpp"
#include "algorithms/study/solver.hpp"
#include "kalmarm/dynamics.hpp"

namespace kalmarm::stress {

template <class T>
class ForwardDynamics {
 public:
  ForwardDynamics(const RegisteredVariant<T>& variant, const Model<T>& model) {
    if (variant.traits.kind == VariantKind::ladder)
      ladder_.emplace(plain(model.template cast<double>()),
                      DynamicsOptions{.tolerance = variant.traits.tolerance,
                                      .question = {.want = {Want::acceleration}}});
    else
      solver_ = variant.make(model);
  }

  Outcome acceleration(const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau,
                       VectorX<T>& a) {
    return ladder_ ? ladder_->forward_dynamics(q, qd, tau, a)
                   : solver_->acceleration(q, qd, tau, a);
  }

 private:
  std::optional<Dynamics<T>> ladder_;
  std::unique_ptr<Solver<T>> solver_;
};

}  // namespace kalmarm::stress
