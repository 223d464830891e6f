// Counts allocations: malloc and its relatives are replaced by ones that count. All of C++ and
// Eigen ends there, shared libraries included. For one source file of a program; not for a binary
// with sanitizers, which replace them too, nor for threads that allocate while it matters.
#pragma once

#include <errno.h>

#include <cstddef>
#include <cstdlib>

namespace kalmarm {
inline long allocations = 0;
}

// glibc's own, under names that are not replaced.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t n, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  ++kalmarm::allocations;
  return __libc_malloc(size);
}

void* calloc(std::size_t n, std::size_t size) {
  ++kalmarm::allocations;
  return __libc_calloc(n, size);
}

void* realloc(void* old, std::size_t size) {
  ++kalmarm::allocations;
  return __libc_realloc(old, size);
}

void* memalign(std::size_t alignment, std::size_t size) {
  ++kalmarm::allocations;
  return __libc_memalign(alignment, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) { return memalign(alignment, size); }

// Under another name, since headers disagree on whether posix_memalign may throw.
int counted_posix_memalign(void** out, std::size_t alignment,
                           std::size_t size) __asm__("posix_memalign");
int counted_posix_memalign(void** out, std::size_t alignment, std::size_t size) {
  *out = memalign(alignment, size);
  return *out ? 0 : ENOMEM;
}
}
