#include <algorithm>
#include <memory>
#include <vector>

#include "algorithms/fast/derivatives/parameter_adjoints.hpp"
#include "algorithms/fast/derivatives/tangent.hpp"
#include "algorithms/fast/engine/instances.hpp"
#include "algorithms/fast/engines/engines.hpp"
#include "algorithms/model/plain.hpp"

namespace kalmarm {
namespace {

// Where a body's ten numbers are: on its link, in the model's axes.
template <class S>
struct BodyFrame {
  Matrix3<S> A;
  Vector3<S> s;
};

template <class S>
std::vector<BodyFrame<S>> body_frames(const LoweredModel<S>& model) {
  const Transform<Wider<S>> same{Matrix3<Wider<S>>::Identity(), Vector3<Wider<S>>::Zero()};
  std::vector<BodyFrame<S>> out;
  for (int k = 0; k < model.nv(); ++k) {
    const auto phi = model.phi_on_link(k, same);
    out.push_back({phi.R.template cast<S>(), phi.p.template cast<S>()});
  }
  return out;
}

// Of one state, or of one in every lane.
template <class T>
class Differentiated {
  using S = typename Lanes<T>::Scalar;

 public:
  explicit Differentiated(const LoweredModel<S>& model)
      : model_(model), power_(model), tangent_(model), bodies_(body_frames(model)) {}

  void answer(const GradientCall<T>& call) {
    call.moves ? answer<true>(call) : answer<false>(call);
  }

 private:
  template <bool moves>
  void answer(const GradientCall<T>& call) {
    const Acting<T> acting = {call.forces, Axes::local, call.loads, call.gravity};
    if (!call.lambda)
      return tangent_.template fill<moves>(model_, call.q, call.qd, call.qdd, call.dq, call.dqd,
                                           call.dqdd, acting, call.dtau);
    virtual_power_adjoints<moves>(model_, call.q, call.qd, call.qdd, call.lambda, power_,
                                  JointAdjoints<T>{call.by.q, call.by.qd, call.by.qdd}, acting);
    for (int k = 0; k < model_.nv(); ++k) {
      if (call.by.inertias)
        body_adjoints(bodies_[k].A, bodies_[k].s, power_.motions[k],
                      call.by.inertias + numbers_of_load * k);
      if (call.by.armature) call.by.armature[k] = call.lambda[k] * call.qdd[k];
    }
    const auto each = [&](const std::vector<LoweredFrame<S>>& frames, T* out,
                          std::ptrdiff_t numbers, const auto& adjoints) {
      for (std::size_t i = 0; out && i < frames.size(); ++i)
        adjoints(frames[i].A, frames[i].s, power_.motions[frames[i].link], out + numbers * i);
    };
    each(model_.acted_on(), call.by.forces, numbers_of_force, force_adjoints<T, S>);
    each(model_.loaded(), call.by.loads, numbers_of_load, body_adjoints<T, S>);
    if constexpr (moves)
      if (call.by.gravity) std::ranges::copy(power_.by_gravity, call.by.gravity);
  }

  const LoweredModel<S>& model_;
  VirtualPowerWorkspace<T> power_;
  Tangent<T> tangent_;
  std::vector<BodyFrame<S>> bodies_;
};

// Memory for what a call has of one state, or of one in every lane, and for what it wants.
template <class T>
struct CallNumbers {
  std::vector<T> q, qd, qdd, lambda, dq, dqd, dqdd, forces, loads, gravity;
  std::vector<T> by_q, by_qd, by_qdd, by_armature, dtau, by_inertias, by_forces, by_loads,
      by_gravity;

  explicit CallNumbers(const Widths& width)
      : q(width.nq),
        qd(width.nv),
        qdd(qd),
        lambda(qd),
        dq(qd),
        dqd(qd),
        dqdd(qd),
        forces(width.f),
        loads(width.l),
        gravity(numbers_of_gravity),
        by_q(qd),
        by_qd(qd),
        by_qdd(qd),
        by_armature(qd),
        dtau(qd),
        by_inertias(numbers_of_load * width.nv),
        by_forces(forces),
        by_loads(loads),
        by_gravity(gravity) {}

  // The call on this memory; load(from, to) of all that is given.
  template <class S, class Load>
  GradientCall<T> load(const GradientCall<S>& call, const Load& load) {
    const auto loaded = [&](const S* from, std::vector<T>& to) -> const T* {
      if (!from) return nullptr;
      load(from, to);
      return to.data();
    };
    GradientCall<T> out{.moves = call.moves};
    out.q = loaded(call.q, q);
    out.qd = loaded(call.qd, qd);
    out.qdd = loaded(call.qdd, qdd);
    out.forces = loaded(call.forces, forces);
    out.loads = loaded(call.loads, loads);
    out.gravity = loaded(call.gravity, gravity);
    out.lambda = loaded(call.lambda, lambda);
    out.dq = loaded(call.dq, dq);
    out.dqd = loaded(call.dqd, dqd);
    out.dqdd = loaded(call.dqdd, dqdd);
    if (out.lambda && call.sign != S(1))
      for (T& x : lambda) x = -x;
    out.by = {by_q.data(), by_qd.data(), by_qdd.data()};  // always worked out
    const auto wanted = [](const S* to, std::vector<T>& from) {
      return to ? from.data() : nullptr;
    };
    out.by.inertias = wanted(call.by.inertias, by_inertias);
    out.by.armature = wanted(call.by.armature, by_armature);
    out.by.forces = wanted(call.by.forces, by_forces);
    out.by.loads = wanted(call.by.loads, by_loads);
    out.by.gravity = wanted(call.by.gravity, by_gravity);
    out.dtau = dtau.data();
    return out;
  }

  // store(from, to) of all that is wanted.
  template <class S, class Store>
  void store(const GradientCall<S>& call, const Store& store) const {
    const auto stored = [&](const std::vector<T>& from, S* to) {
      if (to) store(from, to);
    };
    stored(by_q, call.by.q);
    if (call.moves) stored(by_qd, call.by.qd);
    stored(by_qdd, call.by.qdd);
    stored(by_inertias, call.by.inertias);
    stored(by_armature, call.by.armature);
    stored(by_forces, call.by.forces);
    stored(by_loads, call.by.loads);
    stored(by_gravity, call.by.gravity);
    stored(dtau, call.dtau);
  }
};

template <class S>
class EngineOfGradients final : public GradientEngine<S> {
 public:
  EngineOfGradients(const RobotModel& robot, const CallFrames& frames)
      : given_(model_of(robot)),
        in_double_(given_, Zeros::left_out, accepted_error(default_tolerance<double>), frames),
        lowered_(given_.template cast<S>(), Zeros::left_out, accepted_error(default_tolerance<S>),
                 frames),
        width_(lowered_.widths()),
        numbers_(width_),
        one_(in_double_) {}

  void answer(const GradientCall<S>& call) override {
    one_.answer(numbers_.load(call, [](const S* from, std::vector<double>& to) {
      std::copy_n(from, to.size(), to.begin());
    }));
    numbers_.store(call, [](const std::vector<double>& from, S* to) {
      std::transform(from.begin(), from.end(), to, [](double x) { return static_cast<S>(x); });
    });
  }

  void reserve_workers(int count) override {
    while (static_cast<int>(workers_.size()) < count)
      workers_.push_back(std::make_unique<Worker>(lowered_, width_));
  }

  void answer_rows(int worker, int count, const GradientCall<S>& call) override {
    Worker& w = *workers_[worker];
    for (int first = 0; first < count; first += lanes) {
      const int states = std::min(lanes, count - first), left = count - first;
      const GradientCall<S> rows = call.from(first, width_);
      w.kernel.answer(w.numbers.load(rows, [&](const S* from, std::vector<P>& to) {
        to_lanes(from, static_cast<int>(to.size()), states, left, to);
      }));
      w.numbers.store(rows, [&](const std::vector<P>& from, S* to) {
        from_lanes(from, static_cast<int>(from.size()), states, to);
      });
    }
  }

 private:
  using P = StateLanes<S>;
  static constexpr int lanes = Lanes<P>::count;

  struct Worker {
    CallNumbers<P> numbers;
    Differentiated<P> kernel;

    Worker(const LoweredModel<S>& model, const Widths& width) : numbers(width), kernel(model) {}
  };

  Model<double> given_;
  LoweredModel<double> in_double_;
  LoweredModel<S> lowered_;
  Widths width_;
  CallNumbers<double> numbers_;
  Differentiated<double> one_;
  std::vector<std::unique_ptr<Worker>> workers_;
};

}  // namespace

template <class S>
std::unique_ptr<GradientEngine<S>> make_engine_of_gradients(const RobotModel& robot,
                                                            const CallFrames& frames) {
  return std::make_unique<EngineOfGradients<S>>(robot, frames);
}
template std::unique_ptr<GradientEngine<float>> make_engine_of_gradients(const RobotModel&,
                                                                         const CallFrames&);
template std::unique_ptr<GradientEngine<double>> make_engine_of_gradients(const RobotModel&,
                                                                          const CallFrames&);

}  // namespace kalmarm
