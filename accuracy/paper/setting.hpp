// One mechanism in one state, with all that the checks of the paper compare: the literal operators,
// the recursions, and the truth by another route.
//
// Truth is
//   the world    M and the bias torque by ordinary mechanics in world axes (world_mechanics.hpp)
//   the motion   at the true a = M^-1 (tau - bias): accelerations and spatial forces of every link
//                by Newton and Euler (inverse_dynamics.hpp)
//   UDU          M = U D U' by elimination: unique, so K and D must be it (udu.hpp)
//   sigma        second moments of the random process without sampling error: for W(k) = M^1/2 the
//                columns of diag W(k), and of sqrt(r), are sent one by one through process, filter
//                and smoother; the sum of outer products is the covariance
#pragma once

#include <Eigen/Cholesky>
#include <cmath>
#include <optional>

#include "accuracy/measures/real.hpp"
#include "accuracy/truth/udu.hpp"
#include "accuracy/truth/world_mechanics.hpp"
#include "algorithms/model/inverse_dynamics.hpp"
#include "algorithms/study/estimation/batch_estimate.hpp"
#include "algorithms/study/estimation/simulation.hpp"

namespace kalmarm {

// The vectors of all links, link after link.
template <class T>
VectorX<T> stacked(const std::vector<Vector6<T>>& x) {
  VectorX<T> out(6 * x.size());
  for (std::size_t k = 0; k < x.size(); ++k) out.template segment<6>(6 * k) = x[k];
  return out;
}

// What the sigma points (simulation.hpp) become, one a column; all have mean zero.
template <class T>
struct SigmaPoints {
  MatrixX<T> W, X, tau;        // input, state, measurement
  MatrixX<T> Z_minus, Z_plus;  // filtered state
  MatrixX<T> e_minus;          // innovations
  MatrixX<T> l_plus, l_minus;  // co-states
  MatrixX<T> W_mean, X_mean;   // conditional means

  SigmaPoints(const Process<T>& process, const Covariances<T>& cov) {
    const Simulation<T> simulation(process, cov);
    const int n = process.size(), count = simulation.dimension;
    for (MatrixX<T>* x : {&W, &X, &Z_minus, &Z_plus, &l_plus, &l_minus, &W_mean, &X_mean})
      x->resize(6 * n, count);
    for (MatrixX<T>* x : {&tau, &e_minus}) x->resize(n, count);
    Sample<T> sample(simulation);
    FilterSmoother<T>& fs = sample.estimate;
    for (int j = 0; j < count; ++j) {
      const VectorX<T> point = VectorX<T>::Unit(count, j);
      simulate(simulation, point, sample);
      filter(simulation.process, cov, sample.tau, fs);
      smooth(simulation.process, cov, fs);
      set_conditional_means(simulation.process, fs);
      for (int k = 0; k < n; ++k)
        W.col(j).template segment<6>(6 * k) = process.W[k] * point.template segment<6>(6 * k);
      X.col(j) = stacked(sample.x);
      tau.col(j) = sample.tau;
      Z_minus.col(j) = stacked(fs.z_minus);
      Z_plus.col(j) = stacked(fs.z_plus);
      e_minus.col(j) = fs.e_minus;
      l_plus.col(j) = stacked(fs.l_plus);
      l_minus.col(j) = stacked(fs.l_minus);
      W_mean.col(j) = stacked(fs.w_mean);
      X_mean.col(j) = stacked(fs.x_mean);
    }
  }
};

template <class T>
struct Setting {
  Model<T> model;
  LinkKinematics<T> kin;
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
  std::optional<UDU<T>> udu;    // of M

  // A model in T's working precision and a state. The process must be without flaw, with at most
  // largest_dense joints, and not singular.
  Setting(const Model<T>& parameters, const VectorX<T>& position, const VectorX<T>& velocity,
          const VectorX<T>& torque)
      : model(parameters),
        kin(at(model, position, velocity)),
        process(model, kin),
        q(position),
        qd(velocity),
        tau(torque),
        op(process),
        batch(op, tau),
        cov(filtered(process)),
        fs(smoothed(process, cov, tau)),
        loop(process, op, cov),
        sigma(process, cov) {
    const Model<Real> exact = model.template cast<Real>();
    const WorldMechanics<Real> world(exact, q.template cast<Real>());
    const VectorX<Real> zero = VectorX<Real>::Zero(model.nv());
    const VectorX<Real> exact_bias = world.torque(qd.template cast<Real>(), zero, exact.gravity());
    const MatrixX<Real> exact_M = world.mass();
    M = exact_M.template cast<T>();
    bias = exact_bias.template cast<T>();
    const MatrixX<Real> inverse =
        exact_M.llt().solve(MatrixX<Real>::Identity(exact_M.rows(), exact_M.cols()));
    X = inverse.template cast<T>();
    a = VectorX<Real>(inverse * (tau.template cast<Real>() - exact_bias)).template cast<T>();
    udu.emplace(M);

    InverseDynamics<T> rest(model), motion(model);
    VectorX<T> out(model.nv());
    inverse_dynamics(model, kin, VectorX<T>(VectorX<T>::Zero(model.nv())), rest,
                     Eigen::Ref<VectorX<T>>(out));
    inverse_dynamics(model, kin, a, motion, Eigen::Ref<VectorX<T>>(out));
    force = stacked(motion.z);
    l_minus = stacked(motion.a) - stacked(rest.a);
    net_force.resize(6 * model.nv());
    for (int k = 0; k < model.nv(); ++k)
      net_force.template segment<6>(6 * k) = model.M(k) * motion.a[k] + kin.b[k];
  }

  int n() const { return process.size(); }
  MatrixX<T> identity() const { return MatrixX<T>::Identity(n(), n()); }
  MatrixX<T> identity6() const { return MatrixX<T>::Identity(6 * n(), 6 * n()); }

 private:
  static LinkKinematics<T> at(const Model<T>& model, const VectorX<T>& q, const VectorX<T>& qd) {
    LinkKinematics<T> kin(model);
    set_position(model, q, kin);
    set_velocity(model, qd, kin);
    return kin;
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
