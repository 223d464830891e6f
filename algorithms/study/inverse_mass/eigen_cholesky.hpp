// Backends of Batch that use Eigen's dense factorisations, in any precision.
//   EigenLLT   M = G G',         nv^3/3 flops, no pivoting
//   EigenLDLT  P M P' = L D L',  the same with the largest diagonal entry brought forward
#pragma once

#include <Eigen/Cholesky>
#include <numeric>
#include <utility>
#include <vector>

#include "algorithms/study/inverse_mass/batch.hpp"

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
  static Outcome factor(const Model<T>&, const MatrixX<T>& M, const VectorX<T>& e,
                        Workspace<T>& ws) {
    ws.llt.compute(M);
    return check_cholesky(M, ws.llt.matrixLLT(), ws.llt.info() != Eigen::Success, e);
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
  static Outcome factor(const Model<T>& model, const MatrixX<T>& M, const VectorX<T>& e,
                        Workspace<T>& ws) {
    ws.ldlt.compute(M);
    const int nv = model.nv();
    std::iota(ws.joint.begin(), ws.joint.end(), 0);
    for (int k = 0; k < nv; ++k)
      std::swap(ws.joint[k], ws.joint[ws.ldlt.transpositionsP().coeff(k)]);
    for (int k = 0; k < nv; ++k) {
      const int joint = ws.joint[k];
      if (const Outcome outcome = check_pivot(joint, T(ws.ldlt.vectorD()[k]), e[joint]); !outcome)
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
