// One state after another of robots of slides alone. Neither M nor what is asked of it depends on q: all
// is worked out once, and a call costs a product or two sweeps (translational.hpp). Where some D is
// small beside what it is summed from, the certified form says once whether M is singular, and answers
// every call if it is not. Else the error of accelerations is (10), and what is accepted (8), of
// covariance/force_noise.hpp, by (1) of translational.hpp; the rest the certified form answers.
#pragma once

#include <optional>
#include <vector>

#include "algorithms/fast/ladder/rigid_state.hpp"
#include "algorithms/fast/translational/translational.hpp"

namespace kalmarm {

class TranslationalState : public RigidState {
  using T = double;
  using W = Wider<T>;

 public:
  // Of a robot that is translational.
  TranslationalState(ModelsInDouble& models, const EngineOptions& options)
      : TranslationalState(models, options, models.model.cast<W>()) {}

  // What does not depend on q is in no need of them; nor are derivatives that are refused or suspect in
  // every state.
  bool takes_lanes(Want want) const {
    return want == Want::inverse_dynamics || want == Want::mass ||
           (want == Want::derivatives && refusal_ && !factors_.suspect());
  }

  void reserve_rows(Want) {}

  void answer_rows(int count, const Call<T>& call, Outcome* outcomes, const char* left_over) {
    one_by_one(*this, count, call, outcomes, left_over);
  }

  Outcome acceleration(const Call<T>& call) {
    if (!refusal_) return refusal_;
    // Gravity is among the constants of the slides.
    if (answered() || call.gravity) return certified_->answer(call);
    T squares = T(0), size = T(0), rounding = T(0);
    const auto force = [&](int k) { return call.tau[k]; };
    factors_.solve(force, [&](int k, const T& x) {
      const T a = call.out[k] = x + factors_.by_weight()[k];
      squares += a * a;
      size += lowered().least_inertias()[k] * (a * a);
      rounding += lowered().largest_inertias()[k] * (a * a);
    });
    const T energy = factors_.energy(force) + factors_.energy_by_weight();
    const auto by = acceptance().judge(AccelerationSums<T>{T(0), energy, squares, size, rounding});
    if (by.margin > T(0)) return {.error = by.error};
    return certified_->answer(call);
  }

  Outcome with_columns(const Call<T>& call) {
    const Outcome of_a = acceleration(call);
    const Outcome of_D = of_a ? factor(call) : of_a;
    return of_D ? worse(of_a, worse(of_D, solve(call.m, call.B, call.X))) : of_D;
  }

  // M^-1 and what is read off it.
  Outcome by_factors(const Call<T>& call) {
    if (answered()) return certified_->answer(call);
    const MatrixX<T>& X = factors_.inverse();
    switch (call.want) {
      case Want::inverse:
        std::copy_n(X.data(), X.size(), call.out);
        break;
      case Want::diagonal:
        for (int k = 0; k < X.rows(); ++k) call.out[k] = X(k, k);
        break;
      case Want::log_det:
        *call.out = factors_.log_det();
        break;
      case Want::operational_diagonal:
        for (int k = 0; k < selected_.rows(); ++k) call.out[k] = selected_(k, k);
        break;
      default:
        std::copy_n(selected_.data(), selected_.size(), call.out);
    }
    return refusal_;
  }

  Outcome differentiate(const Call<T>& call) {
    const bool finite = derivatives(call);
    if (!refusal_) return refusal_;
    if (!finite) return {.status = Outcome::Status::not_finite};
    return factors_.suspect() ? of_derivatives({}, loss_) : Outcome{};
  }

  Outcome factor(const Call<T>& call) {
    if (answered()) return certified_->factor(call);
    certified_->keep(call);
    return refusal_;
  }

  Outcome solve(int columns, const T* taus, T* X) {
    if (answered()) return certified_->solve(columns, taus, X);
    if (!refusal_) return refusal_;
    const int nv = lowered().nv();
    Outcome out;
    for (int j = 0; j < columns; ++j, taus += nv, X += nv) {
      const auto force = [&](int k) { return taus[k]; };
      T squares = T(0);
      factors_.solve(force, [&](int k, const T& x) {
        X[k] = x;
        squares += x * x;
      });
      if (!acceptance().accepts({T(0), factors_.energy(force), squares}))
        out = worse(out, certified_->column(taus, X));
    }
    return out;
  }

 private:
  // Whether calls are answered by the certified form.
  bool answered() const { return factors_.suspect() && refusal_; }

  TranslationalState(ModelsInDouble& models, const EngineOptions& options, const Model<W>& wide)
      : RigidState(models, options),
        axes_(axes_of(wide)),
        slides_(slides_of(wide, axes_)),
        factors_(slides_, wide.gravity(), sure_D_over_size<W>(options.tolerance)) {
    EngineOptions able = options;
    if (factors_.suspect()) able.want.insert(Want::solve);
    if (able.wants(Want::acceleration) || able.wants(Want::solve))
      certified_.emplace(models.certified(), able, true);
    if (factors_.suspect()) {
      const VectorX<T> q = VectorX<T>::Zero(wide.nq());
      if (const Outcome verdict = certified_->factor({.want = Want::solve, .q = q.data()});
          !verdict)
        refusal_ = verdict;
      loss_ = RoundingBound<T>(lowered()).look(lowered(), q.data());
    }
    select(options.selection);
  }

  void select(const Selection& selection) {
    const int nv = factors_.nv();
    MatrixX<T> B = MatrixX<T>::Zero(nv, selection.size());
    int column = 0;
    for (const int dof : selection.dofs) B(dof, column++) = T(1);
    for (const Frame& frame : selection.frames) {
      set_site(site_of(frame).cast<W>(), column, B);
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

  std::vector<Matrix3<W>> axes_;  // of the links, in the world's axes
  std::vector<Slide<W>> slides_;
  TranslationalFactors<T> factors_;
  std::optional<CertifiedAnswer> certified_;  // at rest: velocities do not count
  MatrixX<T> selected_;
  RoundingLoss loss_;  // of the spatial kernels, whose D do not depend on q either
  Outcome refusal_;    // of every call, where M is singular
};

}  // namespace kalmarm
