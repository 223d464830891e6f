// What answers in the place of a kernel where the sweep's own numbers do not say that its factors
// can be used: a variant of the study on the same model, the plain one for the conventional form,
// Sequential<Conventional>, the most careful one for the square-root form,
// WideRefined<FactoredBias<ArrayGivens>>, which is the last resort for accelerations too
// (certified/certified_acceleration.hpp).
//
// Plain numbers cross this boundary, so that kernels for any instruction set share one fallback.
#pragma once

#include <memory>

#include "algorithms/model/selection.hpp"
#include "kalmarm/dynamics.hpp"

namespace kalmarm {

// Vectors hold nv numbers, q nq; matrices are column-major. On failure a result is not to be used.
template <class T>
class Fallback {
 public:
  virtual ~Fallback() = default;

  virtual Outcome acceleration(const T* q, const T* qd, const T* tau, T* a) = 0;
  virtual Outcome factor(const T* q) = 0;
  virtual Outcome inverse(const T* q, T* X) = 0;
  virtual Outcome diagonal(const T* q, T* x) = 0;
  virtual Outcome log_det(const T* q, T& x) = 0;

  // What `selected` is about; takes its memory.
  virtual void select(const Selection& selection) = 0;
  virtual Outcome selected(const T* q, T* X) = 0;

  // By the factors of the last `factor`: X (nv x columns) = M^-1 T; the diagonal; log det M.
  virtual void solve(int columns, const T* taus, T* X) = 0;
  virtual void kept_diagonal(T* x) = 0;
  virtual T kept_log_det() const = 0;
};

// Of Sequential<Conventional>, every D is compared with the sizes of what it is a difference of (S
// of inverse_mass/singularity.hpp), not only those that look small.
template <class T>
std::unique_ptr<Fallback<T>> make_fallback(const RobotModel& robot, Form form);

}  // namespace kalmarm
