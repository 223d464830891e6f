// Of Execution (execution.hpp) what answers rows of states: blocks of rows to workers, and in a block
// first what the engines answer together, then, one after another, the rows that they leave over.
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "algorithms/dynamics/execution.hpp"

namespace kalmarm {

template <class T>
int Execution<T>::forward_dynamics(int count, const T* q, const T* qd, const T* tau, T* a,
                                   Outcome* outcomes, int threads) {
  need(Want::acceleration);
  reserve(Want::acceleration, threads);
  failed_.assign(threads, 0);
  for_each_block(count, threads, [&](int worker, int first, int states) {
    const std::ptrdiff_t i = first, nv = plan_.nv;
    const T* const velocities = qd + i * nv;
    if (whole_ && !at_rest_) {
      failed_[worker] += whole_->forward_dynamics(worker, states, q + i * nq_, velocities,
                                                  tau + i * nv, a + i * nv, outcomes + first);
      return;
    }
    std::fill_n(outcomes + first, states, Outcome{});
    for (PartState<T>& p : parts_) {
      typename PartState<T>::Rows& rows = p.rows[worker];
      p.gather_rows(rows, states, q + i * nq_, nq_, velocities, tau + i * nv, nv);
      p.engine->forward_dynamics(worker, states, rows.q.data(), rows.qd.data(),
                                 rows.tau_or_qdd.data(), rows.out.data(), rows.outcomes.data());
      for (int state = 0; state < states; ++state) {
        p.asked(rows.out.data() + state * p.nv, a + (i + state) * asked_);
        Outcome& out = outcomes[first + state];
        if (out) out = worse(out, p.of_whole(rows.outcomes[state]));
      }
    }
    for (int state = 0; state < states; ++state) failed_[worker] += !outcomes[first + state];
  });
  return failed();
}

template <class T>
int Execution<T>::forward_dynamics(int count, const T* q, const T* qd, const T* tau, const T* r,
                                   T* a, Outcome* outcomes, int threads) {
  need(Want::acceleration);
  reserve(Want::acceleration, threads);
  failed_.assign(threads, 0);
  left_over_.assign(count, 0);
  for_each_block(count, threads, [&](int worker, int first, int states) {
    const std::ptrdiff_t at = first, nv = plan_.nv;
    if (whole_) {
      whole_->forward_dynamics(worker, states, q + at * nq_, qd + at * nv, tau + at * nv,
                               r + at * nv, a + at * nv, outcomes + first,
                               left_over_.data() + first);
      for (std::ptrdiff_t i = at; i < at + states; ++i)
        if (left_over_[i])
          outcomes[i] = parts_[0].of_whole(
              parts_[0].of_noise(r + i * nv, q + i * nq_, qd + i * nv, tau + i * nv, a + i * nv));
    } else {
      std::fill_n(outcomes + first, states, Outcome{});
      for (PartState<T>& p : parts_) {
        typename PartState<T>::Rows& rows = p.rows[worker];
        p.gather_rows(rows, states, q + at * nq_, nq_, qd + at * nv, tau + at * nv, nv,
                      r + at * nv);
        p.engine->forward_dynamics(worker, states, rows.q.data(), rows.qd.data(),
                                   rows.tau_or_qdd.data(), rows.r.data(), rows.out.data(),
                                   rows.outcomes.data(), rows.left_over.data());
        for (std::ptrdiff_t i = 0; i < states; ++i) {
          T* const out = rows.out.data() + i * p.nv;
          if (rows.left_over[i])
            rows.outcomes[i] =
                p.of_noise(rows.r.data() + i * p.nv, rows.q.data() + i * p.nq,
                           rows.qd.data() + i * p.nv, rows.tau_or_qdd.data() + i * p.nv, out);
          p.asked(out, a + (at + i) * asked_);
          Outcome& of_row = outcomes[first + i];
          if (of_row) of_row = worse(of_row, p.of_whole(rows.outcomes[i]));
        }
      }
    }
    for (int state = 0; state < states; ++state) failed_[worker] += !outcomes[first + state];
  });
  return failed();
}

template <class T>
int Execution<T>::forward_dynamics(int count, const T* q, const T* qd, const T* tau, T* a, int m,
                                   const T* B, T* X, Outcome* outcomes, int threads) {
  need(Want::solve);
  need(Want::acceleration);
  const std::ptrdiff_t nv = plan_.nv, size = std::ptrdiff_t(asked_) * m;
  left_over_.assign(count, 1);
  if (whole_ && !at_rest_) {
    reserve(Want::acceleration, threads);
    for_each_block(count, threads, [&](int worker, int first, int states) {
      const std::ptrdiff_t i = first;
      whole_->forward_dynamics(worker, states, q + i * nq_, qd + i * nv, tau + i * nv, a + i * nv,
                               outcomes + first, m, B, X + i * size, left_over_.data() + first);
    });
  }
  int failed = 0;
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    if (!left_over_[i]) continue;
    outcomes[i] = forward_dynamics(q + i * nq_, qd + i * nv, tau + i * nv, a + i * asked_, m, B,
                                   X + i * size);
    failed += !outcomes[i];
  }
  return failed;
}

template <class T>
void Execution<T>::inverse_dynamics(int count, const T* q, const T* qd, const T* qdd, T* tau,
                                    int threads) {
  need(Want::inverse_dynamics);
  reserve(Want::inverse_dynamics, threads);
  for_each_block(count, threads, [&](int worker, int first, int states) {
    const std::ptrdiff_t i = first, nv = plan_.nv;
    if (whole_ && !at_rest_) {
      whole_->inverse_dynamics(worker, states, q + i * nq_, qd + i * nv, qdd + i * nv,
                               tau + i * nv);
      return;
    }
    for (PartState<T>& p : parts_) {
      typename PartState<T>::Rows& rows = p.rows[worker];
      p.gather_rows(rows, states, q + i * nq_, nq_, qd + i * nv, qdd + i * nv, nv);
      p.engine->inverse_dynamics(worker, states, rows.q.data(), rows.qd.data(),
                                 rows.tau_or_qdd.data(), rows.out.data());
      for (int state = 0; state < states; ++state)
        p.asked(rows.out.data() + state * p.nv, tau + (i + state) * asked_);
    }
  });
}

template <class T>
int Execution<T>::mass(int count, const T* q, T* M, Outcome* outcomes, int threads) {
  const std::ptrdiff_t size = std::ptrdiff_t(asked_) * asked_;
  return answer_rows(
      Want::mass, count, outcomes, threads,
      [&](int worker, std::ptrdiff_t i, int states) {
        if (whole_)
          whole_->mass(worker, states, q + i * nq_, M + i * size, outcomes + i,
                       left_over_.data() + i);
        else
          matrices_of_parts(Want::mass, worker, i, states, q, M, outcomes,
                            [&](Engine<T>& engine, auto& rows) {
                              engine.mass(worker, states, rows.q.data(), rows.matrices.data(),
                                          rows.outcomes.data(), rows.left_over.data());
                            });
      },
      [&](Execution& one, std::ptrdiff_t i) {
        one.mass(q + i * nq_, M + i * size);
        const Eigen::Map<const VectorX<T>> numbers(M + i * size, size);
        const bool finite = (numbers * T(0)).sum() == T(0);  // several at once
        return Outcome{.status = finite ? Outcome::Status::ok : Outcome::Status::not_finite};
      });
}

template <class T>
int Execution<T>::inverse(int count, const T* q, T* X, Outcome* outcomes, int threads) {
  const std::ptrdiff_t size = std::ptrdiff_t(asked_) * asked_;
  return answer_rows(
      Want::inverse, count, outcomes, threads,
      [&](int worker, std::ptrdiff_t i, int states) {
        if (whole_)
          whole_->inverse(worker, states, q + i * nq_, X + i * size, outcomes + i,
                          left_over_.data() + i);
        else
          matrices_of_parts(Want::inverse, worker, i, states, q, X, outcomes,
                            [&](Engine<T>& engine, auto& rows) {
                              engine.inverse(worker, states, rows.q.data(), rows.matrices.data(),
                                             rows.outcomes.data(), rows.left_over.data());
                            });
      },
      [&](Execution& one, std::ptrdiff_t i) { return one.inverse(q + i * nq_, X + i * size); });
}

template <class T>
int Execution<T>::solve(int count, const T* q, const T* tau, T* x, Outcome* outcomes, int threads) {
  return answer_rows(
      Want::solve, count, outcomes, threads,
      [&](int worker, std::ptrdiff_t i, int states) {
        if (whole_)
          whole_->solve(worker, states, q + i * nq_, tau + i * asked_, x + i * asked_, outcomes + i,
                        left_over_.data() + i);
        else
          vectors_of_parts(worker, i, states, q, x, outcomes, [&](PartState<T>& p, auto& rows) {
            p.gather_asked(rows, states, tau + i * asked_, asked_);
            p.engine->solve(worker, states, rows.q.data(), rows.tau_or_qdd.data(), rows.out.data(),
                            rows.outcomes.data(), rows.left_over.data());
          });
      },
      [&](Execution& one, std::ptrdiff_t i) {
        return one.solve_at(q + i * nq_, tau + i * asked_, x + i * asked_);
      });
}

template <class T>
int Execution<T>::diagonal(int count, const T* q, T* x, Outcome* outcomes, int threads) {
  return answer_rows(
      Want::diagonal, count, outcomes, threads,
      [&](int worker, std::ptrdiff_t i, int states) {
        if (!answers_in_part()) return;
        if (whole_)
          whole_->diagonal(worker, states, q + i * nq_, x + i * asked_, outcomes + i,
                           left_over_.data() + i);
        else
          vectors_of_parts(worker, i, states, q, x, outcomes, [&](PartState<T>& p, auto& rows) {
            p.engine->diagonal(worker, states, rows.q.data(), rows.out.data(), rows.outcomes.data(),
                               rows.left_over.data());
          });
      },
      [&](Execution& one, std::ptrdiff_t i) { return one.diagonal(q + i * nq_, x + i * asked_); });
}

template <class T>
int Execution<T>::log_det(int count, const T* q, T* x, Outcome* outcomes, int threads) {
  const bool sums_D =
      std::all_of(parts_.begin(), parts_.end(), [](const PartState<T>& p) { return p.sums_D; });
  return answer_rows(
      Want::log_det, count, outcomes, threads,
      [&](int worker, std::ptrdiff_t i, int states) {
        if (!sums_D) return;
        if (whole_)
          return whole_->log_det(worker, states, q + i * nq_, x + i, outcomes + i,
                                 left_over_.data() + i);
        begin_rows(states, outcomes + i, left_over_.data() + i);
        std::fill_n(x + i, states, T(0));
        for (PartState<T>& p : parts_) {
          typename PartState<T>::Rows& rows = p.rows[worker];
          p.gather_q(rows, states, q + i * nq_, nq_);
          p.engine->log_det(worker, states, rows.q.data(), rows.log_det.data(),
                            rows.outcomes.data(), rows.left_over.data());
          for (int state = 0; state < states; ++state) {
            merge(p, rows, state, outcomes[i + state], left_over_[i + state]);
            x[i + state] += rows.log_det[state];
          }
        }
      },
      [&](Execution& one, std::ptrdiff_t i) { return one.log_det(q + i * nq_, x[i]); });
}

template <class T>
int Execution<T>::operational(int count, const T* q, T* X, Outcome* outcomes, int threads) {
  const std::ptrdiff_t size = std::ptrdiff_t(rows_) * rows_;
  return answer_rows(
      Want::operational, count, outcomes, threads,
      [&](int worker, std::ptrdiff_t i, int states) {
        constexpr int at_once = PartState<T>::rows_at_once;
        if (!answers_in_part()) return;
        for (int first = 0; first < states; first += at_once)
          operational_of_parts(worker, std::min(at_once, states - first), q + (i + first) * nq_,
                               X + (i + first) * size, outcomes + i + first,
                               left_over_.data() + i + first);
      },
      [&](Execution& one, std::ptrdiff_t i) { return one.operational(q + i * nq_, X + i * size); });
}

template <class T>
int Execution<T>::derivatives(int count, const T* q, const T* qd, const T* tau, T* dq, T* dqd,
                              T* dtau, T* a, Outcome* outcomes, int threads) {
  const std::ptrdiff_t nv = plan_.nv, size = std::ptrdiff_t(asked_) * asked_;
  const auto of_row = [size](T* X, std::ptrdiff_t i) { return X ? X + i * size : nullptr; };
  return answer_rows(
      Want::derivatives, count, outcomes, threads,
      [&](int worker, std::ptrdiff_t i, int states) {
        const T *const q_i = q + i * nq_, *const qd_i = qd + i * nv, *const tau_i = tau + i * nv;
        T* const X[] = {of_row(dq, i), of_row(dqd, i), of_row(dtau, i)};
        if (whole_ && !at_rest_)
          whole_->derivatives(worker, states, q_i, qd_i, tau_i, X[0], X[1], X[2], a + i * nv,
                              outcomes + i, left_over_.data() + i);
        else
          derivatives_of_parts(worker, states, q_i, qd_i, tau_i, X, a + i * asked_, outcomes + i,
                               left_over_.data() + i);
      },
      [&](Execution& one, std::ptrdiff_t i) {
        return one.derivatives(q + i * nq_, qd + i * nv, tau + i * nv, of_row(dq, i),
                               of_row(dqd, i), of_row(dtau, i), a + i * asked_);
      });
}

template <class T>
template <class Call>
void Execution<T>::matrices_of_parts(Want what, int worker, std::ptrdiff_t first, int states,
                                     const T* q, T* X, Outcome* outcomes, const Call& call) {
  const std::ptrdiff_t size = std::ptrdiff_t(asked_) * asked_;
  for (const PartState<T>& p : parts_)
    if (p.numbers_of_matrices(what) == 0) return;  // all are left over
  begin_rows(states, outcomes + first, left_over_.data() + first);
  std::fill_n(X + first * size, states * size, T(0));
  for (PartState<T>& p : parts_) {
    typename PartState<T>::Rows& rows = p.rows[worker];
    p.gather_q(rows, states, q + first * nq_, nq_);
    call(*p.engine, rows);
    for (std::ptrdiff_t i = 0; i < states; ++i) {
      merge(p, rows, i, outcomes[first + i], left_over_[first + i]);
      p.asked.block(rows.matrices.data() + i * p.nv * p.nv, p.nv, X + (first + i) * size, asked_);
    }
  }
}

template <class T>
template <class Call>
void Execution<T>::vectors_of_parts(int worker, std::ptrdiff_t first, int states, const T* q, T* x,
                                    Outcome* outcomes, const Call& call) {
  begin_rows(states, outcomes + first, left_over_.data() + first);
  for (PartState<T>& p : parts_) {
    typename PartState<T>::Rows& rows = p.rows[worker];
    p.gather_q(rows, states, q + first * nq_, nq_);
    call(p, rows);
    for (std::ptrdiff_t i = 0; i < states; ++i) {
      merge(p, rows, i, outcomes[first + i], left_over_[first + i]);
      p.asked(rows.out.data() + i * p.nv, x + (first + i) * asked_);
    }
  }
}

template <class T>
void Execution<T>::operational_of_parts(int worker, int states, const T* q, T* X, Outcome* outcomes,
                                        char* left_over) {
  const std::ptrdiff_t size = std::ptrdiff_t(rows_) * rows_;
  begin_rows(states, outcomes, left_over);
  std::fill_n(X, states * size, T(0));
  for (PartState<T>& p : parts_) {
    if (p.sites.empty()) continue;
    typename PartState<T>::Rows& rows = p.rows[worker];
    p.gather_q(rows, states, q, nq_);
    p.engine->selected(worker, states, rows.q.data(), rows.matrices.data(), rows.outcomes.data(),
                       rows.left_over.data());
    for (int state = 0; state < states; ++state) {
      merge(p, rows, state, outcomes[state], left_over[state]);
      p.frames_out.block(rows.matrices.data() + state * p.selected * p.selected, p.selected,
                         X + state * size, rows_);
    }
  }
}

template <class T>
void Execution<T>::derivatives_of_parts(int worker, int states, const T* q, const T* qd,
                                        const T* tau, T* const X[3], T* a, Outcome* outcomes,
                                        char* left_over) {
  for (const PartState<T>& p : parts_)
    if (p.numbers_of_matrices(Want::derivatives) == 0) return;  // all are left over
  const std::ptrdiff_t size = std::ptrdiff_t(asked_) * asked_;
  begin_rows(states, outcomes, left_over);
  for (int i = 0; i < 3; ++i)
    if (X[i]) std::fill_n(X[i], states * size, T(0));
  for (PartState<T>& p : parts_) {
    typename PartState<T>::Rows& rows = p.rows[worker];
    p.gather_rows(rows, states, q, nq_, qd, tau, plan_.nv);
    T* of_part[3];
    for (int i = 0; i < 3; ++i)
      of_part[i] =
          X[i] ? rows.matrices.data() + i * PartState<T>::rows_at_once * p.nv * p.nv : nullptr;
    p.engine->derivatives(worker, states, rows.q.data(), rows.qd.data(), rows.tau_or_qdd.data(),
                          of_part[0], of_part[1], of_part[2], rows.out.data(), rows.outcomes.data(),
                          rows.left_over.data());
    for (int state = 0; state < states; ++state) {
      merge(p, rows, state, outcomes[state], left_over[state]);
      p.asked(rows.out.data() + state * p.nv, a + state * asked_);
      for (int i = 0; i < 3; ++i)
        if (X[i])
          p.asked.block(of_part[i] + state * p.nv * p.nv, p.nv, X[i] + state * size, asked_);
    }
  }
}

template <class T>
template <class InLanes, class One>
int Execution<T>::answer_rows(Want what, int count, Outcome* outcomes, int threads,
                              const InLanes& in_lanes, const One& one) {
  need(what);
  reserve(what, threads);
  left_over_.assign(count, 1);
  failed_.assign(threads, 0);
  for_each_block(count, threads, [&](int worker, int first, int states) {
    in_lanes(worker, first, states);
    Execution& own = worker == 0 ? *this : *others(what)[worker - 1];
    for (int i = first; i < first + states; ++i) {
      if (left_over_[i]) outcomes[i] = one(own, i);
      failed_[worker] += !outcomes[i];
    }
  });
  return failed();
}

template <class T>
void Execution<T>::reserve(Want what, int threads) {
  int& workers = workers_[static_cast<int>(what)];
  if (threads <= workers) return;
  workers = threads;
  // Engines answer all rows of these themselves.
  const bool answers_all = what == Want::acceleration || what == Want::inverse_dynamics;
  const bool gathers = !whole_ || what == Want::operational ||
                       (at_rest_ && (answers_all || what == Want::derivatives));
  for (PartState<T>& p : parts_) {
    p.engine->reserve_workers(what, threads);
    if (gathers) p.reserve_rows(what, threads);
  }
  if (answers_all) return;
  Plan plan = plan_;
  plan.question.want = {what};
  while (static_cast<int>(others(what).size()) < threads - 1)
    others(what).push_back(
        std::make_unique<Execution>(plan, nq_, tolerance_, Triangles::both, make_));
}

template <class T>
template <class F>
void Execution<T>::for_each_block(int count, int threads, const F& f) {
  const int largest =
      whole_ && !at_rest_ && threads == 1 ? std::max(count, 1) : PartState<T>::rows_at_once;
  const int blocks = (count + largest - 1) / largest;
  const auto one = [&](int worker, int i) {
    f(worker, i * largest, std::min(largest, count - i * largest));
  };
  if (threads == 1)
    for (int i = 0; i < blocks; ++i) one(0, i);
  else
    threads_.run(threads, blocks, one);
}

}  // namespace kalmarm
