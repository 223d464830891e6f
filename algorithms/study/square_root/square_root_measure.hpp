// Steps (1) to (3) of square_root.hpp, which has the equations: the measurement of a joint, and the
// rows that it starts from.
#pragma once

#include <algorithm>

#include "algorithms/fast/covariance/forward_dynamics.hpp"
#include "algorithms/model/rounding_scale.hpp"
#include "algorithms/spatial/inlining.hpp"
#include "algorithms/study/square_root/square_root_model.hpp"
#include "algorithms/study/square_root/square_root_rows.hpp"

namespace kalmarm {

// Of a link: its body and the children absorbed so far.
template <class T>
struct SquareRoot {
  FullTriangle<T> P;
  Sixfold<T> z;
  T reach;  // bound of the distance from the origin to an outboard centre of mass, along the joints
};

template <class T>
struct SquareRootWorkspace : CovarianceWorkspace<T> {
  // Of a link with several children: the rows accumulated so far.
  struct Sum : SquareRoot<T> {
    bool begun;
  };
  std::vector<Sum> sums;

  template <class S>
  explicit SquareRootWorkspace(const SquareRootModel<S>& model)
      : CovarianceWorkspace<T>(model), sums(model.branch_count()) {
    this->forces.reset();  // nothing is said of the error of an answer
  }
};

namespace detail {

template <class T>
KALMARM_INLINE T larger(const T& a, const T& b) {
  using std::min;
  return -min(T(-a), T(-b));
}

// Rows of the body alone. 53 flops.
template <class T, class S>
KALMARM_INLINE auto body_rows(const FactoredBody<S>& body, const T& wx, const T& wy, const T& wz) {
  const T m = T(body.m), cx = T(body.c[0]), cy = T(body.c[1]), cz = T(body.c[2]);
  const T xx = wx * wx, yy = wy * wy, zz = wz * wz;
  const T xz_squares = xx - zz, yz_squares = yy - zz, xy = wx * wy, xz = wx * wz, yz = wy * wz;
  const auto zeta = [&](int i) KALMARM_INLINE_LAMBDA {
    const auto Z = body.Z.row(i);
    return T(Z[0] * xz_squares + Z[1] * yz_squares + Z[2] * xy + Z[3] * xz + Z[4] * yz);
  };
  const Zero zero;
  const One one;
  const auto l1 =
      make_row(zero, cz, T(-cy), one, zero, zero, T(xy * cy + xz * cz - (yy + zz) * cx), m);
  const auto l2 =
      make_row(T(-cz), zero, cx, zero, one, zero, T(xy * cx + yz * cz - (xx + zz) * cy), m);
  const auto l3 =
      make_row(cy, T(-cx), zero, zero, zero, one, T(xz * cx + yz * cy - (xx + yy) * cz), m);
  const auto rz = make_row(T(body.Lzx), T(body.Lzy), one, zero, zero, zero, zeta(0), T(body.Dz));
  const auto rx = make_row(one, T(body.Lxy), zero, zero, zero, zero, zeta(1), T(body.Dx));
  const T Dy = T(body.Dy);
  const LastRow<T> ry{Dy, Dy * zeta(2)};
  return Triangle{l1, l2, l3, rz, rx, ry};
}

// (1): the pivot, and the rows of P+; None where there is none.
template <class Pivot, class L1, class L2, class L3, class Rz, class Rx, class Ry>
struct Measured {
  Pivot pivot;
  L1 l1;
  L2 l2;
  L3 l3;
  Rz rz;
  Rx rx;
  Ry ry;
};
template <class Pivot, class L1, class L2, class L3, class Rz, class Rx, class Ry>
Measured(Pivot, L1, L2, L3, Rz, Rx, Ry) -> Measured<Pivot, L1, L2, L3, Rz, Rx, Ry>;

template <class T>
KALMARM_INLINE Row<T, Zero, One, Zero, Zero, Zero, Zero> as_row(const LastRow<T>& ry) {
  return {{}, {}, {}, {}, {}, {}, ry.zeta(), ry.weight};
}

template <bool noise, class T>
KALMARM_INLINE auto measure_turn(const FullTriangle<T>& P, const T& r) {
  const auto ry = as_row(P.ry);
  if constexpr (!noise) {
    const auto z = eliminate<Column::z, true>(P.rz, P.l3, P.l2, P.l1);
    return Measured{z.pivot, z.c, z.b, z.a, None{}, P.rx, ry};
  } else {
    const Row<T, Zero, Zero, One, Zero, Zero, Zero> rotor{{}, {}, {}, {}, {}, {}, T(0), r};
    const auto first = eliminate<Column::z, true>(rotor, P.rz);
    const auto z = eliminate<Column::z, true>(first.pivot, P.l3, P.l2, P.l1);
    const T D1 = first.pivot.weight, D2 = weight_with<Column::z>(D1, P.l3),
            D3 = weight_with<Column::z>(D2, P.l2);
    const auto with_z = [](const auto& row, const auto& entry) KALMARM_INLINE_LAMBDA {
      return make_row<T>(row.x, row.y, entry, row.u, row.v, row.w, row.zeta, row.weight);
    };
    return Measured{z.pivot,
                    with_z(z.c, T(P.l1.z * r * reciprocal(D3))),
                    with_z(z.b, T(P.l2.z * r * reciprocal(D2))),
                    with_z(z.a, T(P.l3.z * r * reciprocal(D1))),
                    with_z(first.a, One{}),
                    P.rx,
                    ry};
  }
}

// d of (1").
template <bool slides, class T>
KALMARM_INLINE T without_noise(const FullTriangle<T>& P) {
  constexpr Column c = slides ? Column::w : Column::z;
  T d = slides ? P.l3.weight : weight_with<c>(P.rz.weight, P.l3);
  d = weight_with<c>(d, P.l2);
  return weight_with<c>(d, P.l1);
}

// (1').
template <bool noise, class T>
KALMARM_INLINE auto measure_slide(const FullTriangle<T>& P, const T& r) {
  const auto ry = as_row(P.ry);
  if constexpr (!noise) {
    const auto w = eliminate<Column::w, true>(P.l3, P.l2, P.l1);
    return Measured{w.pivot, w.b, w.a, None{}, P.rz, P.rx, ry};
  } else {
    const Row<T, Zero, Zero, Zero, Zero, Zero, One> rotor{{}, {}, {}, {}, {}, {}, T(0), r};
    const auto first = eliminate<Column::w, true>(rotor, P.l3);
    const auto w = eliminate<Column::w, true>(first.pivot, P.l2, P.l1);
    const T D1 = first.pivot.weight, D2 = weight_with<Column::w>(D1, P.l2);
    const auto with_w = [](const auto& row, const auto& entry) KALMARM_INLINE_LAMBDA {
      return make_row<T>(row.x, row.y, row.z, row.u, row.v, entry, row.zeta, row.weight);
    };
    return Measured{w.pivot,
                    with_w(w.b, T(P.l1.w * r * reciprocal(D2))),
                    with_w(w.a, T(P.l2.w * r * reciprocal(D1))),
                    with_w(first.a, One{}),
                    P.rz,
                    P.rx,
                    ry};
  }
}

// (3).
template <class T, class R>
KALMARM_INLINE void add_acceleration(const Sixfold<T>& c, bool slides, R& row) {
  if constexpr (!std::is_same_v<R, None>) {
    row.zeta = row.zeta + row.u * c.u + row.v * c.v + row.w * c.w;
    if (!slides) row.zeta = row.zeta + row.x * c.x + row.y * c.y;
  }
}

// (2), with D, g, e+ kept in ws.
template <bool noise, bool slides, class T, class S, class Pivot>
KALMARM_INLINE void keep(const SquareRootModel<S>& model, int k, const T& tau,
                         SquareRootWorkspace<T>& ws, SquareRoot<T>& at, const Pivot& pivot) {
  using std::min;
  const FactoredBody<S>& body = model.factored(k);
  auto& link = ws.links[k];
  const S threshold = least_D_over_size<S>(2);
  const S size_m = threshold * body.outboard_mass, least = S(65536) * least_weight<S>();
  const T D = pivot.weight;
  const T size =
      slides ? T(size_m) : T(size_m * at.reach * at.reach + threshold * body.outboard_spin);
  ws.margin = min(ws.margin, T(D - size - least));

  const T e = tau - (slides ? at.z.w : at.z.z), inverse_D = reciprocal(D);
  Sixfold<T>& g = link.g;
  g = {number_as<T>(pivot.x), number_as<T>(pivot.y), number_as<T>(pivot.z),
       number_as<T>(pivot.u), number_as<T>(pivot.v), number_as<T>(pivot.w)};
  if constexpr (noise) (slides ? g.w : g.z) = without_noise<slides>(at.P) * inverse_D;
  link.inverse_D = inverse_D;
  link.e = e * inverse_D - pivot.zeta;
  Sixfold<T>& z = at.z;
  z.x += g.x * e;
  z.y += g.y * e;
  z.u += g.u * e;
  z.v += g.v * e;
  if constexpr (noise || slides) z.z += g.z * e;
  if constexpr (noise || !slides) z.w += g.w * e;
  if constexpr (!noise) (slides ? z.w : z.z) = tau;
}

// (1), (2), (3).
template <bool noise, bool slides, class T, class S, class Rows>
KALMARM_INLINE void measure(const SquareRootModel<S>& model, int k, const T& tau,
                            SquareRootWorkspace<T>& ws, SquareRoot<T>& at, Rows& rows) {
  keep<noise, slides>(model, k, tau, ws, at, rows.pivot);
  const Sixfold<T>& c = ws.links[k].c;
  add_acceleration(c, slides, rows.l1);
  add_acceleration(c, slides, rows.l2);
  add_acceleration(c, slides, rows.l3);
  if constexpr (!slides) {
    add_acceleration(c, slides, rows.rz);
    add_acceleration(c, slides, rows.rx);
    add_acceleration(c, slides, rows.ry);
  }
}

}  // namespace detail

}  // namespace kalmarm
