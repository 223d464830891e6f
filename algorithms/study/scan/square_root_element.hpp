// The element of a block (covariance_element.hpp) in square roots, after Yaghoobi, Corenflos, Hassan
// and Särkkä (2022) and Gargir and Toledo (2025): C = U'U and J = Z'Z are never formed.
//
// U is what the array form of the filter leaves at the block's root, A+ of array.hpp; Z gains a row
// n(k) / sqrt D°(k) a link, and rotations keep it at 6 rows. With x whitened by
//   [V]_F = R^-T V,   R'R = 1 + F'F by rotations of [F; 1]                                (1)
// the covariance that comes in, X = Y'Y, goes out as the rows
//   [Y A']_F  and  U,   F = Z Y'                     of P+(m) = C + A X (I + J X)^-1 A'   (2)
// and two elements, 1 outboard of 2, combine with F = Z2 U1' as
//   A = A2 (A1 - [U1]_F' [F']_F Z2 A1),   U by (2) of X = C1,   Z: [Z2 A1]_F' and Z1      (3)
// where 1 + F'F has no eigenvalue below 1, and a heavy body, a long column of F, spoils no other.
// Rows are compressed to 6 by rotations. Where the filter has HP+ = 0 to the last bit, so have (2)
// and (3).
#pragma once

#include <string>

#include "algorithms/study/riccati/array.hpp"
#include "algorithms/study/scan/covariance_element.hpp"

namespace kalmarm::scan {

// Rows of a square root, first `count` of them.
template <class T>
struct RootRows {
  Eigen::Matrix<T, 12, 6, Eigen::RowMajor> rows;
  int count = 0;

  Matrix6<T> square() const { return rows.topRows(count).transpose() * rows.topRows(count); }

  void append(const Eigen::Matrix<T, 1, 6>& row) { rows.row(count++) = row; }

  // At most 6 rows of the same square.
  void compress() {
    int t = 0;
    for (int j = 0; j < 6 && t < count; ++j) {
      array::GivensStep::eliminate(rows, t, count, j);
      if (rows(t, j) != T(0)) ++t;
    }
    count = t;
  }
};

struct SquareRoot {
  using Update = ArrayGivens;
  static std::string name() { return "SquareRoot"; }

  template <class T>
  using Covariance = RootRows<T>;

  template <class T>
  struct Element {
    bool closed = true;  // A = 0
    Matrix6<T> A;
    RootRows<T> U, Z;
  };

  template <class T>
  static Matrix6<T> covariance(const Element<T>& e) {
    return e.U.square();
  }
  template <class T>
  static Matrix6<T> information(const Element<T>& e) {
    return e.Z.square();
  }

  template <class T>
  static void begin_information(Element<T>& e) {
    e.Z.count = 0;
  }

  template <class T>
  static void add_information(const Vector6<T>& n, const T& D, Element<T>& e) {
    using std::sqrt;
    e.Z.append((n / T(sqrt(D))).transpose());
    e.Z.compress();
  }

  template <class T>
  static void set_covariance(int k, const typename Update::Workspace<T>& ws, Element<T>& e) {
    const array::Reduced<T>& plus = ws.links[k].plus;
    e.U.count = plus.rows;
    e.U.rows.topRows(plus.rows) = plus.A.topRows(plus.rows).template leftCols<6>();
  }

  // Rows of phi X phi'.
  template <class T>
  static void add(const RootRows<T>& X, int k, const Transform<T>& phi,
                  typename Update::Workspace<T>& ws) {
    auto& to = ws.links[k];
    for (int i = 0; i < X.count; ++i) {
      auto row = to.A.row(to.filled++);
      row.setZero();
      row.template head<6>() =
          phi.force_to_parent(Vector6<T>(X.rows.row(i).transpose())).transpose();
    }
  }

  // (2).
  template <class T>
  static void apply(const Element<T>& e, const RootRows<T>& X, RootRows<T>& out) {
    out.count = 0;
    if (!e.closed) {
      const Small<T> Y = X.rows.topRows(X.count);
      Small<T> V = Y * e.A.transpose();
      whiten(Small<T>(e.Z.rows.topRows(e.Z.count) * Y.transpose()), V);
      for (int i = 0; i < V.rows(); ++i) out.append(V.row(i));
    }
    for (int i = 0; i < e.U.count; ++i) out.append(e.U.rows.row(i));
    out.compress();
  }

  // (3).
  template <class T>
  static void combine(const Element<T>& outer, const Element<T>& inner, Element<T>& out) {
    out.closed = outer.closed || inner.closed;
    apply(inner, outer.U, out.U);
    if (out.closed) return;
    const Small<T> Z2 = inner.Z.rows.topRows(inner.Z.count);
    const Small<T> U1 = outer.U.rows.topRows(outer.U.count);
    const Small<T> F = Z2 * U1.transpose(), ZA = Z2 * outer.A;
    Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, 6, 12> V(U1.rows(),
                                                                               6 + Z2.rows());
    V << U1, F.transpose();
    whiten(F, V);
    out.A.noalias() =
        inner.A * (outer.A - V.template leftCols<6>().transpose() * (V.rightCols(Z2.rows()) * ZA));
    Small<T> W = ZA;
    whiten(Small<T>(F.transpose()), W);
    out.Z.count = 0;
    for (int i = 0; i < W.rows(); ++i) out.Z.append(W.row(i));
    for (int i = 0; i < outer.Z.count; ++i) out.Z.append(outer.Z.rows.row(i));
    out.Z.compress();
  }

 private:
  template <class T>
  using Small = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, 6, 6>;

  // V <- [V]_F.
  template <class T, class Rows>
  static void whiten(const Small<T>& F, Rows& V) {
    const auto n = static_cast<int>(F.cols()), m = static_cast<int>(F.rows());
    Eigen::Matrix<T, 12, 6, Eigen::RowMajor> R = Eigen::Matrix<T, 12, 6, Eigen::RowMajor>::Zero();
    R.topLeftCorner(m, n) = F;
    R.block(m, 0, n, n).setIdentity();
    for (int j = 0; j < n; ++j) array::GivensStep::eliminate(R, j, m + n, j);
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < i; ++j) V.row(i) -= T(R(j, i)) * V.row(j);
      V.row(i) /= T(R(i, i));
    }
  }
};

}  // namespace kalmarm::scan
