// Derivatives of forward dynamics a = M^-1 (tau - bias(q, q')) with respect to q, q' and tau.
#pragma once

#include <cassert>

#include "algorithms/structured/derivative_chain.hpp"
#include "algorithms/structured/dynamics.hpp"

namespace kalmarm {

template <class T>
struct DerivativeWorkspace {
  DerivativeTerms<T> terms;
  DerivativeColumns<T> columns;
  ChainBlocks<T> chain;

  template <class S>
  explicit DerivativeWorkspace(const StructuredModel<S>& model)
      : terms(model), columns(model), chain(model) {}
};

// da_dq, da_dqd and da_dtau (nv x nv, by columns) and a (nv) from q (nq), qd and tau (nv);
// ws.terms.margin and ws.terms.check say whether they can be believed.
template <class T, class S>
void structured_derivatives(const StructuredModel<S>& model, const T* q, const T* qd, const T* tau,
                            DerivativeWorkspace<T>& ws, T* da_dq, T* da_dqd, T* da_dtau, T* a) {
  derivative_terms(model, q, qd, tau, ws.terms, a);
  const int blocks = ws.terms.table.blocks();
  if constexpr ((lanes_of<T>) > 1) {
    if (!ws.chain.blocks.empty()) {
      detail::set_blocks(model, ws.terms, ws.columns, ws.chain);
      for (int block = 0; block < blocks; ++block)
        detail::chain_columns(model, ws.terms, block, ws.chain, ws.columns, da_dq, da_dqd, da_dtau);
      return;
    }
  }
  for (int block = 0; block < blocks; ++block)
    detail::tree_columns(model, ws.terms, block, ws.columns, da_dq, da_dqd, da_dtau);
}

template <class S>
class StructuredDerivatives {
 public:
  explicit StructuredDerivatives(const Model<S>& model)
      : model_(model), workspace_(model_), judge_(model) {}

  Outcome derivatives(const VectorX<S>& q, const VectorX<S>& qd, const VectorX<S>& tau,
                      MatrixX<S>& da_dq, MatrixX<S>& da_dqd, MatrixX<S>& da_dtau, VectorX<S>& a) {
    structured_derivatives(model_, q.data(), qd.data(), tau.data(), workspace_, da_dq.data(),
                           da_dqd.data(), da_dtau.data(), a.data());
    const S margin = workspace_.terms.margin, check = workspace_.terms.check;
    return judge_.suspects(margin, check) ? judge_.judge(q.data(), check) : Outcome{};
  }

 private:
  StructuredModel<S> model_;
  DerivativeWorkspace<S> workspace_;
  detail::Judge<S, Conventional> judge_;
};

}  // namespace kalmarm
