// The paper's recursions against its literal operators, the library's kernels and mechanics in
// world axes, in every precision and on every kind of mechanism.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <limits>
#include <string>

#include "algorithms/study/derivatives/log_det.hpp"
#include "algorithms/study/estimation/batch_estimate.hpp"
#include "algorithms/study/estimation/filter_smoother.hpp"
#include "algorithms/study/inverse_mass/sequential.hpp"
#include "algorithms/study/riccati/conventional.hpp"
#include "algorithms/test/dense_mechanics.hpp"
#include "algorithms/test/models.hpp"

namespace kalmarm::test {
namespace {

template <class T>
double distance(const MatrixX<T>& a, const MatrixX<T>& b) {
  return static_cast<double>((a - b).norm() / b.norm());
}

template <class T>
VectorX<T> stacked(const std::vector<Vector6<T>>& x) {
  VectorX<T> out(6 * x.size());
  for (std::size_t k = 0; k < x.size(); ++k) out.template segment<6>(6 * k) = x[k];
  return out;
}

// A process with everything that recursion and operators make of it.
template <class T>
struct Estimation {
  Model<T> model;
  State<T> state;
  LinkKinematics<T> kin;
  Process<T> process;
  Covariances<T> cov;
  FilterSmoother<T> fs;

  Estimation(const Model<double>& parameters, std::uint64_t seed)
      : model(parameters.cast<T>()),
        state(random_state(parameters, seed).template cast<T>()),
        kin(model),
        process(at(model, state, kin)),
        cov(process),
        fs(process) {
    EXPECT_FALSE(find_flaw(process));
    EXPECT_TRUE(set_state_covariances(process, cov));
    set_co_state_covariances(process, cov);
    filter(process, cov, state.tau, fs);
    smooth(process, cov, fs);
    set_conditional_means(process, fs);
  }

  static Process<T> at(const Model<T>& model, const State<T>& state, LinkKinematics<T>& kin) {
    set_position(model, state.q, kin);
    set_velocity(model, state.qd, kin);
    return Process<T>(model, kin);
  }
};

template <class T>
class EveryPrecision : public testing::Test {
 protected:
  // Conditions of the families are up to 1e5; T's own rounding is the rest.
  static constexpr double bound = std::is_same_v<T, float>    ? 2e-3
                                  : std::is_same_v<T, double> ? 1e-11
                                                              : 1e-42;

  static void for_each_family(void (*check)(const Estimation<T>&)) {
    for (const Family& family : families()) {
      SCOPED_TRACE(family.name);
      check(Estimation<T>(family.make(61), 62));
    }
  }
};

using Precisions = testing::Types<float, double, Mp>;
using MachinePrecisions = testing::Types<float, double>;

struct PrecisionName {
  template <class T>
  static std::string GetName(int) {
    return std::is_same_v<T, float> ? "float32" : std::is_same_v<T, double> ? "float64" : "mp";
  }
};

TYPED_TEST_SUITE(EveryPrecision, Precisions, PrecisionName);

TYPED_TEST(EveryPrecision, SmootherGivesTheAccelerationOfMechanics) {
  using T = TypeParam;
  this->for_each_family([](const Estimation<T>& e) {
    const Model<Mp> model = e.model.template cast<Mp>();
    const World world(model, e.state.q.template cast<Mp>(), e.state.qd.template cast<Mp>());
    const VectorX<Mp> torque = e.state.tau.template cast<Mp>() - world.bias();
    const MatrixX<Mp> a = world.mass_matrix().llt().solve(torque);
    EXPECT_LE(distance<Mp>(e.fs.a.template cast<Mp>(), a), EveryPrecision<T>::bound);
  });
}

TYPED_TEST(EveryPrecision, PaperAndLibraryHaveTheSameFactors) {  // D and g of riccati/
  using T = TypeParam;
  this->for_each_family([](const Estimation<T>& e) {
    using std::abs;
    Factors<T, Conventional> f(e.model);
    ASSERT_TRUE(factor(e.model, e.kin, f));
    for (int k = 0; k < e.process.size(); ++k) {
      EXPECT_LE(abs(f.D[k] / e.cov.D[k] - T(1)), EveryPrecision<T>::bound) << k;
      EXPECT_LE((f.g[k] - e.cov.g[k]).norm(), EveryPrecision<T>::bound * f.g[k].norm()) << k;
    }
  });
}

// Dense operators: in float32 and float64 here, in multi-precision by the table of the paper.
template <class T>
class Operator : public EveryPrecision<T> {};

TYPED_TEST_SUITE(Operator, MachinePrecisions, PrecisionName);

TYPED_TEST(Operator, RecursionAndOperatorsGiveTheSameMeans) {  // (2.1), (2.7), (2.9)
  using T = TypeParam;
  this->for_each_family([](const Estimation<T>& e) {
    const Operators<T> op(e.process);
    const BatchEstimate<T> batch(op, e.state.tau);
    EXPECT_LE(distance<T>(stacked(e.fs.x_mean), batch.X_mean), EveryPrecision<T>::bound);
    EXPECT_LE(distance<T>(stacked(e.fs.w_mean), batch.W_mean), EveryPrecision<T>::bound);
    EXPECT_LE(distance<T>(stacked(e.fs.l_minus), batch.lambda), EveryPrecision<T>::bound);
  });
}

TYPED_TEST(Operator, RecursionAndOperatorsGiveTheSameCovariances) {  // (3.4), (2.5), (2.11)
  using T = TypeParam;
  this->for_each_family([](const Estimation<T>& e) {
    const Operators<T> op(e.process);
    const BatchEstimate<T> batch(op, e.state.tau);
    const MatrixX<T> r = block_diagonal<T>(e.cov.r_minus);
    EXPECT_LE(distance<T>(r + op.Phi * r + r * op.Phi.transpose(), op.R), EveryPrecision<T>::bound);
    const T R = op.R.norm(), Q = op.Q.norm();
    for (int k = 0; k < e.process.size(); ++k) {
      const Matrix6<T> P = batch.P.template block<6, 6>(6 * k, 6 * k),
                       W = batch.W_cov.template block<6, 6>(6 * k, 6 * k);
      EXPECT_LE((smoothed_state_covariance(e.cov, k) - P).norm(), EveryPrecision<T>::bound * R);
      EXPECT_LE((smoothed_input_covariance(e.process, e.cov, k) - W).norm(),
                EveryPrecision<T>::bound * Q);
    }
  });
}

TYPED_TEST(Operator, ClosedLoopOperatorsFactorTheMassMatrix) {  // (3.1), (3.3)
  using T = TypeParam;
  this->for_each_family([](const Estimation<T>& e) {
    const Operators<T> op(e.process);
    const ClosedLoop<T> loop(e.process, op, e.cov);
    const MatrixX<T> I = MatrixX<T>::Identity(loop.K.rows(), loop.K.cols());
    const MatrixX<T> I_K = I + loop.K, I_L = I - loop.L;
    EXPECT_LE(distance<T>(I_K * loop.D.asDiagonal() * I_K.transpose(), op.M),
              EveryPrecision<T>::bound);
    EXPECT_LE(distance<T>(I_K * I_L, I), EveryPrecision<T>::bound);
  });
}

// log p of T ~ N(H phi b, M) up to a constant, and log det M.
struct Likelihood {
  Mp log_p, log_det_M;

  Likelihood(const Process<Mp>& process, const VectorX<Mp>& tau) {
    Covariances<Mp> cov(process);
    EXPECT_TRUE(set_state_covariances(process, cov));
    FilterSmoother<Mp> fs(process);
    filter(process, cov, tau, fs);
    log_det_M = log_det(cov);
    log_p = -(fs.e_minus.dot(fs.e_plus) + log_det_M) / 2;
  }
};

TEST(LogDet, GradientAndScoreAreTheDerivatives) {
  const Mp step = 1e-15;  // central differences: 1e-30 of the third derivative
  for (const Model<double>& model : {one_slide(63), chain(63, 4), tree(63), floating_base(63)}) {
    const Estimation<Mp> e(model, 64);
    const LogDetGradient<Mp> gradient = log_det_gradient(e.cov), slope = score(e.cov, e.fs);
    const auto expect_slopes = [&](const Process<Mp>& up, const Process<Mp>& down, const Mp& det,
                                   const Mp& p) {
      const Likelihood above(up, e.state.tau), below(down, e.state.tau);
      const Mp d_det = (above.log_det_M - below.log_det_M) / (2 * step),
               d_p = (above.log_p - below.log_p) / (2 * step);
      EXPECT_LE(abs(det - d_det), 1e-20 * (1 + abs(d_det)));
      EXPECT_LE(abs(p - d_p), 1e-20 * (1 + abs(d_p)));
    };
    for (int k = 0; k < e.process.size(); k += 3) {
      for (int i = 0; i < 10; ++i) {
        // M(k) is linear in its parameters: the gradient of tr(M S) with S = unit matrices is dM
        Matrix6<Mp> dM;
        for (int a = 0; a < 6; ++a)
          for (int b = 0; b < 6; ++b) {
            const Matrix6<Mp> unit = (Vector6<Mp>::Unit(a) * Vector6<Mp>::Unit(b).transpose() +
                                      Vector6<Mp>::Unit(b) * Vector6<Mp>::Unit(a).transpose()) /
                                     2;
            dM(a, b) = inertial_gradient<Mp>(unit)[i];
          }
        Process<Mp> up = e.process, down = e.process;
        up.M[k] += step * dM;
        down.M[k] -= step * dM;
        expect_slopes(up, down, gradient.inertia[k][i], slope.inertia[k][i]);
      }
      Process<Mp> up = e.process, down = e.process;
      up.r[k] += step;
      down.r[k] -= step;
      expect_slopes(up, down, gradient.r[k], slope.r[k]);
    }
  }
}

TEST(LogDet, ParametersAreThoseOfAMovingBody) {  // tr(M x x') = 2 x kinetic energy
  Random random(65);
  const RigidBody<double> body = random_body(random);
  const SpatialInertia<double> M(body);
  const Vector6<double> x = random.vector(6);
  InertialVector<double> parameters;
  parameters << M.m, M.h, M.I(0, 0), M.I(1, 1), M.I(2, 2), M.I(0, 1), M.I(0, 2), M.I(1, 2);
  const Vector3<double> w = x.head<3>(), v = x.tail<3>();
  const Vector3<double> spin = rotation(body.axes).transpose() * w, vc = v + w.cross(body.com);
  const double energy = body.mass * vc.squaredNorm() + spin.dot(body.moments.cwiseProduct(spin));
  EXPECT_NEAR(parameters.dot(inertial_gradient<double>(x * x.transpose())), energy, 1e-14 * energy);
}

TEST(Flaw, IsFoundAndNamed) {
  const Estimation<double> e(chain(66), 67);
  const auto flawed = [&](auto&& spoil) {
    Process<double> process = e.process;
    spoil(process);
    return find_flaw(process);
  };
  const Flaw skew = flawed([](auto& p) { p.M[3](0, 4) += 0.5; });
  EXPECT_EQ(skew.kind, Flaw::Kind::not_symmetric);
  EXPECT_EQ(skew.link, 3);
  EXPECT_NEAR(skew.value, 0.5, 1e-12);

  const Flaw indefinite = flawed([](auto& p) { p.M[4] = -p.M[4]; });
  EXPECT_EQ(indefinite.kind, Flaw::Kind::indefinite);
  EXPECT_EQ(indefinite.link, 4);
  const Flaw saddle = flawed([](auto& p) { p.M[2](0, 1) = p.M[2](1, 0) = 100 * p.M[2](0, 0); });
  EXPECT_EQ(saddle.kind, Flaw::Kind::indefinite);
  EXPECT_LT(saddle.value, 0);

  const Flaw noise = flawed([](auto& p) { p.r[5] = -0.25; });
  EXPECT_EQ(noise.kind, Flaw::Kind::negative_noise);
  EXPECT_EQ(noise.link, 5);
  EXPECT_EQ(noise.value, -0.25);

  const Flaw nan =
      flawed([](auto& p) { p.phi[1](2, 2) = std::numeric_limits<double>::quiet_NaN(); });
  EXPECT_EQ(nan.kind, Flaw::Kind::not_finite);
  EXPECT_EQ(nan.link, 1);
}

TEST(Flaw, IsNotSeenInPointMassesAndRods) {  // semidefinite, to rounding
  Random random(68);
  for (int i = 0; i < 200; ++i) {
    Builder builder;
    Joint<double> joint = random_joint(random, -1);
    joint.body = point_mass(std::exp(random.uniform(-20, 20)), 10 * random.vector3());
    if (i % 2 == 1) joint.body.moments = {0, joint.body.mass, joint.body.mass};
    joint.body.axes = random.quaternion();
    builder.add(joint);
    const Model<double> model = builder.build();
    LinkKinematics<double> kin(model);
    const State<double> state = random_state(model, 69);
    EXPECT_FALSE(find_flaw(Estimation<double>::at(model, state, kin))) << i;
  }
}

TEST(Singular, MechanismIsRefusedWithJointAndNumbers) {
  // two joints on one axis with nothing between: the outer one's measurement leaves no variance
  Builder builder;
  Joint<double> joint;
  joint.body = {1, {0.5, 0, 0}, {1, 0, 0, 0}, {0.1, 0.1, 0.1}};
  joint.parent = builder.add(joint);
  joint.translation = {1, 0, 0};
  joint.parent = builder.add_massless(joint);
  joint.translation.setZero();
  builder.add(joint);
  const Model<double> model = builder.build();
  LinkKinematics<double> kin(model);
  const Process<double> process = Estimation<double>::at(model, random_state(model, 70), kin);
  Covariances<double> cov(process);
  const Outcome outcome = set_state_covariances(process, cov);
  EXPECT_EQ(outcome.status, Outcome::Status::singular);
  EXPECT_EQ(outcome.joint, 1);
  EXPECT_LE(std::abs(outcome.D), 1e-14);
  EXPECT_GT(outcome.scale, 0.1);
}

TEST(Singular, NearlySingularIsNotRefused) {  // as factors.hpp: stretched chains keep their digits
  const Model<double> model = straight_chain(200);
  LinkKinematics<double> kin(model);
  State<double> rest = random_state(model, 71);
  rest.q.setZero();
  const Process<double> process = Estimation<double>::at(model, rest, kin);
  Covariances<double> cov(process);
  EXPECT_TRUE(set_state_covariances(process, cov));
}

}  // namespace
}  // namespace kalmarm::test
