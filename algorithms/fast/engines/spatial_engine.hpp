// The fast path's kernels on 6-D vectors, in the form F (forms.hpp), behind an Outcome: what a
// kernel leaves is looked at by the guard, which answers in its place where it has to.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "algorithms/fast/engine/common_engine.hpp"
#include "algorithms/fast/factors/log_det.hpp"
#include "algorithms/fast/guard/guard.hpp"

namespace kalmarm {

template <class S, class F>
class SpatialEngine final : public CommonEngine<S> {
 public:
  using CommonEngine<S>::derivatives;  // of rows

  SpatialEngine(const RobotModel& robot, const EngineOptions& options)
      : CommonEngine<S>(robot, options), robot_(robot), selection_(options.selection) {
    const auto wants = [&](Want want) { return options.wants(want); };
    if (wants(Want::acceleration) || options.wants_factors() || wants(Want::derivatives))
      guard_.emplace(robot, lowered(), options);
    if (wants(Want::acceleration)) one_.emplace(lowered());
    if (options.wants_factors()) {
      factoring_.emplace(lowered());
      factors_.emplace(lowered());
    }
    if (wants(Want::inverse)) inverse_.emplace(lowered(), options.triangles);
    if (wants(Want::solve)) solver_.emplace(lowered());
    if (wants(Want::diagonal)) diagonal_.emplace(lowered(), InverseDiagonal<S>::Terms::fewest);
    if (options.selection.size() > 0) selected_.select(lowered(), options.selection);
  }

  Outcome forward_dynamics(const S* q, const S* qd, const S* tau, S* a) override {
    F::acceleration(lowered(), q, qd, tau, *one_, a);
    const auto by = guard_->believed(F::sums(*one_));
    const double error = guard_->error(lowered(), q, qd, tau, a, *one_, by);
    if (error >= 0) return {.error = error};
    return guard_->certified().acceleration(q, qd, tau, a);
  }

  void reserve_workers(Want what, int count) override {
    CommonEngine<S>::reserve_workers(what, count);
    EngineOptions rows;
    rows.want = {Want::acceleration};
    while (what == Want::acceleration && static_cast<int>(workers_.size()) < count)
      workers_.emplace_back(lowered(), Guard<S, F>(robot_, lowered(), rows), solver_.has_value());
    if constexpr (F::form == Form::conventional) {
      if (what == Want::inverse && MatrixBlock<StateLanes<S>>::takes(lowered().nv()))
        this->reserve(inverses_, count);
      if (what == Want::solve) this->reserve(solves_, count);
      if (what == Want::diagonal) this->reserve(diagonals_, count);
      if (what == Want::log_det) this->reserve(factors_of_rows_, count);
      while (what == Want::operational && static_cast<int>(selections_.size()) < count)
        selections_.emplace_back(lowered(), selection_);
    }
  }

  int forward_dynamics(int worker, int count, const S* q, const S* qd, const S* tau, S* a,
                       Outcome* outcomes) override {
    Worker& w = workers_[worker];
    const std::ptrdiff_t nq = lowered().nq(), nv = lowered().nv();
    int failed = 0;
    std::fill_n(outcomes, count, Outcome{});
    sweep_rows(w, count, q, qd, tau, a, [&](int first, int states, const auto& by) {
      for (int lane = 0; lane < states; ++lane) {
        const std::ptrdiff_t i = first + lane;
        const S *const q_i = q + i * nq, *const qd_i = qd + i * nv, *const tau_i = tau + i * nv;
        const double error =
            w.guard.error(lowered(), q_i, qd_i, tau_i, a + i * nv, w.workspace, by, lane);
        outcomes[i].error = error;
        if (error >= 0) continue;
        outcomes[i] = w.guard.certified().acceleration(q_i, qd_i, tau_i, a + i * nv);
        failed += !outcomes[i];
      }
    });
    return failed;
  }

  Outcome forward_dynamics(const S* q, const S* qd, const S* tau, S* a, int m, const S* B,
                           S* X) override {
    if constexpr (F::form == Form::conventional) {
      const Outcome out = forward_dynamics(q, qd, tau, a);
      bool by_sweep = out && !out.recomputed;
      if (by_sweep)
        solve_columns(*one_, m, B, X,
                      [&](const SolveSums<S>&, std::ptrdiff_t) { by_sweep = false; });
      if (by_sweep) return out;
    }
    return Engine<S>::forward_dynamics(q, qd, tau, a, m, B, X);
  }

  void forward_dynamics(int worker, int count, const S* q, const S* qd, const S* tau, S* a,
                        Outcome* outcomes, int m, const S* B, S* X, char* left_over) override {
    if constexpr (F::form == Form::conventional) {
      Worker& w = workers_[worker];
      const auto& swept = w.workspace;
      const std::ptrdiff_t nv = lowered().nv(), size = nv * m;
      sweep_rows(w, count, q, qd, tau, a, [&](int first, int states, const auto& by) {
        for (int lane = 0; lane < states; ++lane) {
          outcomes[first + lane] = {.error = by.error[lane]};
          left_over[first + lane] = !w.guard.vouched(swept.margin, by, lane);
        }
        for (int j = 0; j < m; ++j) {
          const auto sums = w.columns->solve(lowered(), swept, B + j * nv);
          for (int lane = 0; lane < states; ++lane) {
            S* const x = X + (first + lane) * size + j * nv;
            for (int k = 0; k < nv; ++k) x[k] = w.columns->x()[k][lane];
            left_over[first + lane] |=
                !w.guard.believed({sums.noise[lane], sums.energy[lane], sums.squares[lane]});
          }
        }
      });
    } else {
      Engine<S>::forward_dynamics(worker, count, q, qd, tau, a, outcomes, m, B, X, left_over);
    }
  }

  // What the sums of a lane do not vouch for gets the second look with its own joint noise.
  void forward_dynamics(int worker, int count, const S* q, const S* qd, const S* tau, const S* r,
                        S* a, Outcome* outcomes, char* left_over) override {
    if constexpr (F::form == Form::conventional && !F::at_rest) {
      Worker& w = workers_[worker];
      if (!w.noisy) w.noisy.emplace(lowered());
      auto& swept = w.workspace;
      const std::ptrdiff_t nq = lowered().nq(), nv = lowered().nv();
      std::fill_n(left_over, count, char(0));
      w.rows.for_each(lowered(), count, q, qd, tau, a,
                      [&](int first, int states, const auto& store) {
                        to_lanes(r + first * nv, nv, states, count - first, w.noisy->r);
                        covariance_acceleration(lowered(), w.rows.q.data(), w.rows.qd.data(),
                                                w.rows.tau_or_qdd.data(), w.noisy->r.data(), swept,
                                                w.rows.out.data());
                        store();
                        const auto by = w.guard.believed(F::sums(swept), swept.trace);
                        for (int lane = 0; lane < states; ++lane) {
                          const std::ptrdiff_t i = first + lane;
                          double error = by.error[lane];
                          if (!w.guard.vouched(swept.margin, by, lane)) {
                            w.noisy->model.set_noise(lowered(), r + i * nv);
                            error = w.guard.error(w.noisy->model, q + i * nq, qd + i * nv,
                                                  tau + i * nv, a + i * nv, swept, by, lane);
                            left_over[i] = !(error >= 0);
                          }
                          outcomes[i] = {.error = error};
                        }
                      });
    } else {
      Engine<S>::forward_dynamics(worker, count, q, qd, tau, r, a, outcomes, left_over);
    }
  }

  Outcome inverse(const S* q, S* X) override {
    set_factors(q);
    const S check = inverse_->fill(lowered(), *factors_, X);
    const auto diagonal = [&](int k) { return X[k * (lowered().nv() + std::size_t(1))]; };
    const bool believed = guard_->believed_columns(energy_of_columns(*factors_, X)) ||
                          guard_->believed_columns(lowered(), *factors_, diagonal);
    return !believed || may_be_wrong(q, check) ? guard_->certified().inverse(q, X) : Outcome{};
  }

  void inverse(int worker, int count, const S* q, S* X, char* left_over) override {
    if (inverses_.empty()) return Engine<S>::inverse(worker, count, q, X, left_over);
    const std::ptrdiff_t nq = lowered().nq(),
                         size = std::ptrdiff_t(lowered().nv()) * lowered().nv();
    auto& rows = inverses_[worker];
    this->for_each_lanes(count, [&](int first, int states) {
      const auto check =
          rows.fill(lowered(), q + first * nq, states, count - first, X + first * size);
      for (int i = 0; i < states; ++i)
        left_over[first + i] = !(check[i] == S(0) && rows.factors().margin[i] > S(0) &&
                                 guard_->believed_columns(rows.energy()[i]));
    });
  }

  void solve(int worker, int count, const S* q, const S* tau, S* x, char* left_over) override {
    if (solves_.empty()) return Engine<S>::solve(worker, count, q, tau, x, left_over);
    const std::ptrdiff_t nq = lowered().nq(), nv = lowered().nv();
    Solves& w = solves_[worker];
    this->for_each_lanes(count, [&](int first, int states) {
      const int left = count - first;
      w.factor(lowered(), q + first * nq, states, left);
      to_lanes(tau + first * nv, static_cast<int>(nv), states, left, w.columns.x());
      const auto sums = w.columns.solve(lowered(), w.factors, w.columns.x());
      from_lanes(w.columns.x(), static_cast<int>(nv), states, x + first * nv);
      for (int i = 0; i < states; ++i)
        left_over[first + i] =
            !(w.factors.margin[i] > S(0) &&
              guard_->believed({sums.noise[i], sums.energy[i], sums.squares[i]}));
    });
  }

  void diagonal(int worker, int count, const S* q, S* x, char* left_over) override {
    if (diagonals_.empty()) return Engine<S>::diagonal(worker, count, q, x, left_over);
    const std::ptrdiff_t nq = lowered().nq(), nv = lowered().nv();
    Diagonals& w = diagonals_[worker];
    this->for_each_lanes(count, [&](int first, int states) {
      w.factor(lowered(), q + first * nq, states, count - first);
      const auto check = w.diagonal.fill(lowered(), w.factors, w.x.data());
      from_lanes(w.x, static_cast<int>(nv), states, x + first * nv);
      for (int i = 0; i < states; ++i)
        left_over[first + i] = !(check[i] == S(0) && w.factors.margin[i] > S(0));
    });
  }

  void log_det(int worker, int count, const S* q, S* x, char* left_over) override {
    if (factors_of_rows_.empty()) return Engine<S>::log_det(worker, count, q, x, left_over);
    const std::ptrdiff_t nq = lowered().nq();
    FactorsOfRows& w = factors_of_rows_[worker];
    this->for_each_lanes(count, [&](int first, int states) {
      w.factor(lowered(), q + first * nq, states, count - first);
      for (int i = 0; i < states; ++i) {
        S& y = x[first + i] = kalmarm::log_det(w.factors, i);
        left_over[first + i] = !(y * S(0) == S(0) && w.factors.margin[i] > S(0));
      }
    });
  }

  void selected(int worker, int count, const S* q, S* X, char* left_over) override {
    if (selections_.empty()) return Engine<S>::selected(worker, count, q, X, left_over);
    const std::ptrdiff_t nq = lowered().nq();
    const int size = selection_.size() * selection_.size();
    Selections& w = selections_[worker];
    this->for_each_lanes(count, [&](int first, int states) {
      w.factor(lowered(), q + first * nq, states, count - first);
      const auto check = w.columns.fill(lowered(), w.factors, w.X.data());
      from_lanes(w.X, size, states, X + std::ptrdiff_t(first) * size);
      for (int i = 0; i < states; ++i)
        left_over[first + i] = !(check[i] == S(0) && w.factors.margin[i] > S(0));
    });
  }

  Outcome factor(const S* q) override {
    set_factors(q);
    S check = S(0);
    for (const auto& at : factors_->links) check += at.inverse_D * S(0);
    by_certified_ = may_be_wrong(q, check);
    guard_->keep(lowered(), q);
    return by_certified_ ? guard_->certified().factor(q) : Outcome{};
  }

  Outcome solve(int columns, const S* taus, S* X) override {
    if (by_certified_) return guard_->certified().solve(columns, taus, X);
    Outcome out;
    solve_columns(*factors_, columns, taus, X, [&](const SolveSums<S>& of_x, std::ptrdiff_t at) {
      out = worse(out, second_solve(of_x, taus + at, X + at));
    });
    return out;
  }

  Outcome diagonal(const S* q, S* x) override {
    set_factors(q);
    const S check = diagonal_->fill(lowered(), *factors_, x);
    return may_be_wrong(q, check) ? guard_->certified().diagonal(q, x) : Outcome{};
  }

  Outcome log_det(const S* q, S& x) override {
    set_factors(q);
    x = kalmarm::log_det(*factors_);
    return may_be_wrong(q, S(x * S(0))) ? guard_->certified().log_det(q, x) : Outcome{};
  }

  Outcome selected(const S* q, S* X) override {
    set_factors(q);
    const S check = selected_.fill(lowered(), *factors_, X);
    return may_be_wrong(q, check) ? guard_->certified().selected(q, X) : Outcome{};
  }

  // By the covariance form, whatever F is. The certified form has no derivatives: it says whether M
  // is singular. Where a D may be wrong by 1 per cent, they warn.
  Outcome derivatives(const S* q, const S* qd, const S* tau, S* da_dq, S* da_dqd, S* da_dtau,
                      S* a) override {
    this->set_derivatives(q, qd, tau, da_dq, da_dqd, da_dtau, a);
    const S check = this->terms().check;
    const RoundingLoss loss = this->loss_of_derivatives(q);
    if (check == S(0) && loss.bound < error_of_D_let_pass<S>) return {};
    const Outcome out = guard_->certified().factor(q);
    if (out && check != S(0)) return {.status = Outcome::Status::not_finite};
    return out ? of_derivatives(out, loss) : out;
  }

 private:
  using CommonEngine<S>::lowered;
  using CommonEngine<S>::model;

  struct Worker {
    typename F::template Workspace<StateLanes<S>> workspace;
    RowBlock<S> rows;
    Guard<S, F> guard;
    std::optional<RowSolver<StateLanes<S>>> columns;

    // Of rows with joint noise of their own: of all lanes, and a model with that of one.
    struct Noisy {
      std::vector<StateLanes<S>> r;
      LoweredModel<S> model;

      explicit Noisy(const LoweredModel<S>& m) : r(m.nv()), model(m) {}
    };
    std::optional<Noisy> noisy;  // from the first call on

    Worker(const LoweredModel<S>& model, Guard<S, F> g, bool solves)
        : workspace(model), rows(model), guard(std::move(g)) {
      if (solves) columns.emplace(model);
    }
  };

  struct FactorsOfRows {
    std::vector<StateLanes<S>> q;
    FastFactors<StateLanes<S>> factors;

    explicit FactorsOfRows(const LoweredModel<S>& model) : q(model.nq()), factors(model) {}

    void factor(const LoweredModel<S>& model, const S* rows, int states, int left) {
      to_lanes(rows, model.nq(), states, left, q);
      covariance_factor(model, q.data(), factors);
    }
  };
  struct Solves : FactorsOfRows {
    RowSolver<StateLanes<S>> columns;

    explicit Solves(const LoweredModel<S>& model) : FactorsOfRows(model), columns(model) {}
  };
  struct Selections : FactorsOfRows {
    SelectedColumns<StateLanes<S>> columns;
    std::vector<StateLanes<S>> X;

    Selections(const LoweredModel<S>& model, const Selection& selection)
        : FactorsOfRows(model), X(selection.size() * selection.size()) {
      columns.select(model, selection);
    }
  };
  struct Diagonals : FactorsOfRows {
    InverseDiagonal<StateLanes<S>> diagonal;
    std::vector<StateLanes<S>> x;

    explicit Diagonals(const LoweredModel<S>& model)
        : FactorsOfRows(model),
          diagonal(model, InverseDiagonal<StateLanes<S>>::Terms::fewest),
          x(model.nv()) {}
  };

  // A block of rows in lanes after the other: f(first, states, what is believed of them), whose a is
  // stored.
  template <class Use>
  void sweep_rows(Worker& w, int count, const S* q, const S* qd, const S* tau, S* a, const Use& f) {
    w.rows.for_each(lowered(), count, q, qd, tau, a, [&](int first, int states, const auto& store) {
      F::acceleration(lowered(), w.rows.q.data(), w.rows.qd.data(), w.rows.tau_or_qdd.data(),
                      w.workspace, w.rows.out.data());
      store();
      f(first, states, w.guard.believed(F::sums(w.workspace)));
    });
  }

  // X = M^-1 taus by factors that are kept or that a sweep has left; doubt(sums, where it starts) of
  // every column that its sums do not vouch for.
  template <class Factors, class Doubt>
  void solve_columns(const Factors& factors, int columns, const S* taus, S* X, const Doubt& doubt) {
    const std::ptrdiff_t nv = lowered().nv();
    for (int first = 0; first < columns; first += FactorSolver<S>::lanes) {
      const int left = columns - first, count = std::min(left, FactorSolver<S>::lanes);
      const std::ptrdiff_t start = first * nv;
      const auto sums = solver_->solve(lowered(), factors, count, left, taus + start, X + start);
      for (int j = 0; j < count; ++j) {
        const SolveSums<S> of_x = {sums.noise[j], sums.energy[j], sums.squares[j]};
        if (!(factors.margin > S(0) && guard_->believed(of_x))) doubt(of_x, start + j * nv);
      }
    }
  }

  // Of one column that its sums do not vouch for.
  Outcome second_solve(const SolveSums<S>& of_x, const S* tau, S* x) {
    const auto& z = solver_->forces(lowered(), *factors_, tau);
    const bool wrong =
        guard_->may_be_wrong(lowered(), *factors_, of_x, [&](int k) { return z[k]; });
    return wrong ? guard_->certified_column(lowered().nv(), tau, x) : Outcome{};
  }

  void set_factors(const S* q) { factoring_->factor(lowered(), q, *factors_); }
  bool may_be_wrong(const S* q, const S& check) {
    return guard_->may_be_wrong(lowered(), q, *factors_, check);
  }

  RobotModel robot_;
  Selection selection_;
  std::optional<Guard<S, F>> guard_;
  std::optional<typename F::template Workspace<S>> one_;
  // Of rows, for every worker:
  std::vector<Worker> workers_;
  std::vector<InverseOfRows<StateLanes<S>>> inverses_;
  std::vector<Solves> solves_;
  std::vector<Diagonals> diagonals_;
  std::vector<Selections> selections_;
  std::vector<FactorsOfRows> factors_of_rows_;
  std::optional<typename F::template Factoring<S>> factoring_;
  std::optional<FastFactors<S>> factors_;
  std::optional<InverseColumns<S>> inverse_;
  std::optional<FactorSolver<S>> solver_;
  std::optional<InverseDiagonal<S>> diagonal_;
  SelectedColumns<S> selected_;
  bool by_certified_ = false;  // the factors that are kept
};

}  // namespace kalmarm
