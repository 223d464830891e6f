// The links' own forces, (3) of rigid/inverse_dynamics.hpp, for one state in pairs: several links at
// once, one in every lane. They depend on nothing but each link's own motion, and are two fifths of
// all work of inverse dynamics; numbers of pairs take longer than moving them between lanes.
#pragma once

#include <vector>

#include "algorithms/fast/rigid/inverse_dynamics.hpp"
#include "algorithms/spatial/pair.hpp"

namespace kalmarm {

template <>
class OwnForces<Pair<double>> {
 public:
  explicit OwnForces(const LoweredModel<Pair<double>>& model)
      : blocks_((model.nv() + lanes - 1) / lanes), bodies_(blocks_.size()) {
    for (std::size_t i = 0; i < lanes * blocks_.size(); ++i) {
      const int k = std::min(static_cast<int>(i), model.nv() - 1),
                lane = static_cast<int>(i) % lanes;
      const CentralBody<Pair<double>>& from = model.central(k);
      CentralBody<T>& to = bodies_[i / lanes];
      set(to.m, lane, from.m);
      for (int j = 0; j < 3; ++j) set(to.c[j], lane, from.c[j]);
      set(to.Jxx, lane, from.Jxx);
      set(to.Jxy, lane, from.Jxy);
      set(to.Jxz, lane, from.Jxz);
      set(to.Jyy, lane, from.Jyy);
      set(to.Jyz, lane, from.Jyz);
      set(to.Jzz, lane, from.Jzz);
    }
  }

  template <class D>
  KALMARM_INLINE void keep(int k, const AccelerationGradient<Pair<double>, D>& G,
                           const Sixfold<Pair<double>>& a) {
    Block& to = blocks_[k / lanes];
    const int lane = k % lanes;
    if constexpr (std::is_same_v<D, Pair<double>>) {
      set(to.Gamma.xx, lane, G.xx);
      set(to.Gamma.yy, lane, G.yy);
      set(to.Gamma.zz, lane, G.zz);
    }
    set(to.Gamma.xy, lane, G.xy);
    set(to.Gamma.xz, lane, G.xz);
    set(to.Gamma.yx, lane, G.yx);
    set(to.Gamma.yz, lane, G.yz);
    set(to.Gamma.zx, lane, G.zx);
    set(to.Gamma.zy, lane, G.zy);
    set(to.u, lane, a.u);
    set(to.v, lane, a.v);
    set(to.w, lane, a.w);
  }

  template <bool turning>
  void begin() {
    for (std::size_t i = 0; i < blocks_.size(); ++i) {
      Block& at = blocks_[i];
      const auto& G = at.Gamma;
      if constexpr (turning) {
        detail::link_force(bodies_[i], G, at.u, at.v, at.w, at.z);
      } else {
        const Gradient<T, false> still{{}, G.xy, G.xz, G.yx, {}, G.yz, G.zx, G.zy, {}};
        detail::link_force(bodies_[i], still, at.u, at.v, at.w, at.z);
      }
    }
  }

  template <bool turning>
  KALMARM_INLINE void force(const LoweredModel<Pair<double>>&, int k,
                            Sixfold<Pair<double>>& z) const {
    const Sixfold<T>& from = blocks_[k / lanes].z;
    const int lane = k % lanes;
    z.x = get(from.x, lane);
    z.y = get(from.y, lane);
    z.z = get(from.z, lane);
    z.u = get(from.u, lane);
    z.v = get(from.v, lane);
    z.w = get(from.w, lane);
  }

 private:
  using P = WidePack<double>;
  using T = Pair<P>;
  static constexpr int lanes = Lanes<P>::count;

  struct Block {
    AccelerationGradient<T> Gamma{};
    T u{}, v{}, w{};  // acceleration of the origin
    Sixfold<T> z{};
  };

  KALMARM_INLINE static void set(T& to, int lane, const Pair<double>& x) {
    to.hi.set(lane, x.hi);
    to.lo.set(lane, x.lo);
  }
  KALMARM_INLINE static Pair<double> get(const T& from, int lane) {
    return {from.hi[lane], from.lo[lane]};
  }

  std::vector<Block> blocks_;
  std::vector<CentralBody<T>> bodies_;
};

}  // namespace kalmarm
