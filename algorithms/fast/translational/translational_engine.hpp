// The engine of robots of slides alone. Neither M nor what is asked of it depends on q: all is worked
// out once, and a call costs a product or two sweeps (translational.hpp). Where some D is small
// beside what it is summed from, the certified form says once whether M is singular, and answers
// every call if it is not. Else the error of accelerations is (10), and what is accepted (8), of
// covariance/force_noise.hpp, by (1) of translational.hpp; the rest the certified form answers.
#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include "algorithms/fast/certified/certified_answer.hpp"
#include "algorithms/fast/engine/common_engine.hpp"
#include "algorithms/fast/translational/translational.hpp"

namespace kalmarm {

class TranslationalEngine final : public CommonEngine {
  using T = double;
  using W = Wider<T>;

 public:
  using CommonEngine::derivatives;  // of rows

  // Of a robot that is translational.
  TranslationalEngine(const RobotModel& robot, const EngineOptions& options)
      : TranslationalEngine(robot, options, model_of(robot).cast<W>()) {}

  Outcome forward_dynamics(const T* q, const T* qd, const T* tau, T* a) override {
    return acceleration(own_, q, qd, tau, a);
  }

  // What is refused or suspect is so in every state, and asked for state by state.
  void reserve_workers(Want what, int count) override {
    if (what == Want::derivatives && (!refusal_ || own_.factors.suspect())) return;
    CommonEngine::reserve_workers(what, count);
    EngineOptions rows;
    rows.want = {Want::acceleration};
    rows.tolerance = acceptance().tolerance();
    while (what == Want::acceleration && static_cast<int>(workers_.size()) < count) {
      Worker& worker = workers_.emplace_back(own_.factors);
      worker.certified.emplace(robot_, lowered(), rows, true);
    }
  }

  int forward_dynamics(int worker, int count, const T* q, const T* qd, const T* tau, T* a,
                       Outcome* outcomes) override {
    const int nv = lowered().nv();
    int failed = 0;
    for (int i = 0; i < count; ++i, q += nv, qd += nv, tau += nv, a += nv) {
      outcomes[i] = acceleration(workers_[worker], q, qd, tau, a);
      failed += !outcomes[i];
    }
    return failed;
  }

  Outcome factor(const T* q) override {
    if (answered()) return own_.certified->factor(q);
    own_.certified->keep(q);
    return refusal_;
  }

  Outcome solve(int columns, const T* taus, T* X) override {
    if (answered()) return own_.certified->solve(columns, taus, X);
    if (!refusal_) return refusal_;
    const int nv = lowered().nv();
    Outcome out;
    for (int j = 0; j < columns; ++j, taus += nv, X += nv) {
      const auto force = [&](int k) { return taus[k]; };
      T squares = T(0);
      own_.factors.solve(force, [&](int k, const T& x) {
        X[k] = x;
        squares += x * x;
      });
      if (!acceptance().accepts({T(0), own_.factors.energy(force), squares}))
        out = worse(out, own_.certified->column(taus, X));
    }
    return out;
  }

  Outcome inverse(const T* q, T* X) override {
    if (answered()) return own_.certified->inverse(q, X);
    std::copy_n(own_.factors.inverse().data(), own_.factors.inverse().size(), X);
    return refusal_;
  }

  Outcome diagonal(const T* q, T* x) override {
    if (answered()) return own_.certified->diagonal(q, x);
    for (int k = 0; k < own_.factors.nv(); ++k) x[k] = own_.factors.inverse()(k, k);
    return refusal_;
  }

  Outcome log_det(const T* q, T& x) override {
    if (answered()) return own_.certified->log_det(q, x);
    x = own_.factors.log_det();
    return refusal_;
  }

  Outcome selected(const T* q, T* X) override {
    if (answered()) return own_.certified->selected(q, X);
    std::copy_n(selected_.data(), selected_.size(), X);
    return refusal_;
  }

  Outcome derivatives(const T* q, const T* qd, const T* tau, T* da_dq, T* da_dqd, T* da_dtau,
                      T* a) override {
    set_derivatives(q, qd, tau, da_dq, da_dqd, da_dtau, a);
    if (!refusal_) return refusal_;
    if (terms().check != T(0)) return {.status = Outcome::Status::not_finite};
    if (!own_.factors.suspect()) return {};
    Outcome out;
    out.recomputed = true;
    return of_derivatives(out, loss_);
  }

 private:
  struct Worker {
    TranslationalFactors<T> factors;           // a solve keeps its sums in them
    std::optional<CertifiedAnswer> certified;  // at rest: velocities do not count

    explicit Worker(const TranslationalFactors<T>& of_robot) : factors(of_robot) {}
  };

  // Whether calls are answered by the certified form.
  bool answered() const { return own_.factors.suspect() && refusal_; }

  Outcome acceleration(Worker& worker, const T* q, const T* qd, const T* tau, T* a) const {
    if (!refusal_) return refusal_;
    CertifiedAnswer& certified = *worker.certified;
    if (answered()) return certified.acceleration(q, qd, tau, a);
    T squares = T(0), size = T(0), rounding = T(0);
    const auto force = [&](int k) { return tau[k]; };
    worker.factors.solve(force, [&](int k, const T& x) {
      a[k] = x + worker.factors.by_weight()[k];
      squares += a[k] * a[k];
      size += lowered().least_inertias()[k] * (a[k] * a[k]);
      rounding += lowered().largest_inertias()[k] * (a[k] * a[k]);
    });
    const T energy = worker.factors.energy(force) + worker.factors.energy_by_weight();
    const auto by = acceptance().judge(AccelerationSums<T>{T(0), energy, squares, size, rounding});
    if (by.margin > T(0)) return {.error = by.error};
    return certified.acceleration(q, qd, tau, a);
  }

  TranslationalEngine(const RobotModel& robot, const EngineOptions& options, const Model<W>& wide)
      : CommonEngine(robot, options),
        robot_(robot),
        axes_(axes_of(wide)),
        slides_(slides_of(wide, axes_)),
        own_(TranslationalFactors<T>(slides_, wide.gravity(),
                                     sure_D_over_size<W>(options.tolerance))) {
    EngineOptions able = options;
    if (own_.factors.suspect()) able.want.insert(Want::solve);
    if (able.wants(Want::acceleration) || able.wants(Want::solve))
      own_.certified.emplace(robot, lowered(), able, true);
    if (own_.factors.suspect()) {
      const VectorX<T> q = VectorX<T>::Zero(wide.nq());
      if (const Outcome verdict = own_.certified->factor(q.data()); !verdict) refusal_ = verdict;
      loss_ = RoundingBound<T>(lowered()).look(lowered(), q.data());
    }
    select(options.selection);
  }

  void select(const Selection& selection) {
    const int nv = own_.factors.nv();
    MatrixX<T> B = MatrixX<T>::Zero(nv, selection.size());
    int column = 0;
    for (const int dof : selection.dofs) B(dof, column++) = T(1);
    for (const Frame& frame : selection.frames) {
      set_site(site_of(frame).cast<W>(), column, B);
      column += 6;
    }
    selected_ = B.transpose() * own_.factors.inverse() * B;
    selected_.template triangularView<Eigen::StrictlyUpper>() = selected_.transpose();
  }

  static std::vector<Matrix3<W>> axes_of(const Model<W>& model) {
    std::vector<Matrix3<W>> R;
    for (int k = 0; k < model.nv(); ++k) {
      const int parent = model.parent(k);
      R.push_back(parent < 0 ? model.E(k) : Matrix3<W>(R[parent] * model.E(k)));
    }
    return R;
  }

  static std::vector<Slide<W>> slides_of(const Model<W>& model, const std::vector<Matrix3<W>>& R) {
    std::vector<Slide<W>> slides;
    for (int k = 0; k < model.nv(); ++k)
      slides.push_back({model.parent(k), R[k].col(2), model.joint(k).r, model.joint(k).body.mass});
    return slides;
  }

  // J' of a site: of its force alone, which is the same at every link.
  void set_site(const Site<W>& site, int column, MatrixX<T>& B) const {
    using std::abs;
    if (site.link < 0) return;
    const Matrix3<W> R = axes_[site.link] * rotation(site.rotation);
    for (int k = site.link; k >= 0; k = slides_[k].parent)
      for (int i = 0; i < 3; ++i) {
        const W x = slides_[k].axis.dot(R.col(i));
        const bool zero = abs(x) <= W(8) * W(unit_roundoff<T>());  // but for rounding
        B(k, column + 3 + i) = zero ? T(0) : T(x);
      }
  }

  RobotModel robot_;
  std::vector<Matrix3<W>> axes_;  // of the links, in the world's axes
  std::vector<Slide<W>> slides_;
  Worker own_;
  std::vector<Worker> workers_;
  MatrixX<T> selected_;
  RoundingLoss loss_;  // of the spatial kernels, whose D do not depend on q either
  Outcome refusal_;    // of every call, where M is singular
};

}  // namespace kalmarm
