// Filter and smoother in a tree's common axes, with Q of (B2) propagated beside P and z, and the
// forces (B3) that columns start from; the equations are in derivative_terms.hpp. About 500 flops a
// joint for the filter.
#pragma once

#include "algorithms/fast/derivatives/derivative_motion.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

namespace detail {

// Across the joint of link k: P-, Q-, z- become P+, Q+, z+; g, D and e are stored.
template <bool slides, class T, class S>
KALMARM_INLINE void cross_joint(int k, const S& noise, const T& tau, const T& qd,
                                DerivativeTerms<T>& ws, Articulated<T>& P, Sixfold<T>& z,
                                Sixfold<T>& Qx, Sixfold<T>& Qy, Sixfold<T>& Qz) {
  using Terms = DerivativeTerms<T>;
  DerivativeJoint<T>& at = ws.joints[k];
  const Triple<T> s = at.s;
  Sixfold<T> u;
  if constexpr (slides)
    u = {P.Bxx * s.x + P.Bxy * s.y + P.Bxz * s.z, P.Byx * s.x + P.Byy * s.y + P.Byz * s.z,
         P.Bzx * s.x + P.Bzy * s.y + P.Bzz * s.z, P.Cxx * s.x + P.Cxy * s.y + P.Cxz * s.z,
         P.Cxy * s.x + P.Cyy * s.y + P.Cyz * s.z, P.Cxz * s.x + P.Cyz * s.y + P.Czz * s.z};
  else
    u = {P.Axx * s.x + P.Axy * s.y + P.Axz * s.z, P.Axy * s.x + P.Ayy * s.y + P.Ayz * s.z,
         P.Axz * s.x + P.Ayz * s.y + P.Azz * s.z, P.Bxx * s.x + P.Byx * s.y + P.Bzx * s.z,
         P.Bxy * s.x + P.Byy * s.y + P.Bzy * s.z, P.Bxz * s.x + P.Byz * s.y + P.Bzz * s.z};
  const T D = along<slides>(s, u) + T(noise);
  const T inverse_D = T(S(1)) / D;
  const Sixfold<T> g = {u.x * inverse_D, u.y * inverse_D, u.z * inverse_D,
                        u.u * inverse_D, u.v * inverse_D, u.w * inverse_D};
  subtract(g, u, P);
  const T Hx = along<slides>(s, Qx), Hy = along<slides>(s, Qy), Hz = along<slides>(s, Qz);
  add_scaled(Qx, T(-Hx), g);
  add_scaled(Qy, T(-Hy), g);
  add_scaled(Qz, T(-Hz), g);
  const T e = tau - along<slides>(s, z);
  add_scaled(z, e, g);
  const Sixfold<T> psi = six(ws.table, Terms::psi, k);
  const Sixfold<T> Pc = times(P, {qd * psi.x, qd * psi.y, qd * psi.z,  //
                                  qd * psi.u, qd * psi.v, qd * psi.w});
  add(z, Pc);
  at.g = g;
  at.q = {Hx * inverse_D, Hy * inverse_D, Hz * inverse_D};
  at.inverse_D = inverse_D;
  at.e = e * inverse_D;
}

// P-, Q-, z- and what the sweeps need of every joint. acting: forces in the frames' own axes.
template <class T, class S>
void filter(const LoweredModel<S>& model, const T* tau, const T* qd, const Acting<T>& acting,
            DerivativeTerms<T>& ws) {
  using Terms = DerivativeTerms<T>;
  using Kind = typename LoweredLink<S>::Kind;
  const T zero = T(S(0));
  auto& table = ws.table;
  const Sixfold<T> none = {zero, zero, zero, zero, zero, zero};
  for (auto& branch : ws.branches) {
    set_zero(branch.P);
    branch.z = branch.Qx = branch.Qy = branch.Qz = none;
  }
  for (std::size_t i = 0; acting.forces && i < model.acted_on().size(); ++i) {
    const LoweredFrame<S>& frame = model.acted_on()[i];
    const OnLink<T> own = from_own_axes(frame, acting.forces + numbers_of_force * i);
    const Triad<T> R = {table.triple(Terms::x_axis, frame.link),
                        table.triple(Terms::y_axis, frame.link),
                        table.triple(Terms::z_axis, frame.link)};
    subtract(ws.branches[model.link(frame.link).branch].z,
             OnLink<T>{R.turned(own.n.x, own.n.y, own.n.z), R.turned(own.f.x, own.f.y, own.f.z),
                       own.moments, own.forces});
  }
  Articulated<T> P;
  Sixfold<T> z, Qx, Qy, Qz;
  bool carried = false;  // from link k + 1
  for (int k = model.nv() - 1; k >= 0; --k) {
    const LoweredLink<S>& link = model.link(k);
    const LoweredBody<S>& body = model.body(k);
    if (!carried) {
      set_zero(P);
      z = Qx = Qy = Qz = none;
    }
    if (!link.massless) {
      const T m = ws.constant.at(Terms::mass, k);
      const Triple<T> h = table.triple(Terms::h, k), p = table.triple(Terms::twice_p, k);
      const Triple<T> Bx = table.triple(Terms::twice_B, k),
                      By = table.triple(Terms::twice_B + 3, k),
                      Bz = table.triple(Terms::twice_B + 6, k);
      P.Axx += table.at(Terms::inertia, k);
      P.Axy += table.at(Terms::inertia + 1, k);
      P.Ayy += table.at(Terms::inertia + 2, k);
      P.Axz += table.at(Terms::inertia + 3, k);
      P.Ayz += table.at(Terms::inertia + 4, k);
      P.Azz += table.at(Terms::inertia + 5, k);
      P.Bxy -= h.z;
      P.Byx += h.z;
      P.Bxz += h.y;
      P.Byz -= h.x;
      P.Bzx -= h.y;
      P.Bzy += h.x;
      P.Cxx += m;
      P.Cyy += m;
      P.Czz += m;
      add(z, six(table, Terms::bias, k));
      add(Qx, {Bx.x, Bx.y, Bx.z, zero, -p.z, p.y});
      add(Qy, {By.x, By.y, By.z, p.z, zero, -p.x});
      add(Qz, {Bz.x, Bz.y, Bz.z, -p.y, p.x, zero});
    }
    if (link.branch >= 0) {
      const auto& branch = ws.branches[link.branch];
      add(P, branch.P);
      add(z, branch.z);
      add(Qx, branch.Qx);
      add(Qy, branch.Qy);
      add(Qz, branch.Qz);
    }
    for_numbers(P, [&](int i, const T& x) { table.at(Terms::P + i, k) = x; });
    set(table, Terms::z, k, z);
    set(table, Terms::Q, k, Qx);
    set(table, Terms::Q + 6, k, Qy);
    set(table, Terms::Q + 12, k, Qz);
    if (link.slides)
      cross_joint<true>(k, body.r, tau[k], qd[k], ws, P, z, Qx, Qy, Qz);
    else
      cross_joint<false>(k, body.r, tau[k], qd[k], ws, P, z, Qx, Qy, Qz);
    carried = link.hangs_on_previous;
    if (link.parent < 0) continue;
    if (link.kind != Kind::cyclic) {
      const Triple<T> r = ws.joints[k].r;
      translate_x(r.x, P);
      translate_y(r.y, P);
      translate_z(r.z, P);
      move_inward(r, z);
      move_inward(r, Qx);
      move_inward(r, Qy);
      move_inward(r, Qz);
    }
    if (carried) continue;
    auto& branch = ws.branches[model.link(link.parent).branch];
    add(branch.P, P);
    add(branch.z, z);
    add(branch.Qx, Qx);
    add(branch.Qy, Qy);
    add(branch.Qz, Qz);
  }
}

// The accelerations: `qdd` of the joints, a- and a of every link.
template <class T, class S>
void accelerate(const LoweredModel<S>& model, const T* qd, DerivativeTerms<T>& ws, T* qdd) {
  using Terms = DerivativeTerms<T>;
  const T zero = T(S(0));
  Sixfold<T> a, before = {zero, zero, zero, zero, zero, zero};
  ws.check = zero;
  for (int k = 0; k < model.nv(); ++k) {
    const LoweredLink<S>& link = model.link(k);
    const DerivativeJoint<T>& at = ws.joints[k];
    if (link.parent < 0) {
      const Triple<T> a0 = base_acceleration(model.uncommon(link), ws.gravity);
      a = {zero, zero, zero, a0.x, a0.y, a0.z};
    } else {
      if (!link.hangs_on_previous) a = six(ws.table, Terms::a, link.parent);
      move_outward(at.r, a);
    }
    if (link.kind != LoweredLink<S>::Kind::cyclic) before = a;
    set(ws.table, Terms::a_before, k, before);
    add_scaled(a, qd[k], six(ws.table, Terms::psi, k));
    const auto& g = at.g;
    qdd[k] = ((at.e - g.x * a.x - g.y * a.y) - g.z * a.z) - ((g.u * a.u + g.v * a.v) + g.w * a.w);
    if (link.slides)
      add_along<true>(a, at.s, qdd[k]);
    else
      add_along<false>(a, at.s, qdd[k]);
    set(ws.table, Terms::a, k, a);
    ws.check += qdd[k] * zero;
  }
}

// (B3) and chi for a block of joints.
template <class T>
void set_starts(int block, DerivativeTerms<T>& ws) {
  using Terms = DerivativeTerms<T>;
  using W = Wide<T>;
  auto& table = ws.table;
  const auto load6 = [&](int number) {
    const Triple<W> a = table.load3(number, block), b = table.load3(number + 3, block);
    return Sixfold<W>{a.x, a.y, a.z, b.x, b.y, b.z};
  };
  const auto store6 = [&](int number, const Sixfold<W>& x) {
    table.store3(number, block, {x.x, x.y, x.z});
    table.store3(number + 3, block, {x.u, x.v, x.w});
  };
  const Triple<W> H_w = table.load3(Terms::turn, block);
  const Triple<W> H_v = table.load3(Terms::z_axis, block) - H_w;
  const Triple<W> psi_w = table.load3(Terms::psi, block),
                  psi_v = table.load3(Terms::psi + 3, block);
  const Triple<W> w = table.load3(Terms::before, block), v = table.load3(Terms::before + 3, block);
  const Triple<W> a_w = table.load3(Terms::a_before, block),
                  a_v = table.load3(Terms::a_before + 3, block);
  const Triple<W> chi_w = cross(a_w, H_w) + cross(w, psi_w);
  const Triple<W> chi_v = cross(a_w, H_v) + cross(a_v, H_w) + cross(w, psi_v) + cross(v, psi_w);
  const Triple<W> w_sum = w + table.load3(Terms::after, block),
                  v_sum = v + table.load3(Terms::after + 3, block);
  const Triple<W> chi_qd_w = cross(w_sum, H_w), chi_qd_v = cross(w_sum, H_v) + cross(v_sum, H_w);
  const Sixfold<W> chi = {chi_w.x, chi_w.y, chi_w.z, chi_v.x, chi_v.y, chi_v.z};
  const Sixfold<W> chi_qd = {chi_qd_w.x, chi_qd_w.y, chi_qd_w.z,
                             chi_qd_v.x, chi_qd_v.y, chi_qd_v.z};
  store6(Terms::chi, chi);
  store6(Terms::chi_qd, chi_qd);

  Articulated<W> P;
  for_numbers(P, [&](int i, W& x) { x = table.load(Terms::P + i, block); });
  Sixfold<W> F = times(P, load6(Terms::a));
  add(F, load6(Terms::z));
  const Triple<W> n = {F.x, F.y, F.z}, f = {F.u, F.v, F.w};
  const Triple<W> moment = cross(H_w, n) + cross(H_v, f), force = cross(H_w, f);
  const Sixfold<W> H_x_F = {moment.x, moment.y, moment.z, force.x, force.y, force.z};
  store6(Terms::H_x_F, H_x_F);

  Sixfold<W> x_q = times(P, chi), x_qd = times(P, chi_qd);
  add_scaled(x_q, ws.constant.load(Terms::single, block), H_x_F);
  const auto add_Q = [&](int number, const W& turn_q, const W& turn_qd) {
    const Sixfold<W> column = load6(number);
    add_scaled(x_q, turn_q, column);
    add_scaled(x_qd, turn_qd, column);
  };
  add_Q(Terms::Q, psi_w.x, H_w.x);
  add_Q(Terms::Q + 6, psi_w.y, H_w.y);
  add_Q(Terms::Q + 12, psi_w.z, H_w.z);
  store6(Terms::x_q, x_q);
  store6(Terms::x_qd, x_qd);
}

}  // namespace detail

// All of the above, and qdd (nv).
template <class T, class S>
void derivative_terms(const LoweredModel<S>& model, const T* q, const T* qd, const T* tau,
                      const Acting<T>& acting, DerivativeTerms<T>& ws, T* qdd) {
  ws.set_given(model, acting);
  detail::set_angles(model, q, ws);
  detail::set_motion(model, q, qd, ws);
  for (int block = 0; block < ws.table.blocks(); ++block) detail::set_bodies(block, ws);
  detail::filter(model, tau, qd, acting, ws);
  detail::accelerate(model, qd, ws, qdd);
  for (int block = 0; block < ws.table.blocks(); ++block) detail::set_starts(block, ws);
}

}  // namespace kalmarm
