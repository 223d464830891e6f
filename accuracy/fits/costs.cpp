#include "accuracy/fits/costs.hpp"

#include <ceres/autodiff_cost_function.h>
#include <ceres/dynamic_autodiff_cost_function.h>
#include <ceres/dynamic_numeric_diff_cost_function.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "accuracy/fits/jacobians.hpp"

namespace kalmarm {
namespace {

// J over the columns becomes Ceres' Jacobians of the blocks: J_x = J d theta / d x.
class ToBlocks {
 public:
  ToBlocks(const FreeParameters& free, double const* const* blocks) : sizes_(free.block_sizes()) {
    for (std::size_t b = 0; b < free.bodies.size(); ++b)
      of_bodies_.push_back(log_cholesky_jacobian(
          InertialVector<double>(Eigen::Map<const InertialVector<double>>(blocks[b]))));
  }

  // Into the rows from first_row on, of `rows`.
  void operator()(const MatrixX<double>& J, int first_row, int rows, double** jacobians) const {
    int column = 0;
    for (std::size_t b = 0; b < sizes_.size(); ++b) {
      if (jacobians[b]) {
        auto to = Eigen::Map<RowMatrixX<double>>(jacobians[b], rows, sizes_[b])
                      .middleRows(first_row, J.rows());
        if (b < of_bodies_.size())
          to.noalias() = J.middleCols<body_parameters>(column).lazyProduct(of_bodies_[b]);
        else
          to = J.middleCols(column, sizes_[b]);
      }
      column += sizes_[b];
    }
  }

 private:
  std::vector<int> sizes_;
  std::vector<InertialMatrix<double>> of_bodies_;
};

void set_sizes(const FreeParameters& free, int rows, ceres::DynamicCostFunction& cost) {
  for (const int size : free.block_sizes()) cost.AddParameterBlock(size);
  cost.SetNumResiduals(rows);
}

// A step may go as far as where an exponential overflows.
bool finite(const double* x, int size) {
  return Eigen::Map<const VectorX<double>>(x, size).allFinite();
}

class Analytic final : public ceres::DynamicCostFunction {
 public:
  Analytic(const Mechanics<double>& robot, const FreeParameters& free, const Samples& samples,
           int first, int count, const ResidualOptions& options)
      : free_(free),
        samples_(samples),
        first_(first),
        count_(count),
        rows_(kalmarm::rows(options.kind, robot.model.nv())),
        robot_(robot),
        sample_(robot.model, free, options),
        J_(rows_, free.columns()) {
    set_sizes(free, rows_ * count, *this);
  }

  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    free_.apply(blocks, robot_);
    std::optional<ToBlocks> to_blocks;
    if (jacobians) to_blocks.emplace(free_, blocks);
    for (int i = 0; i < count_; ++i) {
      double* out = residuals + i * rows_;
      if (!sample_.evaluate(robot_, samples_, first_ + i, out, jacobians ? &J_ : nullptr))
        return false;
      if (jacobians) (*to_blocks)(J_, i * rows_, num_residuals(), jacobians);
    }
    return finite(residuals, num_residuals());
  }

 private:
  FreeParameters free_;
  const Samples& samples_;
  int first_, count_, rows_;
  mutable Mechanics<double> robot_;
  mutable SampleJacobian sample_;
  mutable MatrixX<double> J_;
};

// The templates themselves, for Jets and for differences.
class Template {
 public:
  Template(const Mechanics<double>& robot, const FreeParameters& free, const Samples& samples,
           int first, int count, const ResidualOptions& options)
      : robot_(robot),
        free_(free),
        samples_(samples),
        first_(first),
        count_(count),
        options_(options) {}

  template <class T>
  bool operator()(T const* const* blocks, T* residuals) const {
    Mechanics<T> robot = robot_.cast<T>();
    free_.apply(blocks, robot);
    SampleResidual<T> sample(robot_.model, options_);
    const int rows = kalmarm::rows(options_.kind, robot_.model.nv());
    for (int i = 0; i < count_; ++i)
      if (!sample.evaluate(robot, samples_, first_ + i, residuals + i * rows)) return false;
    return true;
  }

 private:
  Mechanics<double> robot_;
  FreeParameters free_;
  const Samples& samples_;
  int first_, count_;
  ResidualOptions options_;
};

class Linear final : public ceres::DynamicCostFunction {
 public:
  Linear(const FreeParameters& free, const MatrixX<double>& R, const VectorX<double>& y)
      : free_(free), R_(R), y_(y) {
    set_sizes(free, static_cast<int>(R.rows()), *this);
  }

  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    VectorX<double> p(free_.columns());
    int column = 0, block = 0;
    for (const int size : parameter_block_sizes()) {
      const Eigen::Map<const VectorX<double>> x(blocks[block], size);
      if (block < static_cast<int>(free_.bodies.size()))
        p.segment<body_parameters>(column) = from_log_cholesky(InertialVector<double>(x));
      else
        p.segment(column, size) = x;
      column += size;
      ++block;
    }
    Eigen::Map<VectorX<double>>(residuals, num_residuals()) = R_ * p - y_;
    if (jacobians) ToBlocks(free_, blocks)(R_, 0, num_residuals(), jacobians);
    return finite(residuals, num_residuals());
  }

 private:
  FreeParameters free_;
  MatrixX<double> R_;
  VectorX<double> y_;
};

// V = U0^-1 U, and the diagonal's share f(v) = v^2 - 1 - 2 log v as a square.
class BodyPrior {
 public:
  BodyPrior(const InertialVector<double>& x0, double weight) : x0_(x0), weight_(weight) {
    S0_ << std::exp(x0[1]), x0[4], x0[6], 0, std::exp(x0[2]), x0[5], 0, 0, std::exp(x0[3]);
  }

  template <class T>
  bool operator()(const T* x, T* out) const {
    using std::exp;
    const T alpha = x[0] - x0_[0], scale = weight_ * exp(alpha);
    out[0] = diagonal(alpha);
    for (int i = 1; i < 4; ++i) out[i] = diagonal(alpha + x[i] - x0_[i]);
    Eigen::Matrix<T, 3, 3> rest;  // above S0's diagonal: S, and t - t0
    rest << x[4], x[6], x[7] - x0_[7], exp(x[2]), x[5], x[8] - x0_[8], T(0), exp(x[3]),
        x[9] - x0_[9];
    const Eigen::Matrix<T, 3, 3> V =
        S0_.cast<T>().template triangularView<Eigen::Upper>().solve(rest);
    const std::pair<int, int> entries[] = {{0, 0}, {0, 1}, {1, 1}, {0, 2}, {1, 2}, {2, 2}};
    for (int i = 0; i < 6; ++i) out[4 + i] = scale * V(entries[i].first, entries[i].second);
    return true;
  }

 private:
  // sqrt f(e^x) with the sign of x.
  template <class T>
  T diagonal(const T& x) const {
    using std::exp;
    using std::sqrt;
    if (abs(x) < T(1e-4)) return weight_ * std::numbers::sqrt2 * x * (1.0 + x / 3.0);
    const T root = weight_ * sqrt(exp(2.0 * x) - 1.0 - 2.0 * x);
    return x < T(0) ? T(-root) : root;
  }

  InertialVector<double> x0_;
  Matrix3<double> S0_;
  double weight_;
};

// Not ceres::NormalPrior: Eigen's vectors may not pass between Ceres' library and this one, which
// are compiled for different processors and so align them differently.
class ScalarPrior {
 public:
  ScalarPrior(const VectorX<double>& x0, double weight) : x0_(x0), weight_(weight) {}

  template <class T>
  bool operator()(T const* const* blocks, T* out) const {
    for (int i = 0; i < x0_.size(); ++i)
      out[i] = weight_ / (x0_[i] > 0 ? x0_[i] : 1) * (blocks[0][i] - x0_[i]);
    return true;
  }

 private:
  VectorX<double> x0_;
  double weight_;
};

}  // namespace

std::unique_ptr<ceres::CostFunction> make_cost(const Mechanics<double>& robot,
                                               const FreeParameters& free, const Samples& samples,
                                               int first, int count, const ResidualOptions& options,
                                               Differentiation differentiation) {
  if (differentiation == Differentiation::analytic)
    return std::make_unique<Analytic>(robot, free, samples, first, count, options);
  const int rows = count * kalmarm::rows(options.kind, robot.model.nv());
  const auto functor = [&] { return new Template(robot, free, samples, first, count, options); };
  std::unique_ptr<ceres::DynamicCostFunction> out;
  if (differentiation == Differentiation::automatic)
    out = std::make_unique<ceres::DynamicAutoDiffCostFunction<Template, 8>>(functor());
  else
    out = std::make_unique<ceres::DynamicNumericDiffCostFunction<Template, ceres::CENTRAL>>(
        functor());
  set_sizes(free, rows, *out);
  return out;
}

std::unique_ptr<ceres::CostFunction> make_linear_cost(const FreeParameters& free,
                                                      const MatrixX<double>& R,
                                                      const VectorX<double>& y) {
  return std::make_unique<Linear>(free, R, y);
}

std::unique_ptr<ceres::CostFunction> make_body_prior(const InertialVector<double>& x0,
                                                     double weight) {
  using Cost = ceres::AutoDiffCostFunction<BodyPrior, body_parameters, body_parameters>;
  return std::make_unique<Cost>(new BodyPrior(x0, weight));
}

std::unique_ptr<ceres::CostFunction> make_scalar_prior(const VectorX<double>& x0, double weight) {
  auto out = std::make_unique<ceres::DynamicAutoDiffCostFunction<ScalarPrior>>(
      new ScalarPrior(x0, weight));
  out->AddParameterBlock(static_cast<int>(x0.size()));
  out->SetNumResiduals(static_cast<int>(x0.size()));
  return out;
}

}  // namespace kalmarm
