// Errors counted in bins that are fixed, so that the counts of parts add up to those of the whole.
//
//   b = floor(32 log2 error),   2^(b/32) <= error < 2^((b+1)/32)                           (1)
// are 32 bins an octave, of 2.2 per cent each. With error = f 2^e and 1 <= f < 2, exactly (frexp),
//   b = 32 e + number of j from 1 to 31 with 2^(j/32) <= f                                 (2)
// No such power is a double: f is above it where it is at least the next double, which the table
// holds. Logarithms would differ between libraries beside the edges of bins.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory_resource>

namespace kalmarm::stress {

inline constexpr int bins_per_octave = 32;

// 2^(j/32), j = 1 to 31, rounded up.
inline constexpr std::array<double, bins_per_octave - 1> bin_edges = {
    0x1.059b0d3158575p+0, 0x1.0b5586cf98910p+0, 0x1.11301d0125b51p+0, 0x1.172b83c7d517bp+0,
    0x1.1d4873168b9abp+0, 0x1.2387a6e756239p+0, 0x1.29e9df51fdee2p+0, 0x1.306fe0a31b716p+0,
    0x1.371a7373aa9cbp+0, 0x1.3dea64c123423p+0, 0x1.44e086061892ep+0, 0x1.4bfdad5362a28p+0,
    0x1.5342b569d4f82p+0, 0x1.5ab07dd48542ap+0, 0x1.6247eb03a5585p+0, 0x1.6a09e667f3bcdp+0,
    0x1.71f75e8ec5f74p+0, 0x1.7a11473eb0187p+0, 0x1.82589994cce13p+0, 0x1.8ace5422aa0dcp+0,
    0x1.93737b0cdc5e5p+0, 0x1.9c49182a3f091p+0, 0x1.a5503b23e255dp+0, 0x1.ae89f995ad3aep+0,
    0x1.b7f76f2fb5e47p+0, 0x1.c199bdd85529dp+0, 0x1.cb720dcef906ap+0, 0x1.d5818dcfba488p+0,
    0x1.dfc97337b9b5fp+0, 0x1.ea4afa2a490dap+0, 0x1.f50765b6e4541p+0};

// (2). error: finite and above zero.
inline int bin_of(double error) {
  int exponent = 0;
  const double f = 2 * std::frexp(error, &exponent);
  const auto above = std::ranges::upper_bound(bin_edges, f);
  return bins_per_octave * (exponent - 1) + static_cast<int>(above - bin_edges.begin());
}

struct ErrorCounts {
  std::uint64_t zero = 0, nan = 0, inf = 0;
  std::pmr::map<int, std::uint64_t> bins;  // by (1)

  explicit ErrorCounts(std::pmr::memory_resource* memory = std::pmr::get_default_resource())
      : bins(memory) {}

  void add(double error) {
    if (std::isnan(error))
      ++nan;
    else if (std::isinf(error))
      ++inf;
    else if (error == 0)
      ++zero;
    else
      ++bins[bin_of(error)];
  }
};

}  // namespace kalmarm::stress
