// In a file of its own: sums and products of DoubleDouble must not be contracted.
#include "algorithms/fast/certified/wide_factors.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "algorithms/fast/certified/bounded_solve.hpp"
#include "algorithms/fast/certified/wide_test.hpp"
#include "algorithms/fast/rigid/inverse_dynamics.hpp"
#include "algorithms/model/plain.hpp"

namespace kalmarm {

struct WideFactors::Sweeps {
  using T = DoubleDouble;

  // A frame among the columns of B: its six wrenches are forces on a link.
  struct Wrenches {
    int link;
    MatrixPlacement<T> phi;
  };

  Sweeps(const RobotModel& robot, const EngineOptions& options)
      : model(kalmarm::model_of(robot).cast<T>(), Zeros::left_out,
              accepted_error(default_tolerance<T>), options.frames),
        factors(model),
        mass(model),
        bounded(model),
        test(model),
        q(model.nq()),
        rows(model.widths().c),
        loads(model.widths().l),
        b(model.nv()),
        x(b),
        r(b),
        d(b),
        signs(model.nv()),
        dofs(options.selection.dofs) {
    std::mt19937_64 random;
    for (double& sign : signs) sign = random() % 2 ? 1 : -1;
    for (const Frame& frame : options.selection.frames) {
      Wrenches& to = frames.emplace_back();
      to.link = frame.link;
      if (frame.link < 0) continue;
      const Transform<T> on_link =
          model.phi_on_link(frame.link, site_of(frame).cast<Wider<T>>().phi());
      for (int i = 0; i < 3; ++i) {
        to.phi.p[i] = on_link.p[i];
        for (int j = 0; j < 3; ++j) to.phi.R.R[i][j] = on_link.R(i, j);
      }
    }
    B.resize(std::size_t(options.selection.size()) * model.nv());
  }

  // D and g at the position, with contacts where there are some, and what can be told of them.
  Outcome factor(const Call<double>& at) {
    std::copy_n(at.q, q.size(), q.begin());
    if (at.contacts) std::copy_n(at.contacts, rows.size(), rows.begin());
    if (at.loads) std::copy_n(at.loads, loads.size(), loads.begin());
    given = {at.contacts ? rows.data() : nullptr, at.axes, at.loads ? loads.data() : nullptr};
    const Outcome out = test.of_D(model, q.data(), given);
    if (!out) return out;
    covariance_factor(model, q.data(), factors, given);
    if (given.forces) test.add(error_of_contacts(model, factors));
    detail::set_placements(model, q.data(), mass);
    contacts.clear();
    detail::for_each_contact(model, mass, given, [this](int link, const Sixfold<T>& w) {
      contacts.push_back({link, w});
    });
    return out;
  }

  // (1) of b, but for the rounding: x, r, d and its bound.
  void solve() {
    const T eps(test.error_of_D());
    bounded.solve(model, factors, eps, b.data(), x.data());
    detail::mass_times(model, x.data(), contacts, given, mass, r.data());
    for (std::size_t k = 0; k < b.size(); ++k) r[k] = b[k] - r[k];
    bound = static_cast<double>(bounded.solve(model, factors, eps, r.data(), d.data()));
    for (std::size_t k = 0; k < b.size(); ++k) x[k] += d[k];
  }

  // (2) of the last solution.
  double energy_error() const {
    const T size = dot(b.data(), x.data());
    if (size == T(0)) return 0;
    const double square(dot(r.data(), d.data()) / size);
    return std::sqrt(std::max(square, -square));  // NaN stays NaN
  }

  T dot(const T* one, const T* other) const {
    T sum(0);
    for (std::size_t k = 0; k < b.size(); ++k) sum += one[k] * other[k];
    return sum;
  }

  // (2) of a random torque.
  double probe() {
    for (std::size_t k = 0; k < b.size(); ++k)
      b[k] = T(signs[k]) / sqrt(factors.links[k].inverse_D);
    solve();
    return energy_error() + rounded;
  }

  Outcome judged(double error, double check) const {
    return check == 0 ? test.of_error(error) : Outcome{.status = Outcome::Status::not_finite};
  }

  // use(j) of every column of M^-1, which stands in x.
  template <class Use>
  Outcome of_columns(const Call<double>& at, const Use& use) {
    const Outcome out = factor(at);
    if (!out) return out;
    double worst = 0, check = 0;
    for (std::size_t j = 0; j < b.size(); ++j) {
      std::fill(b.begin(), b.end(), T(0));
      b[j] = T(1);
      solve();
      use(static_cast<int>(j));
      keep_worse(energy_error(), worst);
      for (const T& entry : x) check += 0 * entry.hi;
    }
    return judged(worst + rounded, check);
  }

  static void keep_worse(double error, double& worst) {
    if (error > worst || std::isnan(error)) worst = error;
  }

  // B, column by column.
  void set_selection() {
    std::fill(B.begin(), B.end(), T(0));
    T* column = B.data();
    for (const int dof : dofs) {
      column[dof] = T(1);
      column += b.size();
    }
    for (const Wrenches& at : frames)
      for (int i = 0; i < 6; ++i, column += b.size())
        if (at.link >= 0) set_row(at, i, column);
  }

  // J'(k) of unit i of a frame's six: H(k) phi(k, frame) unit(i).
  void set_row(const Wrenches& at, int i, T* column) const {
    const auto unit = [i](int j) { return T(i == j ? 1 : 0); };
    Sixfold<T> z = {unit(0), unit(1), unit(2), unit(3), unit(4), unit(5)};
    detail::force_to_parent(at.phi, z);
    for (int k = at.link; k >= 0; k = model.link(k).parent) {
      const LoweredLink<T>& link = model.link(k);
      column[k] = link.slides ? z.w : z.z;
      if (link.parent >= 0) detail::force_to_parent(model, link, factors, factors.links[k].d, z);
    }
  }

  static constexpr double rounded = 0x1p-53;  // to double

  LoweredModel<T> model;
  FastFactors<T> factors;
  InverseDynamicsWorkspace<T> mass;
  BoundedSolve<T> bounded;
  double bound = 0;  // of what the last solution leaves
  WideTest test;
  std::vector<T> q, rows, loads, b, x, r, d;
  Acting<T> given;                                   // of the last factors
  std::vector<std::pair<int, Sixfold<T>>> contacts;  // on their links
  std::vector<double> signs;
  std::vector<int> dofs;
  std::vector<Wrenches> frames;
  std::vector<T> B;
};

WideFactors::WideFactors(const RobotModel& robot, const EngineOptions& options)
    : sweeps_(std::make_unique<Sweeps>(robot, options)) {}

WideFactors::WideFactors(WideFactors&&) noexcept = default;
WideFactors::~WideFactors() = default;

Outcome WideFactors::inverse(const Call<double>& call) {
  Sweeps& w = *sweeps_;
  const std::ptrdiff_t nv = w.model.nv();
  double* const X = call.out;
  return w.of_columns(call, [&](int j) {
    for (std::ptrdiff_t i = j; i < nv; ++i) X[i + j * nv] = X[j + i * nv] = w.x[i].hi;
  });
}

Outcome WideFactors::diagonal(const Call<double>& call) {
  Sweeps& w = *sweeps_;
  return w.of_columns(call, [&](int j) { call.out[j] = w.x[j].hi; });
}

Outcome WideFactors::log_det(const Call<double>& call) {
  Sweeps& w = *sweeps_;
  const Outcome out = w.factor(call);
  if (!out) return out;
  // Of 1 / D, as in factors/log_det.hpp.
  DoubleDouble product(1);
  long exponent = 0;
  for (const auto& at : w.factors.links) {
    product *= at.inverse_D;
    int own = 0;
    std::frexp(product.hi, &own);
    product = ldexp(product, -own);
    exponent += own;
  }
  *call.out = -(std::log(product.hi) + product.lo / product.hi +
                static_cast<double>(exponent) * std::numbers::ln2);
  return w.judged(w.probe(), 0 * *call.out);
}

Outcome WideFactors::selected(const Call<double>& call, double* X) {
  Sweeps& w = *sweeps_;
  const Outcome out = w.factor(call);
  if (!out) return out;
  w.set_selection();
  const std::ptrdiff_t nv = w.model.nv(), size = nv > 0 ? w.B.size() / nv : 0;
  double worst = 0, check = 0;
  for (std::ptrdiff_t j = 0; j < size; ++j) {
    std::copy_n(w.B.begin() + j * nv, nv, w.b.begin());
    w.solve();
    for (std::ptrdiff_t i = j; i < size; ++i) {
      X[i + j * size] = X[j + i * size] = w.dot(w.B.data() + i * nv, w.x.data()).hi;
      check += 0 * X[i + j * size];
    }
    Sweeps::keep_worse(w.energy_error(), worst);
  }
  return w.judged(worst + Sweeps::rounded, check);
}

Outcome WideFactors::factor(const Call<double>& call) {
  Sweeps& w = *sweeps_;
  const Outcome out = w.factor(call);
  return out ? w.judged(w.probe(), 0) : out;
}

Outcome WideFactors::solve(int columns, const double* taus, double* X) {
  Sweeps& w = *sweeps_;
  const std::ptrdiff_t nv = w.model.nv();
  double worst = 0, check = 0;
  for (int j = 0; j < columns; ++j, taus += nv, X += nv) {
    std::copy_n(taus, nv, w.b.begin());
    w.solve();
    double size = 0, change = 0, lost = 0;
    for (std::ptrdiff_t k = 0; k < nv; ++k) {
      X[k] = w.x[k].hi;
      check += 0 * X[k];
      size += w.x[k].hi * w.x[k].hi;
      lost += w.x[k].lo * w.x[k].lo;
      change += w.d[k].hi * w.d[k].hi;
    }
    const double error = std::sqrt(change) + std::sqrt(w.bound) + std::sqrt(lost);
    Sweeps::keep_worse(error > 0 ? error / std::sqrt(size) : error, worst);
  }
  return w.judged(worst, check);
}

}  // namespace kalmarm
