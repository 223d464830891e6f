// C(q, q') of M q'' + C q' + gravity, the one for which M' - 2 C is skew-symmetric (Echeandia and Wensing 2021).
// With S(k) = (e; 0) or (0; e) of DoF k at p(k), V its link's velocity and V(end) that of the last DoF of
// its joint, with which the axes move, and a body's momentum (n; F) there,
//   S'(k) = V(end) x S(k)
//   B = [(w~I - Iw~ - (Iw)~) / 2 - h~v~   0;  -F~  0],  F = m v + w x h,  B V = V x* (I V)      (1)
// I, h, F and B of all that hangs on link k go to the parent, r away, by (6) of whole_body.hpp and
//   F += F,  B_11 += B_11 - r~F~                                                                (2)
// and with S(i) seen at p(k), for every i inboard of k,
//   C(i,k) = S(i)'(I S'(k) + B S(k)),  C(k,i) = (I S(k))'S'(i) + (B'S(k))'S(i)                  (3)
// About 150 flops a link, and 60 for each DoF inboard of it.
#pragma once

#include <vector>

#include "algorithms/fast/frames/whole_body.hpp"

namespace kalmarm {

template <class T>
class CoriolisMatrix {
  using S = typename Lanes<T>::Scalar;

 public:
  explicit CoriolisMatrix(const LoweredModel<S>& model) : momenta_(model.nv()), end_(model.nv()) {
    for (int k = model.nv() - 1; k >= 0; --k) {
      const bool goes_on =
          k + 1 < model.nv() && model.link(k + 1).coordinate == Coordinate::follower;
      end_[k] = goes_on ? end_[k + 1] : k;
    }
  }

  // C (nv x nv, column-major); what is zero is left as it was. whole: composed.
  void fill(const LoweredModel<S>& model, const WorldMotion<T>& at, const WholeBody<T>& whole,
            T* C) {
    const int nv = model.nv();
    for (int k = 0; k < nv; ++k) begin(whole.body(model, k), at.links[k], momenta_[k]);
    for (int k = nv - 1; k >= 0; --k) {
      fill_of(model, at, whole.composite(k), k, C);
      const int parent = model.link(k).parent;
      if (parent >= 0) add(at.links[k].p - at.links[parent].p, momenta_[k], momenta_[parent]);
    }
  }

 private:
  struct Momentum {
    Triple<T> F;
    Triad<T> B;  // B_11, by columns
  };
  struct Motion {
    Triple<T> w, v;
  };

  // (1)
  static void begin(const Composite<T>& body, const typename WorldMotion<T>::Link& link,
                    Momentum& out) {
    const Triple<T>&w = link.w, &v = link.v, &h = body.h;
    const Symmetric<T>& I = body.I;
    const Triple<T> X = cross(w, Triple<T>{I.xx, I.xy, I.xz}),
                    Y = cross(w, Triple<T>{I.xy, I.yy, I.yz}),
                    Z = cross(w, Triple<T>{I.xz, I.yz, I.zz});
    const Triple<T> n = I.times(w);
    const T half = T(S(0.5)), hv = dot(h, v);
    // (A + A' - n~) / 2 - v h' + h'v 1 with A = w~I, of columns X, Y, Z
    out.F = body.m * v + cross(w, h);
    out.B.x = {X.x - h.x * v.x + hv, half * (X.y + Y.x - n.z) - h.x * v.y,
               half * (X.z + Z.x + n.y) - h.x * v.z};
    out.B.y = {half * (Y.x + X.y + n.z) - h.y * v.x, Y.y - h.y * v.y + hv,
               half * (Y.z + Z.y - n.x) - h.y * v.z};
    out.B.z = {half * (Z.x + X.z - n.y) - h.z * v.x, half * (Z.y + Y.z + n.x) - h.z * v.y,
               Z.z - h.z * v.z + hv};
  }

  // (2)
  static void add(const Triple<T>& r, const Momentum& from, Momentum& to) {
    const Triple<T>& F = from.F;
    const T rF = dot(r, F);
    to.F += F;
    to.B.x += from.B.x - r.x * F;
    to.B.y += from.B.y - r.y * F;
    to.B.z += from.B.z - r.z * F;
    to.B.x.x += rF;
    to.B.y.y += rF;
    to.B.z.z += rF;
  }

  // S(i) and S'(i) at `point`.
  static void axis(const LoweredModel<S>& model, const WorldMotion<T>& at, int i, int end,
                   const Triple<T>& point, Motion& axis, Motion& rate) {
    const auto& link = at.links[i];
    const auto& last = at.links[end];
    const Triple<T>& e = link.R.z;
    const Triple<T> turning = cross(last.w, e);
    if (model.link(i).slides) {
      axis = {detail::zeros<T>(), e};
      rate = {detail::zeros<T>(), turning};
      return;
    }
    const Triple<T> arm = point - link.p;
    const Triple<T> v =
        last.v + cross(last.w, point - last.p);  // of the joint's body, at the point
    axis = {e, cross(e, arm)};
    rate = {turning, cross(v, e) + cross(last.w, axis.v)};
  }

  // (3)
  void fill_of(const LoweredModel<S>& model, const WorldMotion<T>& at, const Composite<T>& body,
               int k, T* C) const {
    const int nv = model.nv();
    const Momentum& momentum = momenta_[k];
    const Triple<T>& point = at.links[k].p;
    const auto times = [&](const Motion& x) {  // I x
      return Motion{body.I.times(x.w) + cross(body.h, x.v), body.m * x.v - cross(body.h, x.w)};
    };
    Motion own, rate;
    axis(model, at, k, end_[k], point, own, rate);
    const Motion IS = times(own), ISd = times(rate);
    const Motion force = {ISd.w + momentum.B.turned(own.w.x, own.w.y, own.w.z),
                          ISd.v - cross(momentum.F, own.w)};
    const Triple<T> back = momentum.B.back(own.w) + cross(momentum.F, own.v);
    for (int i = k; i >= 0; i = model.link(i).parent) {
      Motion of_i, rate_of_i;
      axis(model, at, i, end_[i], point, of_i, rate_of_i);
      C[k * nv + i] = dot(of_i.w, force.w) + dot(of_i.v, force.v);
      if (i < k)
        C[i * nv + k] = dot(IS.w, rate_of_i.w) + dot(IS.v, rate_of_i.v) + dot(back, of_i.w);
    }
  }

  std::vector<Momentum> momenta_;
  std::vector<int> end_;  // the last DoF of the joint
};

}  // namespace kalmarm
