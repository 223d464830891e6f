// Forward dynamics of a chain by divide and conquer (Featherstone, 1999): runs of bodies in mobility
// form, two of them joined at a time.
//
// z(k) is the force through joint k and l(k) the acceleration of its link there. A run of bodies is
// known by how its two ends answer to the forces z_in at its inboard joint and z_out at the joint
// outboard of it:
//   l_in  = X11 z_in - X12 z_out + y1
//   l_out = X12' z_in - X22 z_out + y2                                                     (1)
// One body, with phi = phi(k,k+1):
//   X11 = M^-1,   X12 = M^-1 phi,   X22 = phi' M^-1 phi,   y1 = -M^-1 b,   y2 = phi' y1    (2)
// Two runs, A inboard of joint k and B outboard, are held together by l_in(B) = l_out(A) + H'a + c
// and H z + r a = tau. With S = X11(B) + X22(A) and s = X12(A)' z_in + X12(B) z_out + beta,
// beta = y2(A) - y1(B) + c,
//   z = W s + nu tau,   V = S^-1,   d = H V H' + r,   nu = V H'/d,   W = V - nu (V H')'    (3)
//   a = (tau - H V s) / d                                                                  (4)
//   X11 = X11(A) - X12(A) W X12(A)',   X12 = X12(A) W X12(B),
//   X22 = X22(B) - X12(B)' W X12(B)                                                        (5)
//   y1 = y1(A) - X12(A) f,   y2 = y2(B) + X12(B)' f,   f = W beta + nu tau                 (6)
// Up a balanced tree (5) and (6), down it (3) and (4), O(log N) one after another. The base is a
// body that does not move: X22 = 0 and y2 = phi' l(base).
//
// Where r = 0 the force has H z = tau, and only its other five entries T'z are unknown. `projected`
// solves for them, W = T (T'S T)^-1 T' and nu = H' - W S H', which leaves out the cancellation of
// W's axis in (3); a = H (S z - s) then.
//
// A body's inertia is inverted, so each must have mass and three moments of inertia, and the links
// be a chain (`applies`): massless links have no mobility form. The filter's elements need neither
// (covariance_element.hpp).
#pragma once

#include <Eigen/Cholesky>
#include <string>
#include <vector>

#include "algorithms/model/link_kinematics.hpp"
#include "algorithms/study/scan/blocks.hpp"
#include "algorithms/study/variant_traits.hpp"
#include "kalmarm/outcome.hpp"

namespace kalmarm {

template <bool projected>
struct DivideAndConquer {
  static std::string name() {
    return projected ? "DivideAndConquer<Projected>" : "DivideAndConquer";
  }
  static constexpr VariantKind kind = VariantKind::scan;
  static constexpr const char* citation = "Featherstone 1999, divide and conquer";
  static constexpr const char* equation = "mobilities of runs of bodies, joined two by two";
  template <class T>
  static constexpr bool supports = true;

  // Of other models there is nothing to be asked.
  template <class T>
  static bool applies(const Model<T>& model) {
    for (int k = 0; k < model.nv(); ++k) {
      const RigidBody<T>& body = model.joint(k).body;
      if (model.parent(k) != k - 1 || !(body.mass > T(0)) || !(body.moments.minCoeff() > T(0)))
        return false;
    }
    return true;
  }

  template <class T>
  struct Run {
    int first = 0, last = 0;  // bodies [first, last)
    int depth = 0;
    int inner = -1, outer = -1;  // runs that it is made of, joined at joint first of `outer`
    Matrix6<T> X11, X12, X22;
    Matrix6<T> S, V, W;  // of the joint between them
    Vector6<T> nu;
    T d;
    Vector6<T> y1, y2, beta, z_in, z_out;
  };

  template <class T>
  struct Workspace {
    std::vector<Run<T>> runs;  // the first is all, and every run comes before what it is made of
    Run<T> base;
    VectorX<T> unit, column;

    explicit Workspace(const Model<T>& model, scan::Order order = scan::Order::balanced)
        : unit(model.nv()), column(model.nv()) {
      runs.resize(1);
      runs[0].last = model.nv();
      for (std::size_t i = 0; i < runs.size(); ++i) {
        const int first = runs[i].first, last = runs[i].last;
        if (last - first == 1) continue;
        const int middle = order == scan::Order::balanced     ? (first + last) / 2
                           : order == scan::Order::tips_first ? first + 1
                                                              : last - 1;
        runs[i].inner = static_cast<int>(runs.size());
        runs[i].outer = runs[i].inner + 1;
        runs.resize(runs.size() + 2);
        Run<T>&inner = runs[runs[i].inner], &outer = runs[runs[i].outer];
        inner.first = first;
        inner.last = outer.first = middle;
        outer.last = last;
        inner.depth = outer.depth = runs[i].depth + 1;
      }
    }

    // Of joins, one after another.
    int depth() const { return runs.back().depth; }
  };

  template <class T>
  static Outcome factor(const Model<T>& model, const LinkKinematics<T>& kin, Workspace<T>& ws) {
    for (auto run = ws.runs.rbegin(); run != ws.runs.rend(); ++run) {
      if (run->inner < 0) {  // (2)
        const int k = run->first;
        run->X11 = model.M(k).matrix().llt().solve(Matrix6<T>::Identity());
        const bool tip = k + 1 == model.nv();
        const Matrix6<T> phi = tip ? Matrix6<T>(Matrix6<T>::Zero()) : kin.phi[k + 1].matrix();
        run->X12.noalias() = run->X11 * phi;
        run->X22.noalias() = phi.transpose() * run->X12;
        continue;
      }
      const Run<T>&A = ws.runs[run->inner], &B = ws.runs[run->outer];
      if (!join(model.joint(B.first), A.X22, B.X11, *run)) return failed(B.first);
      const Matrix6<T> AW = A.X12 * run->W;  // (5)
      run->X11 = A.X11 - AW * A.X12.transpose();
      run->X12.noalias() = AW * B.X12;
      run->X22 = B.X22 - B.X12.transpose() * run->W * B.X12;
    }
    return join(model.joint(0), Matrix6<T>(Matrix6<T>::Zero()), ws.runs[0].X11, ws.base)
               ? Outcome{}
               : failed(0);
  }

  // a (nv) from tau (nv), with the bias of kin, after factor.
  template <class T>
  static void acceleration(const Model<T>& model, const LinkKinematics<T>& kin,
                           const VectorX<T>& tau, Workspace<T>& ws, VectorX<T>& a) {
    pass_forces(
        model, kin, tau, [&](int k) { return kin.b[k]; }, [&](int k) { return kin.c[k]; },
        base_acceleration(model), ws, a);
  }

  // x = M^-1 tau, after factor: b, c and gravity are zero.
  template <class T>
  static void solve(const Model<T>& model, const LinkKinematics<T>& kin, const VectorX<T>& tau,
                    Workspace<T>& ws, VectorX<T>& x) {
    const Vector6<T> zero = Vector6<T>::Zero();
    const auto none = [&](int) { return zero; };
    pass_forces(model, kin, tau, none, none, zero, ws, x);
  }

  // M^-1 (nv x nv), both triangles, after factor: column by column, of which the lower part counts.
  template <class T>
  static void inverse(const Model<T>& model, const LinkKinematics<T>& kin, Workspace<T>& ws,
                      MatrixX<T>& X) {
    for (int j = 0; j < model.nv(); ++j) {
      ws.unit.setZero();
      ws.unit[j] = T(1);
      solve(model, kin, ws.unit, ws, ws.column);
      for (int i = j; i < model.nv(); ++i) X(i, j) = X(j, i) = ws.column[i];
    }
  }

 private:
  // (2) and (6) up the tree, (3) and (4) down it.
  template <class T, class Bias, class C>
  static void pass_forces(const Model<T>& model, const LinkKinematics<T>& kin,
                          const VectorX<T>& tau, const Bias& b, const C& c, const Vector6<T>& base,
                          Workspace<T>& ws, VectorX<T>& a) {
    for (auto run = ws.runs.rbegin(); run != ws.runs.rend(); ++run) {
      if (run->inner < 0) {  // (2)
        const int k = run->first;
        run->y1 = -(run->X11 * b(k));
        if (k + 1 < model.nv()) run->y2 = kin.phi[k + 1].motion_from_parent(run->y1);
        continue;
      }
      const Run<T>&A = ws.runs[run->inner], &B = ws.runs[run->outer];
      run->beta = A.y2 - B.y1 + c(B.first);
      const Vector6<T> f = run->W * run->beta + run->nu * tau[B.first];  // (6)
      run->y1 = A.y1 - A.X12 * f;
      run->y2 = B.y2 + B.X12.transpose() * f;
    }
    Run<T>& all = ws.runs[0];
    const Vector6<T> s = kin.phi[0].motion_from_parent(base) + c(0) - all.y1;
    all.z_in = pass(model.joint(0), s, tau[0], ws.base, a[0]);
    all.z_out.setZero();
    for (const Run<T>& run : ws.runs) {
      if (run.inner < 0) continue;
      Run<T>&A = ws.runs[run.inner], &B = ws.runs[run.outer];
      A.z_in = run.z_in;
      B.z_out = run.z_out;
      const Vector6<T> in = A.X12.transpose() * run.z_in + B.X12 * run.z_out + run.beta;
      A.z_out = B.z_in = pass(model.joint(B.first), in, tau[B.first], run, a[B.first]);
    }
  }

  static Outcome failed(int joint) {
    Outcome out;
    out.status = Outcome::Status::indefinite;
    out.joint = joint;
    return out;
  }

  // S, V, W, nu and d.
  template <class T>
  static bool join(const Joint<T>& joint, const Matrix6<T>& A22, const Matrix6<T>& B11,
                   Run<T>& run) {
    const int h = joint.axis();
    run.S = B11 + A22;
    if (projects(joint)) {
      // The axis exchanged with the last entry: T'S T is the leading block.
      Matrix6<T> S = run.S;
      S.row(h).swap(S.row(5));
      S.col(h).swap(S.col(5));
      const Eigen::LLT<Eigen::Matrix<T, 5, 5>> llt(S.template topLeftCorner<5, 5>());
      Matrix6<T> W = Matrix6<T>::Zero();
      W.template topLeftCorner<5, 5>() = llt.solve(Eigen::Matrix<T, 5, 5>::Identity());
      W.row(h).swap(W.row(5));
      W.col(h).swap(W.col(5));
      run.W = W;
      run.nu = Vector6<T>::Unit(h) - W * run.S.col(h);
      return llt.info() == Eigen::Success && W.allFinite();
    }
    const Eigen::LLT<Matrix6<T>> llt(run.S);
    run.V = llt.solve(Matrix6<T>::Identity());
    const Vector6<T> VH = run.V.col(h);
    run.d = VH[h] + joint.r;
    run.nu = VH / run.d;
    run.W = run.V - run.nu * VH.transpose();
    return llt.info() == Eigen::Success && run.d > T(0) && run.W.allFinite();
  }

  template <class T>
  static bool projects(const Joint<T>& joint) {
    return projected && joint.r == T(0);
  }

  // z by (3), a by (4).
  template <class T>
  static Vector6<T> pass(const Joint<T>& joint, const Vector6<T>& s, const T& tau,
                         const Run<T>& run, T& a) {
    const int h = joint.axis();
    const Vector6<T> z = run.W * s + run.nu * tau;
    a = projects(joint) ? T(run.S.row(h).dot(z) - s[h]) : T((tau - run.V.row(h).dot(s)) / run.d);
    return z;
  }
};

}  // namespace kalmarm
