// Python's global lock, given up while C++ computes.
#pragma once

#include <Python.h>
#include <cxxabi.h>
#include <unistd.h>

namespace kalmarm::python {

// As nb::gil_scoped_release, but for threads that still compute when the interpreter has ended (daemon
// threads): before Python 3.14 the lock then ends its thread by unwinding, through destructors that
// need the lock, where C++ aborts. As of 3.14 they wait here for the end of the process.
class WithoutLock {
 public:
  explicit WithoutLock(bool released = true) : state_(released ? PyEval_SaveThread() : nullptr) {}
  WithoutLock(const WithoutLock&) = delete;
  WithoutLock& operator=(const WithoutLock&) = delete;
  ~WithoutLock() {
    if (!state_) return;
    try {
      PyEval_RestoreThread(state_);
    } catch (abi::__forced_unwind&) {
      for (;;) pause();
    }
  }

 private:
  PyThreadState* state_;
};

}  // namespace kalmarm::python
