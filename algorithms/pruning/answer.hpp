// What a plan answers, call by call: numbers of the whole robot's state are copied for each part,
// and what is asked is put in its place. Solvers, memory and what is copied where are settled when
// the object is made.
#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/partial_solver.hpp"
#include "algorithms/pruning/plan.hpp"

namespace kalmarm {

// The fast path's solver of a part: float and double, kernels.cpp.
template <class T>
std::unique_ptr<Solver<T>> make_structured_kernel(const Part& part, const Model<T>& model);

// The solver of a part; its model in precision T, where locked joints may be held by noise.
template <class T>
using MakeSolver =
    std::function<std::unique_ptr<Solver<T>>(const Part& part, const Model<T>& model)>;

// By a variant of the registry; they are null where it has none in precision T.
template <class T>
MakeSolver<T> solvers_of(const std::string& variant) {
  return [variant](const Part& part, const Model<T>& model) {
    if constexpr (std::is_floating_point_v<T>)
      if (variant == "Structured") return make_structured_kernel<T>(part, model);
    return make_solver<T>(variant, model);
  };
}

namespace detail {

// Copies of entries, as runs of neighbours.
class Copies {
 public:
  Copies() = default;

  void add(int from, int to) {
    if (!runs_.empty() && from == runs_.back().from + runs_.back().count &&
        to == runs_.back().to + runs_.back().count)
      ++runs_.back().count;
    else
      runs_.push_back({from, to, 1});
  }

  template <class T>
  void operator()(const VectorX<T>& from, VectorX<T>& to) const {
    for (const Run& run : runs_) std::copy_n(from.data() + run.from, run.count, to.data() + run.to);
  }

  // A block of a matrix, rows and columns alike; from and to need not be of one size.
  template <class T>
  void block(const MatrixX<T>& from, MatrixX<T>& to) const {
    for (const Run& column : runs_)
      for (int j = 0; j < column.count; ++j)
        for (const Run& row : runs_)
          std::copy_n(&from(row.from, column.from + j), row.count, &to(row.to, column.to + j));
  }

 private:
  struct Run {
    int from, to, count;
  };
  std::vector<Run> runs_;
};

// One part at work.
template <class T>
struct Worker {
  std::unique_ptr<Solver<T>> solver;
  PartialSolver<T>* partial = nullptr;  // the same, where it answers in part
  bool block = false;                   // M^-1 by `selected`: not all of it is asked for
  bool sums_D = false;                  // log det M by it: no D is that of a locked joint
  Model<T> model;
  RandomModel<T> rm;
  CompositeInertia<T> composite;
  std::vector<int> dofs;  // of the whole
  std::vector<Site<T>> sites;
  Copies q_in, v_in;            // of the whole's q and qd, tau
  std::vector<int> asked_dofs;  // of the part
  Copies asked;                 // of them to the answer
  Copies block_out, sites_out;  // to the answer: of rows of `selected`, or of J
  VectorX<T> q, qd, tau, a;
  MatrixX<T> X, selection, J, XJ, M;
  Eigen::LLT<MatrixX<T>> llt;

  explicit Worker(const Model<T>& m)
      : model(m), rm(m), composite(m), q(m.nq()), qd(m.nv()), tau(m.nv()), a(m.nv()) {}
};

}  // namespace detail

// Only what the question wants may be called.
template <class T>
class Answer {
 public:
  // make: not null for any part.
  Answer(const Plan& plan, const MakeSolver<T>& make)
      : nv_(static_cast<int>(plan.asked.size())),
        rows_(6 * static_cast<int>(plan.question.sites.size())) {
    for (const Part& part : plan.parts) add(plan, part, make);
    if (nv_ == plan.nv && workers_.size() == 1) acceleration_ = &Answer::acceleration_of_all;
  }

  int nv() const { return nv_; }      // DoF asked about, whose order is that of the whole
  int rows() const { return rows_; }  // of J

  // a (nv()) from the whole robot's q (nq), qd and tau; what is locked or does not matter is not
  // looked at. On failure a result is not to be used; a joint is that of the whole.
  Outcome acceleration(const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau,
                       VectorX<T>& a) {
    return (this->*acceleration_)(q, qd, tau, a);
  }

  // X (nv() x nv()) = M^-1 of the joints that are free, the rows and columns that are asked for.
  Outcome inverse(const VectorX<T>& q, MatrixX<T>& X) {
    X.setZero();
    return each([&](Worker& w) {
      w.q_in(q, w.q);
      if (w.block) {
        const Outcome outcome = w.partial->selected(w.q, w.selection);
        w.block_out.block(w.selection, X);
        return outcome;
      }
      const Outcome outcome = w.solver->inverse(w.q, w.X);
      w.asked.block(w.X, X);
      return outcome;
    });
  }

  // x (nv()) = the diagonal of M^-1.
  Outcome diagonal(const VectorX<T>& q, VectorX<T>& x) {
    return each([&](Worker& w) {
      w.q_in(q, w.q);
      Outcome outcome;
      if (w.partial) {
        outcome = w.partial->diagonal(w.q, w.a);
      } else {
        outcome = w.solver->inverse(w.q, w.X);
        w.a = w.X.diagonal();
      }
      w.asked(w.a, x);
      return outcome;
    });
  }

  // x = log det M of the joints that are free.
  Outcome log_det(const VectorX<T>& q, T& x) {
    x = T(0);
    return each([&](Worker& w) {
      w.q_in(q, w.q);
      T part(0);
      Outcome outcome;
      if (w.sums_D)
        outcome = w.partial->log_det(w.q, part);
      else
        outcome = by_cholesky(w, part);
      x += part;
      return outcome;
    });
  }

  // M (nv() x nv()).
  void mass(const VectorX<T>& q, MatrixX<T>& M) {
    M.setZero();
    for (Worker& w : workers_) {
      w.q_in(q, w.q);
      set_mass(w);
      w.asked.block(w.X, M);
    }
  }

  // X (rows() x rows()) = J M^-1 J', 6 rows a site (site.hpp).
  Outcome operational(const VectorX<T>& q, MatrixX<T>& X) {
    X.setZero();
    return each([&](Worker& w) {
      if (w.sites.empty()) return Outcome{};
      w.q_in(q, w.q);
      if (w.partial) {
        const Outcome outcome = w.partial->selected(w.q, w.selection);
        w.sites_out.block(w.selection, X);
        return outcome;
      }
      const Outcome outcome = w.solver->inverse(w.q, w.X);
      set_position(w.model, w.q, w.rm);
      site_jacobian<T>(w.model, w.rm, w.sites, w.J);
      w.XJ.noalias() = w.X * w.J.transpose();
      w.selection.noalias() = w.J * w.XJ;
      w.sites_out.block(w.selection, X);
      return outcome;
    });
  }

 private:
  using Worker = detail::Worker<T>;
  using Acceleration = Outcome (Answer::*)(const VectorX<T>&, const VectorX<T>&, const VectorX<T>&,
                                           VectorX<T>&);

  // Where nothing is left out but by the solver itself, there is nothing to copy.
  Outcome acceleration_of_all(const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau,
                              VectorX<T>& a) {
    return workers_[0].solver->acceleration(q, qd, tau, a);
  }

  Outcome acceleration_of_parts(const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau,
                                VectorX<T>& a) {
    return each([&](Worker& w) {
      w.q_in(q, w.q);
      w.v_in(qd, w.qd);
      w.v_in(tau, w.tau);
      const Outcome outcome = w.solver->acceleration(w.q, w.qd, w.tau, w.a);
      w.asked(w.a, a);
      return outcome;
    });
  }

  void add(const Plan& plan, const Part& part, const MakeSolver<T>& make) {
    const Reduction& reduction = part.reduction;
    const Question& question = plan.question;
    Worker& w = workers_.emplace_back(reduction.model.cast<T>());
    w.dofs = reduction.dofs;
    // Large enough for g = P H' / D to vanish beside 1, small enough for g^2 not to underflow.
    const T infinite_noise = T(1) / (unit_roundoff<T>() * unit_roundoff<T>());
    std::vector<char> locked(plan.nv, 0);
    for (const int k : question.locked) locked[k] = 1;
    for (int k = 0; k < w.model.nv(); ++k)
      if (locked[w.dofs[k]]) w.model.set_noise(k, infinite_noise);
    w.solver = make(part, w.model);
    if (plan.partial_answers) w.partial = dynamic_cast<PartialSolver<T>*>(w.solver.get());
    const int nv = w.model.nv();

    // What is locked by noise keeps its place and stands still.
    w.qd.setZero();
    w.tau.setZero();
    for (int i = 0; i < w.model.nq(); ++i) w.q[i] = T(question.q[reduction.q_whole[i]]);
    for (int k = 0; k < nv; ++k) {
      if (locked[reduction.dofs[k]]) continue;
      w.v_in.add(reduction.dofs[k], k);
      const Joint<T>& joint = w.model.joint(k);
      for (int i = 0; i < q_entries(joint.coordinate); ++i)
        w.q_in.add(reduction.q_whole[joint.q_index + i], joint.q_index + i);
    }

    w.block = w.partial && part.block;
    w.sums_D =
        w.partial && std::none_of(w.dofs.begin(), w.dofs.end(), [&](int k) { return locked[k]; });
    Selection<T> selection;
    for (const int k : part.asked) {
      const int place = static_cast<int>(
          std::lower_bound(plan.asked.begin(), plan.asked.end(), reduction.dofs[k]) -
          plan.asked.begin());
      w.asked.add(k, place);
      w.asked_dofs.push_back(k);
      if (!w.block) continue;
      w.block_out.add(static_cast<int>(selection.dofs.size()), place);
      selection.dofs.push_back(k);
    }
    for (std::size_t i = 0; i < part.sites.size(); ++i) {
      for (int row = 0; row < 6; ++row)
        w.sites_out.add(static_cast<int>(selection.dofs.size() + 6 * i) + row,
                        6 * part.site_index[i] + row);
      w.sites.push_back(part.sites[i].cast<T>());
    }
    selection.sites = w.sites;
    w.selection.resize(selection.size(), selection.size());
    w.J.resize(6 * static_cast<int>(w.sites.size()), nv);
    w.XJ.resize(nv, w.J.rows());
    if (w.partial && selection.size() > 0) w.partial->select(selection);
    const bool whole = (question.want.contains(Want::inverse) && !w.block) ||
                       question.want.contains(Want::mass) || !w.sums_D;
    if (whole) w.X.resize(nv, nv);
    if (!w.sums_D) {
      w.M.resize(part.asked.size(), part.asked.size());
      w.llt = Eigen::LLT<MatrixX<T>>(w.M.rows());
    }
  }

  static void set_mass(Worker& w) {
    set_position(w.model, w.q, w.rm);
    mass_matrix(w.model, w.rm, w.composite, Eigen::Ref<MatrixX<T>>(w.X));
  }

  // Of the DoF asked about, which are all that are free.
  static Outcome by_cholesky(Worker& w, T& x) {
    using std::log;
    set_mass(w);
    for (int j = 0; j < w.M.cols(); ++j)
      for (int i = 0; i < w.M.rows(); ++i) w.M(i, j) = w.X(w.asked_dofs[i], w.asked_dofs[j]);
    w.llt.compute(w.M);
    if (w.llt.info() != Eigen::Success) return {.status = Outcome::Status::indefinite};
    x = T(0);
    for (int k = 0; k < w.M.rows(); ++k) x += T(2) * log(w.llt.matrixLLT()(k, k));
    return {};
  }

  // The first warning and the largest estimate of an error.
  static Outcome both(Outcome a, const Outcome& b) {
    if (!a.warns() && b.warns()) return b;
    if (!(a.error >= b.error)) a.error = b.error;
    return a;
  }

  // f(part) of all, until one fails.
  template <class F>
  Outcome each(const F& f) {
    Outcome out;
    for (Worker& w : workers_) {
      Outcome outcome = f(w);
      if (outcome.joint >= 0) outcome.joint = w.dofs[outcome.joint];
      if (!outcome) return outcome;
      out = both(out, outcome);
    }
    return out;
  }

  int nv_, rows_;
  std::vector<Worker> workers_;
  Acceleration acceleration_ = &Answer::acceleration_of_parts;
};

}  // namespace kalmarm
