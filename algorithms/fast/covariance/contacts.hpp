// Contacts with the world in the place of inertia: H = M + J'DJ, what contact simulators factor.
//
// A contact that resists the motion of link k along a line with stiffness d (of a step: h^2 times a spring's, h
// times a damper's, or an impulse's weight) is a row of six numbers, and a term of the process noise Q,
//   w = sqrt(d) (p x f; f),  M(k) <- M(k) + w w'     p: the point, f: the unit direction        (1)
// so that the filter of (3.6) and (3.10) factors H, which is never formed. Rows are given as forces from outside
// are (kinematics/acting.hpp), in the axes of a call, and turned and moved to their links as these; any 6 x 6
// matrix that a body's inertia grows by is up to six rows. They are never squared, since d would push what is
// small in P out of its digits: they go to the base beside P0 of M alone (resisting_rows.hpp).
//
// A reflection rounds every row to the largest: an error of c u |w| acts as a force of c u |w| |w'l| on the body,
// which absorbs it as (2) of force_noise.hpp has it. So H of the factors is H to a factor of 1 +- eps in the order of
// positive semidefinite matrices,
//   eps^2 = (c u)^2 K,  K = sum over contacts and i of w(i) of the body's weights times w(i)^2  (2)
// which grows as sqrt(d), where that of P - g U' with d in it grows as d (docs/contacts.md).
//
// The product H x adds J'DJ x: z of a link begins at the sum over its contacts of
//   w (w'l),  l: the link's motion                                                              (3)
#pragma once

#include <cstddef>

#include "algorithms/fast/covariance/force_noise.hpp"
#include "algorithms/fast/covariance/resisting_rows.hpp"
#include "algorithms/fast/kinematics/acting.hpp"

namespace kalmarm {

namespace detail {

// use(link, w) of every row w of LoweredModel::contacts, on its link.
template <class T, class S, class Workspace, class Use>
void for_each_contact(const LoweredModel<S>& model, const Workspace& ws, const Acting<T>& rows,
                      const Use& use) {
  if (!rows.forces) return;
  int turned_to = -1;
  Triad<T> base{};  // its axes in those of a link
  for (std::size_t i = 0; i < model.contacts().size(); ++i) {
    const LoweredFrame<S>& frame = model.contacts()[i];
    const T* const given = rows.forces + 6 * i;
    OnLink<T> on{};
    if (rows.axes == Axes::aligned) {
      if (frame.link != turned_to) {
        const T one(S(1)), zero(S(0)), x_and_y[] = {one, zero, zero, zero, one, zero};
        const OnLink<T> axes = along_way<false>(model, frame, ws, x_and_y);
        base = {axes.n, axes.f, cross(axes.n, axes.f)};
        turned_to = frame.link;
      }
      on.n = base.turned(given[0], given[1], given[2]);
      on.f = base.turned(given[3], given[4], given[5]);
      on = about_link(frame, on);
    } else {
      on = acting_on_link(model, ws, rows.axes, frame, given);
    }
    Sixfold<T> w = {on.n.x, on.n.y, on.n.z, on.f.x, on.f.y, on.f.z};
    normalise(w.x, w.y, w.z);
    normalise(w.u, w.v, w.w);
    use(frame.link, w);
  }
}

}  // namespace detail

}  // namespace kalmarm
