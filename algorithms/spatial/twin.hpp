// Two packs at once, for sweeps along a chain whose every step waits for the one before.
#pragma once

#include "algorithms/spatial/pack.hpp"

namespace kalmarm {

template <class P>
struct Twin {
  using Scalar = typename Lanes<P>::Scalar;

  P a, b;

  Twin() = default;
  [[gnu::always_inline]] Twin(Scalar x) : a(x), b(x) {}
  [[gnu::always_inline]] Twin(const P& first, const P& second) : a(first), b(second) {}

  [[gnu::always_inline]] static Twin load(const Scalar* from) {
    return {P::load(from), P::load(from + Lanes<P>::count)};
  }
  [[gnu::always_inline]] void store(Scalar* to) const {
    a.store(to);
    b.store(to + Lanes<P>::count);
  }
  Scalar operator[](int lane) const {
    return lane < Lanes<P>::count ? a[lane] : b[lane - Lanes<P>::count];
  }

  [[gnu::always_inline]] friend Twin operator+(const Twin& x, const Twin& y) {
    return {x.a + y.a, x.b + y.b};
  }
  [[gnu::always_inline]] friend Twin operator-(const Twin& x, const Twin& y) {
    return {x.a - y.a, x.b - y.b};
  }
  [[gnu::always_inline]] friend Twin operator-(const Twin& x) { return {-x.a, -x.b}; }
  [[gnu::always_inline]] friend Twin operator*(const Twin& x, const Twin& y) {
    return {x.a * y.a, x.b * y.b};
  }
  [[gnu::always_inline]] friend Twin& operator+=(Twin& x, const Twin& y) { return x = x + y; }
  [[gnu::always_inline]] friend Twin& operator-=(Twin& x, const Twin& y) { return x = x - y; }
};

template <class P>
struct Lanes<Twin<P>> {
  using Scalar = typename Lanes<P>::Scalar;
  static constexpr int count = 2 * Lanes<P>::count;
};

template <class P>
[[gnu::always_inline]] inline Twin<P> without_tiny(const Twin<P>& x) {
  return {without_tiny(x.a), without_tiny(x.b)};
}

}  // namespace kalmarm
