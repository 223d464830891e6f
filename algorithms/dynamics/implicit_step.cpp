#include "kalmarm/implicit_step.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "algorithms/model/short_text.hpp"
#include "algorithms/spatial/spatial.hpp"

namespace kalmarm {
namespace {

[[noreturn]] void refuse(const std::string& what) {
  throw std::invalid_argument("implicit step: " + what);
}

// nv numbers, or as many zeros; those that are not to be negative, or that T does not hold, are refused.
template <class T>
std::vector<double> numbers(const RobotModel& model, const char* what,
                            const std::vector<double>& given, double least) {
  const auto nv = static_cast<std::size_t>(model.nv());
  if (given.empty()) return std::vector<double>(nv, 0);
  if (given.size() != nv)
    refuse(std::string(what) + " of " + std::to_string(given.size()) + " DoF, needed " +
           std::to_string(nv));
  for (std::size_t k = 0; k < nv; ++k)
    if (!(given[k] >= least && given[k] <= static_cast<double>(std::numeric_limits<T>::max())))
      refuse("DoF '" + model.names[k] + "': " + what + " " + short_text("%g", given[k]));
  return given;
}

// In T, once they are checked, of so many rows.
template <class T>
std::vector<T> held(const RobotModel& model, const std::vector<double>& given, int rows) {
  std::vector<T> out;
  for (int row = 0; row < rows; ++row)
    for (int k = 0; k < model.nv(); ++k)
      out.push_back(given.empty() ? T(0) : static_cast<T>(given[k]));
  return out;
}

// Whether entry k of q is that of DoF k.
bool is_as_velocity(const RobotModel& model) {
  for (int k = 0; k < model.nv(); ++k)
    if (!takes_spring(model.links[k]) || model.links[k].q_index != k) return false;
  return true;
}

// With r of (2) in the place of armature.
RobotModel with_noise(RobotModel model, double h, const std::vector<double>& b,
                      const std::vector<double>& k) {
  for (int dof = 0; dof < model.nv(); ++dof) model.links[dof].armature += h * (b[dof] + h * k[dof]);
  return model;
}

template <class T>
RobotModel checked(const RobotModel& model, double h, const JointTerms& terms, Scheme scheme,
                   const DynamicsOptions& options) {
  if (static_cast<int>(model.names.size()) != model.nv())
    refuse(std::to_string(model.names.size()) + " names for " + std::to_string(model.nv()) +
           " DoF");
  if (!(h >= 0 && std::isfinite(h))) refuse("h = " + short_text("%g", h));
  if (!options.question.dofs.empty() || !options.question.locked.empty())
    refuse("of a question that leaves joints out");
  if (options.question.at_rest) refuse("of a question at rest");
  const double any = -static_cast<double>(std::numeric_limits<T>::max());
  const auto b = numbers<T>(model, "damping", terms.damping, 0);
  auto k = numbers<T>(model, "stiffness", terms.stiffness, 0);
  numbers<T>(model, "reference", terms.reference, any);
  for (int dof = 0; dof < model.nv(); ++dof)
    if (k[dof] > 0 && !takes_spring(model.links[dof]))
      refuse("DoF '" + model.names[dof] + "': a spring about a ball or a free joint");
  if (scheme == Scheme::springs_at_start) std::ranges::fill(k, 0);
  return with_noise(model, h, b, k);
}

template <class T>
void move(const RobotModel& model, double h, VectorView<const T> a, VectorView<T> q,
          VectorView<T> v) {
  const int nv = model.nv();
  if (a.size() != nv || v.size() != nv || q.size() != model.nq)
    refuse("advance: q, v and a of " + std::to_string(q.size()) + ", " + std::to_string(v.size()) +
           " and " + std::to_string(a.size()) + ", needed " + std::to_string(model.nq) + " and " +
           std::to_string(nv));
  const T step = static_cast<T>(h);
  for (int k = 0; k < nv; ++k) v.data()[k] += step * a.data()[k];
  for (int k = 0; k < nv; ++k) {
    const LinkParameters& link = model.links[k];
    T* const at = q.data() + link.q_index;
    const T* const rate = v.data() + k;
    switch (link.coordinate) {
      case Coordinate::angle:
      case Coordinate::distance:
        at[0] += step * rate[0];
        break;
      case Coordinate::position:
        for (int i = 0; i < 3; ++i) at[i] += step * rate[i];
        break;
      case Coordinate::quaternion: {
        const Vector3<double> half =
            Eigen::Map<const Vector3<T>>(rate).template cast<double>() * (h / 2);
        const double angle = half.norm(), s = angle > 0 ? std::sin(angle) / angle : 1;
        Eigen::Quaternion<double> turned(at[0], at[1], at[2], at[3]);
        turned = turned *
                 Eigen::Quaternion<double>(std::cos(angle), s * half[0], s * half[1], s * half[2]);
        turned.normalize();
        at[0] = T(turned.w()), at[1] = T(turned.x()), at[2] = T(turned.y()), at[3] = T(turned.z());
        break;
      }
      case Coordinate::follower:
        break;
    }
  }
}

}  // namespace

void advance(const RobotModel& model, double h, VectorView<const double> a, VectorView<double> q,
             VectorView<double> v) {
  move<double>(model, h, a, q, v);
}
void advance(const RobotModel& model, double h, VectorView<const float> a, VectorView<float> q,
             VectorView<float> v) {
  move<float>(model, h, a, q, v);
}

template <class T>
ImplicitStep<T>::ImplicitStep(const RobotModel& model, double h, const JointTerms& terms,
                              Scheme scheme, const DynamicsOptions& options)
    : model_(model),
      h_(h),
      dynamics_(checked<T>(model, h, terms, scheme, options), options),
      rows_of_terms_(is_as_velocity(model) ? repeated : 1),
      damping_(held<T>(model, terms.damping, rows_of_terms_)),
      stiffness_(held<T>(model, terms.stiffness, rows_of_terms_)),
      reference_(held<T>(model, terms.reference, rows_of_terms_)),
      h_of_springs_(scheme == Scheme::springs_at_end ? static_cast<T>(h) : T(0)),
      tau_(model.nv()) {
  const bool derived = options.question.wants(Want::derivatives);
  if (derived) X_.resize(static_cast<std::size_t>(model.nv()) * model.nv());
  for (int k = 0; k < model.nv(); ++k) {
    if (stiffness_[k] == T(0)) continue;
    const int q = model.links[k].q_index;
    const bool next = !springs_.empty() && springs_.back().dof + springs_.back().count == k &&
                      springs_.back().q + springs_.back().count == q;
    if (next)
      ++springs_.back().count;
    else
      springs_.push_back({k, q, 1});
  }
}

template <class T>
void ImplicitStep<T>::require(const char* call, std::ptrdiff_t q, std::ptrdiff_t v,
                              std::ptrdiff_t tau) const {
  if (q == model_.nq && v == model_.nv() && tau == model_.nv()) return;
  refuse(std::string(call) + ": q, v and tau of " + std::to_string(q) + ", " + std::to_string(v) +
         " and " + std::to_string(tau) + ", needed " + std::to_string(model_.nq) + " and " +
         std::to_string(model_.nv()));
}

// tau^ of (2).
template <class T>
void ImplicitStep<T>::set_torque(std::ptrdiff_t rows, const T* q, const T* v, const T* tau,
                                 T* out) const {
  using Numbers = Eigen::Map<const Eigen::Array<T, Eigen::Dynamic, 1>>;
  using Result = Eigen::Map<Eigen::Array<T, Eigen::Dynamic, 1>>;
  const std::ptrdiff_t nv = model_.nv(), nq = model_.nq, block = rows_of_terms_;
  for (std::ptrdiff_t first = 0; first < rows; first += block) {
    const std::ptrdiff_t n = std::min(block, rows - first) * nv, at = first * nv;
    const auto damped = Numbers(tau + at, n) - Numbers(damping_.data(), n) * Numbers(v + at, n);
    const auto spring = [&](std::ptrdiff_t dof, std::ptrdiff_t in_q, std::ptrdiff_t count) {
      return Numbers(stiffness_.data() + dof, count) *
             ((Numbers(q + in_q, count) - Numbers(reference_.data() + dof, count)) +
              h_of_springs_ * Numbers(v + at + dof, count));
    };
    if (block > 1) {
      Result(out + at, n) = damped - spring(0, at, n);
      continue;
    }
    Result(out + at, n) = damped;
    for (const auto& [dof, in_q, count] : springs_)
      Result(out + at + dof, count) -= spring(dof, first * nq + in_q, count);
  }
}

template <class T>
Outcome ImplicitStep<T>::acceleration(VectorView<const T> q, VectorView<const T> v,
                                      VectorView<const T> tau, VectorView<T> a) {
  require("acceleration", q.size(), v.size(), tau.size());
  set_torque(1, q.data(), v.data(), tau.data(), tau_.data());
  return dynamics_.forward_dynamics(q, v, VectorView<const T>(tau_), a);
}

template <class T>
int ImplicitStep<T>::acceleration(RowsView<const T> q, RowsView<const T> v, RowsView<const T> tau,
                                  RowsView<T> a, std::span<Outcome> outcomes, int threads) {
  const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
  const std::ptrdiff_t nv = model_.nv(), nq = model_.nq;
  if (!q.fits(count, nq) || !v.fits(count, nv) || !tau.fits(count, nv))
    refuse("acceleration: rows of q, v and tau are " + q.shape() + ", " + v.shape() + " and " +
           tau.shape() + ", needed " + detail::shape(count, nq) + " and " +
           detail::shape(count, nv));
  if (static_cast<std::ptrdiff_t>(rows_.size()) < count * nv) rows_.resize(count * nv);
  set_torque(count, q.data(), v.data(), tau.data(), rows_.data());
  return dynamics_.forward_dynamics(q, v, RowsView<const T>(rows_.data(), count, nv), a, outcomes,
                                    threads);
}

template <class T>
Outcome ImplicitStep<T>::step(VectorView<T> q, VectorView<T> v, VectorView<const T> tau,
                              VectorView<T> a) {
  const Outcome outcome = acceleration(VectorView<const T>(q.data(), q.size()),
                                       VectorView<const T>(v.data(), v.size()), tau, a);
  if (outcome) advance(model_, h_, VectorView<const T>(a.data(), a.size()), q, v);
  return outcome;
}

template <class T>
Outcome ImplicitStep<T>::derivatives(VectorView<const T> q, VectorView<const T> v,
                                     VectorView<const T> tau, const Derivatives<T>& out,
                                     VectorView<T> a) {
  require("derivatives", q.size(), v.size(), tau.size());
  set_torque(1, q.data(), v.data(), tau.data(), tau_.data());
  const int nv = model_.nv();
  Derivatives<T> all = out;
  if (!all.dtau) all.dtau = MatrixView<T>(X_.data(), nv, nv);  // (4) has X
  const Outcome outcome = dynamics_.derivatives(q, v, VectorView<const T>(tau_), all, a);
  if (!outcome) return outcome;
  const auto less = [&](const MatrixView<T>& by, int column, T c) {
    if (!by || c == T(0)) return;
    const T* const x = all.dtau.data() + static_cast<std::ptrdiff_t>(column) * nv;
    T* const to = by.data() + static_cast<std::ptrdiff_t>(column) * nv;
    for (int i = 0; i < nv; ++i) to[i] -= c * x[i];
  };
  for (int k = 0; k < nv; ++k) less(out.dqd, k, damping_[k]);
  for (int k = 0; k < nv; ++k) {
    less(out.dq, k, stiffness_[k]);
    less(out.dqd, k, h_of_springs_ * stiffness_[k]);
  }
  return outcome;
}

template class ImplicitStep<float>;
template class ImplicitStep<double>;

}  // namespace kalmarm
