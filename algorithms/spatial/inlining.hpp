// Attributes that the small functions and the sweeps of the fast path need, and why.
//
//   KALMARM_INLINE         One joint's or one number's work: always inlined. As a call it would
//                          pass its arguments (6-vectors, packs) through memory, and would compute
//                          with zeros and constant axes that the caller knows. gcc's own limits are
//                          far below the size of one step of a sweep.
//   KALMARM_INLINE_LAMBDA  The same for a lambda; it follows the parameters.
//   KALMARM_NOINLINE       A whole sweep, or a case that few robots have: never inlined, so that it
//                          takes no registers from its caller's loop.
//   KALMARM_SWEEP          A sweep over the links, without gcc's SLP vectorisation. This would pair
//                          neighbours of P and z into vectors, which are written as single numbers
//                          and read as pairs: 1.4 times as slow in the covariance filter where
//                          there is armature, 1.2 times in the forces of composite bodies. clang
//                          does not know the attribute and ignores it.
//
// They stand before the return type. KALMARM_INLINE includes the word `inline`.
//
// A file compiled with KALMARM_CALLS leaves it to the compiler what is inlined: a test that times
// nothing takes two thirds of the compiler's time.
#pragma once

#ifdef KALMARM_CALLS
#define KALMARM_INLINE inline
#define KALMARM_INLINE_LAMBDA
#else
#define KALMARM_INLINE [[gnu::always_inline]] inline
#define KALMARM_INLINE_LAMBDA __attribute__((always_inline))
#endif
#define KALMARM_NOINLINE [[gnu::noinline]]
#define KALMARM_SWEEP [[gnu::optimize("no-tree-slp-vectorize")]]
