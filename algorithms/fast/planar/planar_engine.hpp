// Planar mechanisms (plane.hpp) behind the interface of every solver: what moves in the plane by
// planar_filter.hpp, what slides along its normal by translational.hpp.
//
// What is not accepted (engine/acceptance.hpp) is answered by the certified form, but where a D is no more
// than rounding: the axes are parallel, or lie in the plane, but for their last bits, and what these
// make of D does not make M regular.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <optional>
#include <vector>

#include "algorithms/fast/certified/certified_answer.hpp"
#include "algorithms/fast/engine/common_engine.hpp"
#include "algorithms/fast/planar/planar_columns.hpp"
#include "algorithms/fast/planar/planar_selection.hpp"
#include "algorithms/model/rounding_scale.hpp"
#include "algorithms/spatial/flush_subnormals.hpp"

namespace kalmarm {

class PlanarEngine final : public CommonEngine {
  using T = double;
  using W = Lowering<T>;
  using Many = WidePack<T>;

 public:
  using CommonEngine::derivatives;  // of rows

  // Of a robot that find_plane finds a plane of.
  PlanarEngine(const RobotModel& robot, const EngineOptions& options)
      : PlanarEngine(robot, options, *find_plane(model_of(robot))) {}

  Outcome forward_dynamics(const T* q, const T* qd, const T* tau, T* a) override {
    planar_acceleration(model_, q, qd, tau, ws_, a);
    T squares = ws_.squares;
    along_factors_.solve([&](int i) { return tau[along_.dofs[i]]; },
                         [&](int i, const T& x) {
                           a[along_.dofs[i]] = x + along_factors_.by_weight()[i];
                           squares += a[along_.dofs[i]] * a[along_.dofs[i]];
                         });
    const T along = along_factors_.energy([&](int i) { return tau[along_.dofs[i]]; }) +
                    along_factors_.energy_by_weight();
    const auto by = acceptance().judge(AccelerationSums<T>{
        noise(), ws_.energy + along, squares, sum_of(lowered().least_inertias(), a),
        sum_of(lowered().largest_inertias(), a)});
    if (!along_factors_.suspect() && acceptance().accepts(ws_.margin, by, 0))
      return {.error = by.error};
    const Outcome out = verdict(q);
    return out ? certified_->acceleration(q, qd, tau, a) : out;
  }

  void reserve_workers(Want what, int count) override {
    CommonEngine::reserve_workers(what, count);
    while (what == Want::acceleration && static_cast<int>(workers_.size()) < count - 1)
      workers_.push_back(std::make_unique<PlanarEngine>(robot_, rows_, plane_));
  }

  // One after another; the first worker is this engine itself.
  int forward_dynamics(int worker, int count, const T* q, const T* qd, const T* tau, T* a,
                       Outcome* outcomes) override {
    if (worker > 0)
      return workers_[worker - 1]->forward_dynamics(0, count, q, qd, tau, a, outcomes);
    const int nq = lowered().nq(), nv = lowered().nv();
    int failed = 0;
    for (int i = 0; i < count; ++i, q += nq, qd += nv, tau += nv, a += nv) {
      outcomes[i] = forward_dynamics(q, qd, tau, a);
      failed += !outcomes[i];
    }
    return failed;
  }

  Outcome factor(const T* q) override {
    by_certified_ = factors_may_be_wrong(q);
    if (!by_certified_) {
      certified_->keep(q);
      return {};
    }
    const Outcome out = verdict(q);
    return out ? certified_->factor(q) : out;
  }

  // About 51 flops a hinge and column, 25 of them for N, E and |x|^2.
  Outcome solve(int columns, const T* taus, T* X) override {
    if (by_certified_) return certified_->solve(columns, taus, X);
    const int nv = lowered().nv(), last = model_.nv() - 1;
    Outcome out;
    for (int j = 0; j < columns; ++j, taus += nv, X += nv) {
      const auto force = [&](int k) { return taus[model_.link(k).dof]; };
      const auto along = [&](int i) { return taus[along_.dofs[i]]; };
      SolveSums<T> sums = {T(0), along_factors_.energy(along), T(0)};
      const Observer observer = {model_, ws_, sums};
      const auto put = [&](int dof, const T& x) {
        X[dof] = x;
        sums.squares += x * x;
      };
      detail::sweep_inward(model_, ws_, last, all_.data(), force, one_, observer);
      detail::sweep_outward(
          model_, ws_, last, one_, [&](int k, const T& x) { put(model_.link(k).dof, x); },
          observer);
      along_factors_.solve(along, [&](int i, const T& x) { put(along_.dofs[i], x); });
      if (!acceptance().accepts(sums)) out = worse(out, certified_->column(taus, X));
    }
    return out;
  }

  Outcome inverse(const T* q, T* result) override {
    planar_factor(model_, q, ws_);
    T* const in_plane = along_.dofs.empty() ? result : in_plane_.data();
    const T check = columns(in_plane);
    const bool accepted = acceptance().accepts_columns(energy_of_columns(in_plane)) ||
                          acceptance().accepts_all_of(energy_with_terms(in_plane));
    if (!along_.dofs.empty()) {
      const int nv = lowered().nv();
      Eigen::Map<MatrixX<T>> X(result, nv, nv);
      X.setZero();
      for (int j = 0; j < model_.nv(); ++j)
        for (int i = 0; i < model_.nv(); ++i)
          X(model_.link(i).dof, model_.link(j).dof) = in_plane_(i, j);
      for (int j = 0; j < along_factors_.nv(); ++j)
        for (int i = 0; i < along_factors_.nv(); ++i)
          X(along_.dofs[i], along_.dofs[j]) = along_factors_.inverse()(i, j);
    }
    if (accepted && !may_be_wrong(check)) return {};
    const Outcome out = verdict(q);
    return out ? certified_->inverse(q, result) : out;
  }

  Outcome diagonal(const T* q, T* x) override {
    if (factors_may_be_wrong(q)) {
      const Outcome out = verdict(q);
      return out ? certified_->diagonal(q, x) : out;
    }
    planar_diagonal(model_, ws_, covariances_,
                    [&](int k, const T& alpha) { x[model_.link(k).dof] = alpha; });
    for (int i = 0; i < along_factors_.nv(); ++i)
      x[along_.dofs[i]] = along_factors_.inverse()(i, i);
    return {};
  }

  Outcome log_det(const T* q, T& x) override {
    using std::log;
    if (factors_may_be_wrong(q)) {
      const Outcome out = verdict(q);
      return out ? certified_->log_det(q, x) : out;
    }
    x = along_factors_.log_det();
    for (const auto& at : ws_.links) x += log(at.D);
    return {};
  }

  Outcome selected(const T* q, T* X) override {
    if (factors_may_be_wrong(q)) {
      const Outcome out = verdict(q);
      return out ? certified_->selected(q, X) : out;
    }
    selection_.fill(model_, ws_, X);
    return {};
  }

  // By the spatial kernels, which are looked at by their own numbers.
  Outcome derivatives(const T* q, const T* qd, const T* tau, T* da_dq, T* da_dqd, T* da_dtau,
                      T* a) override {
    set_derivatives(q, qd, tau, da_dq, da_dqd, da_dtau, a);
    const T check = terms().check;
    const RoundingLoss loss = loss_of_derivatives(q);
    if (check == T(0) && loss.bound < error_of_D_let_pass<T>) return {};
    if (const Outcome out = verdict(q); !out) return out;
    const Outcome out = certified_->factor(q);
    if (out && check != T(0)) return {.status = Outcome::Status::not_finite};
    return out ? of_derivatives(out, loss) : out;
  }

 private:
  static constexpr int lanes = Lanes<Many>::count;

 public:
  PlanarEngine(const RobotModel& robot, const EngineOptions& options, const Plane<W>& plane)
      : CommonEngine(robot, options),
        robot_(robot),
        plane_(plane),
        along_(model().cast<W>(), plane),
        along_factors_(along_.slides, Vector3<W>(plane.axes * model().gravity().cast<W>())),
        model_(model(), plane),
        ws_(model_),
        one_(model_),
        many_(model_),
        paths_(model_, options.wants(Want::inverse) ? model_.nv() : 0, lanes),
        all_(model_.nv(), 1),
        covariances_(model_.branch_count()),
        placed_(model()),
        scale_(model()) {
    assert(static_cast<int>(plane.home.size()) == lowered().nv());
    model_.set_weights(lowered());
    rows_.want = {Want::acceleration};
    if (options.wants(Want::inverse)) {
      in_plane_.resize(model_.nv(), model_.nv());
      responses_.resize(model_.nv());
    }
    if (options.wants(Want::acceleration) || options.wants_factors() ||
        options.wants(Want::derivatives))
      certified_.emplace(robot, lowered(), options, false);
    if (options.selection.size() > 0)
      selection_ = PlanarSelection<T>(model_, along_, along_factors_, plane_, options.selection);
  }

 private:
  // Of blocks of turning and of moving.
  struct Traces {
    T turning = T(0), moving = T(0);
  };

  // What the sweeps show of one column.
  struct Observer {
    const PlanarModel<T>& model;
    const PlanarWorkspace<T>& ws;
    SolveSums<T>& sums;

    void gathered(int k, const Planar<T>& z) const { sums.noise += absorbed(model.link(k), z); }
    void moved(int k, const T& e, const T& squares_of_terms) const {
      sums.energy += ws.links[k].D * (e * e + squares_of_terms);
    }
  };

  // The share of a link in N of covariance/force_noise.hpp, from z-.
  static T absorbed(const PlanarLink<T>& link, const Planar<T>& z) {
    const PlanarWeights<T>& w = link.weights;
    return w.n * (z.n * z.n) + w.force * (z.x * z.x + z.y * z.y);
  }

  // N
  T noise() const {
    T sum = T(0);
    for (int k = 0; k < model_.nv(); ++k) sum += absorbed(model_.link(k), ws_.z[k]);
    return sum;
  }

  // Of inertias times squares of a: |a|_s^2 of lowering/least_inertia.hpp, R of covariance/force_noise.hpp.
  static T sum_of(const std::vector<T>& inertias, const T* a) {
    T sum = T(0);
    for (std::size_t k = 0; k < inertias.size(); ++k) sum += inertias[k] * (a[k] * a[k]);
    return sum;
  }

  // singular where some D is no more than rounding in T, of the axes too: of two that are parallel but
  // for their last bits D is right to its own digits, by rounding_bound.hpp, and nothing beside P
  // (rounding_scale.hpp).
  Outcome verdict(const T* q) {
    const Model<T>& model = this->model();
    set_position(model, q, placed_);
    scale_.begin(model);
    for (int k = model.nv() - 1; k >= 0; --k) {
      const Joint<T>& joint = model.joint(k);
      const Vector6<T> column = scale_.P[k].col(joint.axis());
      const T D = column[joint.axis()] + joint.r, scale = scale_.scale(model, k);
      if (!std::isfinite(D)) return {.status = Outcome::Status::not_finite};
      if (!(D > least_D_over_scale<T>(1) * scale))
        return {.status = Outcome::Status::singular,
                .joint = k,
                .D = static_cast<double>(D),
                .scale = static_cast<double>(scale)};
      if (joint.parent >= 0) scale_.propagate(model, placed_.phi[k], k, Vector6<T>(column / D));
    }
    return {};
  }

  bool may_be_wrong(const T& check) const {
    return along_factors_.suspect() || check != T(0) || !(ws_.margin > T(0));
  }

  // Of the factors at q, which are made.
  bool factors_may_be_wrong(const T* q) {
    planar_factor(model_, q, ws_);
    T check = T(0);
    for (const auto& at : ws_.links) check += at.inverse_D * T(0);
    return may_be_wrong(check);
  }

  // The first sum of S in (11) of force_noise.hpp, for X = M^-1 in the plane.
  T energy_of_columns(const T* X) const {
    const std::ptrdiff_t nv = model_.nv();
    T sum = T(0);
    for (std::ptrdiff_t k = 0; k < nv; ++k) sum += ws_.links[k].D * X[k * nv + k];
    return sum;
  }

  // S, with l+ and Omega+ in the axes of the plane, where a link turns about n alone.
  T energy_with_terms(const T* X) {
    const auto square = [](const T& x) { return x * x; };
    const std::ptrdiff_t nv = model_.nv();
    const T unit = rounding_unit<T>();
    std::vector<Traces>& Omega = responses_;
    T sum = T(0);
    for (std::ptrdiff_t k = 0; k < nv; ++k) {
      const PlanarLink<T>& link = model_.link(k);
      const auto& at = ws_.links[k];
      const T v = X[k * nv + k];
      Traces plus;
      if (link.parent >= 0) {
        const Traces& there = Omega[link.parent];
        const T reach = link.slides ? ws_.apart[link.apart].reach : link.reach;
        plus = {there.turning, T(2) * there.moving + reach * there.turning};
      }
      const T own = link.has_noise ? square(link.slides ? at.g.x : at.g.n) : T(1);
      const T turned = link.slides ? square(at.g.n) : own;
      const T moved = square(at.g.y) + (link.slides ? own : square(at.g.x));
      sum += at.D * (v + turned * plus.turning + moved * plus.moving);
      Omega[k] = {T(2) * plus.turning, T(2) * plus.moving};
      (link.slides ? Omega[k].moving : Omega[k].turning) += T(2) * v;
      Omega[k].turning = std::min(Omega[k].turning, link.weights.pending_moment / unit);
      Omega[k].moving = std::min(Omega[k].moving, link.weights.pending_force / unit);
    }
    return sum;
  }

  // M^-1 of the DoF in the plane, column-major, without subnormal entries (factors/inverse.hpp).
  // Zero, or NaN where a number is not finite.
  T columns(T* X) {
    const FlushSubnormals flush;
    const int nv = model_.nv();
    Many check = T(0);
    int i = 0;
    for_each_chunk(nv, lanes, [&](int first, int count) {
      const int last = first + count - 1;
      detail::sweep_inward(
          model_, ws_, last, paths_[i++],
          [&](int k) { return detail::Unit<Many>::lane(k - first); }, many_);
      detail::sweep_outward(model_, ws_, last, many_, [&](int k, const Many& a) {
        check += a * T(0);
        store_rows(a, first, k, nv, X);
      });
    });
    mirror(nv, X);
    T sum = T(0);
    for (int lane = 0; lane < lanes; ++lane) sum += check[lane];
    return sum;
  }

  RobotModel robot_;
  Plane<W> plane_;
  AlongNormal<W> along_;
  TranslationalFactors<T> along_factors_;
  PlanarModel<T> model_;
  PlanarWorkspace<T> ws_;
  PlanarColumns<T> one_;
  PlanarColumns<Many> many_;
  ColumnPaths paths_;
  std::vector<char> all_;  // links: a path for any tau
  std::vector<detail::PlanarCovariance<T>> covariances_;
  MatrixX<T> in_plane_;
  std::vector<Traces> responses_;  // Omega of (4) of force_noise.hpp
  PlanarSelection<T> selection_;
  bool by_certified_ = false;  // the factors that are kept
  LinkKinematics<T> placed_;   // these two for the verdict
  RoundingScale<T> scale_;
  std::optional<CertifiedAnswer> certified_;
  EngineOptions rows_;  // of further workers, who answer rows alone
  std::vector<std::unique_ptr<PlanarEngine>> workers_;
};

}  // namespace kalmarm
