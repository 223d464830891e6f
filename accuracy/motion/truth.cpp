#include "accuracy/motion/truth.hpp"

#include <boost/numeric/odeint.hpp>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include "algorithms/model/plain.hpp"
#include "algorithms/model/short_text.hpp"
#include "algorithms/study/inverse_mass/sequential.hpp"
#include "algorithms/study/riccati/conventional.hpp"
#include "algorithms/study/solver_of.hpp"

namespace kalmarm::motion {
namespace {

namespace odeint = boost::numeric::odeint;

using Wide = long double;
using State = std::vector<Wide>;  // (q; v)

constexpr double second_tolerance = 0.01;  // of the first
constexpr Wide first_step = 1e-6L;         // of the duration

// (1), counted. Once it has stopped, x' is not to be used.
class RightHandSide {
 public:
  RightHandSide(const Motion& motion, long cap)
      : motion_(motion),
        solver_(model_of(motion.robot).cast<Wide>()),
        cap_(cap),
        q_(motion.robot.nq),
        v_(motion.robot.nv()),
        tau_(v_),
        a_(v_) {}

  void operator()(const State& x, State& derivative, Wide t) {
    stopped_ = stopped_ || calls_ == cap_;
    if (stopped_) return;
    ++calls_;
    const RobotModel& robot = motion_.robot;
    const JointTerms& terms = motion_.terms;
    q_ = Eigen::Map<const VectorX<Wide>>(x.data(), robot.nq);
    v_ = Eigen::Map<const VectorX<Wide>>(x.data() + robot.nq, robot.nv());
    const Wide s = std::sin(2 * std::numbers::pi_v<Wide> * Wide(motion_.frequency) * t);
    for (int k = 0; k < robot.nv(); ++k) {
      tau_[k] = motion_.tau[k] + s * motion_.swept[k] - terms.damping[k] * v_[k];
      if (terms.stiffness[k] > 0)
        tau_[k] -= terms.stiffness[k] * (q_[robot.links[k].q_index] - terms.reference[k]);
    }
    stopped_ = !solver_.acceleration(q_, v_, tau_, a_);
    coordinate_rate<Wide>(robot, q_.data(), v_.data(), derivative.data());
    Eigen::Map<VectorX<Wide>>(derivative.data() + robot.nq, robot.nv()) = a_;
  }

  long calls() const { return calls_; }
  bool stopped() const { return stopped_; }

 private:
  const Motion& motion_;
  SolverOf<Sequential<Conventional>, Wide> solver_;
  long cap_, calls_ = 0;
  bool stopped_ = false;
  VectorX<Wide> q_, v_, tau_, a_;
};

// Whether x came to the end.
bool integrate(RightHandSide& f, State& x, Wide duration, Wide tolerance) {
  auto stepper = odeint::make_controlled<odeint::runge_kutta_fehlberg78<State, Wide, State, Wide>>(
      tolerance, tolerance);
  Wide t = 0, h = first_step * duration;
  while (!f.stopped()) {
    const Wide left = duration - t;
    const bool last = h >= left;
    if (last) h = left;
    const auto result = stepper.try_step(std::ref(f), x, t, h);
    if (last && result == odeint::success && !f.stopped()) return true;
  }
  return false;
}

}  // namespace

Truth true_end(const Motion& motion, const TruthOptions& options) {
  const int nq = motion.robot.nq, nv = motion.robot.nv();
  RightHandSide f(motion, options.cap);
  std::vector<std::pair<VectorX<Wide>, VectorX<Wide>>> ends;
  for (const double part : {1.0, second_tolerance}) {
    State x(nq + nv);
    for (int i = 0; i < nq; ++i) x[i] = motion.q[i];
    for (int k = 0; k < nv; ++k) x[nq + k] = motion.v[k];
    if (!integrate(f, x, motion.duration, part * options.tolerance))
      throw NoTruth(f.calls() == options.cap
                        ? "needs more than " + std::to_string(options.cap) + " calls"
                        : "leads to a mass matrix that cannot be factored");
    ends.emplace_back(Eigen::Map<VectorX<Wide>>(x.data(), nq),
                      Eigen::Map<VectorX<Wide>>(x.data() + nq, nv));
  }
  const auto& [q, v] = ends[1];
  Truth out{q, v, errors(motion.robot, ends[0].first, ends[0].second, q, v), f.calls()};
  if (!(out.difference.q <= options.agreement && out.difference.v <= options.agreement))
    throw NoTruth("is known no better than to " + short_text("%.1e", out.difference.q) +
                  " in q and " + short_text("%.1e", out.difference.v) + " in v");
  return out;
}

}  // namespace kalmarm::motion
