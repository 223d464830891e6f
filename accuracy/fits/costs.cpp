#include "accuracy/fits/costs.hpp"

#include <ceres/dynamic_autodiff_cost_function.h>
#include <ceres/dynamic_numeric_diff_cost_function.h>

#include "accuracy/fits/jacobians.hpp"

namespace kalmarm {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Splits J over the columns into Ceres' Jacobians of the blocks: J_x = J d theta / d x.
void to_blocks(const FreeParameters& free, const MatrixX<double>& J, double const* const* blocks,
               double** jacobians, int first_row, int rows) {
  int column = 0, block = 0;
  for (const int size : free.block_sizes()) {
    if (double* out = jacobians[block]) {
      Eigen::Map<RowMajor> to(out, rows, size);
      auto of_block = to.middleRows(first_row, J.rows());
      if (block < static_cast<int>(free.bodies.size())) {
        const InertialVector<double> x = Eigen::Map<const InertialVector<double>>(blocks[block]);
        of_block.noalias() = J.middleCols<body_parameters>(column) * log_cholesky_jacobian(x);
      } else {
        of_block = J.middleCols(column, size);
      }
    }
    column += size;
    ++block;
  }
}

void set_sizes(const FreeParameters& free, int rows, ceres::DynamicCostFunction& cost) {
  for (const int size : free.block_sizes()) cost.AddParameterBlock(size);
  cost.SetNumResiduals(rows);
}

bool finite(double const* const* blocks, const std::vector<int>& sizes) {
  for (std::size_t i = 0; i < sizes.size(); ++i)
    if (!Eigen::Map<const VectorX<double>>(blocks[i], sizes[i]).allFinite()) return false;
  return true;
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
    if (!finite(blocks, parameter_block_sizes())) return false;
    free_.apply(blocks, robot_);
    for (int i = 0; i < count_; ++i) {
      double* out = residuals + i * rows_;
      if (!sample_.evaluate(robot_, samples_, first_ + i, out, jacobians ? &J_ : nullptr))
        return false;
      if (jacobians) to_blocks(free_, J_, blocks, jacobians, i * rows_, num_residuals());
    }
    return true;
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
    if (!finite(blocks, parameter_block_sizes())) return false;
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
    if (jacobians) to_blocks(free_, R_, blocks, jacobians, 0, num_residuals());
    return true;
  }

 private:
  FreeParameters free_;
  MatrixX<double> R_;
  VectorX<double> y_;
};

// Not ceres::NormalPrior: Eigen's vectors may not pass between Ceres' library and this one, which
// are compiled for different processors and so align them differently.
class Prior final : public ceres::DynamicCostFunction {
 public:
  Prior(const VectorX<double>& x0, double weight) : x0_(x0), weight_(weight) {
    AddParameterBlock(static_cast<int>(x0.size()));
    SetNumResiduals(static_cast<int>(x0.size()));
  }

  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    const auto n = x0_.size();
    Eigen::Map<VectorX<double>>(residuals, n) =
        weight_ * (Eigen::Map<const VectorX<double>>(blocks[0], n) - x0_);
    if (jacobians && jacobians[0])
      Eigen::Map<RowMajor>(jacobians[0], n, n) = weight_ * MatrixX<double>::Identity(n, n);
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
    out = std::make_unique<ceres::DynamicAutoDiffCostFunction<Template, 10>>(functor());
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

std::unique_ptr<ceres::CostFunction> make_prior(const VectorX<double>& x0, double weight) {
  return std::make_unique<Prior>(x0, weight);
}

}  // namespace kalmarm
