// Models of slides alone behind the interface of every solver. Neither M nor what is asked of it
// depends on q: all is worked out once, and a call costs a product or two sweeps
// (translational.hpp). A suspect is looked into by Sequential<Conventional>, once.
#pragma once

#include <cmath>
#include <vector>

#include "algorithms/inverse_mass/sequential.hpp"
#include "algorithms/partial_solver.hpp"
#include "algorithms/planar/translational.hpp"
#include "algorithms/riccati/conventional.hpp"

namespace kalmarm {

// Nothing turns.
template <class T>
bool is_translational(const Model<T>& model) {
  for (int k = 0; k < model.nv(); ++k)
    if (model.joint(k).coordinate != Coordinate::distance) return false;
  return true;
}

template <class T>
class TranslationalSolver final : public PartialSolver<T> {
 public:
  // Of a model that is translational.
  explicit TranslationalSolver(const Model<T>& model)
      : TranslationalSolver(model.template cast<Lowering<T>>(), model) {}

  Outcome acceleration(const VectorX<T>&, const VectorX<T>&, const VectorX<T>& tau,
                       VectorX<T>& a) override {
    if (!outcome_) return outcome_;
    T check = T(0);
    factors_.solve([&](int k) { return tau[k]; },
                   [&](int k, const T& x) {
                     a[k] = x + factors_.by_weight()[k];
                     check += x * T(0);
                   });
    return check == T(0) ? outcome_ : Outcome{.status = Outcome::Status::not_finite};
  }

  Outcome factor(const VectorX<T>&) override { return outcome_; }

  void solve(const VectorX<T>& tau, VectorX<T>& x) override {
    factors_.solve([&](int k) { return tau[k]; }, [&](int k, const T& a) { x[k] = a; });
  }

  Outcome inverse(const VectorX<T>&, MatrixX<T>& X) override {
    X = factors_.inverse();
    return outcome_;
  }

  Outcome diagonal(const VectorX<T>&, VectorX<T>& x) override {
    x = factors_.inverse().diagonal();
    return outcome_;
  }

  Outcome log_det(const VectorX<T>&, T& x) override {
    x = factors_.log_det();
    return outcome_;
  }

  void select(const Selection<T>& selection) override {
    const int nv = factors_.nv();
    MatrixX<T> B = MatrixX<T>::Zero(nv, selection.size());
    int column = 0;
    for (const int dof : selection.dofs) B(dof, column++) = T(1);
    for (const Site<T>& site : selection.sites) {
      set_site(site.template cast<W>(), column, B);
      column += 6;
    }
    selected_ = B.transpose() * factors_.inverse() * B;
    selected_.template triangularView<Eigen::StrictlyUpper>() = selected_.transpose();
  }

  Outcome selected(const VectorX<T>&, MatrixX<T>& X) override {
    X = selected_;
    return outcome_;
  }

 private:
  using W = Lowering<T>;

  TranslationalSolver(const Model<W>& wide, const Model<T>& model)
      : axes_(axes_of(wide)),
        slides_(slides_of(wide, axes_)),
        factors_(slides_, wide.gravity(), W(SingularityTest<T, 1>::net())) {
    if (factors_.suspect()) outcome_ = looked_into(model);
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

  static Outcome looked_into(const Model<T>& model) {
    using V = Sequential<Conventional>;
    RandomModel<T> rm(model);
    typename V::template Workspace<T> ws(model);
    set_position(model, VectorX<T>(VectorX<T>::Zero(model.nq())), rm);
    Outcome out = V::factor(model, rm, ws);
    out.suspect = static_cast<bool>(out);
    return out;
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
  MatrixX<T> selected_;
  Outcome outcome_;
};

}  // namespace kalmarm
