// Derivatives of measured motion, without a shift in time (Savitzky and Golay, 1964).
//
// At every sample i a polynomial of degree d is fitted to the 2 h + 1 samples x around it, by least
// squares; its derivatives at t_i are those of x:
//   min over c of  sum_j ( sum_p c_p s_j^p - x(t_j) )^2,   s_j = (t_j - t_i) / scale            (1)
//   x'(t_i) = c_1 / scale,   x''(t_i) = 2 c_2 / scale^2                                         (2)
// by a QR factorisation, so that the steps of time may differ. A polynomial up to degree d comes
// out exactly. With equal steps dt, x^(k) = sum_j w_j x(t + j dt), w_-j = (-1)^k w_j: the gain on
// e^(i omega t) is imaginary for k = 1 and real for k = 2 as that of the derivative is, so that no
// frequency is delayed,
//   G_1(omega) = 2 sum_(j>0) w_j sin(j omega dt)              (the derivative itself: omega)
//   G_2(omega) = w_0 + 2 sum_(j>0) w_j cos(j omega dt)        (the derivative itself: -omega^2)
// and noise of standard deviation sigma in x becomes sigma sqrt(sum_j w_j^2) in the derivative.
//
// Of positions, x is q with angles unwrapped and the signs of quaternions made continuous. An
// orientation is u / |u| of its four polynomials u, its rates are those of quaternion_rates.hpp.
#pragma once

#include "accuracy/fits/samples.hpp"

namespace kalmarm {

// The default, by frequencies as shares of the sampling frequency; a wider window moves them by
// 10 / h:
//   x'    gain within 1 % up to 0.023, 3 dB down at 0.060, none at 0.103, under 13 % beyond;
//         noise 0.091 sigma / dt, where a central difference has 0.71
//   x''   gain within 1 % up to 0.026, 3 dB down at 0.068, none at 0.122, under 7.2 % beyond;
//         noise 0.048 sigma / dt^2, where a central difference has 2.4
struct LocalPolynomial {
  int degree = 4;
  int half_width = 10;  // h
};

// Sets samples.qdd (nv x count) from samples.qd. Near the ends the window stays as wide and is
// shifted inwards. Throws InputError where there are no more samples than the degree. About
// 2 (2 h + 1) (d + 1)^2 flops and 4 (2 h + 1) (d + 1) a DoF for each sample.
void differentiate(Samples& samples, const LocalPolynomial& filter = {});

// A step of time that is longer than this many median steps is a gap, across which nothing is
// differentiated: it makes a window of 2 h steps 15 % wider.
inline constexpr double longest_step = 4;

// Sets samples.qd and samples.qdd from samples.q, and leaves out the first and the last h samples,
// where windows shifted inwards would pass 5 to 7 times the noise. Throws InputError where fewer
// than two samples would be left, or time has a gap.
void differentiate_positions(Samples& samples, const Model<double>& model,
                             const LocalPolynomial& filter = {});

}  // namespace kalmarm
