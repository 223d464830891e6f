// Jacobians of the residuals of an identification, against differences and dual numbers.
#include <cmath>
#include <limits>

#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/study/derivatives/acceleration_jacobian.hpp"
#include "algorithms/study/derivatives/factor_direction.hpp"
#include "algorithms/study/derivatives/innovation_jacobian.hpp"
#include "algorithms/study/derivatives/log_D_jacobian.hpp"
#include "algorithms/study/derivatives/mass_jacobian.hpp"
#include "algorithms/study/derivatives/regressor.hpp"
#include "algorithms/study/derivatives/test/support.hpp"

namespace kalmarm::test {
namespace {

using Matrix = RowMatrixX<double>;

template <class T>
VectorX<T> torque(const Mechanism<T>& m) {
  InverseDynamics<T> ws(m.model);
  VectorX<T> tau(m.model.nv());
  inverse_dynamics(m.model, m.kin, m.qdd, ws, Eigen::Ref<VectorX<T>>(tau));
  return tau;
}

template <class T>
VectorX<T> mass_triangle(const Mechanism<T>& m) {
  const int nv = m.model.nv();
  CompositeInertia<T> ws(m.model);
  MatrixX<T> M(nv, nv);
  mass_matrix(m.model, m.kin, ws, Eigen::Ref<MatrixX<T>>(M));
  VectorX<T> out(lower_triangle_size(nv));
  for (int i = 0; i < nv; ++i)
    for (int j = 0; j <= i; ++j) out[lower_triangle_row(i, j)] = M(i, j);
  return out;
}

struct Residuals {
  template <class T>
  Quantities<T> operator()(const Mechanism<T>& m) const {
    Innovations<T> ws(m.model);
    VectorX<T> w(m.model.nv());
    innovations(m.model, m.kin, m.ws.factors, m.qdd, m.tau, ws, w);
    using std::log;
    VectorX<T> log_D(m.model.nv());
    for (int k = 0; k < m.model.nv(); ++k) log_D[k] = log(m.ws.factors.D[k]);
    return {{"ID", torque(m)}, {"a", m.a}, {"w", w}, {"M", mass_triangle(m)}, {"log D", log_D}};
  }
};

// Filled with NaN, so that what is not written shows.
Matrix unwritten(int rows, int cols) {
  return Matrix::Constant(rows, cols, std::numeric_limits<double>::quiet_NaN());
}

struct Jacobian {
  Matrix by_theta, by_r, by_tau;

  Jacobian(int rows, int nv)
      : by_theta(unwritten(rows, body_parameters * nv)),
        by_r(unwritten(rows, nv)),
        by_tau(unwritten(rows, nv)) {}

  VectorX<double> times(const ParameterVector<double>& x) const {
    VectorX<double> theta(by_theta.cols());
    for (int k = 0; k < by_r.cols(); ++k)
      theta.segment<body_parameters>(body_parameters * k) = x.theta[k];
    return by_theta * theta + by_r * x.r + by_tau * x.tau;
  }
};

struct Jacobians {
  Jacobian torque, acceleration, innovation, log_D, mass;

  explicit Jacobians(const Mechanism<double>& m)
      : Jacobians(m, m.model.nv(), lower_triangle_size(m.model.nv())) {
    Regressor<double> regressor_ws(m.model);
    regressor(m.model, m.kin, m.qdd, regressor_ws, torque.by_theta);
    torque.by_r = m.qdd.asDiagonal();
    torque.by_tau.setZero();

    AccelerationJacobian<double> acceleration_ws(m.model);
    acceleration_jacobian(m.model, m.kin, m.ws.factors, m.a, acceleration_ws, acceleration.by_theta,
                          acceleration.by_r, acceleration.by_tau);

    Innovations<double> innovation_ws(m.model);
    VectorX<double> w(m.model.nv());
    innovations(m.model, m.kin, m.ws.factors, m.qdd, m.tau, innovation_ws, w);
    InnovationJacobian<double> jacobian_ws(m.model);
    innovation_jacobian(m.model, m.kin, m.ws.factors, m.qdd, innovation_ws.sweeps.e, jacobian_ws,
                        innovation.by_theta, innovation.by_r, innovation.by_tau);

    log_D_jacobian(m.model, m.kin, m.ws.factors, jacobian_ws, log_D.by_theta, log_D.by_r);
    log_D.by_tau.setZero();

    MassJacobian<double> mass_ws(m.model);
    mass_jacobian(m.model, m.kin, mass_ws, mass.by_theta, mass.by_r);
    mass.by_tau.setZero();
  }

  Quantities<double> times(const ParameterVector<double>& x) const {
    return {{"ID", torque.times(x)},
            {"a", acceleration.times(x)},
            {"w", innovation.times(x)},
            {"log D", log_D.times(x)},
            {"M", mass.times(x)}};
  }

 private:
  Jacobians(const Mechanism<double>&, int nv, int pairs)
      : torque(nv, nv), acceleration(nv, nv), innovation(nv, nv), log_D(nv, nv), mass(pairs, nv) {}
};

Mechanism<double> unshifted(const Case& at) { return {at, ParameterVector<double>(at.model), 0}; }

using JacobiansOf = Derivatives;

TEST_P(JacobiansOf, AgreeWithDifferencesInFiftyDigits) {
  const Jacobians jacobians(unshifted(at_));
  for (int seed = 0; seed < 3; ++seed) {
    const ParameterVector<double> direction = random_direction(at_, seed);
    expect_near(jacobians.times(direction), by_differences(at_, direction, Residuals{}), tolerance);
  }
}

// Each parameter of each body alone; a massless link's would leave it with inertia and no mass.
TEST_P(JacobiansOf, AgreeWithDualNumbersColumnByColumn) {
  const Jacobians jacobians(unshifted(at_));
  const auto check = [&](const ParameterVector<double>& direction) {
    const Quantities<double> columns = jacobians.times(direction);
    const Quantities<double> truth = by_jets(at_, direction, Residuals{});
    const Quantities<double> size = jacobians.times(random_direction(at_, 9));
    for (const auto& [name, value] : truth)
      EXPECT_LE((columns.at(name) - value).norm(),
                jet_tolerance * (value.norm() + size.at(name).norm()))
          << name;
  };
  for (int k = 0; k < at_.model.nv(); ++k) {
    SCOPED_TRACE("link " + std::to_string(k));
    ParameterVector<double> unit(at_.model);
    for (int i = 0; i < body_parameters && !at_.model.inertia(k).massless; ++i) {
      unit.theta[k] = InertialVector<double>::Unit(i);
      check(unit);
    }
    unit.theta[k].setZero();
    unit.r[k] = 1;
    check(unit);
    unit.r[k] = 0;
    unit.tau[k] = 1;
    check(unit);
  }
}

// Those of a and log D, against the filter and the smoother differentiated line by line.
TEST_P(JacobiansOf, AgreeWithTheDerivativesOfTheRecursions) {
  const Mechanism<double> m = unshifted(at_);
  const Jacobians jacobians(m);
  for (int seed = 0; seed < 3; ++seed) {
    const ParameterVector<double> direction = random_direction(at_, seed);
    FactorDirection<double> d(m.model);
    factor_direction(m.model, m.kin, m.ws.factors, m.ws.sweeps, m.a, direction, d);
    const Eigen::Map<const VectorX<double>> D(m.ws.factors.D.data(), m.model.nv());
    expect_near({{"a", jacobians.acceleration.times(direction)},
                 {"log D", jacobians.log_D.times(direction)}},
                {{"a", d.da}, {"log D", d.dD.cwiseQuotient(D)}}, tolerance);
  }
}

// ID = Y theta + diag(r) q'', with inverse dynamics by Newton and Euler about centres of mass.
TEST_P(JacobiansOf, RegressorTimesParametersIsInverseDynamics) {
  const Mechanism<double> m = unshifted(at_);
  ParameterVector<double> all(m.model);
  for (int k = 0; k < m.model.nv(); ++k) {
    all.theta[k] = inertial_parameters(m.model.M(k));
    all.r[k] = m.model.joint(k).r;
  }
  const VectorX<double> tau = torque(m);
  EXPECT_LE((Jacobians(m).torque.times(all) - tau).norm(), 1e-14 * tau.norm());
}

// w'w = Delta' M^-1 Delta, Gauss' principle.
TEST_P(JacobiansOf, InnovationsMeasureTheTorqueResidualByTheInverseMass) {
  const Mechanism<double> m = unshifted(at_);
  const VectorX<double> w = Residuals{}(m).at("w"), Delta = m.tau - torque(m);
  const Matrix& whitening = Jacobians(m).innovation.by_tau;
  EXPECT_LE((whitening * Delta - w).norm(), 1e-13 * w.norm());
  Sweeps<double> sweeps(m.model);
  VectorX<double> x(m.model.nv());
  solve(m.model, m.kin, m.ws.factors, Delta, sweeps, x);
  EXPECT_NEAR(w.squaredNorm(), Delta.dot(x), 1e-13 * w.squaredNorm());
}

INSTANTIATE_TEST_SUITE_P(Families, JacobiansOf, testing::ValuesIn(families()), family_name);

}  // namespace
}  // namespace kalmarm::test
