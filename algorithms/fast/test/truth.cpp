#include "algorithms/fast/test/truth.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>
#include <optional>

#include "algorithms/fast/test/exact.hpp"
#include "algorithms/model/plain.hpp"

namespace kalmarm::test {
namespace {

MatrixX<Mp> jacobian(const Model<Mp>& model, const VectorX<Mp>& q,
                     const std::vector<Frame>& frames) {
  LinkKinematics<Mp> kin(model);
  set_position(model, q, kin);
  std::vector<Site<Mp>> sites;
  for (const Frame& frame : frames) sites.push_back(site_of(frame).cast<Mp>());
  MatrixX<Mp> J(6 * sites.size(), model.nv());
  site_jacobian<Mp>(model, kin, sites, J);
  return J;
}

double worst_entry(const MatrixX<double>& X, const MatrixX<Mp>& exact) {
  double worst = 0;
  for (int j = 0; j < X.cols(); ++j)
    for (int i = 0; i < X.rows(); ++i) {
      const Mp d = abs(Mp(Mp(X(i, j)) - exact(i, j)));
      if (d == 0) continue;
      const Mp size = sqrt(Mp(exact(i, i) * exact(j, j)));
      const double own = (size == 0 ? d : Mp(d / size)).convert_to<double>();
      worst = own <= worst ? worst : own < 1e300 ? own : std::numeric_limits<double>::infinity();
    }
  return worst;
}

// What a mechanism in this state is pushed by beside tau, where it has the accelerations a.
VectorX<Mp> torque(const Model<Mp>& model, const State<Mp>& state, const Push& push,
                   const VectorX<Mp>& a) {
  const World world(model, state.q, state.qd);
  return world.torque(a) - torques_of(push, world, model.nv());
}

}  // namespace

// q moved by h along the velocity of DoF k.
State<Mp> moved(const Model<Mp>& model, State<Mp> state, int k, const Mp& h) {
  int first = k;
  while (model.joint(first).coordinate == Coordinate::follower) --first;
  const int i = model.joint(first).q_index;
  if (model.joint(first).coordinate != Coordinate::quaternion) {
    state.q[i + k - first] += h;
    return state;
  }
  Eigen::Quaternion<Mp> turn(cos(Mp(h / 2)), Mp(0), Mp(0), Mp(0));
  turn.vec()[k - first] = sin(Mp(h / 2));
  const auto& q = state.q;
  const Eigen::Quaternion<Mp> turned =
      Eigen::Quaternion<Mp>(q[i], q[i + 1], q[i + 2], q[i + 3]) * turn;
  state.q.segment<4>(i) << turned.w(), turned.x(), turned.y(), turned.z();
  return state;
}

AccelerationDerivatives<Mp> differences(const Model<Mp>& model, const State<Mp>& state,
                                        const Push& push) {
  const Mp h("1e-17");
  const Exact exact(model, state, push);
  AccelerationDerivatives<Mp> out(model.nv());
  out.a = exact.a;
  out.dtau = exact.inverse();
  const auto difference = [&](const State<Mp>& after, const State<Mp>& before) {
    return VectorX<Mp>((torque(model, after, push, out.a) - torque(model, before, push, out.a)) /
                       (2 * h));
  };
  MatrixX<Mp> dq(model.nv(), model.nv()), dqd = dq;
  for (int k = 0; k < model.nv(); ++k) {
    dq.col(k) = difference(moved(model, state, k, h), moved(model, state, k, -h));
    State<Mp> faster = state, slower = state;
    faster.qd[k] += h;
    slower.qd[k] -= h;
    dqd.col(k) = difference(faster, slower);
  }
  out.dq = -exact.ldlt.solve(dq);
  out.dqd = -exact.ldlt.solve(dqd);
  return out;
}

struct Truth::Impl {
  Model<Mp> model;
  State<Mp> state;
  Exact exact;
  mutable std::optional<MatrixX<Mp>> inverse_of_M;

  Impl(const Model<double>& m, const State<double>& s, const Push& push, const Push& contacts)
      : model(m.cast<Mp>()), state(s.cast<Mp>()), exact(model, state, push, contacts) {}

  const MatrixX<Mp>& inverse() const {
    if (!inverse_of_M) inverse_of_M = exact.inverse();
    return *inverse_of_M;
  }
};

Truth::Truth(const Model<double>& model, const State<double>& state, const Push& push,
             const Push& contacts)
    : impl_(std::make_shared<const Impl>(model, state, push, contacts)) {}

double Truth::acceleration_error(const VectorX<double>& a) const {
  return impl_->exact.error(a.cast<Mp>());
}

double Truth::relative_error(const VectorX<double>& a) const {
  const Mp error = (a.cast<Mp>() - impl_->exact.a).norm() / impl_->exact.a.norm();
  const double rounded = error.convert_to<double>();
  return std::isfinite(rounded) ? rounded : std::numeric_limits<double>::infinity();
}

double Truth::energy_error(const VectorX<double>& a) const {
  const Exact& exact = impl_->exact;
  const VectorX<Mp> d = a.cast<Mp>() - exact.a;
  const Mp squares = d.dot(exact.M * d) / exact.a.dot(exact.M * exact.a);
  const double rounded = Mp(sqrt(squares)).convert_to<double>();
  return std::isfinite(rounded) ? rounded : std::numeric_limits<double>::infinity();
}

double Truth::torque_error(const VectorX<double>& tau) const {
  return ExactTorque(impl_->exact, impl_->state.tau).error(tau.cast<Mp>());
}

VectorX<double> Truth::solution() const {
  return impl_->exact.ldlt.solve(impl_->state.tau).template cast<double>();
}

double Truth::solution_error(const VectorX<double>& x) const {
  const VectorX<Mp> exact = impl_->exact.ldlt.solve(impl_->state.tau), d = x.cast<Mp>() - exact;
  return Mp(sqrt(Mp(d.dot(impl_->exact.M * d) / exact.dot(impl_->state.tau)))).convert_to<double>();
}

double Truth::mass_error(const MatrixX<double>& M) const { return worst_entry(M, impl_->exact.M); }

double Truth::inverse_error(const MatrixX<double>& X) const {
  return worst_entry(X, impl_->inverse());
}

double Truth::selected_error(const Selection& selection, const MatrixX<double>& X) const {
  const MatrixX<Mp> J = jacobian(impl_->model, impl_->state.q, selection.frames);
  MatrixX<Mp> B = MatrixX<Mp>::Zero(impl_->model.nv(), selection.size());
  for (int i = 0; i < static_cast<int>(selection.dofs.size()); ++i) B(selection.dofs[i], i) = 1;
  B.rightCols(J.rows()) = J.transpose();
  return worst_entry(X, MatrixX<Mp>(B.transpose() * impl_->exact.ldlt.solve(B)));
}

double Truth::diagonal_error(const VectorX<double>& x) const {
  double worst = 0;
  for (int k = 0; k < x.size(); ++k) {
    const double own = Mp(abs(Mp(Mp(x[k]) / impl_->inverse()(k, k) - 1))).convert_to<double>();
    worst = own <= worst ? worst : own < 1e300 ? own : std::numeric_limits<double>::infinity();
  }
  return worst;
}

double Truth::log_det(double x) const {
  Mp exact = 0;
  for (const Mp& D : impl_->exact.ldlt.vectorD()) exact += log(D);
  return Mp(abs(Mp(Mp(x) - exact))).convert_to<double>();
}

double Truth::log_det_size() const {
  const VectorX<Mp> D = Eigen::LLT<MatrixX<Mp>>(impl_->exact.M).matrixLLT().diagonal();
  Mp size = 1;
  for (const Mp& d : D) size += abs(Mp(2 * log(d)));
  return size.convert_to<double>();
}

MatrixX<double> Truth::M() const { return impl_->exact.M.cast<double>(); }

Energies energies(const Model<double>& model, const State<double>& state) {
  const Model<Mp> wide = model.cast<Mp>();
  const World world(wide, state.q.cast<Mp>(), state.qd.cast<Mp>());
  return {world.kinetic_energy().convert_to<double>(),
          world.potential_energy().convert_to<double>()};
}

VectorX<double> innovation_covariances(const Model<double>& model, const VectorX<double>& q) {
  const Model<Mp> exact = model.cast<Mp>();
  MatrixX<Mp> M = World(exact, q.cast<Mp>(), VectorX<Mp>::Zero(model.nv())).mass_matrix();
  VectorX<double> D(model.nv());
  for (int k = model.nv() - 1; k >= 0; --k) {  // tips to base: what is left of M without k
    D[k] = M(k, k).convert_to<double>();
    const VectorX<Mp> column = M.col(k).head(k);
    M.topLeftCorner(k, k) -= column * (column / M(k, k)).transpose();
  }
  return D;
}

DenseMechanics dense_mechanics(const Model<double>& model, const State<double>& state) {
  const Model<Mp> wide = model.cast<Mp>();
  const World world(wide, state.q.cast<Mp>(), state.qd.cast<Mp>());
  return {world.mass_matrix().cast<double>(), world.bias().cast<double>()};
}

MatrixX<double> frame_jacobian(const Model<double>& model, const VectorX<double>& q,
                               const std::vector<Frame>& frames) {
  return jacobian(model.cast<Mp>(), q.cast<Mp>(), frames).cast<double>();
}

struct TrueDerivatives::Impl {
  AccelerationDerivatives<Mp> truth;
};

TrueDerivatives::TrueDerivatives(const Model<double>& model, const State<double>& state,
                                 const Push& push)
    : impl_(std::make_shared<const Impl>(
          Impl{differences(model.cast<Mp>(), state.cast<Mp>(), push)})) {}

double TrueDerivatives::error(const AccelerationDerivatives<double>& x) const {
  return test::error(x.cast<Mp>(), impl_->truth);
}

AccelerationDerivatives<double> TrueDerivatives::rounded() const {
  return impl_->truth.cast<double>();
}

double TrueDerivatives::condition() const {
  const MatrixX<Mp>& inverse = impl_->truth.dtau;
  const VectorX<Mp> scale = inverse.diagonal().cwiseSqrt().cwiseInverse();
  const MatrixX<double> scaled = (scale.asDiagonal() * inverse * scale.asDiagonal()).cast<double>();
  const VectorX<double> lambda =
      Eigen::SelfAdjointEigenSolver<MatrixX<double>>(scaled).eigenvalues();
  return lambda.maxCoeff() / lambda.minCoeff();
}

}  // namespace kalmarm::test
