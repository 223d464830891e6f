// A part of a plan at work: its engine, and for every worker its states and what is copied to and from
// them.
//
// What the engine is asked is what the whole robot is asked, but for what an engine does not have
// (Engine::answers_in_part), or of which joints that are locked by their noise are no part:
//   M^-1                      a block of M^-1 alone, where that is all that is asked for
//   its diagonal, J M^-1 J'   else M^-1, of which they are read
//   log det M                 else M, by Cholesky: 2 sum of log L(k,k)
#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "algorithms/dynamics/copies.hpp"
#include "algorithms/dynamics/plan.hpp"
#include "algorithms/fast/claims/tuning.hpp"
#include "algorithms/model/plain.hpp"

namespace kalmarm {

template <class T>
class PartState {
 public:
  PartState(const Plan& plan, const Part& part, double tolerance, Triangles triangles,
            const MakeEngine<T>& make);

  Engine<T>& engine() { return *engine_; }
  // Whether the engine is asked just that.
  bool asks_engine(Want want) const { return asked_of_engine(want) == want; }

  // Memory of so many workers for so many states of `want` at once.
  void reserve(Want want, int workers, int states);
  // That of the engine, for rows.
  void reserve_engine(Want want, int workers) {
    if (asks(want)) engine_->reserve_workers(asked_of_engine(want), workers);
  }

  // As many states of `want` as lie in a cache together.
  int states_at_once(Want want) const {
    const std::ptrdiff_t numbers =
        want == Want::derivatives ? 3 * part_.n * part_.n : part_.out(asked_of_engine(want));
    return static_cast<int>(
        std::clamp<std::ptrdiff_t>(most_states * most_rows_in_lanes * most_rows_in_lanes /
                                       std::max(numbers, std::ptrdiff_t(1)),
                                   1, most_states));
  }

  // What `call` of the whole robot, whose rows are so wide, asks of this part, copied to where its result
  // is zero elsewhere: of one state, or of rows.
  Outcome answer(const Call<T>& call, const Widths& whole) {
    if (!asks(call.want)) return {};
    Worker& w = workers_[0];
    const Call<T> asked = gather(w, 1, call, whole);
    const Outcome out = of_whole(engine_->answer(asked));
    return scatter(w, asked, call, whole, out);
  }
  void answer_rows(int worker, int states, const Call<T>& call, const Widths& whole,
                   Outcome* outcomes) {
    if (!asks(call.want)) return;
    Worker& w = workers_[worker];
    const Call<T> asked = gather(w, states, call, whole);
    engine_->answer_rows(worker, states, asked, w.outcomes.data());
    for (int i = 0; i < states; ++i) {
      const Outcome out = scatter(w, asked.from(i, part_), call.from(i, whole), whole,
                                  outcomes ? of_whole(w.outcomes[i]) : Outcome{});
      if (outcomes) outcomes[i] = worse(outcomes[i], out);
    }
  }

  Outcome factor(const Call<T>& call, const Widths& whole) {
    return of_whole(engine_->factor(gather(workers_[0], 1, call, whole)));
  }

  // By the factors of the last `factor`; torques of joints that are not asked about are zero.
  Outcome solve(const T* tau, T* x) {
    Worker& w = workers_[0];
    std::fill(w.tau.begin(), w.tau.end(), T(0));
    asked_.back(tau, w.tau.data());
    const Outcome out = of_whole(engine_->solve(1, w.tau.data(), w.out.data()));
    asked_(w.out.data(), x);
    return out;
  }

 private:
  static constexpr std::ptrdiff_t most_states = 64;

  // For what is read off M^-1 or M.
  struct Reading {
    Model<T> model;
    LinkKinematics<T> kin;
    VectorX<T> q, diagonal;
    MatrixX<T> J, XJ, JXJ, M;
    Eigen::LLT<MatrixX<T>> llt;

    Reading(const Model<T>& of_part, Eigen::Index rows_of_J, Eigen::Index free_dofs)
        : model(of_part),
          kin(model),
          q(model.nq()),
          diagonal(rows_of_J),
          J(rows_of_J, model.nv()),
          XJ(model.nv(), rows_of_J),
          JXJ(rows_of_J, rows_of_J),
          M(free_dofs, free_dofs),
          llt(free_dofs) {}
  };

  struct Worker {
    std::vector<T> q, qd, tau, forces, contacts, loads, r, out;
    std::vector<T> derivatives[3];
    std::vector<Outcome> outcomes;
    std::unique_ptr<Reading> reading;
  };

  // A part without frames has nothing to say of them.
  bool asks(Want want) const { return !is_of_frames(want) || !sites_.empty(); }

  Want asked_of_engine(Want want) const {
    switch (want) {
      case Want::inverse:
        return block_ ? Want::operational : want;
      case Want::diagonal:
      case Want::operational:
      case Want::operational_diagonal:
        return in_part_ ? want : Want::inverse;
      case Want::log_det:
        return sums_D_ ? want : Want::mass;
      default:
        return want;
    }
  }

  Call<T> gather(Worker& w, int states, const Call<T>& call, const Widths& whole) const;
  Outcome scatter(Worker& w, const Call<T>& part, const Call<T>& call, const Widths& whole,
                  Outcome out) const;

  Outcome of_whole(Outcome outcome) const {
    if (outcome.joint >= 0) outcome.joint = dofs_[outcome.joint];
    return outcome;
  }

  const MatrixX<T>& read_operational(Reading& reading, const Call<T>& part) const;
  Outcome read_log_det(Reading& reading, const T* M, T& x) const;

  std::unique_ptr<Engine<T>> engine_;
  bool in_part_ = false;
  bool block_ = false;   // of M^-1 not all is asked for
  bool sums_D_ = false;  // log det M by it: no D is that of a locked joint
  bool at_rest_ = false;
  Widths part_;
  Model<double> model_;
  VectorX<T> q_;           // where what is locked by noise stands
  std::vector<int> dofs_;  // of the whole
  std::vector<Site<T>> sites_;
  Copies q_in_, v_in_;  // state of the whole -> of the part
  Copies forces_in_, contacts_in_, loads_in_;
  std::vector<int> free_dofs_;     // of the part: those that are not locked
  Copies asked_;                   // DoF of the part -> of the result
  Copies block_out_, frames_out_;  // row of the engine's selection, or of J -> row of the result
  std::vector<Worker> workers_;
};

template <class T>
PartState<T>::PartState(const Plan& plan, const Part& part, double tolerance, Triangles triangles,
                        const MakeEngine<T>& make)
    : at_rest_(plan.question.at_rest),
      part_(part.reduction.model.nq(), part.reduction.model.nv(), part.reduction.model.nv(), 0,
            part.of_calls),
      model_(part.reduction.model),
      q_(part_.nq),
      dofs_(part.reduction.dofs) {
  const Reduction& reduction = part.reduction;
  const Question& question = plan.question;
  const auto wants = [&](Want what) { return question.want.contains(what); };
  const bool wants_frames = std::any_of(question.want.begin(), question.want.end(), is_of_frames);
  // Large enough for g = P H' / D to vanish beside 1, small enough for g^2 not to underflow.
  const T infinite = T(1) / (unit_roundoff<T>() * unit_roundoff<T>());
  const double infinite_noise = infinite < T(0x1p996) ? static_cast<double>(infinite) : 0x1p996;
  // What is locked by noise keeps its place and stands still.
  for (int i = 0; i < part_.nq; ++i) q_[i] = T(question.q[reduction.q_whole[i]]);
  for (int k = 0; k < model_.nv(); ++k) {
    if (std::binary_search(question.locked.begin(), question.locked.end(), dofs_[k])) {
      model_.set_noise(k, infinite_noise);
      continue;
    }
    free_dofs_.push_back(k);
    v_in_.add(dofs_[k], k);
    const Joint<double>& joint = model_.joint(k);
    for (int i = 0; i < q_entries(joint.coordinate); ++i)
      q_in_.add(reduction.q_whole[joint.q_index + i], joint.q_index + i);
  }
  const auto copy = [](const std::vector<int>& index, std::ptrdiff_t numbers, Copies& in) {
    const int n = static_cast<int>(numbers);
    for (int i = 0; i < static_cast<int>(index.size()); ++i)
      for (int j = 0; j < n; ++j) in.add(n * index[i] + j, n * i + j);
  };
  copy(part.acted_index, numbers_of_force, forces_in_);
  copy(part.contact_index, numbers_of_force, contacts_in_);
  copy(part.loaded_index, numbers_of_load, loads_in_);
  const bool holds_locked = static_cast<int>(free_dofs_.size()) < model_.nv();

  EngineOptions options;
  options.tolerance = tolerance;
  // Without partial answers the rest of M^-1 is read off the whole of it.
  options.triangles = plan.partial_answers ? triangles : Triangles::both;
  options.kernel = part.kernel;
  options.zeros = part.zeros;
  options.want = question.want;
  options.frames = part.of_calls;
  if (plan.partial_answers) {
    if (part.block) options.selection.dofs = part.asked;
    if (part.block) options.want.insert(Want::operational);
    if (wants_frames) options.selection.frames = part.frames;
  } else if (wants(Want::diagonal) || wants_frames) {
    options.want.insert(Want::inverse);
  }
  if ((!plan.partial_answers || holds_locked) && wants(Want::log_det))
    options.want.insert(Want::mass);
  engine_ = make(plain(model_), options);
  in_part_ = plan.partial_answers && engine_->answers_in_part();
  block_ = in_part_ && part.block;
  sums_D_ = in_part_ && !holds_locked;

  int row = 0;
  for (const int k : part.asked) {
    const int place = static_cast<int>(
        std::lower_bound(plan.asked.begin(), plan.asked.end(), dofs_[k]) - plan.asked.begin());
    asked_.add(k, place);
    if (block_) block_out_.add(row++, place);
  }
  if (wants_frames) {
    for (const int frame : part.frame_index)
      for (int i = 0; i < 6; ++i) frames_out_.add(row++, 6 * frame + i);
    for (const Frame& frame : part.frames) sites_.push_back(site_of(frame).template cast<T>());
  }
  part_.k = row;
}

template <class T>
void PartState<T>::reserve(Want want, int workers, int states) {
  const auto grow = [states](std::vector<T>& x, std::ptrdiff_t numbers) {
    x.resize(std::max<std::size_t>(x.size(), states * numbers));
  };
  const Want of_engine = asked_of_engine(want);
  if (static_cast<int>(workers_.size()) < workers) workers_.resize(workers);
  for (int i = 0; i < workers; ++i) {
    Worker& w = workers_[i];
    while (static_cast<std::ptrdiff_t>(w.q.size()) < states * part_.nq)
      w.q.insert(w.q.end(), q_.begin(), q_.end());
    for (std::vector<T>* const x : {&w.qd, &w.tau, &w.r}) grow(*x, part_.nv);
    grow(w.forces, part_.f);
    grow(w.contacts, part_.c);
    grow(w.loads, part_.l);
    // A solve of one state has a vector, whatever is asked.
    grow(w.out, std::max(part_.out(of_engine), part_.nv));
    if (want == Want::derivatives)
      for (std::vector<T>& X : w.derivatives) grow(X, part_.n * part_.n);
    w.outcomes.resize(std::max<std::size_t>(w.outcomes.size(), states));
    const bool reads = is_of_frames(want) || want == Want::log_det;
    if (reads && of_engine != want && !w.reading)
      w.reading = std::make_unique<Reading>(model_.template cast<T>(),
                                            static_cast<Eigen::Index>(6 * sites_.size()),
                                            static_cast<Eigen::Index>(free_dofs_.size()));
  }
}

template <class T>
Call<T> PartState<T>::gather(Worker& w, int states, const Call<T>& call,
                             const Widths& whole) const {
  Call<T> out{.want = asked_of_engine(call.want), .q = w.q.data(), .out = w.out.data()};
  for (int i = 0; i < states; ++i) {
    const Call<T> from = call.from(i, whole);
    q_in_(from.q, w.q.data() + i * part_.nq);
    if (from.qd && !at_rest_) v_in_(from.qd, w.qd.data() + i * part_.nv);
    T* const tau = w.tau.data() + i * part_.nv;
    if (call.want == Want::solve) {
      std::fill_n(tau, part_.nv, T(0));
      if (from.tau) asked_.back(from.tau, tau);
    } else if (from.tau) {
      v_in_(from.tau, tau);
    }
    if (from.forces) forces_in_(from.forces, w.forces.data() + i * part_.f);
    if (from.contacts) contacts_in_(from.contacts, w.contacts.data() + i * part_.c);
    if (from.loads) loads_in_(from.loads, w.loads.data() + i * part_.l);
    if (from.r) v_in_(from.r, w.r.data() + i * part_.nv);
  }
  if (call.qd) out.qd = w.qd.data();
  if (call.tau) out.tau = w.tau.data();
  if (call.forces) out.forces = w.forces.data();
  if (call.contacts) out.contacts = w.contacts.data();
  if (call.loads) out.loads = w.loads.data();
  out.gravity = call.gravity;  // in the base's axes, which are those of every part
  out.axes = call.axes;
  if (call.r) out.r = w.r.data();
  for (std::size_t i = 0; i < call.derivatives.size(); ++i)
    if (call.derivatives[i]) out.derivatives[i] = w.derivatives[i].data();
  return out;
}

// Of one state.
template <class T>
Outcome PartState<T>::scatter(Worker& w, const Call<T>& part, const Call<T>& call,
                              const Widths& whole, Outcome out) const {
  const int nv = static_cast<int>(part_.nv), n = static_cast<int>(whole.n);
  switch (call.want) {
    case Want::mass:
      asked_.block(part.out, nv, call.out, n);
      return out;
    case Want::inverse:
      if (block_)
        block_out_.block(part.out, static_cast<int>(part_.k), call.out, n);
      else
        asked_.block(part.out, nv, call.out, n);
      return out;
    case Want::diagonal:
      if (!in_part_)
        for (int k = 0; k < nv; ++k) part.out[k] = part.out[k * (part_.nv + 1)];
      asked_(part.out, call.out);
      return out;
    case Want::log_det: {
      T x = sums_D_ ? *part.out : T(0);
      if (!sums_D_) out = read_log_det(*w.reading, part.out, x);
      *call.out += x;
      return out;
    }
    case Want::operational:
      if (in_part_)
        frames_out_.block(part.out, static_cast<int>(part_.k), call.out, static_cast<int>(whole.k));
      else
        frames_out_.block(read_operational(*w.reading, part).data(),
                          static_cast<int>(6 * sites_.size()), call.out, static_cast<int>(whole.k));
      return out;
    case Want::operational_diagonal:
      if (!in_part_) w.reading->diagonal = read_operational(*w.reading, part).diagonal();
      frames_out_(in_part_ ? part.out : w.reading->diagonal.data(), call.out);
      return out;
    case Want::derivatives:
      for (std::size_t i = 0; i < call.derivatives.size(); ++i)
        if (call.derivatives[i]) asked_.block(part.derivatives[i], nv, call.derivatives[i], n);
      asked_(part.out, call.out);
      return out;
    default:
      asked_(part.out, call.out);
      return out;
  }
}

template <class T>
const MatrixX<T>& PartState<T>::read_operational(Reading& r, const Call<T>& part) const {
  const Eigen::Map<const MatrixX<T>> inverse(part.out, part_.nv, part_.nv);
  r.q = Eigen::Map<const VectorX<T>>(part.q, part_.nq);
  set_position(r.model, r.q, r.kin);
  site_jacobian<T>(r.model, r.kin, sites_, r.J);
  r.XJ.noalias() = inverse * r.J.transpose();
  r.JXJ.noalias() = r.J * r.XJ;
  return r.JXJ;
}

// Of all DoF that are free.
template <class T>
Outcome PartState<T>::read_log_det(Reading& r, const T* M, T& x) const {
  using std::log;
  const Eigen::Index n = r.M.rows();
  for (Eigen::Index j = 0; j < n; ++j)
    for (Eigen::Index i = 0; i < n; ++i) r.M(i, j) = M[free_dofs_[j] * part_.nv + free_dofs_[i]];
  r.llt.compute(r.M);
  if (r.llt.info() != Eigen::Success) return {.status = Outcome::Status::indefinite};
  x = T(0);
  for (Eigen::Index k = 0; k < n; ++k) x += T(2) * log(r.llt.matrixLLT()(k, k));
  return {};
}

}  // namespace kalmarm
