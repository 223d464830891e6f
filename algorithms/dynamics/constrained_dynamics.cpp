#include "kalmarm/constrained_dynamics.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "algorithms/dynamics/check_model.hpp"
#include "algorithms/dynamics/constraint_rows.hpp"
#include "algorithms/dynamics/threads.hpp"
#include "algorithms/fast/claims/constants.hpp"
#include "algorithms/model/short_text.hpp"
#include "kalmarm/kinematics.hpp"

namespace kalmarm {
namespace {

constexpr double standard_gravity = 9.81;  // [m/s^2]
constexpr int rows_at_once = 64;           // of a worker, whose M^-1 and J stay in a cache

[[noreturn]] void refuse(const std::string& what) {
  throw std::invalid_argument("constrained dynamics: " + what);
}

class Check {
 public:
  Check(const RobotModel& robot, const Constraint& constraint)
      : robot_(robot), constraint_(constraint) {}

  void run() const {
    if (constraint_.kind == Constraint::Kind::coupling)
      coupling();
    else
      closure();
    need_not_negative("stiffness", constraint_.stiffness);
    need_not_negative("damping", constraint_.damping);
    for (const double R : constraint_.compliance) need_not_negative("compliance", R);
    if (const std::optional<Impedance>& d = constraint_.impedance) {
      for (const double of : {d->least, d->most})
        if (!(of > 0 && of <= 1)) bad("an impedance of", of);
      need_not_negative("an impedance's width", d->width);
      if (!(d->midpoint > 0 && d->midpoint < 1)) bad("an impedance's midpoint", d->midpoint);
      if (!(d->power >= 1 && std::isfinite(d->power))) bad("an impedance's power", d->power);
    }
  }

 private:
  [[noreturn]] void bad(const std::string& what) const {
    refuse("constraint '" + constraint_.name + "': " + what);
  }
  [[noreturn]] void bad(const std::string& what, double value) const {
    bad(what + " " + short_text("%g", value));
  }
  void need_not_negative(const char* what, double x) const {
    if (!(x >= 0 && std::isfinite(x))) bad(what, x);
  }

  void closure() const {
    const auto& [first, second] = std::pair(constraint_.first, constraint_.second);
    for (const Frame& frame : {first, second})
      check_frame(("constraint '" + constraint_.name + "'").c_str(), frame, robot_.nv());
    if (first.link == second.link)
      bad(first.link < 0 ? "both frames are on the base"
                         : "both frames are on link " + std::to_string(first.link));
    if (!(constraint_.turning > 0 && std::isfinite(constraint_.turning)))
      bad("turning", constraint_.turning);
  }

  void coupling() const {
    const auto nv = static_cast<std::size_t>(robot_.nv());
    bool moves = false;
    for (const std::vector<double>* J : {&constraint_.jacobian, &constraint_.other}) {
      const bool may_be_left_out = J == &constraint_.other;
      if (J->size() != nv && !(may_be_left_out && J->empty()))
        bad("a jacobian of " + std::to_string(J->size()) + " numbers of a robot with " +
            std::to_string(nv));
      for (std::size_t k = 0; k < J->size(); ++k) {
        if (!std::isfinite((*J)[k])) bad("a jacobian of", (*J)[k]);
        if ((*J)[k] != 0 && !takes_spring(robot_.links[k]))
          bad("joint '" + robot_.names[k] + "' is no hinge or slide");
        moves = moves || (*J)[k] != 0;
      }
    }
    if (!moves) bad("it is of no joint");
    for (const double c : constraint_.polynomial)
      if (!std::isfinite(c)) bad("a coefficient of", c);
    if (!std::isfinite(constraint_.reference)) bad("reference", constraint_.reference);
  }

  const RobotModel& robot_;
  const Constraint& constraint_;
};

const std::vector<Constraint>& checked(const RobotModel& robot,
                                       const std::vector<Constraint>& constraints,
                                       const ConstrainedOptions& options) {
  if (constraints.empty()) refuse("no constraint");
  for (const Constraint& constraint : constraints) Check(robot, constraint).run();
  if (!(options.proximal >= 0 && std::isfinite(options.proximal)))
    refuse("proximal " + short_text("%g", options.proximal));
  if (options.iterations < 2) refuse(std::to_string(options.iterations) + " iterations");
  return constraints;
}

// What the engines have found of some rows of states.
template <class T>
struct Found {
  std::vector<T> positions, rotations, jacobians, velocities, accelerations, W, x0;
  std::vector<Outcome> of_x0, of_W;

  void resize(std::ptrdiff_t count, int nv, int frames) {
    positions.resize(count * 3 * frames);
    rotations.resize(count * 9 * frames);
    jacobians.resize(count * 6 * frames * nv);
    for (std::vector<T>* const moving : {&velocities, &accelerations})
      moving->resize(count * 6 * frames);
    W.resize(count * nv * nv);
    x0.resize(count * nv);
    of_x0.resize(count);
    of_W.resize(count);
  }
};

// (3), (4) and (7) of one state; memory of one worker.
class Projection {
 public:
  Projection(int nv, int m)
      : numbers(nv, m),
        X_(nv, m),
        A_(m, m),
        x_(nv),
        change_(nv),
        root_W_(nv),
        per_root_W_(nv),
        acting_(nv),
        size_(m),
        diagonal_(m),
        terms_(m),
        r_(m),
        delta_(m),
        lambda_(m) {}

  RowNumbers numbers;  // of the state

  // What (4) begins with: x0 and its relative error; a smaller |x| than `least` is nothing.
  template <class T>
  struct Start {
    const T* x0;
    double error, least;
  };

  // W and its relative error; x and lambda: the result, NaN on failure. joint: nv + row.
  template <class T>
  Outcome project(const ConstraintRows& rows, const ConstrainedOptions& options,
                  const Start<T>& start, const T* W, double error_of_W, T* x, T* lambda) {
    const auto nv = x_.size(), m = r_.size();
    Outcome out = solve(rows, options, start, Eigen::Map<const MatrixX<T>>(W, nv, nv), error_of_W);
    Eigen::Map<VectorX<T>> to_x(x, nv), to_lambda(lambda, m);
    to_x = x_.cast<T>();
    to_lambda = lambda_.cast<T>();
    if (out && !(to_x.allFinite() && to_lambda.allFinite()))
      out = {.status = Outcome::Status::not_finite};
    if (out) return out;
    to_x.setConstant(std::numeric_limits<T>::quiet_NaN());
    to_lambda.setConstant(std::numeric_limits<T>::quiet_NaN());
    return out;
  }

 private:
  using Row = Eigen::Index;

  template <class T>
  Outcome solve(const ConstraintRows& rows, const ConstrainedOptions& options,
                const Start<T>& start, const Eigen::Map<const MatrixX<T>>& W, double error_of_W) {
    const double u = double(unit_roundoff<T>()), rounding = rounding_constant * u;
    const Row m = r_.size();
    x_ = Eigen::Map<const VectorX<T>>(start.x0, x_.size()).template cast<double>();
    lambda_.setZero();
    root_W_ = W.diagonal().template cast<double>().cwiseSqrt();
    per_root_W_ = root_W_.cwiseInverse();
    size_.noalias() = numbers.reach.transpose() * root_W_;
    for (Row i = 0; i < m; ++i) {
      X_.col(i).setZero();
      for (const int j : rows.moved_by(i))
        X_.col(i) += numbers.Jt(j, i) * W.col(j).template cast<double>();
    }
    for (Row k = 0; k < m; ++k) {
      for (Row i = k; i < m; ++i) A_(i, k) = A_(k, i) = numbers.Jt.col(i).dot(X_.col(k));
      A_(k, k) += numbers.R[k];
    }
    for (Row k = 0, alike; k < m; k += alike) {
      alike = rows.alike(static_cast<int>(k));
      auto diagonal = A_.diagonal().segment(k, alike);
      diagonal.array() += options.proximal * diagonal.mean();
      diagonal_.segment(k, alike).setConstant(diagonal.mean());
      size_.segment(k, alike).setConstant(size_.segment(k, alike).maxCoeff());
    }
    const double size_of_x0 = norm(x_);
    if (!std::isfinite(size_of_x0 + A_.diagonal().sum() + numbers.target.sum()))
      return {.status = Outcome::Status::not_finite};
    Outcome out = invert(options.proximal > 0 ? 0 : roundings_of_D * u);
    if (!out) return out;

    double before = 0;
    for (int i = 0; i < options.iterations; ++i) {  // (4)
      r_ = numbers.target - numbers.R.cwiseProduct(lambda_);
      r_.noalias() -= numbers.Jt.transpose() * x_;
      delta_.noalias() = A_ * r_;
      lambda_ += delta_;
      change_.noalias() = X_ * delta_;
      x_ += change_;
      const double now = norm(change_), next = i == 0 ? now : now * (now / before);
      if (i > 0 && (next <= rounding * norm(x_) || now >= before)) break;
      before = now;
    }
    const double changed = norm(change_);
    change_ = x_.cwiseAbs();
    delta_ = lambda_.cwiseAbs();
    terms_ = numbers.spread + numbers.R.cwiseProduct(delta_);
    terms_.noalias() += numbers.reach.transpose() * change_;
    acting_.noalias() = numbers.reach * delta_;
    const double error = start.error * size_of_x0 +
                         std::fmax(error_of_W, rounding) * acting_.dot(root_W_) +
                         rounding * terms_.dot(A_.diagonal().cwiseSqrt()) + changed;
    Row most;
    const double missed =
        (terms_.array() > 0).select(r_.array().abs() / terms_.array(), 0).maxCoeff(&most);
    const double size = std::max({norm(x_), least_beside_gravity * size_of_x0, start.least});
    out.error = std::fmax(error > 0 ? error / size : 0, missed);  // (7)
    if (!(out.error < 1) || missed > largest_error_of_D) out.status = Outcome::Status::singular;
    if (!out || out.warns()) out.joint = static_cast<int>(x_.size() + most);
    return out;
  }

  double norm(const VectorX<double>& x) const {
    return x.cwiseProduct(per_root_W_).cwiseAbs().maxCoeff();
  }
  // A becomes A^-1: pivot after pivot D of it, the rows before are eliminated from the others. NaN does not pass.
  Outcome invert(double lost) {
    Outcome out{.D = 1, .scale = 1};
    for (Row k = 0; k < A_.rows(); ++k) {
      const double D = A_(k, k), scale = diagonal_[k];  // S of (3)
      if (k == 0 || D * out.scale < out.D * scale) out.D = D, out.scale = scale;
      if (!(D > lost * (size_[k] * size_[k] + numbers.R[k])))
        return {.status = Outcome::Status::singular,
                .joint = static_cast<int>(x_.size() + k),
                .D = D,
                .scale = scale};
      delta_ = A_.col(k);
      delta_[k] = -1;
      A_.col(k).setZero();
      A_.row(k).setZero();
      A_.noalias() -= delta_ / D * delta_.transpose();
    }
    A_ *= -1;
    return out;
  }

  MatrixX<double> X_, A_;
  VectorX<double> x_, change_, root_W_, per_root_W_, acting_, size_, diagonal_, terms_, r_, delta_,
      lambda_;
};

}  // namespace

template <class T>
struct ConstrainedDynamics<T>::Memory {
  std::vector<std::string> names;  // of the DoF, then of the constraints
  ConstrainedOptions options;
  ConstraintRows rows;
  Dynamics<T> dynamics;
  Kinematics<T> kinematics;
  int nq, nv, frames;
  double least;    // |a| that is nothing: a hundredth of gravity's, of the whole robot
  Found<T> found;  // of one state, and of rows
  std::vector<Projection> workers;
  Threads threads;

  Memory(const RobotModel& model, const std::vector<Constraint>& constraints,
         const ConstrainedOptions& how)
      : names(model.names),
        options(how),
        rows(model, constraints),
        dynamics(model, {.tolerance = how.tolerance,
                         .question = {.want = {Want::acceleration, Want::inverse},
                                      .acted_on = how.acted_on}}),
        kinematics(model, rows.frames()),
        nq(model.nq),
        nv(model.nv()),
        frames(static_cast<int>(rows.frames().size())),
        least(least_beside_gravity * standard_gravity * std::sqrt(kinematics.mass())) {
    for (const Constraint& constraint : constraints) names.push_back(constraint.name);
    reserve(1, 1);
  }

  void reserve(std::ptrdiff_t count, int threads_of_rows) {
    if (std::ssize(found.of_W) < count) found.resize(count, nv, frames);
    while (std::ssize(workers) < threads_of_rows) workers.emplace_back(nv, rows.count());
  }

  void find_frames(const T* q, const T* qd) {
    if (frames == 0) return;
    StateKinematics<T> out{.positions = {found.positions.data(), 3, frames},
                           .rotations = {found.rotations.data(), 3, 3 * frames},
                           .jacobians = {found.jacobians.data(), nv, 6 * frames}};
    if (!qd) return kinematics.compute({q, nq}, out);
    out.velocities = {found.velocities.data(), 6, frames};
    out.accelerations = {found.accelerations.data(), 6, frames};
    kinematics.compute({q, nq}, {qd, nv}, out);
  }

  void find_frames_of_rows(std::ptrdiff_t count, const T* q, const T* qd, int used) {
    if (frames == 0) return;
    const auto rows_of = [&](std::vector<T>& of, int width) {
      return RowsView<T>(of.data(), count, width);
    };
    RowsOfKinematics<T> out{.positions = rows_of(found.positions, 3 * frames),
                            .rotations = rows_of(found.rotations, 9 * frames),
                            .jacobians = rows_of(found.jacobians, 6 * frames * nv)};
    if (!qd) return kinematics.compute_rows({q, count, nq}, out, used);
    out.velocities = rows_of(found.velocities, 6 * frames);
    out.accelerations = rows_of(found.accelerations, 6 * frames);
    kinematics.compute_rows({q, count, nq}, {qd, count, nv}, out, used);
  }

  // e, J and what follows, of row i of what was found.
  void evaluate(Projection& worker, std::ptrdiff_t i, const T* q, const T* qd) const {
    FrameNumbers<T> at{found.positions.data() + i * 3 * frames,
                       found.rotations.data() + i * 9 * frames,
                       found.jacobians.data() + i * 6 * frames * nv};
    if (qd) {
      at.velocities = found.velocities.data() + i * 6 * frames;
      at.accelerations = found.accelerations.data() + i * 6 * frames;
    }
    rows.evaluate(at, q, qd, worker.numbers);
  }

  // Row i of what was found; qd: null but of accelerations. given: the tau, qd or b of the row.
  Outcome finish(What what, Projection& worker, std::ptrdiff_t i, const T* q, const T* qd,
                 const T* given, T* x, T* forces) {
    const T* const W = found.W.data() + i * nv * nv;
    T* const x0 = found.x0.data() + i * nv;
    Outcome of_x0 = what == What::accelerations ? found.of_x0[i] : Outcome{.error = 0};
    const Outcome& of_W = found.of_W[i];
    for (const Outcome& failed : {of_x0, of_W}) {
      if (failed) continue;
      std::fill_n(x, nv, std::numeric_limits<T>::quiet_NaN());
      std::fill_n(forces, rows.count(), std::numeric_limits<T>::quiet_NaN());
      return failed;
    }
    if (what == What::impulses) std::copy_n(given, nv, x0);
    if (what == What::solutions) {
      Eigen::Map<VectorX<T>>(x0, nv).noalias() =
          Eigen::Map<const MatrixX<T>>(W, nv, nv) * Eigen::Map<const VectorX<T>>(given, nv);
      of_x0.error = rounding_constant * double(unit_roundoff<T>());
    }
    evaluate(worker, i, q, qd);
    if (what != What::accelerations) {
      worker.numbers.target.setZero();
      worker.numbers.spread.setZero();
    }
    Outcome out =
        worker.project<T>(rows, options, {x0, of_x0.error, what == What::accelerations ? least : 0},
                          W, of_W.error, x, forces);
    if (out.joint >= nv) out.joint = nv + rows.constraint_of(out.joint - nv);
    out.near_singular = of_x0.near_singular || of_W.near_singular;
    out.rung = std::max(of_x0.rung, of_W.rung);
    return out;
  }
};

template <class T>
ConstrainedDynamics<T>::ConstrainedDynamics(const RobotModel& model,
                                            const std::vector<Constraint>& constraints,
                                            const ConstrainedOptions& options)
    : nq_(model.nq), nv_(model.nv()), m_(0) {
  for (const Constraint& constraint : checked(model, constraints, options)) m_ += constraint.rows();
  memory_ = std::make_unique<Memory>(model, constraints, options);
}
template <class T>
ConstrainedDynamics<T>::~ConstrainedDynamics() = default;
template <class T>
ConstrainedDynamics<T>::ConstrainedDynamics(ConstrainedDynamics&&) noexcept = default;
template <class T>
ConstrainedDynamics<T>& ConstrainedDynamics<T>::operator=(ConstrainedDynamics&&) noexcept = default;

template <class T>
typename ConstrainedDynamics<T>::Memory& ConstrainedDynamics<T>::memory() const {
  if (!memory_) throw std::logic_error("ConstrainedDynamics: was moved from, and answers nothing");
  return *memory_;
}

template <class T>
const std::string& ConstrainedDynamics<T>::name_of(const Outcome& outcome) const {
  static const std::string none;
  return outcome.joint < 0 ? none : memory().names.at(outcome.joint);
}

namespace {

void need(const char* name, std::ptrdiff_t given, std::ptrdiff_t needed) {
  if (given != needed)
    refuse(std::string(name) + " has size " + std::to_string(given) + ", " +
           std::to_string(needed) + " is needed");
}
template <class Rows>
void need(const char* name, const Rows& given, std::ptrdiff_t count, std::ptrdiff_t width) {
  if (!given.fits(count, width))
    refuse(std::string(name) + " has size " + given.shape() + ", " + detail::shape(count, width) +
           " is needed");
}
template <class T>
void need_columns(const char* name, const MatrixView<T>& given, int rows, int columns) {
  if (given && (!given.fits(rows, columns) || (columns > 1 && given.is_row_major())))
    refuse(std::string(name) + " has size " + given.shape() + ", " + detail::shape(rows, columns) +
           ", column-major, is needed");
}

}  // namespace

template <class T>
void ConstrainedDynamics<T>::evaluate(const VectorView<const T>& q, const VectorView<const T>* qd,
                                      const ConstraintState<T>& out) {
  Memory& all = memory();
  need("q", q.size(), nq_);
  if (qd) need("qd", qd->size(), nv_);
  if (out.rate && !qd) refuse("rate needs qd");
  need_columns("error", out.error, m_, 1);
  need_columns("rate", out.rate, m_, 1);
  need_columns("jacobian", out.jacobian, nv_, m_);
  Projection& worker = all.workers[0];
  const T* const velocity = qd ? qd->data() : nullptr;
  all.find_frames(q.data(), velocity);
  all.evaluate(worker, 0, q.data(), velocity);
  const auto write = [](const auto& from, const MatrixView<T>& to) {
    if (to) Eigen::Map<MatrixX<T>>(to.data(), from.rows(), from.cols()) = from.template cast<T>();
  };
  write(worker.numbers.e, out.error);
  write(worker.numbers.rate, out.rate);
  write(worker.numbers.Jt, out.jacobian);
}

template <class T>
Outcome ConstrainedDynamics<T>::of_state(const Asked& asked, const VectorView<const T>& q,
                                         const VectorView<const T>* qd,
                                         const VectorView<const T>& given, const VectorView<T>& x,
                                         const VectorView<T>& forces,
                                         const StateForces<T>& outside) {
  Memory& all = memory();
  need("q", q.size(), nq_);
  if (qd) need("qd", qd->size(), nv_);
  need(asked.name, given.size(), nv_);
  need("the result", x.size(), nv_);
  need("forces", forces.size(), m_);
  const T* const velocity = qd ? qd->data() : nullptr;
  Found<T>& found = all.found;
  if (qd)
    found.of_x0[0] = all.dynamics.forward_dynamics(q, *qd, given, {found.x0.data(), nv_}, outside);
  found.of_W[0] = all.dynamics.inverse_mass(q, {found.W.data(), nv_, nv_});
  all.find_frames(q.data(), velocity);
  return all.finish(asked.what, all.workers[0], 0, q.data(), velocity, given.data(), x.data(),
                    forces.data());
}

template <class T>
int ConstrainedDynamics<T>::of_rows(const Asked& asked, const RowsView<const T>& q,
                                    const RowsView<const T>* qd, const RowsView<const T>& given,
                                    const RowsView<T>& x, const RowsView<T>& forces,
                                    std::span<Outcome> outcomes, int threads,
                                    const ForceRows<T>& outside) {
  Memory& all = memory();
  const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
  need("q", q, count, nq_);
  if (qd) need("qd", *qd, count, nv_);
  need(asked.name, given, count, nv_);
  need("the result", x, count, nv_);
  need("forces", forces, count, m_);
  const int acting = 6 * static_cast<int>(all.options.acted_on.size());
  if (outside.on) need("outside", *outside.on, count, acting);
  threads = std::max(threads, 1);
  all.reserve(std::min<std::ptrdiff_t>(count, std::ptrdiff_t(rows_at_once) * threads), threads);
  Found<T>& found = all.found;
  const auto block = static_cast<std::ptrdiff_t>(found.of_W.size());
  int failed = 0;
  for (std::ptrdiff_t first = 0; first < count; first += block) {
    const std::ptrdiff_t some = std::min(block, count - first);
    const auto rows_of = [&](const RowsView<const T>& of, int width) {
      return RowsView<const T>(of.data() + first * width, some, width);
    };
    const auto of = [&](std::vector<Outcome>& list) {
      return std::span<Outcome>(list.data(), some);
    };
    const RowsView<const T> at = rows_of(q, nq_);
    ForceRows<T> act{.axes = outside.axes};
    if (outside.on) act.on.emplace(rows_of(*outside.on, acting));
    if (qd)
      (void)all.dynamics.forward_dynamics(at, rows_of(*qd, nv_), rows_of(given, nv_),
                                          {found.x0.data(), some, nv_}, of(found.of_x0), threads,
                                          act);
    (void)all.dynamics.inverse_mass(at, {found.W.data(), some, nv_ * nv_}, of(found.of_W), threads);
    all.find_frames_of_rows(some, at.data(), qd ? qd->data() + first * nv_ : nullptr, threads);
    const auto one = [&](int worker, int i) {
      const std::ptrdiff_t row = first + i;
      outcomes[row] = all.finish(asked.what, all.workers[worker], i, q.data() + row * nq_,
                                 qd ? qd->data() + row * nv_ : nullptr, given.data() + row * nv_,
                                 x.data() + row * nv_, forces.data() + row * m_);
    };
    if (threads == 1)
      for (int i = 0; i < some; ++i) one(0, i);
    else
      all.threads.run(threads, static_cast<int>(some), one);
    for (std::ptrdiff_t i = first; i < first + some; ++i) failed += !outcomes[i];
  }
  return failed;
}

template class ConstrainedDynamics<float>;
template class ConstrainedDynamics<double>;

}  // namespace kalmarm
