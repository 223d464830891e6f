// Covariance updates that carry P as it stands.
//
//   P-(k) = M(k) + sum over children c of phi(k,c) P+(c) phi'(k,c)     (3.6), summed for a tree
//   D(k)  = H P- H' + r(k)                                             (3.6), with joint noise
//   g(k)  = P- H' / D                                                  (3.10)
// and then one of
//   Conventional  P+ = P- - g (P- H')'                                 (3.6)
//   Zeroed        the same, and HP+ = 0 set to the last bit where r = 0, as it is in exact
//                 arithmetic
//   Joseph        P+ = (I - gH) P- (I - gH)' + g r g'                  the same as a square
// P+ is formed as P - gU', not P - UU'/D: squaring U would halve the exponent range. P- is
// symmetric to the last bit, since phi P+ phi' is made so. About 400 flops a link; Joseph 480.
#pragma once

#include <string>
#include <vector>

#include "algorithms/study/contacts/contact_row.hpp"
#include "algorithms/study/riccati/covariance_update.hpp"

namespace kalmarm {

// What the three share: everything but P+.
template <class Form>
struct PlainCovariance : LinkFrames<PlainCovariance<Form>> {
  static std::string name() { return Form::name; }
  // D carries an absolute error of about u times the covariance that was subtracted on the way.
  static constexpr int resolution = 1;
  static constexpr bool exact_constraint = Form::exact_constraint;

  template <class T>
  struct Workspace {
    std::vector<Matrix6<T>> P;  // P- until the joint is measured, P+ after

    explicit Workspace(const Model<T>& model) : P(model.nv()) {}
  };

  template <class T>
  static void set(int k, const LinkInertia<T>& inertia, Workspace<T>& ws) {
    ws.P[k] = inertia.M.matrix();
  }

  template <class T>
  static void add_contact(const ContactRow<T>& row, Workspace<T>& ws) {
    ws.P[row.link] += Vector6<T>(row.d * row.e) * row.e.transpose();
  }

  template <class T, class Row>
  static T update(int k, const Row& H, const T& r, Workspace<T>& ws, Vector6<T>& g) {
    Matrix6<T>& P = ws.P[k];
    const Vector6<T> U = column(P, H);
    const T D = dot(H, U) + r;
    g = U / D;
    Form::subtract(H, U, g, r, P);
    return D;
  }

  template <class T>
  static void add(int k, int parent, const Transform<T>& phi, Workspace<T>& ws) {
    ws.P[parent] += phi.congruence(ws.P[k]);
  }

  template <class T>
  static Vector6<T> P_plus_times(int k, const Vector6<T>& x, const Workspace<T>& ws) {
    return ws.P[k] * x;
  }
};

struct ConventionalForm {
  static constexpr const char* name = "Conventional";
  static constexpr bool exact_constraint = false;

  template <class Row, class T>
  static void subtract(const Row&, const Vector6<T>& U, const Vector6<T>& g, const T&,
                       Matrix6<T>& P) {
    P.noalias() -= g * U.transpose();
  }
};

struct ZeroedForm {
  static constexpr const char* name = "Zeroed";
  static constexpr bool exact_constraint = true;

  // In other frames than the link's no row of P is zero, and this would be Conventional.
  template <class T>
  static void subtract(UnitRow H, const Vector6<T>& U, const Vector6<T>& g, const T& r,
                       Matrix6<T>& P) {
    P.noalias() -= g * U.transpose();
    if (r > T(0)) return;
    P.row(H.axis).setZero();
    P.col(H.axis).setZero();
  }
};

struct JosephForm {
  static constexpr const char* name = "Joseph";
  static constexpr bool exact_constraint = false;

  template <class Row, class T>
  static void subtract(const Row& H, const Vector6<T>&, const Vector6<T>& g, const T& r,
                       Matrix6<T>& P) {
    Matrix6<T> psi = Matrix6<T>::Identity();  // I - gH
    if constexpr (std::is_same_v<Row, UnitRow>)
      psi.col(H.axis) -= g;
    else
      psi -= g * H.transpose();
    P = psi * P * psi.transpose() + r * g * g.transpose();
  }
};

using Conventional = PlainCovariance<ConventionalForm>;
using Zeroed = PlainCovariance<ZeroedForm>;
using Joseph = PlainCovariance<JosephForm>;

}  // namespace kalmarm
