// The change of inverse dynamics tau = ID(q, q', q'') along dq, dq' and dq'', in O(n): rigid/inverse_dynamics.hpp on dual
// numbers, whose placements change by
//   d sin = cos dq,  d cos = -sin dq of a hinge,  d d = dq of a slide,  dp = R dq of a free joint's position,
//   dR = R dq~ of a ball joint, dq about the axes of its body                                               (1)
// so that dq is along the velocity of the joints. Of forward dynamics da = M^-1 (dtau - dID) at fixed a. About 500 flops a
// hinge. Forces, which turn with their frames, loads and gravity do not change by themselves.
#pragma once

#include <vector>

#include "algorithms/fast/rigid/inverse_dynamics.hpp"
#include "algorithms/spatial/dual.hpp"

namespace kalmarm {

template <class T>
class Tangent {
  using S = typename Lanes<T>::Scalar;

 public:
  explicit Tangent(const LoweredModel<S>& model)
      : placed_(model),
        ws_(model),
        qd_(model.nv()),
        qdd_(model.nv()),
        tau_(model.nv()),
        forces_(model.widths().f),
        loads_(model.widths().l),
        gravity_(numbers_of_gravity) {}

  // dtau (nv). turning: with velocities and gravity, else qd and dqd are not looked at. dqdd: null where it is zero.
  template <bool turning>
  void fill(const LoweredModel<S>& model, const T* q, const T* qd, const T* qdd, const T* dq,
            const T* dqd, const T* dqdd, const Acting<T>& acting, T* dtau) {
    place(model, q, dq);
    for (int k = 0; k < model.nv(); ++k) {
      if constexpr (turning) qd_[k] = {qd[k], dqd[k]};
      qdd_[k] = {qdd[k], dqdd ? dqdd[k] : T(S(0))};
    }
    const Acting<Dual<T>> given = {constant(acting.forces, forces_), acting.axes,
                                   constant(acting.loads, loads_),
                                   constant(acting.gravity, gravity_)};
    ws_.gravity = given.gravity;
    detail::set_link_forces<turning>(model, qd_.data(), qdd_.data(), ws_);
    detail::sum_forces<turning>(model, qdd_.data(), ws_, tau_.data(), given);
    for (int k = 0; k < model.nv(); ++k) dtau[k] = tau_[k].dx;
  }

 private:
  struct Placed : Placements<T> {
    struct Link {
      T d;
    };
    std::vector<Link> links;

    explicit Placed(const LoweredModel<S>& model) : Placements<T>(model), links(model.nv()) {}
  };

  // (1)
  void place(const LoweredModel<S>& model, const T* q, const T* dq) {
    using Kind = typename LoweredLink<S>::Kind;
    detail::set_placements(model, q, placed_);
    for (int k = 0; k < model.nv(); ++k) {
      const LoweredLink<S>& link = model.link(k);
      if (link.kind == Kind::matrix) {
        turn(link, placed_.matrices[link.varying], dq + k, ws_.matrices[link.varying]);
      } else if (link.kind == Kind::screws && link.slides) {
        ws_.links[k].d = {placed_.links[k].d, dq[k]};
      } else if (link.kind == Kind::screws) {
        const T &s = placed_.sin[link.varying], &c = placed_.cos[link.varying];
        ws_.sin[link.varying] = {s, c * dq[k]};
        ws_.cos[link.varying] = {c, -(s * dq[k])};
      }
    }
  }

  // Of a joint's three DoF; its own axes are the columns of R from the last on (moves.hpp: set_matrix).
  static void turn(const LoweredLink<S>& link, const MatrixPlacement<T>& at, const T* dq,
                   MatrixPlacement<Dual<T>>& to) {
    const bool slides = link.coordinate == Coordinate::position;
    const T zero = T(S(0));
    for (int i = 0; i < 3; ++i) {
      const T* const R = at.R.R[i];
      const T x = R[2], y = R[0], z = R[1];
      to.p[i] = {at.p[i], slides ? x * dq[0] + y * dq[1] + z * dq[2] : zero};
      to.R.R[i][2] = {x, slides ? zero : y * dq[2] - z * dq[1]};
      to.R.R[i][0] = {y, slides ? zero : z * dq[0] - x * dq[2]};
      to.R.R[i][1] = {z, slides ? zero : x * dq[1] - y * dq[0]};
    }
  }

  static const Dual<T>* constant(const T* x, std::vector<Dual<T>>& to) {
    if (!x) return nullptr;
    for (std::size_t i = 0; i < to.size(); ++i) to[i] = Dual<T>(x[i]);
    return to.data();
  }

  Placed placed_;
  InverseDynamicsWorkspace<Dual<T>> ws_;
  std::vector<Dual<T>> qd_, qdd_, tau_, forces_, loads_, gravity_;
};

}  // namespace kalmarm
