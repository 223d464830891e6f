// The algebra of the spatially random model, and the laws of mechanics that its quantities obey, in
// 50 digits.
#include <gtest/gtest.h>

#include "algorithms/model/inverse_dynamics.hpp"
#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/study/solver.hpp"
#include "algorithms/test/dense_mechanics.hpp"
#include "algorithms/test/models.hpp"

namespace kalmarm::test {
namespace {

using Matrix4 = Eigen::Matrix<Mp, 4, 4>;

const Mp rounding = 1e-45;

template <class A, class B>
void expect_near(const A& a, const B& b, const Mp& tolerance = rounding) {
  EXPECT_LE((a - b).norm(), tolerance * (1 + a.norm()));
}

Vector6<Mp> random_vector6(Random& random) { return random.vector(6).cast<Mp>(); }

Matrix6<Mp> random_symmetric(Random& random) {
  const Matrix6<Mp> A = Matrix6<Mp>::NullaryExpr([&] { return Mp(random.normal()); });
  return A + A.transpose();
}

Transform<Mp> random_transform(Random& random) {
  return {rotation(random.quaternion().cast<Mp>()), random.vector3().cast<Mp>()};
}

Matrix6<Mp> phi_matrix(const Transform<Mp>& phi) {
  Matrix6<Mp> out;
  for (int i = 0; i < 6; ++i) out.col(i) = phi.force_to_parent(Vector6<Mp>::Unit(i));
  return out;
}

Matrix4 homogeneous(const Transform<Mp>& phi) {
  Matrix4 out = Matrix4::Identity();
  out.topLeftCorner<3, 3>() = phi.R;
  out.topRightCorner<3, 1>() = phi.p;
  return out;
}

// A force f at point x, about the origin.
Vector6<Mp> force_at(const Vector3<Mp>& x, const Vector3<Mp>& f) {
  Vector6<Mp> out;
  out << x.cross(f), f;
  return out;
}

TEST(Rotation, OfAnyQuaternionIsOrthogonalAndTurnsItsAxisIntoItself) {
  Random random(1);
  const Eigen::Quaternion<Mp> q = random.quaternion().cast<Mp>();
  const Matrix3<Mp> R = rotation(q);
  expect_near(R * R.transpose(), Matrix3<Mp>::Identity());
  expect_near(R * q.vec(), q.vec());
  expect_near(R, rotate_basis(q));
}

TEST(Phi, MovesForcesAsPointsMove) {
  Random random(2);
  const Transform<Mp> phi = random_transform(random);
  const Vector3<Mp> x = random.vector3().cast<Mp>(), f = random.vector3().cast<Mp>();
  const Vector3<Mp> moved = (homogeneous(phi) * x.homogeneous()).head<3>();
  expect_near(phi.force_to_parent(force_at(x, f)), force_at(moved, phi.R * f));
}

TEST(Phi, ComposesAsHomogeneousTransformsDo) {
  Random random(3);
  const Transform<Mp> a = random_transform(random), b = random_transform(random);
  const Matrix4 ab = homogeneous(a) * homogeneous(b);
  const Transform<Mp> composed{ab.topLeftCorner<3, 3>(), ab.topRightCorner<3, 1>()};
  expect_near(phi_matrix(a) * phi_matrix(b), phi_matrix(composed));
}

TEST(Phi, TransposeKeepsPower) {
  Random random(4);
  const Transform<Mp> phi = random_transform(random);
  const Vector6<Mp> f = random_vector6(random), v = random_vector6(random);
  const Mp power = phi.force_to_parent(f).dot(v);
  EXPECT_LE(abs(power - f.dot(phi.motion_from_parent(v))), rounding);
}

TEST(Phi, CrossForceIsMinusTheTransposeOfCrossMotion) {
  Random random(5);
  const Vector6<Mp> m = random_vector6(random), s = random_vector6(random),
                    f = random_vector6(random);
  EXPECT_LE(abs(cross_motion(m, s).dot(f) + s.dot(cross_force(m, f))), rounding);
}

TEST(Phi, CrossMotionIsTheRateOfATurningFrame) {
  // d/dt of phi'(t) s for a frame that moves with velocity m: -m x s.
  Random random(6);
  const Vector6<Mp> m = random_vector6(random), s = random_vector6(random);
  const auto at = [&](const Mp& t) {
    const Eigen::Quaternion<Mp> q(1, t * m[0] / 2, t * m[1] / 2, t * m[2] / 2);
    return Transform<Mp>{rotation(q), t * m.tail<3>()}.motion_from_parent(s);
  };
  const Mp h = 1e-15;
  const Vector6<Mp> rate = (at(h) - at(-h)) / (2 * h);
  expect_near(rate, -cross_motion(m, s), Mp(1e-28));
}

TEST(Congruence, IsTheDenseProductAndSymmetricToTheLastBit) {
  Random random(7);
  const Transform<Mp> phi = random_transform(random);
  const Matrix6<Mp> P = random_symmetric(random), dense = phi_matrix(phi);
  expect_near(phi.congruence(P), dense * P * dense.transpose());
  expect_near(phi.dual_congruence(P), dense.transpose() * P * dense);

  const Transform<double> rounded{phi.R.cast<double>(), phi.p.cast<double>()};
  for (const Matrix6<double>& out :
       {rounded.congruence(P.cast<double>()), rounded.dual_congruence(P.cast<double>())})
    EXPECT_EQ(out, out.transpose());
}

TEST(SpatialInertia, GivesTheKineticEnergyOfItsBody) {
  Random random(8);
  const RigidBody<Mp> body = random_body(random).cast<Mp>();
  const Vector6<Mp> v = random_vector6(random);
  const Vector3<Mp> w = v.head<3>(), at_com = v.tail<3>() + w.cross(body.com);
  const Vector3<Mp> w_principal = rotate_basis(body.axes).transpose() * w;
  const Mp twice =
      body.mass * at_com.squaredNorm() + body.moments.dot(w_principal.cwiseProduct(w_principal));
  EXPECT_LE(abs(v.dot(SpatialInertia<Mp>(body) * v) - twice), rounding * twice);
}

TEST(SpatialInertia, ItsFormsAgree) {
  Random random(9);
  const RigidBody<Mp> body = random_body(random).cast<Mp>();
  const SpatialInertia<Mp> inertia(body);
  const WeightedInertia<Mp> weighted(body);
  const Matrix6<Mp> W = weighted.W();
  const Vector6<Mp> x = random_vector6(random);
  expect_near(W * W.transpose(), inertia.matrix());
  expect_near(weighted.V * weighted.w.asDiagonal() * weighted.V.transpose(), inertia.matrix());
  expect_near(inertia.matrix() * x, inertia * x);
}

TEST(SpatialInertia, MovesAndAddsAsItsMatrixDoes) {
  Random random(10);
  const Transform<Mp> phi = random_transform(random);
  SpatialInertia<Mp> inertia(random_body(random).cast<Mp>());
  const SpatialInertia<Mp> other(random_body(random).cast<Mp>());
  expect_near(inertia.to_parent(phi).matrix(), phi.congruence(inertia.matrix()));
  const Matrix6<Mp> sum = inertia.matrix() + other.matrix();
  inertia += other;
  expect_near(inertia.matrix(), sum);
}

// The rest is of whole mechanisms.
struct Mechanism {
  Model<double> parameters;
  Model<Mp> model;
  State<Mp> state;
  LinkKinematics<Mp> kin;
  InverseDynamics<Mp> ws;

  Mechanism(const Model<double>& made, std::uint64_t seed)
      : parameters(made),
        model(made.cast<Mp>()),
        state(random_state(made, seed).cast<Mp>()),
        kin(model),
        ws(model) {
    set_position(model, state.q, kin);
    set_velocity(model, state.qd, kin);
  }

  VectorX<Mp> torque(const VectorX<Mp>& qdd) {
    VectorX<Mp> tau(model.nv());
    inverse_dynamics(model, kin, qdd, ws, Eigen::Ref<VectorX<Mp>>(tau));
    return tau;
  }

  MatrixX<Mp> mass() const {
    CompositeInertia<Mp> composite(model);
    MatrixX<Mp> M(model.nv(), model.nv());
    mass_matrix(model, kin, composite, Eigen::Ref<MatrixX<Mp>>(M));
    return M;
  }

  // The state a time t later, to first order: enough for central differences.
  World after(const Mp& t, const VectorX<Mp>& qdd) const {
    VectorX<Mp> q = state.q;
    for (int k = 0; k < model.nv(); ++k) {
      const int i = model.joint(k).q_index;
      switch (model.joint(k).coordinate) {
        case Coordinate::angle:
        case Coordinate::distance:
          q[i] += t * state.qd[k];
          break;
        case Coordinate::position:
          q.segment<3>(i) += t * state.qd.segment<3>(k);
          break;
        case Coordinate::quaternion: {
          const Eigen::Quaternion<Mp> at(q[i], q[i + 1], q[i + 2], q[i + 3]);
          Eigen::Quaternion<Mp> turn(1, 0, 0, 0);
          turn.vec() = t / 2 * state.qd.segment<3>(k);
          const Eigen::Quaternion<Mp> later = at * turn;
          q.segment<4>(i) << later.w(), later.vec();
          break;
        }
        case Coordinate::follower:
          break;
      }
    }
    return World(model, q, state.qd + t * qdd);
  }
};

const Mp step = 1e-15;  // of central differences, whose error is its square
const Mp differencing = 1e-26;

class EveryFamily : public testing::TestWithParam<Family> {
 protected:
  static constexpr std::uint64_t seed = 21;
  Mechanism mechanism{GetParam().make(seed), seed};
};

TEST_P(EveryFamily, LinkVelocitiesGiveTheKineticEnergy) {
  const auto& [parameters, model, state, kin, ws] = mechanism;
  Mp twice = 0;
  for (int k = 0; k < model.nv(); ++k)
    twice += kin.v[k].dot(model.M(k) * kin.v[k]) + model.joint(k).r * state.qd[k] * state.qd[k];
  const Mp energy = World(model, state.q, state.qd).kinetic_energy();
  EXPECT_LE(abs(twice / 2 - energy), rounding * energy);
  EXPECT_LE(abs(state.qd.dot(mechanism.mass() * state.qd) / 2 - energy), rounding * energy);
}

TEST_P(EveryFamily, PowerOfTheTorquesIsTheRateOfEnergy) {
  Random random(seed);
  const VectorX<Mp> qdd = random.vector(mechanism.model.nv()).cast<Mp>();
  const auto energy = [&](const Mp& t) {
    const World world = mechanism.after(t, qdd);
    return Mp(world.kinetic_energy() + world.potential_energy());
  };
  const Mp power = mechanism.torque(qdd).dot(mechanism.state.qd);
  const Mp rate = (energy(step) - energy(-step)) / (2 * step);
  EXPECT_LE(abs(power - rate), differencing * (1 + abs(power)));
}

TEST_P(EveryFamily, MassMatrixIsTheDerivativeOfTheTorques) {
  const int nv = mechanism.model.nv();
  const MatrixX<Mp> M = mechanism.mass();
  const VectorX<Mp> bias = mechanism.torque(VectorX<Mp>::Zero(nv));
  for (int j = 0; j < nv; ++j)
    expect_near(mechanism.torque(VectorX<Mp>::Unit(nv, j)) - bias, M.col(j));
  EXPECT_EQ(M, M.transpose());
}

TEST_P(EveryFamily, BiasAndMassMatrixAreThoseOfTheWorldFrame) {
  const auto& [parameters, model, state, kin, ws] = mechanism;
  const World world(model, state.q, state.qd);
  expect_near(mechanism.mass(), world.mass_matrix());
  expect_near(mechanism.torque(VectorX<Mp>::Zero(model.nv())), world.bias());
}

INSTANTIATE_TEST_SUITE_P(Models, EveryFamily, testing::ValuesIn(families()),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(FreeFloatingTree, WithoutTorquesKeepsItsMomentum) {
  Mechanism mechanism(floating_base(31, Vector3<double>::Zero()), 31);
  const int nv = mechanism.model.nv();
  for (const RegisteredVariant<Mp>& variant : registered_variants<Mp>()) {
    VectorX<Mp> a(nv);
    const State<Mp>& state = mechanism.state;
    ASSERT_TRUE(
        variant.make(mechanism.model)->acceleration(state.q, state.qd, VectorX<Mp>::Zero(nv), a));
    const Vector6<Mp> rate =
        (mechanism.after(step, a).momentum() - mechanism.after(-step, a).momentum()) / (2 * step);
    EXPECT_LE(rate.norm(), differencing * mechanism.after(0, a).momentum().norm()) << variant.name;
  }
}

}  // namespace
}  // namespace kalmarm::test
