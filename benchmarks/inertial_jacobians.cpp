#include "benchmarks/inertial_jacobians.hpp"

#include <ceres/dynamic_autodiff_cost_function.h>
#include <ceres/dynamic_numeric_diff_cost_function.h>
#include <ceres/jet.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/study/derivatives/acceleration_jacobian.hpp"
#include "algorithms/study/derivatives/fit_filter.hpp"
#include "algorithms/study/derivatives/innovation_jacobian.hpp"
#include "algorithms/study/derivatives/mass_jacobian.hpp"
#include "algorithms/study/inverse_mass/sequential.hpp"

namespace kalmarm {
namespace {

enum class Task { inverse_dynamics, forward_dynamics, innovations, mass_matrix };

// Directions that Jets carry at a time, a vector of AVX-512: there the fastest of 8, 10 and 16.
constexpr int stride = 8;

std::string name_of(Task task) {
  switch (task) {
    case Task::inverse_dynamics:
      return "jacobian_inverse_dynamics";
    case Task::forward_dynamics:
      return "jacobian_forward_dynamics";
    case Task::innovations:
      return "jacobian_innovations";
    case Task::mass_matrix:
      break;
  }
  return "jacobian_mass_matrix";
}

bool has_inverse(Task task) { return task == Task::forward_dynamics || task == Task::innovations; }

// What all of a task's contenders are given. The sample is set before each call.
struct Problem {
  Task task;
  const Case& measured;
  const Model<double>& model;
  std::vector<int> bodies;  // links with mass
  std::vector<InertialVector<double>> x;
  std::vector<double const*> blocks;  // of x
  const State* state = nullptr;
  const VectorX<double>* qdd = nullptr;

  Problem(Task what, const Case& c) : task(what), measured(c), model(c.scene.model) {
    for (int k = 0; k < model.nv(); ++k)
      if (!model.inertia(k).massless) bodies.push_back(k);
    for (const int k : bodies) x.push_back(to_log_cholesky(model.M(k)));
    for (const InertialVector<double>& of_body : x) blocks.push_back(of_body.data());
  }
  Problem(const Problem&) = delete;

  int rows() const {
    return task == Task::mass_matrix ? lower_triangle_size(model.nv()) : model.nv();
  }
  bool is_physical() const {
    return std::ranges::all_of(x, [](const auto& of_body) { return of_body.allFinite(); });
  }
  // Accelerations are the next state's velocities.
  void choose(int i) {
    const std::vector<State>& states = measured.states;
    state = &states[i];
    qdd = &states[(i + 1) % states.size()].qd;
  }
};

// The residual in precision T.
template <class T>
class Residual {
 public:
  explicit Residual(const Problem& problem)
      : problem_(problem),
        model_(problem.model.cast<T>()),
        kin_(model_),
        composite_(model_),
        filter_(model_),
        innovations_(model_),
        q_(model_.nq()),
        qd_(model_.nv()),
        qdd_(model_.nv()),
        tau_(model_.nv()),
        a_(model_.nv()),
        M_(model_.nv(), model_.nv()) {}

  // Writes problem.rows() numbers. False where M is singular.
  bool operator()(T const* const* blocks, T* out) {
    using std::sqrt;
    for (const int k : problem_.bodies) {
      const InertialVector<T> x = Eigen::Map<const InertialVector<T>>(*blocks++);
      model_.set_inertia(k, spatial_inertia<T>(from_log_cholesky(x)));
    }
    Eigen::Map<VectorX<T>> r(out, problem_.rows());
    q_ = problem_.state->q.template cast<T>();
    set_position(model_, q_, kin_);
    if (problem_.task == Task::mass_matrix) {
      mass_matrix(model_, kin_, composite_, Eigen::Ref<MatrixX<T>>(M_));
      for (int i = 0; i < model_.nv(); ++i)
        for (int j = 0; j <= i; ++j) r[lower_triangle_row(i, j)] = -M_(i, j);
      return true;
    }
    qd_ = problem_.state->qd.template cast<T>();
    qdd_ = problem_.qdd->template cast<T>();
    tau_ = problem_.state->tau.template cast<T>();
    set_velocity(model_, qd_, kin_);
    if (problem_.task == Task::inverse_dynamics) {
      inverse_dynamics(model_, kin_, qdd_, innovations_.newton_euler, Eigen::Ref<VectorX<T>>(a_));
      r = tau_ - a_;
      return true;
    }
    if (!filter_.factor(model_, kin_)) return false;
    if (problem_.task == Task::forward_dynamics) {
      Sequential<Conventional>::acceleration(model_, kin_, tau_, filter_, a_);
      r = qdd_ - a_;
    } else {
      innovations(model_, kin_, filter_.factors, qdd_, tau_, innovations_,
                  Eigen::Ref<VectorX<T>>(a_));
      r = a_;
    }
    return true;
  }

  // Of the last call.
  const Model<T>& model() const { return model_; }
  const LinkKinematics<T>& random_model() const { return kin_; }
  const Gains<T>& gains() const { return filter_.factors; }
  const VectorX<T>& acceleration() const { return a_; }                   // forward_dynamics
  const std::vector<T>& e_plus() const { return innovations_.sweeps.e; }  // innovations

 private:
  const Problem& problem_;
  Model<T> model_;
  LinkKinematics<T> kin_;
  CompositeInertia<T> composite_;
  FitFilter<T> filter_;
  Innovations<T> innovations_;
  VectorX<T> q_, qd_, qdd_, tau_, a_;
  MatrixX<T> M_;
};

// The factored derivatives over theta, then J_x = J d theta / d x body by body. All Jacobians have
// to be asked for.
class Factored final : public ceres::CostFunction {
 public:
  explicit Factored(const Problem& problem)
      : problem_(problem),
        residual_(problem),
        regressor_(problem.model),
        acceleration_(problem.model),
        innovation_(problem.model),
        mass_(problem.model),
        by_theta_(problem.rows(), body_parameters * problem.model.nv()),
        by_r_(problem.rows(), problem.model.nv()),
        by_tau_(by_r_) {
    mutable_parameter_block_sizes()->assign(problem.bodies.size(), body_parameters);
    set_num_residuals(problem.rows());
  }

  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    if (!residual_(blocks, residuals)) return false;
    const Model<double>& model = residual_.model();
    const LinkKinematics<double>& kin = residual_.random_model();
    double sign = -1;
    switch (problem_.task) {
      case Task::inverse_dynamics:
        regressor<double>(model, kin, *problem_.qdd, regressor_, by_theta_);
        break;
      case Task::forward_dynamics:
        acceleration_jacobian<double>(model, kin, residual_.gains(), residual_.acceleration(),
                                      acceleration_, by_theta_, by_r_, by_tau_);
        break;
      case Task::innovations:
        innovation_jacobian<double>(model, kin, residual_.gains(), *problem_.qdd,
                                    residual_.e_plus(), innovation_, by_theta_, by_r_, by_tau_);
        sign = 1;
        break;
      case Task::mass_matrix:
        mass_jacobian<double>(model, kin, mass_, by_theta_, by_r_);
        break;
    }
    for (const int k : problem_.bodies) {
      const InertialVector<double> x = Eigen::Map<const InertialVector<double>>(*blocks++);
      const InertialMatrix<double> theta_by_x = sign * log_cholesky_jacobian(x);
      Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, body_parameters, Eigen::RowMajor>> J(
          *jacobians++, problem_.rows(), body_parameters);
      const int rows = rows_of(k);
      J.topRows(rows).noalias() =
          by_theta_.block(0, body_parameters * k, rows, body_parameters).lazyProduct(theta_by_x);
      J.bottomRows(problem_.rows() - rows).setZero();
    }
    return true;
  }

 private:
  // The first rows, behind which link k's columns are zero: it is felt inboard, where numbers are
  // smaller, and everywhere in M^-1.
  int rows_of(int k) const {
    if (problem_.task == Task::forward_dynamics) return problem_.rows();
    return problem_.task == Task::mass_matrix ? lower_triangle_size(k + 1) : k + 1;
  }

  const Problem& problem_;
  mutable Residual<double> residual_;
  mutable Regressor<double> regressor_;
  mutable AccelerationJacobian<double> acceleration_;
  mutable InnovationJacobian<double> innovation_;
  mutable MassJacobian<double> mass_;
  mutable RowMatrixX<double> by_theta_, by_r_, by_tau_;
};

// The residual in each precision that Ceres asks for.
class Functor {
 public:
  using Jet = ceres::Jet<double, stride>;

  explicit Functor(const Problem& problem) : values_(problem), jets_(problem) {}

  bool operator()(double const* const* blocks, double* out) const { return values_(blocks, out); }
  bool operator()(Jet const* const* blocks, Jet* out) const { return jets_(blocks, out); }

 private:
  mutable Residual<double> values_;
  mutable Residual<Jet> jets_;
};

template <class Cost>
std::unique_ptr<ceres::CostFunction> make_cost(const Problem& problem) {
  auto out = std::make_unique<Cost>(new Functor(problem));
  for (std::size_t i = 0; i < problem.bodies.size(); ++i) out->AddParameterBlock(body_parameters);
  out->SetNumResiduals(problem.rows());
  return out;
}
using AutoDiff = ceres::DynamicAutoDiffCostFunction<Functor, stride>;
template <ceres::NumericDiffMethodType method>
using NumericDiff = ceres::DynamicNumericDiffCostFunction<Functor, method>;

// A cost function with the memory for its results: the Jacobians of the blocks one after the other,
// each row by row, as Ceres has them.
class Contender {
 public:
  Contender(const Problem& problem, std::unique_ptr<ceres::CostFunction> cost)
      : problem_(problem),
        cost_(std::move(cost)),
        residual_(problem.rows()),
        jacobian_(problem.rows() * body_parameters, problem.bodies.size()) {
    for (auto block : jacobian_.colwise()) jacobians_.push_back(block.data());
  }

  bool evaluate() {
    return cost_->Evaluate(problem_.blocks.data(), residual_.data(), jacobians_.data());
  }
  MatrixX<double>& jacobian() { return jacobian_; }

 private:
  const Problem& problem_;
  std::unique_ptr<ceres::CostFunction> cost_;
  VectorX<double> residual_;
  MatrixX<double> jacobian_;
  std::vector<double*> jacobians_;
};

// The Jacobian in Contender's order by dual numbers of a wider precision; empty where M is
// singular.
MatrixX<double> wide_jacobian(const Problem& problem) {
  using Wide = ceres::Jet<Wider<double>, body_parameters>;
  const auto bodies = problem.bodies.size();
  Residual<Wide> residual(problem);
  std::vector<Wide> x(bodies * body_parameters), r(problem.rows());
  std::vector<Wide const*> blocks;
  for (std::size_t b = 0; b < bodies; ++b) {
    for (int i = 0; i < body_parameters; ++i) x[b * body_parameters + i] = Wide(problem.x[b][i]);
    blocks.push_back(&x[b * body_parameters]);
  }
  MatrixX<double> out(problem.rows() * body_parameters, bodies);
  for (std::size_t b = 0; b < bodies; ++b) {
    Wide* const block = &x[b * body_parameters];
    for (int i = 0; i < body_parameters; ++i) block[i].v[i] = 1;
    if (!residual(blocks.data(), r.data())) return {};
    for (int row = 0; row < problem.rows(); ++row)
      out.col(b).segment<body_parameters>(row * body_parameters) = r[row].v.cast<double>();
    for (int i = 0; i < body_parameters; ++i) block[i].v[i] = 0;
  }
  return out;
}

// What a task's contenders share; the truth is worked out when the first of them is verified.
struct TaskCase {
  std::shared_ptr<const Case> measured;
  Problem problem;
  std::vector<MatrixX<double>> truth;

  TaskCase(Task task, std::shared_ptr<const Case> c) : measured(c), problem(task, *c) {}

  // Of long robots the first state alone, whose truth takes seconds.
  int verified() const { return problem.model.nv() <= 20 ? measured->verified() : 1; }
  const MatrixX<double>& right(int i) {
    while (static_cast<int>(truth.size()) <= i) {
      problem.choose(static_cast<int>(truth.size()));
      truth.push_back(wide_jacobian(problem));
    }
    return truth[i];
  }
};

// `lost`: what the method itself multiplies the roundoff by.
void add(const std::string& variant, double lost, std::shared_ptr<TaskCase> task,
         const std::function<std::unique_ptr<ceres::CostFunction>(const Problem&)>& make) {
  const std::string name = name_of<double>(name_of(task->problem.task), variant, *task->measured);
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& run) {
    Problem& problem = task->problem;
    std::string flaw = problem.is_physical() ? task->measured->flaw : "a body is not physical";
    Contender contender(problem, make(problem));
    double worst = 0;
    for (int i = 0; i < task->verified() && flaw.empty(); ++i) {
      const MatrixX<double>& right = task->right(i);
      problem.choose(i);
      contender.jacobian().setConstant(std::numeric_limits<double>::quiet_NaN());
      if (right.size() == 0 || !contender.evaluate()) {
        flaw = "singular";
        break;
      }
      const double error = (contender.jacobian() - right).norm() / right.norm();
      const double condition = has_inverse(problem.task) ? task->measured->condition[i] : 1;
      const double bound = task->measured->bound<double>(lost * condition);
      if (!(error <= bound)) flaw = wrong(error, bound);
      worst = std::max(worst, error);
    }
    if (!flaw.empty()) {
      run.SkipWithError(flaw.c_str());
      return;
    }
    time_calls(run, [&](int i) {
      problem.choose(i);
      benchmark::DoNotOptimize(contender.evaluate());
      benchmark::DoNotOptimize(contender.jacobian().data());
    });
    run.counters["error"] = worst;
  })->Unit(benchmark::kNanosecond);
}

}  // namespace

void add_inertial_jacobians(std::shared_ptr<const Case> c) {
  const double half = 1 / std::sqrt(unit_roundoff<double>());
  for (const Task task :
       {Task::inverse_dynamics, Task::forward_dynamics, Task::innovations, Task::mass_matrix}) {
    const auto of_task = std::make_shared<TaskCase>(task, c);
    add("Factored", 1, of_task, [](const Problem& p) { return std::make_unique<Factored>(p); });
    add("AutoDiff", 1, of_task, make_cost<AutoDiff>);
    add("NumericDiff", half, of_task, make_cost<NumericDiff<ceres::FORWARD>>);
    add("NumericDiffCentral", half, of_task, make_cost<NumericDiff<ceres::CENTRAL>>);
  }
}

}  // namespace kalmarm
