// Conjugate gradients on H = M + J'DJ, which is formed, by Eigen's loop; what contact simulators take where a factor
// of H is too much.
//
//   x(i+1) = x(i) + alpha p(i) until |b - H x| <= u |b|, 10 n steps at most
// Preconditioner: of M alone. With M^-1 by the filter M^-1 H is 1 but for as many eigenvalues as J has rank, so that
// exact arithmetic takes no more than that many steps and one. Outcome::steps of `solve` counts them; one that has not
// settled warns.
#pragma once

#include <Eigen/IterativeLinearSolvers>
#include <span>
#include <string>

#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/study/contacts/contact_row.hpp"
#include "kalmarm/outcome.hpp"

namespace kalmarm {

// M's diagonal.
struct DiagonalOfM {
  static std::string name() { return "Diagonal"; }

  template <class T>
  struct Workspace {
    VectorX<T> inverse;
    explicit Workspace(const Model<T>& model) : inverse(model.nv()) {}
  };

  template <class T>
  static Outcome factor(const Model<T>&, const LinkKinematics<T>&, const MatrixX<T>& M,
                        Workspace<T>& ws) {
    ws.inverse = M.diagonal().cwiseInverse();
    return {};
  }
  template <class T>
  static void solve(const Model<T>&, const LinkKinematics<T>&, const VectorX<T>& r,
                    Workspace<T>& ws, VectorX<T>& z) {
    z = ws.inverse.cwiseProduct(r);
  }
};

// M^-1 by the factors of a variant.
template <class Variant>
struct InverseOfM {
  static std::string name() { return Variant::name(); }

  template <class T>
  using Workspace = typename Variant::template Workspace<T>;

  template <class T>
  static Outcome factor(const Model<T>& model, const LinkKinematics<T>& kin, const MatrixX<T>&,
                        Workspace<T>& ws) {
    return Variant::factor(model, kin, ws);
  }
  template <class T>
  static void solve(const Model<T>& model, const LinkKinematics<T>& kin, const VectorX<T>& r,
                    Workspace<T>& ws, VectorX<T>& z) {
    Variant::solve(model, kin, r, ws, z);
  }
};

template <class Preconditioner>
struct ConjugateGradient {
  static std::string name() { return "ConjugateGradient<" + Preconditioner::name() + ">"; }

  // As Eigen's loop asks its preconditioner.
  template <class T>
  class Applied {
   public:
    using StorageIndex = Eigen::Index;
    enum { ColsAtCompileTime = Eigen::Dynamic, MaxColsAtCompileTime = Eigen::Dynamic };

    void set(const Model<T>& model, const LinkKinematics<T>& kin,
             typename Preconditioner::template Workspace<T>& ws) {
      model_ = &model, kin_ = &kin, ws_ = &ws;
    }

    template <class Matrix>
    Applied& analyzePattern(const Matrix&) {
      return *this;
    }
    template <class Matrix>
    Applied& factorize(const Matrix&) {
      return *this;
    }
    template <class Matrix>
    Applied& compute(const Matrix&) {
      return *this;
    }
    Eigen::ComputationInfo info() { return Eigen::Success; }

    template <class Residual>
    VectorX<T> solve(const Residual& r) const {
      VectorX<T> z(r.size());
      Preconditioner::solve(*model_, *kin_, VectorX<T>(r), *ws_, z);
      return z;
    }

   private:
    const Model<T>* model_ = nullptr;
    const LinkKinematics<T>* kin_ = nullptr;
    typename Preconditioner::template Workspace<T>* ws_ = nullptr;
  };

  template <class T>
  struct Workspace {
    CompositeInertia<T> composite;
    MatrixX<T> H;
    VectorX<T> J;
    typename Preconditioner::template Workspace<T> of_M;
    Eigen::ConjugateGradient<MatrixX<T>, Eigen::Lower | Eigen::Upper, Applied<T>> loop;

    explicit Workspace(const Model<T>& model)
        : composite(model), H(model.nv(), model.nv()), J(model.nv()), of_M(model) {
      loop.setTolerance(unit_roundoff<T>());
      loop.setMaxIterations(10 * model.nv());
    }
  };

  template <class T>
  static Outcome factor(const Model<T>& model, const LinkKinematics<T>& kin,
                        std::span<const ContactRow<T>> contacts, Workspace<T>& ws) {
    mass_matrix(model, kin, ws.composite, Eigen::Ref<MatrixX<T>>(ws.H));
    if (const Outcome of_M = Preconditioner::factor(model, kin, ws.H, ws.of_M); !of_M) return of_M;
    for (const ContactRow<T>& row : contacts) {
      contact_jacobian(model, kin, row, ws.J);
      ws.H.noalias() += (row.d * ws.J) * ws.J.transpose();
    }
    ws.loop.preconditioner().set(model, kin, ws.of_M);
    ws.loop.compute(ws.H);
    return {};
  }

  // x = H^-1 b, after factor.
  template <class T>
  static Outcome solve(const Model<T>&, const LinkKinematics<T>&, const VectorX<T>& b,
                       Workspace<T>& ws, VectorX<T>& x) {
    x = ws.loop.solve(b);
    Outcome out;
    out.steps = static_cast<int>(ws.loop.iterations());
    out.near_singular = ws.loop.info() != Eigen::Success;
    return out;
  }
};

}  // namespace kalmarm
