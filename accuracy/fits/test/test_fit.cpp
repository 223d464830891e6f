// Fits: Jacobians of the costs against Jets and differences, base parameters against what is known
// of one hinge and two links, fits of noise-free data against the truth, intervals against how
// often they hold it.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>
#include <cmath>
#include <string>

#include "accuracy/fits/costs.hpp"
#include "accuracy/fits/excitation.hpp"
#include "accuracy/fits/fit.hpp"
#include "accuracy/fits/identifiability.hpp"
#include "accuracy/fits/prediction.hpp"
#include "algorithms/study/derivatives/mass_jacobian.hpp"
#include "algorithms/test/models.hpp"

namespace kalmarm::test {
namespace {

constexpr Residual kinds[] = {Residual::inverse_dynamics, Residual::forward_dynamics,
                              Residual::innovations, Residual::mass_matrix, Residual::likelihood};

Scene scene_of(const Model<double>& model) { return generated_scene("test", model); }

FreeParameters all_bodies(const Model<double>& model) {
  FreeParameters out;
  for (int k = 0; k < model.nv(); ++k)
    if (!model.inertia(k).massless) out.bodies.push_back(k);
  return out;
}

FreeParameters everything(const Model<double>& model) {
  FreeParameters out = all_bodies(model);
  for (int k = 0; k < model.nv(); ++k)
    for (auto* dofs : {&out.armature, &out.viscous, &out.coulomb}) dofs->push_back(k);
  return out;
}

Mechanics<double> with_friction(const Model<double>& model) {
  const VectorX<double> ones = VectorX<double>::Ones(model.nv());
  return {model, 0.3 * ones, 0.2 * ones};
}

// Exact samples of a robot along an excitation.
Samples motion_of(const Mechanics<double>& robot, int count, std::uint64_t seed = 1) {
  ExcitationOptions options;
  options.count = count;
  options.seed = seed;
  options.candidates = 5;
  Samples out = excite(scene_of(robot.model), options).samples;
  out.tau = torques(robot, out);
  const Model<double>& model = robot.model;
  LinkKinematics<double> kin(model);
  CompositeInertia<double> composite(model);
  MatrixX<double> M(model.nv(), model.nv());
  out.mass.resize(lower_triangle_size(model.nv()), count);
  for (int i = 0; i < count; ++i) {
    set_position(model, out.q.col(i), kin);
    mass_matrix(model, kin, composite, Eigen::Ref<MatrixX<double>>(M));
    for (int row = 0; row < model.nv(); ++row)
      for (int col = 0; col <= row; ++col) out.mass(lower_triangle_row(row, col), i) = M(row, col);
  }
  return out;
}

// The robot with its free parameters moved in the solver's coordinates.
Mechanics<double> moved(const Mechanics<double>& robot, const FreeParameters& free, double size) {
  Random random(3);
  std::vector<VectorX<double>> blocks = free.blocks_of(robot);
  std::vector<double*> pointers;
  for (VectorX<double>& block : blocks) {
    for (double& x : block) x *= 1 + size * random.uniform(-1, 1);
    pointers.push_back(block.data());
  }
  Mechanics<double> out = robot;
  free.apply(pointers.data(), out);
  return out;
}

MatrixX<double> jacobian_of(const ceres::CostFunction& cost, std::vector<VectorX<double>> blocks) {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  std::vector<RowMajor> parts;
  std::vector<const double*> values;
  std::vector<double*> jacobians;
  Eigen::Index columns = 0;
  for (const VectorX<double>& block : blocks) {
    parts.emplace_back(cost.num_residuals(), block.size());
    values.push_back(block.data());
    columns += block.size();
  }
  for (RowMajor& part : parts) jacobians.push_back(part.data());
  VectorX<double> r(cost.num_residuals());
  EXPECT_TRUE(cost.Evaluate(values.data(), r.data(), jacobians.data()));
  MatrixX<double> out(cost.num_residuals(), columns);
  columns = 0;
  for (const RowMajor& part : parts) {
    out.middleCols(columns, part.cols()) = part;
    columns += part.cols();
  }
  return out;
}

class Costs : public testing::TestWithParam<std::tuple<int, int>> {};

TEST_P(Costs, AnalyticJacobianIsThatOfJetsAndOfDifferences) {
  const auto [family, kind] = GetParam();
  const Mechanics<double> robot = with_friction(families()[family].make(4));
  const FreeParameters free = everything(robot.model);
  const Samples samples = motion_of(robot, 3);
  const Mechanics<double> start = moved(robot, free, 0.2);
  ResidualOptions options = residual_options(kinds[kind], start, samples);
  options.sigma = 0.5;
  MatrixX<double> J[3];
  for (int i = 0; i < 3; ++i)
    J[i] = jacobian_of(*make_cost(start, free, samples, 0, 3, options, Differentiation(i)),
                       free.blocks_of(start));
  EXPECT_LE((J[0] - J[1]).norm(), 1e-11 * J[1].norm());
  EXPECT_LE((J[0] - J[2]).norm(), 1e-5 * J[1].norm());
}

// chain, tree, floating_base, ball_in_chain, slides, one_hinge
INSTANTIATE_TEST_SUITE_P(Families, Costs,
                         testing::Combine(testing::Values(0, 1, 3, 4, 5, 8), testing::Range(0, 5)));

double base_error(const Mechanics<double>& fitted, const Mechanics<double>& truth,
                  const FreeParameters& free, const MatrixX<double>& R) {
  const VectorX<double> units = column_units(truth, free);
  const BaseParameters base = base_parameters(R, units);
  const VectorX<double> error = base.map * (free.values_of(fitted) - free.values_of(truth));
  double worst = 0;
  for (int i = 0; i < base.rank; ++i)
    worst = std::max(worst, std::abs(error[i]) / units[base.columns[i]]);
  return worst;
}

class NoiseFree : public testing::TestWithParam<std::tuple<int, int>> {};

TEST_P(NoiseFree, FitFindsTheBaseParameters) {
  const auto [family, kind] = GetParam();
  const Mechanics<double> truth = with_friction(families()[family].make(4));
  const FreeParameters free = all_bodies(truth.model);
  const Samples samples = motion_of(truth, 200);
  FitOptions options;
  options.residual = kinds[kind];
  const Fit result = fit(moved(truth, free, 0.3), free, samples, options);
  ASSERT_TRUE(result.converged) << result.message;
  EXPECT_LE(base_error(result.robot, truth, free, result.R), 1e-8);
}

// chain, tree, floating_base, one_hinge, one_slide
INSTANTIATE_TEST_SUITE_P(Families, NoiseFree,
                         testing::Combine(testing::Values(0, 1, 3, 8, 9), testing::Range(0, 5)));

TEST(Fit, FrictionAndArmatureAreFoundAlong) {
  Mechanics<double> truth = with_friction(armature(2));
  const FreeParameters free = everything(truth.model);
  const Samples samples = motion_of(truth, 300);
  const Fit result = fit(moved(truth, free, 0.3), free, samples, {});
  ASSERT_TRUE(result.converged) << result.message;
  EXPECT_LE(base_error(result.robot, truth, free, result.R), 1e-8);
  EXPECT_LE((result.robot.viscous - truth.viscous).norm(), 1e-8);
  EXPECT_LE((result.robot.coulomb - truth.coulomb).norm(), 1e-8);
}

TEST(Fit, WhatTheDataDoNotSeeStaysAtTheStart) {
  const Mechanics<double> truth = with_friction(one_hinge(3));
  const FreeParameters free = all_bodies(truth.model);
  const Mechanics<double> start = moved(truth, free, 0.3);
  const Fit result = fit(start, free, motion_of(truth, 100), {});
  // about its axis e_z and gravity, a hinge shows mx, my and Izz; m is seen by nothing
  EXPECT_NEAR(result.robot.model.M(0).I(2, 2), truth.model.M(0).I(2, 2), 1e-9);
  EXPECT_NEAR(result.robot.model.M(0).h[0], truth.model.M(0).h[0], 1e-9);
  EXPECT_NEAR(result.robot.model.M(0).m, start.model.M(0).m, 0.3 * start.model.M(0).m);
}

TEST(Fit, BodiesStayPhysicalUnderNoise) {
  const Mechanics<double> truth = with_friction(tree(6));
  const FreeParameters free = all_bodies(truth.model);
  Samples samples = motion_of(truth, 100);
  Random random(8);
  const VectorX<double> sizes = row_sizes(samples.tau);
  for (int i = 0; i < samples.count(); ++i)
    for (int k = 0; k < truth.model.nv(); ++k)
      samples.tau(k, i) += 0.2 * sizes[k] * random.normal();
  for (const Residual kind : {Residual::inverse_dynamics, Residual::innovations}) {
    FitOptions options;
    options.residual = kind;
    const Fit result = fit(truth, free, samples, options);
    ASSERT_TRUE(result.usable);
    for (const int k : free.bodies) {
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(
          pseudo_inertia(result.robot.model.M(k)));
      EXPECT_GE(eigen.eigenvalues()[0], -1e-15 * eigen.eigenvalues()[3]) << k;
    }
  }
}

TEST(Fit, BoundsHold) {
  const Mechanics<double> truth = with_friction(chain(7, 5));
  const FreeParameters free = all_bodies(truth.model);
  const Mechanics<double> start = moved(truth, free, 0.5);
  FitOptions options;
  options.mass_within = 1.05;
  options.com_within = 0.01;
  const Fit result = fit(start, free, motion_of(truth, 100), options);
  for (const int k : free.bodies) {
    const SpatialInertia<double>&is = result.robot.model.M(k), &was = start.model.M(k);
    EXPECT_LE(std::abs(std::log(is.m / was.m)), std::log(1.05) + 1e-12);
    EXPECT_LE((is.h / is.m - was.h / was.m).cwiseAbs().maxCoeff(), 0.01 + 1e-12);
  }
}

TEST(Fit, StrongPriorKeepsTheStart) {
  const Mechanics<double> truth = with_friction(chain(7, 4));
  const FreeParameters free = all_bodies(truth.model);
  const Mechanics<double> start = moved(truth, free, 0.3);
  FitOptions options;
  options.prior = 1e6;
  const Fit result = fit(start, free, motion_of(truth, 100), options);
  const VectorX<double> was = free.values_of(start);
  EXPECT_LE((free.values_of(result.robot) - was).norm(), 1e-6 * was.norm());
}

// With noise of known size the 95 per cent intervals hold the truth in 95 per cent of fits: of 300
// numbers between 270 and 300 (six standard deviations).
TEST(Fit, IntervalsHoldTheTruthAsOftenAsTheySay) {
  const Mechanics<double> truth = with_friction(one_hinge(3));
  const FreeParameters free = all_bodies(truth.model);
  const Samples exact = motion_of(truth, 60);
  boost::random::mt19937_64 engine(5);
  boost::random::normal_distribution<double> normal;
  int held = 0, all = 0;
  for (int run = 0; run < 100; ++run) {
    Samples samples = exact;
    for (double& tau : samples.tau.reshaped()) tau += 0.02 * normal(engine);
    const Fit result = fit(truth, free, samples, {});
    const BaseParameters base = base_parameters(result.R, column_units(truth, free));
    ASSERT_EQ(base.rank, 3);
    const VectorX<double> error = base.map * (free.values_of(result.robot) - free.values_of(truth));
    const MatrixX<double> covariance = base.map * result.covariance * base.map.transpose();
    for (int i = 0; i < base.rank; ++i, ++all)
      held += std::abs(error[i]) <= 1.96 * std::sqrt(covariance(i, i));
  }
  EXPECT_GE(held, 270);
  EXPECT_LT(held, all);
}

MatrixX<double> regressor_triangle(const Mechanics<double>& robot, const Samples& samples) {
  return jacobian_triangle(robot, all_bodies(robot.model), samples,
                           residual_options(Residual::inverse_dynamics, robot, samples));
}

TEST(Identifiability, OneHingeShowsThreeNumbersAndOneAlongGravityOne) {
  Joint<double> joint;
  joint.body = {2, {0.1, 0.2, 0.3}, {1, 0, 0, 0}, {0.1, 0.1, 0.15}};
  for (const bool vertical : {false, true}) {
    Builder builder;
    builder.add(joint);
    const Mechanics<double> robot = with_friction(
        builder.build(vertical ? Vector3<double>(0, 0, -9.81) : Vector3<double>(0, -9.81, 0)));
    const FreeParameters free = all_bodies(robot.model);
    const BaseParameters base =
        base_parameters(regressor_triangle(robot, motion_of(robot, 50)), column_units(robot, free));
    EXPECT_EQ(base.rank, vertical ? 1 : 3);
    EXPECT_EQ(base.alone, vertical ? std::vector<int>({6}) : std::vector<int>({1, 2, 6}));
    EXPECT_EQ(base.unseen.size(), vertical ? 9U : 7U);
  }
}

// Textbook: Izz1 + m2 l1^2, mx1 + m2 l1, my1, mx2, my2, Izz2.
TEST(Identifiability, TwoLinkArmHasSixBaseParameters) {
  const Mechanics<double> robot = with_friction(planar_two_link(1));
  const FreeParameters free = all_bodies(robot.model);
  const BaseParameters base =
      base_parameters(regressor_triangle(robot, motion_of(robot, 50)), column_units(robot, free));
  ASSERT_EQ(base.rank, 6);
  const std::vector<std::string> names = column_names(free, {"1", "2"}, {"1", "2"});
  const VectorX<double> theta = free.values_of(robot);
  for (int i = 0; i < base.rank; ++i) {
    const std::string lead = names[base.columns[i]];
    const double value = base.map.row(i) * theta;
    if (lead == "mx(2)") {
      EXPECT_NEAR(value, 0.5, 1e-9);
    } else if (lead == "Izz(2)") {
      EXPECT_NEAR(value, 0.1 + 0.25, 1e-9);
    } else if (lead == "my(1)" || lead == "my(2)") {
      EXPECT_NEAR(value, 0, 1e-9);
    }
  }
  // the combinations see a mass on link 2 as if it sat on link 1's tip
  VectorX<double> exchange = VectorX<double>::Zero(20);
  exchange << -1, -1, 0, 0, 0, -1, -1, 0, 0, 0, 1, VectorX<double>::Zero(9);
  EXPECT_LE((base.map * exchange).norm(), 1e-8);
}

TEST(Identifiability, RestShowsWhatIsLost) {
  const Mechanics<double> robot = with_friction(planar_two_link(1));
  const FreeParameters free = all_bodies(robot.model);
  Samples samples = motion_of(robot, 50);
  samples.qd.setZero();
  samples.qdd.setZero();  // gravity alone: no moment of inertia
  const MatrixX<double> R = regressor_triangle(robot, samples);
  const Lost lost =
      lost_parameters(scene_of(robot.model), robot, free, Residual::inverse_dynamics, R);
  EXPECT_EQ(lost.rank, 6);
  EXPECT_EQ(base_parameters(R, column_units(robot, free)).rank, 4);
  const int Izz_of_2 = body_parameters + 6, mx_of_2 = body_parameters + 1;
  EXPECT_EQ(std::count(lost.columns.begin(), lost.columns.end(), Izz_of_2), 1);
  EXPECT_EQ(std::count(lost.columns.begin(), lost.columns.end(), mx_of_2), 0);
}

TEST(Identifiability, NoiseInAnUnseenColumnIsNoRank) {
  MatrixX<double> R = MatrixX<double>::Identity(3, 3);
  R(2, 2) = 1e-17;
  EXPECT_EQ(rank_and_condition(R).rank, 2);
  EXPECT_NEAR(rank_and_condition(R).condition, 1, 1e-12);
}

// Accelerations are the derivatives of velocities, and those of positions, also of orientations.
TEST(Excitation, MotionIsConsistentAndWithinItsLimits) {
  const Model<double> model = floating_base(3);
  Scene scene = scene_of(model);
  ExcitationOptions options;
  options.count = 20001;
  options.candidates = 1;
  const Samples samples = excite(scene, options).samples;
  const double dt = samples.time[1] - samples.time[0];
  const LinkKinematics<double> at_rest(model);
  for (const int i : {100, 7000, 15000}) {
    EXPECT_LE(((samples.qd.col(i + 1) - samples.qd.col(i - 1)) / (2 * dt) - samples.qdd.col(i))
                  .cwiseAbs()
                  .maxCoeff(),
              1e-5);
    for (int k = 0; k < model.nv(); ++k) {
      const int at = model.joint(k).q_index;
      if (model.joint(k).coordinate == Coordinate::quaternion) {
        const auto quaternion = [&](int column) {
          const auto q = samples.q.col(column).segment<4>(at);
          return Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
        };
        // omega = 2 q* q' in the body's axes
        const Eigen::Quaterniond rate = quaternion(i - 1).conjugate() * quaternion(i + 1);
        EXPECT_LE((rate.vec() / dt - samples.qd.col(i).segment<3>(k)).norm(), 1e-5);
      } else if (model.joint(k).coordinate != Coordinate::follower) {
        EXPECT_NEAR((samples.q(at, i + 1) - samples.q(at, i - 1)) / (2 * dt), samples.qd(k, i),
                    1e-5);
      }
    }
  }
  for (int k = 0; k < model.nv(); ++k)
    if (model.joint(k).coordinate == Coordinate::angle) {
      EXPECT_LE(samples.qd.row(k).cwiseAbs().maxCoeff(), options.speed * 1.001);
      const auto [low, high] = scene.range[model.joint(k).q_index];
      EXPECT_GE(samples.q.row(model.joint(k).q_index).minCoeff(), low - 1e-3);
      EXPECT_LE(samples.q.row(model.joint(k).q_index).maxCoeff(), high + 1e-3);
    }
}

TEST(Excitation, MoreCandidatesAreNoWorse) {
  const Scene scene = scene_of(chain(5, 6));
  ExcitationOptions one, many;
  one.candidates = 1;
  many.candidates = 60;
  EXPECT_LE(excite(scene, many).condition, excite(scene, one).condition);
}

TEST(TorqueError, OfOnePerCentIsOnePerCent) {
  const Mechanics<double> robot = with_friction(chain(5, 3));
  Samples samples = motion_of(robot, 40);
  EXPECT_LE(torque_error(robot, samples).total, 1e-14);
  samples.tau /= 1.01;  // the robot says 1 per cent more than was measured
  const TorqueError error = torque_error(robot, samples);
  EXPECT_NEAR(error.total, 0.01, 1e-12);
  EXPECT_NEAR(error.joints.maxCoeff(), 0.01, 1e-12);
}

}  // namespace
}  // namespace kalmarm::test
