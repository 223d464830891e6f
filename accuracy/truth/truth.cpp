#include "accuracy/truth/truth.hpp"

#include <cmath>
#include <limits>
#include <sstream>

#include "accuracy/truth/enclosure.hpp"
#include "accuracy/truth/link_filter.hpp"
#include "accuracy/truth/structured_condition.hpp"

namespace kalmarm {
namespace {

constexpr double required_width = 1e-25;

// M, X, D and g.
template <class T>
void set_matrices(const Enclosure& enclosure, LinkFilter<Real>& filter, Truth<T>& out) {
  const auto nv = static_cast<Eigen::Index>(filter.D().size());
  out.M = enclosure.mass();
  out.X = filter.inverse();
  out.D = Eigen::Map<const VectorX<Real>>(filter.D().data(), nv);
  out.g.resize(6, nv);
  for (Eigen::Index k = 0; k < nv; ++k) out.g.col(k) = filter.g()[k];
  out.width = {enclosure.mass_width(out.M), enclosure.inverse_width(out.X),
               enclosure.D_width(out.D), enclosure.g_width(out.g)};
}

// At the precision in force.
template <class T>
Truth<T> attempt(const Model<T>& model, const VectorX<T>& q, const std::vector<Task<T>>& tasks,
                 unsigned digits, const TruthOptions& options) {
  Truth<T> out;
  out.digits = digits;
  LinkFilter<Real> filter(model.template cast<Real>(), q.template cast<Real>());
  out.outcome = filter.outcome();
  if (!out.outcome) return out;

  const BallDigits centres;
  const Enclosure enclosure(model, q, filter.inverse_diagonal());
  if (options.matrices) set_matrices(enclosure, filter, out);
  for (const Task<T>& task : tasks) {
    const Vector3<Real> gravity = gravity_of(task, model);
    Response<T>& response = out.responses.emplace_back();
    response.tau = torque_of(task, filter, enclosure, gravity);
    const VectorX<Real> qd = task.qd.template cast<Real>(),
                        tau = response.tau.template cast<Real>();
    response.a = filter.acceleration(qd, tau, gravity);
    response.width = enclosure.acceleration_width(qd, tau, gravity, response.a);
  }

  if (options.draws > 0 && out.largest_width() <= required_width) {
    const Solve solve = [&](const VectorX<Real>& r) {
      return options.matrices ? VectorX<Real>(out.X * r) : filter.solve(r);
    };
    const std::vector<StructuredCondition> kS =
        structured_condition(model, q, tasks, out.responses, solve, digits, options.draws);
    for (std::size_t i = 0; i < kS.size(); ++i) out.responses[i].kS = kS[i];
  }
  return out;
}

// log10 of the ratio of the largest to the smallest mass.
template <class T>
double mass_range(const Model<T>& model) {
  double low = std::numeric_limits<double>::infinity(), high = 0;
  for (int k = 0; k < model.nv(); ++k)
    if (const double mass = model.joint(k).body.mass; mass > 0) {
      low = std::min(low, mass);
      high = std::max(high, mass);
    }
  return high > 0 ? std::log10(high) - std::log10(low) : 0;
}

}  // namespace

template <class T>
double Truth<T>::largest_width() const {
  double worst = std::max({width.M, width.X, width.D, width.g});
  for (const Response<T>& response : responses)
    worst = std::max({worst, response.width.relative, response.width.energy});
  return worst;
}

template <class T>
Truth<T> truth(const Model<T>& model, const VectorX<T>& q, const std::vector<Task<T>>& tasks,
               const TruthOptions& options) {
  Truth<T> out;
  const double start = 40 + 4 * std::log10(model.nv()) + 2 * mass_range(model);
  const unsigned first = std::min(options.digits, static_cast<unsigned>(std::ceil(start)));
  for (unsigned digits = first; digits <= options.digits; digits *= 2) {
    const Digits precision(digits);
    out = attempt(model, q, tasks, digits, options);
    if (out.outcome && out.largest_width() <= required_width) return out;
  }
  if (!out.outcome) return out;
  std::ostringstream what;
  what << "no truth within " << options.digits << " digits: with " << out.digits
       << " it is proven to no more than " << out.largest_width();
  throw NoTruth(NoTruth::Why::digits, what.str());
}

template struct Truth<float>;
template struct Truth<double>;
template Truth<float> truth(const Model<float>&, const VectorX<float>&,
                            const std::vector<Task<float>>&, const TruthOptions&);
template Truth<double> truth(const Model<double>&, const VectorX<double>&,
                             const std::vector<Task<double>>&, const TruthOptions&);

}  // namespace kalmarm
