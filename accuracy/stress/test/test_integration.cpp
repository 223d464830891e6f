// A free fall is what mechanics says it is, and its calls are counted.
#include <gtest/gtest.h>

#include <boost/math/special_functions/jacobi_elliptic.hpp>
#include <cmath>
#include <stdexcept>
#include <string>

#include "accuracy/stress/families.hpp"
#include "accuracy/stress/integration.hpp"
#include "robots/scene/generate.hpp"

namespace kalmarm::stress {
namespace {

const Vector3<double> in_plane(0, -9.81, 0);

Case heavy_tip(double rho) {
  for (const Family& family : families())
    if (family.name == "heavy_tip") return family.make(rho, 1);
  throw std::runtime_error("no family heavy_tip");
}

Integration fall_of(const std::string& variant, const Case& c, const Fall& fall = {}) {
  return free_fall(*make_solver(variant, c.model), c.model, c.q, fall);
}

// One hinge along z, the com at a distance of 0.7 m along x, gravity along -y.
Model<double> pendulum() {
  Joint<double> joint;
  joint.body.mass = 2;
  joint.body.com = {0.7, 0, 0};
  joint.body.moments = {0.1, 0.2, 0.3};
  joint.r = 0.4;
  return assemble({joint}, in_plane);
}

// With theta the angle from hanging down and w^2 = m g d / (I + m d^2 + r):
//   sin(theta / 2) = k cd(w t, k),  k = sin(theta(0) / 2)
TEST(FreeFall, PendulumFollowsItsEllipticFunction) {
  const double q0 = 0.4, half_pi = std::acos(0.0), duration = 1.7;
  const double w = std::sqrt(2 * 9.81 * 0.7 / (0.3 + 2 * 0.7 * 0.7 + 0.4));
  const double k = std::sin((q0 + half_pi) / 2);
  const double theta = 2 * std::asin(k * boost::math::jacobi_cd(k, w * duration));
  const Case c{pendulum(), VectorX<double>::Constant(1, q0), {}};
  const Integration fall =
      fall_of("Sequential<Conventional>", c, {.duration = duration, .tolerance = 1e-11});
  ASSERT_TRUE(fall.finished);
  EXPECT_NEAR(fall.q[0], theta - half_pi, 1e-9);
  const double speed = w * std::sqrt(2 * (std::cos(theta) - std::cos(q0 + half_pi)));
  EXPECT_NEAR(std::abs(fall.qd[0]), speed, 1e-9);
}

// Link 2 stands upright at the end of link 1; q' = (2, -3) rad/s. In base axes its com is at
// (1, 0.25) and moves with (0, 2) + (2 - 3) e_z x (0, 0.25) = (0.25, 2).
TEST(Energy, IsThatOfTwoLinksByHand) {
  Joint<double> first, second;
  first.body = {3, {0.5, 0, 0}, {1, 0, 0, 0}, {0.1, 0.1, 0.2}};
  first.r = 0.5;
  second.parent = 0;
  second.translation = {1, 0, 0};
  second.body = {4, {0.25, 0, 0}, {1, 0, 0, 0}, {0.1, 0.1, 0.3}};
  const Model<long double> model = assemble({first, second}, in_plane).cast<long double>();
  const long double quarter = std::acos(0.0L);
  const VectorX<long double> q{{0, quarter}}, qd{{2, -3}};
  const Energy e = energy(model, q, qd);
  const long double first_K = (3 * 1.0L + 0.2L * 4 + 0.5L * 4) / 2;
  const long double second_K = (4 * (0.0625L + 4) + 0.3L * 1) / 2;
  EXPECT_NEAR(static_cast<double>(e.kinetic), static_cast<double>(first_K + second_K), 1e-14);
  EXPECT_NEAR(static_cast<double>(e.potential), 4 * 9.81 * 0.25, 1e-14);
  EXPECT_EQ(e.total(), e.kinetic + e.potential);
}

TEST(FreeFall, EveryVariantConservesEnergyOfEvenMasses) {
  const Case c = heavy_tip(1);
  for (const std::string& variant : usual_variants) {
    const Integration fall = fall_of(variant, c);
    EXPECT_TRUE(fall.finished) << variant;
    EXPECT_LT(fall.energy_drift, 1e-8) << variant;
    EXPECT_GT(fall.qd.norm(), 0.1) << variant;
  }
}

TEST(FreeFall, CallsAreTheSameAgain) {
  const Case c = heavy_tip(1e4);
  const Integration fall = fall_of("FactoredBias<ArrayMGS>", c);
  const Integration again = fall_of("FactoredBias<ArrayMGS>", c);
  EXPECT_TRUE(fall.finished);
  EXPECT_EQ(fall.calls, again.calls);
  EXPECT_EQ(fall.q, again.q);
}

TEST(FreeFall, CapEndsIt) {
  const Case c = heavy_tip(1);
  const int needed = fall_of("Sequential<ArrayMGS>", c).calls;
  EXPECT_TRUE(fall_of("Sequential<ArrayMGS>", c, {.cap = needed}).finished);
  const Integration capped = fall_of("Sequential<ArrayMGS>", c, {.cap = needed - 1});
  EXPECT_FALSE(capped.finished);
  EXPECT_EQ(capped.calls, needed - 1);
  EXPECT_TRUE(std::isnan(capped.energy_drift));
}

// A hinge that turns nothing.
TEST(FreeFall, FailureOfTheSolverEndsIt) {
  Joint<double> joint;
  joint.body.mass = 1;
  const Case c{assemble({joint}, in_plane), VectorX<double>::Zero(1), {}};
  for (const std::string& variant : usual_variants) {
    const Integration fall = fall_of(variant, c);
    EXPECT_FALSE(fall.finished) << variant;
    EXPECT_EQ(fall.calls, 1) << variant;
    EXPECT_TRUE(std::isnan(fall.energy_drift)) << variant;
  }
}

// Fails at the given call and falls freely before.
class FailsLater : public Solver<double> {
 public:
  explicit FailsLater(int at) : left_(at) {}
  Outcome acceleration(const VectorX<double>&, const VectorX<double>&, const VectorX<double>&,
                       VectorX<double>& a) override {
    a.setConstant(-9.81);
    return {.status = --left_ > 0 ? Outcome::Status::ok : Outcome::Status::indefinite};
  }
  Outcome factor(const VectorX<double>&) override { return {}; }
  void solve(const VectorX<double>&, VectorX<double>&) override {}
  void mass(const VectorX<double>&, MatrixX<double>&) override {}
  Outcome inverse(const VectorX<double>&, MatrixX<double>&) override { return {}; }
  bool has_factors() const override { return false; }
  Outcome factors(const VectorX<double>&, VectorX<double>&, MatrixX<double>&) override {
    return {};
  }
  Vector6<double> P_plus_times(int, const Vector6<double>& x) const override { return x; }

 private:
  int left_;
};

TEST(FreeFall, FailureWithinAStepIsTheLastCall) {
  const VectorX<double> q = VectorX<double>::Zero(1);
  for (const int at : {1, 2, 7, 8}) {
    FailsLater solver(at);
    const Integration fall = free_fall(solver, pendulum(), q, {});
    EXPECT_FALSE(fall.finished) << at;
    EXPECT_EQ(fall.calls, at);
  }
}

// Steps shrink to where rounding is below the tolerance, which is what the calls are counted for.
TEST(FreeFall, ALessAccurateVariantNeedsMoreCalls) {
  const Case c = heavy_tip(1e12);
  const int factored = fall_of("FactoredBias<ArrayGivens>", c).calls;
  EXPECT_LT(factored, 1000);
  EXPECT_GT(fall_of("Batch<EigenLLT>", c).calls, 2 * factored);
}

}  // namespace
}  // namespace kalmarm::stress
