// Backend of Batch: M = L'DL without fill-in on a tree (Featherstone 2005), in any precision.
//
// From the last DoF to the first, with anc(k) the ancestors of k:
//   factor    D(k) = M(k,k),  L(k,i) = M(k,i) / D(k),  M(i,j) <- M(i,j) - L(k,i) M(k,j)
//             for i, j in anc(k)
//   solve     x(i) <- x(i) - L(k,i) x(k), tips to base;  x <- x / D;
//             x(k) <- x(k) - L(k,i) x(i), base to tips
//   inverse   X = L^-1 D^-1 L^-T, so that row k of L X = D^-1 L^-T says, for j <= k,
//             X(k,j) = [j = k] / D(k) - sum over i in anc(k) of L(k,i) X(i,j):
//             base to tips, each row from the rows of its ancestors
// O(nv depth^2) for the factors; on a chain, dense.
#pragma once

#include <vector>

#include "algorithms/study/inverse_mass/batch.hpp"

namespace kalmarm {

struct SparseLTDL {
  static constexpr const char* name = "SparseLTDL";
  static constexpr const char* equation = "M = L'DL, sparse over branches";
  template <class T>
  static constexpr bool supports = true;

  template <class T>
  struct Workspace {
    MatrixX<T> LT;  // column k: L(k,i) in row i, D(k) on the diagonal

    explicit Workspace(const Model<T>& model) : LT(model.nv(), model.nv()) {}
  };

  template <class T>
  static Outcome factor(const Model<T>& model, const MatrixX<T>& M, const VectorX<T>& e,
                        Workspace<T>& ws) {
    MatrixX<T>& LT = ws.LT;
    LT = M;
    for (int k = model.nv() - 1; k >= 0; --k) {
      const T D = LT(k, k);
      if (const Outcome outcome = check_pivot(k, D, e[k]); !outcome) return outcome;
      for (int j = model.parent(k); j >= 0; j = model.parent(j)) {
        const T l = LT(j, k) / D;
        for (int i = j; i >= 0; i = model.parent(i)) LT(i, j) -= l * LT(i, k);
        LT(j, k) = l;
      }
    }
    return {};
  }

  template <class T>
  static void solve(const Model<T>& model, Workspace<T>& ws, VectorX<T>& x) {
    const MatrixX<T>& LT = ws.LT;
    for (int k = model.nv() - 1; k >= 0; --k)  // x <- L^-T x
      for (int i = model.parent(k); i >= 0; i = model.parent(i)) x[i] -= LT(i, k) * x[k];
    for (int k = 0; k < model.nv(); ++k) {  // x <- L^-1 D^-1 x
      x[k] /= LT(k, k);
      for (int i = model.parent(k); i >= 0; i = model.parent(i)) x[k] -= LT(i, k) * x[i];
    }
  }

  template <class T>
  static void inverse(const Model<T>& model, Workspace<T>& ws, MatrixX<T>& X) {
    const MatrixX<T>& LT = ws.LT;
    for (int k = 0; k < model.nv(); ++k) {
      auto column = X.col(k).head(k + 1);  // row k of X, by symmetry, up to the diagonal
      column.setZero();
      for (int i = model.parent(k); i >= 0; i = model.parent(i)) {
        column.head(i + 1) -= LT(i, k) * X.col(i).head(i + 1);
        column.segment(i + 1, k - i - 1) -=
            LT(i, k) * X.row(i).segment(i + 1, k - i - 1).transpose();
      }
      T diagonal = T(1) / LT(k, k);
      for (int i = model.parent(k); i >= 0; i = model.parent(i)) diagonal -= LT(i, k) * column[i];
      column[k] = diagonal;
    }
    X.template triangularView<Eigen::StrictlyLower>() = X.transpose();
  }
};

}  // namespace kalmarm
