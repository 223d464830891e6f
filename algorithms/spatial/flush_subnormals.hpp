// Arithmetic on subnormal numbers takes many processors about a hundred times as long. Where they
// count for nothing, an object of this class makes them zero for as long as it lives, by the
// processor's modes "flush to zero" (results) and "denormals are zero" (operands), and then restores
// what the caller had. Processors other than x86 are left as they are.
#pragma once

#ifdef __SSE2__
#include <xmmintrin.h>
#endif

namespace kalmarm {

class FlushSubnormals {
 public:
  FlushSubnormals(const FlushSubnormals&) = delete;
  FlushSubnormals& operator=(const FlushSubnormals&) = delete;

#ifdef __SSE2__
  FlushSubnormals() : before_(_mm_getcsr()) { _mm_setcsr(before_ | modes); }
  // Exceptions that were raised since stay raised.
  ~FlushSubnormals() { _mm_setcsr((_mm_getcsr() & ~modes) | (before_ & modes)); }

 private:
  static constexpr unsigned modes = 0x8040;  // MXCSR: bit 15 flushes, bit 6 takes for zero
  unsigned before_;
#else
  FlushSubnormals() {}
  ~FlushSubnormals() {}
#endif
};

}  // namespace kalmarm
