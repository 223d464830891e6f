// The mass matrix by the fast path.
//
//   M(k,k) = H F(k) + r(k),  M(m,k) = H(m) phi(m,k) F(k) for m inboard of k      (3.4), (5.1)
// with F of composite.hpp; zero for joints on different branches. Lanes are columns, and which of them
// share a register column_schedule.hpp says: about 32 flops for each lane of a step.
#pragma once

#include <cstddef>
#include <type_traits>
#include <vector>

#include "algorithms/fast/kinematics/blocks.hpp"
#include "algorithms/fast/rigid/column_schedule.hpp"
#include "algorithms/fast/rigid/composite.hpp"
#include "algorithms/spatial/inlining.hpp"

namespace kalmarm {

namespace detail {

// F of link k is added in its own lane, where r belongs too; H z is returned.
template <class T, class S, class U>
KALMARM_INLINE T add_force(const LoweredModel<S>& model, const CompositeForces<U>& composite, int k,
                           const T& own, Sixfold<T>& z) {
  const Sixfold<U>& F = composite.links[k].F;
  z.x += own * F.x;
  z.y += own * F.y;
  z.z += own * F.z;
  z.u += own * F.u;
  z.v += own * F.v;
  z.w += own * F.w;
  const T rotor = own * model.body(k).r;
  if (model.link(k).slides) return z.w + rotor;
  return z.z + rotor;
}

// M(k,j) of the links up to `last`, one column j from first to last in every lane of T, or in several:
// own(i) is 1 in those of column first + i, else 0.
template <class T, class S, class U, class Own>
void sweep_composite_forces(const LoweredModel<S>& model, const CompositeForces<U>& composite,
                            int first, int last, const char* path, const Own& own,
                            ColumnsWorkspace<T>& ws) {
  for (auto& branch : ws.branches) set_zero(branch.z);
  Sixfold<T> z;
  set_zero(z);
  bool carried = false;  // z comes from link k + 1
  for (int k = last; k >= 0; --k) {
    if (!path[k]) {
      ws.e[k] = T(S(0));
      carried = false;
      continue;
    }
    const LoweredLink<S>& link = model.link(k);
    const auto& at = composite.links[k];
    if (!carried) set_zero(z);
    if (link.branch >= 0) add(z, ws.branches[link.branch].z);
    if (k >= first)
      ws.e[k] = add_force(model, composite, k, T(own(k - first)), z);
    else if (link.slides)  // the address of either would keep z in memory
      ws.e[k] = z.w;
    else
      ws.e[k] = z.z;
    carried = link.hangs_on_previous;
    if (link.parent < 0) continue;
    force_to_parent(model, link, composite, at.d, z);
    if (!carried) add(ws.branches[model.link(link.parent).branch].z, z);
  }
}

// M of a chain, for Blocks: Phi = phi, N = H', Z = phi F.
template <class S>
struct MassOfChain {
  const LoweredModel<S>& model;
  const CompositeForces<S>& composite;

  Sixfold<S> N(int k) const {
    const S zero = S(0), one = S(1);
    return model.link(k).slides ? Sixfold<S>{zero, zero, zero, zero, zero, one}
                                : Sixfold<S>{zero, zero, one, zero, zero, zero};
  }

  template <class T>
  KALMARM_INLINE void Phi_times(int k, Sixfold<T>& v) const {
    motion_from_parent(model, model.link(k), composite, composite.links[k].d, v);
  }

  template <class T>
  KALMARM_INLINE T enter(int k, const T& own, Sixfold<T>& z) const {
    const T x = add_force(model, composite, k, own, z);
    if (k > 0) force_to_parent(model, model.link(k), composite, composite.links[k].d, z);
    return x;
  }
};

}  // namespace detail

template <class S>
class FastMass {
 public:
  explicit FastMass(const LoweredModel<S>& model, Triangles triangles = Triangles::both)
      : composite_(model),
        triangles_(triangles),
        blocks_(model.nv(), triangles),
        by_blocks_(is_chain(model, 4 * Lanes<TwoPacks<S>>::count)),
        schedule_(model, by_blocks_ ? 0 : model.nv(), Lanes<Lane>::count),
        branches_(model.branch_count()),
        x_(schedule_.steps().size() + 1, Lane(S(0))) {}

  // M (nv x nv) at q (nq) with these loads, symmetric to the last bit. About 80 nv + 16 nv^2 flops, of branched
  // robots less (32 for a link and each that it hangs on), of long chains 1500 nv + 8 nv^2.
  void fill(const LoweredModel<S>& model, const S* q, const Acting<S>& loads, S* M);

 private:
  // With AVX2 alone, one register takes chain:31 12 % longer than two (float64).
  using Lane = std::conditional_t<register_bytes == 64, WidePack<S>, TwoPacks<S>>;

  KALMARM_NOINLINE void sweep(const LoweredModel<S>& model);

  CompositeForces<S> composite_;
  Triangles triangles_;
  Blocks<S> blocks_;
  bool by_blocks_;  // where they are faster than columns
  ColumnSchedule schedule_;
  std::vector<Sixfold<Lane>> branches_;
  std::vector<Lane> x_;  // of every step, and zero
};

template <class S>
void FastMass<S>::fill(const LoweredModel<S>& model, const S* q, const Acting<S>& loads, S* M) {
  composite_forces(model, q, composite_, loads);
  if (by_blocks_) {
    blocks_.fill(detail::MassOfChain<S>{model, composite_}, model.nv(), M);
    return;
  }
  sweep(model);
  const std::ptrdiff_t size = static_cast<std::ptrdiff_t>(model.nv()) * model.nv();
  for (const ColumnWrite& write : schedule_.writes())
    store_before(size, x_[write.step], write.to, M);
  if (triangles_ == Triangles::both) mirror(model.nv(), M);
}

// M(k, columns) of every step.
template <class S>
void FastMass<S>::sweep(const LoweredModel<S>& model) {
  Sixfold<Lane> z;
  detail::set_zero(z);
  Lane* x = x_.data();
  for (const ColumnStep& at : schedule_.steps()) {
    const LoweredLink<S>& link = model.link(at.link);
    if (at.begins) detail::set_zero(z);
    if (at.from >= 0) add(z, branches_[at.from]);
    if (at.lane >= 0)
      *x = detail::add_force(model, composite_, at.link, detail::Unit<Lane>::lane(at.lane), z);
    else if (link.slides)
      *x = z.w;
    else
      *x = z.z;
    ++x;
    if (link.parent < 0) continue;
    detail::force_to_parent(model, link, composite_, composite_.links[at.link].d, z);
    if (at.into < 0) continue;
    if (at.opens)
      detail::assign(branches_[at.into], z);
    else
      add(branches_[at.into], z);
  }
}

}  // namespace kalmarm
