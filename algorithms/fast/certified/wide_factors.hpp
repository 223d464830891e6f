// Factors of M in DoubleDouble (spatial/double_double.hpp) and what is made of them, judged in the
// same precision: what the certified form does where double's own factors do not do.
//   D, g by (3.6), (3.10), D tested (wide_test.hpp)
//   x = M^^-1 b,  r = b - M x,  d = M^^-1 r,  x + d is rounded to double                    (1)
//   error = |d|_M / |x|_M = sqrt(r'd / b'x)                 the energy norm, |x|_M^2 = x' M x (2)
// Columns of M^-1, of its diagonal and of J M^-1 J' are solutions (1) of b = B(j). By Cauchy and
// Schwarz an error of (2) of column j moves B(i)' M^-1 B(j) by no more than (2) times the root of
// B(i)' M^-1 B(i) B(j)' M^-1 B(j): Outcome::error is the largest (2) of all columns, and u for the
// rounding to double. Of `factor` and `log_det` it is (2) of b(k) = z(k) sqrt(D(k)), z(k) = +-1 drawn
// once. Of `solve`, whose x is judged in Euclid's norm,
//   error = (|d| + sqrt(bound of d)) / |x|                  bound: (1) of bounded_solve.hpp   (3)
// To each the largest loss(k) is added (wide_test.hpp). An answer whose error is above enough_in_two_doubles is
// near_singular; where no digit of a D is left, the answer is refused. Either names the joint.
//
// About 345 n operations of DoubleDouble a column.
#pragma once

#include <memory>

#include "algorithms/fast/engine/engine.hpp"

namespace kalmarm {

class WideFactors {
 public:
  WideFactors(const RobotModel& robot, const EngineOptions& options);
  WideFactors(WideFactors&&) noexcept;
  ~WideFactors();

  // Of finite numbers, to call.out, or X. On failure a result is not to be used.
  Outcome inverse(const Call<double>& call);
  Outcome diagonal(const Call<double>& call);
  Outcome log_det(const Call<double>& call);
  Outcome selected(const Call<double>& call, double* X);

  // Factors that are kept until another call, and solves by them, which were ok.
  Outcome factor(const Call<double>& call);
  Outcome solve(int columns, const double* taus, double* X);

 private:
  struct Sweeps;
  std::unique_ptr<Sweeps> sweeps_;
};

}  // namespace kalmarm
