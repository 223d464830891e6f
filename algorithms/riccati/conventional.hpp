// Covariance update, conventional form: P as it stands.
//
//   P-(k) = M(k) + sum over children c of phi(k,c) P+(c) phi'(k,c)     (3.6), summed for a tree
//   D(k)  = H P- H' + r(k)                                             (3.6), with joint noise
//   g(k)  = P- H' / D                                                  (3.10)
//   P+(k) = P- - g (P- H')'                                            (3.6)
// P+ is formed as P - gU', not P - UU'/D: squaring U would halve the exponent range. P- is
// symmetric to the last bit, since phi P+ phi' is made so. About 400 flops a link.
#pragma once

#include <vector>

#include "algorithms/model/random_model.hpp"

namespace kalmarm {

struct Conventional {
  static constexpr const char* name = "Conventional";
  // D carries an absolute error of about u times the covariance that was subtracted on the way.
  static constexpr int resolution = 1;
  static constexpr bool exact_constraint = false;

  template <class T>
  struct Workspace {
    std::vector<Matrix6<T>> P;  // P- until the joint is measured, P+ after

    explicit Workspace(const Model<T>& model) : P(model.nv()) {}
  };

  template <class T>
  static void start(const Model<T>& model, Workspace<T>& ws) {
    for (int k = 0; k < model.nv(); ++k) ws.P[k] = model.M(k).matrix();
  }

  template <class T>
  static T measure(const Model<T>& model, int k, Workspace<T>& ws, Vector6<T>& g) {
    const Joint<T>& joint = model.joint(k);
    Matrix6<T>& P = ws.P[k];
    const Vector6<T> U = P.col(joint.axis());
    const T D = U[joint.axis()] + joint.r;
    g = U / D;
    P.noalias() -= g * U.transpose();
    return D;
  }

  template <class T>
  static void propagate(const Model<T>& model, int k, const Transform<T>& phi, Workspace<T>& ws) {
    ws.P[model.parent(k)] += phi.congruence(ws.P[k]);
  }

  // P+(k) x.
  template <class T>
  static Vector6<T> P_plus_times(int k, const Vector6<T>& x, const Workspace<T>& ws) {
    return ws.P[k] * x;
  }
};

}  // namespace kalmarm
