// Accelerations from measured velocities, without a shift in time (Savitzky and Golay, 1964).
//
// At every sample i a polynomial of degree d is fitted to the 2 h + 1 velocities around it, by
// least squares; its derivative at t_i is the acceleration:
//   min over c of  sum_j ( sum_p c_p s_j^p - q'(t_j) )^2,   s_j = (t_j - t_i) / scale
//   q''(t_i) = c_1 / scale
// by a QR factorisation, so that the steps of time may differ. Near the ends the window stays as
// wide and is shifted inwards. A polynomial up to degree d comes out exactly.
// With equal steps dt and away from the ends q'' = sum_j w_j q'(t + j dt), w_-j = -w_j: the gain on
// e^(i omega t) is imaginary as that of d/dt is, so that no frequency is delayed,
//   G(omega) = 2 sum_(j>0) w_j sin(j omega dt)            (the derivative itself: omega)
// and noise of standard deviation sigma in q' becomes sigma sqrt(sum_j w_j^2) in q''.
#pragma once

#include "accuracy/fits/samples.hpp"

namespace kalmarm {

// The default: gain within 1 % up to 0.023 of the sampling frequency, 3 dB down at 0.060, none at
// 0.103, under 13 % beyond; noise 0.091 sigma / dt, where a central difference has 0.71.
struct LocalPolynomial {
  int degree = 4;
  int half_width = 10;  // h
};

// Sets samples.qdd (nv x count) from samples.qd. Throws InputError where there are no more samples
// than the degree. About 2 (2 h + 1) (d + 1)^2 flops and 4 (2 h + 1) (d + 1) a DoF for each sample.
void differentiate(Samples& samples, const LocalPolynomial& filter = {});

}  // namespace kalmarm
