// Accelerations of chosen rows of states, refined a state in every lane (certified_acceleration.hpp); what
// its own factors do not settle is answered in two doubles, one state after another.
#pragma once

#include <algorithm>
#include <vector>

#include "algorithms/fast/certified/certified_acceleration.hpp"
#include "algorithms/fast/engine/row_block.hpp"

namespace kalmarm {

class CertifiedRows {
 public:
  explicit CertifiedRows(const CertifiedModels& models)
      : models_(models),
        width_(models.lowered.widths()),
        sweep_(models),
        lanes_(models.lowered),
        q_(lanes * width_.nq),
        qd_(lanes * width_.nv, 0.0),
        tau_(qd_),
        forces_(lanes * width_.f),
        loads_(lanes * width_.l),
        gravity_(lanes * numbers_of_gravity),
        a_(qd_) {
    chosen_.reserve(lanes);
  }

  // Of every row whose `choice` is set; call.qd is null where all are at rest.
  void answer(int count, const Call<double>& call, Outcome* outcomes, const char* choice,
              CertifiedAcceleration& one) {
    for_each_chosen(count, choice, lanes, chosen_, [&] { refine(call, outcomes, one); });
  }

 private:
  using Block = RowBlock<double>;
  static constexpr int lanes = Block::lanes;

  void refine(const Call<double>& call, Outcome* outcomes, CertifiedAcceleration& one) {
    const int states = static_cast<int>(chosen_.size());
    gather(call.q, width_.nq, q_);
    if (call.qd) gather(call.qd, width_.nv, qd_);
    gather(call.tau, width_.nv, tau_);
    if (call.forces) gather(call.forces, width_.f, forces_);
    if (call.loads) gather(call.loads, width_.l, loads_);
    if (call.gravity) gather(call.gravity, numbers_of_gravity, gravity_);
    const Call<double> gathered{.want = call.want,
                                .q = q_.data(),
                                .qd = qd_.data(),
                                .tau = tau_.data(),
                                .out = a_.data(),
                                .forces = call.forces ? forces_.data() : nullptr,
                                .loads = call.loads ? loads_.data() : nullptr,
                                .gravity = call.gravity ? gravity_.data() : nullptr,
                                .axes = call.axes};
    lanes_.load(models_.lowered, gathered, states, lanes);
    RefinedAnswer refined[lanes];
    sweep_.acceleration(models_, lanes_.q.data(), lanes_.qd.data(), lanes_.tau.data(),
                        lanes_.acting, states, lanes_.out.data(), refined);
    lanes_.store(states, a_.data());
    for (int i = 0; i < states; ++i) {
      const Call<double> state = gathered.from(i, width_);
      outcomes[chosen_[i]] =
          refined[i].settled ? outcome_of(refined[i]) : one.last_resort(models_, state);
      std::copy_n(state.out, width_.nv, call.out + chosen_[i] * width_.nv);
    }
  }

  void gather(const double* rows, std::ptrdiff_t width, std::vector<double>& to) const {
    double* next = to.data();
    for (const int row : chosen_) next = std::copy_n(rows + row * width, width, next);
  }

  const CertifiedModels& models_;
  Widths width_;
  CertifiedSweep<StateLanes<double>> sweep_;
  Block lanes_;
  std::vector<double> q_, qd_, tau_, forces_, loads_, gravity_,
      a_;  // of as many rows as there are lanes
  std::vector<int> chosen_;
};

}  // namespace kalmarm
