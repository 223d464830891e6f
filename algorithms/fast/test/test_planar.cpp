// Planar and translational mechanisms against truth of the world frame in three dimensions: every
// answer, and their outcomes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/fast/engine/engine.hpp"
#include "algorithms/fast/planar/plane.hpp"
#include "algorithms/fast/planar/translational.hpp"
#include "algorithms/fast/test/planar_support.hpp"

namespace kalmarm::test {
namespace {

// Two DoF, not in rising order, and frames on the base, on the last link and on another.
template <class T>
Selection some_selection(const Model<double>& model) {
  Random random(9);
  Selection selection;
  selection.dofs = {model.nv() - 1, model.nv() / 2};
  for (const int link : {-1, model.nv() - 1, model.nv() / 3}) {
    const Eigen::Quaterniond rotation = random.quaternion();
    const Vector3<double> translation = 0.3 * random.vector3();
    selection.frames.push_back(
        {link, plain(rounded<T>(rotation)), plain(Vector3<double>(rounded<T>(translation)))});
  }
  return selection;
}

// The kernels that are tested, whatever a plan would take: it looks for planes in double, and a
// selection may name DoF in any order.
template <class T>
class Robot {
 public:
  Robot(const Model<double>& model, Kernel kernel, const Selection& selection = {})
      : engine_(make_engine<T>(plain(model), options(kernel, selection))) {}

  Outcome forward_dynamics(const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau,
                           VectorX<T>& a) {
    return engine_->forward_dynamics(q.data(), qd.data(), tau.data(), a.data());
  }
  Outcome factor(const VectorX<T>& q) { return engine_->factor(q.data()); }
  Outcome solve(const VectorX<T>& tau, VectorX<T>& x) {
    return engine_->solve(1, tau.data(), x.data());
  }
  Outcome inverse_mass(const VectorX<T>& q, MatrixX<T>& X) {
    return engine_->inverse(q.data(), X.data());
  }
  Outcome diagonal(const VectorX<T>& q, VectorX<T>& x) {
    return engine_->diagonal(q.data(), x.data());
  }
  Outcome log_det(const VectorX<T>& q, T& x) { return engine_->log_det(q.data(), x); }
  Outcome selected(const VectorX<T>& q, MatrixX<T>& X) {
    return engine_->selected(q.data(), X.data());
  }

 private:
  static EngineOptions options(Kernel kernel, const Selection& selection) {
    EngineOptions out;
    out.kernel = kernel;
    out.selection = selection;
    out.want = {Want::acceleration, Want::solve, Want::inverse, Want::diagonal, Want::log_det};
    return out;
  }

  std::unique_ptr<Engine<T>> engine_;
};

// Errors of every answer in units of the roundoff.
struct Errors {
  double acceleration = 0, solve = 0, inverse = 0, diagonal = 0, log_det = 0, selected = 0;

  double worst() const {
    return std::max({acceleration, solve, inverse, diagonal, log_det, selected});
  }
};

template <class T>
Errors errors(Kernel kernel, const Model<double>& drawn, std::uint64_t seed) {
  const Model<double> model = rounded<T>(drawn);
  const int nv = model.nv();
  const State<T> state = random_state(drawn, seed + 1000).template cast<T>();
  const Truth truth(model, state.template cast<double>());
  const double u = static_cast<double>(unit_roundoff<T>());
  const Selection selection = some_selection<T>(drawn);
  Robot<T> robot(model, kernel, selection);
  Errors out;

  VectorX<T> a = poisoned<T>(nv), x = a, diagonal = a;
  EXPECT_TRUE(robot.forward_dynamics(state.q, state.qd, state.tau, a));
  out.acceleration = truth.acceleration(a) / u;

  EXPECT_TRUE(robot.factor(state.q));
  EXPECT_TRUE(robot.solve(state.tau, x));
  out.solve = truth.solution(x) / u;

  MatrixX<T> X = poisoned<T>(nv, nv);
  EXPECT_TRUE(robot.inverse_mass(state.q, X));
  EXPECT_TRUE(X == X.transpose());
  out.inverse = truth.inverse(X) / u;

  EXPECT_TRUE(robot.diagonal(state.q, diagonal));
  out.diagonal = truth.diagonal(diagonal) / u;

  T log_det = std::numeric_limits<T>::quiet_NaN();
  EXPECT_TRUE(robot.log_det(state.q, log_det));
  out.log_det = truth.log_det(log_det) / truth.log_det_size() / u;

  MatrixX<T> S = poisoned<T>(selection.size(), selection.size());
  EXPECT_TRUE(robot.selected(state.q, S));
  EXPECT_TRUE(S == S.transpose());
  out.selected = truth.selected(selection, S) / u;
  return out;
}

// Within `bound` u, of planar chains of n > 10 joints within sqrt(n / 10) times as much: planar
// kernels take sines of the sum of all angles to the base, which is rounded to u times its size,
// and the size of a sum of n random angles grows as sqrt(n).
template <class T>
void expect_accurate(Kernel kernel, const std::vector<Family>& families, int seeds,
                     double bound_of_ten) {
  for (const Family& family : families) {
    Errors worst;
    for (int seed = 0; seed < seeds; ++seed) {
      SCOPED_TRACE(std::string(family.name) + " seed " + std::to_string(seed));
      const Model<double> model = family.make(seed);
      const double bound = kernel == Kernel::planar
                               ? bound_of_ten * std::sqrt(std::max(1.0, model.nv() / 10.0))
                               : bound_of_ten;
      const Errors e = errors<T>(kernel, model, seed);
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

using Precisions = testing::Types<double>;  // in float the answer is rounded
TYPED_TEST_SUITE(Planes, Precisions, PrecisionName);
TYPED_TEST_SUITE(Translations, Precisions, PrecisionName);

TYPED_TEST(Planes, EveryAnswerAgreesWithTruth) {
  expect_accurate<TypeParam>(Kernel::planar, planar_families(), 10, 60);
}

// A slide between massless links comes near to a singular state, as a wrist does.
TYPED_TEST(Planes, MasslessLinksLoseWhatTheConditionAllows) {
  expect_accurate<TypeParam>(Kernel::planar, {{"planar_massless", planar_massless}}, 10, 500);
}

TYPED_TEST(Translations, EveryAnswerAgreesWithTruth) {
  expect_accurate<TypeParam>(Kernel::translational, translational_families(), 10, 20);
}

// Slides in a plane or along its normal are both.
TYPED_TEST(Translations, PlanarFilterAgrees) {
  expect_accurate<TypeParam>(
      Kernel::translational,
      {{"slides_in_the_plane", slides_in_the_plane}, {"one_planar_slide", one_planar_slide}}, 5,
      20);
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
    EXPECT_LE(errors<T>(Kernel::planar, drawn, seed).worst(), 60);
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
void expect_refused(Kernel kernel, const Model<double>& drawn, const std::vector<int>& joints) {
  const State<T> state = random_state(drawn, 5).template cast<T>();
  const int nv = drawn.nv();
  Robot<T> robot(drawn, kernel, some_selection<T>(drawn));
  VectorX<T> x(nv);
  MatrixX<T> X(nv, nv), S(20, 20);
  T log_det;
  for (const Outcome& outcome :
       {robot.forward_dynamics(state.q, state.qd, state.tau, x), robot.factor(state.q),
        robot.inverse_mass(state.q, X), robot.diagonal(state.q, x), robot.log_det(state.q, log_det),
        robot.selected(state.q, S)}) {
    EXPECT_EQ(outcome.status, Outcome::Status::singular);
    EXPECT_TRUE(std::ranges::count(joints, outcome.joint)) << outcome.joint;
  }
}

TYPED_TEST(Planes, SingularMechanismsAreRefusedAndWithArmatureAnswered) {
  using T = TypeParam;
  for (int seed = 0; seed < 10; ++seed)
    for (const Refusal& refusal : singular_planar_mechanisms(seed)) {
      SCOPED_TRACE(std::string(refusal.name) + " seed " + std::to_string(seed));
      expect_refused<T>(Kernel::planar, refusal.model, refusal.joints);
      Model<double> regular = refusal.model;
      for (int k = 0; k < regular.nv(); ++k) regular.set_noise(k, 0.1);
      EXPECT_LE(errors<T>(Kernel::planar, regular, seed).worst(), 300);
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
  expect_refused<T>(Kernel::translational, four.build(), {0});
  Model<double> leaf = slides_alone(3, 5);
  Joint<double> massless = leaf.joint(4);
  massless.body = {};
  massless.r = 0;
  leaf = with_joint(leaf, 4, massless);
  expect_refused<T>(Kernel::translational, leaf, {4});
}

// Hardly any mass outboard of a hinge: D is below the threshold, and others answer.
TYPED_TEST(Planes, SuspectsAreAnsweredToo) {
  using T = TypeParam;
  Model<double> drawn = planar_everything(3);
  const int last = drawn.nv() - 1;
  for (int k = 0; k <= last; ++k) drawn.set_noise(k, 0.1);
  drawn.set_noise(last, 1e-10);
  Joint<double> light = drawn.joint(last);
  light.body = {};
  drawn = with_joint(drawn, last, light);
  const Joint<double>& joint = drawn.joint(last);
  ASSERT_TRUE(joint.body.massless());
  EXPECT_LE(errors<T>(Kernel::planar, drawn, 3).worst(), 500);
}

TYPED_TEST(Planes, NanIsReported) {
  using T = TypeParam;
  const Model<double> drawn = planar_everything(5);
  Robot<T> robot(drawn, Kernel::planar);
  const State<T> state = random_state(drawn, 5).template cast<T>();
  const int nv = drawn.nv();
  VectorX<T> a(nv);
  MatrixX<T> X(nv, nv);
  const T nan = std::numeric_limits<T>::quiet_NaN();
  for (int k = 0; k < nv; ++k) {
    State<T> bad = state;
    bad.tau[k] = nan;
    EXPECT_FALSE(robot.forward_dynamics(bad.q, bad.qd, bad.tau, a)) << k;
  }
  int turn = 0;
  while (drawn.joint(turn).slides || drawn.parent(turn) < 0) ++turn;
  State<T> bad = state;
  bad.q[turn] = nan;
  EXPECT_FALSE(robot.forward_dynamics(bad.q, bad.qd, bad.tau, a));
  EXPECT_FALSE(robot.factor(bad.q));
  EXPECT_FALSE(robot.inverse_mass(bad.q, X));
  EXPECT_TRUE(robot.forward_dynamics(state.q, state.qd, state.tau, a));
}

// What cannot move is zero to the last bit: a site with the plane's own axes.
TYPED_TEST(Planes, ComponentsThatCannotMoveAreZero) {
  using T = TypeParam;
  const Model<double> drawn = planar_chain(2);
  Robot<T> robot(drawn, Kernel::planar, {{}, {Frame{9, {1, 0, 0, 0.3}, {0.1, 0.2, 0.3}}}});
  MatrixX<T> X(6, 6);
  EXPECT_TRUE(robot.selected(random_state(drawn, 5).template cast<T>().q, X));
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) {
      const bool moves = i > 1 && i < 5 && j > 1 && j < 5;
      EXPECT_EQ(X(i, j) != T(0), moves) << i << ' ' << j;
    }
}

}  // namespace
}  // namespace kalmarm::test
