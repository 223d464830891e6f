// Derivatives of forward dynamics a = M^-1 (tau - bias(q, q')) with respect to q, q' and tau.
#pragma once

#include <cassert>

#include "algorithms/structured/derivative_columns.hpp"
#include "algorithms/structured/dynamics.hpp"

namespace kalmarm {

template <class S>
class StructuredDerivatives {
 public:
  explicit StructuredDerivatives(const Model<S>& model)
      : model_(model), terms_(model_), columns_(model_), judge_(model) {}

  Outcome derivatives(const VectorX<S>& q, const VectorX<S>& qd, const VectorX<S>& tau,
                      MatrixX<S>& da_dq, MatrixX<S>& da_dqd, MatrixX<S>& da_dtau, VectorX<S>& a) {
    derivative_terms(model_, q.data(), qd.data(), tau.data(), terms_, a.data());
    derivative_columns(model_, terms_, columns_, da_dq.data(), da_dqd.data(), da_dtau.data());
    const S margin = terms_.margin, check = terms_.check;
    return judge_.suspects(margin, check) ? judge_.judge(q.data(), check) : Outcome{};
  }

 private:
  StructuredModel<S> model_;
  DerivativeTerms<S> terms_;
  DerivativeColumns<S> columns_;
  detail::Judge<S, Conventional> judge_;
};

}  // namespace kalmarm
