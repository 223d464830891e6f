// The torques of inverse dynamics as a linear function of what the bodies are: tau = Y pi + r q''. pi(k) of a link:
//   (m, h_x, h_y, h_z, I_xx, I_yy, I_zz, I_xy, I_xz, I_yz)         h = m c, I about the link's origin
// in its axes as the model has them, of which the base's see the columns r_x, r_y, r_z. With a the acceleration
// of its origin less gravity, the body needs there
//   F = m a + w' x h + w x (w x h),  N = h x a + I w' + w x I w                                (1)
// so that per unit of                                      F                          N
//   m                                                      a                          0
//   h_i                                                    w' x r_i + w x (w x r_i)   r_i x a
//   I_ij, with S = (r_i r_j' + r_j r_i') / (1 + [i = j])   0                          S w' + w x S w
// and DoF j inboard of it feels
//   Y(j) = e'(N + (p(k) - p(j)) x F) where it turns, e'F where it slides                        (2)
// About 300 flops a link, and 100 for each DoF inboard of it.
#pragma once

#include <array>
#include <vector>

#include "algorithms/fast/frames/world_motion.hpp"

namespace kalmarm {

template <class T>
class Regressor {
  using S = typename Lanes<T>::Scalar;

 public:
  static constexpr int parameters = 10;  // of a link

  // By the parameters of these links.
  Regressor(const LoweredModel<S>& model, const Vector3<double>& gravity,
            const std::vector<int>& bodies)
      : gravity_{T(S(gravity[0])), T(S(gravity[1])), T(S(gravity[2]))} {
    const Transform<Wider<S>> same{Matrix3<Wider<S>>::Identity(), Vector3<Wider<S>>::Zero()};
    for (const int k : bodies) {
      const Transform<Wider<S>> phi = model.phi_on_link(k, same);
      const auto column = [&](int j) {
        return Triple<S>{S(phi.R(0, j)), S(phi.R(1, j)), S(phi.R(2, j))};
      };
      given_.push_back(
          {k, {column(0), column(1), column(2)}, {S(phi.p[0]), S(phi.p[1]), S(phi.p[2])}});
    }
  }

  // Y (nv rows, ten columns a body, column-major); what is zero is left as it was.
  void fill(const LoweredModel<S>& model, const WorldMotion<T>& at, T* Y) const {
    const int nv = model.nv();
    for (const Given& given : given_) {
      const auto& link = at.links[given.link];
      const auto turned = [&](const Triple<S>& v) { return link.R.turned(v.x, v.y, v.z); };
      const Triad<T> r = {turned(given.R.x), turned(given.R.y), turned(given.R.z)};
      const Triple<T> offset = turned(given.p), p = link.p + offset;
      const Triple<T> a =
          link.a + cross(link.w_dot, offset) + cross(link.w, cross(link.w, offset)) - gravity_;
      const std::array<Wrench, parameters> needed = wrenches(r, link.w, link.w_dot, a);
      for (int j = given.link; j >= 0; j = model.link(j).parent) {
        const auto& joint = at.links[j];
        const bool slides = model.link(j).slides;
        const Triple<T>& e = joint.R.z;
        const Triple<T> arm = cross(e, p - joint.p);  // e'(r x F) = (e x r)'F
        for (int i = 0; i < parameters; ++i) {
          const Wrench& one = needed[i];
          Y[i * nv + j] = slides ? dot(e, one.F) : dot(e, one.N) + dot(arm, one.F);
        }
      }
      Y += parameters * nv;
    }
  }

 private:
  struct Wrench {
    Triple<T> F, N;
  };
  // A link's frame in the model, in the one that is used here.
  struct Given {
    int link;
    Triad<S> R;
    Triple<S> p;
  };

  static std::array<Wrench, parameters> wrenches(const Triad<T>& r, const Triple<T>& w,
                                                 const Triple<T>& w_dot, const Triple<T>& a) {
    const Triple<T> zero = detail::zeros<T>();
    const auto of_h = [&](const Triple<T>& axis) {
      return Wrench{cross(w_dot, axis) + cross(w, cross(w, axis)), cross(axis, a)};
    };
    const auto half = [&](const Triple<T>& x, const Triple<T>& y) {
      return dot(y, w_dot) * x + dot(y, w) * cross(w, x);
    };
    const auto of_I = [&](const Triple<T>& x, const Triple<T>& y) {
      return Wrench{zero, half(x, y) + half(y, x)};
    };
    return {{{a, zero},
             of_h(r.x),
             of_h(r.y),
             of_h(r.z),
             {zero, half(r.x, r.x)},
             {zero, half(r.y, r.y)},
             {zero, half(r.z, r.z)},
             of_I(r.x, r.y),
             of_I(r.x, r.z),
             of_I(r.y, r.z)}};
  }

  Triple<T> gravity_;
  std::vector<Given> given_;
};

}  // namespace kalmarm
