#include "accuracy/truth.hpp"

#include <cmath>
#include <limits>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "accuracy/inverse_check.hpp"
#include "accuracy/measures.hpp"
#include "accuracy/world_frame.hpp"
#include "algorithms/solver.hpp"

namespace kalmarm {
namespace {

constexpr double agreement = 1e-25;
constexpr int probes = 4;
constexpr const char* filter_variant = "Sequential<ArrayMGS>";

// Both algorithms at the precision in force.
Truth attempt(const Model<Real>& model, const VectorX<Real>& q, const VectorX<Real>& qd,
              const VectorX<Real>& tau, int dense) {
  const int nv = model.nv();
  Truth out;
  const auto filter = make_solver<Real>(filter_variant, model);
  VectorX<Real> a(nv);
  MatrixX<Real> X(nv, nv);
  out.outcome = filter->acceleration(q, qd, tau, a);
  if (out.outcome) out.outcome = filter->inverse(q, X);
  if (!out.outcome) return out;

  WorldFrame world = world_frame(model, q, qd);
  const VectorX<Real> torque = tau - world.bias;
  VectorX<Real> a_world;
  if (nv <= dense) {
    const std::optional<MatrixX<Real>> X_world = ldl_inverse(world.M);
    if (!X_world) {
      out.disagreement = std::numeric_limits<double>::infinity();
      return out;
    }
    a_world = *X_world * torque;
    out.disagreement = matrix_error(*X_world, X).scaled;
  } else {
    a_world = X * torque;
    out.disagreement = probed_residual(world.M, X, probes);
  }
  out.disagreement = larger(out.disagreement, acceleration_error(a_world, a, world.M).relative);
  out.M = std::move(world.M);
  out.X = std::move(X);
  out.a = std::move(a);
  return out;
}

}  // namespace

template <class T>
Truth truth(const Model<T>& model, const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau,
            const TruthLimits& limits) {
  Truth out;
  const unsigned first = 40 + static_cast<unsigned>(std::ceil(4 * std::log10(model.nv())));
  for (unsigned digits = first; digits <= limits.digits; digits *= 2) {
    const Digits precision(digits);
    out = attempt(model.template cast<Real>(), q.template cast<Real>(), qd.template cast<Real>(),
                  tau.template cast<Real>(), limits.dense);
    out.digits = digits;
    if (out.outcome && out.disagreement <= agreement) return out;
  }
  if (!out.outcome) return out;
  std::ostringstream what;
  what << "no truth within " << limits.digits << " digits: with " << out.digits
       << " two algorithms still differ by " << out.disagreement;
  throw std::runtime_error(what.str());
}

template Truth truth(const Model<float>&, const VectorX<float>&, const VectorX<float>&,
                     const VectorX<float>&, const TruthLimits&);
template Truth truth(const Model<double>&, const VectorX<double>&, const VectorX<double>&,
                     const VectorX<double>&, const TruthLimits&);

}  // namespace kalmarm
