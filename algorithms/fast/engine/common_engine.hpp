// What every engine of the fast path answers in the same way, whatever its kernels for M^-1 are: M,
// inverse dynamics and derivatives, by the spatial kernels.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "algorithms/fast/engine/engine.hpp"
#include "algorithms/fast/engine/instances.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/spatial/lanes.hpp"

namespace kalmarm {

// Rows of states, which are taken lanes at a time: the memory of one worker.
template <class S>
struct RowBlock {
  using P = StateLanes<S>;
  static constexpr int lanes = Lanes<P>::count;

  std::vector<P> q, qd, tau_or_qdd, out;

  explicit RowBlock(const LoweredModel<S>& model)
      : q(model.nq()), qd(model.nv()), tau_or_qdd(model.nv()), out(model.nv()) {}

  // f(first, states) of every block of rows, which `out` then has the answers to.
  template <class F>
  void for_each(const LoweredModel<S>& model, int count, const S* q_rows, const S* qd_rows,
                const S* tau_or_qdd_rows, S* out_rows, const F& f) {
    const int nq = model.nq(), nv = model.nv();
    for (int first = 0; first < count; first += lanes) {
      const int left = count - first, states = std::min(lanes, left);
      const std::ptrdiff_t i = first;
      to_lanes(q_rows + i * nq, nq, states, left, q);
      to_lanes(qd_rows + i * nv, nv, states, left, qd);
      to_lanes(tau_or_qdd_rows + i * nv, nv, states, left, tau_or_qdd);
      f(first, states, [&] { from_lanes(out, nv, states, out_rows + i * nv); });
    }
  }
};

// Of derivatives, which carry no error of their own: `judged`, which is ok, without its error. They
// warn where a D of their sweep may be wrong by 1 per cent, as `loss` says.
inline Outcome of_derivatives(Outcome judged, const RoundingLoss& loss) {
  judged.error = Outcome{}.error;
  if (loss.bound < error_of_D_to_refine || judged.near_singular) return judged;
  judged.near_singular = true;
  judged.joint = loss.joint;
  judged.D = loss.D;
  judged.scale = std::isfinite(loss.bound) ? loss.bound * loss.D : loss.scale;
  return judged;
}

template <class S>
class CommonEngine : public Engine<S> {
 public:
  CommonEngine(const RobotModel& robot, const EngineOptions& options)
      : model_(model_of(robot).template cast<S>()), lowered_(model_, options.zeros) {
    if (options.wants(Want::mass)) mass_.emplace(lowered_, options.triangles);
    if (options.wants(Want::inverse_dynamics)) inverse_dynamics_.emplace(lowered_);
    if (!options.wants(Want::derivatives)) return;
    derivatives_.emplace(lowered_);
    if (lowered_.may_lose_D()) loss_.emplace(lowered_);
  }

  bool answers_in_part() const final { return true; }

  void reserve_workers(Want what, int count) override {
    if (what == Want::inverse_dynamics) reserve(torques_, count);
    if (what == Want::mass && MatrixBlock<StateLanes<S>>::takes(lowered_.nv()))
      reserve(masses_, count);
    if (what == Want::derivatives && DerivativesOfRows<StateLanes<S>>::takes(lowered_.nv()))
      reserve(derivatives_of_rows_, count);
  }

  void inverse_dynamics(int worker, int count, const S* q, const S* qd, const S* qdd,
                        S* tau) final {
    Torques& w = torques_[worker];
    w.rows.for_each(lowered_, count, q, qd, qdd, tau, [&](int, int, const auto& store) {
      fast_inverse_dynamics(lowered_, w.rows.q.data(), w.rows.qd.data(), w.rows.tau_or_qdd.data(),
                            w.workspace, w.rows.out.data());
      store();
    });
  }

  void inverse_dynamics(const S* q, const S* qd, const S* qdd, S* tau) final {
    fast_inverse_dynamics(lowered_, q, qd, qdd, *inverse_dynamics_, tau);
  }

  void mass(const S* q, S* M) final { mass_->fill(lowered_, q, M); }

  void mass(int worker, int count, const S* q, S* M, char* left_over) final {
    if (masses_.empty()) return Engine<S>::mass(worker, count, q, M, left_over);
    const std::ptrdiff_t nq = lowered_.nq(), size = std::ptrdiff_t(lowered_.nv()) * lowered_.nv();
    for_each_lanes(count, [&](int first, int states) {
      const auto check =
          masses_[worker].fill(lowered_, q + first * nq, states, count - first, M + first * size);
      for (int i = 0; i < states; ++i) left_over[first + i] = check[i] != S(0);
    });
  }

  void derivatives(int worker, int count, const S* q, const S* qd, const S* tau, S* da_dq,
                   S* da_dqd, S* da_dtau, S* a, char* left_over) override {
    if (derivatives_of_rows_.empty())
      return Engine<S>::derivatives(worker, count, q, qd, tau, da_dq, da_dqd, da_dtau, a,
                                    left_over);
    const std::ptrdiff_t nq = lowered_.nq(), nv = lowered_.nv();
    for_each_lanes(count, [&](int first, int states) {
      const auto of_row = [&](S* X) { return X ? X + first * nv * nv : nullptr; };
      derivatives_of_rows_[worker].fill(lowered_, q + first * nq, qd + first * nv, tau + first * nv,
                                        states, count - first, of_row(da_dq), of_row(da_dqd),
                                        of_row(da_dtau), a + first * nv, left_over + first);
    });
  }

 protected:
  // f(first, states) of rows that are taken lanes at a time.
  template <class F>
  static void for_each_lanes(int count, const F& f) {
    constexpr int lanes = RowBlock<S>::lanes;
    for (int first = 0; first < count; first += lanes) f(first, std::min(lanes, count - first));
  }

  // Memory of so many workers.
  template <class Worker>
  void reserve(std::vector<Worker>& workers, int count) const {
    while (static_cast<int>(workers.size()) < count) workers.emplace_back(lowered_);
  }

  // Whether the results are finite stands in terms().
  void set_derivatives(const S* q, const S* qd, const S* tau, S* da_dq, S* da_dqd, S* da_dtau,
                       S* a) {
    fast_derivatives(lowered_, q, qd, tau, *derivatives_, da_dq, da_dqd, da_dtau, a);
  }
  const DerivativeTerms<S>& terms() const { return derivatives_->terms; }

  // How wrong a D that derivatives at q stand on can be, where that may count: their sweep has no test of
  // its own, so that the margin of another is asked first.
  RoundingLoss loss_of_derivatives(const S* q) {
    if (!loss_) return {};
    covariance_factor(lowered_, q, loss_->factors);
    return loss_->factors.margin > S(0) ? RoundingLoss{} : loss_->bound.look(lowered_, q);
  }

  const Model<S>& model() const { return model_; }
  const LoweredModel<S>& lowered() const { return lowered_; }

 private:
  struct Torques {
    InverseDynamicsWorkspace<StateLanes<S>> workspace;
    RowBlock<S> rows;

    explicit Torques(const LoweredModel<S>& model) : workspace(model), rows(model) {}
  };

  struct LossOfD {
    FastFactors<S> factors;
    RoundingBound<S> bound;

    explicit LossOfD(const LoweredModel<S>& model) : factors(model), bound(model) {}
  };

  Model<S> model_;
  LoweredModel<S> lowered_;
  std::optional<FastMass<S>> mass_;
  std::optional<InverseDynamicsWorkspace<S>> inverse_dynamics_;
  std::optional<DerivativeWorkspace<S>> derivatives_;
  std::optional<LossOfD> loss_;  // for derivatives, of robots that can lose a D
  // Of rows, for every worker:
  std::vector<Torques> torques_;
  std::vector<MassOfRows<StateLanes<S>>> masses_;
  std::vector<DerivativesOfRows<StateLanes<S>>> derivatives_of_rows_;
};

}  // namespace kalmarm
