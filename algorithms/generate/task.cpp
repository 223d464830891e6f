// What is inlined is of no matter here: a kernel runs once.
#define KALMARM_CALLS
#include "algorithms/generate/task.hpp"

#include "algorithms/fast/engine/acceptance.hpp"
#include "algorithms/fast/factors/solve.hpp"
#include "algorithms/fast/rigid/inverse_dynamics.hpp"
#include "algorithms/fast/rigid/mass.hpp"
#include "algorithms/generate/record_arguments.hpp"
#include "algorithms/model/plain.hpp"

namespace kalmarm {
namespace {

using Numbers = std::vector<Recorded>;

template <class S>
class Recorder {
 public:
  Recorder(GeneratedTask task, const Model<double>& model, double tolerance)
      : recording_(out_.graph),
        tolerance_(tolerance),
        model_(model, Zeros::left_out, accepted_error(tolerance)),
        robot_(plain(model)) {
    out_.task = task;
  }

  TaskRecord run() {
    switch (out_.task) {
      case GeneratedTask::forward_dynamics:
        forward_dynamics(false);
        break;
      case GeneratedTask::judged_forward_dynamics:
        forward_dynamics(true);
        break;
      case GeneratedTask::inverse_dynamics:
        inverse_dynamics();
        break;
      case GeneratedTask::mass:
        mass();
        break;
      case GeneratedTask::inverse_mass:
        inverse_mass(false);
        break;
      case GeneratedTask::judged_inverse_mass:
        inverse_mass(true);
        break;
      case GeneratedTask::diagonal:
        diagonal(false);
        break;
      case GeneratedTask::judged_diagonal:
        diagonal(true);
        break;
      case GeneratedTask::solve:
        solve(false);
        break;
      case GeneratedTask::judged_solve:
        solve(true);
        break;
    }
    return std::move(out_);
  }

 private:
  int nv() const { return model_.nv(); }

  Numbers input(const std::string& name, int size) { return add_input(out_, name, size); }
  void output(const std::string& name, const Numbers& x) { add_output(out_, name, x); }

  void forward_dynamics(bool judged) {
    const Numbers q = input("q", model_.nq()), qd = input("qd", nv()), tau = input("tau", nv());
    CovarianceWorkspace<Recorded> ws(model_);
    Numbers a(nv());
    covariance_acceleration(model_, q.data(), qd.data(), tau.data(), ws, a.data());
    output("a", a);
    if (judged) output(acceptance().judge(CovarianceForm::sums(ws)), ws.margin);
  }

  void inverse_dynamics() {
    const Numbers q = input("q", model_.nq()), qd = input("qd", nv()), qdd = input("qdd", nv());
    InverseDynamicsWorkspace<Recorded> ws(model_);
    Numbers tau(nv());
    fast_inverse_dynamics(model_, q.data(), qd.data(), qdd.data(), ws, tau.data());
    output("tau", tau);
  }

  // Column by column up to its diagonal; the upper triangle is the lower one.
  void mass() {
    const Numbers q = input("q", model_.nq());
    CompositeForces<Recorded> composite(model_);
    ColumnsWorkspace<Recorded> ws(model_);
    const ColumnPaths paths(model_, nv(), 1);
    composite_forces(model_, q.data(), composite);
    Numbers M(square());
    for (int j = 0; j < nv(); ++j) {
      detail::sweep_composite_forces(
          model_, composite, j, j, paths[j], [](int) { return Recorded(1); }, ws);
      for (int k = 0; k <= j; ++k) set(M, k, j, ws.e[k]);
    }
    output("M", M);
  }

  void inverse_mass(bool judged) {
    const Numbers q = input("q", model_.nq());
    FastFactors<Recorded> factors(model_);
    ColumnsWorkspace<Recorded> ws(model_);
    const ColumnPaths paths(model_, nv(), 1);
    covariance_factor(model_, q.data(), factors);
    Numbers X(square());
    for (int j = 0; j < nv(); ++j) {
      detail::sweep_inward(
          model_, factors, j, paths[j], [j](int k) { return Recorded(k == j); }, ws);
      detail::sweep_outward(model_, factors, j, ws,
                            [&](int k, const Recorded& x) { set(X, k, j, x); });
    }
    output("X", X);
    if (judged) judge_columns(factors, [&](int k) { return X[k * nv() + k]; });
  }

  // e of a unit torque, and so one sweep a column.
  struct Diagonal : detail::Unobserved {
    const FastFactors<Recorded>& factors;
    Recorded& x;

    Diagonal(const FastFactors<Recorded>& of, Recorded& sum) : factors(of), x(sum) {}
    void measured(int k, const Recorded& e) const { x += e * e * factors.links[k].inverse_D; }
  };

  void diagonal(bool judged) {
    const Numbers q = input("q", model_.nq());
    FastFactors<Recorded> factors(model_);
    ColumnsWorkspace<Recorded> ws(model_);
    const ColumnPaths paths(model_, nv(), 1);
    covariance_factor(model_, q.data(), factors);
    Numbers x(nv());
    for (int j = 0; j < nv(); ++j)
      detail::sweep_inward(
          model_, factors, j, paths[j], [j](int k) { return Recorded(k == j); }, ws,
          Diagonal(factors, x[j]));
    output("x", x);
    if (judged) judge_columns(factors, [&](int k) { return x[k]; });
  }

  void solve(bool judged) {
    const Numbers q = input("q", model_.nq()), tau = input("tau", nv());
    FastFactors<Recorded> factors(model_);
    ColumnsWorkspace<Recorded> ws(model_);
    auto forces = detail::forces_of<Recorded>(model_);
    const std::vector<char> all(nv(), 1);
    covariance_factor(model_, q.data(), factors);
    Numbers x(nv());
    const SolveSums<Recorded> sums = detail::solve(
        model_, factors, all.data(), [&](int k) { return tau[k]; }, ws, forces,
        [&](int k, const Recorded& xk) { x[k] = xk; });
    output("x", x);
    if (judged) output(acceptance().judge(sums), factors.margin);
  }

  // (11) of force_noise.hpp: by a constant of the robot, or where that says nothing by the state.
  template <class Of>
  void judge_columns(const FastFactors<Recorded>& factors, const Of& diagonal) {
    const Acceptance<S> by = acceptance();
    Recorded energy = by.terms_of_columns();
    if (by.accepts_terms_of_columns())
      for (int k = 0; k < nv(); ++k) energy += diagonal(k) / factors.links[k].inverse_D;
    else
      energy = ForceNoise<Recorded>(model_).energy_of_columns(model_, factors, diagonal);
    output(by.judge_columns(energy), factors.margin);
  }

  Acceptance<S> acceptance() const { return {robot_, model_, tolerance_}; }
  void output(const Judged<Recorded>& judgement, const Recorded& margin_of_D) {
    output("error", Numbers{judgement.error});
    output("margin", Numbers{min(margin_of_D, judgement.margin)});
  }

  std::size_t square() const { return static_cast<std::size_t>(nv()) * nv(); }
  void set(Numbers& X, int k, int j, const Recorded& x) const {
    X[k * nv() + j] = X[j * nv() + k] = x;
  }

  TaskRecord out_;
  Recording recording_;
  double tolerance_;
  LoweredModel<S> model_;
  RobotModel robot_;
};

}  // namespace

std::string to_string(GeneratedTask task) {
  switch (task) {
    case GeneratedTask::forward_dynamics:
      return "forward_dynamics";
    case GeneratedTask::judged_forward_dynamics:
      return "judged_forward_dynamics";
    case GeneratedTask::inverse_dynamics:
      return "inverse_dynamics";
    case GeneratedTask::mass:
      return "mass";
    case GeneratedTask::inverse_mass:
      return "inverse_mass";
    case GeneratedTask::judged_inverse_mass:
      return "judged_inverse_mass";
    case GeneratedTask::diagonal:
      return "diagonal";
    case GeneratedTask::judged_diagonal:
      return "judged_diagonal";
    case GeneratedTask::solve:
      return "solve";
    case GeneratedTask::judged_solve:
      return "judged_solve";
  }
  return {};
}

template <class S>
TaskRecord record(GeneratedTask task, const Model<double>& model, double tolerance) {
  return Recorder<S>(task, model, tolerance).run();
}

template TaskRecord record<float>(GeneratedTask, const Model<double>&, double);
template TaskRecord record<double>(GeneratedTask, const Model<double>&, double);

}  // namespace kalmarm
