#include "kalmarm/configuration.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "algorithms/dynamics/displacement.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/model/short_text.hpp"
#include "algorithms/spatial/spatial.hpp"

namespace kalmarm {
namespace {

using Quaternion = Eigen::Quaternion<double>;
using Vector = Vector3<double>;
using Matrix = Matrix3<double>;

// Calls add(k, i) for every DoF k that adds to entry i of q, and turn(k, i) for every quaternion,
// whose first DoF is k and first entry i.
template <class Add, class Turn>
void each_coordinate(const RobotModel& model, const Add& add, const Turn& turn) {
  for (int k = 0; k < model.nv(); ++k) {
    const LinkParameters& link = model.links[k];
    if (link.coordinate == Coordinate::quaternion)
      turn(k, link.q_index);
    else
      for (int i = 0; i < q_entries(link.coordinate); ++i) add(k + i, link.q_index + i);
  }
}

// --- quaternions

// Of unit length; NaN where it is no turn.
template <class T>
Quaternion read_turn(const T* q) {
  const Quaternion turn(q[0], q[1], q[2], q[3]);
  if (is_turn(turn)) return turn.normalized();
  return Quaternion(Eigen::Vector4d::Constant(std::numeric_limits<double>::quiet_NaN()));
}

template <class T>
void write_turn(const Quaternion& turn, T* q) {
  q[0] = T(turn.w()), q[1] = T(turn.x()), q[2] = T(turn.y()), q[3] = T(turn.z());
}

template <class T>
Vector read_vector(const T* v) {
  return Vector(v[0], v[1], v[2]);
}

double sinc(double x) { return x == 0 ? 1 : std::sin(x) / x; }

// (2)
Quaternion exponential(const Vector& half_v) {
  const double half_t = half_v.norm();
  const Vector x = sinc(half_t) * half_v;
  return Quaternion(std::cos(half_t), x[0], x[1], x[2]);
}

// (3). The same quaternions give exactly zero, since this file is compiled without contraction.
Vector shorter_turn(const Quaternion& q0, const Quaternion& q1) {
  const double c = q0.dot(q1);
  const Vector y = q0.w() * q1.vec() - q1.w() * q0.vec() - q0.vec().cross(q1.vec());
  const double s = y.norm();
  if (s == 0) return 2 / c * y;  // its square underflows
  return std::copysign(2 * std::atan2(s, std::abs(c)), c) / s * y;
}

// I + a n~ + b n~^2 by a unit vector n.
Matrix by_axis(const Vector& n, double a, double b) {
  const Matrix N = cross_matrix(n);
  return Matrix::Identity() + a * N + b * (N * N);
}

// Angle t and axis n of a displacement; n is zero where t is.
struct Turn {
  double t;
  Vector n;

  explicit Turn(const Vector& v) : t(v.norm()), n(t == 0 ? Vector::Zero() : Vector(v / t)) {}

  // (4)
  Matrix inverse_rotation() const { return by_axis(n, -std::sin(t), 1 - std::cos(t)); }
  // (5), where (1 - cos(t)) / t = sin(t/2) sin(t/2) / (t/2)
  Matrix jacobian() const { return by_axis(n, -std::sin(t / 2) * sinc(t / 2), 1 - sinc(t)); }
  // (6)
  Matrix inverse_jacobian() const { return by_axis(n, t / 2, 1 - std::cos(t / 2) / sinc(t / 2)); }
};

// --- random numbers

// Uniform in [0, 1), of 53 bits: std::uniform_real_distribution is another with each library.
double uniform(std::mt19937_64& generator) {
  return static_cast<double>(generator() >> 11) * 0x1p-53;
}

// A point in the unit disk.
struct DiskPoint {
  double x, y, s;  // s = x^2 + y^2

  explicit DiskPoint(std::mt19937_64& generator) {
    do {
      x = 2 * uniform(generator) - 1;
      y = 2 * uniform(generator) - 1;
      s = x * x + y * y;
    } while (s >= 1 || s == 0);
  }
};

// G. Marsaglia, Choosing a point from the surface of a sphere, 1972, in four dimensions: by
// operations that are rounded alike everywhere, which sine and logarithm are not.
Quaternion random_turn(std::mt19937_64& generator) {
  const DiskPoint a(generator), b(generator);
  const double scale = std::sqrt((1 - a.s) / b.s);
  return Quaternion(a.x, a.y, scale * b.x, scale * b.y);
}

// --- checks

template <class View>
void require(const char* call, const char* what, const View& given, std::ptrdiff_t rows,
             std::ptrdiff_t width) {
  if (given.fits(rows, width)) return;
  const std::string needed =
      given.is_shaped() ? detail::shape(rows, width) : std::to_string(rows * width);
  throw std::invalid_argument(std::string(call) + ": " + what + " has size " + given.shape() +
                              ", " + needed + " is needed");
}

// Of one state, as a row.
template <class T>
RowsView<T> row_of(const char* call, const char* what, const RobotModel& model,
                   const MatrixView<T>& D) {
  const std::ptrdiff_t nv = model.nv();
  if (!D.fits(nv, nv) || D.is_row_major())
    throw std::invalid_argument(std::string(call) + ": " + what + " has size " + D.shape() + ", " +
                                detail::shape(nv, nv) + ", column-major, is needed");
  return {D.data(), 1, nv * nv};
}

template <class T>
void check_bounds(const RobotModel& model, VectorView<const T> lower, VectorView<const T> upper) {
  const auto check = [&](int k, int i) {
    const T low = lower.data()[i], high = upper.data()[i];
    if (std::isfinite(low) && std::isfinite(high) && low <= high) return;
    throw std::invalid_argument("random: DoF '" + model.names[k] + "': bounds " +
                                short_text("%g", low) + " and " + short_text("%g", high));
  };
  each_coordinate(model, check, [](int, int) {});
}

// --- rows of states

template <class T>
void integrate_rows(const RobotModel& model, std::ptrdiff_t rows, RowsView<const T> q,
                    RowsView<const T> v, RowsView<T> q_next) {
  const std::ptrdiff_t nq = model.nq, nv = model.nv();
  require("integrate", "q", q, rows, nq);
  require("integrate", "v", v, rows, nv);
  require("integrate", "q_next", q_next, rows, nq);
  for (std::ptrdiff_t row = 0; row < rows; ++row)
    displace(model, q.data() + row * nq, v.data() + row * nv, 1, q_next.data() + row * nq);
}

template <class T>
void difference_rows(const RobotModel& model, std::ptrdiff_t rows, RowsView<const T> q0,
                     RowsView<const T> q1, RowsView<T> v) {
  const std::ptrdiff_t nq = model.nq, nv = model.nv();
  require("difference", "q0", q0, rows, nq);
  require("difference", "q1", q1, rows, nq);
  require("difference", "v", v, rows, nv);
  for (std::ptrdiff_t row = 0; row < rows; ++row) {
    const T *const from = q0.data() + row * nq, *const to = q1.data() + row * nq;
    T* const out = v.data() + row * nv;
    each_coordinate(
        model, [&](int k, int i) { out[k] = to[i] - from[i]; },  // (1)
        [&](int k, int i) {
          const Vector turn = shorter_turn(read_turn(from + i), read_turn(to + i));
          for (int axis = 0; axis < 3; ++axis) out[k + axis] = T(turn[axis]);
        });
  }
}

template <class T>
void set_neutral(const RobotModel& model, VectorView<T> q) {
  require("neutral", "q", RowsView<T>(q), 1, model.nq);
  each_coordinate(
      model, [&](int, int i) { q.data()[i] = T(0); },
      [&](int, int i) { write_turn(Quaternion::Identity(), q.data() + i); });
}

template <class T>
void draw_rows(const RobotModel& model, std::ptrdiff_t rows, VectorView<const T> lower,
               VectorView<const T> upper, std::mt19937_64& generator, RowsView<T> q) {
  require("random", "lower", RowsView<const T>(lower), 1, model.nq);
  require("random", "upper", RowsView<const T>(upper), 1, model.nq);
  require("random", "q", q, rows, model.nq);
  check_bounds(model, lower, upper);
  const auto within = [&](double low, double high) {
    const double u = uniform(generator);
    return std::clamp((1 - u) * low + u * high, low, high);  // rounding may lead out
  };
  for (std::ptrdiff_t row = 0; row < rows; ++row) {
    T* const out = q.data() + row * model.nq;
    each_coordinate(
        model, [&](int, int i) { out[i] = T(within(lower.data()[i], upper.data()[i])); },
        [&](int, int i) { write_turn(random_turn(generator), out + i); });
  }
}

// Blocks of two Jacobians for one quaternion.
struct Blocks {
  Matrix first, second;
};

template <class T>
void write_block(const Matrix& block, std::ptrdiff_t nv, int k, T* D) {
  for (int column = 0; column < 3; ++column)
    for (int row = 0; row < 3; ++row) D[(k + column) * nv + k + row] = T(block(row, column));
}

// Of one state: on the diagonals `add` and 1 where q adds, and of every quaternion blocks(k, i).
template <class T, class BlocksOf>
void set_jacobians(const RobotModel& model, T add, const BlocksOf& blocks, T* first, T* second) {
  const std::ptrdiff_t nv = model.nv();
  std::fill_n(first, nv * nv, T(0));
  std::fill_n(second, nv * nv, T(0));
  each_coordinate(
      model,
      [&](int k, int) {
        first[k * (nv + 1)] = add;
        second[k * (nv + 1)] = T(1);
      },
      [&](int k, int i) {
        const Blocks of_turn = blocks(k, i);
        write_block(of_turn.first, nv, k, first);
        write_block(of_turn.second, nv, k, second);
      });
}

template <class T>
void integrate_jacobians_of_rows(const RobotModel& model, std::ptrdiff_t rows, RowsView<const T> q,
                                 RowsView<const T> v, RowsView<T> dq, RowsView<T> dv) {
  constexpr const char* call = "integrate_jacobians";
  const std::ptrdiff_t nv = model.nv(), size = nv * nv;
  require(call, "q", q, rows, model.nq);
  require(call, "v", v, rows, nv);
  require(call, "dq", dq, rows, size);
  require(call, "dv", dv, rows, size);
  for (std::ptrdiff_t row = 0; row < rows; ++row) {
    const auto blocks = [&](int k, int) {
      const Turn turn(read_vector(v.data() + row * nv + k));
      return Blocks{turn.inverse_rotation(), turn.jacobian()};
    };
    set_jacobians(model, T(1), blocks, dq.data() + row * size, dv.data() + row * size);
  }
}

template <class T>
void difference_jacobians_of_rows(const RobotModel& model, std::ptrdiff_t rows,
                                  RowsView<const T> q0, RowsView<const T> q1, RowsView<T> d0,
                                  RowsView<T> d1) {
  constexpr const char* call = "difference_jacobians";
  const std::ptrdiff_t nq = model.nq, nv = model.nv(), size = nv * nv;
  require(call, "q0", q0, rows, nq);
  require(call, "q1", q1, rows, nq);
  require(call, "d0", d0, rows, size);
  require(call, "d1", d1, rows, size);
  for (std::ptrdiff_t row = 0; row < rows; ++row) {
    const T *const from = q0.data() + row * nq, *const to = q1.data() + row * nq;
    const auto blocks = [&](int, int i) {
      const Turn turn(shorter_turn(read_turn(from + i), read_turn(to + i)));
      const Matrix by_q1 = turn.inverse_jacobian();
      return Blocks{-by_q1.transpose(), by_q1};  // (7)
    };
    set_jacobians(model, T(-1), blocks, d0.data() + row * size, d1.data() + row * size);
  }
}

}  // namespace

template <class T>
void displace(const RobotModel& model, const T* q, const T* v, double h, T* q_next) {
  each_coordinate(
      model, [&](int k, int i) { q_next[i] = q[i] + T(h) * v[k]; },  // (1)
      [&](int k, int i) {
        const Quaternion turned = read_turn(q + i) * exponential(h / 2 * read_vector(v + k));
        write_turn(turned.normalized(), q_next + i);
      });
}
template void displace(const RobotModel&, const double*, const double*, double, double*);
template void displace(const RobotModel&, const float*, const float*, double, float*);

void integrate(const RobotModel& model, VectorView<const double> q, VectorView<const double> v,
               VectorView<double> q_next) {
  integrate_rows<double>(model, 1, q, v, q_next);
}
void integrate(const RobotModel& model, std::ptrdiff_t rows, RowsView<const double> q,
               RowsView<const double> v, RowsView<double> q_next) {
  integrate_rows<double>(model, rows, q, v, q_next);
}
void integrate(const RobotModel& model, VectorView<const float> q, VectorView<const float> v,
               VectorView<float> q_next) {
  integrate_rows<float>(model, 1, q, v, q_next);
}
void integrate(const RobotModel& model, std::ptrdiff_t rows, RowsView<const float> q,
               RowsView<const float> v, RowsView<float> q_next) {
  integrate_rows<float>(model, rows, q, v, q_next);
}

void difference(const RobotModel& model, VectorView<const double> q0, VectorView<const double> q1,
                VectorView<double> v) {
  difference_rows<double>(model, 1, q0, q1, v);
}
void difference(const RobotModel& model, std::ptrdiff_t rows, RowsView<const double> q0,
                RowsView<const double> q1, RowsView<double> v) {
  difference_rows<double>(model, rows, q0, q1, v);
}
void difference(const RobotModel& model, VectorView<const float> q0, VectorView<const float> q1,
                VectorView<float> v) {
  difference_rows<float>(model, 1, q0, q1, v);
}
void difference(const RobotModel& model, std::ptrdiff_t rows, RowsView<const float> q0,
                RowsView<const float> q1, RowsView<float> v) {
  difference_rows<float>(model, rows, q0, q1, v);
}

void neutral(const RobotModel& model, VectorView<double> q) { set_neutral<double>(model, q); }
void neutral(const RobotModel& model, VectorView<float> q) { set_neutral<float>(model, q); }

void random(const RobotModel& model, VectorView<const double> lower, VectorView<const double> upper,
            std::mt19937_64& generator, VectorView<double> q) {
  draw_rows<double>(model, 1, lower, upper, generator, q);
}
void random(const RobotModel& model, std::ptrdiff_t rows, VectorView<const double> lower,
            VectorView<const double> upper, std::mt19937_64& generator, RowsView<double> q) {
  draw_rows<double>(model, rows, lower, upper, generator, q);
}
void random(const RobotModel& model, VectorView<const float> lower, VectorView<const float> upper,
            std::mt19937_64& generator, VectorView<float> q) {
  draw_rows<float>(model, 1, lower, upper, generator, q);
}
void random(const RobotModel& model, std::ptrdiff_t rows, VectorView<const float> lower,
            VectorView<const float> upper, std::mt19937_64& generator, RowsView<float> q) {
  draw_rows<float>(model, rows, lower, upper, generator, q);
}

void integrate_jacobians(const RobotModel& model, VectorView<const double> q,
                         VectorView<const double> v, MatrixView<double> dq, MatrixView<double> dv) {
  integrate_jacobians_of_rows<double>(model, 1, q, v,
                                      row_of("integrate_jacobians", "dq", model, dq),
                                      row_of("integrate_jacobians", "dv", model, dv));
}
void integrate_jacobians(const RobotModel& model, std::ptrdiff_t rows, RowsView<const double> q,
                         RowsView<const double> v, RowsView<double> dq, RowsView<double> dv) {
  integrate_jacobians_of_rows<double>(model, rows, q, v, dq, dv);
}
void integrate_jacobians(const RobotModel& model, VectorView<const float> q,
                         VectorView<const float> v, MatrixView<float> dq, MatrixView<float> dv) {
  integrate_jacobians_of_rows<float>(model, 1, q, v, row_of("integrate_jacobians", "dq", model, dq),
                                     row_of("integrate_jacobians", "dv", model, dv));
}
void integrate_jacobians(const RobotModel& model, std::ptrdiff_t rows, RowsView<const float> q,
                         RowsView<const float> v, RowsView<float> dq, RowsView<float> dv) {
  integrate_jacobians_of_rows<float>(model, rows, q, v, dq, dv);
}

void difference_jacobians(const RobotModel& model, VectorView<const double> q0,
                          VectorView<const double> q1, MatrixView<double> d0,
                          MatrixView<double> d1) {
  difference_jacobians_of_rows<double>(model, 1, q0, q1,
                                       row_of("difference_jacobians", "d0", model, d0),
                                       row_of("difference_jacobians", "d1", model, d1));
}
void difference_jacobians(const RobotModel& model, std::ptrdiff_t rows, RowsView<const double> q0,
                          RowsView<const double> q1, RowsView<double> d0, RowsView<double> d1) {
  difference_jacobians_of_rows<double>(model, rows, q0, q1, d0, d1);
}
void difference_jacobians(const RobotModel& model, VectorView<const float> q0,
                          VectorView<const float> q1, MatrixView<float> d0, MatrixView<float> d1) {
  difference_jacobians_of_rows<float>(model, 1, q0, q1,
                                      row_of("difference_jacobians", "d0", model, d0),
                                      row_of("difference_jacobians", "d1", model, d1));
}
void difference_jacobians(const RobotModel& model, std::ptrdiff_t rows, RowsView<const float> q0,
                          RowsView<const float> q1, RowsView<float> d0, RowsView<float> d1) {
  difference_jacobians_of_rows<float>(model, rows, q0, q1, d0, d1);
}

}  // namespace kalmarm
