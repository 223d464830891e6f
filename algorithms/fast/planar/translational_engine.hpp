// The engine of robots of slides alone. Neither M nor what is asked of it depends on q: all is worked
// out once, and a call costs a product or two sweeps (translational.hpp). Where some D is small
// beside what it is summed from, the fallback gives its verdict once. The error of accelerations is
// (10), and what is believed (8), of covariance/force_noise.hpp, by (1) of translational.hpp; what is
// not, the certified form answers.
#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include "algorithms/fast/common_engine.hpp"
#include "algorithms/fast/fallback/guard.hpp"
#include "algorithms/fast/planar/translational.hpp"

namespace kalmarm {

template <class T>
class TranslationalEngine final : public CommonEngine<T> {
 public:
  // Of a robot that is translational.
  TranslationalEngine(const RobotModel& robot, const EngineOptions& options)
      : TranslationalEngine(robot, options, model_of(robot).template cast<T>().template cast<W>()) {
  }

  Outcome forward_dynamics(const T* q, const T* qd, const T* tau, T* a) override {
    return acceleration(factors_, *guard_, q, qd, tau, a);
  }

  void reserve_workers(int count) override {
    CommonEngine<T>::reserve_workers(count);
    while (static_cast<int>(workers_.size()) < count)
      workers_.push_back({factors_, Guarding(robot_, this->lowered())});
  }

  int forward_dynamics(int worker, int count, const T* q, const T* qd, const T* tau, T* a,
                       Outcome* outcomes) override {
    Worker& w = workers_[worker];
    const int nv = factors_.nv();
    int failed = 0;
    for (int i = 0; i < count; ++i, q += nv, qd += nv, tau += nv, a += nv) {
      outcomes[i] = acceleration(w.factors, w.guard, q, qd, tau, a);
      failed += !outcomes[i];
    }
    return failed;
  }

  Outcome factor(const T*) override { return outcome_; }

  Outcome solve(int columns, const T* taus, T* X) override {
    const std::ptrdiff_t nv = factors_.nv();
    T check = T(0);
    for (int j = 0; j < columns; ++j)
      factors_.solve([&](int k) { return taus[j * nv + k]; },
                     [&](int k, const T& a) {
                       check += a * T(0);
                       X[j * nv + k] = a;
                     });
    return check == T(0) ? outcome_ : Outcome{.status = Outcome::Status::not_finite};
  }

  Outcome inverse(const T*, T* X) override {
    std::copy_n(factors_.inverse().data(), factors_.inverse().size(), X);
    return outcome_;
  }

  Outcome diagonal(const T*, T* x) override {
    for (int k = 0; k < factors_.nv(); ++k) x[k] = factors_.inverse()(k, k);
    return outcome_;
  }

  Outcome log_det(const T*, T& x) override {
    x = factors_.log_det();
    return outcome_;
  }

  Outcome selected(const T*, T* X) override {
    std::copy_n(selected_.data(), selected_.size(), X);
    return outcome_;
  }

  Outcome derivatives(const T* q, const T* qd, const T* tau, T* da_dq, T* da_dqd, T* da_dtau,
                      T* a) override {
    this->set_derivatives(q, qd, tau, da_dq, da_dqd, da_dtau, a);
    const bool finite = this->terms().check == T(0);
    return outcome_ && !finite ? Outcome{.status = Outcome::Status::not_finite} : outcome_;
  }

 private:
  using W = Lowering<T>;

  using Guarding = Guard<T, AtRest>;  // velocities do not count

  struct Worker {
    TranslationalFactors<T> factors;  // a solve keeps its sums in them
    Guarding guard;
  };

  Outcome acceleration(TranslationalFactors<T>& factors, Guarding& guard, const T* q, const T* qd,
                       const T* tau, T* a) const {
    if (!outcome_) return outcome_;
    T squares = T(0), size = T(0);
    factors.solve([&](int k) { return tau[k]; },
                  [&](int k, const T& x) {
                    a[k] = x + factors.by_weight()[k];
                    squares += a[k] * a[k];
                    size += this->lowered().least_inertias()[k] * (a[k] * a[k]);
                  });
    const auto by = guard.believed(T(0), factors.energy(tau), squares, size);
    if (!(by.margin > T(0))) return guard.certified().acceleration(q, qd, tau, a);
    Outcome out = outcome_;
    out.error = by.error;
    return out;
  }

  TranslationalEngine(const RobotModel& robot, const EngineOptions& options, const Model<W>& wide)
      : CommonEngine<T>(robot, options),
        robot_(robot),
        axes_(axes_of(wide)),
        slides_(slides_of(wide, axes_)),
        factors_(slides_, wide.gravity(), W(SingularityTest<T, 1>::threshold())) {
    if (options.wants(Want::acceleration)) guard_.emplace(robot, this->lowered());
    if (factors_.suspect()) {
      const VectorX<T> q = VectorX<T>::Zero(wide.nq());
      outcome_ = make_fallback<T>(robot, Form::conventional)->factor(q.data());
    }
    select(options.selection);
  }

  void select(const Selection& selection) {
    const int nv = factors_.nv();
    MatrixX<T> B = MatrixX<T>::Zero(nv, selection.size());
    int column = 0;
    for (const int dof : selection.dofs) B(dof, column++) = T(1);
    for (const Frame& frame : selection.frames) {
      set_site(site_of(frame).template cast<W>(), column, B);
      column += 6;
    }
    selected_ = B.transpose() * factors_.inverse() * B;
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
  TranslationalFactors<T> factors_;
  std::optional<Guarding> guard_;  // where accelerations are wanted
  std::vector<Worker> workers_;
  MatrixX<T> selected_;
  Outcome outcome_;
};

}  // namespace kalmarm
