// Rows of states in lanes: a state in every lane of a pack, accelerations by the sweep of the form F
// (forms.hpp), and from the sums of a lane whether its answer is accepted (acceptance.hpp). left_over[i] is
// set where that of row i is not, and everywhere where no memory was reserved: another rung is to be
// asked.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "algorithms/fast/engine/acceptance.hpp"
#include "algorithms/fast/engine/engine.hpp"
#include "algorithms/fast/engine/instances.hpp"
#include "algorithms/fast/engine/row_block.hpp"
#include "algorithms/fast/factors/log_det.hpp"
#include "algorithms/model/selection.hpp"

namespace kalmarm {

template <class S, class F>
class RowsInLanes {
 public:
  // Both models are kept by reference. solves: accelerations may come with columns.
  RowsInLanes(const LoweredModel<S>& lowered, const Acceptance<S>& acceptance, Selection selection,
              bool solves)
      : lowered_(lowered),
        acceptance_(acceptance),
        selection_(std::move(selection)),
        solves_(solves),
        width_(lowered.widths(selection_.size())) {}

  // Memory of so many workers for rows of `want`; matrices that are larger than pay off get none.
  void reserve(Want want, int count) {
    switch (want) {
      case Want::acceleration:
        while (static_cast<int>(accelerations_.size()) < count)
          accelerations_.emplace_back(lowered_, solves_);
        return;
      case Want::inverse_dynamics:
        return reserve(torques_, count);
      case Want::mass:
        if (MatrixOfRows<P>::takes(lowered_.nv())) reserve(masses_, count);
        return;
      case Want::derivatives:
        if (DerivativesOfRows<P>::takes(lowered_.nv())) reserve(derivatives_, count);
        return;
      case Want::inverse:
        if (MatrixOfRows<P>::takes(lowered_.nv())) reserve(inverses_, count);
        return;
      case Want::solve:
        return reserve(solves_of_rows_, count);
      case Want::diagonal:
        return reserve(diagonals_, count);
      case Want::log_det:
        return reserve(factors_, count);
      case Want::operational:
      case Want::operational_diagonal:
        while (static_cast<int>(selections_.size()) < count)
          selections_.emplace_back(lowered_, selection_);
        return;
    }
  }

  void answer(int worker, int count, const Call<S>& call, Outcome* outcomes, char* left_over) {
    const auto answer = [&](auto& workers, const auto& of_lanes) {
      std::fill_n(left_over, count, char(workers.empty()));
      if (workers.empty()) return;
      if (outcomes) std::fill_n(outcomes, count, answered_in_lanes<S>());
      for (int first = 0; first < count; first += lanes)
        of_lanes(workers[worker],
                 Rows{call.from(first, width_), std::min(lanes, count - first), count - first,
                      outcomes ? outcomes + first : nullptr, left_over + first});
    };
    switch (call.want) {
      case Want::acceleration:
        return answer(accelerations_, [&](auto& w, const Rows& rows) { acceleration(w, rows); });
      case Want::inverse_dynamics:
        return answer(torques_, [&](auto& w, const Rows& rows) { inverse_dynamics(w, rows); });
      case Want::mass:
        return answer(masses_, [&](auto& w, const Rows& rows) { mass(w, rows); });
      case Want::derivatives:
        return answer(derivatives_, [&](auto& w, const Rows& rows) { derivatives(w, rows); });
      case Want::inverse:
        return answer(inverses_, [&](auto& w, const Rows& rows) { inverse(w, rows); });
      case Want::solve:
        return answer(solves_of_rows_, [&](auto& w, const Rows& rows) { solve(w, rows); });
      case Want::diagonal:
        return answer(diagonals_, [&](auto& w, const Rows& rows) { diagonal(w, rows); });
      case Want::log_det:
        return answer(factors_, [&](auto& w, const Rows& rows) { log_det(w, rows); });
      case Want::operational:
      case Want::operational_diagonal:
        return answer(selections_, [&](auto& w, const Rows& rows) { selected(w, rows); });
    }
  }

 private:
  using P = StateLanes<S>;
  static constexpr int lanes = RowBlock<S>::lanes;

  // What fills the lanes once.
  struct Rows {
    Call<S> call;
    int states, left;  // of `left` rows that can be read
    Outcome* outcomes;
    char* left_over;
  };

  struct Accelerations : RowBlock<S> {
    typename F::template Workspace<P> swept;
    std::optional<RowSolver<P>> columns;
    std::vector<P> r;  // joint noise, from the first call with it on

    Accelerations(const LoweredModel<S>& model, bool solves) : RowBlock<S>(model), swept(model) {
      if (solves) columns.emplace(model);
    }
  };
  struct Torques : RowBlock<S> {
    InverseDynamicsWorkspace<P> workspace;

    explicit Torques(const LoweredModel<S>& model) : RowBlock<S>(model), workspace(model) {}
  };
  struct FactorsOfRows {
    std::vector<P> q;
    ActingInLanes<P> contacts;
    FastFactors<P> factors;

    explicit FactorsOfRows(const LoweredModel<S>& model)
        : q(model.nq()), contacts(model.widths().c, model.widths().l), factors(model) {}

    void factor(const LoweredModel<S>& model, const Rows& rows) {
      to_lanes(rows.call.q, model.nq(), rows.states, rows.left, q);
      covariance_factor(model, q.data(), factors,
                        contacts.load(contacts_of(rows.call), rows.states, rows.left));
    }
  };
  struct Inverses {
    InverseOfRows<P> matrices;
    ForceNoise<P> forces;

    explicit Inverses(const LoweredModel<S>& model) : matrices(model), forces(model) {}
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

  void acceleration(Accelerations& w, const Rows& rows) {
    const Call<S>& call = rows.call;
    w.load(lowered_, call, rows.states, rows.left);
    const Judged<P> by = acceptance_.judge(call.r ? with_noise(w, rows) : swept(w));
    w.store(rows.states, call.out);
    for (int i = 0; i < rows.states; ++i) {
      rows.outcomes[i].error = by.error[i];
      rows.left_over[i] = !acceptance_.accepts(w.swept.margin, by, i);
    }
    if (call.B) columns(w, rows);
  }

  AccelerationSums<P> swept(Accelerations& w) const {
    F::acceleration(lowered_, w.q.data(), w.qd.data(), w.tau.data(), w.swept, w.out.data(),
                    w.acting);
    return F::sums(w.swept);
  }

  AccelerationSums<P> with_noise(Accelerations& w, const Rows& rows) const {
    w.r.resize(lowered_.nv());
    to_lanes(rows.call.r, lowered_.nv(), rows.states, rows.left, w.r);
    covariance_acceleration(lowered_, w.q.data(), w.qd.data(), w.tau.data(), w.r.data(), w.swept,
                            w.out.data(), w.acting);
    AccelerationSums<P> sums = F::sums(w.swept);
    sums.trace = w.swept.trace;
    return sums;
  }

  // X = M^-1 B by the factors of the same sweep.
  void columns(Accelerations& w, const Rows& rows) const {
    const std::ptrdiff_t nv = lowered_.nv();
    const auto solved = [&](const S* b) {
      if (!rows.call.B_of_rows) return w.columns->solve(lowered_, w.swept, b);
      std::vector<P>& x = w.columns->x();
      to_lanes(b, static_cast<int>(nv), rows.states, rows.left, x);
      return w.columns->solve(lowered_, w.swept, x);
    };
    for (int j = 0; j < rows.call.m; ++j) {
      const auto sums = solved(rows.call.B + j * nv);
      for (int i = 0; i < rows.states; ++i) {
        S* const x = rows.call.X + (i * rows.call.m + j) * nv;
        for (int k = 0; k < nv; ++k) x[k] = w.columns->x()[k][i];
        rows.left_over[i] |= !acceptance_.accepts(sums, i);
      }
    }
  }

  void inverse_dynamics(Torques& w, const Rows& rows) const {
    w.load(lowered_, rows.call, rows.states, rows.left);
    fast_inverse_dynamics(lowered_, w.q.data(), w.qd.data(), w.tau.data(), w.workspace,
                          w.out.data(), w.acting);
    w.store(rows.states, rows.call.out);
  }

  void mass(MassOfRows<P>& w, const Rows& rows) const {
    const P check = w.fill(lowered_, rows.call.q, contacts_of(rows.call), rows.states, rows.left,
                           rows.call.out);
    accept(rows, [&](int i) { return check[i] == S(0); });
  }

  void derivatives(DerivativesOfRows<P>& w, const Rows& rows) const {
    const Call<S>& call = rows.call;
    w.fill(lowered_, call.q, call.qd, call.tau, forces_of(call), rows.states, rows.left,
           call.derivatives[0], call.derivatives[1], call.derivatives[2], call.out, rows.left_over);
  }

  // By constants of the robot, or where these say nothing, as of slides, by the state.
  void inverse(Inverses& w, const Rows& rows) const {
    const InverseOfRows<P>& made = w.matrices;
    const P check = w.matrices.fill(lowered_, rows.call.q, contacts_of(rows.call), rows.states,
                                    rows.left, rows.call.out);
    const auto sure = [&](int i) { return check[i] == S(0) && made.factors().margin[i] > S(0); };
    const auto known = [&](int i) { return acceptance_.accepts_columns(made.energy()[i]); };
    accept(rows, [&](int i) { return sure(i) && known(i); });
    bool all = true;
    for (int i = 0; i < rows.states; ++i) all &= known(i) || !sure(i);
    if (all) return;
    const std::ptrdiff_t nv = lowered_.nv();
    const P energy = w.forces.energy_of_columns(lowered_, made.factors(), [&](int k) {
      std::array<S, lanes> diagonal{};
      for (int i = 0; i < rows.states; ++i) diagonal[i] = rows.call.out[i * nv * nv + k * (nv + 1)];
      return P::load(diagonal.data());
    });
    accept(rows,
           [&](int i) { return sure(i) && (known(i) || acceptance_.accepts_all_of(energy[i])); });
  }

  void solve(Solves& w, const Rows& rows) const {
    const int nv = lowered_.nv();
    w.factor(lowered_, rows);
    to_lanes(rows.call.tau, nv, rows.states, rows.left, w.columns.x());
    const auto sums = w.columns.solve(lowered_, w.factors, w.columns.x());
    from_lanes(w.columns.x(), nv, rows.states, rows.call.out);
    accept(rows, [&](int i) { return w.factors.margin[i] > S(0) && acceptance_.accepts(sums, i); });
  }

  void diagonal(Diagonals& w, const Rows& rows) const {
    w.factor(lowered_, rows);
    const P check = w.diagonal.fill(lowered_, w.factors, w.x.data());
    from_lanes(w.x, lowered_.nv(), rows.states, rows.call.out);
    accept(rows, [&](int i) { return check[i] == S(0) && w.factors.margin[i] > S(0); });
  }

  void log_det(FactorsOfRows& w, const Rows& rows) const {
    w.factor(lowered_, rows);
    accept(rows, [&](int i) {
      const S x = rows.call.out[i] = kalmarm::log_det(w.factors, i);
      return x * S(0) == S(0) && w.factors.margin[i] > S(0);
    });
  }

  void selected(Selections& w, const Rows& rows) const {
    w.factor(lowered_, rows);
    const Want want = rows.call.want;
    const P check = w.columns.answer(want, lowered_, w.factors, w.X.data());
    from_lanes(w.X, static_cast<int>(width_.out(want)), rows.states, rows.call.out);
    accept(rows, [&](int i) { return check[i] == S(0) && w.factors.margin[i] > S(0); });
  }

  template <class Accepted>
  static void accept(const Rows& rows, const Accepted& accepted) {
    for (int i = 0; i < rows.states; ++i) rows.left_over[i] = !accepted(i);
  }

  template <class Worker>
  void reserve(std::vector<Worker>& workers, int count) const {
    while (static_cast<int>(workers.size()) < count) workers.emplace_back(lowered_);
  }

  const LoweredModel<S>& lowered_;
  const Acceptance<S>& acceptance_;
  Selection selection_;
  bool solves_;
  Widths width_;
  // Of every worker:
  std::vector<Accelerations> accelerations_;
  std::vector<Torques> torques_;
  std::vector<MassOfRows<P>> masses_;
  std::vector<DerivativesOfRows<P>> derivatives_;
  std::vector<Inverses> inverses_;
  std::vector<Solves> solves_of_rows_;
  std::vector<Diagonals> diagonals_;
  std::vector<Selections> selections_;
  std::vector<FactorsOfRows> factors_;
};

}  // namespace kalmarm
