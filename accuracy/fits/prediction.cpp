#include "accuracy/fits/prediction.hpp"

#include <cmath>

#include "algorithms/model/inverse_dynamics.hpp"

namespace kalmarm {

MatrixX<double> torques(const Mechanics<double>& robot, const Samples& samples) {
  const Model<double>& model = robot.model;
  LinkKinematics<double> kin(model);
  InverseDynamics<double> ws(model);
  VectorX<double> tau(model.nv());
  MatrixX<double> out(model.nv(), samples.count());
  for (int i = 0; i < samples.count(); ++i) {
    set_position(model, samples.q.col(i), kin);
    set_velocity(model, samples.qd.col(i), kin);
    inverse_dynamics(model, kin, samples.qdd.col(i), ws, Eigen::Ref<VectorX<double>>(tau));
    for (int k = 0; k < model.nv(); ++k) {
      const double v = samples.qd(k, i);
      out(k, i) = tau[k] + robot.viscous[k] * v + robot.coulomb[k] * coulomb_sign(v);
    }
  }
  return out;
}

VectorX<double> row_sizes(const MatrixX<double>& measured) {
  const VectorX<double> sizes =
      measured.rowwise().norm() / std::sqrt(static_cast<double>(measured.cols()));
  const double largest = sizes.maxCoeff();
  return sizes.cwiseMax(largest > 0 ? 1e-3 * largest : 1.0);
}

TorqueError torque_error(const Mechanics<double>& robot, const Samples& samples) {
  const MatrixX<double> error =
      (torques(robot, samples) - samples.tau).array().colwise() / row_sizes(samples.tau).array();
  TorqueError out;
  out.joints = error.rowwise().norm() / std::sqrt(static_cast<double>(error.cols()));
  out.total = out.joints.norm() / std::sqrt(static_cast<double>(error.rows()));
  return out;
}

Mechanics<double> mechanics_of(const Scene& scene) {
  const JointFriction friction = friction_of(scene);
  return {scene.model, friction.viscous, friction.coulomb};
}

}  // namespace kalmarm
