// A robot's dynamics on NumPy arrays: the calls of kalmarm::Dynamics, each of one state or of as
// many as leading dimensions say.
//
// One state: an outcome that is not ok is raised, one that warns is a RuntimeWarning. Many: failed
// rows are NaN. With `status` nothing is raised, and the outcomes are returned beside the result.
//
// Python's global lock is released for many states and for large robots. One state of a small one
// keeps it: its call takes a few microseconds at most, and whoever gives up the lock may wait for
// it 5 ms while another thread computes in Python.
#pragma once

#include <kalmarm/dynamics.hpp>
#include <kalmarm/gradients.hpp>
#include <kalmarm/operational_space.hpp>
#include <kalmarm/plan_summary.hpp>
#include <kalmarm/recommend.hpp>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "arrays.hpp"
#include "workers.hpp"

namespace kalmarm::python {

struct Result;  // gradients.hpp
class Factors;

class Robot {
 public:
  // By generated code in the precisions that are compiled.
  Robot(RobotModel model, DynamicsOptions options, bool compiled_float, bool compiled_double);

  const RobotModel& model() const { return model_; }
  const DynamicsOptions& options() const { return options_; }
  int asked() const { return asked_; }
  PlanSummary plan();
  std::vector<std::string> compiled();  // Dynamics::notes of both precisions

  // forces: None, or six numbers of every frame that is acted on, in `axes`; contacts, likewise, rows of them; loads:
  // None, or ten numbers of every frame that is loaded.
  nb::object forward_dynamics(nb::handle q, nb::handle qd, nb::handle tau, nb::handle out,
                              bool status, int threads, nb::handle forces, const std::string& axes,
                              nb::handle loads, nb::handle gravity);
  nb::object inverse_dynamics(nb::handle q, nb::handle qd, nb::handle qdd, nb::handle out,
                              bool status, int threads, nb::handle forces, const std::string& axes,
                              nb::handle loads, nb::handle gravity);
  nb::object bias(nb::handle q, nb::handle qd, nb::handle out, bool status, int threads,
                  nb::handle forces, const std::string& axes, nb::handle loads, nb::handle gravity);
  nb::object gravity(nb::handle q, nb::handle out, bool status, int threads, nb::handle loads,
                     nb::handle gravity);
  nb::object mass_matrix(nb::handle q, nb::handle out, bool status, int threads, nb::handle loads);
  nb::object inverse_mass_matrix(nb::handle q, nb::handle out, bool status, int threads,
                                 nb::handle contacts, const std::string& axes, nb::handle loads);
  nb::object diagonal(nb::handle q, nb::handle out, bool status, int threads, nb::handle contacts,
                      const std::string& axes, nb::handle loads);
  nb::object log_det(nb::handle q, nb::handle out, bool status, int threads, nb::handle contacts,
                     const std::string& axes, nb::handle loads);
  nb::object operational(nb::handle q, nb::handle out, bool status, int threads,
                         nb::handle contacts, const std::string& axes, nb::handle loads);
  nb::object operational_diagonal(nb::handle q, nb::handle out, bool status, int threads,
                                  nb::handle contacts, const std::string& axes, nb::handle loads);
  // (Lambda, J^, N, outcomes or None) of J, k x n by rows.
  nb::object operational_space(nb::handle q, nb::handle J, int k, int alike,
                               const Regularisation& how, bool status, int threads);
  nb::object operational_inertia(nb::handle q, nb::handle out, const Regularisation& how,
                                 bool status, int threads);
  nb::object solve(nb::handle q, nb::handle tau, nb::handle out, bool status, int threads,
                   nb::handle contacts, const std::string& axes, nb::handle loads);
  nb::object derivatives(nb::handle q, nb::handle qd, nb::handle tau, nb::handle out, bool status,
                         int threads, nb::handle forces, const std::string& axes, nb::handle loads,
                         nb::handle gravity);
  // The products of Gradients with w: of forward dynamics (x: tau), inverse dynamics (x: qdd) or, without qd, of solve. A
  // kalmarm.Gradients.
  nb::object vector_jacobian(Want of, nb::handle q, nb::handle qd, nb::handle x, nb::handle w,
                             bool inertias, bool armature, bool status, int threads,
                             nb::handle forces, nb::handle loads, nb::handle gravity);
  // Of tr(W'J M^-1 J'), W k x k.
  nb::object operational_vjp(nb::handle q, nb::handle W, bool inertias, bool armature, bool status,
                             int threads, nb::handle loads);
  // Its changes along dq, dqd and dx.
  nb::object jacobian_vector(Want of, nb::handle q, nb::handle qd, nb::handle x, nb::handle dq,
                             nb::handle dqd, nb::handle dx, bool status, int threads,
                             nb::handle forces, nb::handle loads, nb::handle gravity);
  std::unique_ptr<Factors> factor(nb::handle q, nb::handle contacts, const std::string& axes,
                                  nb::handle loads);
  Recommendation recommend(double tolerance, nb::handle q, nb::handle qd, nb::handle tau) const;

  // Seconds of `calls` calls of forward_dynamics in C++, of all rows or, `singly`, of one row after
  // another: what python/benchmarks compares calls from Python with.
  double time_forward_dynamics(nb::handle q, nb::handle qd, nb::handle tau, nb::handle out,
                               int calls, bool singly, int threads);

 private:
  friend class Factors;
  friend class RobotRows;  // of JAX

  void need(const char* call, Want want) const;
  // one(dynamics, result) -> Outcome of one state, or of many all(dynamics, result, outcomes, threads)
  // -> how many failed; each has `width` numbers. names: of what outcomes call joints, unless the DoF.
  template <class One, class All>
  nb::object rows(const Inputs& inputs, int threads, bool status, const nb::object& result,
                  npy_intp width, const One& one, const All& all,
                  const std::vector<std::string>* names = nullptr);
  // value, that is made of these results: call(gradients, outcomes, threads) fills them.
  template <class Call>
  nb::object products(Inputs& in, std::span<const Result> results, const nb::object& value,
                      bool status, int threads, const Call& call);
  // What (J M^-1 J')^-1 is told beside `given`, that of what is inverted. Rows of J are numbered after the DoF.
  Outcome of_inertia(Outcome outcome, const Outcome& given) const;
  // tau of rows or of one state; qd, qdd: inputs, -1: zero.
  template <class Given>
  nb::object newton_euler(const char* call, const Given& given, nb::handle out, bool status,
                          int threads, int qd, int qdd);

  RobotModel model_;
  DynamicsOptions options_;
  bool compiled_float_, compiled_double_;
  WorkersOfBoth<Dynamics> workers_{[this]<class T>() {
    DynamicsOptions options = options_;
    if (std::is_same_v<T, float> ? compiled_float_ : compiled_double_)
      options.kernels = Kernels::generated;
    return Dynamics<T>(model_, options);
  }};
  WorkersOfBoth<Gradients> gradients_{[this]<class T>() { return Gradients<T>(model_, options_); }};
  int asked_ = 0, rows_ = 0, forces_ = 0, contacts_ = 0, loads_ = 0;
  std::vector<std::string> names_with_rows_;  // of the DoF, then of the rows of J M^-1 J'
};

// Factors of M in one state. They keep a worker of their robot's, and one thread at a time solves.
class Factors {
 public:
  // names: of the robot's DoF, kept by reference.
  template <class Loan>
  Factors(Loan worker, int asked, const std::vector<std::string>& names)
      : worker_(std::move(worker)), asked_(asked), names_(names) {}

  nb::object solve(nb::handle tau, nb::handle out);
  int asked() const { return asked_; }

 private:
  std::variant<Workers<float>::Loan, Workers<double>::Loan> worker_;
  int asked_;
  const std::vector<std::string>& names_;
  std::mutex mutex_;
};

// The arrays of a kalmarm.Derivatives: new ones, or those of `out`, what an earlier call returned.
struct DerivativeArrays {
  DerivativeArrays(Inputs& inputs, nb::handle out, npy_intp n);

  nb::object tuple() const;

  nb::object fields[4];  // their matrices with columns one after another
};

// How many threads `threads` are for so many states; 0: as many as there are cores, which is the most.
int cores(const char* call, int threads, int states);

constexpr int large = 64;  // DoF from which a call of one state releases the lock

}  // namespace kalmarm::python
