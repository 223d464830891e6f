// Backend of Batch: LAPACK's Cholesky as OpenBLAS has it: potrf, potrs, potri. float and double.
#pragma once

#include <lapacke.h>

#include <type_traits>

#include "algorithms/study/inverse_mass/batch.hpp"

namespace kalmarm {

struct OpenBLAS {
  static constexpr const char* name = "OpenBLAS";
  static constexpr const char* equation = "M = G G', Cholesky, OpenBLAS";
  template <class T>
  static constexpr bool supports = std::is_same_v<T, float> || std::is_same_v<T, double>;

  template <class T>
  struct Workspace {
    MatrixX<T> G;  // lower triangle

    explicit Workspace(const Model<T>& model) : G(model.nv(), model.nv()) {}
  };

  template <class T>
  static Outcome factor(const Model<T>& model, const MatrixX<T>& M, const VectorX<T>& e,
                        Workspace<T>& ws) {
    const int nv = model.nv();
    ws.G = M;
    const int info = potrf(nv, ws.G.data());
    return check_cholesky(M, ws.G, info > 0, e);
  }

  template <class T>
  static void solve(const Model<T>& model, Workspace<T>& ws, VectorX<T>& x) {
    potrs(model.nv(), ws.G.data(), x.data());
  }

  template <class T>
  static void inverse(const Model<T>& model, Workspace<T>& ws, MatrixX<T>& X) {
    X = ws.G;
    potri(model.nv(), X.data());
    X.template triangularView<Eigen::StrictlyUpper>() = X.transpose();
  }

 private:
  // The _work entry points neither allocate nor look for NaN. Arguments are right by construction,
  // and a NaN fails in check_pivot.
  static int potrf(int n, double* G) { return LAPACKE_dpotrf_work(LAPACK_COL_MAJOR, 'L', n, G, n); }
  static int potrf(int n, float* G) { return LAPACKE_spotrf_work(LAPACK_COL_MAJOR, 'L', n, G, n); }
  static void potrs(int n, const double* G, double* x) {
    LAPACKE_dpotrs_work(LAPACK_COL_MAJOR, 'L', n, 1, G, n, x, n);
  }
  static void potrs(int n, const float* G, float* x) {
    LAPACKE_spotrs_work(LAPACK_COL_MAJOR, 'L', n, 1, G, n, x, n);
  }
  static void potri(int n, double* G) { LAPACKE_dpotri_work(LAPACK_COL_MAJOR, 'L', n, G, n); }
  static void potri(int n, float* G) { LAPACKE_spotri_work(LAPACK_COL_MAJOR, 'L', n, G, n); }
};

}  // namespace kalmarm
