// One mechanism in one state, with all that the checks of the paper compare: the literal operators,
// the recursions, and the truth by another route.
//
// Truth is
//   the world    M and the bias torque by ordinary mechanics in world axes (world_frame.hpp)
//   the motion   at the true a = M^-1 (tau - bias): accelerations and spatial forces of every link
//                by Newton and Euler (inverse_dynamics.hpp)
//   UDU          M = U D U', U unit upper triangular, by elimination: unique, so K and D must be it
//   sigma        second moments of the random process without sampling error: for W(k) = M^1/2 the
//                columns of diag W(k), and of sqrt(r), are sent one by one through process, filter
//                and smoother; the sum of outer products is the covariance
#pragma once

#include <Eigen/Cholesky>
#include <cmath>

#include "accuracy/real.hpp"
#include "accuracy/world_frame.hpp"
#include "algorithms/estimation/batch_estimate.hpp"
#include "algorithms/estimation/filter_smoother.hpp"
#include "algorithms/model/inverse_dynamics.hpp"

namespace kalmarm {

// What the sigma points become, one a column; all have mean zero.
template <class T>
struct SigmaPoints {
  MatrixX<T> W, X, tau;        // input, state, measurement
  MatrixX<T> Z_minus, Z_plus;  // filtered state
  MatrixX<T> e_minus;          // innovations
  MatrixX<T> l_plus, l_minus;  // co-states
  MatrixX<T> W_mean, X_mean;   // conditional means

  SigmaPoints(const Process<T>& process, const Covariances<T>& cov) {
    using std::sqrt;
    const int n = process.size(), count = 7 * n;
    for (MatrixX<T>* x : {&W, &X, &Z_minus, &Z_plus, &l_plus, &l_minus, &W_mean, &X_mean})
      *x = MatrixX<T>::Zero(6 * n, count);
    for (MatrixX<T>* x : {&tau, &e_minus}) *x = MatrixX<T>::Zero(n, count);
    Process<T> centred = process;
    for (Vector6<T>& b : centred.b) b.setZero();
    FilterSmoother<T> fs(centred);
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < 7; ++i) {
        const int point = 7 * j + i;
        if (i < 6) W.col(point).template segment<6>(6 * j) = process.W[j].col(i);
        auto x = X.col(point);
        x = W.col(point);
        for (int k = n - 1; k >= 0; --k) {
          const Vector6<T> force = x.template segment<6>(6 * k);
          tau(k, point) = process.H[k].dot(force);  // (1.4)
          if (const int parent = process.parent[k]; parent >= 0)
            x.template segment<6>(6 * parent) += process.phi[k] * force;  // (1.1)
        }
        if (i == 6) tau(j, point) += sqrt(process.r[j]);
        filter(centred, cov, VectorX<T>(tau.col(point)), fs);
        smooth(centred, cov, fs);
        set_conditional_means(centred, fs);
        Z_minus.col(point) = stacked(fs.z_minus);
        Z_plus.col(point) = stacked(fs.z_plus);
        e_minus.col(point) = fs.e_minus;
        l_plus.col(point) = stacked(fs.l_plus);
        l_minus.col(point) = stacked(fs.l_minus);
        W_mean.col(point) = stacked(fs.w_mean);
        X_mean.col(point) = stacked(fs.x_mean);
      }
    }
  }

  static VectorX<T> stacked(const std::vector<Vector6<T>>& x) {
    VectorX<T> out(6 * x.size());
    for (std::size_t k = 0; k < x.size(); ++k) out.template segment<6>(6 * k) = x[k];
    return out;
  }
};

// Unit upper triangular U and diagonal D with M = U diag(D) U'.
template <class T>
void factor_udu(MatrixX<T> M, MatrixX<T>& U, VectorX<T>& D) {
  const Eigen::Index n = M.rows();
  U = MatrixX<T>::Identity(n, n);
  D.resize(n);
  for (Eigen::Index j = n - 1; j >= 0; --j) {
    D[j] = M(j, j);
    U.col(j).head(j) = M.col(j).head(j) / D[j];
    M.topLeftCorner(j, j) -= U.col(j).head(j) * D[j] * U.col(j).head(j).transpose();
  }
}

template <class T>
struct Setting {
  Model<T> model;
  RandomModel<T> rm;
  Process<T> process;
  VectorX<T> q, qd, tau;

  Operators<T> op;
  BatchEstimate<T> batch;

  Covariances<T> cov;
  FilterSmoother<T> fs;
  ClosedLoop<T> loop;
  SigmaPoints<T> sigma;

  // truth
  MatrixX<T> M, X;              // mass matrix and its inverse
  VectorX<T> bias, a;           // bias torque; acceleration
  VectorX<T> force, net_force;  // of every link at a: across its joint; M a + b of it alone
  VectorX<T> l_minus;           // spatial accelerations of every link, less those at q'' = 0
  MatrixX<T> U;                 // of M = U D U'
  VectorX<T> D;

  // A model in T's working precision and a state. The process must be without flaw, with at most
  // largest_dense joints, and not singular.
  Setting(const Model<T>& parameters, const VectorX<T>& position, const VectorX<T>& velocity,
          const VectorX<T>& torque)
      : model(parameters),
        rm(at(model, position, velocity)),
        process(model, rm),
        q(position),
        qd(velocity),
        tau(torque),
        op(process),
        batch(op, tau),
        cov(filtered(process)),
        fs(smoothed(process, cov, tau)),
        loop(process, op, cov),
        sigma(process, cov) {
    const WorldFrame world =
        world_frame(model.template cast<Real>(), q.template cast<Real>(), qd.template cast<Real>());
    M = world.M.template cast<T>();
    bias = world.bias.template cast<T>();
    const MatrixX<Real> inverse =
        world.M.llt().solve(MatrixX<Real>::Identity(world.M.rows(), world.M.cols()));
    X = inverse.template cast<T>();
    a = VectorX<Real>(inverse * (tau.template cast<Real>() - world.bias)).template cast<T>();
    factor_udu<T>(M, U, D);

    InverseDynamics<T> rest(model), motion(model);
    VectorX<T> out(model.nv());
    inverse_dynamics(model, rm, VectorX<T>(VectorX<T>::Zero(model.nv())), rest,
                     Eigen::Ref<VectorX<T>>(out));
    inverse_dynamics(model, rm, a, motion, Eigen::Ref<VectorX<T>>(out));
    force = SigmaPoints<T>::stacked(motion.z);
    l_minus = SigmaPoints<T>::stacked(motion.a) - SigmaPoints<T>::stacked(rest.a);
    net_force.resize(6 * model.nv());
    for (int k = 0; k < model.nv(); ++k)
      net_force.template segment<6>(6 * k) = model.M(k) * motion.a[k] + rm.b[k];
  }

  int n() const { return process.size(); }
  MatrixX<T> identity() const { return MatrixX<T>::Identity(n(), n()); }
  MatrixX<T> identity6() const { return MatrixX<T>::Identity(6 * n(), 6 * n()); }

 private:
  static RandomModel<T> at(const Model<T>& model, const VectorX<T>& q, const VectorX<T>& qd) {
    RandomModel<T> rm(model);
    set_position(model, q, rm);
    set_velocity(model, qd, rm);
    return rm;
  }

  static Covariances<T> filtered(const Process<T>& process) {
    Covariances<T> cov(process);
    [[maybe_unused]] const Outcome outcome = set_state_covariances(process, cov);
    assert(outcome);
    set_co_state_covariances(process, cov);
    return cov;
  }

  static FilterSmoother<T> smoothed(const Process<T>& process, const Covariances<T>& cov,
                                    const VectorX<T>& tau) {
    FilterSmoother<T> fs(process);
    filter(process, cov, tau, fs);
    smooth(process, cov, fs);
    set_conditional_means(process, fs);
    return fs;
  }
};

}  // namespace kalmarm
