// A solver that answers without forming M^-1 where a part of it is all that is asked for.
#pragma once

#include <limits>
#include <vector>

#include "algorithms/model/site.hpp"
#include "algorithms/solver.hpp"

namespace kalmarm {

// The columns of B = [e(j) of every DoF j, J' of every site].
template <class T>
struct Selection {
  std::vector<int> dofs;
  std::vector<Site<T>> sites;

  int size() const { return static_cast<int>(dofs.size() + 6 * sites.size()); }
};

// All from q, kinematics included. On failure a result is not to be used.
template <class T>
class PartialSolver : public Solver<T> {
 public:
  // x (nv) = the diagonal of M^-1.
  virtual Outcome diagonal(const VectorX<T>& q, VectorX<T>& x) = 0;

  // x = log det M, the sum of log D(k).
  virtual Outcome log_det(const VectorX<T>& q, T& x) = 0;

  // What `selected` is about from now on; takes its memory.
  virtual void select(const Selection<T>& selection) = 0;

  // X (size x size of the selection) = B'M^-1 B, both triangles: chosen rows and columns of M^-1,
  // and of sites J M^-1 J'.
  virtual Outcome selected(const VectorX<T>& q, MatrixX<T>& X) = 0;

  // Factors stand in frames of the solver's own, and are not shown.
  bool has_factors() const final { return false; }
  Outcome factors(const VectorX<T>& q, VectorX<T>&, MatrixX<T>&) final { return this->factor(q); }
  Vector6<T> P_plus_times(int, const Vector6<T>&) const final {
    return Vector6<T>::Constant(std::numeric_limits<T>::quiet_NaN());
  }
};

}  // namespace kalmarm
