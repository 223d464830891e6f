// Numbers of many digits: MPFR. Two kinds, since the digits are chosen at two times. Every algorithm
// of the library takes either as its T.
//
//   Real               digits chosen while the program runs: truth.hpp doubles them until its
//                      numbers are proven, and a user asks for any number of them. New numbers have
//                      the digits in force (Digits); u follows them.
//   FixedReal<digits>  digits that belong to the type: what they are needed for is known beforehand,
//                      as in a test. Nothing need be in force, so it is fit for static data and for
//                      threads; and without memory of its own it takes half the time.
//
// It stands among the tests because the library itself knows neither Boost nor MPFR
// (scripts/check_includes); accuracy/ takes it from here.
#pragma once

#include <boost/multiprecision/eigen.hpp>
#include <boost/multiprecision/mpfr.hpp>

namespace kalmarm {

using Real = boost::multiprecision::number<boost::multiprecision::mpfr_float_backend<0>,
                                           boost::multiprecision::et_off>;

template <unsigned digits>
using FixedReal = boost::multiprecision::number<
    boost::multiprecision::mpfr_float_backend<digits, boost::multiprecision::allocate_stack>,
    boost::multiprecision::et_off>;

// As long as it lives, new Reals have this many decimal digits. Boost 1.74 keeps the setting for
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

}  // namespace kalmarm
