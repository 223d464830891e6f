// Simulations against proven ends: the order of each method, what is unstable, float32, and MuJoCo.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "accuracy/motion/simulate.hpp"
#include "accuracy/motion/test/oscillator.hpp"
#include "accuracy/motion/truth.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm::motion {
namespace {

constexpr Effort once = {.repetitions = 1, .least = 0};

Errors error_of(const Motion& motion, const Truth& truth, const Method& method) {
  const Simulation end = simulate(motion, method, once);
  EXPECT_EQ(end.status, Status::ok) << method.integrator << ' ' << method.step;
  return errors(motion.robot, end.q, end.v, truth.q, truth.v);
}

// log2 of what half the step gains, in q and in v.
Errors order_of(const Motion& motion, const std::string& integrator, double h) {
  const Truth truth = true_end(motion);
  const Errors whole = error_of(motion, truth, {.integrator = integrator, .step = h});
  const Errors half = error_of(motion, truth, {.integrator = integrator, .step = h / 2});
  return {std::log2(whole.q / half.q), std::log2(whole.v / half.v)};
}

const std::map<std::string, double> orders = {
    {"semi_implicit_euler", 1}, {"rk4", 4}, {"springs_at_start", 1}, {"springs_at_end", 1}};

TEST(Orders, OfAnOscillatorWhoseTargetMovesAreThoseOfTheMethods) {
  const Motion motion = Oscillator{.k = 800, .b = 30, .swept = 200}.motion();
  for (const auto& [integrator, order] : orders) {
    const Errors measured = order_of(motion, integrator, 1e-3);
    EXPECT_NEAR(measured.q, order, 0.1) << integrator;
    EXPECT_NEAR(measured.v, order, 0.1) << integrator;
  }
}

// Of a quaternion that turns by several radians, where (3) of motion.hpp counts.
TEST(Orders, OfATumblingBodyAreThoseOfTheMethods) {
  for (const auto& [integrator, order] : orders) {
    const Errors measured = order_of(tumbling(2), integrator, 5e-3);
    EXPECT_NEAR(measured.q, order, 0.1) << integrator;
    EXPECT_NEAR(measured.v, order, 0.1) << integrator;
  }
}

TEST(Orders, OfMujocoAreThoseOfItsIntegrators) {
  const Motion motion = make_motion(load_scene("panda"), {.duration = 0.2, .stiffness = 1e3});
  for (const auto& [integrator, order] :
       std::map<std::string, double>{{"mj_implicitfast", 1}, {"mj_discrete", 1}, {"mj_rk4", 4}})
    EXPECT_NEAR(order_of(motion, integrator, 5e-4).q, order, 0.15) << integrator;
}

TEST(Simulations, WithSpringsAtTheEndAreThoseOfMujocosDiscrete) {
  const Motion motion = make_motion(load_scene("go2"), {.duration = 0.1, .stiffness = 1e4});
  for (const auto& [ours, theirs] : std::map<std::string, std::string>{
           {"springs_at_end", "mj_discrete"}, {"springs_at_start", "mj_implicitfast"}}) {
    const Simulation a = simulate(motion, {.integrator = ours, .step = 2e-4}, once);
    const Simulation b = simulate(motion, {.integrator = theirs, .step = 2e-4}, once);
    ASSERT_EQ(a.status, Status::ok);
    ASSERT_EQ(b.status, Status::ok);
    const Errors apart = errors(motion.robot, a.q, a.v, b.q, b.v);
    EXPECT_LE(apart.q, 1e-10) << ours;
    EXPECT_LE(apart.v, 1e-10) << ours;
  }
}

// h w = 2 is the limit of semi-implicit Euler, 2.8 of RK4; springs at the end have none.
TEST(Stability, EndsWhereTheTheoryHasIt) {
  const Oscillator oscillator{.m = 1, .k = 1e4, .duration = 10};  // w = 100
  const Motion motion = oscillator.motion();
  const auto [q, v] = oscillator.end();
  const VectorX<long double> true_q = VectorX<long double>::Constant(1, q),
                             true_v = VectorX<long double>::Constant(1, v);
  const auto status = [&](const char* integrator, double h) {
    const Simulation end = simulate(motion, {.integrator = integrator, .step = h}, once);
    if (end.status != Status::ok) return end.status;
    return judged(end.status, errors(motion.robot, end.q, end.v, true_q, true_v));
  };
  EXPECT_EQ(status("semi_implicit_euler", 0.02 * 1.25), Status::unstable);
  EXPECT_EQ(status("rk4", 0.04), Status::unstable);
  EXPECT_EQ(status("springs_at_start", 0.025), Status::unstable);
  EXPECT_EQ(status("semi_implicit_euler", 2e-4), Status::ok);
  EXPECT_EQ(status("rk4", 1e-3), Status::ok);
  const Simulation damped = simulate(motion, {.integrator = "springs_at_end", .step = 0.1}, once);
  ASSERT_EQ(damped.status, Status::ok);  // it comes to rest: h is far above what follows the motion
  EXPECT_NEAR(static_cast<double>(damped.q[0]), 0.25 + 3e-4, 1e-9);
}

TEST(Stability, IsLostWhereAMotionIsOffByMoreThanItself) {
  EXPECT_EQ(judged(Status::ok, {0.5, 0.5}), Status::ok);
  EXPECT_EQ(judged(Status::ok, {1.5, 0.5}), Status::unstable);
  EXPECT_EQ(judged(Status::ok, {0.5, 1.5}), Status::unstable);
  EXPECT_EQ(judged(Status::ok, {NAN, 0}), Status::unstable);
  EXPECT_EQ(judged(Status::given_up, {0, 0}), Status::given_up);
}

// Undamped, the energy of a spring is that of its start but for the method's own error.
TEST(Energy, OfAnUndampedSpringIsKeptByRungeAndKutta) {
  Oscillator oscillator{.force = 0};
  const Simulation end = simulate(oscillator.motion(), {.integrator = "rk4", .step = 1e-4}, once);
  const auto energy = [&](double q, double v) {
    return oscillator.m * v * v / 2 + oscillator.k * (q - oscillator.q0) * (q - oscillator.q0) / 2;
  };
  const double before = energy(oscillator.q, oscillator.v);
  EXPECT_NEAR(energy(static_cast<double>(end.q[0]), static_cast<double>(end.v[0])), before,
              1e-9 * before);
}

// Each to about its tolerance, and better by a smaller one.
TEST(AdaptiveMethods, KeepTheirTolerance) {
  const Motion motion = make_motion(load_scene("two_link"), {.stiffness = 1e3});
  const Truth truth = true_end(motion);
  for (const Integrator& integrator : integrators()) {
    if (!integrator.adaptive) continue;
    const Errors loose = error_of(motion, truth, {.integrator = integrator.name, .step = 1e-4});
    const Errors tight = error_of(motion, truth, {.integrator = integrator.name, .step = 1e-9});
    EXPECT_LE(loose.q, 1e-2) << integrator.name;
    EXPECT_LE(tight.q, 1e-6) << integrator.name;
    EXPECT_LE(tight.q, 0.1 * loose.q) << integrator.name;
  }
}

TEST(AdaptiveMethods, AreGivenUpAtTheirCap) {
  const Motion motion = Oscillator{.k = 1e6}.motion();
  for (const Integrator& integrator : integrators()) {
    if (!integrator.adaptive) continue;
    const Simulation end = simulate(motion, {.integrator = integrator.name, .step = 1e-12},
                                    {.repetitions = 1, .cap = 50});
    EXPECT_EQ(end.status, Status::given_up) << integrator.name;
    EXPECT_EQ(end.calls, 50) << integrator.name;
  }
}

// A step of 2 ms of stiff joints: rounding to float32 moves the end by far less than the step does.
TEST(Float32, IsRightToTheErrorOfTheStep) {
  const Motion motion = make_motion(load_scene("two_link"), {.duration = 0.1, .stiffness = 1e5});
  const Truth truth = true_end(motion);
  for (const bool last_bits : {false, true}) {
    const Method wide = {.integrator = "springs_at_end", .last_bits = last_bits, .step = 2e-3};
    Method narrow = wide;
    narrow.float32 = true;
    const Simulation a = simulate(motion, narrow, once), b = simulate(motion, wide, once);
    const Errors rounding = errors(motion.robot, a.q, a.v, b.q, b.v);
    EXPECT_LE(rounding.q, 0.05 * error_of(motion, truth, wide).q) << last_bits;
    EXPECT_GT(rounding.q, 1e-9) << last_bits;  // it is float32
  }
}

TEST(Simulations, CountTheirStepsAndCalls) {
  const Motion motion = Oscillator{}.motion();
  for (const auto& [integrator, calls] :
       std::map<std::string, long>{{"semi_implicit_euler", 1}, {"rk4", 4}, {"springs_at_end", 1}}) {
    const Simulation end = simulate(motion, {.integrator = integrator, .step = 5e-3});
    EXPECT_EQ(end.steps, 100) << integrator;
    EXPECT_EQ(end.calls, 100 * calls) << integrator;
    EXPECT_GT(end.seconds, 0) << integrator;
  }
}

TEST(Simulations, ThatCannotBeHadAreRefused) {
  const Motion motion = Oscillator{}.motion();
  EXPECT_THROW((void)simulate(motion, {.integrator = "euler", .step = 5e-3}), InputError);
  EXPECT_THROW((void)simulate(motion, {.integrator = "mj_euler", .step = 5e-3}), InputError);
  EXPECT_THROW((void)simulate(motion, {.integrator = "mj_euler", .float32 = true, .step = 5e-3}),
               InputError);
  EXPECT_THROW((void)simulate(motion, {.integrator = "rk4", .step = 3e-3}), InputError);
}

}  // namespace
}  // namespace kalmarm::motion
