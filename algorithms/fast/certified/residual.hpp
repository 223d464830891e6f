// Residuals of the equation of motion in twice the precision of double, for one state or one in every
// lane:
//   r = tau - ID(q, q', x)          what x leaves of the torques                             (1)
//   r = tau - M(q) x                the same at rest, without gravity; of contacts, H x      (2)
// by the kernels of rigid/inverse_dynamics.hpp, on a model that was lowered in pairs (spatial/pair.hpp),
// from sines and cosines in pairs. q, q', tau, forces from outside and the parameters are exact as they stand,
// so r is that of the mechanism itself. x comes as a sum of two numbers, high + low, which need not round to `high`.
//
// (1) takes about 1390 flops a hinge, and 200 for its sine and cosine.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "algorithms/fast/certified/own_forces.hpp"
#include "algorithms/fast/covariance/contacts.hpp"
#include "algorithms/spatial/lanes.hpp"
#include "algorithms/spatial/pair_sincos.hpp"

namespace kalmarm {

// Memory of one state, or of one state in every lane of T.
template <class T>
class TwiceResidual {
 public:
  using Wide = Pair<T>;
  using Model = LoweredModel<Pair<double>>;

  explicit TwiceResidual(const Model& model)
      : workspace_(model),
        q_(model.nq()),
        qd_(model.nv()),
        x_(model.nv()),
        torque_(model.nv()),
        forces_(std::max(model.widths().f, model.widths().c)),
        loads_(model.widths().l),
        gravity_(numbers_of_gravity),
        tau_(model.nv()) {
    contacts_.reserve(model.contacts().size());
  }

  // The equation that is to be solved. (1):
  void set_motion(const Model& model, const T* q, const T* qd, const T* tau,
                  const Acting<T>& acting);
  // (2):
  void set_mass(const Model& model, const T* q, const Acting<T>& contacts = {});
  void set_torque(const T* tau) { std::copy_n(tau, tau_.size(), tau_.data()); }

  // r (nv) of x = high + low; low may be null: zero.
  void of(const Model& model, const T* high, const T* low, T* r);

 private:
  // forces: numbers of them.
  Acting<Wide> widened(const Acting<T>& acting, std::ptrdiff_t forces) {
    if (acting.forces) std::copy_n(acting.forces, forces, forces_.begin());
    if (acting.loads) std::copy_n(acting.loads, loads_.size(), loads_.begin());
    if (acting.gravity) std::copy_n(acting.gravity, gravity_.size(), gravity_.begin());
    return {acting.forces ? forces_.data() : nullptr, acting.axes,
            acting.loads ? loads_.data() : nullptr, acting.gravity ? gravity_.data() : nullptr};
  }

  bool moving_ = false;  // (1), else (2)
  InverseDynamicsWorkspace<Wide> workspace_;
  std::vector<Wide> q_, qd_, x_, torque_, forces_, loads_, gravity_;
  Acting<Wide> acting_;
  std::vector<std::pair<int, Sixfold<Wide>>> contacts_;
  std::vector<T> tau_;
};

template <class T>
void TwiceResidual<T>::set_motion(const Model& model, const T* q, const T* qd, const T* tau,
                                  const Acting<T>& acting) {
  set_mass(model, q);
  moving_ = true;
  set_torque(tau);
  std::copy_n(qd, qd_.size(), qd_.begin());
  acting_ = widened(acting, model.widths().f);
  workspace_.gravity = acting_.gravity;
}

template <class T>
void TwiceResidual<T>::set_mass(const Model& model, const T* q, const Acting<T>& contacts) {
  moving_ = false;
  std::copy_n(q, q_.size(), q_.begin());
  detail::set_placements(model, q_.data(), workspace_);
  contacts_.clear();
  acting_ = widened(contacts, model.widths().c);
  detail::for_each_contact(model, workspace_, acting_, [this](int link, const Sixfold<Wide>& w) {
    contacts_.push_back({link, w});
  });
}

template <class T>
void TwiceResidual<T>::of(const Model& model, const T* high, const T* low, T* r) {
  const int nv = model.nv();
  for (int k = 0; k < nv; ++k) x_[k] = low ? Wide{high[k], low[k]} : Wide(high[k]);
  if (moving_) {
    detail::set_link_forces<true>(model, qd_.data(), x_.data(), workspace_);
    detail::sum_forces<true>(model, x_.data(), workspace_, torque_.data(), acting_);
  } else {
    detail::mass_times(model, x_.data(), contacts_, acting_, workspace_, torque_.data());
  }
  for (int k = 0; k < nv; ++k) {
    const Wide rest = Wide(tau_[k]) - torque_[k];
    r[k] = rest.hi + rest.lo;
  }
}

extern template class LoweredModel<Pair<double>>;
extern template LoweredModel<Pair<double>>::LoweredModel(const kalmarm::Model<Pair<double>>&, Zeros,
                                                         double, const CallFrames&);
extern template class TwiceResidual<double>;
extern template class TwiceResidual<Pack<double, padding<double>>>;

}  // namespace kalmarm
