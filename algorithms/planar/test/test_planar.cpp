// Planar and translational mechanisms against truth of the world frame in three dimensions: every
// answer, in float and double; which mechanisms they are; and their promises: flops, outcomes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/planar/planar_solver.hpp"
#include "algorithms/planar/test/support.hpp"
#include "algorithms/planar/translational_solver.hpp"
#include "algorithms/test/allocations.hpp"

namespace kalmarm::test {
namespace {

template <class T>
MatrixX<T> poisoned_matrix(int rows, int columns) {
  return MatrixX<T>::Constant(rows, columns, std::numeric_limits<T>::quiet_NaN());
}

// Two DoF, and sites on the base, on the last link and on another.
template <class T>
Selection<T> some_selection(const Model<double>& model) {
  Random random(9);
  Selection<double> selection;
  selection.dofs = {model.nv() - 1, model.nv() / 2};
  for (const int link : {-1, model.nv() - 1, model.nv() / 3})
    selection.sites.push_back({link, random.quaternion(), 0.3 * random.vector3()});
  Selection<T> out{selection.dofs, {}};
  for (const Site<double>& site : selection.sites) out.sites.push_back(site.cast<T>());
  return out;
}

MatrixX<Mp> columns_of(const Selection<Mp>& selection, const Model<Mp>& model,
                       const VectorX<Mp>& q) {
  RandomModel<Mp> rm(model);
  set_position(model, q, rm);
  const int dofs = static_cast<int>(selection.dofs.size());
  MatrixX<Mp> J(6 * selection.sites.size(), model.nv());
  site_jacobian(model, rm, selection.sites, Eigen::Ref<MatrixX<Mp>>(J));
  MatrixX<Mp> B = MatrixX<Mp>::Zero(model.nv(), selection.size());
  for (int j = 0; j < dofs; ++j) B(selection.dofs[j], j) = 1;
  B.rightCols(J.rows()) = J.transpose();
  return B;
}

// Largest |X - exact| / sqrt(diagonal diagonal) of entries i, j that move. What cannot move is
// zero.
template <class T>
double error(const MatrixX<T>& X, const MatrixX<Mp>& exact) {
  Mp worst = 0;
  for (int i = 0; i < X.rows(); ++i)
    for (int j = 0; j < X.cols(); ++j) {
      const Mp size = sqrt(Mp(exact(i, i) * exact(j, j)));
      const Mp d = abs(Mp(Mp(X(i, j)) - exact(i, j)));
      const Mp relative = size == 0 ? d : Mp(d / size);
      if (!(relative <= worst)) worst = relative;
    }
  return worst.convert_to<double>();
}

// Errors of every answer in units of the roundoff.
struct Errors {
  double acceleration = 0, solve = 0, inverse = 0, diagonal = 0, log_det = 0, selected = 0;

  double worst() const {
    return std::max({acceleration, solve, inverse, diagonal, log_det, selected});
  }
};

template <class T, class PartialSolverOf>
Errors errors(const Model<double>& drawn, std::uint64_t seed) {
  const Model<T> model = drawn.cast<T>();
  const int nv = model.nv();
  const State<T> state = random_state(drawn, seed + 1000).template cast<T>();
  const Model<Mp> exact = model.template cast<Mp>();
  const Truth truth(exact, state.template cast<Mp>());
  const MatrixX<Mp> inverse =
      Eigen::LDLT<MatrixX<Mp>>(truth.M).solve(MatrixX<Mp>::Identity(nv, nv));
  const double u = static_cast<double>(unit_roundoff<T>());
  PartialSolverOf solver(model);
  Errors out;

  VectorX<T> a = poisoned<T>(nv), x = a, diagonal = a;
  EXPECT_TRUE(solver.acceleration(state.q, state.qd, state.tau, a));
  out.acceleration = truth.error(a) / u;

  EXPECT_TRUE(solver.factor(state.q));
  solver.solve(state.tau, x);
  const VectorX<Mp> tau = state.tau.template cast<Mp>(), solved = inverse * tau;
  const VectorX<Mp> d = x.template cast<Mp>() - solved;
  out.solve = Mp(sqrt(Mp(d.dot(truth.M * d) / solved.dot(tau)))).convert_to<double>() / u;

  MatrixX<T> X = poisoned_matrix<T>(nv, nv);
  EXPECT_TRUE(solver.inverse(state.q, X));
  EXPECT_TRUE(X == X.transpose());
  out.inverse = error(X, inverse) / u;

  EXPECT_TRUE(solver.diagonal(state.q, diagonal));
  for (int k = 0; k < nv; ++k) {
    const Mp relative = abs(Mp(Mp(diagonal[k]) / inverse(k, k) - 1));
    out.diagonal = std::max(out.diagonal, relative.convert_to<double>() / u);
  }

  T log_det = std::numeric_limits<T>::quiet_NaN();
  EXPECT_TRUE(solver.log_det(state.q, log_det));
  Mp exact_log_det = 0, size = 1;
  const VectorX<Mp> D = Eigen::LLT<MatrixX<Mp>>(truth.M).matrixLLT().diagonal();
  for (int k = 0; k < nv; ++k) {
    exact_log_det += 2 * log(D[k]);
    size += abs(Mp(2 * log(D[k])));
  }
  out.log_det = Mp(abs(Mp(Mp(log_det) - exact_log_det)) / size).convert_to<double>() / u;

  const Selection<T> selection = some_selection<T>(drawn);
  Selection<Mp> selection_mp{selection.dofs, {}};
  for (const Site<T>& site : selection.sites)
    selection_mp.sites.push_back(site.template cast<Mp>());
  const MatrixX<Mp> B = columns_of(selection_mp, exact, state.q.template cast<Mp>());
  solver.select(selection);
  MatrixX<T> S = poisoned_matrix<T>(selection.size(), selection.size());
  EXPECT_TRUE(solver.selected(state.q, S));
  EXPECT_TRUE(S == S.transpose());
  out.selected = error(S, MatrixX<Mp>(B.transpose() * inverse * B)) / u;
  return out;
}

template <class T, template <class> class SolverOf>
void expect_accurate(const std::vector<Family>& families, int seeds, double bound) {
  for (const Family& family : families) {
    Errors worst;
    for (int seed = 0; seed < seeds; ++seed) {
      SCOPED_TRACE(std::string(family.name) + " seed " + std::to_string(seed));
      const Errors e = errors<T, SolverOf<T>>(family.make(seed), seed);
      for (const auto& part : {&Errors::acceleration, &Errors::solve, &Errors::inverse,
                               &Errors::diagonal, &Errors::log_det, &Errors::selected}) {
        EXPECT_LE(e.*part, bound);
        worst.*part = std::max(worst.*part, e.*part);
      }
    }
    testing::Test::RecordProperty(
        family.name, std::to_string(worst.acceleration) + " " + std::to_string(worst.solve) + " " +
                         std::to_string(worst.inverse) + " " + std::to_string(worst.diagonal) +
                         " " + std::to_string(worst.log_det) + " " +
                         std::to_string(worst.selected));
  }
}

template <class T>
class Planes : public testing::Test {};
template <class T>
class Translations : public testing::Test {};

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Planes, Precisions, PrecisionName);
TYPED_TEST_SUITE(Translations, Precisions, PrecisionName);

TYPED_TEST(Planes, EveryAnswerAgreesWithTruth) {
  expect_accurate<TypeParam, PlanarSolver>(planar_families(), 10, 60);
}

// A slide between massless links comes near to a singular state, as a wrist does.
TYPED_TEST(Planes, MasslessLinksLoseWhatTheConditionAllows) {
  expect_accurate<TypeParam, PlanarSolver>({{"planar_massless", planar_massless}}, 10, 500);
}

TYPED_TEST(Translations, EveryAnswerAgreesWithTruth) {
  expect_accurate<TypeParam, TranslationalSolver>(translational_families(), 10, 20);
}

// Slides in a plane or along its normal are both.
TYPED_TEST(Translations, PlanarFilterAgrees) {
  expect_accurate<TypeParam, TranslationalSolver>(
      {{"slides_in_the_plane", slides_in_the_plane}, {"one_planar_slide", one_planar_slide}}, 5,
      20);
}

// Hinges and slides whose quaternions are integers, and axes parallel to all digits.
Model<double> exactly_planar() {
  Random random(4);
  Builder builder;
  const std::vector<Eigen::Quaterniond> rotations{{3, 1, -2, 5}, {2, 0, 0, 1}, {5, -3, 4, 0},
                                                  {5, 3, -4, 0}, {0, 2, 1, 0}, {3, 0, 0, 2}};
  const std::vector<int> parents{-1, 0, 1, 2, 3, 1};
  for (int k = 0; k < 6; ++k) {
    const bool slides = k == 2 || k == 4;
    Joint<double> joint =
        random_joint(random, parents[k], slides ? Coordinate::distance : Coordinate::angle);
    joint.rotation = rotations[k];
    if (k == 3) joint.r = 0.2;
    builder.add(joint);
  }
  return builder.build();
}

TEST(PlanarFilter, EquationsHoldInMultiPrecision) {
  const Model<double> drawn = exactly_planar();
  const Model<Mp> model = drawn.cast<Mp>();
  const State<Mp> state = random_state(drawn, 4).cast<Mp>();
  const auto plane = find_plane(model);
  ASSERT_TRUE(plane);
  const Truth truth(model, state);
  PlanarModel<Mp> planar(model, *plane);
  PlanarWorkspace<Mp> ws(planar);
  const AlongNormal<Mp> along(model, *plane);
  ASSERT_EQ(planar.nv() + along.slides.size(), 6);
  ASSERT_EQ(along.dofs, std::vector<int>{4});
  VectorX<Mp> a = poisoned<Mp>(6);
  planar_acceleration(planar, state.q.data(), state.qd.data(), state.tau.data(), ws, a.data());
  TranslationalFactors<Mp> factors(along.slides, Vector3<Mp>(plane->axes * model.gravity()),
                                   Mp(1e-20));
  factors.solve([&](int i) { return state.tau[along.dofs[i]]; },
                [&](int i, const Mp& x) { a[along.dofs[i]] = x + factors.by_weight()[i]; });
  EXPECT_LE(truth.error(a), 1e-40);
}

TEST(PlanarFilter, HingeOfAChainCostsAtMost110Flops) {
  for (int n : {10, 40}) {
    const Model<double> drawn = planar_chain(1, n);
    const State<double> state = random_state(drawn, 3);
    const PlanarModel<Count> model(drawn, *find_plane(drawn));
    PlanarWorkspace<Count> ws(model);
    const auto counts = [](const VectorX<double>& x) {
      return std::vector<Count>(x.begin(), x.end());
    };
    const std::vector<Count> q = counts(state.q), qd = counts(state.qd), tau = counts(state.tau);
    std::vector<Count> a(n);
    Count::flops = 0;
    planar_acceleration(model, q.data(), qd.data(), tau.data(), ws, a.data());
    const double flops = static_cast<double>(Count::flops) / n;
    EXPECT_LE(flops, 110) << n;
    EXPECT_GE(flops, 80) << n << ": does it count?";
    RecordProperty("flops_" + std::to_string(n), std::to_string(flops));
  }
}

TYPED_TEST(Planes, FamiliesAreFoundPlanar) {
  for (const Family& family : planar_families())
    for (int seed = 0; seed < 50; ++seed)
      EXPECT_TRUE(find_plane(family.make(seed).template cast<TypeParam>()))
          << family.name << " seed " << seed;
}

Model<double> with_joint(const Model<double>& model, int k, const Joint<double>& joint) {
  std::vector<Joint<double>> joints;
  for (int i = 0; i < model.nv(); ++i) joints.push_back(i == k ? joint : model.joint(i));
  return {joints, model.names(), model.nq(), model.gravity()};
}

// Joint k's placement turned about its x axis.
Model<double> tilted(const Model<double>& model, int k, double angle) {
  Joint<double> joint = model.joint(k);
  joint.rotation = joint.rotation * Eigen::Quaterniond(1, angle / 2, 0, 0);
  return with_joint(model, k, joint);
}

TYPED_TEST(Planes, TiltOfAMillionthIsRefused) {
  for (int k = 1; k < 10; ++k)
    EXPECT_FALSE(find_plane(tilted(planar_chain(3), k, 1e-6).cast<TypeParam>())) << k;
  EXPECT_TRUE(find_plane(tilted(planar_chain(3), 0, 1e-6).cast<TypeParam>()));  // another plane
  for (int k = 1; k < 16; ++k)
    EXPECT_FALSE(find_plane(tilted(planar_tree(3), k, 1e-6).cast<TypeParam>())) << k;
}

TYPED_TEST(Planes, ObliqueSlideIsRefused) {
  for (int seed = 0; seed < 5; ++seed) {
    PlanarBuilder builder(seed);
    builder.add(-1, Moves::turns);
    Joint<double> slide = builder.joint(0, Moves::slides_along);
    slide.rotation = slide.rotation * Eigen::Quaterniond(std::cos(std::numbers::pi / 8),
                                                         std::sin(std::numbers::pi / 8), 0, 0);
    builder.add(slide);
    EXPECT_FALSE(find_plane(builder.build().cast<TypeParam>()));
  }
}

TYPED_TEST(Planes, BallAndFreeJointsAreRefused) {
  Random random(2);
  Builder ball, free;
  ball.add_ball(random_joint(random, -1));
  free.add_free(random_joint(random, -1));
  EXPECT_FALSE(find_plane(ball.build().cast<TypeParam>()));
  EXPECT_FALSE(find_plane(free.build().cast<TypeParam>()));
  EXPECT_FALSE(is_translational(free.build().cast<TypeParam>()));
  EXPECT_FALSE(is_translational(planar_chain(1).cast<TypeParam>()));
  EXPECT_TRUE(is_translational(slides_alone(1, 4).cast<TypeParam>()));
}

TYPED_TEST(Planes, SlidesAloneArePlanarWhereTwoOfThreeAxesAreAcross) {
  EXPECT_FALSE(find_plane(slides_alone(1, 12).cast<TypeParam>()));  // any directions
  Builder gantry;                                                   // x, y, z
  Random random(3);
  for (int k = 0; k < 3; ++k) {
    Joint<double> joint = random_joint(random, k - 1, Coordinate::distance);
    joint.rotation = {1, 1, 1, 1};
    gantry.add(joint);
  }
  EXPECT_TRUE(find_plane(gantry.build().cast<TypeParam>()));
}

// Every number of every quaternion off by a roundoff, as a file has it.
TYPED_TEST(Planes, RoundingOfAFileIsAcceptedAndCostsNothing) {
  using T = TypeParam;
  for (int seed = 0; seed < 10; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed);
    Model<double> drawn = planar_everything(seed);
    for (int k = 0; k < drawn.nv(); ++k) {
      Joint<double> joint = drawn.joint(k);
      for (double& x : joint.rotation.coeffs())
        x *= 1 + random.uniform(-1, 1) * static_cast<double>(unit_roundoff<T>());
      drawn = with_joint(drawn, k, joint);
    }
    ASSERT_TRUE(find_plane(drawn.cast<T>()));
    EXPECT_LE((errors<T, PlanarSolver<T>>(drawn, seed).worst()), 60);
  }
}

struct Refusal {
  const char* name;
  Model<double> model;
  std::vector<int> joints;
};

// On a regular chain of three.
template <class Grow>
Refusal grown(const char* name, std::uint64_t seed, std::vector<int> joints, const Grow& grow) {
  PlanarBuilder builder(seed);
  for (int k = 0; k < 3; ++k) builder.add(k - 1, Moves::turns);
  grow(builder);
  return {name, builder.build(), std::move(joints)};
}

std::vector<Refusal> singular_planar_mechanisms(std::uint64_t seed) {
  return {
      grown("massless_leaf", seed, {3}, [](auto& m) { m.add_massless(2, Moves::turns); }),
      grown("massless_slide", seed, {3}, [](auto& m) { m.add_massless(2, Moves::slides_across); }),
      grown("massless_slide_along_the_normal", seed, {3},
            [](auto& m) { m.add_massless(2, Moves::slides_along); }),
      grown("two_slides_along_the_normal", seed, {3, 4},
            [](auto& m) {
              m.add_massless(2, Moves::slides_along);
              m.add(3, Moves::slides_along);
            }),
      grown("three_slides_in_a_plane", seed, {3, 4, 5},
            [](auto& m) {
              m.add_massless(2, Moves::slides_across);
              m.add_massless(3, Moves::slides_across);
              m.add(4, Moves::slides_across);
            }),
      grown("point_mass_on_its_joint_axis", seed, {3}, [](auto& m) {
        Joint<double> tip = m.joint(2, Moves::turns);
        tip.body = point_mass(0.7, {0, 0, 0.3});
        m.add(tip);
      })};
}

template <class T>
void expect_refused(PartialSolver<T>& solver, const Model<double>& drawn,
                    const std::vector<int>& joints) {
  const State<T> state = random_state(drawn, 5).template cast<T>();
  const int nv = drawn.nv();
  VectorX<T> x(nv);
  MatrixX<T> X(nv, nv), S(20, 20);
  T log_det;
  solver.select(some_selection<T>(drawn));
  for (const Outcome& outcome :
       {solver.acceleration(state.q, state.qd, state.tau, x), solver.factor(state.q),
        solver.inverse(state.q, X), solver.diagonal(state.q, x), solver.log_det(state.q, log_det),
        solver.selected(state.q, S)}) {
    EXPECT_EQ(outcome.status, Outcome::Status::singular);
    EXPECT_TRUE(std::ranges::count(joints, outcome.joint)) << outcome.joint;
  }
}

TYPED_TEST(Planes, SingularMechanismsAreRefusedAndWithArmatureAnswered) {
  using T = TypeParam;
  for (int seed = 0; seed < 10; ++seed)
    for (const Refusal& refusal : singular_planar_mechanisms(seed)) {
      SCOPED_TRACE(std::string(refusal.name) + " seed " + std::to_string(seed));
      PlanarSolver<T> solver(refusal.model.template cast<T>());
      expect_refused(solver, refusal.model, refusal.joints);
      Model<double> regular = refusal.model;
      for (int k = 0; k < regular.nv(); ++k) regular.set_noise(k, 0.1);
      EXPECT_LE((errors<T, PlanarSolver<T>>(regular, seed).worst()), 300);
    }
}

TYPED_TEST(Translations, SingularMechanismsAreRefused) {
  using T = TypeParam;
  Random random(7);
  Builder four;  // in three dimensions, and one mass
  for (int k = 0; k < 4; ++k) {
    Joint<double> joint = random_joint(random, k - 1, Coordinate::distance);
    if (k < 3) joint.body = {};
    four.add(joint);
  }
  TranslationalSolver<T> one_mass(four.build().cast<T>());
  expect_refused(one_mass, four.build(), {0});
  Model<double> leaf = slides_alone(3, 5);
  Joint<double> massless = leaf.joint(4);
  massless.body = {};
  massless.r = 0;
  leaf = with_joint(leaf, 4, massless);
  TranslationalSolver<T> solver(leaf.cast<T>());
  expect_refused(solver, leaf, {4});
}

// Hardly any mass outboard of a hinge: D is below the net, and what looks into it answers.
TYPED_TEST(Planes, SuspectsAreAnsweredToo) {
  using T = TypeParam;
  Model<double> drawn = planar_everything(3);
  const int last = drawn.nv() - 1;
  for (int k = 0; k <= last; ++k) drawn.set_noise(k, 0.1);
  drawn.set_noise(last, 1e-7 * (std::is_same_v<T, float> ? 100 : 1e-3));
  Joint<double> light = drawn.joint(last);
  light.body = {};
  drawn = with_joint(drawn, last, light);
  const Joint<double>& joint = drawn.joint(last);
  ASSERT_TRUE(joint.body.massless());
  EXPECT_LE((errors<T, PlanarSolver<T>>(drawn, 3).worst()), 500);
}

TYPED_TEST(Planes, NanIsReported) {
  using T = TypeParam;
  const Model<double> drawn = planar_everything(5);
  PlanarSolver<T> solver(drawn.cast<T>());
  const State<T> state = random_state(drawn, 5).template cast<T>();
  const int nv = drawn.nv();
  VectorX<T> a(nv);
  MatrixX<T> X(nv, nv);
  const T nan = std::numeric_limits<T>::quiet_NaN();
  for (int k = 0; k < nv; ++k) {
    State<T> bad = state;
    bad.tau[k] = nan;
    EXPECT_FALSE(solver.acceleration(bad.q, bad.qd, bad.tau, a)) << k;
  }
  int turn = 0;
  while (drawn.joint(turn).slides || drawn.parent(turn) < 0) ++turn;
  State<T> bad = state;
  bad.q[turn] = nan;
  EXPECT_FALSE(solver.acceleration(bad.q, bad.qd, bad.tau, a));
  EXPECT_FALSE(solver.factor(bad.q));
  EXPECT_FALSE(solver.inverse(bad.q, X));
  EXPECT_TRUE(solver.acceleration(state.q, state.qd, state.tau, a));
}

// What cannot move is zero to the last bit: a site with the plane's own axes.
TYPED_TEST(Planes, ComponentsThatCannotMoveAreZero) {
  using T = TypeParam;
  const Model<double> drawn = planar_chain(2);
  PlanarSolver<T> solver(drawn.cast<T>());
  solver.select({{}, {{9, {T(1), T(0), T(0), T(0.3)}, {T(0.1), T(0.2), T(0.3)}}}});
  MatrixX<T> X(6, 6);
  EXPECT_TRUE(solver.selected(random_state(drawn, 5).template cast<T>().q, X));
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) {
      const bool moves = i > 1 && i < 5 && j > 1 && j < 5;
      EXPECT_EQ(X(i, j) != T(0), moves) << i << ' ' << j;
    }
}

template <class T>
void expect_no_allocation(PartialSolver<T>& solver, const Model<double>& drawn) {
  const State<T> state = random_state(drawn, 5).template cast<T>();
  const int nv = drawn.nv();
  const Selection<T> selection = some_selection<T>(drawn);
  VectorX<T> x(nv);
  MatrixX<T> X(nv, nv), S(selection.size(), selection.size());
  T log_det;
  solver.select(selection);
  const long before = allocations;
  bool ok = static_cast<bool>(solver.acceleration(state.q, state.qd, state.tau, x));
  ok = solver.factor(state.q) && ok;
  solver.solve(state.tau, x);
  ok = solver.inverse(state.q, X) && solver.diagonal(state.q, x) && ok;
  ok = solver.log_det(state.q, log_det) && solver.selected(state.q, S) && ok;
  EXPECT_EQ(allocations, before);
  EXPECT_TRUE(ok);
}

TYPED_TEST(Planes, NothingIsAllocatedOnceASolverIsMade) {
  using T = TypeParam;
  for (const Model<double>& drawn : {planar_everything(5), planar_chain(5, 40)}) {
    PlanarSolver<T> solver(drawn.cast<T>());
    expect_no_allocation(solver, drawn);
  }
  TranslationalSolver<T> solver(slides_alone(5, 20).cast<T>());
  expect_no_allocation(solver, slides_alone(5, 20));
}

}  // namespace
}  // namespace kalmarm::test
