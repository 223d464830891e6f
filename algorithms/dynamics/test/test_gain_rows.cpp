// Rows of states with gains of their own: each row's equation with the dense matrices of mechanics in
// 50 digits, the step of a robot that is built with the row's gains, rows that rounding may spoil, and
// what is refused.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "algorithms/dynamics/test/door_support.hpp"
#include "algorithms/fast/engine/engine.hpp"
#include "algorithms/fast/test/mechanisms_that_lose.hpp"
#include "algorithms/fast/test/truth.hpp"
#include "kalmarm/implicit_step.hpp"

namespace kalmarm::test {
namespace {

constexpr double h = 0.002;
constexpr Scheme schemes[] = {Scheme::springs_at_end, Scheme::springs_at_start};

template <class T>
using Rows = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// States, gains and armatures, of every row others. Some rows and DoF have no gains and no armature, and no ball or free
// joint springs.
template <class T>
struct Batch {
  Rows<T> q, v, tau, damping, stiffness, reference, armature, a;
  std::vector<Outcome> outcomes;

  Batch(const Model<double>& model, int count, std::uint64_t seed)
      : q(count, model.nq()),
        v(count, model.nv()),
        tau(v),
        damping(v),
        stiffness(v),
        reference(v),
        armature(v),
        a(poisoned<T>(count, model.nv())),
        outcomes(count) {
    Random random(seed);
    const auto decades = [&](double low, double high) {
      return static_cast<T>(std::pow(10, random.uniform(low, high)));
    };
    for (int i = 0; i < count; ++i) {
      const State<T> state = random_state(model, seed + i).template cast<T>();
      q.row(i) = state.q;
      v.row(i) = state.qd;
      tau.row(i) = state.tau;
      for (int k = 0; k < model.nv(); ++k) {
        const bool none = (i + k) % 5 == 0;
        damping(i, k) = none ? T(0) : decades(-2, 4);
        stiffness(i, k) = none || !is_single(model, k) ? T(0) : decades(0, 6);
        reference(i, k) = static_cast<T>(random.uniform(-1, 1));
        armature(i, k) = none ? T(0) : decades(-6, 0);
      }
    }
  }

  GainRows<T> gains() const { return {damping, stiffness, reference, armature}; }
  int count() const { return static_cast<int>(outcomes.size()); }
};

template <class T>
std::vector<double> numbers(const Rows<T>& rows, int i) {
  std::vector<double> out;
  for (int k = 0; k < rows.cols(); ++k) out.push_back(static_cast<double>(rows(i, k)));
  return out;
}

template <class T>
VectorX<double> wide(const Rows<T>& rows, int i) {
  return rows.row(i).transpose().template cast<double>();
}

template <class T>
State<double> state_of(const Batch<T>& batch, int i) {
  return {wide(batch.q, i), wide(batch.v, i), wide(batch.tau, i)};
}

template <class T>
JointTerms terms_of(const Batch<T>& batch, int i) {
  return {numbers(batch.damping, i), numbers(batch.stiffness, i), numbers(batch.reference, i)};
}

// The robot with a row's armatures.
template <class T>
RobotModel robot_of(const Model<double>& model, const Batch<T>& batch, int i) {
  RobotModel out = plain(model);
  for (int k = 0; k < out.nv(); ++k)
    out.links[k].armature = static_cast<double>(batch.armature(i, k));
  return out;
}

template <class T>
class StepsOfGainRows : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(StepsOfGainRows, Scalars);

// (2) of every row, beside the sizes of its terms.
TYPED_TEST(StepsOfGainRows, SolveEachTheirOwnEquation) {
  using T = TypeParam;
  for (const Family& family : robots())
    for (const Scheme scheme : schemes) {
      SCOPED_TRACE(family.name);
      const Model<double> model = rounded<T>(family.make(3));
      const int nv = model.nv();
      Batch<T> batch(model, 11, 5);
      ImplicitStep<T> step(plain(model), h, {}, scheme);
      ASSERT_EQ(
          step.acceleration(batch.q, batch.v, batch.tau, batch.gains(), batch.a, batch.outcomes),
          0);
      const double at_end = scheme == Scheme::springs_at_end ? h : 0;
      for (int i = 0; i < batch.count(); ++i) {
        const State<double> state = state_of(batch, i);
        const VectorX<double>&q = state.q, &v = state.qd, a = wide(batch.a, i);
        const DenseMechanics truth = dense_mechanics(model_of(robot_of(model, batch, i)), state);
        for (int k = 0; k < nv; ++k) {
          const double b = batch.damping(i, k), s = batch.stiffness(i, k), tau = state.tau[k];
          const double q_k = s > 0 ? q[model.joint(k).q_index] : 0, q0 = batch.reference(i, k);
          const double spring = s * (q_k - q0 + at_end * v[k]), r = h * (b + at_end * s);
          const double bias = truth.bias[k];
          const double flaw = truth.M.row(k).dot(a) + r * a[k] - (tau - bias - b * v[k] - spring);
          const double size = truth.M.row(k).cwiseAbs().dot(a.cwiseAbs()) + std::abs(r * a[k]) +
                              std::abs(tau) + std::abs(bias) + std::abs(b * v[k]) +
                              s * (std::abs(q_k) + std::abs(q0)) + std::abs(spring) + 1;
          EXPECT_LE(std::abs(flaw) / size, 2000 * double(unit_roundoff<T>())) << i << ' ' << k;
        }
      }
    }
}

// Which other kernels answer: slides alone, the certified form, robots without joint noise.
TYPED_TEST(StepsOfGainRows, AreThoseOfRobotsWithTheirGains) {
  using T = TypeParam;
  for (const Family& family : robots())
    for (const Scheme scheme : schemes)
      for (const Tolerance tolerance : tolerances) {
        const Model<double> model = rounded<T>(family.make(2));
        SCOPED_TRACE(std::string(family.name) + ' ' + name_of(tolerance));
        const int nv = model.nv(), count = tolerance ? 3 : 21;
        Batch<T> batch(model, count, 7);
        ImplicitStep<T> step(plain(model), h, {}, scheme, {.tolerance = tolerance});
        ASSERT_EQ(step.acceleration(batch.q, batch.v, batch.tau, batch.gains(), batch.a,
                                    batch.outcomes, 2),
                  0);
        for (int i = 0; i < count; ++i) {
          ImplicitStep<T> own(robot_of(model, batch, i), h, terms_of(batch, i), scheme,
                              {.tolerance = tolerance});
          VectorX<T> one = poisoned<T>(nv);
          const VectorX<T> q = batch.q.row(i), v = batch.v.row(i), tau = batch.tau.row(i);
          ASSERT_TRUE(own.acceleration(q, v, tau, one));
          EXPECT_LE((one - VectorX<T>(batch.a.row(i))).norm(),
                    4000 * unit_roundoff<T>() * one.norm())
              << i;
          EXPECT_GE(batch.outcomes[i].error, 0);
        }
      }
}

// What is left out is the step's own, and the next call has others, more or fewer of them.
TYPED_TEST(StepsOfGainRows, TakeWhatIsLeftOutFromTheStep) {
  using T = TypeParam;
  const Model<double> model = rounded<T>(creature(2));
  const int count = 40;
  Batch<T> batch(model, count, 3);
  const JointTerms own = terms_of(batch, 1);
  ImplicitStep<T> step(plain(model), h, own);
  Rows<T> all = poisoned<T>(count, model.nv());
  const auto expect_of = [&](const GainRows<T>& some) {
    Batch<T> filled = batch;
    const auto fill = [&](const RowsView<const T>& given, const std::vector<double>& from,
                          Rows<T>& to) {
      for (int i = 0; !given.data() && i < count; ++i)
        for (int k = 0; k < model.nv(); ++k) to(i, k) = static_cast<T>(from[k]);
    };
    fill(some.damping, own.damping, filled.damping);
    fill(some.stiffness, own.stiffness, filled.stiffness);
    fill(some.reference, own.reference, filled.reference);
    std::vector<double> armature;
    for (const LinkParameters& link : plain(model).links) armature.push_back(link.armature);
    fill(some.armature, armature, filled.armature);
    ASSERT_EQ(step.acceleration(batch.q, batch.v, batch.tau, some, all, batch.outcomes), 0);
    ASSERT_EQ(step.acceleration(filled.q, filled.v, filled.tau, filled.gains(), filled.a,
                                filled.outcomes),
              0);
    EXPECT_LE((all - filled.a).norm(), 100 * unit_roundoff<T>() * all.norm());
  };
  expect_of({.damping = batch.damping});
  expect_of({.stiffness = batch.stiffness});
  expect_of({.reference = batch.reference});
  expect_of({.damping = batch.damping, .reference = batch.reference});
  expect_of({.armature = batch.armature});
  expect_of({});
}

// References are part of the torque alone: they may stand beside terms that couple joints.
TYPED_TEST(StepsOfGainRows, MayHaveReferencesBesideCoupledJoints) {
  using T = TypeParam;
  const Model<double> model = rounded<T>(chain(4));
  const int nv = model.nv(), count = 5;
  Batch<T> batch(model, count, 9);
  JointTerms terms = terms_of(batch, 1);
  CoupledRow row = {.jacobian = std::vector<double>(nv, 0.5), .damping = 3, .stiffness = 1e4};
  terms.rows = {row};
  ImplicitStep<T> step(plain(model), h, terms);
  ASSERT_EQ(step.acceleration(batch.q, batch.v, batch.tau, {.reference = batch.reference}, batch.a,
                              batch.outcomes),
            0);
  for (int i = 0; i < count; ++i) {
    terms.reference = numbers(batch.reference, i);
    ImplicitStep<T> own(plain(model), h, terms);
    VectorX<T> one = poisoned<T>(nv);
    const VectorX<T> q = batch.q.row(i), v = batch.v.row(i), tau = batch.tau.row(i);
    ASSERT_TRUE(own.acceleration(q, v, tau, one));
    EXPECT_LE((one - VectorX<T>(batch.a.row(i))).norm(), 4000 * unit_roundoff<T>() * one.norm());
  }
  EXPECT_THROW((void)step.acceleration(batch.q, batch.v, batch.tau, {.damping = batch.damping},
                                       batch.a, batch.outcomes),
               std::invalid_argument);
}

// Masses that grow a millionfold to the tip: where a sweep cannot be believed, the row gets a second
// look or the certified form with its own joint noise.
TYPED_TEST(StepsOfGainRows, AreRightWhereRoundingSpoilsASweep) {
  using T = TypeParam;
  const Model<double> model = rounded<T>(growing(2, std::is_same_v<T, float> ? 1e6 : 1e13));
  const int nv = model.nv(), count = 33;
  Batch<T> batch(model, count, 4);
  batch.damping *= T(1e-3);
  batch.stiffness *= T(1e-3);
  batch.armature *= T(1e-6);
  ImplicitStep<T> step(plain(model), h, {});
  ASSERT_EQ(step.acceleration(batch.q, batch.v, batch.tau, batch.gains(), batch.a, batch.outcomes),
            0);
  int looked_at = 0;
  for (int i = 0; i < count; ++i) {
    // (2) is that of a robot with more armature, pushed by what springs and dampers do beside it.
    RobotModel heavier = robot_of(model, batch, i);
    State<double> state = state_of(batch, i);
    for (int k = 0; k < nv; ++k) {
      const double b = batch.damping(i, k), s = batch.stiffness(i, k), v = state.qd[k];
      heavier.links[k].armature += h * b + h * h * s;
      const double stretched = state.q[model.joint(k).q_index] - batch.reference(i, k) + h * v;
      state.tau[k] -= b * v + s * stretched;
    }
    // In |x|_M, the scale of what Outcome::error says (force_noise.hpp), beside which the rounding of
    // torque and armature is small here.
    EXPECT_LE(Truth(model_of(heavier), state).energy(wide(batch.a, i)),
              4 * batch.outcomes[i].error + 1e3 * double(unit_roundoff<T>()))
        << i;
    looked_at += batch.outcomes[i].rung > answered_in_lanes<T>().rung;
  }
  EXPECT_GT(looked_at, 0);
}

TEST(StepsOfGainRowsRefuse, WhatNoGainsAre) {
  const Model<double> model = floating_base(1);
  const RobotModel robot = plain(model);
  const int nv = robot.nv();
  Batch<double> batch(model, 4, 1);
  ImplicitStep<double> step(robot, h, {});
  const auto refused = [&](const GainRows<double>& gains, const std::string& says) {
    try {
      (void)step.acceleration(batch.q, batch.v, batch.tau, gains, batch.a, batch.outcomes);
      ADD_FAILURE() << says;
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(says), std::string::npos) << error.what();
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    }
  };
  Rows<double> given;
  const auto with = [&](int row, int dof, double x) -> const Rows<double>& {
    given = Rows<double>::Zero(4, nv);
    given(row, dof) = x;
    return given;
  };
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  const std::string last = "row 2, DoF '" + robot.names.back() + "': ";
  refused({.damping = with(2, nv - 1, -1)}, last + "damping -1");
  refused({.damping = with(2, nv - 1, nan)}, last + "damping nan");
  refused({.stiffness = with(2, nv - 1, -0.5)}, last + "stiffness -0.5");
  refused({.stiffness = with(2, nv - 1, inf)}, last + "stiffness inf");
  refused({.reference = with(2, nv - 1, nan)}, last + "reference nan");
  refused({.armature = with(2, nv - 1, -2)}, last + "armature -2");
  refused({.stiffness = with(1, 4, 1)}, "a spring about a ball or a free joint");
  const Rows<double> few = Rows<double>::Zero(3, nv), narrow = Rows<double>::Zero(4, nv - 1);
  refused({.damping = few},
          "rows of damping are 3 x " + std::to_string(nv) + ", needed 4 x " + std::to_string(nv));
  refused({.reference = narrow}, "rows of reference are 4 x");
}

}  // namespace
}  // namespace kalmarm::test
