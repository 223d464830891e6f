// How far terms that cancel can move M^-1 of a robot, wherever its joints stand: a bound of the second sum
// of S in (11) of covariance/force_noise.hpp, from numbers of the robot alone.
//
//   D g g' <= P-,  so that  D g(i)^2 <= P-(i,i) <= I for moments, m for forces           (1)
// with I and m the largest that they can be (rounding_weights.hpp), and with traces of the blocks of
// turning and of moving of Omega+, by (4) there, whose v(k) is at most 1 / mu(k) (least_inertia.hpp),
//   S2 <= sum over k of I(k) trace Omega+(turning) + m(k) trace Omega+(moving)           (2)
// Of a robot of ordinary proportions that is less than float32 bears; of a long chain, or where a body
// resists no motion about some axis, it says nothing.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "algorithms/fast/lowering/lowered_link.hpp"
#include "algorithms/fast/lowering/rounding_weights.hpp"

namespace kalmarm::detail {

template <class S>
double terms_of_columns(const std::vector<LoweredLink<S>>& links,
                        const std::vector<LoweredBody<S>>& bodies,
                        const std::vector<S>& least_inertias, const std::vector<Largest>& largest,
                        double unit) {
  constexpr double infinite = std::numeric_limits<double>::infinity();
  const auto times = [](double a, double b) { return a == 0 || b == 0 ? 0.0 : a * b; };
  const auto most = [&](const S& weight) {
    return weight < S(no_body) ? static_cast<double>(weight) / unit : infinite;
  };
  struct Traces {
    double turning = 0, moving = 0;
  };
  std::vector<Traces> Omega(links.size());
  double sum = 0;
  for (std::size_t k = 0; k < links.size(); ++k) {
    const LoweredLink<S>& link = links[k];
    Traces plus;
    if (link.parent >= 0) {
      const Traces& there = Omega[link.parent];
      const double reach = link.slides ? infinite : static_cast<double>(bodies[k].reach);
      plus = {there.turning, 2 * there.moving + times(reach, there.turning)};
    }
    // A body's largest moment is at most half their sum, which no file has to respect.
    const double I = largest[k].unbounded ? infinite : 2 * largest[k].moment;
    sum += times(I, plus.turning) + times(largest[k].force, plus.moving);
    const double mu = static_cast<double>(least_inertias[k]), v = mu > 0 ? 1 / mu : infinite;
    Omega[k] = {2 * plus.turning, 2 * plus.moving};
    (link.slides ? Omega[k].moving : Omega[k].turning) += 2 * v;
    Omega[k].turning = std::min(Omega[k].turning, most(bodies[k].weights.moment));
    Omega[k].moving = std::min(Omega[k].moving, most(bodies[k].weights.force));
  }
  return std::min(sum, no_body);
}

}  // namespace kalmarm::detail
