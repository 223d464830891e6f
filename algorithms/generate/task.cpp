// What is inlined is of no matter here: a kernel runs once.
#define KALMARM_CALLS
#include "algorithms/generate/task.hpp"

#include <numeric>

#include "algorithms/fast/derivatives/derivatives.hpp"
#include "algorithms/fast/engine/acceptance.hpp"
#include "algorithms/fast/factors/selected.hpp"
#include "algorithms/fast/factors/solve.hpp"
#include "algorithms/fast/rigid/inverse_dynamics.hpp"
#include "algorithms/fast/rigid/mass.hpp"
#include "algorithms/generate/record_arguments.hpp"
#include "algorithms/model/plain.hpp"

namespace kalmarm {
namespace {

using Numbers = std::vector<Recorded>;

// Whether a step may have springs and dampers at a DoF.
bool takes_gains(const Joint<double>& joint) {
  return joint.coordinate == Coordinate::angle || joint.coordinate == Coordinate::distance;
}

// Where a step may have joint noise and the robot has none, one that vanishes beside any inertia: kernels look at
// whether there is any (dynamics/gain_rows.hpp).
Model<double> with_noise(Model<double> model) {
  for (int k = 0; k < model.nv(); ++k)
    if (takes_gains(model.joint(k)) && !(model.joint(k).r > 0)) model.set_noise(k, 1 / no_body);
  return model;
}

bool is_step(GeneratedTask task) {
  return task == GeneratedTask::implicit_step || task == GeneratedTask::judged_implicit_step;
}

template <class S>
class Recorder {
 public:
  Recorder(GeneratedTask task, const Model<double>& model, const Question& question,
           double tolerance, Gravity gravity)
      : recording_(out_.graph),
        tolerance_(tolerance),
        gravity_(gravity),
        given_(model),
        question_(question),
        model_(is_step(task) ? with_noise(model) : model, Zeros::left_out,
               accepted_error(tolerance), CallFrames{{}, {}, question.loaded}),
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
      case GeneratedTask::operational:
        operational();
        break;
      case GeneratedTask::derivatives:
        derivatives(false);
        break;
      case GeneratedTask::judged_derivatives:
        derivatives(true);
        break;
      case GeneratedTask::implicit_step:
        implicit_step(false);
        break;
      case GeneratedTask::judged_implicit_step:
        implicit_step(true);
        break;
    }
    return std::move(out_);
  }

 private:
  int nv() const { return model_.nv(); }

  Numbers input(const std::string& name, int size) { return add_input(out_, name, size); }
  void output(const std::string& name, const Numbers& x) { add_output(out_, name, x); }
  Numbers input_qd() { return question_.at_rest ? Numbers(nv()) : input("qd", nv()); }
  Acting<Recorded> input_acting() {
    if (question_.loaded.empty()) return {};
    loads_ = input("loads", static_cast<int>(numbers_of_load * question_.loaded.size()));
    return {.loads = loads_.data()};
  }
  // Of tasks that weight enters.
  Acting<Recorded> input_acting_and_gravity() {
    Acting<Recorded> out = input_acting();
    if (gravity_ == Gravity::constant) return out;
    gravity_given_ = input("gravity", 3);
    out.gravity = gravity_given_.data();
    return out;
  }

  void output(const Judged<Recorded>& judgement, const Recorded& margin_of_D) {
    output("error", Numbers{judgement.error});
    output("margin", Numbers{min(margin_of_D, judgement.margin)});
  }

  // Of what is asked: DoF, and rows and columns of a matrix, x(i, j).
  std::vector<int> asked() const {
    if (!question_.dofs.empty()) return question_.dofs;
    std::vector<int> all(nv());
    std::iota(all.begin(), all.end(), 0);
    return all;
  }
  Numbers of_asked(const Numbers& x) const {
    Numbers out;
    for (const int k : asked()) out.push_back(x[k]);
    return out;
  }
  template <class Matrix>
  Numbers block(const Matrix& x) const {
    Numbers out;
    for (const int i : asked())
      for (const int j : asked()) out.push_back(x(i, j));
    return out;
  }

  void forward_dynamics(bool judged) {
    const Numbers q = input("q", model_.nq()), qd = input_qd(), tau = input("tau", nv());
    const Acting<Recorded> acting = input_acting_and_gravity();
    CovarianceWorkspace<Recorded> ws(model_);
    Numbers a(nv());
    covariance_acceleration(model_, q.data(), qd.data(), tau.data(), ws, a.data(), acting);
    output("a", of_asked(a));
    if (judged) output(acceptance().judge(CovarianceForm::sums(ws)), ws.margin);
  }

  void inverse_dynamics() {
    const Numbers q = input("q", model_.nq()), qd = input_qd(), qdd = input("qdd", nv());
    const Acting<Recorded> acting = input_acting_and_gravity();
    InverseDynamicsWorkspace<Recorded> ws(model_);
    Numbers tau(nv());
    fast_inverse_dynamics(model_, q.data(), qd.data(), qdd.data(), ws, tau.data(), acting);
    output("tau", of_asked(tau));
  }

  // A symmetric matrix, column by column up to its diagonal; the upper triangle is the lower one.
  class Symmetric {
   public:
    explicit Symmetric(int n) : n_(n), x_(static_cast<std::size_t>(n) * n) {}
    void set(int k, int j, const Recorded& x) { x_[k * n_ + j] = x_[j * n_ + k] = x; }
    const Recorded& operator()(int k, int j) const { return x_[k * n_ + j]; }

   private:
    int n_;
    Numbers x_;
  };

  void mass() {
    const Numbers q = input("q", model_.nq());
    const Acting<Recorded> acting = input_acting();
    CompositeForces<Recorded> composite(model_);
    ColumnsWorkspace<Recorded> ws(model_);
    const ColumnPaths paths(model_, nv(), 1);
    composite_forces(model_, q.data(), composite, acting);
    Symmetric M(nv());
    for (int j = 0; j < nv(); ++j) {
      detail::sweep_composite_forces(
          model_, composite, j, j, paths[j], [](int) { return Recorded(1); }, ws);
      for (int k = 0; k <= j; ++k) M.set(k, j, ws.e[k]);
    }
    output("M", block(M));
  }

  FastFactors<Recorded> factors(const Numbers& q) {
    FastFactors<Recorded> out(model_);
    covariance_factor(model_, q.data(), out, input_acting());
    return out;
  }

  void inverse_mass(bool judged) {
    const Numbers q = input("q", model_.nq());
    const FastFactors<Recorded> factors = this->factors(q);
    ColumnsWorkspace<Recorded> ws(model_);
    const ColumnPaths paths(model_, nv(), 1);
    Symmetric X(nv());
    for (int j = 0; j < nv(); ++j) {
      detail::sweep_inward(
          model_, factors, j, paths[j], [j](int k) { return Recorded(k == j); }, ws);
      detail::sweep_outward(model_, factors, j, ws,
                            [&](int k, const Recorded& x) { X.set(k, j, x); });
    }
    output("X", block(X));
    if (judged) judge_columns(factors, [&](int k) { return X(k, k); });
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
    const FastFactors<Recorded> factors = this->factors(q);
    ColumnsWorkspace<Recorded> ws(model_);
    const ColumnPaths paths(model_, nv(), 1);
    Numbers x(nv());
    for (int j = 0; j < nv(); ++j)
      detail::sweep_inward(
          model_, factors, j, paths[j], [j](int k) { return Recorded(k == j); }, ws,
          Diagonal(factors, x[j]));
    output("x", of_asked(x));
    if (judged) judge_columns(factors, [&](int k) { return x[k]; });
  }

  void solve(bool judged) {
    const Numbers q = input("q", model_.nq()), tau = input("tau", nv());
    const FastFactors<Recorded> factors = this->factors(q);
    ColumnsWorkspace<Recorded> ws(model_);
    auto forces = detail::forces_of<Recorded>(model_);
    const std::vector<char> all(nv(), 1);
    Numbers x(nv());
    const SolveSums<Recorded> sums = detail::solve(
        model_, factors, all.data(), [&](int k) { return tau[k]; }, ws, forces,
        [&](int k, const Recorded& xk) { x[k] = xk; });
    output("x", of_asked(x));
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

  void operational() {
    const Selection selection{{}, question_.frames};
    const Numbers q = input("q", model_.nq());
    const FastFactors<Recorded> factors = this->factors(q);
    SelectedColumns<Recorded, S> columns;
    columns.select(model_, selection);
    Numbers X(static_cast<std::size_t>(selection.size()) * selection.size());
    columns.answer(Want::operational, model_, factors, X.data());
    output("X", X);
  }

  void derivatives(bool judged) {
    const Numbers q = input("q", model_.nq()), qd = input_qd(), tau = input("tau", nv());
    const Acting<Recorded> acting = input_acting_and_gravity();
    DerivativeWorkspace<Recorded> ws(model_);
    const std::size_t square = static_cast<std::size_t>(nv()) * nv();
    Numbers a(nv()), dq(square), dqd(square), dtau(square);
    fast_derivatives(model_, q.data(), qd.data(), tau.data(), ws, dq.data(), dqd.data(),
                     dtau.data(), a.data(), acting);
    output("a", of_asked(a));
    for (const auto& [name, columns] :
         {std::pair{"da_dq", &dq}, std::pair{"da_dqd", &dqd}, std::pair{"da_dtau", &dtau}})
      output(name, block([&, x = columns](int j, int i) { return (*x)[j * nv() + i]; }));
    if (judged) output("margin", Numbers{margin_of_derivatives(q, a, acting)});
  }

  // Of D where one may be lost, and none where an acceleration is not finite, as rows of the loops have it
  // (fast/derivatives/derivatives_of_rows.hpp).
  Recorded margin_of_derivatives(const Numbers& q, const Numbers& a,
                                 const Acting<Recorded>& acting) {
    Recorded squares(0);
    for (const Recorded& one : a) squares += one * one;
    const Recorded finite = Recorded(1) / (Recorded(1) + squares);
    if (!model_.may_lose_D()) return finite;
    FastFactors<Recorded> factors(model_);
    covariance_factor(model_, q.data(), factors, acting);
    return factors.margin * finite;
  }

  // (2) of kalmarm/implicit_step.hpp.
  void implicit_step(bool judged) {
    const Numbers q = input("q", model_.nq()), qd = input_qd(), tau = input("tau", nv()),
                  damping = input("damping", nv()), stiffness = input("stiffness", nv()),
                  reference = input("reference", nv());
    const Recorded h = input("h", 1)[0];
    const Acting<Recorded> acting = input_acting_and_gravity();
    Numbers r(nv()), at_end(tau);
    for (int k = 0; k < nv(); ++k) {
      const Joint<double>& joint = given_.joint(k);
      r[k] = S(joint.r);
      if (!takes_gains(joint)) continue;
      r[k] += h * damping[k] + h * h * stiffness[k];
      at_end[k] -=
          damping[k] * qd[k] + stiffness[k] * ((q[joint.q_index] - reference[k]) + h * qd[k]);
    }
    CovarianceWorkspace<Recorded> ws(model_);
    Numbers a(nv());
    covariance_acceleration(model_, q.data(), qd.data(), at_end.data(), r.data(), ws, a.data(),
                            acting);
    output("a", of_asked(a));
    AccelerationSums<Recorded> sums = CovarianceForm::sums(ws);
    sums.trace = ws.trace;
    if (judged) output(acceptance().judge(sums), ws.margin);
  }

  Acceptance<S> acceptance() const { return {robot_, model_, tolerance_}; }

  TaskRecord out_;
  Recording recording_;
  double tolerance_;
  Gravity gravity_;
  Model<double> given_;
  Question question_;
  LoweredModel<S> model_;
  RobotModel robot_;
  Numbers loads_, gravity_given_;
};

}  // namespace

// Accelerations: go2 (4700) is faster, g1 (11 900) slower. M^-1: panda (2500) is faster, go2 (5800) slower.
// Derivatives: none that was measured is faster.
int most_operations_of_one_state(GeneratedTask task) {
  switch (task) {
    case GeneratedTask::derivatives:
    case GeneratedTask::judged_derivatives:
      return 0;
    case GeneratedTask::inverse_mass:
    case GeneratedTask::judged_inverse_mass:
      return 4000;
    default:
      return 8000;
  }
}

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
    case GeneratedTask::operational:
      return "operational";
    case GeneratedTask::derivatives:
      return "derivatives";
    case GeneratedTask::judged_derivatives:
      return "judged_derivatives";
    case GeneratedTask::implicit_step:
      return "implicit_step";
    case GeneratedTask::judged_implicit_step:
      return "judged_implicit_step";
  }
  return {};
}

template <class S>
TaskRecord record(GeneratedTask task, const Model<double>& model, const Question& question,
                  double tolerance, Gravity gravity) {
  return Recorder<S>(task, model, question, tolerance, gravity).run();
}

template TaskRecord record<float>(GeneratedTask, const Model<double>&, const Question&, double,
                                  Gravity);
template TaskRecord record<double>(GeneratedTask, const Model<double>&, const Question&, double,
                                   Gravity);

}  // namespace kalmarm
