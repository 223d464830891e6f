// The scalar of truth: MPFR, with the precision chosen while the program runs. Every algorithm of
// the library takes it as its T; u follows the precision in force.
#pragma once

#include <boost/multiprecision/eigen.hpp>
#include <boost/multiprecision/mpfr.hpp>
#include <cmath>

namespace kalmarm {

using Real = boost::multiprecision::number<boost::multiprecision::mpfr_float_backend<0>,
                                           boost::multiprecision::et_off>;

// As long as it lives, new numbers have this many decimal digits. Boost 1.74 keeps the setting for
// the whole process: one thread at a time.
class Digits {
 public:
  explicit Digits(unsigned digits) : before_(Real::default_precision()) {
    Real::default_precision(digits);
  }
  ~Digits() { Real::default_precision(before_); }
  Digits(const Digits&) = delete;
  Digits& operator=(const Digits&) = delete;

 private:
  unsigned before_;
};

// The larger of two; NaN if either is.
template <class S>
S larger(const S& a, const S& b) {
  using std::isnan;
  return isnan(a) || a >= b ? a : b;
}

}  // namespace kalmarm
