// What stands between Kalmarm and other libraries: the mechanism that they are given, the
// conventions of their results, and the check of their derivatives. A single rigid body on a free
// joint, in its own axes, is the library here, by Newton and Euler:
//   M aB = tauB + weight - v x* M v,  v in the body's axes
#include <gtest/gtest.h>

#include "algorithms/study/solver.hpp"
#include "algorithms/test/models.hpp"
#include "benchmarks/derivative_check.hpp"
#include "benchmarks/peers/body_axes.hpp"
#include "benchmarks/peers/mechanism.hpp"

namespace kalmarm::test {
namespace {

using Vector6d = Vector6<double>;

Model<double> free_body() {
  Random random(5);
  Builder builder;
  builder.add_free(random_joint(random, -1));
  return builder.build();
}

// Linear part first, as it stands in q' of a free joint.
Vector6d swap_halves(const Vector6d& x) {
  Vector6d out;
  out << x.tail<3>(), x.head<3>();
  return out;
}

// The library: accelerations and derivatives of a free body in its own axes.
struct BodyInItsAxes {
  Matrix6<double> M;
  double mass;
  Vector3<double> com, gravity;  // gravity in the body's axes

  BodyInItsAxes(const Model<double>& model, const VectorX<double>& q)
      : M(model.M(5).matrix()), mass(model.M(5).m), com(model.M(5).h / mass) {
    const Eigen::Quaterniond turn(q[3], q[4], q[5], q[6]);
    gravity = (model.E(0) * turn.normalized().toRotationMatrix()).transpose() * model.gravity();
  }

  Vector6d weight(const Vector3<double>& g) const {
    Vector6d out;
    out << mass * com.cross(g), mass * g;
    return out;
  }
  Vector6d bias(const Vector6d& v) const { return cross_force(v, Vector6d(M * v)); }
  Vector6d solve(const Vector6d& x) const { return M.ldlt().solve(x); }

  Vector acceleration(const Vector& v, const Vector& tau) const {
    const Vector6d force = swap_halves(tau) + weight(gravity) - bias(swap_halves(v));
    return swap_halves(solve(force));
  }
  // Only the weight depends on the orientation: a turn dt moves g by -dt x g.
  Matrix by_q() const {
    Matrix out = Matrix::Zero(6, 6);
    for (int k = 0; k < 3; ++k)
      out.col(3 + k) = swap_halves(solve(weight(-Vector3<double>::Unit(k).cross(gravity))));
    return out;
  }
  // The bias is quadratic: central differences are exact.
  Matrix by_v(const Vector& v) const {
    Matrix out(6, 6);
    for (int k = 0; k < 6; ++k) {
      const Vector6d at = swap_halves(v), step = swap_halves(Vector6d::Unit(k));
      out.col(k) = swap_halves(solve(-(bias(at + step) - bias(at - step)) / 2));
    }
    return out;
  }
  Matrix by_tau() const {
    Matrix out(6, 6);
    for (int k = 0; k < 6; ++k) out.col(k) = swap_halves(solve(swap_halves(Vector6d::Unit(k))));
    return out;
  }
};

struct FreeBody {
  Model<double> model = free_body();
  kalmarm::State state;
  Mechanism mechanism = make_mechanism(model);
  BodyAxes axes{mechanism};
  std::unique_ptr<Solver<double>> solver = make_solver<double>("Sequential<ArrayMGS>", model);
  BodyInItsAxes library;
  Vector vB, tauB, aB;

  FreeBody()
      : state([this] {
          const State<double> drawn = random_state(model, 6);
          return kalmarm::State{drawn.q, drawn.qd, drawn.tau};
        }()),
        library(model, state.q),
        vB(axes.to_library(state.q.data(), state.qd.data())),
        tauB(axes.to_library(state.q.data(), state.tau.data())),
        aB(library.acceleration(vB, tauB)) {}
};

TEST(BodyAxes, AccelerationOfAFreeBodyIsNewtonsAndEulers) {
  FreeBody body;
  VectorX<double> a(6), right(6);
  body.axes.acceleration(body.state.q.data(), body.state.qd.data(), body.aB, a.data());
  ASSERT_TRUE(body.solver->acceleration(body.state.q, body.state.qd, body.state.tau, right));
  EXPECT_LE((a - right).norm(), 1e-12 * right.norm());
}

TEST(BodyAxes, TorqueOfInverseDynamicsIsThatOfTheAcceleration) {
  FreeBody body;
  VectorX<double> a(6), tau(6);
  ASSERT_TRUE(body.solver->acceleration(body.state.q, body.state.qd, body.state.tau, a));
  const Vector aB =
      body.axes.acceleration_to_library(body.state.q.data(), body.state.qd.data(), a.data());
  EXPECT_LE((aB - body.aB).norm(), 1e-12 * body.aB.norm());
  body.axes.torque(body.state.q.data(), body.tauB, tau.data());
  EXPECT_LE((tau - body.state.tau).norm(), 1e-14 * tau.norm());
}

TEST(BodyAxes, InverseIsThatOfTheModel) {
  FreeBody body;
  MatrixX<double> X(6, 6), right(6, 6);
  body.axes.matrix(body.state.q.data(), body.library.by_tau(), X.data());
  ASSERT_TRUE(body.solver->inverse(body.state.q, right));
  EXPECT_LE((X - right).norm(), 1e-12 * right.norm());
}

TEST(BodyAxes, DerivativesAreThoseOfTheAcceleration) {
  FreeBody body;
  RowMajor dq(6, 6), dqd(6, 6), dtau(6, 6);
  body.axes.derivatives(body.state.q.data(), body.state.qd.data(), body.state.tau.data(), body.aB,
                        body.library.by_q(), body.library.by_v(body.vB), body.library.by_tau(),
                        dq.data(), dqd.data(), dtau.data());
  EXPECT_LE(derivative_error(body.model, *body.solver, body.state, dq, dqd, dtau), 1e-9);
}

TEST(DerivativeError, SeesAWrongEntryInEveryMatrix) {
  FreeBody body;
  RowMajor J[3] = {RowMajor(6, 6), RowMajor(6, 6), RowMajor(6, 6)};
  body.axes.derivatives(body.state.q.data(), body.state.qd.data(), body.state.tau.data(), body.aB,
                        body.library.by_q(), body.library.by_v(body.vB), body.library.by_tau(),
                        J[0].data(), J[1].data(), J[2].data());
  for (RowMajor& wrong : J) {
    const double right = wrong(4, 2);
    wrong(4, 2) += 1e-3 * wrong.norm();
    EXPECT_GE(derivative_error(body.model, *body.solver, body.state, J[0], J[1], J[2]), 1e-6);
    wrong(4, 2) = right;
  }
}

TEST(Mechanism, JointsOfSeveralDofAreWholeAgain) {
  const Model<double> model = floating_base(7);
  const Mechanism mechanism = make_mechanism(model);
  int dof = 0;
  double mass = 0, right = 0;
  for (std::size_t i = 0; i < mechanism.joints.size(); ++i) {
    const Mechanism::Joint& joint = mechanism.joints[i];
    EXPECT_EQ(joint.v, dof);
    EXPECT_LT(joint.parent, static_cast<int>(i));
    dof += joint.dof;
    mass += joint.mass;
  }
  for (int k = 0; k < model.nv(); ++k) right += model.joint(k).body.mass;
  EXPECT_EQ(dof, model.nv());
  EXPECT_DOUBLE_EQ(mass, right);
  EXPECT_EQ(mechanism.joints[0].type, Mechanism::Type::free);
  EXPECT_FALSE(mechanism.is_chain());
  EXPECT_FALSE(mechanism.has_only_hinges_and_slides());
  EXPECT_TRUE(make_mechanism(chain(8, 5)).is_chain());
}

TEST(Mechanism, WithoutArmatureOnlyTheArmatureIsMissing) {
  Scene scene;
  scene.model = armature(9);
  const Model<double> plain = without_armature(scene).model;
  double before = 0;
  for (int k = 0; k < plain.nv(); ++k) {
    before += scene.model.joint(k).r;
    EXPECT_EQ(plain.joint(k).r, 0);
    EXPECT_EQ(plain.joint(k).body.mass, scene.model.joint(k).body.mass);
    EXPECT_EQ(plain.joint(k).translation, scene.model.joint(k).translation);
  }
  EXPECT_GT(before, 0);
}

}  // namespace
}  // namespace kalmarm::test
