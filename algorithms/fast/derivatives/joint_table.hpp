// A table of numbers per joint that can be read by joint or by SIMD register: blocks of `lanes`
// joints, as many as V holds, and in each block one row for every number.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <type_traits>
#include <vector>

#include "algorithms/fast/covariance/articulated.hpp"
#include "algorithms/fast/kinematics/triple.hpp"
#include "algorithms/spatial/inlining.hpp"
#include "algorithms/spatial/pack.hpp"

namespace kalmarm {

// The SIMD pack of T: a register of float or double, but the six columns of a link have room
// (derivative_chain.hpp); T itself for any other scalar, and where T is a pack of states.
template <class T>
struct WideOf {
  using type = T;
};
template <class T>
requires std::is_floating_point_v<T>
struct WideOf<T> {
  using type = Pack<T, std::max(Lanes<WidePack<T>>::count, 8)>;
};
template <class T>
using Wide = typename WideOf<T>::type;

// How many columns, or joints, are worked out at once: one where T has a state in every lane.
template <class T>
inline constexpr int lanes_of = Lanes<Wide<T>>::count / Lanes<T>::count;

template <class T>
using AlignedVector = std::vector<T, Eigen::aligned_allocator<T>>;

template <class T>
KALMARM_INLINE Wide<T> load(const T* from) {
  if constexpr ((lanes_of<T>) > 1)
    return Wide<T>::load(from);
  else
    return *from;
}
template <class T>
KALMARM_INLINE void store(const Wide<T>& x, T* to) {
  if constexpr ((lanes_of<T>) > 1)
    x.store(to);
  else
    *to = x;
}

// The first `count` lanes; `room` says whether all of them may be written, in which case the others
// keep what is there.
template <class P>
KALMARM_INLINE void store_first(const P& x, int count, bool room, typename Lanes<P>::Scalar* to) {
  constexpr int lanes = Lanes<P>::count;
  if (count >= lanes) return x.store(to);
  if constexpr (requires { x.high; }) {
    store_first(x.low, count, room, to);
    if (count > lanes / 2) store_first(x.high, count - lanes / 2, room, to + lanes / 2);
  } else if (room) {
    typename P::Mask lane;
    for (int i = 0; i < lanes; ++i) lane[i] = i;
    const P there = P::load(to);
    P::of(lane < count ? x.v : there.v).store(to);
  } else {
    for (int i = 0; i < count; ++i) to[i] = x[i];
  }
}
template <class T>
KALMARM_INLINE void store_some(const Wide<T>& x, int count, bool room, T* to) {
  if constexpr ((lanes_of<T>) == 1)
    *to = x;
  else
    store_first(x, count, room, to);
}

template <class T, int numbers, class V = Wide<T>>
class JointTable {
 public:
  static constexpr int lanes = Lanes<V>::count / Lanes<T>::count;

  explicit JointTable(int joints)
      : blocks_((joints + lanes - 1) / lanes), data_(blocks_ * numbers * lanes, T(0)) {}

  int blocks() const { return blocks_; }

  T& at(int number, int joint) {
    return data_[(joint / lanes * numbers + number) * lanes + joint % lanes];
  }
  const T& at(int number, int joint) const {
    return data_[(joint / lanes * numbers + number) * lanes + joint % lanes];
  }
  void set(int number, int joint, const Triple<T>& x) {
    at(number, joint) = x.x;
    at(number + 1, joint) = x.y;
    at(number + 2, joint) = x.z;
  }
  Triple<T> triple(int number, int joint) const {
    return {at(number, joint), at(number + 1, joint), at(number + 2, joint)};
  }

  // Of all joints of a block.
  const T* row(int number, int block) const { return &data_[(block * numbers + number) * lanes]; }
  T* row(int number, int block) { return &data_[(block * numbers + number) * lanes]; }
  V load(int number, int block) const {
    if constexpr (lanes > 1)
      return V::load(row(number, block));
    else
      return *row(number, block);
  }
  void store(int number, int block, const V& x) {
    if constexpr (lanes > 1)
      x.store(row(number, block));
    else
      *row(number, block) = x;
  }
  Triple<V> load3(int number, int block) const {
    return {load(number, block), load(number + 1, block), load(number + 2, block)};
  }
  void store3(int number, int block, const Triple<V>& x) {
    store(number, block, x.x);
    store(number + 1, block, x.y);
    store(number + 2, block, x.z);
  }

 private:
  int blocks_;
  AlignedVector<T> data_;
};

}  // namespace kalmarm
