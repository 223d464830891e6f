// Rows of states in lanes, all calls but accelerations (acceleration_rows.hpp): a state in every lane of
// a pack, and from the sums of a lane whether its answer is accepted (engine/acceptance.hpp). left_over[i]
// is set where that of row i is not, and everywhere where no memory was reserved: another rung is to be
// asked. Pointers are those of Engine.
#pragma once

#include <algorithm>
#include <vector>

#include "algorithms/fast/engine/acceptance.hpp"
#include "algorithms/fast/engine/engine.hpp"
#include "algorithms/fast/engine/instances.hpp"
#include "algorithms/fast/engine/row_block.hpp"
#include "algorithms/fast/factors/log_det.hpp"
#include "algorithms/model/selection.hpp"

namespace kalmarm {

template <class S>
class RowsInLanes {
 public:
  // Both are kept by reference.
  RowsInLanes(const LoweredModel<S>& lowered, const Acceptance<S>& acceptance, Selection selection)
      : lowered_(lowered), acceptance_(acceptance), selection_(std::move(selection)) {}

  // Memory of so many workers for rows of `what`; matrices that are larger than pay off get none.
  void reserve(Want what, int count) {
    switch (what) {
      case Want::inverse_dynamics:
        return reserve(torques_, count);
      case Want::mass:
        if (MatrixBlock<P>::takes(lowered_.nv())) reserve(masses_, count);
        return;
      case Want::derivatives:
        if (DerivativesOfRows<P>::takes(lowered_.nv())) reserve(derivatives_, count);
        return;
      case Want::inverse:
        if (MatrixBlock<P>::takes(lowered_.nv())) reserve(inverses_, count);
        return;
      case Want::solve:
        return reserve(solves_, count);
      case Want::diagonal:
        return reserve(diagonals_, count);
      case Want::log_det:
        return reserve(factors_, count);
      case Want::operational:
        while (static_cast<int>(selections_.size()) < count)
          selections_.emplace_back(lowered_, selection_);
        return;
      case Want::acceleration:
        return;
    }
  }

  void inverse_dynamics(int worker, int count, const S* q, const S* qd, const S* qdd, S* tau) {
    Torques& w = torques_[worker];
    w.rows.for_each(lowered_, count, q, qd, qdd, tau, [&](int, int, const auto& store) {
      fast_inverse_dynamics(lowered_, w.rows.q.data(), w.rows.qd.data(), w.rows.tau_or_qdd.data(),
                            w.workspace, w.rows.out.data());
      store();
    });
  }

  void mass(int worker, int count, const S* q, S* M, Outcome* outcomes, char* left_over) {
    if (masses_.empty()) return leave(count, left_over);
    std::fill_n(outcomes, count, answered_in_lanes<S>());
    const std::ptrdiff_t nq = lowered_.nq(), size = square_of_nv();
    for_each_lanes(count, [&](int first, int states) {
      const auto check =
          masses_[worker].fill(lowered_, q + first * nq, states, count - first, M + first * size);
      for (int i = 0; i < states; ++i) left_over[first + i] = check[i] != S(0);
    });
  }

  void derivatives(int worker, int count, const S* q, const S* qd, const S* tau, S* da_dq,
                   S* da_dqd, S* da_dtau, S* a, Outcome* outcomes, char* left_over) {
    if (derivatives_.empty()) return leave(count, left_over);
    std::fill_n(outcomes, count, answered_in_lanes<S>());
    const std::ptrdiff_t nq = lowered_.nq(), nv = lowered_.nv(), size = square_of_nv();
    for_each_lanes(count, [&](int first, int states) {
      const auto of_row = [&](S* X) { return X ? X + first * size : nullptr; };
      derivatives_[worker].fill(lowered_, q + first * nq, qd + first * nv, tau + first * nv, states,
                                count - first, of_row(da_dq), of_row(da_dqd), of_row(da_dtau),
                                a + first * nv, left_over + first);
    });
  }

  void inverse(int worker, int count, const S* q, S* X, Outcome* outcomes, char* left_over) {
    if (inverses_.empty()) return leave(count, left_over);
    std::fill_n(outcomes, count, answered_in_lanes<S>());
    const std::ptrdiff_t nq = lowered_.nq(), size = square_of_nv();
    InverseOfRows<P>& rows = inverses_[worker];
    for_each_lanes(count, [&](int first, int states) {
      const auto check =
          rows.fill(lowered_, q + first * nq, states, count - first, X + first * size);
      for (int i = 0; i < states; ++i)
        left_over[first + i] = !(check[i] == S(0) && rows.factors().margin[i] > S(0) &&
                                 acceptance_.accepts_columns(rows.energy()[i]));
    });
  }

  void solve(int worker, int count, const S* q, const S* tau, S* x, Outcome* outcomes,
             char* left_over) {
    if (solves_.empty()) return leave(count, left_over);
    std::fill_n(outcomes, count, answered_in_lanes<S>());
    const std::ptrdiff_t nq = lowered_.nq(), nv = lowered_.nv();
    Solves& w = solves_[worker];
    for_each_lanes(count, [&](int first, int states) {
      const int left = count - first;
      w.factor(lowered_, q + first * nq, states, left);
      to_lanes(tau + first * nv, static_cast<int>(nv), states, left, w.columns.x());
      const auto sums = w.columns.solve(lowered_, w.factors, w.columns.x());
      from_lanes(w.columns.x(), static_cast<int>(nv), states, x + first * nv);
      for (int i = 0; i < states; ++i)
        left_over[first + i] = !(w.factors.margin[i] > S(0) && acceptance_.accepts(sums, i));
    });
  }

  void diagonal(int worker, int count, const S* q, S* x, Outcome* outcomes, char* left_over) {
    if (diagonals_.empty()) return leave(count, left_over);
    std::fill_n(outcomes, count, answered_in_lanes<S>());
    const std::ptrdiff_t nq = lowered_.nq(), nv = lowered_.nv();
    Diagonals& w = diagonals_[worker];
    for_each_lanes(count, [&](int first, int states) {
      w.factor(lowered_, q + first * nq, states, count - first);
      const auto check = w.diagonal.fill(lowered_, w.factors, w.x.data());
      from_lanes(w.x, static_cast<int>(nv), states, x + first * nv);
      for (int i = 0; i < states; ++i)
        left_over[first + i] = !(check[i] == S(0) && w.factors.margin[i] > S(0));
    });
  }

  void log_det(int worker, int count, const S* q, S* x, Outcome* outcomes, char* left_over) {
    if (factors_.empty()) return leave(count, left_over);
    std::fill_n(outcomes, count, answered_in_lanes<S>());
    const std::ptrdiff_t nq = lowered_.nq();
    FactorsOfRows& w = factors_[worker];
    for_each_lanes(count, [&](int first, int states) {
      w.factor(lowered_, q + first * nq, states, count - first);
      for (int i = 0; i < states; ++i) {
        S& y = x[first + i] = kalmarm::log_det(w.factors, i);
        left_over[first + i] = !(y * S(0) == S(0) && w.factors.margin[i] > S(0));
      }
    });
  }

  void selected(int worker, int count, const S* q, S* X, Outcome* outcomes, char* left_over) {
    if (selections_.empty()) return leave(count, left_over);
    std::fill_n(outcomes, count, answered_in_lanes<S>());
    const std::ptrdiff_t nq = lowered_.nq();
    const int size = selection_.size() * selection_.size();
    Selections& w = selections_[worker];
    for_each_lanes(count, [&](int first, int states) {
      w.factor(lowered_, q + first * nq, states, count - first);
      const auto check = w.columns.fill(lowered_, w.factors, w.X.data());
      from_lanes(w.X, size, states, X + std::ptrdiff_t(first) * size);
      for (int i = 0; i < states; ++i)
        left_over[first + i] = !(check[i] == S(0) && w.factors.margin[i] > S(0));
    });
  }

 private:
  using P = StateLanes<S>;

  struct Torques {
    InverseDynamicsWorkspace<P> workspace;
    RowBlock<S> rows;

    explicit Torques(const LoweredModel<S>& model) : workspace(model), rows(model) {}
  };
  struct FactorsOfRows {
    std::vector<P> q;
    FastFactors<P> factors;

    explicit FactorsOfRows(const LoweredModel<S>& model) : q(model.nq()), factors(model) {}

    void factor(const LoweredModel<S>& model, const S* rows, int states, int left) {
      to_lanes(rows, model.nq(), states, left, q);
      covariance_factor(model, q.data(), factors);
    }
  };
  struct Solves : FactorsOfRows {
    RowSolver<P> columns;

    explicit Solves(const LoweredModel<S>& model) : FactorsOfRows(model), columns(model) {}
  };
  struct Selections : FactorsOfRows {
    SelectedColumns<P> columns;
    std::vector<P> X;

    Selections(const LoweredModel<S>& model, const Selection& selection)
        : FactorsOfRows(model), X(selection.size() * selection.size()) {
      columns.select(model, selection);
    }
  };
  struct Diagonals : FactorsOfRows {
    InverseDiagonal<P> diagonal;
    std::vector<P> x;

    explicit Diagonals(const LoweredModel<S>& model)
        : FactorsOfRows(model), diagonal(model, InverseDiagonal<P>::Terms::fewest), x(model.nv()) {}
  };

  static void leave(int count, char* left_over) { std::fill_n(left_over, count, char(1)); }

  std::ptrdiff_t square_of_nv() const { return std::ptrdiff_t(lowered_.nv()) * lowered_.nv(); }

  // f(first, states) of rows that are taken lanes at a time.
  template <class F>
  static void for_each_lanes(int count, const F& f) {
    constexpr int lanes = RowBlock<S>::lanes;
    for (int first = 0; first < count; first += lanes) f(first, std::min(lanes, count - first));
  }

  template <class Worker>
  void reserve(std::vector<Worker>& workers, int count) const {
    while (static_cast<int>(workers.size()) < count) workers.emplace_back(lowered_);
  }

  const LoweredModel<S>& lowered_;
  const Acceptance<S>& acceptance_;
  Selection selection_;
  // Of every worker:
  std::vector<Torques> torques_;
  std::vector<MassOfRows<P>> masses_;
  std::vector<DerivativesOfRows<P>> derivatives_;
  std::vector<InverseOfRows<P>> inverses_;
  std::vector<Solves> solves_;
  std::vector<Diagonals> diagonals_;
  std::vector<Selections> selections_;
  std::vector<FactorsOfRows> factors_;
};

}  // namespace kalmarm
