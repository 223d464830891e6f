#include "accuracy/truth/acceleration_truth.hpp"

#include <optional>

#include "accuracy/truth/link_filter.hpp"
#include "accuracy/truth/structured_condition.hpp"

namespace kalmarm {
namespace {

constexpr unsigned digits = 38;  // 128 bits: as many as a ball holds without memory of its own
constexpr double required_width = 0x1p-64, required_of_M = 1e-25;  // (2)

constexpr int most_steps = 4;             // (1): each gives as many digits as the filter has
constexpr unsigned condition_digits = 9;  // for kS

using Wide = long double;

// (1), until (2). False where that is not reached.
template <class T>
bool refine(const Enclosure& enclosure, LinkFilter<Wide>& filter, const Task<T>& task,
            const Vector3<Real>& gravity, Response<T>& response) {
  const VectorX<Real> qd = task.qd.template cast<Real>(), tau = response.tau.template cast<Real>();
  response.a = filter
                   .acceleration(task.qd.template cast<Wide>(), response.tau.template cast<Wide>(),
                                 gravity.template cast<Wide>())
                   .template cast<Real>();
  for (int step = 0;; ++step) {
    const VectorX<Ball> r = enclosure.residual(qd, tau, gravity, response.a);
    if (step > 0) {  // before, a has no more digits than long double
      response.width = enclosure.acceleration_width(r, response.a);
      if (response.width.relative <= required_width && response.width.energy <= required_width)
        return true;
    }
    if (step == most_steps) return false;
    const VectorX<Wide> correction =
        filter.solve(r.unaryExpr([](const Ball& x) { return static_cast<Wide>(rounded(x)); }));
    response.a += correction.template cast<Real>();
  }
}

// Nothing where (2) cannot be proven with 128 bits.
template <class T>
std::optional<Truth<T>> quick_truth(const Model<T>& model, const VectorX<T>& q,
                                    const std::vector<Task<T>>& tasks,
                                    const TruthOptions& options) {
  const Digits precision(digits);
  const BallDigits centres;
  LinkFilter<Wide> filter(model.template cast<Wide>(), q.template cast<Wide>());
  if (!filter.outcome()) return {};
  const Enclosure enclosure(model, q, filter.inverse_diagonal().template cast<Real>());
  if (!enclosure.definite()) return {};
  Truth<T> out;
  out.digits = digits;
  if (options.matrices) {
    out.M = enclosure.mass();
    out.width.M = enclosure.mass_width(out.M);
    if (!(out.width.M <= required_of_M)) return {};
  }
  for (const Task<T>& task : tasks) {
    const Vector3<Real> gravity = gravity_of(task, model);
    Response<T>& response = out.responses.emplace_back();
    response.tau = torque_of(task, filter, enclosure, gravity);
    if (!refine(enclosure, filter, task, gravity, response)) return {};
  }
  if (options.draws == 0) return out;
  const Solve solve = [&](const VectorX<Real>& r) {
    return filter.solve(r.template cast<Wide>()).template cast<Real>().eval();
  };
  const std::vector<StructuredCondition> kS =
      structured_condition(model, q, tasks, out.responses, solve, condition_digits, options.draws);
  for (std::size_t i = 0; i < kS.size(); ++i) out.responses[i].kS = kS[i];
  return out;
}

}  // namespace

template <class T>
Truth<T> acceleration_truth(const Model<T>& model, const VectorX<T>& q,
                            const std::vector<Task<T>>& tasks, const TruthOptions& options) {
  if (std::optional<Truth<T>> quick = quick_truth(model, q, tasks, options))
    return *std::move(quick);
  return truth(model, q, tasks, options);
}

template Truth<float> acceleration_truth(const Model<float>&, const VectorX<float>&,
                                         const std::vector<Task<float>>&, const TruthOptions&);
template Truth<double> acceleration_truth(const Model<double>&, const VectorX<double>&,
                                          const std::vector<Task<double>>&, const TruthOptions&);

}  // namespace kalmarm
