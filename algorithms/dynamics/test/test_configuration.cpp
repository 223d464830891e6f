// Positions with quaternions: displacements and differences undo each other, tiny turns and turns
// of pi, Jacobians against matrix exponentials in 50 digits, random positions, and what is
// refused.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "algorithms/dynamics/test/door_support.hpp"
#include "algorithms/test/dense_mechanics.hpp"
#include "kalmarm/configuration.hpp"
#include "kalmarm/implicit_step.hpp"
#include "kalmarm/model_builder.hpp"

namespace kalmarm::test {
namespace {

constexpr double pi = std::numbers::pi;

template <class T>
using Rows = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

bool is_quaternion(const RobotModel& robot, int k) {
  return robot.links[k].coordinate == Coordinate::quaternion;
}

// A hinge, a ball, a slide and a free joint between others.
const RobotModel& robot() {
  static const RobotModel out = plain(everything(3));
  return out;
}

const RobotModel& ball() {
  static const RobotModel out = plain(body_on_the_base<&Builder::add_ball>(2));
  return out;
}

template <class T>
VectorX<T> random_q(std::uint64_t seed) {
  return random_state(everything(3), seed).q.template cast<T>();
}

// Random, with turns of this angle.
template <class T>
VectorX<T> displacement(std::uint64_t seed, double angle) {
  Random random(seed);
  VectorX<double> v = random.vector(robot().nv());
  for (int k = 0; k < robot().nv(); ++k)
    if (is_quaternion(robot(), k)) v.segment<3>(k) *= angle / v.segment<3>(k).norm();
  return v.cast<T>();
}

template <class T>
VectorX<T> moved(const RobotModel& model, const VectorX<T>& q, const VectorX<T>& v) {
  VectorX<T> out = poisoned<T>(model.nq);
  integrate(model, q, v, out);
  return out;
}

template <class T>
VectorX<T> between(const RobotModel& model, const VectorX<T>& q0, const VectorX<T>& q1) {
  VectorX<T> out = poisoned<T>(model.nv());
  difference(model, q0, q1, out);
  return out;
}

// With quaternions of unit length, and w >= 0.
template <class T>
VectorX<T> canonical(const RobotModel& model, VectorX<T> q) {
  for (int k = 0; k < model.nv(); ++k)
    if (is_quaternion(model, k)) {
      auto turn = q.template segment<4>(model.links[k].q_index);
      turn.normalize();
      if (turn[0] < 0) turn *= T(-1);
    }
  return q;
}

template <class T>
class Configurations : public testing::Test {};
using Scalars = testing::Types<float, double>;
TYPED_TEST_SUITE(Configurations, Scalars);

// Rounding q [+] v to T turns it by up to 2 u, and rounding v moves it by u |v|; double adds a few
// roundoffs of its own.
TYPED_TEST(Configurations, DifferencesUndoDisplacements) {
  using T = TypeParam;
  const T u = unit_roundoff<T>();
  int seed = 0;
  for (const double angle : {0.0, 1e-12, 1e-5, 0.1, 1.0, 3.0, 3.14})
    for (int i = 0; i < 20; ++i, ++seed) {
      const VectorX<T> q = random_q<T>(seed), v = displacement<T>(seed, angle);
      const VectorX<T> q_next = moved(robot(), q, v);
      const VectorX<T> found = between(robot(), q, q_next);
      for (int k = 0; k < robot().nv(); ++k)
        EXPECT_NEAR(found[k], v[k], 16 * u * (1 + std::abs(v[k]))) << angle << ' ' << k;
      VectorX<T> in_place = q;
      integrate(robot(), in_place, v, in_place);
      EXPECT_EQ(in_place, q_next);
      for (int k = 0; k < robot().nv(); ++k)
        if (is_quaternion(robot(), k)) {
          const int at = robot().links[k].q_index;
          EXPECT_NEAR(q_next.template segment<4>(at).norm(), 1, 4 * u);
        }
    }
}

TYPED_TEST(Configurations, DisplacementsByDifferencesArrive) {
  using T = TypeParam;
  for (int seed = 0; seed < 100; ++seed) {
    const VectorX<T> q0 = random_q<T>(seed), q1 = random_q<T>(seed + 1000);
    const VectorX<T> v = between(robot(), q0, q1);
    const VectorX<T> found = canonical(robot(), moved(robot(), q0, v));
    const VectorX<T> expected = canonical(robot(), q1);
    for (int i = 0; i < robot().nq; ++i)
      EXPECT_NEAR(found[i], expected[i], 16 * unit_roundoff<T>() * (1 + std::abs(q0[i]))) << i;
    for (int k = 0; k < robot().nv(); ++k)
      if (is_quaternion(robot(), k)) {
        EXPECT_LE(v.template segment<3>(k).norm(), T(pi));
      }
  }
}

// A power of two changes no bit, nor does the sign of a quaternion: up to squares that overflow.
TYPED_TEST(Configurations, LengthAndSignOfQuaternionsDoNotMatter) {
  using T = TypeParam;
  const VectorX<T> q0 = random_q<T>(1), q1 = random_q<T>(2), v = displacement<T>(3, 1);
  const double longest = std::ldexp(1, std::numeric_limits<T>::max_exponent / 2 - 4);
  for (const double factor : {-1.0, -longest, 1 / longest}) {
    const auto scaled = [&](VectorX<T> q) {
      for (int k = 0; k < robot().nv(); ++k)
        if (is_quaternion(robot(), k)) q.template segment<4>(robot().links[k].q_index) *= T(factor);
      return q;
    };
    EXPECT_EQ(between(robot(), scaled(q0), q1), between(robot(), q0, q1));
    EXPECT_EQ(between(robot(), q0, scaled(q1)), between(robot(), q0, q1));
    EXPECT_EQ(canonical(robot(), moved(robot(), scaled(q0), v)),
              canonical(robot(), moved(robot(), q0, v)));
    EXPECT_EQ(between(robot(), q0, scaled(q0)), VectorX<T>::Zero(robot().nv()));
  }
}

TYPED_TEST(Configurations, TinyTurnsKeepTheirDigits) {
  using T = TypeParam;
  VectorX<T> q(4), v(3);
  neutral(ball(), q);
  for (const double angle : {1e-5, 1e-12, 1e-30}) {
    v << T(angle), T(-angle / 3), T(angle / 7);
    const VectorX<T> found = between(ball(), q, moved(ball(), q, v));
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(found[k] / v[k], 1, 4 * unit_roundoff<T>()) << angle << ' ' << k;
  }
}

// A turn that is longer than pi is found as the shorter one, the other way round.
TYPED_TEST(Configurations, DifferencesAreTheShorterTurn) {
  using T = TypeParam;
  const T u = unit_roundoff<T>();
  VectorX<T> q0(4), v(3);
  q0 << T(0.3), T(-0.2), T(0.9), T(0.1);
  const Vector3<double> n = Vector3<double>(1, -2, 0.5).normalized();
  for (const double beyond : {-1e-3, -1e-5, 1e-5, 1e-3, 1.0}) {
    v = ((pi + beyond) * n).cast<T>();
    const VectorX<T> found = between(ball(), q0, moved(ball(), q0, v));
    const Vector3<double> expected = (beyond < 0 ? pi + beyond : beyond - pi) * n;
    EXPECT_LE((found.template cast<double>() - expected).norm(), 16 * u) << beyond;
  }
  VectorX<T> identity(4), half(4);
  neutral(ball(), identity);
  half << T(0), T(0.6), T(0), T(-0.8);
  const VectorX<T> found = between(ball(), identity, half);
  EXPECT_NEAR(found.norm(), pi, 4 * u);
  EXPECT_NEAR(std::abs(found[0] / T(0.6)), pi, 8 * u);
  EXPECT_EQ(found[1], T(0));
  EXPECT_LT(found[0] * found[2], T(0));
}

// exp(v~) by its series.
Matrix3<Mp> rotation(const Vector3<Mp>& v) {
  const Matrix3<Mp> V = cross_matrix(v);
  Matrix3<Mp> sum = Matrix3<Mp>::Identity(), term = sum;
  for (int n = 1; n < 80; ++n) {
    term = Matrix3<Mp>(term * V) / Mp(n);
    sum += term;
  }
  return sum;
}

// d(q [+] v)/dv of a quaternion by central differences of 1e-15, which err by 1e-30.
Matrix3<Mp> difference_by_v(const Vector3<Mp>& v) {
  const Mp e = 1e-15;
  const Matrix3<Mp> back = rotation(v).transpose();
  Matrix3<Mp> out;
  for (int j = 0; j < 3; ++j) {
    const Vector3<Mp> step = e * Vector3<Mp>::Unit(j);
    const Matrix3<Mp> D = back * (rotation(v + step) - rotation(v - step)) / (2 * e);
    out.col(j) << (D(2, 1) - D(1, 2)) / 2, (D(0, 2) - D(2, 0)) / 2, (D(1, 0) - D(0, 1)) / 2;
  }
  return out;
}

// `add` on the diagonal, and of every quaternion block(k).
template <class Block>
MatrixX<double> block_diagonal(double add, const Block& block) {
  const int nv = robot().nv();
  MatrixX<double> out = add * MatrixX<double>::Identity(nv, nv);
  for (int k = 0; k < nv; ++k)
    if (is_quaternion(robot(), k)) out.block<3, 3>(k, k) = block(k).template cast<double>();
  return out;
}

TYPED_TEST(Configurations, JacobiansOfDisplacementsAreThoseOfExponentials) {
  using T = TypeParam;
  const int nv = robot().nv();
  for (const double angle : {0.0, 1e-12, 1e-5, 0.01, 0.3, 1.0, 3.0, 3.141, 7.0}) {
    const VectorX<T> q = random_q<T>(5), v = displacement<T>(6, angle);
    MatrixX<T> dq = poisoned<T>(nv, nv), dv = dq;
    integrate_jacobians(robot(), q, v, dq, dv);
    const auto turn = [&](int k) {
      return Vector3<Mp>(v.template segment<3>(k).template cast<Mp>());
    };
    const MatrixX<double> by_q =
        block_diagonal(1, [&](int k) { return Matrix3<Mp>(rotation(turn(k)).transpose()); });
    const MatrixX<double> by_v = block_diagonal(1, [&](int k) { return difference_by_v(turn(k)); });
    const double bound = 8 * unit_roundoff<T>() * (1 + angle);  // t errs by u t
    EXPECT_LE((dq.template cast<double>() - by_q).cwiseAbs().maxCoeff(), bound) << angle;
    EXPECT_LE((dv.template cast<double>() - by_v).cwiseAbs().maxCoeff(), bound) << angle;
  }
}

// q1 = q0 [+] v, so that d1 dv = I, and, since (q0 [+] v) [-] q0 = v for every q0, d0 + d1 dq = 0.
TYPED_TEST(Configurations, JacobiansOfDifferencesAreInverseToThoseOfDisplacements) {
  using T = TypeParam;
  const int nv = robot().nv();
  const MatrixX<T> I = MatrixX<T>::Identity(nv, nv);
  for (const double angle : {0.0, 1e-12, 1e-5, 0.01, 0.3, 1.0, 3.0, 3.141}) {
    const VectorX<T> q0 = random_q<T>(5), v = displacement<T>(6, angle);
    const VectorX<T> q1 = moved(robot(), q0, v);
    MatrixX<T> dq = poisoned<T>(nv, nv), dv = dq, d0 = dq, d1 = dq;
    integrate_jacobians(robot(), q0, v, dq, dv);
    difference_jacobians(robot(), q0, q1, d0, d1);
    EXPECT_LE((d1 * dv - I).cwiseAbs().maxCoeff(), 32 * unit_roundoff<T>()) << angle;
    EXPECT_LE((d0 + d1 * dq).cwiseAbs().maxCoeff(), 32 * unit_roundoff<T>()) << angle;
  }
}

TYPED_TEST(Configurations, NeutralIsZeroWithoutATurn) {
  using T = TypeParam;
  VectorX<T> q = poisoned<T>(robot().nq), expected = VectorX<T>::Zero(robot().nq);
  neutral(robot(), q);
  for (int k = 0; k < robot().nv(); ++k)
    if (is_quaternion(robot(), k)) expected[robot().links[k].q_index] = T(1);
  EXPECT_EQ(q, expected);
}

TYPED_TEST(Configurations, RandomPositionsKeepTheirBounds) {
  using T = TypeParam;
  Random random(7);
  const int nq = robot().nq, count = 2000;
  VectorX<T> lower = random.vector(nq).cast<T>(), upper = lower;
  for (int i = 0; i < nq; ++i)
    upper[i] += i % 4 == 0 ? T(0) : static_cast<T>(std::pow(10, random.uniform(-9, 6)));
  for (int k = 0; k < robot().nv(); ++k)
    if (is_quaternion(robot(), k)) {  // not read
      lower.template segment<4>(robot().links[k].q_index) = poisoned<T>(4);
      upper.template segment<4>(robot().links[k].q_index) = poisoned<T>(4);
    }
  std::mt19937_64 generator(3);
  Rows<T> q = poisoned<T>(count, nq);
  kalmarm::random(robot(), count, lower, upper, generator, q);
  for (int k = 0; k < robot().nv(); ++k) {
    const LinkParameters& link = robot().links[k];
    for (int i = link.q_index; i < link.q_index + q_entries(link.coordinate); ++i) {
      const auto x = q.col(i).template cast<double>();
      if (is_quaternion(robot(), k)) {
        EXPECT_TRUE(
            ((q.template middleCols<4>(link.q_index).rowwise().norm().array() - T(1)).abs() <
             4 * unit_roundoff<T>())
                .all());
        continue;
      }
      const double low = lower[i], high = upper[i];
      EXPECT_TRUE((x.array() >= low && x.array() <= high).all()) << i;
      // The mean's standard deviation is (high - low) / sqrt(12 count).
      EXPECT_NEAR((x.array() - low).mean(), (high - low) / 2,
                  4 * (high - low) / std::sqrt(12.0 * count) + unit_roundoff<T>() * std::abs(high))
          << i;
    }
  }
}

// Entries of R have mean 0 and variance 1/3, their squares mean 1/3 and variance 4/45, since each
// is uniform in [-1, 1].
TEST(RandomPositions, TurnUniformly) {
  const int count = 20000;
  const VectorX<double> none = VectorX<double>::Zero(4);
  std::mt19937_64 generator(1);
  Rows<double> q(count, 4);
  kalmarm::random(ball(), count, none, none, generator, q);
  Matrix3<double> mean = Matrix3<double>::Zero(), square = mean;
  for (int i = 0; i < count; ++i) {
    const Matrix3<double> R =
        Eigen::Quaterniond(q(i, 0), q(i, 1), q(i, 2), q(i, 3)).toRotationMatrix();
    mean += R / count;
    square += R.cwiseAbs2() / count;
  }
  EXPECT_LE(mean.cwiseAbs().maxCoeff(), 3 * std::sqrt(1.0 / 3 / count));
  EXPECT_LE((square.array() - 1.0 / 3).abs().maxCoeff(), 3 * std::sqrt(4.0 / 45 / count));
}

// The standard fixes the generator, and IEEE 754 what is made of its numbers.
TEST(RandomPositions, AreTheSameWithEveryCompiler) {
  ModelBuilder builder;
  builder.add_body({.name = "x", .joint = JointType::slide, .mass = 1});
  builder.add_body(
      {.name = "b", .parent = 0, .joint = JointType::ball, .mass = 1, .inertia = {1, 1, 1}});
  const RobotModel model = builder.build();
  const VectorX<double> lower = VectorX<double>::Zero(5), upper = VectorX<double>::Ones(5);
  std::mt19937_64 generator, again;
  VectorX<double> q(5), same(5);
  kalmarm::random(model, lower, upper, generator, q);
  kalmarm::random(model, lower, upper, again, same);
  EXPECT_EQ(q, same);
  EXPECT_EQ(generator, again);
  // 14514284786278117030 is the first number of a std::mt19937_64, by its definition.
  EXPECT_EQ(q[0], std::ldexp(static_cast<double>(14514284786278117030U >> 11), -53));
  // By a generator and Marsaglia's method in Python.
  const double turn[] = {-0x1.ff0429c3a1bfcp-2, 0x1.af7465b55f228p-2, -0x1.14f7c87a2bb76p-2,
                         -0x1.6a232d77f1a7cp-1};
  for (int i = 0; i < 4; ++i) EXPECT_EQ(q[1 + i], turn[i]) << i;
}

TYPED_TEST(Configurations, RowsAreSingleStatesToTheBit) {
  using T = TypeParam;
  const int count = 5, nq = robot().nq, nv = robot().nv();
  Rows<T> q0(count, nq), q1(count, nq), v(count, nv);
  for (int i = 0; i < count; ++i) {
    q0.row(i) = random_q<T>(i);
    q1.row(i) = random_q<T>(i + 50);
    v.row(i) = displacement<T>(i, 1);
  }
  Rows<T> q_next = poisoned<T>(count, nq), back = poisoned<T>(count, nv), drawn = q_next;
  Rows<T> dq = poisoned<T>(count, nv * nv), dv = dq, d0 = dq, d1 = dq;
  const VectorX<T> lower = VectorX<T>::Constant(nq, -1), upper = VectorX<T>::Ones(nq);
  std::mt19937_64 generator(5), one_by_one(5);
  integrate(robot(), count, q0, v, q_next);
  difference(robot(), count, q0, q1, back);
  integrate_jacobians(robot(), count, q0, v, dq, dv);
  difference_jacobians(robot(), count, q0, q1, d0, d1);
  kalmarm::random(robot(), count, lower, upper, generator, drawn);
  for (int i = 0; i < count; ++i) {
    const VectorX<T> from = q0.row(i), to = q1.row(i), by = v.row(i);
    EXPECT_EQ(VectorX<T>(q_next.row(i)), moved(robot(), from, by));
    EXPECT_EQ(VectorX<T>(back.row(i)), between(robot(), from, to));
    MatrixX<T> A = poisoned<T>(nv, nv), B = A;
    const auto equals = [&](const Rows<T>& rows, const MatrixX<T>& one) {
      return Eigen::Map<const MatrixX<T>>(rows.row(i).data(), nv, nv) == one;
    };
    integrate_jacobians(robot(), from, by, A, B);
    EXPECT_TRUE(equals(dq, A) && equals(dv, B));
    difference_jacobians(robot(), from, to, A, B);
    EXPECT_TRUE(equals(d0, A) && equals(d1, B));
    VectorX<T> one(nq);
    kalmarm::random(robot(), lower, upper, one_by_one, one);
    EXPECT_EQ(VectorX<T>(drawn.row(i)), one);
  }
}

TYPED_TEST(Configurations, AreWhereStepsLead) {
  using T = TypeParam;
  VectorX<T> q = random_q<T>(1), v = displacement<T>(2, 1);
  const VectorX<T> none = VectorX<T>::Zero(robot().nv()), expected = moved(robot(), q, v);
  advance(robot(), 1, none, q, v);
  EXPECT_EQ(q, expected);
}

// Of a joint that holds a NaN, an infinity or a quaternion of no length, and of no other.
TYPED_TEST(Configurations, WhatIsNoNumberStaysInItsJoint) {
  using T = TypeParam;
  const int nv = robot().nv();
  const VectorX<T> q = random_q<T>(1), v = displacement<T>(2, 1);
  const VectorX<T> expected = moved(robot(), q, v), apart = between(robot(), q, expected);
  MatrixX<T> I(nv, nv), D(nv, nv), bad(nv, nv);
  difference_jacobians(robot(), q, expected, I, D);
  for (int k = 0; k < nv; ++k) {
    const LinkParameters& link = robot().links[k];
    const int width = q_entries(link.coordinate), dofs = is_quaternion(robot(), k) ? 3 : width;
    if (width == 0) continue;
    for (const T x :
         {std::numeric_limits<T>::quiet_NaN(), std::numeric_limits<T>::infinity(), T(0)}) {
      if (x == T(0) && !is_quaternion(robot(), k)) continue;
      VectorX<T> from = q;
      from.segment(link.q_index, width).setConstant(x);
      const VectorX<T> found = moved(robot(), from, v), far = between(robot(), from, expected);
      difference_jacobians(robot(), from, expected, I, bad);
      for (int i = 0; i < robot().nq; ++i) {
        const bool own = i >= link.q_index && i < link.q_index + width;
        EXPECT_TRUE(own ? !std::isfinite(found[i]) : found[i] == expected[i]) << k << ' ' << i;
      }
      for (int i = 0; i < nv; ++i) {
        const bool own = i >= k && i < k + dofs;
        EXPECT_TRUE(own ? !std::isfinite(far[i]) : far[i] == apart[i]) << k << ' ' << i;
        if (is_quaternion(robot(), k) && own) {
          EXPECT_TRUE(std::isnan(bad(i, i)));
        }
        if (!own) {
          EXPECT_TRUE(bad.col(i) == D.col(i));
        }
      }
    }
  }
}

template <class F>
void expect_says(const std::string& says, const F& f) {
  try {
    f();
    ADD_FAILURE() << says;
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(error.what(), says);
  }
}

TEST(ConfigurationsRefuse, WrongSizesByName) {
  const RobotModel& model = ball();
  VectorX<double> q(4), v(3);
  MatrixX<double> D(3, 3), wide(3, 4);
  Rows<double> qs(2, 4), vs(2, 3), Ds(2, 9), by_rows(3, 3);
  std::mt19937_64 generator;
  expect_says("integrate: q has size 3, 4 is needed", [&] { integrate(model, v, v, q); });
  expect_says("integrate: v has size 4, 3 is needed", [&] { integrate(model, q, q, q); });
  expect_says("integrate: q_next has size 3, 4 is needed", [&] { integrate(model, q, v, v); });
  expect_says("integrate: v has size 2 x 4, 2 x 3 is needed",
              [&] { integrate(model, 2, qs, qs, qs); });
  expect_says("integrate: q has size 2 x 4, 3 x 4 is needed",
              [&] { integrate(model, 3, qs, vs, qs); });
  expect_says("difference: q1 has size 3, 4 is needed", [&] { difference(model, q, v, v); });
  expect_says("difference: v has size 4, 3 is needed", [&] { difference(model, q, q, q); });
  expect_says("neutral: q has size 3, 4 is needed", [&] { neutral(model, v); });
  expect_says("random: upper has size 3, 4 is needed",
              [&] { kalmarm::random(model, q, v, generator, q); });
  expect_says("integrate_jacobians: v has size 4, 3 is needed",
              [&] { integrate_jacobians(model, q, q, D, D); });
  expect_says("integrate_jacobians: dq has size 3 x 4, 3 x 3, column-major, is needed",
              [&] { integrate_jacobians(model, q, v, wide, D); });
  expect_says("integrate_jacobians: dv has size 3 x 3, 3 x 3, column-major, is needed",
              [&] { integrate_jacobians(model, q, v, D, by_rows); });
  expect_says("difference_jacobians: q0 has size 3, 4 is needed",
              [&] { difference_jacobians(model, v, q, D, D); });
  expect_says("difference_jacobians: d1 has size 2 x 3, 2 x 9 is needed",
              [&] { difference_jacobians(model, 2, qs, qs, Ds, vs); });
}

TEST(ConfigurationsRefuse, BoundsThatAreNone) {
  const RobotModel& model = robot();
  VectorX<double> lower = VectorX<double>::Zero(model.nq), upper = lower, q(model.nq);
  int hinge = 0;
  while (model.links[hinge].coordinate != Coordinate::angle) ++hinge;
  const int at = model.links[hinge].q_index;
  std::mt19937_64 generator, untouched;
  const auto refused = [&](double low, double high, const std::string& says) {
    lower[at] = low;
    upper[at] = high;
    expect_says("random: DoF '" + model.names[hinge] + "': bounds " + says,
                [&] { kalmarm::random(model, lower, upper, generator, q); });
  };
  refused(1, -1, "1 and -1");
  refused(std::nan(""), 1, "nan and 1");
  refused(0, std::numeric_limits<double>::infinity(), "0 and inf");
  EXPECT_EQ(generator, untouched);
}

}  // namespace
}  // namespace kalmarm::test
