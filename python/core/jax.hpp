// Calls of a robot's rows as custom calls of XLA on the CPU, which kalmarm.jax registers with JAX.
//
// The handlers are part of _core, not of a module of their own: XLA's typed interface (xla/ffi/api/ffi.h of the wheel
// jaxlib, Apache-2.0) is headers alone, so that nothing of JAX is linked, loaded or needed at run time, one wheel serves
// every release of JAX with the same version of that interface, and a robot's memory for calls (workers.hpp) is shared by
// NumPy's and JAX's calls. A build without the headers has no handlers, and kalmarm.jax says so.
//
// Buffers are read and written where they lie. A robot comes as a number, of a table here, and not as an address: programs
// of XLA are kept on disk, and an address of another process would be read.
#pragma once

#include <nanobind/nanobind.h>

namespace kalmarm::python {

// The module's _jax_ functions; none in a build without the headers.
void bind_jax(nanobind::module_& module);

}  // namespace kalmarm::python
