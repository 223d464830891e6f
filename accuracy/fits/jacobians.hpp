// The residuals of residuals.hpp with their factored derivatives, over the columns of
// parameters.hpp.
//
// A column of friction is that of torque times the velocity, or its smoothed sign: with by_tau the
// residual's derivative over measured torque, -by_tau diag(q').
#pragma once

#include <vector>

#include "accuracy/fits/residuals.hpp"
#include "algorithms/study/derivatives/acceleration_jacobian.hpp"
#include "algorithms/study/derivatives/log_D_jacobian.hpp"

namespace kalmarm {

class SampleJacobian {
 public:
  SampleJacobian(const Model<double>& model, const FreeParameters& free,
                 const ResidualOptions& options)
      : options_(options),
        free_(free),
        residual_(model, options),
        regressor_(model),
        acceleration_(model),
        innovation_(model),
        mass_(model),
        by_theta_(rows(options.kind, model.nv()), body_parameters * model.nv()),
        by_r_(by_theta_.rows(), model.nv()),
        by_tau_(by_r_) {}

  // r has rows(kind, nv) numbers, J (null: not wanted) as many rows and free.columns() columns.
  // False where M is singular.
  bool evaluate(const Mechanics<double>& robot, const Samples& samples, int i, double* r,
                MatrixX<double>* J) {
    if (!residual_.evaluate(robot, samples, i, r)) return false;
    if (!J) return true;
    differentiate(robot.model, samples.qdd.col(i), r);
    int column = 0;
    for (const int k : free_.bodies) {
      J->middleCols<body_parameters>(column) =
          by_theta_.middleCols<body_parameters>(body_parameters * k);
      column += body_parameters;
    }
    for (const int k : free_.armature) J->col(column++) = by_r_.col(k);
    for (const int k : free_.viscous) J->col(column++) = -by_tau_.col(k) * samples.qd(k, i);
    for (const int k : free_.coulomb)
      J->col(column++) = -by_tau_.col(k) * coulomb_sign(samples.qd(k, i));
    return true;
  }

 private:
  template <class V>
  void differentiate(const Model<double>& model, const V& qdd, const double* r) {
    const LinkKinematics<double>& kin = residual_.random_model();
    const int nv = model.nv();
    const VectorX<double> per_scale =
        options_.scale.size() ? VectorX<double>(-options_.scale.cwiseInverse()) : VectorX<double>();
    switch (options_.kind) {
      case Residual::inverse_dynamics:
        regressor<double>(model, kin, qdd, regressor_, by_theta_);
        by_r_ = qdd.asDiagonal();
        by_tau_ = -MatrixX<double>::Identity(nv, nv);
        scale_rows(per_scale);
        break;
      case Residual::forward_dynamics:
        acceleration_jacobian<double>(model, kin, residual_.gains(), residual_.acceleration(),
                                      acceleration_, by_theta_, by_r_, by_tau_);
        scale_rows(per_scale);
        break;
      case Residual::mass_matrix: {
        mass_jacobian<double>(model, kin, mass_, by_theta_, by_r_);
        VectorX<double> of_entries(by_theta_.rows());
        for (int row = 0; row < nv; ++row)
          for (int col = 0; col <= row; ++col)
            of_entries[lower_triangle_row(row, col)] = -per_scale[row] * per_scale[col];
        by_tau_.setZero();
        scale_rows(of_entries);
        break;
      }
      case Residual::innovations:
      case Residual::likelihood:
        innovation_jacobian<double>(model, kin, residual_.gains(), qdd, residual_.e_plus(),
                                    innovation_, by_theta_.topRows(nv), by_r_.topRows(nv),
                                    by_tau_.topRows(nv));
        if (options_.kind == Residual::innovations) break;
        log_D_jacobian<double>(model, kin, residual_.gains(), innovation_, by_theta_.bottomRows(nv),
                               by_r_.bottomRows(nv));
        by_tau_.bottomRows(nv).setZero();
        for (int k = nv; k < 2 * nv; ++k) {  // d sigma sqrt(log D + C) = sigma^2 / 2r dD / D
          const double factor = options_.sigma * options_.sigma / (2 * r[k]);
          by_theta_.row(k) *= factor;
          by_r_.row(k) *= factor;
        }
        break;
    }
  }

  void scale_rows(const VectorX<double>& factors) {
    by_theta_ = factors.asDiagonal() * by_theta_;
    by_r_ = factors.asDiagonal() * by_r_;
    by_tau_ = factors.asDiagonal() * by_tau_;
  }

  ResidualOptions options_;
  FreeParameters free_;
  SampleResidual<double> residual_;
  Regressor<double> regressor_;
  AccelerationJacobian<double> acceleration_;
  InnovationJacobian<double> innovation_;
  MassJacobian<double> mass_;
  RowMatrixX<double> by_theta_, by_r_, by_tau_;
};

}  // namespace kalmarm
