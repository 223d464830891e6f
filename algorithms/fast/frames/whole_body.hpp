// What all bodies have together, from how they move (world_motion.hpp). With C a body's centre of mass from
// the first tree's root, W = R J R' of lowered_link.hpp's CentralBody, I = tr(W) 1 - W, c that of all:
//   c = sum of m C / sum of m,  c' and c'' likewise of v(C) and a(C)                          (1)
//   h = (sum of I w + (C - c) x m v(C);  sum of m v(C))                                       (2)
//   h' = (sum of I w' + w x I w + (C - c) x m a(C);  sum of m a(C))                           (3)
//   2 K = sum of m v(C)'v(C) + w'I w + r(k) q'(k)^2,   V = -sum of m g'C                      (4)
// The column of DoF k in the momentum matrix is that of its composite body, of mass m, first moment h and inertia I
// about p(k), which turns about e through p(k), or slides along it:
//   l = e x h or m e,   (I e or h x e) + (p(k) - c) x l                                       (5)
// and l / sum of m is its column in the Jacobian of c. Composites go to the parent, r away, by
//   h += m r,  I += 2 h'r 1 - h r' - r h' + m (r'r 1 - r r')        h as it was               (6)
#pragma once

#include <vector>

#include "algorithms/fast/frames/world_motion.hpp"

namespace kalmarm {

// A symmetric matrix.
template <class T>
struct Symmetric {
  T xx, yy, zz, xy, xz, yz;

  KALMARM_INLINE Triple<T> times(const Triple<T>& v) const {
    return {xx * v.x + xy * v.y + xz * v.z, xy * v.x + yy * v.y + yz * v.z,
            xz * v.x + yz * v.y + zz * v.z};
  }
};

// Of a body, or of all that hangs on a link: mass, first moment and inertia about the link's origin.
template <class T>
struct Composite {
  T m;
  Triple<T> h;
  Symmetric<T> I;
};

template <class T>
class WholeBody {
  using S = typename Lanes<T>::Scalar;

 public:
  // Results; momenta about `center`.
  T mass;
  Triple<T> center, center_velocity, center_acceleration;
  Triple<T> angular, linear, angular_rate, linear_rate;
  T kinetic, potential;
  struct Column {
    Triple<T> angular, linear;
  };
  std::vector<Column> columns;  // (5)

  WholeBody(const LoweredModel<S>& model, const Vector3<double>& gravity)
      : columns(model.nv()),
        gravity_{T(S(gravity[0])), T(S(gravity[1])), T(S(gravity[2]))},
        bodies_(model.nv()) {}

  // center, potential.
  void stand(const LoweredModel<S>& model, const WorldMotion<T>& at);
  // After it: velocities, accelerations, momenta, kinetic energy.
  void move(const LoweredModel<S>& model, const WorldMotion<T>& at, const T* qd);
  // After `stand`: the columns, and the composites.
  void compose(const LoweredModel<S>& model, const WorldMotion<T>& at);
  const Composite<T>& composite(int k) const { return composites_[k]; }
  Composite<T> body(const LoweredModel<S>& model, int k) const;  // of link k alone

 private:
  struct Body {
    Triple<T> offset;  // of C from the link's origin
    Triple<T> C;
    Symmetric<T> W;
  };

  KALMARM_INLINE static Symmetric<T> turned(const Triad<T>& R, const CentralBody<S>& body);
  // I += m (v'v 1 - v v').
  KALMARM_INLINE static void add_point(const T& m, const Triple<T>& v, Symmetric<T>& I);

  Triple<T> gravity_;
  std::vector<Body> bodies_;
  std::vector<Composite<T>> composites_;
};

template <class T>
KALMARM_INLINE Symmetric<T> WholeBody<T>::turned(const Triad<T>& R, const CentralBody<S>& body) {
  const Triple<T> X = R.turned(body.Jxx, body.Jxy, body.Jxz),
                  Y = R.turned(body.Jxy, body.Jyy, body.Jyz),
                  Z = R.turned(body.Jxz, body.Jyz, body.Jzz);
  return {X.x * R.x.x + Y.x * R.y.x + Z.x * R.z.x, X.y * R.x.y + Y.y * R.y.y + Z.y * R.z.y,
          X.z * R.x.z + Y.z * R.y.z + Z.z * R.z.z, X.x * R.x.y + Y.x * R.y.y + Z.x * R.z.y,
          X.x * R.x.z + Y.x * R.y.z + Z.x * R.z.z, X.y * R.x.z + Y.y * R.y.z + Z.y * R.z.z};
}

template <class T>
KALMARM_INLINE void WholeBody<T>::add_point(const T& m, const Triple<T>& v, Symmetric<T>& I) {
  const Triple<T> mv = m * v;
  I.xx += mv.y * v.y + mv.z * v.z;
  I.yy += mv.x * v.x + mv.z * v.z;
  I.zz += mv.x * v.x + mv.y * v.y;
  I.xy -= mv.x * v.y;
  I.xz -= mv.x * v.z;
  I.yz -= mv.y * v.z;
}

template <class T>
void WholeBody<T>::stand(const LoweredModel<S>& model, const WorldMotion<T>& at) {
  mass = T(S(0));
  Triple<T> sum = detail::zeros<T>();
  for (int k = 0; k < model.nv(); ++k) {
    const CentralBody<S>& body = model.central(k);
    const auto& link = at.links[k];
    Body& own = bodies_[k];
    own.offset = link.R.turned(body.c[0], body.c[1], body.c[2]);
    own.C = link.p + own.offset;
    if (link.tree > 0) own.C += (at.roots[link.tree] - at.roots[0]);
    own.W = turned(link.R, body);
    sum += body.m * own.C;
    mass += body.m;
  }
  center = T(T(S(1)) / mass) * sum;
  potential = -dot(gravity_, sum) - mass * dot(gravity_, at.roots[0]);
}

template <class T>
void WholeBody<T>::move(const LoweredModel<S>& model, const WorldMotion<T>& at, const T* qd) {
  const Triple<T> zero = detail::zeros<T>();
  angular = linear = angular_rate = linear_rate = zero;
  T twice = T(S(0));
  for (int k = 0; k < model.nv(); ++k) {
    const S m = model.central(k).m;
    const auto& link = at.links[k];
    const Body& own = bodies_[k];
    const T trace = own.W.xx + own.W.yy + own.W.zz;
    const auto I = [&](const Triple<T>& v) { return trace * v - own.W.times(v); };
    const Triple<T> arm = own.C - center, turning = cross(link.w, own.offset);
    const Triple<T> mv = m * (link.v + turning), Iw = I(link.w);
    const Triple<T> ma = m * (link.a + cross(link.w_dot, own.offset) + cross(link.w, turning));
    linear += mv;
    angular += Iw + cross(arm, mv);
    linear_rate += ma;
    angular_rate += I(link.w_dot) + cross(link.w, Iw) + cross(arm, ma);
    twice += dot(mv, link.v + turning) + dot(link.w, Iw);
    if (model.link(k).has_noise) twice += model.body(k).r * (qd[k] * qd[k]);
  }
  const T one = T(S(1)) / mass;
  center_velocity = one * linear;
  center_acceleration = one * linear_rate;
  kinetic = twice * T(S(0.5));
}

template <class T>
Composite<T> WholeBody<T>::body(const LoweredModel<S>& model, int k) const {
  const Body& own = bodies_[k];
  const T m = T(model.central(k).m);
  const Symmetric<T>& W = own.W;
  Composite<T> out = {
      m, m * own.offset, {W.yy + W.zz, W.xx + W.zz, W.xx + W.yy, -W.xy, -W.xz, -W.yz}};
  add_point(m, own.offset, out.I);
  return out;
}

template <class T>
void WholeBody<T>::compose(const LoweredModel<S>& model, const WorldMotion<T>& at) {
  const int nv = model.nv();
  composites_.resize(nv);
  for (int k = 0; k < nv; ++k) composites_[k] = body(model, k);
  for (int k = nv - 1; k >= 0; --k) {
    const auto& link = at.links[k];
    const Composite<T>& body = composites_[k];
    const Triple<T>& e = link.R.z;
    const bool slides = model.link(k).slides;
    Triple<T> arm = link.p - center;
    if (link.tree > 0) arm += (at.roots[link.tree] - at.roots[0]);
    Column& column = columns[k];
    column.linear = slides ? body.m * e : cross(e, body.h);
    column.angular = (slides ? cross(body.h, e) : body.I.times(e)) + cross(arm, column.linear);
    const int parent = model.link(k).parent;
    if (parent < 0) continue;
    const Triple<T> r = link.p - at.links[parent].p, h = body.h;
    Composite<T>& to = composites_[parent];
    const T hx = h.x * r.x, hy = h.y * r.y, hz = h.z * r.z;
    to.m += body.m;
    to.h += h + body.m * r;
    to.I.xx += body.I.xx + ((hy + hz) + (hy + hz));
    to.I.yy += body.I.yy + ((hx + hz) + (hx + hz));
    to.I.zz += body.I.zz + ((hx + hy) + (hx + hy));
    to.I.xy += body.I.xy - (h.x * r.y + h.y * r.x);
    to.I.xz += body.I.xz - (h.x * r.z + h.z * r.x);
    to.I.yz += body.I.yz - (h.y * r.z + h.z * r.y);
    add_point(body.m, r, to.I);
  }
}

}  // namespace kalmarm
