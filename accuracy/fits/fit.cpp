#include "accuracy/fits/fit.hpp"

#include <ceres/covariance.h>
#include <ceres/iteration_callback.h>
#include <ceres/problem.h>
#include <ceres/solver.h>
#include <glog/logging.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "accuracy/fits/costs.hpp"
#include "accuracy/fits/identifiability.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

constexpr int samples_a_cost = 50;

using Clock = std::chrono::steady_clock;

// The blocks as Ceres wants them.
struct Blocks {
  std::vector<VectorX<double>> values;
  std::vector<double*> pointers;

  explicit Blocks(std::vector<VectorX<double>> start) : values(std::move(start)) {
    for (VectorX<double>& block : values) pointers.push_back(block.data());
  }
  Blocks(const Blocks&) = delete;
};

class Recorder final : public ceres::IterationCallback {
 public:
  Recorder(const FreeParameters& free, const Mechanics<double>& robot, const Blocks& blocks,
           int round, Clock::time_point start, std::vector<Iteration>& out)
      : free_(free), robot_(robot), blocks_(blocks), round_(round), start_(start), out_(out) {}

  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    free_.apply(blocks_.pointers.data(), robot_);
    const std::chrono::duration<double> elapsed = Clock::now() - start_;
    out_.push_back({round_, summary.cost, summary.gradient_max_norm, elapsed.count(),
                    free_.values_of(robot_)});
    return ceres::SOLVER_CONTINUE;
  }

 private:
  const FreeParameters& free_;
  Mechanics<double> robot_;
  const Blocks& blocks_;
  int round_;
  Clock::time_point start_;
  std::vector<Iteration>& out_;
};

// d columns / d blocks.
MatrixX<double> block_jacobian(const FreeParameters& free, const Blocks& blocks) {
  MatrixX<double> out = MatrixX<double>::Identity(free.columns(), free.columns());
  for (std::size_t b = 0; b < free.bodies.size(); ++b) {
    const int at = body_parameters * static_cast<int>(b);
    out.block<body_parameters, body_parameters>(at, at) =
        log_cholesky_jacobian(InertialVector<double>(blocks.values[b]));
  }
  return out;
}

// Of the columns, by Ceres from the triangle R at the solution; zero where the data see nothing.
MatrixX<double> covariance_of(const FreeParameters& free, const MatrixX<double>& R,
                              Blocks& blocks) {
  ceres::Problem problem;
  problem.AddResidualBlock(make_linear_cost(free, R, VectorX<double>::Zero(R.rows())).release(),
                           nullptr, blocks.pointers);
  ceres::Covariance::Options options;
  options.algorithm_type = ceres::DENSE_SVD;
  options.null_space_rank = -1;
  options.min_reciprocal_condition_number = 1e-16;
  ceres::Covariance covariance(options);
  const std::vector<const double*> all(blocks.pointers.begin(), blocks.pointers.end());
  const int n = free.columns();
  if (!covariance.Compute(all, &problem))
    return MatrixX<double>::Constant(n, n, std::numeric_limits<double>::quiet_NaN());
  MatrixX<double> of_blocks(n, n);  // symmetric: row-major is column-major
  covariance.GetCovarianceMatrix(all, of_blocks.data());
  const MatrixX<double> map = block_jacobian(free, blocks);
  return map * of_blocks * map.transpose();
}

class Fitter {
 public:
  Fitter(const Mechanics<double>& start, const FreeParameters& free, const Samples& samples,
         const FitOptions& options)
      : start_(start),
        free_(free),
        samples_(samples),
        options_(options),
        x0_(free.blocks_of(start)),
        blocks_(x0_) {
    out_.robot = start;
  }

  Fit run() && {
    const bool likelihood = options_.residual == Residual::likelihood;
    rounds(likelihood ? Residual::innovations : options_.residual,
           {1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 0});
    for (int i = 0; likelihood && i < 2; ++i) rounds(Residual::likelihood, {0});
    out_.seconds = std::chrono::duration<double>(Clock::now() - began_).count();
    finish();
    return std::move(out_);
  }

 private:
  // One solution after the other, each from the last, with falling weight of the prior. While the
  // prior has weight a few samples say enough; a residual that is reduced has all in one triangle.
  void rounds(Residual kind, const std::vector<double>& weights) {
    ResidualOptions residual = residual_options(kind, start_, samples_);
    residual.sigma = out_.sigma;
    const bool reduced = is_linear(kind) && options_.differentiation == Differentiation::analytic;
    const int enough = std::max(200, 5 * free_.columns() / start_.model.nv());
    const int stride = reduced ? 1 : std::max(1, samples_.count() / enough);
    const Samples few = every(samples_, stride);
    const MatrixX<double> Rp = linear_triangle(out_.robot, free_, few, residual);
    const MatrixX<double> R = Rp.leftCols(free_.columns());
    for (const double weight : weights) {
      const Samples& samples = weight > 0 ? few : samples_;
      ceres::Problem problem;
      if (reduced) {
        problem.AddResidualBlock(make_linear_cost(free_, R, Rp.col(free_.columns())).release(),
                                 nullptr, blocks_.pointers);
      } else {
        for (int first = 0; first < samples.count(); first += samples_a_cost)
          problem.AddResidualBlock(make_cost(start_, free_, samples, first,
                                             std::min(samples_a_cost, samples.count() - first),
                                             residual, options_.differentiation)
                                       .release(),
                                   nullptr, blocks_.pointers);
      }
      const double size = (R * block_jacobian(free_, blocks_)).norm() *
                          std::sqrt(samples.count() / (few.count() * double(free_.columns())));
      if (const double w = std::max(weight, options_.prior); w > 0) add_priors(w * size, problem);
      solve(problem, reduced, weight > 0);
      if (!out_.usable) return;
    }
    residual_ = residual;
    out_.sigma = root_mean_square(out_.robot, samples_, residual);
  }

  void solve(ceres::Problem& problem, bool reduced, bool roughly) {
    add_bounds(problem);
    ceres::Solver::Options solver;
    solver.linear_solver_type = reduced ? ceres::DENSE_QR : ceres::DENSE_NORMAL_CHOLESKY;
    solver.max_num_iterations = options_.iterations;
    solver.function_tolerance = roughly ? 1e-5 : 1e-8;  // far below what noise says
    solver.gradient_tolerance = 1e-20;
    solver.parameter_tolerance = roughly ? 1e-6 : 1e-14;
    solver.max_num_consecutive_invalid_steps = 20;
    solver.logging_type = ceres::SILENT;
    FLAGS_minloglevel = google::GLOG_FATAL;  // a step that goes too far is taken back, not told
    solver.update_state_every_iteration = true;
    Recorder recorder(free_, start_, blocks_, round_++, began_, out_.iterations);
    solver.callbacks.push_back(&recorder);
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem, &summary);
    out_.usable = summary.IsSolutionUsable();
    out_.converged = summary.termination_type == ceres::CONVERGENCE;
    out_.message = one_line(summary.message);
    free_.apply(blocks_.pointers.data(), out_.robot);
  }

  void add_priors(double weight, ceres::Problem& problem) {
    const int bodies = static_cast<int>(free_.bodies.size());
    for (int b = 0; b < static_cast<int>(x0_.size()); ++b) {
      auto prior = b < bodies ? make_body_prior(x0_[b], weight) : make_scalar_prior(x0_[b], weight);
      problem.AddResidualBlock(prior.release(), nullptr, blocks_.pointers[b]);
    }
  }

  // Around the start, whatever the block holds now.
  void add_bounds(ceres::Problem& problem) {
    const int bodies = static_cast<int>(free_.bodies.size());
    for (int b = 0; b < static_cast<int>(x0_.size()); ++b) {
      double* const block = blocks_.pointers[b];
      const auto within = [&](int i, double reach) {
        problem.SetParameterLowerBound(block, i, x0_[b][i] - reach);
        problem.SetParameterUpperBound(block, i, x0_[b][i] + reach);
      };
      if (b >= bodies) {
        for (int i = 0; i < x0_[b].size(); ++i) problem.SetParameterLowerBound(block, i, 0);
        continue;
      }
      if (options_.mass_within > 0) within(0, std::log(options_.mass_within) / 2);
      if (options_.com_within > 0)
        for (int i = 7; i < body_parameters; ++i) within(i, options_.com_within);
    }
  }

  void finish() {
    if (!out_.usable) return;
    out_.R = jacobian_triangle(out_.robot, free_, samples_, residual_);
    const double n =
        static_cast<double>(samples_.count()) * data_rows(residual_.kind, start_.model.nv());
    const double freedom = n - rank_and_condition(out_.R).rank;  // 0: infinite intervals
    out_.covariance = out_.sigma * out_.sigma * n / freedom * covariance_of(free_, out_.R, blocks_);
  }

  const Mechanics<double>& start_;
  const FreeParameters& free_;
  const Samples& samples_;
  const FitOptions& options_;
  std::vector<VectorX<double>> x0_;
  Blocks blocks_;
  ResidualOptions residual_;
  Clock::time_point began_ = Clock::now();
  int round_ = 0;
  Fit out_;
};

}  // namespace

Fit fit(const Mechanics<double>& start, const FreeParameters& free, const Samples& samples,
        const FitOptions& options) {
  return Fitter(start, free, samples, options).run();
}

double root_mean_square(const Mechanics<double>& robot, const Samples& samples,
                        const ResidualOptions& options) {
  SampleResidual<double> sample(robot.model, options);
  VectorX<double> r(rows(options.kind, robot.model.nv()));
  const int of_data = data_rows(options.kind, robot.model.nv());
  double sum = 0;
  for (int i = 0; i < samples.count(); ++i) {
    sample.evaluate(robot, samples, i, r.data());
    sum += r.head(of_data).squaredNorm();
  }
  return std::sqrt(sum / (static_cast<double>(samples.count()) * of_data));
}

}  // namespace kalmarm
