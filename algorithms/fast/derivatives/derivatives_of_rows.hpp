// Derivatives of forward dynamics of one state in every lane: derivatives.hpp with a pack of states for
// its scalar, so that the motion, the filter and (B1) to (B3), which one state works out number by
// number, fill registers too. Columns go one after another; the three matrices of a column are three
// recursions, which hide each other's latency.
#pragma once

#include <optional>
#include <vector>

#include "algorithms/fast/claims/tuning.hpp"
#include "algorithms/fast/derivatives/derivatives.hpp"
#include "algorithms/fast/factors/factors.hpp"
#include "algorithms/fast/kinematics/acting_in_lanes.hpp"

namespace kalmarm {

template <class P>
class DerivativesOfRows {
  using S = typename Lanes<P>::Scalar;

 public:
  explicit DerivativesOfRows(const LoweredModel<S>& model)
      : q_(model.nq()),
        qd_(model.nv()),
        tau_(model.nv()),
        a_(model.nv()),
        dq_(std::size_t(model.nv()) * model.nv()),
        dqd_(dq_),
        dtau_(dq_),
        given_(model.widths().f, model.widths().l),
        workspace_(model) {
    if (model.may_lose_D()) factors_.emplace(model);
  }

  // Whether the derivatives of a robot with n DoF are worked out faster here than state by state.
  static constexpr bool takes(int n) { return n <= most_derivatives_in_lanes; }

  // Of so many rows of states, at most as many as there are lanes, of `left` that can be read: a (nv a
  // state), da/dq, da/dq' and da/dtau (nv x nv a state, by columns), of which those that are null are
  // left out. About 1300 nv + 100 nv^2 flops a lane. Of a state with doubtful[i], which is not finite or
  // may have lost a D, one state is to be asked.
  // acting: of rows too, as fast_derivatives takes it.
  void fill(const LoweredModel<S>& model, const S* q, const S* qd, const S* tau,
            const Acting<S>& acting, int states, int left, S* da_dq, S* da_dqd, S* da_dtau, S* a,
            char* doubtful);

 private:
  std::vector<P> q_, qd_, tau_, a_, dq_, dqd_, dtau_;
  ActingInLanes<P> given_;
  DerivativeWorkspace<P> workspace_;
  std::optional<FastFactors<P>> factors_;  // whose margin says whether a D may be lost
};

template <class P>
void DerivativesOfRows<P>::fill(const LoweredModel<S>& model, const S* q, const S* qd, const S* tau,
                                const Acting<S>& acting, int states, int left, S* da_dq, S* da_dqd,
                                S* da_dtau, S* a, char* doubtful) {
  const int nv = model.nv();
  to_lanes(q, model.nq(), states, left, q_);
  to_lanes(qd, nv, states, left, qd_);
  to_lanes(tau, nv, states, left, tau_);
  const Acting<P> given = given_.load(acting, states, left);
  fast_derivatives(model, q_.data(), qd_.data(), tau_.data(), workspace_, dq_.data(), dqd_.data(),
                   dtau_.data(), a_.data(), given);
  if (factors_) covariance_factor(model, q_.data(), *factors_, Acting<P>{.loads = given.loads});
  for (int i = 0; i < states; ++i)
    doubtful[i] =
        !(workspace_.terms.check[i] == S(0)) || (factors_ && !(factors_->margin[i] > S(0)));
  from_lanes(a_, nv, states, a);
  if (da_dq) from_lanes(dq_, nv * nv, states, da_dq);
  if (da_dqd) from_lanes(dqd_, nv * nv, states, da_dqd);
  if (da_dtau) from_lanes(dtau_, nv * nv, states, da_dtau);
}

}  // namespace kalmarm
