// M = U D U', U unit upper triangular: the factorisation that (3.1) is, I + K = U, by elimination.
// It is unique. O(n^3 / 3).
#pragma once

#include "algorithms/spatial/spatial.hpp"

namespace kalmarm {

template <class T>
struct UDU {
  MatrixX<T> U;
  VectorX<T> D;

  // M: symmetric and positive definite.
  explicit UDU(MatrixX<T> M) : U(MatrixX<T>::Identity(M.rows(), M.cols())), D(M.rows()) {
    for (Eigen::Index j = M.rows() - 1; j >= 0; --j) {
      D[j] = M(j, j);
      U.col(j).head(j) = M.col(j).head(j) / D[j];
      const VectorX<T> u = U.col(j).head(j);
      M.topLeftCorner(j, j) -= u * M.row(j).head(j);
    }
  }

  // U^-1 B.
  MatrixX<T> solve_U(const MatrixX<T>& B) const {
    return U.template triangularView<Eigen::UnitUpper>().solve(B);
  }
};

}  // namespace kalmarm
