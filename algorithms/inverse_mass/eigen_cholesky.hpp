// Backends of Batch that use Eigen's dense factorisations, in any precision.
//   EigenLLT   M = G G',         nv^3/3 flops, no pivoting
//   EigenLDLT  P M P' = L D L',  the same with the largest diagonal entry brought forward
#pragma once

#include <Eigen/Cholesky>
#include <numeric>
#include <utility>
#include <vector>

#include "algorithms/inverse_mass/batch.hpp"

namespace kalmarm {

struct EigenLLT {
  static constexpr const char* name = "EigenLLT";
  static constexpr const char* equation = "M = G G', Cholesky, Eigen";
  template <class T>
  static constexpr bool supports = true;

  template <class T>
  struct Workspace {
    Eigen::LLT<MatrixX<T>> llt;

    explicit Workspace(const Model<T>& model) : llt(model.nv()) {}
  };

  template <class T>
  static Outcome factor(const Model<T>& model, const MatrixX<T>& M, Workspace<T>& ws) {
    ws.llt.compute(M);
    const int nv = model.nv();
    const bool stopped = ws.llt.info() != Eigen::Success;
    const MatrixX<T>& G = ws.llt.matrixLLT();
    for (int k = 0; k < nv; ++k) {
      // Eigen does not say where it stopped, but the rows up to there are done.
      const T D = stopped ? T(M(k, k) - G.row(k).head(k).squaredNorm()) : T(G(k, k) * G(k, k));
      if (const Outcome outcome = check_pivot(k, D, T(M(k, k)), nv); !outcome) return outcome;
    }
    if (stopped) return {Outcome::Status::indefinite, nv - 1, 0, 0};
    return {};
  }

  template <class T>
  static void solve(const Model<T>&, Workspace<T>& ws, VectorX<T>& x) {
    ws.llt.solveInPlace(x);
  }

  template <class T>
  static void inverse(const Model<T>&, Workspace<T>& ws, MatrixX<T>& X) {
    X.setIdentity();
    ws.llt.solveInPlace(X);
  }
};

struct EigenLDLT {
  static constexpr const char* name = "EigenLDLT";
  static constexpr const char* equation = "P M P' = L D L', pivoted, Eigen";
  template <class T>
  static constexpr bool supports = true;

  template <class T>
  struct Workspace {
    Eigen::LDLT<MatrixX<T>> ldlt;
    std::vector<int> joint;  // DoF of every pivot

    explicit Workspace(const Model<T>& model) : ldlt(model.nv()), joint(model.nv()) {}
  };

  template <class T>
  static Outcome factor(const Model<T>& model, const MatrixX<T>& M, Workspace<T>& ws) {
    ws.ldlt.compute(M);
    const int nv = model.nv();
    std::iota(ws.joint.begin(), ws.joint.end(), 0);
    for (int k = 0; k < nv; ++k)
      std::swap(ws.joint[k], ws.joint[ws.ldlt.transpositionsP().coeff(k)]);
    for (int k = 0; k < nv; ++k) {
      const int joint = ws.joint[k];
      if (const Outcome outcome =
              check_pivot(joint, T(ws.ldlt.vectorD()[k]), T(M(joint, joint)), nv);
          !outcome)
        return outcome;
    }
    return {};
  }

  template <class T>
  static void solve(const Model<T>&, Workspace<T>& ws, VectorX<T>& x) {
    ws.ldlt.solveInPlace(x);
  }

  template <class T>
  static void inverse(const Model<T>&, Workspace<T>& ws, MatrixX<T>& X) {
    X.setIdentity();
    ws.ldlt.solveInPlace(X);
  }
};

}  // namespace kalmarm
