// Accelerations of rows of states in lanes, by the sweep of the form F (forms.hpp). Every lane has its
// estimated error, and left_over is set where it is not accepted (engine/acceptance.hpp). Pointers are
// those of Engine.
#pragma once

#include <optional>
#include <vector>

#include "algorithms/fast/engine/acceptance.hpp"
#include "algorithms/fast/engine/engine.hpp"
#include "algorithms/fast/engine/instances.hpp"
#include "algorithms/fast/engine/row_block.hpp"

namespace kalmarm {

template <class S, class F>
class AccelerationRows {
 public:
  // Both are kept by reference. solves: X = M^-1 B is wanted too.
  AccelerationRows(const LoweredModel<S>& lowered, const Acceptance<S>& acceptance, bool solves)
      : lowered_(lowered), acceptance_(acceptance), solves_(solves) {}

  void reserve(int count) {
    while (static_cast<int>(workers_.size()) < count) workers_.emplace_back(lowered_, solves_);
  }

  void forward_dynamics(int worker, int count, const S* q, const S* qd, const S* tau, S* a,
                        Outcome* outcomes, char* left_over) {
    sweep(worker, count, q, qd, tau, a, outcomes, left_over, [](int, int, const auto&) {});
  }

  // The same and X = M^-1 B of the m columns of B, by the factors of the same sweep.
  void forward_dynamics(int worker, int count, const S* q, const S* qd, const S* tau, S* a,
                        Outcome* outcomes, int m, const S* B, S* X, char* left_over) {
    Worker& w = workers_[worker];
    const std::ptrdiff_t nv = lowered_.nv(), size = nv * m;
    sweep(worker, count, q, qd, tau, a, outcomes, left_over,
          [&](int first, int states, const auto& swept) {
            for (int j = 0; j < m; ++j) {
              const auto sums = w.columns->solve(lowered_, swept, B + j * nv);
              for (int lane = 0; lane < states; ++lane) {
                S* const x = X + (first + lane) * size + j * nv;
                for (int k = 0; k < nv; ++k) x[k] = w.columns->x()[k][lane];
                left_over[first + lane] |= !acceptance_.accepts(sums, lane);
              }
            }
          });
  }

  // With joint noise r (nv a row) in the place of the robot's.
  void forward_dynamics(int worker, int count, const S* q, const S* qd, const S* tau, const S* r,
                        S* a, Outcome* outcomes, char* left_over) {
    Worker& w = workers_[worker];
    const std::ptrdiff_t nv = lowered_.nv();
    w.r.resize(nv);
    w.rows.for_each(lowered_, count, q, qd, tau, a, [&](int first, int states, const auto& store) {
      to_lanes(r + first * nv, nv, states, count - first, w.r);
      covariance_acceleration(lowered_, w.rows.q.data(), w.rows.qd.data(), w.rows.tau_or_qdd.data(),
                              w.r.data(), w.swept, w.rows.out.data());
      store();
      AccelerationSums<P> sums = F::sums(w.swept);
      sums.trace = w.swept.trace;
      judge(w, acceptance_.judge(sums), first, states, outcomes, left_over);
    });
  }

 private:
  using P = StateLanes<S>;
  using Swept = typename F::template Workspace<P>;

  struct Worker {
    Swept swept;
    RowBlock<S> rows;
    std::optional<RowSolver<P>> columns;
    std::vector<P> r;  // joint noise, from the first call with it on

    Worker(const LoweredModel<S>& model, bool solves) : swept(model), rows(model) {
      if (solves) columns.emplace(model);
    }
  };

  // use(first, states, what the sweep has left) of every block of rows.
  template <class Use>
  void sweep(int worker, int count, const S* q, const S* qd, const S* tau, S* a, Outcome* outcomes,
             char* left_over, const Use& use) {
    Worker& w = workers_[worker];
    w.rows.for_each(lowered_, count, q, qd, tau, a, [&](int first, int states, const auto& store) {
      F::acceleration(lowered_, w.rows.q.data(), w.rows.qd.data(), w.rows.tau_or_qdd.data(),
                      w.swept, w.rows.out.data());
      store();
      judge(w, acceptance_.judge(F::sums(w.swept)), first, states, outcomes, left_over);
      use(first, states, w.swept);
    });
  }

  void judge(const Worker& w, const Judged<P>& by, int first, int states, Outcome* outcomes,
             char* left_over) const {
    for (int lane = 0; lane < states; ++lane) {
      outcomes[first + lane] = answered_in_lanes<S>();
      outcomes[first + lane].error = by.error[lane];
      left_over[first + lane] = !acceptance_.accepts(w.swept.margin, by, lane);
    }
  }

  const LoweredModel<S>& lowered_;
  const Acceptance<S>& acceptance_;
  bool solves_;
  std::vector<Worker> workers_;
};

}  // namespace kalmarm
