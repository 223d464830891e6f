// The fast path behind an Outcome: forward dynamics of one state, or of many states of one robot,
// by the conventional form or the square-root form.
//
// The sweeps leave two numbers for every lane: how far D(k) stays above the net, at the joint that
// comes nearest, and whether all accelerations are finite. Only a suspect pays for more: where a
// second look does not clear it, a variant of inverse_mass/ looks into it, and gives the answer in
// its place: the plain one of the conventional form, the most careful one of the square-root form.
// Where errors grow along a robot every state is a suspect (rounding_growth.hpp).
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "algorithms/inverse_mass/factored_bias.hpp"
#include "algorithms/inverse_mass/sequential.hpp"
#include "algorithms/inverse_mass/wide_refined.hpp"
#include "algorithms/partial_solver.hpp"
#include "algorithms/riccati/array.hpp"
#include "algorithms/riccati/conventional.hpp"
#include "algorithms/spatial/lanes.hpp"
#include "algorithms/structured/forward_dynamics.hpp"
#include "algorithms/structured/rounding_growth.hpp"
#include "algorithms/structured/square_root.hpp"

namespace kalmarm {

namespace detail {

template <class S>
S number(const S& x, int) {
  return x;
}
template <class S, int n>
S number(const Pack<S, n>& x, int lane) {
  return x[lane];
}

template <class T>
auto inverse_D(const SquareRootWorkspace<T>& swept, int k, int lane) {
  return number(swept.inverse_D[k], lane);
}
template <class S>
S inverse_D(const StructuredFactors<S>& swept, int k, int) {
  return swept.links[k].inverse_D;
}

}  // namespace detail

struct CovarianceForm {
  using Fallback = Sequential<Conventional>;
  static constexpr bool at_rest = false;
  template <class T>
  using Workspace = StructuredWorkspace<T>;

  template <class T, class S>
  static void acceleration(const StructuredModel<S>& model, const T* q, const T* qd, const T* tau,
                           Workspace<T>& ws, T* a) {
    structured_acceleration(model, q, qd, tau, ws, a);
  }

  // D and g at q alone.
  template <class S>
  struct Factoring {
    explicit Factoring(const StructuredModel<S>&) {}

    void factor(const StructuredModel<S>& model, const S* q, StructuredFactors<S>& factors) const {
      structured_factor(model, q, factors);
    }
  };

  // A second look at a suspect: none.
  template <class S>
  struct Second {
    explicit Second(const StructuredModel<S>&) {}
    template <class Swept>
    static bool clears(const StructuredModel<S>&, const S*, const Swept&, int) {
      return false;
    }
  };

  // Whether every state of this robot is a suspect; the fallback then looks closely at each.
  template <class S>
  static bool mistrusts(const Model<S>& model, const StructuredModel<S>& structured,
                        Fallback::Workspace<S>& fallback) {
    const bool grows = RoundingGrowth<S>(model, structured).grows();
    if (grows) fallback.factors.test.look_always();
    return grows;
  }
};

struct SquareRootForm {
  using Fallback = WideRefined<FactoredBias<ArrayGivens>>;
  static constexpr bool at_rest = false;
  template <class T>
  using Workspace = SquareRootWorkspace<T>;

  template <class T, class S>
  static void acceleration(const StructuredModel<S>& model, const T* q, const T* qd, const T* tau,
                           Workspace<T>& ws, T* a) {
    square_root_acceleration(model, q, qd, tau, ws, a);
  }

  template <class S>
  struct Factoring {
    SquareRootWorkspace<S> ws;
    std::vector<S> zeros;

    explicit Factoring(const StructuredModel<S>& model) : ws(model), zeros(model.nv(), S(0)) {}

    void factor(const StructuredModel<S>& model, const S* q, StructuredFactors<S>& factors) {
      square_root_factor(model, q, zeros, ws, factors);
    }
  };

  // The net is made of composite inertias, which grow with the cube of a chain's length: in float32
  // it catches long chains. P of the other form tells them from singular ones, for less than the
  // fallback takes. The two have to agree on every D: rows of least weight would show there.
  template <class S>
  struct Second {
    StructuredFactors<S> factors;

    explicit Second(const StructuredModel<S>& model) : factors(model) {}

    // swept: where the rows have left 1 / D.
    template <class Swept>
    bool clears(const StructuredModel<S>& model, const S* q, const Swept& swept, int lane) {
      structured_factor(model, q, factors);
      bool agree = factors.margin > S(0);
      for (int k = 0; k < model.nv() && agree; ++k)
        agree = std::abs(detail::inverse_D(swept, k, lane) / factors.links[k].inverse_D - S(1)) <
                S(0.01);
      return agree;
    }
  };

  template <class S, class Workspace>
  static bool mistrusts(const Model<S>&, const StructuredModel<S>&, const Workspace&) {
    return false;
  }
};

namespace detail {

// What looks into suspects.
template <class S, class Form>
class Fallback {
  using V = typename Form::Fallback;

 public:
  Fallback(const Model<S>& model, const StructuredModel<S>& structured)
      : model_(model),
        rm_(model_),
        ws_(model_),
        tau_(model.nv()),
        a_(model.nv()),
        second_(structured),
        suspects_all_(Form::mistrusts(model_, structured, ws_)) {}

  // Every state.
  bool suspects_all() const { return suspects_all_; }

  // From what the sweeps have left of a state q, in a lane of `swept`.
  template <class Swept, class T>
  bool suspects(const StructuredModel<S>& structured, const S* q, const Swept& swept,
                const T& check, int lane = 0) {
    if (suspects_all_ || number(check, lane) != S(0)) return true;
    return !(number(swept.margin, lane) > S(0)) && !second_.clears(structured, q, swept, lane);
  }

  Outcome factor(const S* q) {
    set_position(model_, q, rm_);
    return factor();
  }

  [[gnu::noinline]] Outcome acceleration(const S* q, const S* qd, const S* tau, S* a) {
    set_position(model_, q, rm_);
    if constexpr (!Form::at_rest) set_velocity(model_, qd, rm_);  // V may factor the bias with M
    Outcome out = factor();
    if (!out) return out;
    std::copy_n(tau, model_.nv(), tau_.data());
    V::acceleration(model_, rm_, tau_, ws_, a_);
    report_refinement(ws_, out);
    std::copy_n(a_.data(), model_.nv(), a);
    return checked(a_, out);
  }

  // After factor, these five.
  void solve(const VectorX<S>& tau, VectorX<S>& x) { V::solve(model_, rm_, tau, ws_, x); }

  void solve(const MatrixX<S>& taus, MatrixX<S>& X) {
    for (int j = 0; j < taus.cols(); ++j) {
      tau_ = taus.col(j);
      solve(tau_, a_);
      X.col(j) = a_;
    }
  }

  void diagonal(VectorX<S>& x) {
    for (int k = 0; k < model_.nv(); ++k) {
      tau_.setZero();
      tau_[k] = S(1);
      solve(tau_, a_);
      x[k] = a_[k];
    }
  }

  S log_det() const {
    using std::log;
    S sum = S(0);
    for (const S& D : gains(ws_).D) sum += log(D);
    return sum;
  }

  [[gnu::noinline]] Outcome diagonal(const S* q, VectorX<S>& x) {
    const Outcome out = factor(q);
    if (!out) return out;
    diagonal(x);
    return checked(x, out);
  }

  [[gnu::noinline]] Outcome log_det(const S* q, S& x) {
    const Outcome out = factor(q);
    if (!out) return out;
    x = log_det();
    return std::isfinite(x) ? out : Outcome{.status = Outcome::Status::not_finite};
  }

  // What `selected` is about; takes its memory.
  void select(const Selection<S>& selection) {
    selection_ = selection;
    J_.resize(6 * selection.sites.size(), model_.nv());
    B_.resize(model_.nv(), selection.size());
    x_.resize(model_.nv(), selection.size());
  }

  [[gnu::noinline]] Outcome selected(const S* q, MatrixX<S>& X) {
    const Outcome out = factor(q);
    if (!out) return out;
    const int dofs = static_cast<int>(selection_.dofs.size());
    B_.setZero();
    for (int i = 0; i < dofs; ++i) B_(selection_.dofs[i], i) = S(1);
    site_jacobian<S>(model_, rm_, selection_.sites, J_);
    B_.rightCols(J_.rows()) = J_.transpose();
    solve(B_, x_);
    for (int j = 0; j < B_.cols(); ++j)
      for (int i = j; i < B_.cols(); ++i) X(i, j) = X(j, i) = B_.col(i).dot(x_.col(j));
    return checked(X, out);
  }

  [[gnu::noinline]] Outcome inverse(const S* q, MatrixX<S>& X) {
    const Outcome out = factor(q);
    if (!out) return out;
    V::inverse(model_, rm_, ws_, X);
    return checked(X, out);
  }

 private:
  template <class Result>
  static Outcome checked(const Result& result, const Outcome& out) {
    return result.allFinite() ? out : Outcome{.status = Outcome::Status::not_finite};
  }

  // D and g of a filter, or of the one that is refined.
  template <class Workspace>
  static const Gains<S>& gains(const Workspace& ws) {
    if constexpr (requires { ws.factors; })
      return ws.factors;
    else
      return ws.inner.factors;
  }

  Outcome factor() {
    Outcome out = V::factor(model_, rm_, ws_);
    out.suspect = static_cast<bool>(out);
    return out;
  }

  Model<S> model_;
  RandomModel<S> rm_;
  typename V::template Workspace<S> ws_;
  VectorX<S> tau_, a_;
  Selection<S> selection_;
  MatrixX<S> J_, B_, x_;
  typename Form::template Second<S> second_;
  bool suspects_all_;
};

}  // namespace detail

template <class S, class Form = CovarianceForm>
class StructuredDynamics {
 public:
  explicit StructuredDynamics(const Model<S>& model, Zeros zeros = Zeros::left_out)
      : model_(model, zeros), workspace_(model_), fallback_(model, model_) {}

  // a (nv) from q (nq), qd and tau (nv). On failure a is not to be used.
  Outcome acceleration(const VectorX<S>& q, const VectorX<S>& qd, const VectorX<S>& tau,
                       VectorX<S>& a) {
    Form::acceleration(model_, q.data(), qd.data(), tau.data(), workspace_, a.data());
    if (!fallback_.suspects(model_, q.data(), workspace_, workspace_.check)) return {};
    return fallback_.acceleration(q.data(), qd.data(), tau.data(), a.data());
  }

 private:
  StructuredModel<S> model_;
  typename Form::template Workspace<S> workspace_;
  detail::Fallback<S, Form> fallback_;
};

// One thread's: several on parts of the same arrays do not disturb each other.
template <class S, class Form = CovarianceForm, int lanes = padding<S>>
class StructuredBatch {
 public:
  using P = Pack<S, lanes>;

  explicit StructuredBatch(const Model<S>& model)
      : model_(model),
        workspace_(model_),
        fallback_(model, model_),
        q_(model.nq()),
        qd_(model.nv()),
        tau_(model.nv()),
        a_(model.nv()) {}

  // a (count x nv) from q (count x nq), qd and tau (count x nv), all row-major: one state a row,
  // and `count` outcomes. Returns how many failed, whose rows are not to be used.
  int acceleration(int count, const S* q, const S* qd, const S* tau, S* a, Outcome* outcomes) {
    const int nq = model_.nq(), nv = model_.nv();
    int failed = 0;
    std::fill_n(outcomes, count, Outcome{});
    for (int first = 0; first < count; first += lanes) {
      const int left = count - first, states = std::min(lanes, left);
      to_lanes(q, nq, states, left, q_);
      to_lanes(qd, nv, states, left, qd_);
      to_lanes(tau, nv, states, left, tau_);
      Form::acceleration(model_, q_.data(), qd_.data(), tau_.data(), workspace_, a_.data());
      from_lanes(a_, nv, states, a);
      for (int i = 0; i < states; ++i) {
        if (!fallback_.suspects(model_, q + i * nq, workspace_, workspace_.check, i)) continue;
        outcomes[i] = fallback_.acceleration(q + i * nq, qd + i * nv, tau + i * nv, a + i * nv);
        failed += !outcomes[i];
      }
      q += states * nq;
      qd += states * nv;
      tau += states * nv;
      a += states * nv;
      outcomes += states;
    }
    return failed;
  }

 private:
  StructuredModel<S> model_;
  typename Form::template Workspace<P> workspace_;
  detail::Fallback<S, Form> fallback_;
  std::vector<P> q_, qd_, tau_, a_;
};

}  // namespace kalmarm
