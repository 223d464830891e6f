// Mechanisms of slides alone against truth of the world frame in three dimensions: every
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

// The kernel that is tested, whatever a plan would take; a selection may name DoF in any order.
template <class T>
class Robot {
 public:
  Robot(const Model<double>& model, const Selection& selection)
      : engine_(make_engine<T>(plain(model), options(selection))) {}

  Outcome forward_dynamics(const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau,
                           VectorX<T>& a) {
    return engine_->answer({.want = Want::acceleration,
                            .q = q.data(),
                            .qd = qd.data(),
                            .tau = tau.data(),
                            .out = a.data()});
  }
  Outcome factor(const VectorX<T>& q) {
    return engine_->factor({.want = Want::solve, .q = q.data()});
  }
  Outcome solve(const VectorX<T>& tau, VectorX<T>& x) {
    return engine_->solve(1, tau.data(), x.data());
  }
  Outcome inverse_mass(const VectorX<T>& q, MatrixX<T>& X) {
    return engine_->answer({.want = Want::inverse, .q = q.data(), .out = X.data()});
  }
  Outcome diagonal(const VectorX<T>& q, VectorX<T>& x) {
    return engine_->answer({.want = Want::diagonal, .q = q.data(), .out = x.data()});
  }
  Outcome log_det(const VectorX<T>& q, T& x) {
    return engine_->answer({.want = Want::log_det, .q = q.data(), .out = &x});
  }
  Outcome selected(const VectorX<T>& q, MatrixX<T>& X) {
    return engine_->answer({.want = Want::operational, .q = q.data(), .out = X.data()});
  }
  Outcome selected_diagonal(const VectorX<T>& q, VectorX<T>& x) {
    return engine_->answer({.want = Want::operational_diagonal, .q = q.data(), .out = x.data()});
  }

 private:
  static EngineOptions options(const Selection& selection) {
    EngineOptions out;
    out.kernel = Kernel::translational;
    out.selection = selection;
    out.want = {Want::acceleration, Want::solve,   Want::inverse,
                Want::diagonal,     Want::log_det, Want::operational_diagonal};
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
Errors errors(const Model<double>& drawn, std::uint64_t seed) {
  const Model<double> model = rounded<T>(drawn);
  const int nv = model.nv();
  const State<T> state = random_state(drawn, seed + 1000).template cast<T>();
  const Truth truth(model, state.template cast<double>());
  const double u = static_cast<double>(unit_roundoff<T>());
  const Selection selection = some_selection<T>(drawn);
  Robot<T> robot(model, selection);
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
  VectorX<T> of_S = poisoned<T>(selection.size());
  EXPECT_TRUE(robot.selected_diagonal(state.q, of_S));
  EXPECT_TRUE(of_S == S.diagonal());
  out.selected = truth.selected(selection, S) / u;
  return out;
}

// Within `bound` u.
template <class T>
void expect_accurate(const std::vector<Family>& families, int seeds, double bound) {
  for (const Family& family : families) {
    Errors worst;
    for (int seed = 0; seed < seeds; ++seed) {
      SCOPED_TRACE(std::string(family.name) + " seed " + std::to_string(seed));
      const Model<double> model = family.make(seed);
      const Errors e = errors<T>(model, seed);
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
class Translations : public testing::Test {};

using Precisions = testing::Types<double>;  // in float the answer is rounded
TYPED_TEST_SUITE(Translations, Precisions, PrecisionName);

TYPED_TEST(Translations, EveryAnswerAgreesWithTruth) {
  expect_accurate<TypeParam>(translational_families(), 10, 20);
}

template <class T>
void expect_refused(const Model<double>& drawn, const std::vector<int>& joints) {
  const State<T> state = random_state(drawn, 5).template cast<T>();
  const int nv = drawn.nv();
  Robot<T> robot(drawn, some_selection<T>(drawn));
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

TYPED_TEST(Translations, SingularMechanismsAreRefused) {
  using T = TypeParam;
  Random random(7);
  Builder four;  // in three dimensions, and one mass
  for (int k = 0; k < 4; ++k) {
    Joint<double> joint = random_joint(random, k - 1, Coordinate::distance);
    if (k < 3) joint.body = {};
    four.add(joint);
  }
  expect_refused<T>(four.build(), {0});
  Model<double> leaf = slides_alone(3, 5);
  Joint<double> massless = leaf.joint(4);
  massless.body = {};
  massless.r = 0;
  leaf = with_joint(leaf, 4, massless);
  expect_refused<T>(leaf, {4});
}

}  // namespace
}  // namespace kalmarm::test
