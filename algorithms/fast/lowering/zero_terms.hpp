// What of phi(parent,k) is zero in a robot's fast path, and therefore left out of it
// (lowered_model.hpp):
//
//   alpha = 0             the axes are parallel: Rx(alpha) is 1
//   alpha = pi/2          the axes are at a right angle: Rx(alpha) is an exchange and a sign
//   p = 0                 the axes meet, in the origin of the parent's frame
//   d = 0, at a hinge     the link's origin is at the foot of their common perpendicular
// Only what is exact counts: an angle of 1.5708 is no right angle.
#pragma once

#include "algorithms/fast/lowering/lowered_model.hpp"

namespace kalmarm {

struct ZeroTerms {
  int links = 0;  // hinges and slides that hang on another link; each may count below
  int parallel = 0, right_angles = 0, meeting = 0, without_offset = 0;
};

template <class S>
ZeroTerms count_zero_terms(const LoweredModel<S>& model) {
  using Link = LoweredLink<S>;
  ZeroTerms out;
  for (int k = 0; k < model.nv(); ++k) {
    const Link& link = model.link(k);
    if (link.parent < 0 || link.kind != Link::Kind::screws) continue;
    ++out.links;
    out.parallel += link.tilt == Link::Tilt::none;
    out.right_angles += link.tilt == Link::Tilt::right;
    out.meeting += link.p[0] == S(0) && link.p[1] == S(0) && link.p[2] == S(0);
    out.without_offset += !link.slides && link.d == S(0);
  }
  return out;
}

}  // namespace kalmarm
