// Covariance update, P in two parts: what is inertia as it stands, contacts as rows beside it.
//
//   P = P0 + W'W,   P0 of M alone (conventional.hpp), a contact row sqrt(d) e' is a row of W       (R1)
// Contacts are never squared: d beside a link's inertia would push the inertia out of P's digits.
// At a joint, with U = P0 H', D0 = H U + r:
//   1. one reflection of the rows leaves a single one, w, with w_h = w H' other than zero         (R2)
//   2. D = D0 + w_h^2,   g = (U + w_h w) / D                                                      (R3)
//   3. P0+ = P0 - (U / D0) U',   w+ = sqrt(D0 / D) (w - (w_h / D0) U),   other rows as they are   (R4)
// exactly, since w+ w+' = w w' + U U' / D0 - (U + w_h w)(U + w_h w)' / D. To the parent P0 goes by the
// congruence and rows by phi; more than six are compressed to six by reflections. The error of H^-1 b
// grows as sqrt(d) u, that of P - g U' as d u, and that of rotations, Gram-Schmidt and UD not (docs/contacts.md).
//
// P0 and D0 are those of the robot without contacts, so that the test for singular mechanisms looks
// at them (factors.hpp): what contacts alone hold is refused.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "algorithms/study/contacts/contact_row.hpp"
#include "algorithms/study/riccati/array.hpp"
#include "algorithms/study/riccati/gains.hpp"

namespace kalmarm {

struct RowsBeside : LinkFrames<RowsBeside> {
  static std::string name() { return "RowsBeside"; }
  static constexpr int resolution = 1;
  static constexpr bool exact_constraint = true;

  template <class T>
  struct Workspace {
    std::vector<Matrix6<T>> P;      // P0
    std::vector<array::Rows<T>> W;  // of which the first `filled` count
    std::vector<int> filled;
    Gains<T> alone;  // D0, and U / D0
    array::Reduced<T> compressed;

    explicit Workspace(const Model<T>& model)
        : P(model.nv()),
          W(model.nv(), array::Rows<T>::Zero(6, array::width)),
          filled(model.nv()),
          alone(model, exact_constraint) {}
  };

  template <class T>
  static void set(int k, const LinkInertia<T>& inertia, Workspace<T>& ws) {
    ws.P[k] = inertia.M.matrix();
    ws.filled[k] = 0;
  }

  template <class T>
  static void add_contact(const ContactRow<T>& row, Workspace<T>& ws) {
    using std::sqrt;
    append(Vector6<T>(sqrt(row.d) * row.e), row.link, ws);
  }

  template <class T>
  static T update(int k, UnitRow H, const T& r, Workspace<T>& ws, Vector6<T>& g) {
    using std::sqrt;
    const int h = H.axis;
    array::Rows<T>& W = ws.W[k];
    int& m = ws.filled[k];
    if (m > 6) {
      array::Orthogonal<array::HouseholderStep>::compress(W, 0, m, -1, ws.compressed);
      m = ws.compressed.rows;
      W.topRows(m) = ws.compressed.A.topRows(m);
    }
    array::HouseholderStep::eliminate(W, 0, m, h);  // (R2)

    Matrix6<T>& P = ws.P[k];
    const Vector6<T> U = P.col(h);
    const T D0 = U[h] + r;
    ws.alone.D[k] = D0;
    ws.alone.g[k] = U / D0;
    P.noalias() -= ws.alone.g[k] * U.transpose();
    if (r == T(0)) {  // HP+ = 0
      P.row(h).setZero();
      P.col(h).setZero();
    }
    if (m == 0 || W(0, h) == T(0)) {
      g = ws.alone.g[k];
      return D0;
    }
    auto w = W.row(0).template head<6>();
    const T w_h = w[h], D = D0 + w_h * w_h;
    g = (U + w_h * w.transpose()) / D;                                   // (R3)
    w = T(sqrt(D0 / D)) * (w - w_h * ws.alone.g[k].transpose()).eval();  // (R4)
    if (r == T(0)) w[h] = T(0);
    return D;
  }

  template <class T>
  static void add(int k, int parent, const Transform<T>& phi, Workspace<T>& ws) {
    ws.P[parent] += phi.congruence(ws.P[k]);
    for (int i = 0; i < ws.filled[k]; ++i)
      append(phi.force_to_parent(Vector6<T>(ws.W[k].row(i).template head<6>())), parent, ws);
  }

  template <class T>
  static Vector6<T> P_plus_times(int k, const Vector6<T>& x, const Workspace<T>& ws) {
    const auto W = ws.W[k].topRows(ws.filled[k]).template leftCols<6>();
    return ws.P[k] * x + W.transpose() * (W * x);
  }

 private:
  template <class T>
  static void append(const Vector6<T>& row, int k, Workspace<T>& ws) {
    array::Rows<T>& W = ws.W[k];
    int& m = ws.filled[k];
    if (m == W.rows()) W.conservativeResize(2 * m, Eigen::NoChange);
    W.row(m).setZero();
    W.row(m++).template head<6>() = row.transpose();
  }
};

}  // namespace kalmarm
