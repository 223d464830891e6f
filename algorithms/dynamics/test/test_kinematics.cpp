// Kinematics against the definitions in 50 digits, and against what Dynamics answers.
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "algorithms/dynamics/test/door_support.hpp"
#include "algorithms/fast/test/kinematics_truth.hpp"
#include "kalmarm/dynamics.hpp"
#include "kalmarm/kinematics.hpp"

namespace kalmarm::test {
namespace {

// Memory of all results of one state, poisoned, or of rows of states.
template <class T>
struct Results {
  std::array<MatrixX<T>, kinematics> of;

  Results(int nv, int frames) {
    const auto shapes = kinematic_shapes(nv, frames, nv);
    for (int i = 0; i < kinematics; ++i)
      of[i].setConstant(shapes[i].rows, shapes[i].columns, std::numeric_limits<T>::quiet_NaN());
  }

  MatrixX<T>& operator[](Kinematic what) { return of[static_cast<int>(what)]; }

  StateKinematics<T> all(Axes axes) {
    return {axes,  of[0], of[1],  of[2],  of[3],  of[4],  of[5],  of[6],  of[7],
            of[8], of[9], of[10], of[11], of[12], of[13], of[14], of[15], of[16]};
  }
};

template <class T>
struct Rows {
  std::array<std::vector<T>, kinematics> of;

  Rows(int nv, int frames, int count) {
    const auto shapes = kinematic_shapes(nv, frames, nv);
    for (int i = 0; i < kinematics; ++i)
      of[i].assign(std::size_t(count) * shapes[i].size(), std::numeric_limits<T>::quiet_NaN());
  }

  RowsOfKinematics<T> all(Axes axes) {
    return {axes,  of[0], of[1],  of[2],  of[3],  of[4],  of[5],  of[6],  of[7],
            of[8], of[9], of[10], of[11], of[12], of[13], of[14], of[15], of[16]};
  }
};

std::vector<Frame> frames_on(const Model<double>& model) {
  return {{end_of_joint(model, model.nv() - 1), {1, 0.2, -0.3, 0.1}, {0.1, 0, 0.2}},
          {-1, {0.5, 0.1, 0, 0.3}, {1, 2, 3}},
          {end_of_joint(model, model.nv() / 2), {-0.1, 0.7, 0.2, 0.3}, {-0.2, 0.1, 0}}};
}

template <class T>
State<T> state_in(const Model<double>& model, std::uint64_t seed) {
  return random_state(model, seed).cast<T>();
}

// Of each result the largest error relative to its largest number, which the roundings of nv links and
// a frame may make: some twelve a link, of numbers that the result's largest bounds but for cancellation.
template <class T>
double bound(int nv) {
  return 12 * (nv + 4) * static_cast<double>(unit_roundoff<T>());
}

double largest_error(const MatrixX<double>& is, const MatrixX<double>& should, double size = 0) {
  if (should.size() == 0) return 0;
  size = std::max(size, should.cwiseAbs().maxCoeff());
  const double error = (is - should).cwiseAbs().maxCoeff();
  if (std::isnan(error)) return std::numeric_limits<double>::infinity();
  return size > 0 ? error / size : error;
}

constexpr int by_definition = static_cast<int>(Kinematic::coriolis);  // those before it
const char* const names[] = {
    "positions",     "rotations",     "quaternions",     "jacobians",           "velocities",
    "accelerations", "center",        "center_velocity", "center_acceleration", "center_jacobian",
    "momentum",      "momentum_rate", "momentum_matrix", "kinetic_energy",      "potential_energy"};

template <class T>
void agrees_with_the_definitions(const Model<double>& given, Axes axes, std::uint64_t seed) {
  const Model<double> model = given.cast<T>().template cast<double>();
  const std::vector<Frame> frames = frames_on(model);
  const int nv = model.nv(), nq = model.nq(), count = 3;
  Kinematics<T> robot(plain(model), frames);
  VectorX<T> q(count * nq), qd(count * nv), qdd(count * nv);
  Rows<T> rows(nv, 3, count);
  for (int i = 0; i < count; ++i) {
    const State<T> state = state_in<T>(model, seed + i);
    q.segment(i * nq, nq) = state.q;
    qd.segment(i * nv, nv) = state.qd;
    qdd.segment(i * nv, nv) = state.tau;
  }
  robot.compute_rows(q, qd, qdd, rows.all(axes));
  const auto shapes = kinematic_shapes(nv, 3, nv);
  for (int i = 0; i < count; ++i) {
    const State<T> state = state_in<T>(model, seed + i);
    const auto truth = true_kinematics(model, state.template cast<double>(), frames, axes);
    Results<T> one(nv, 3);
    robot.compute(state.q, state.qd, state.tau, one.all(axes));
    // V = -mass g'c is rounded as the three numbers of c are, across gravity too.
    const double weight =
        robot.mass() * model.gravity().norm() * truth[static_cast<int>(Kinematic::center)].norm();
    for (int j = 0; j < by_definition; ++j) {
      const double size = j == static_cast<int>(Kinematic::potential_energy) ? weight : 0;
      EXPECT_LE(largest_error(one.of[j].template cast<double>(), truth[j], size), bound<T>(nv))
          << names[j];
      const Eigen::Map<const MatrixX<T>> row(rows.of[j].data() + i * shapes[j].size(),
                                             shapes[j].rows, shapes[j].columns);
      EXPECT_LE(largest_error(row.template cast<double>(), truth[j], size), bound<T>(nv))
          << names[j] << " of row " << i;
    }
  }
}

class OfAxes : public testing::TestWithParam<Axes> {};
INSTANTIATE_TEST_SUITE_P(
    Kinematics, OfAxes, testing::Values(Axes::local, Axes::world, Axes::aligned),
    [](const auto& info) {
      return std::string(std::array{"local", "world", "aligned"}[static_cast<int>(info.param)]);
    });

TEST_P(OfAxes, AgreesWithTheDefinitionsOfMechanics) {
  for (const Family& family : families_and_robots()) {
    SCOPED_TRACE(family.name);
    agrees_with_the_definitions<double>(family.make(3), GetParam(), 17);
    agrees_with_the_definitions<float>(family.make(4), GetParam(), 18);
  }
}

// A robot that has walked off by 1000 km.
TEST(Kinematics, FarFromTheBaseWhatIsNearEachOtherKeepsItsDigits) {
  const Model<double> model = floating_base(7);
  State<double> state = random_state(model, 5);
  state.q.head<3>() = Vector3<double>(1e6, -2e6, 5e5);
  const std::vector<Frame> frames = frames_on(model);
  Kinematics<double> robot(plain(model), frames);
  for (const Axes axes : {Axes::local, Axes::aligned}) {
    Results<double> is(model.nv(), 3);
    robot.compute(state.q, state.qd, state.tau, is.all(axes));
    const auto truth = true_kinematics(model, state, frames, axes);
    for (int j = 0; j < by_definition; ++j)
      EXPECT_LE(largest_error(is.of[j], truth[j]), bound<double>(model.nv())) << names[j];
  }
}

// f = J'F of a force at the centre of mass, and the work of gravity.
TEST(Kinematics, GravityActsAtTheCentreOfMass) {
  const Model<double> model = creature(2);
  const State<double> state = random_state(model, 3);
  Kinematics<double> robot(plain(model));
  Dynamics<double> dynamics(plain(model));
  MatrixX<double> Jt(model.nv(), 3);
  VectorX<double> tau(model.nv());
  robot.compute(state.q, {.center_jacobian = Jt});
  dynamics.gravity(state.q, tau);
  const VectorX<double> weight = -robot.mass() * (Jt * model.gravity());
  EXPECT_LE((tau - weight).norm(), bound<double>(model.nv()) * weight.norm());
}

TEST(Kinematics, KineticEnergyIsThatOfTheMassMatrix) {
  const Model<double> model = everything(3);
  const State<double> state = random_state(model, 4);
  Kinematics<double> robot(plain(model));
  Dynamics<double> dynamics(plain(model));
  MatrixX<double> M(model.nv(), model.nv());
  double K = 0;
  robot.compute(state.q, state.qd, {.kinetic_energy = MatrixView<double>(&K, 1, 1)});
  dynamics.mass(state.q, M);
  EXPECT_NEAR(K, 0.5 * state.qd.dot(M * state.qd), bound<double>(model.nv()) * K);
}

// Nothing acts on a robot in free fall but its weight: its momentum says so.
TEST(Kinematics, FreeFallChangesTheMomentumByTheWeightAlone) {
  const Model<double> model = floating_base(11);
  const State<double> state = random_state(model, 12);
  const int nv = model.nv();
  Kinematics<double> robot(plain(model));
  Dynamics<double> dynamics(plain(model));
  const VectorX<double> still = VectorX<double>::Zero(nv);
  VectorX<double> a(nv);
  ASSERT_TRUE(dynamics.forward_dynamics(state.q, state.qd, still, a));
  Vector6<double> rate, momentum;
  robot.compute(state.q, state.qd, a, {.momentum = momentum, .momentum_rate = rate});
  Vector6<double> weight;
  weight << 0, 0, 0, robot.mass() * model.gravity();
  EXPECT_LE((rate - weight).norm(), 1e-11 * (weight.norm() + momentum.norm()));
}

// J of a frame and M^-1 of the robot make what the door answers of both.
TEST(Kinematics, JacobiansAreThoseOfOperational) {
  const Model<double> model = creature(5);
  const State<double> state = random_state(model, 6);
  const std::vector<Frame> frames = frames_on(model);
  const int nv = model.nv();
  Kinematics<double> robot(plain(model), frames);
  Dynamics<double> dynamics(plain(model), {.question = {.frames = frames}});
  MatrixX<double> Jt(nv, 18), X(nv, 18), JXJ(18, 18);
  robot.compute(state.q, {.axes = Axes::local, .jacobians = Jt});
  ASSERT_TRUE(dynamics.factor(state.q));
  ASSERT_TRUE(dynamics.solve(Jt, X));
  ASSERT_TRUE(dynamics.operational(state.q, JXJ));
  EXPECT_LE((Jt.transpose() * X - JXJ).norm(), 1e-12 * JXJ.norm());
}

// C qd is what velocities need; M' - 2 C is skew-symmetric. What cancels in C is as large as M qd.
TEST(Kinematics, TheCoriolisMatrixIsTheOneThatMassChangesBy) {
  for (const Family& family : families_and_robots()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = family.make(6);
    const State<double> state = random_state(model, 7);
    const int nv = model.nv();
    Kinematics<double> robot(plain(model));
    Dynamics<double> dynamics(plain(model));
    MatrixX<double> C(nv, nv);
    VectorX<double> bias(nv), gravity(nv);
    robot.compute(state.q, state.qd, {.coriolis = C});
    dynamics.bias(state.q, state.qd, bias);
    dynamics.gravity(state.q, gravity);
    MatrixX<double> M(nv, nv);
    dynamics.mass(state.q, M);
    const double speed = state.qd.norm(), size = M.norm() * speed;
    EXPECT_LE((C * state.qd + gravity - bias).norm(),
              bound<double>(nv) * (size * speed + gravity.norm()));
    const MatrixX<double> rest = mass_rate(model, state) - 2 * C;
    EXPECT_LE((rest + rest.transpose()).norm(), bound<double>(nv) * size);
  }
}

// Y knows nothing of the bodies, and gives the torques of any.
TEST(Kinematics, TheRegressorGivesTheTorquesOfAnyBodies) {
  for (const Family& family : families_and_robots()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = family.make(6);
    const State<double> state = random_state(model, 8);
    const int nv = model.nv();
    MatrixX<double> Y(nv, 10 * nv), same(Y);
    RobotModel robot = plain(model), heavier = robot;
    for (LinkParameters& link : heavier.links) {
      link.mass = 3 + 2 * link.mass;
      link.center_of_mass[1] += 0.3;
      link.principal_moments = {1, 1.1, 1.2};
    }
    for (const RobotModel* bodies : {&robot, &heavier}) {
      Kinematics<double>(*bodies).compute(state.q, state.qd, state.tau,
                                          {.regressor = bodies == &robot ? Y : same});
      const Model<double> of_bodies = model_of(*bodies);
      VectorX<double> pi(10 * nv), tau(nv);
      for (int k = 0; k < nv; ++k) {
        const auto& M = of_bodies.M(k);
        pi.segment<10>(10 * k) << M.m, M.h, M.I(0, 0), M.I(1, 1), M.I(2, 2), M.I(0, 1), M.I(0, 2),
            M.I(1, 2);
      }
      Dynamics<double>(*bodies).inverse_dynamics(state.q, state.qd, state.tau, tau);
      VectorX<double> by_Y = Y * pi;
      for (int k = 0; k < nv; ++k) by_Y[k] += bodies->links[k].armature * state.tau[k];
      EXPECT_LE((by_Y - tau).norm(), 10 * bound<double>(nv) * tau.norm());
    }
    EXPECT_EQ(Y, same);
  }
}

// The columns of chosen bodies, in their order, of one state and of rows; the same bits, since each is worked out
// by itself.
TEST(Kinematics, TheRegressorOfChosenBodiesIsTheirColumns) {
  const Model<double> model = creature(4);
  const int nv = model.nv(), count = 9;
  const std::vector<int> bodies = {nv - 1, 2, nv / 2};
  VectorX<double> q(count * model.nq()), qd(count * nv), qdd(count * nv);
  for (int i = 0; i < count; ++i) {
    const State<double> state = random_state(model, i);
    q.segment(i * model.nq(), model.nq()) = state.q;
    qd.segment(i * nv, nv) = state.qd;
    qdd.segment(i * nv, nv) = state.tau;
  }
  Kinematics<double> all(plain(model)), some(plain(model), {}, bodies);
  std::vector<double> whole(count * nv * 10 * nv), chosen(count * nv * 30);
  all.compute_rows(q, qd, qdd, {.regressor = whole});
  some.compute_rows(q, qd, qdd, {.regressor = chosen});
  const State<double> state = random_state(model, 0);
  MatrixX<double> Y(nv, 10 * nv), Y_chosen(nv, 30);
  all.compute(state.q, state.qd, state.tau, {.regressor = Y});
  some.compute(state.q, state.qd, state.tau, {.regressor = Y_chosen});
  for (int b = 0; b < 3; ++b) {
    EXPECT_EQ(Y_chosen.middleCols(10 * b, 10), Y.middleCols(10 * bodies[b], 10));
    for (int i = 0; i < count; ++i) {
      const Eigen::Map<MatrixX<double>> of_all(&whole[i * nv * 10 * nv], nv, 10 * nv),
          of_some(&chosen[i * nv * 30], nv, 30);
      EXPECT_EQ(of_some.middleCols(10 * b, 10), of_all.middleCols(10 * bodies[b], 10));
    }
  }
  EXPECT_THROW(Kinematics<double>(plain(model), {}, {nv}), std::invalid_argument);
  EXPECT_THROW(some.compute(state.q, state.qd, {.regressor = Y}), std::invalid_argument);
}

// Of each result alone the bits of all together.
TEST(Kinematics, WhatIsLeftOutChangesNothing) {
  const Model<double> model = creature(8);
  const State<double> state = random_state(model, 9);
  const std::vector<Frame> frames = frames_on(model);
  Kinematics<double> robot(plain(model), frames);
  Results<double> all(model.nv(), 3);
  robot.compute(state.q, state.qd, state.tau, all.all(Axes::world));
  Results<double> one(model.nv(), 3);
  using View = MatrixView<double>;
  const auto alone = [&](View StateKinematics<double>::*view, int j) {
    StateKinematics<double> out{.axes = Axes::world};
    out.*view = one.of[j];
    robot.compute(state.q, state.qd, state.tau, out);
    EXPECT_EQ(one.of[j], all.of[j]) << names[j];
  };
  using Out = StateKinematics<double>;
  alone(&Out::positions, 0);
  alone(&Out::rotations, 1);
  alone(&Out::quaternions, 2);
  alone(&Out::jacobians, 3);
  alone(&Out::velocities, 4);
  alone(&Out::accelerations, 5);
  alone(&Out::center, 6);
  alone(&Out::center_velocity, 7);
  alone(&Out::center_acceleration, 8);
  alone(&Out::center_jacobian, 9);
  alone(&Out::momentum, 10);
  alone(&Out::momentum_rate, 11);
  alone(&Out::momentum_matrix, 12);
  alone(&Out::kinetic_energy, 13);
  alone(&Out::potential_energy, 14);
  alone(&Out::coriolis, 15);
  alone(&Out::regressor, 16);
}

TEST(Kinematics, RowsOnAnyNumberOfThreadsHaveTheSameBits) {
  const Model<double> model = creature(1);
  const std::vector<Frame> frames = frames_on(model);
  const int count = 150, nv = model.nv(), nq = model.nq();
  Kinematics<double> robot(plain(model), frames);
  VectorX<double> q(count * nq), qd(count * nv);
  for (int i = 0; i < count; ++i) {
    const State<double> state = random_state(model, i);
    q.segment(i * nq, nq) = state.q;
    qd.segment(i * nv, nv) = state.qd;
  }
  Rows<double> one(nv, 3, count), three(nv, 3, count);
  robot.compute_rows(q, qd, one.all(Axes::local), 1);
  robot.compute_rows(q, qd, three.all(Axes::local), 3);
  EXPECT_EQ(one.of, three.of);
}

TEST(Kinematics, ARowThatIsNotFiniteIsAlone) {
  const Model<double> model = creature(1);
  const std::vector<Frame> frames = frames_on(model);
  const int count = 9, nv = model.nv(), nq = model.nq(), bad = 4;
  Kinematics<double> robot(plain(model), frames);
  VectorX<double> q(count * nq);
  for (int i = 0; i < count; ++i) q.segment(i * nq, nq) = random_state(model, i).q;
  std::vector<double> good(count * nv * 18), with(good);
  robot.compute_rows(q, {.jacobians = good});
  q.segment(bad * nq, nq).setConstant(std::numeric_limits<double>::quiet_NaN());
  robot.compute_rows(q, {.jacobians = with});
  for (int i = 0; i < count; ++i) {
    const auto row = [&](const std::vector<double>& of) {
      return Eigen::Map<const VectorX<double>>(of.data() + i * nv * 18, nv * 18);
    };
    if (i == bad)
      EXPECT_TRUE(std::isnan(row(with).sum()));
    else
      EXPECT_EQ(row(with), row(good));
  }
}

std::string refused(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "nothing";
}

TEST(Kinematics, WrongSizesAreRefusedByName) {
  const Model<double> model = chain(2, 5);
  const RobotModel robot = plain(model);
  Kinematics<double> of(robot, {{4}});
  VectorX<double> q = VectorX<double>::Zero(5), four = VectorX<double>::Zero(4);
  MatrixX<double> Jt(5, 6), J(6, 5);
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> by_rows(5, 6);
  EXPECT_EQ(refused([&] { of.compute(four, {.jacobians = Jt}); }),
            "kinematics: q has size 4, 5 is needed");
  EXPECT_EQ(refused([&] { of.compute(q, four, {.velocities = J}); }),
            "kinematics: velocities has size 6 x 5, 6 x 1, column-major, is needed");
  EXPECT_EQ(refused([&] { of.compute(q, {.jacobians = J}); }),
            "kinematics: jacobians has size 6 x 5, 5 x 6, column-major, is needed");
  EXPECT_EQ(refused([&] { of.compute(q, {.jacobians = by_rows}); }),
            "kinematics: jacobians has size 5 x 6, 5 x 6, column-major, is needed");
  EXPECT_EQ(refused([&] { of.compute(q, {.momentum = VectorX<double>(Vector6<double>())}); }),
            "kinematics: momentum needs qd");
  std::vector<double> two(10), X(29);
  EXPECT_EQ(refused([&] { of.compute_rows(two, {.jacobians = X}); }),
            "kinematics: jacobians has size 29, 2 x 30 is needed");
  EXPECT_EQ(refused([&] { Kinematics<double>(robot, {{5}}); }),
            "kinematics: a frame on link 5 of a robot with 5");
  EXPECT_EQ(refused([&] {
              Kinematics<double>(robot, {{1, {0, 0, 0, 0}}});
            }),
            "kinematics: a frame on link 1 has a quaternion of no length or a number that is not "
            "finite");
}

TEST(Kinematics, WhatWasMovedFromAnswersNothing) {
  Kinematics<double> first(plain(chain(2, 3)));
  const Kinematics<double> second = std::move(first);
  const VectorX<double> q = VectorX<double>::Zero(3);
  double V = 0;
  EXPECT_THROW(first.compute(q, {.potential_energy = MatrixView<double>(&V, 1, 1)}),
               std::logic_error);
  EXPECT_EQ(second.nv(), 3);
}

TEST(Kinematics, WithoutMassThereIsNoCentre) {
  Kinematics<double> nothing(RobotModel{}, {{-1, {1, 0, 0, 0}, {1, 2, 3}}});
  Vector3<double> center, position;
  nothing.compute(VectorX<double>(), {.positions = position, .center = center});
  EXPECT_EQ(position, Vector3<double>(1, 2, 3));
  EXPECT_TRUE(std::isnan(center[0]));
}

}  // namespace
}  // namespace kalmarm::test
