// Accelerations in DoubleDouble (spatial/double_double.hpp), judged in the same precision: what the
// certified form does where double's own factors do not do.
//   a by (4.2) to (4.11), D tested by (1) to (3) of covariance/rounding_test.hpp
//   r = tau - ID(q, q', a),  d = M^^-1 r,  a + d
//   error = |d| / |a| + sqrt(bound of d) / |a|               bound: (5) of bounded_solve.hpp   (1)
// Sweep and residual share their model, but nothing that they compute: where rounding had moved a
// by more, they would not agree.
#pragma once

#include <memory>

#include "kalmarm/outcome.hpp"
#include "kalmarm/robot_model.hpp"

namespace kalmarm {

class WideAcceleration {
 public:
  explicit WideAcceleration(const RobotModel& robot);
  WideAcceleration(WideAcceleration&&) noexcept;
  ~WideAcceleration();

  // a (nv) from q (nq), qd (nv), tau (nv), and its error by (1). near_singular: a D may be lost in
  // rounding even so, and then the error says little.
  Outcome acceleration(const double* q, const double* qd, const double* tau, double* a);

 private:
  struct Sweeps;
  std::unique_ptr<Sweeps> sweeps_;
};

}  // namespace kalmarm
