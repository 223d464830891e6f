// What pairs cannot tell of an answer's error, in DoubleDouble (spatial/double_double.hpp): D tested by
// wide_test.hpp, by which M cannot be told from a singular matrix or every D is right to eps < 1, and
//   r = tau - ID(q, q', x) or tau - M x,  |d|_M^2 = r' M^-1 r                              (1)
// with u of (1) of measured.hpp by (3) of energy.hpp, and what rounds r by N, E and G of force_noise.hpp.
#pragma once

#include <memory>

#include "algorithms/fast/check/check_engine.hpp"
#include "algorithms/fast/check/measured.hpp"

namespace kalmarm {

class WideCheck {
 public:
  explicit WideCheck(const RobotModel& robot);
  WideCheck(WideCheck&&) noexcept;
  ~WideCheck();

  // Of one state and an answer to it, all finite. Measured has no least sizes.
  Outcome acceleration(const CheckCall& call, Measured& out);
  Outcome factor(const double* q);  // of the columns that follow
  void column(const double* tau, const double* x, Measured& out);
  double error_of(int k) const;  // of x(k) of the last column
  void torques(const CheckCall& call, Measured& out);

  // An outcome that says which D is the least certain, of an error that is not known.
  Outcome unknown() const;

 private:
  struct Sweeps;
  std::unique_ptr<Sweeps> sweeps_;
};

}  // namespace kalmarm
