// What a fit drives to zero, a sample (q, q', q'', tau) at a time, as templates that run in double
// and in Jets:
//
//   inverse_dynamics   (tau - ID(q, q', q'') - friction) / scale                        (2.1)
//   forward_dynamics   (q'' - M^-1 (tau - friction - bias)) / scale                     (3.3)
//   innovations        w = D^-1/2 (I - L) (tau - ID - friction), w'w = Delta' M^-1 Delta: Gauss'
//                      principle
//   mass_matrix        (M_ij - M(q)_ij) / sqrt(M_ii M_jj), i >= j, where M was measured
//   likelihood         w and sigma sqrt(log D(k) + C): half their square is sigma^2 times the
//                      negative log-likelihood of tau ~ N(ID, sigma^2 M), but for constants. w'w
//                      alone, whose weight M^-1 is fitted along, would favour heavy robots
// A scale is the root mean square of the measured torque or acceleration of the DoF.
#pragma once

#include <string>
#include <vector>

#include "accuracy/fits/parameters.hpp"
#include "accuracy/fits/samples.hpp"
#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/study/derivatives/fit_filter.hpp"
#include "algorithms/study/derivatives/innovation_jacobian.hpp"
#include "algorithms/study/derivatives/mass_jacobian.hpp"
#include "algorithms/study/inverse_mass/sequential.hpp"

namespace kalmarm {

enum class Residual { inverse_dynamics, forward_dynamics, innovations, mass_matrix, likelihood };

// Linear in the columns of parameters.hpp.
constexpr bool is_linear(Residual kind) {
  return kind == Residual::inverse_dynamics || kind == Residual::mass_matrix;
}

struct ResidualOptions {
  Residual kind = Residual::inverse_dynamics;
  VectorX<double> scale;   // nv: of torques, accelerations, or sqrt(M_ii)
  double sigma = 0;        // of the likelihood
  double log_D_shift = 0;  // C: log D + C stays positive
};

// Residuals of a sample that its data make, and all of them.
inline int data_rows(Residual kind, int nv) {
  return kind == Residual::mass_matrix ? lower_triangle_size(nv) : nv;
}
inline int rows(Residual kind, int nv) {
  return kind == Residual::likelihood ? 2 * nv : data_rows(kind, nv);
}

// Residuals of one sample after the other, in precision T.
template <class T>
class SampleResidual {
 public:
  SampleResidual(const Model<double>& model, const ResidualOptions& options)
      : options_(options),
        kin_(model.cast<T>()),
        composite_(model.cast<T>()),
        filter_(model.cast<T>()),
        innovations_(model.cast<T>()),
        q_(model.nq()),
        qd_(model.nv()),
        qdd_(model.nv()),
        tau_(model.nv()),
        a_(model.nv()),
        M_(options.kind == Residual::mass_matrix ? model.nv() : 0,
           options.kind == Residual::mass_matrix ? model.nv() : 0) {}

  // Writes rows(kind, nv) numbers. False where M is singular.
  bool evaluate(const Mechanics<T>& robot, const Samples& samples, int i, T* out) {
    using std::log;
    using std::sqrt;
    const Model<T>& model = robot.model;
    const int nv = model.nv();
    q_ = samples.q.col(i).template cast<T>();
    set_position(model, q_, kin_);
    if (options_.kind == Residual::mass_matrix) {
      mass_matrix(model, kin_, composite_, Eigen::Ref<MatrixX<T>>(M_));
      for (int row = 0; row < nv; ++row)
        for (int col = 0; col <= row; ++col) {
          const double scale = options_.scale[row] * options_.scale[col];
          *out++ = (samples.mass(lower_triangle_row(row, col), i) - M_(row, col)) / scale;
        }
      return true;
    }
    qd_ = samples.qd.col(i).template cast<T>();
    qdd_ = samples.qdd.col(i).template cast<T>();
    set_velocity(model, qd_, kin_);
    for (int k = 0; k < nv; ++k) {
      const double v = samples.qd(k, i);
      tau_[k] = samples.tau(k, i) - robot.viscous[k] * v - robot.coulomb[k] * coulomb_sign(v);
    }
    if (options_.kind == Residual::forward_dynamics) {
      if (!filter_.factor(model, kin_)) return false;
      Sequential<Conventional>::acceleration(model, kin_, tau_, filter_, a_);
      for (int k = 0; k < nv; ++k) out[k] = (samples.qdd(k, i) - a_[k]) / options_.scale[k];
      return true;
    }
    if (options_.kind == Residual::inverse_dynamics) {
      inverse_dynamics(model, kin_, qdd_, innovations_.newton_euler, Eigen::Ref<VectorX<T>>(a_));
      for (int k = 0; k < nv; ++k) out[k] = (tau_[k] - a_[k]) / options_.scale[k];
      return true;
    }
    if (!filter_.factor(model, kin_)) return false;
    innovations(model, kin_, filter_.factors, qdd_, tau_, innovations_, Eigen::Ref<VectorX<T>>(a_));
    for (int k = 0; k < nv; ++k) out[k] = a_[k];
    if (options_.kind == Residual::likelihood)
      for (int k = 0; k < nv; ++k)
        out[nv + k] = options_.sigma * sqrt(log(filter_.factors.D[k]) + options_.log_D_shift);
    return true;
  }

  // Of the last sample.
  const LinkKinematics<T>& random_model() const { return kin_; }
  const Gains<T>& gains() const { return filter_.factors; }
  const VectorX<T>& acceleration() const { return a_; }                   // forward_dynamics
  const std::vector<T>& e_plus() const { return innovations_.sweeps.e; }  // innovations

 private:
  ResidualOptions options_;
  LinkKinematics<T> kin_;
  CompositeInertia<T> composite_;
  FitFilter<T> filter_;
  Innovations<T> innovations_;
  VectorX<T> q_, qd_, qdd_, tau_, a_;
  MatrixX<T> M_;
};

// The options that depend on the samples: scales, and C of the likelihood.
ResidualOptions residual_options(Residual kind, const Mechanics<double>& robot,
                                 const Samples& samples);

}  // namespace kalmarm
