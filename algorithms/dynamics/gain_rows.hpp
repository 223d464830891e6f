// Gains of rows of states: every row is a step with damping b and stiffness k of its own, by (1) to
// (3) of kalmarm/implicit_step.hpp, in one sweep.
//
//   r(i,k) = armature(i,k) + h b(i,k) + h h' k(i,k)        of row i, h' = h, or 0: springs at the start
// is joint noise of a lane (fast/covariance/forward_dynamics.hpp): it changes D and P+ alone. What
// does not depend on its value, but on whether there is any, is settled when the sweep's model is
// lowered: HP+ = r g' is no row of zeros, and DoF of ball and free joints are crossed one by one. So
// the model has the robot's own armature, unless a row has less, or has noise where the robot has none: then
// one that vanishes beside any inertia. The model is made again when a DoF changes from one to the other.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "algorithms/dynamics/execution.hpp"
#include "algorithms/fast/claims/arithmetic.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/model/short_text.hpp"
#include "algorithms/spatial/spatial.hpp"
#include "kalmarm/implicit_step.hpp"

namespace kalmarm {

template <class T>
class GainsOfRows {
 public:
  // robot: with its own armature; b and k: the step's own damping and stiffness (nv).
  GainsOfRows(const RobotModel& robot, double h, double h_of_springs, const T* b, const T* k,
              const DynamicsOptions& options)
      : robot_(robot),
        of_damping_(static_cast<T>(h)),
        of_stiffness_(static_cast<T>(h * h_of_springs)),
        tolerance_(options.tolerance.value_or(default_tolerance<T>)),
        question_{.want = {Want::acceleration},
                  .acted_on = options.question.acted_on,
                  .loaded = options.question.loaded},
        rules_(rules_for(tolerance_)) {
    std::erase_if(rules_, [&](Rule rule) {
      // Its kernel has no joint noise of a lane.
      return rule == Rule::translations || !options.rules.contains(rule);
    });
    for (int dof = 0; dof < robot.nv(); ++dof) {
      if (!takes_spring(robot.links[dof])) springless_.push_back(dof);
    }
    for (int row = 0; row < repeated; ++row)
      for (int dof = 0; dof < robot.nv(); ++dof) {
        armature_.push_back(static_cast<T>(robot.links[dof].armature));
        own_damping_.push_back(of_damping_ * b[dof]);
        own_stiffness_.push_back(of_stiffness_ * k[dof]);
      }
  }

  // Throws std::invalid_argument where one of rows x nv numbers is not finite, or below zero where
  // `positive`, or a stiffness of what has no spring.
  void check(const char* what, const T* x, std::ptrdiff_t rows, bool positive) const {
    const std::ptrdiff_t nv = robot_.nv();
    const Eigen::Map<const Eigen::Array<T, Eigen::Dynamic, 1>> all(x, rows * nv);
    if (all.size() == 0) return;
    const bool finite = (all * T(0)).sum() == T(0);
    if (finite && (!positive || all.minCoeff() >= T(0))) return;
    for (std::ptrdiff_t i = 0; i < all.size(); ++i)
      if (!(all[i] * T(0) == T(0)) || (positive && all[i] < T(0)))
        refuse(what, i / nv, i % nv, all[i]);
  }
  void check_springs(const T* stiffness, std::ptrdiff_t rows) const {
    const std::ptrdiff_t nv = robot_.nv();
    for (const int k : springless_)
      for (std::ptrdiff_t i = 0; i < rows; ++i)
        if (const T x = stiffness[i * nv + k]; x != T(0))
          refuse("a spring about a ball or a free joint: stiffness", i, k, x);
  }

  // The call, of rows at the torques tau^, with r of `gains`, and where they have none the step's own. How many
  // failed.
  int acceleration(std::ptrdiff_t rows, Call<T> call, const GainRows<T>& gains, Outcome* outcomes,
                   int threads) {
    set_noise(rows, gains.armature.data(), gains.damping.data(), gains.stiffness.data());
    call.r = r_.data();
    return execution_->answer_rows(static_cast<int>(rows), call, outcomes, std::max(threads, 1));
  }

 private:
  void set_noise(std::ptrdiff_t rows, const T* armature, const T* damping, const T* stiffness) {
    using Numbers = Eigen::Array<T, Eigen::Dynamic, 1>;
    const std::ptrdiff_t nv = robot_.nv();
    if (static_cast<std::ptrdiff_t>(r_.size()) < rows * nv) r_.resize(rows * nv);
    for (std::ptrdiff_t first = 0; first < rows; first += repeated) {
      const std::ptrdiff_t n = std::min(repeated, rows - first) * nv, at = first * nv;
      const auto numbers = [n](const T* x) { return Eigen::Map<const Numbers>(x, n); };
      Eigen::Map<Numbers> r(r_.data() + at, n);
      r = numbers(armature ? armature + at : armature_.data());
      if (damping)
        r += of_damping_ * numbers(damping + at);
      else
        r += numbers(own_damping_.data());
      if (stiffness)
        r += of_stiffness_ * numbers(stiffness + at);
      else
        r += numbers(own_stiffness_.data());
    }
    make_execution(rows, armature != nullptr);
  }

  [[noreturn]] void refuse(const char* what, std::ptrdiff_t row, std::ptrdiff_t dof, T x) const {
    throw std::invalid_argument("implicit step: row " + std::to_string(row) + ", DoF '" +
                                robot_.names[dof] + "': " + what + " " +
                                short_text("%g", static_cast<double>(x)));
  }

  void make_execution(std::ptrdiff_t rows, bool of_rows) {
    const std::ptrdiff_t nv = robot_.nv();
    const auto has_some = [&](int k) {
      for (std::ptrdiff_t i = 0; i < rows; ++i)
        if (r_[i * nv + k] > T(0)) return true;
      return false;
    };
    const auto has_less = [&](int k) {
      for (std::ptrdiff_t i = 0; i < rows; ++i)
        if (r_[i * nv + k] < static_cast<T>(robot_.links[k].armature)) return true;
      return false;
    };
    bool changed = !execution_;
    for (int k = 0; k < robot_.nv(); ++k) {
      double& own = robot_.links[k].armature;
      if (own > 0 ? !of_rows || own == 1 / no_body || !has_less(k) : !has_some(k)) continue;
      own = 1 / no_body;
      changed = true;
    }
    if (!changed) return;
    execution_ =
        std::make_unique<Execution<T>>(make_plan(model_of(robot_), question_, rules_), robot_.nq,
                                       tolerance_, Triangles::both, make_engine<T>);
  }

  static constexpr std::ptrdiff_t repeated = 32;  // rows of own numbers, side by side

  RobotModel robot_;
  T of_damping_, of_stiffness_;
  double tolerance_;
  Question question_;
  std::set<Rule> rules_;
  std::vector<T> armature_, own_damping_, own_stiffness_, r_;
  std::vector<int> springless_;  // DoF
  std::unique_ptr<Execution<T>> execution_;
};

}  // namespace kalmarm
