// A number of which is known that it lies in a ball, centre +- radius: Arb's arb_t as a scalar for
// templates and for Eigen. Every operation gives a ball that holds all results for all numbers of
// its operands' balls; what is rounded goes into the radius. A division by a ball that holds zero
// gives an infinite radius, and the root of one that holds a negative number is not a number:
// comparisons with either are false.
//
// Comparisons are true where they are certain, for all numbers of both balls.
//
// Intervals by their ends (MPFI) would take two numbers instead of one, and Arb multiplies large
// matrices as integers.
#pragma once

#include <arb.h>
#include <arb_mat.h>

#include <limits>
#include <type_traits>
#include <utility>

#include "accuracy/measures/real.hpp"
#include "algorithms/spatial/spatial.hpp"

namespace kalmarm {

class Ball {
 public:
  Ball() { arb_init(x_); }
  Ball(int x) : Ball() { arb_set_si(x_, x); }
  Ball(double x) : Ball() { arb_set_d(x_, x); }
  explicit Ball(const Real& x) : Ball() {
    arf_set_mpfr(arb_midref(x_), const_cast<Real&>(x).backend().data());
  }
  Ball(const Ball& other) : Ball() { arb_set(x_, other.x_); }
  Ball(Ball&& other) noexcept : Ball() { arb_swap(x_, other.x_); }
  Ball& operator=(const Ball& other) {
    arb_set(x_, other.x_);
    return *this;
  }
  Ball& operator=(Ball&& other) noexcept {
    arb_swap(x_, other.x_);
    return *this;
  }
  ~Ball() { arb_clear(x_); }

  arb_ptr data() { return x_; }
  arb_srcptr data() const { return x_; }

  Ball& operator+=(const Ball& y) { return arb_add(x_, x_, y.x_, bits()), *this; }
  Ball& operator-=(const Ball& y) { return arb_sub(x_, x_, y.x_, bits()), *this; }
  Ball& operator*=(const Ball& y) { return arb_mul(x_, x_, y.x_, bits()), *this; }
  Ball& operator/=(const Ball& y) { return arb_div(x_, x_, y.x_, bits()), *this; }
  friend Ball operator+(const Ball& x, const Ball& y) {
    Ball out;
    return arb_add(out.x_, x.x_, y.x_, bits()), out;
  }
  friend Ball operator-(const Ball& x, const Ball& y) {
    Ball out;
    return arb_sub(out.x_, x.x_, y.x_, bits()), out;
  }
  friend Ball operator*(const Ball& x, const Ball& y) {
    Ball out;
    return arb_mul(out.x_, x.x_, y.x_, bits()), out;
  }
  friend Ball operator/(const Ball& x, const Ball& y) {
    Ball out;
    return arb_div(out.x_, x.x_, y.x_, bits()), out;
  }
  Ball operator-() const {
    Ball out;
    return arb_neg(out.x_, x_), out;
  }

  friend bool operator==(const Ball& x, const Ball& y) { return arb_eq(x.x_, y.x_); }
  friend bool operator!=(const Ball& x, const Ball& y) { return arb_ne(x.x_, y.x_); }
  friend bool operator<(const Ball& x, const Ball& y) { return arb_lt(x.x_, y.x_); }
  friend bool operator<=(const Ball& x, const Ball& y) { return arb_le(x.x_, y.x_); }
  friend bool operator>(const Ball& x, const Ball& y) { return arb_gt(x.x_, y.x_); }
  friend bool operator>=(const Ball& x, const Ball& y) { return arb_ge(x.x_, y.x_); }

  friend Ball abs(Ball x) { return arb_abs(x.x_, x.x_), x; }
  friend Ball sqrt(Ball x) { return arb_sqrt(x.x_, x.x_, bits()), x; }
  friend Ball sin(Ball x) { return arb_sin(x.x_, x.x_, bits()), x; }
  friend Ball cos(Ball x) { return arb_cos(x.x_, x.x_, bits()), x; }

  // The same number of bits as a Real that is made now.
  static slong bits() { return bits_; }

 private:
  friend class BallDigits;
  arb_t x_;
  static inline slong bits_ = 128;
};

// As long as it lives, centres of balls are rounded to the digits in force for Real.
class BallDigits {
 public:
  BallDigits() : before_(std::exchange(Ball::bits_, Real().backend().data()[0]._mpfr_prec)) {}
  ~BallDigits() { Ball::bits_ = before_; }
  BallDigits(const BallDigits&) = delete;
  BallDigits& operator=(const BallDigits&) = delete;

 private:
  slong before_;
};

// Exact: the centre, and numbers that no number of the ball is beyond.
inline Ball centre(Ball x) {
  arb_get_mid_arb(x.data(), x.data());
  return x;
}
inline Ball lower_end(const Ball& x) {
  Ball out;
  arb_get_lbound_arf(arb_midref(out.data()), x.data(), Ball::bits());
  return out;
}
inline Ball upper_end(const Ball& x) {
  Ball out;
  arb_get_ubound_arf(arb_midref(out.data()), x.data(), Ball::bits());
  return out;
}
inline Ball radius(const Ball& x) {
  Ball out;
  arb_get_rad_arb(out.data(), x.data());
  return out;
}

// x +- what the ball e has at most.
inline Ball widened(Ball x, const Ball& e) {
  arb_add_error(x.data(), e.data());
  return x;
}

// All between x and y.
inline Ball hull(Ball x, const Ball& y) {
  arb_union(x.data(), x.data(), y.data(), Ball::bits());
  return x;
}

// The centre, rounded to the digits in force.
inline Real rounded(const Ball& x) {
  Real out;
  arf_get_mpfr(out.backend().data(), arb_midref(x.data()), MPFR_RNDN);
  return out;
}

inline bool is_nan(const Ball& x) { return arf_is_nan(arb_midref(x.data())); }

// A double that no number of the ball is above; infinite where there is none.
inline double bound_of(const Ball& x) {
  const Ball end = upper_end(x);
  if (is_nan(end)) return std::numeric_limits<double>::infinity();
  return arf_get_d(arb_midref(end.data()), ARF_RND_UP);
}

}  // namespace kalmarm

template <>
struct Eigen::NumTraits<kalmarm::Ball> : Eigen::GenericNumTraits<kalmarm::Ball> {
  using Real = kalmarm::Ball;
  using NonInteger = kalmarm::Ball;
  using Nested = kalmarm::Ball;
  using Literal = double;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 8,
    AddCost = 100,
    MulCost = 100
  };
  static Real epsilon() { return 0; }
  static Real dummy_precision() { return 0; }
  static int digits10() { return 0; }
};

namespace kalmarm {

// A B.
inline MatrixX<Ball> product(const MatrixX<Ball>& A, const MatrixX<Ball>& B) {
  const auto taken = [](const MatrixX<Ball>& from, arb_mat_t to) {
    arb_mat_init(to, from.rows(), from.cols());
    for (Eigen::Index j = 0; j < from.cols(); ++j)
      for (Eigen::Index i = 0; i < from.rows(); ++i)
        arb_set(arb_mat_entry(to, i, j), from(i, j).data());
  };
  arb_mat_t a, b, c;
  taken(A, a);
  taken(B, b);
  arb_mat_init(c, A.rows(), B.cols());
  arb_mat_mul(c, a, b, Ball::bits());
  MatrixX<Ball> C(A.rows(), B.cols());
  for (Eigen::Index j = 0; j < C.cols(); ++j)
    for (Eigen::Index i = 0; i < C.rows(); ++i) arb_swap(C(i, j).data(), arb_mat_entry(c, i, j));
  arb_mat_clear(a);
  arb_mat_clear(b);
  arb_mat_clear(c);
  return C;
}

}  // namespace kalmarm
