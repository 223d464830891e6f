// Derivatives of forward dynamics a = M^-1 (tau - bias(q, q')) with respect to q, q' and tau, by
// solving for them: no derivative of inverse dynamics is formed, and none is multiplied by M^-1.
//
//   M da/dtau = 1
//   M da/dq_j = -d bias/dq_j - dM/dq_j a        M da/dq'_j = -d bias/dq'_j
// Column j is what the filter and smoother answer to the forces that DoF j's motion causes: one
// acceleration and one turn for all that is outboard of it, and H x* F at its joint. The terms are
// in derivative_terms.hpp, the sweeps over columns in derivative_columns.hpp, the tiles of long
// chains in derivative_chain.hpp. dq_j is the change along DoF j's velocity: of an angle, a
// distance, a turn about an axis of a ball joint's body, a shift along an axis of a free joint's
// parent.
//
// O(nv depth) flops but for branches that answer each other, O(nv^2) stores: about 1.3k flops a
// joint, and for every entry of a matrix 45 in sweeps, 20 in tiles. Error: a few tens of roundoffs
// times the condition number of M scaled to unit diagonal, and mostly far less. Axes are common to
// a tree, reference points are not, so that neither the place nor the velocity of a robot adds to
// it: a free base 7e7 m away that travels at 1e4 m/s has the same derivatives to the bit.
#pragma once

#include <algorithm>

#include "algorithms/fast/derivatives/derivative_chain.hpp"

namespace kalmarm {

template <class T>
struct DerivativeWorkspace {
  DerivativeTerms<T> terms;
  DerivativeColumns<T> columns;
  ChainBlocks<T> chain;

  template <class S>
  explicit DerivativeWorkspace(const LoweredModel<S>& model)
      : terms(model), columns(model), chain(model) {}
};

// da_dq, da_dqd and da_dtau (nv x nv, by columns) and a (nv) from q (nq), qd and tau (nv), loads, and forces in the
// axes of their frames, with which they turn;
// ws.terms.check says whether they are finite. No D is tested: rounding_bound.hpp does that.
template <class T, class S>
void fast_derivatives(const LoweredModel<S>& model, const T* q, const T* qd, const T* tau,
                      DerivativeWorkspace<T>& ws, T* da_dq, T* da_dqd, T* da_dtau, T* a,
                      const Acting<T>& acting = {}) {
  derivative_terms(model, q, qd, tau, acting, ws.terms, a);
  constexpr int lanes = lanes_of<T>, mirrored_at_once = 8;
  const int blocks = ws.terms.table.blocks();
  const bool tiles = !ws.chain.blocks.empty();
  if constexpr (lanes > 1)
    if (tiles) detail::set_blocks(model, ws.terms, ws.columns, ws.chain);
  for (int block = 0; block < blocks; ++block) {
    if constexpr (lanes > 1)
      if (tiles)
        detail::chain_columns(model, ws.terms, block, ws.chain, ws.columns, da_dq, da_dqd, da_dtau);
    if (!tiles) detail::tree_columns(model, ws.terms, block, ws.columns, da_dq, da_dqd, da_dtau);
    if ((block + 1) % mirrored_at_once == 0 || block + 1 == blocks)  // whole lines of the cache
      detail::mirror(block / mirrored_at_once * mirrored_at_once * lanes,
                     std::min((block + 1) * lanes, model.nv()), model.nv(), da_dtau);
  }
}

}  // namespace kalmarm
