// Derivatives of the factors and of the sweeps, forward and reverse, against differences, dual
// numbers, each other and the gradient of log det M.
#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/study/derivatives/factor_gradient.hpp"
#include "algorithms/study/derivatives/gain_operators.hpp"
#include "algorithms/study/derivatives/test/support.hpp"

namespace kalmarm::test {
namespace {

template <class T, class Items>
VectorX<T> list(const Items& items) {
  const int size = static_cast<int>(items[0].size());
  VectorX<T> out(static_cast<int>(items.size()) * size);
  for (int k = 0; k < static_cast<int>(items.size()); ++k)
    out.segment(k * size, size) = items[k].reshaped();
  return out;
}

template <class T>
struct Operators {
  MatrixX<T> K, L, dK, dL;

  Operators(const Mechanism<T>& m, const FactorDirection<T>& direction)
      : K(m.model.nv(), m.model.nv()), L(K), dK(K), dL(K) {
    gain_operator(m.model, m.kin, m.ws.factors, direction, Loop::open, K, dK);
    gain_operator(m.model, m.kin, m.ws.factors, direction, Loop::closed, L, dL);
  }
};

// What factor_direction differentiates, from the gains and the sweeps by the recursions' own
// equations.
struct Everything {
  template <class T>
  Quantities<T> operator()(const Mechanism<T>& m) const {
    const int nv = m.model.nv();
    const Gains<T>& gains = m.ws.factors;
    std::vector<Matrix6<T>> P_minus(nv), P_plus = m.ws.factors.update.P;
    std::vector<Vector6<T>> z_minus(nv), z_plus(nv), l_minus(nv), l_plus(nv);
    VectorX<T> D(nv), e_minus(nv), e_plus(nv);
    for (int k = 0; k < nv; ++k) {
      const Vector6<T>& g = gains.g[k];
      D[k] = gains.D[k];
      P_minus[k] = P_plus[k] + D[k] * g * g.transpose();  // P- H' = D g
      e_plus[k] = m.ws.sweeps.e[k];
      e_minus[k] = D[k] * e_plus[k];
      const Vector6<T> step = g * e_minus[k] + P_plus[k] * m.kin.c[k];
      z_minus[k] = m.ws.sweeps.z[k];
      if (m.model.parent(k) >= 0) z_minus[k] -= step;  // the filter stops at the base
      z_plus[k] = z_minus[k] + step;
      l_minus[k] = m.ws.sweeps.l[k];
      l_plus[k] = kalmarm::l_plus(m.model, m.ws.sweeps, m.a, k);
    }
    FactorDirection<T> still(m.model);
    for (Vector6<T>& dg : still.dg) dg.setZero();
    const Operators<T> operators(m, still);
    return {{"P-", list<T>(P_minus)},
            {"P+", list<T>(P_plus)},
            {"D", D},
            {"g", list<T>(gains.g)},
            {"z-", list<T>(z_minus)},
            {"z+", list<T>(z_plus)},
            {"e-", e_minus},
            {"e+", e_plus},
            {"l+", list<T>(l_plus)},
            {"l-", list<T>(l_minus)},
            {"a", m.a},
            {"K", operators.K.reshaped()},
            {"L", operators.L.reshaped()}};
  }
};

class FactorDerivatives : public Derivatives {
 protected:
  Quantities<double> along(const ParameterVector<double>& direction) const {
    FactorDirection<double> d(at_.model);
    factor_direction(m_.model, m_.kin, m_.ws.factors, m_.ws.sweeps, m_.a, direction, d);
    const Operators<double> operators(m_, d);
    return {{"P-", list<double>(d.dP_minus)},
            {"P+", list<double>(d.dP_plus)},
            {"D", d.dD},
            {"g", list<double>(d.dg)},
            {"z-", list<double>(d.dz_minus)},
            {"z+", list<double>(d.dz_plus)},
            {"e-", d.de_minus},
            {"e+", d.de_plus},
            {"l+", list<double>(d.dl_plus)},
            {"l-", list<double>(d.dl_minus)},
            {"a", d.da},
            {"K", operators.dK.reshaped()},
            {"L", operators.dL.reshaped()}};
  }

  ParameterVector<double> gradient(const FactorAdjoint<double>& adjoint) const {
    FactorGradient<double> ws(at_.model);
    ParameterVector<double> out(at_.model);
    factor_gradient(m_.model, m_.kin, m_.ws.factors, m_.ws.sweeps, m_.a, adjoint, ws, out);
    return out;
  }

  const Mechanism<double> m_{at_, ParameterVector<double>(at_.model), 0};
};

TEST_P(FactorDerivatives, AgreeWithDifferencesInFiftyDigits) {
  for (int seed = 0; seed < 3; ++seed) {
    const ParameterVector<double> direction = random_direction(at_, seed);
    expect_near(along(direction), by_differences(at_, direction, Everything{}), tolerance);
  }
}

TEST_P(FactorDerivatives, AgreeWithDualNumbers) {
  for (int seed = 0; seed < 3; ++seed) {
    ParameterVector<double> direction = random_direction(at_, seed);
    for (int k = 0; k < at_.model.nv(); ++k)
      if (at_.model.inertia(k).massless) direction.theta[k].setZero();
    expect_near(along(direction), by_jets(at_, direction, Everything{}), jet_tolerance);
  }
}

// <f-bar, df> = <gradient, direction> for any f-bar and any direction.
TEST_P(FactorDerivatives, ReverseModeIsTheAdjointOfForwardMode) {
  const int nv = at_.model.nv();
  for (int seed = 0; seed < 5; ++seed) {
    Random random(seed);
    FactorAdjoint<double> adjoint(at_.model);
    adjoint.D = random.vector(nv);
    adjoint.e_minus = random.vector(nv);
    adjoint.a = random.vector(nv);
    for (Vector6<double>& g : adjoint.g) g = random.vector(6);
    const ParameterVector<double> direction = random_direction(at_, 100 + seed);
    const ParameterVector<double> grad = gradient(adjoint);
    const Quantities<double> d = along(direction);
    double size = 0;
    const auto inner = [&](const VectorX<double>& x, const VectorX<double>& y) {
      size += x.norm() * y.norm();
      return x.dot(y);
    };
    const double forward = inner(adjoint.D, d.at("D")) + inner(adjoint.e_minus, d.at("e-")) +
                           inner(adjoint.a, d.at("a")) + inner(list<double>(adjoint.g), d.at("g"));
    const double reverse = inner(list<double>(grad.theta), list<double>(direction.theta)) +
                           inner(grad.r, direction.r) + inner(grad.tau, direction.tau);
    EXPECT_NEAR(forward, reverse, 1e-13 * size);
  }
}

// d log det M = sum of dD / D; its gradient is L- of (5.6).
TEST_P(FactorDerivatives, GradientOfLogDetIsTheCoStateCovariance) {
  const Process<double> process(m_.model, m_.kin);
  Covariances<double> cov(process);
  ASSERT_TRUE(set_state_covariances(process, cov));
  set_co_state_covariances(process, cov);
  const LogDetGradient<double> truth = log_det_gradient(cov);
  FactorAdjoint<double> adjoint(at_.model);
  for (int k = 0; k < at_.model.nv(); ++k) adjoint.D[k] = 1 / m_.ws.factors.D[k];
  const ParameterVector<double> grad = gradient(adjoint);
  for (int k = 0; k < at_.model.nv(); ++k) {
    EXPECT_LE((grad.theta[k] - truth.inertia[k]).norm(), 1e-11 * truth.inertia[k].norm());
    EXPECT_NEAR(grad.r[k], truth.r[k], 1e-11 * truth.r[k]);
    EXPECT_EQ(grad.tau[k], 0);
  }
}

// M = (I + K) D (I + K*) and (I + K)(I - L) = I, (3.3).
TEST_P(FactorDerivatives, OperatorsFactorTheMassMatrixAndInvertEachOther) {
  FactorDirection<double> d(at_.model);
  factor_direction(m_.model, m_.kin, m_.ws.factors, m_.ws.sweeps, m_.a, random_direction(at_, 1),
                   d);
  const Operators<double> operators(m_, d);
  const int nv = at_.model.nv();
  const MatrixX<double> I = MatrixX<double>::Identity(nv, nv);
  const MatrixX<double> I_plus_K = I + operators.K, I_minus_L = I - operators.L;
  EXPECT_LE((I_plus_K * I_minus_L - I).norm(), 1e-14 * I_plus_K.norm() * I_minus_L.norm());
  const Eigen::Map<const VectorX<double>> D(m_.ws.factors.D.data(), nv);
  CompositeInertia<double> composite(m_.model);
  MatrixX<double> M(nv, nv);
  mass_matrix(m_.model, m_.kin, composite, Eigen::Ref<MatrixX<double>>(M));
  EXPECT_LE((I_plus_K * D.asDiagonal() * I_plus_K.transpose() - M).norm(), 1e-13 * M.norm());
}

INSTANTIATE_TEST_SUITE_P(Families, FactorDerivatives, testing::ValuesIn(families()), family_name);

}  // namespace
}  // namespace kalmarm::test
