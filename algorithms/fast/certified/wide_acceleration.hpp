// Accelerations in DoubleDouble (spatial/double_double.hpp), judged in the same precision: what the
// certified form does where double's own factors do not do.
//   a by (4.2) to (4.11), D tested by wide_test.hpp
//   r = tau - ID(q, q', a),  d = M^^-1 r,  a + d
//   error = (|d| + sqrt(bound of d) + sqrt(T (N + E + G)) c u) / |a| + largest loss(k)         (1)
//   bound: (1) of bounded_solve.hpp; N, E, T: those of the sweep, as in (8) of covariance/force_noise.hpp;
//   G: of (1) of certified_acceleration.hpp; c = rounding_constant; loss: (3) of covariance/rounding_bound.hpp
// Sweep and residual share their model and its sines, for which loss(k) stands where they make D and
// N where they make forces, but nothing that they compute: where rounding had moved a by more, they
// would not agree. Without N a search found an acceleration of 4e-15 at velocities of 6 rad/s, made
// by a cosine of 6e-17, wrong by 2e-13 where 1e-16 was told. Beside gravity g and velocities
// u (g + |q'|^2), u of double, takes the place of a smaller |a|. An error above enough_in_two_doubles warns; where no
// digit of a D is left, M cannot be told from singular and there is no answer.
#pragma once

#include <memory>
#include <vector>

#include "kalmarm/call.hpp"
#include "kalmarm/outcome.hpp"
#include "kalmarm/robot_model.hpp"

namespace kalmarm {

class WideAcceleration {
 public:
  explicit WideAcceleration(const RobotModel& robot, const CallFrames& frames = {});
  WideAcceleration(WideAcceleration&&) noexcept;
  ~WideAcceleration();

  // call.out = a (nv) from q (nq), qd (nv), tau (nv) and what acts from outside, all finite, and its error by (1).
  // call.r (nv): joint noise in the place of the robot's, of joints that have some and not less; null: the
  // robot's.
  Outcome acceleration(const Call<double>& call);

 private:
  struct Sweeps;
  std::unique_ptr<Sweeps> sweeps_;
};

}  // namespace kalmarm
