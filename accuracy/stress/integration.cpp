#include "accuracy/stress/integration.hpp"

#include <boost/numeric/odeint.hpp>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "accuracy/measures/measures.hpp"

namespace kalmarm::stress {
namespace {

namespace odeint = boost::numeric::odeint;

using Wide = long double;
using State = std::vector<double>;  // (q; q')

constexpr double first_step = 0.01;  // of the duration

using Part = Eigen::Map<VectorX<double>>;
using ConstPart = Eigen::Map<const VectorX<double>>;

// (1), counted. Once it has stopped, x' is not to be used.
template <class T>
class RightHandSide {
 public:
  RightHandSide(Solver<T>& solver, int n, int cap)
      : solver_(solver), n_(n), cap_(cap), tau_(VectorX<T>::Zero(n)), a_(n) {}

  void operator()(const State& x, State& derivative, double /* t */) {
    stopped_ = stopped_ || calls_ == cap_;
    if (stopped_) return;
    ++calls_;
    const ConstPart q(x.data(), n_), qd(x.data() + n_, n_);
    q_ = q.cast<T>();
    qd_ = qd.cast<T>();
    a_.setConstant(std::numeric_limits<T>::quiet_NaN());
    stopped_ = !solver_.acceleration(q_, qd_, tau_, a_);
    Part(derivative.data(), n_) = qd;
    Part(derivative.data() + n_, n_) = a_.template cast<double>();
  }

  int calls() const { return calls_; }
  bool stopped() const { return stopped_; }

 private:
  Solver<T>& solver_;
  int n_, cap_, calls_ = 0;
  bool stopped_ = false;
  VectorX<T> q_, qd_, tau_, a_;
};

// Whether x came to the end of the duration.
template <class T>
bool integrate(RightHandSide<T>& f, State& x, const Fall& fall) {
  auto stepper = odeint::make_controlled<odeint::runge_kutta_dopri5<State>>(fall.tolerance,
                                                                            fall.tolerance);  // (2)
  double t = 0, h = first_step * fall.duration;
  while (!f.stopped()) {
    const double left = fall.duration - t;
    const bool last = h >= left;
    if (last) h = left;
    const auto result = stepper.try_step(std::ref(f), x, t, h);
    if (last && result == odeint::success && !f.stopped()) return true;
  }
  return false;
}

// (5)
double energy_drift(const Model<Wide>& model, const VectorX<double>& q0, const VectorX<double>& q,
                    const VectorX<double>& qd) {
  const Energy before = energy(model, q0.cast<Wide>(), VectorX<Wide>::Zero(model.nv()));
  const Energy after = energy(model, q.cast<Wide>(), qd.cast<Wide>());
  return static_cast<double>(quotient(std::abs(after.total() - before.total()), after.kinetic));
}

}  // namespace

Energy energy(const Model<Wide>& model, const VectorX<Wide>& q, const VectorX<Wide>& qd) {
  LinkKinematics<Wide> kin(model);
  set_position(model, q, kin);
  set_velocity(model, qd, kin);
  std::vector<Transform<Wide>> pose(model.nv());
  Energy out;
  for (int k = 0; k < model.nv(); ++k) {
    const Joint<Wide>& joint = model.joint(k);
    const Vector3<Wide>& c = joint.body.com;
    pose[k] = kin.phi[k];
    if (joint.parent >= 0) {
      const Transform<Wide>& parent = pose[joint.parent];
      pose[k] = {parent.R * kin.phi[k].R, parent.p + parent.R * kin.phi[k].p};
    }
    const Vector3<Wide> w = kin.v[k].head<3>(), v_c = kin.v[k].tail<3>() + w.cross(c);
    out.kinetic += (joint.body.mass * v_c.squaredNorm() + w.dot(model.inertia(k).I_cm * w) +
                    joint.r * qd[k] * qd[k]) /
                   2;                                                                   // (3)
    out.potential -= joint.body.mass * model.gravity().dot(pose[k].p + pose[k].R * c);  // (4)
  }
  return out;
}

template <class T>
Integration free_fall(Solver<T>& solver, const Model<T>& model, const VectorX<double>& q,
                      const Fall& fall) {
  const int n = model.nv();
  State x(2 * n, 0.0);
  Part(x.data(), n) = q;
  RightHandSide<T> f(solver, n, fall.cap);
  Integration out;
  out.finished = integrate(f, x, fall);
  out.calls = f.calls();
  out.q = Part(x.data(), n);
  out.qd = Part(x.data() + n, n);
  out.energy_drift = out.finished ? energy_drift(model.template cast<Wide>(), q, out.q, out.qd)
                                  : std::numeric_limits<double>::quiet_NaN();
  return out;
}

template Integration free_fall(Solver<float>&, const Model<float>&, const VectorX<double>&,
                               const Fall&);
template Integration free_fall(Solver<double>&, const Model<double>&, const VectorX<double>&,
                               const Fall&);

}  // namespace kalmarm::stress
