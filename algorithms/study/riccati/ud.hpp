// Covariance update, UD factors: P = U diag(d) U' with U unit upper triangular, free of square
// roots.
//
// Time update (Thornton's weighted Gram-Schmidt, 1976). With rows A = [V'(k); U+'(c) phi'(k,c) …]
// and weights w = (J, m, m, m; d+(c) …), P- = A' diag(w) A. From the last column to the first:
//   d_j = a_j' w a_j,   U_ij = a_j' w a_i / d_j,   a_i <- a_i - U_ij a_j              for i < j
// Measurement update (Bierman, 1977). With f = U'H', v = diag(d) f, alpha = r, from the first entry
// to the last:
//   beta = alpha + f_j v_j,   d_j+ = d_j alpha / beta,
//   U_ij+ = U_ij - (f_j / alpha) s_i,   s_i <- s_i + v_j U_ij                        for i < j
// and alpha <- beta. At the end D = alpha (3.6) and g = s / D (3.10). Where alpha = 0 (no noise
// yet: r = 0 and f_j = 0 so far), d_j+ = 0 unless f_j = 0, and column j may stay as it is: 0/0 is
// never formed. With r = 0 and a unit row, HP+ = 0 means U_hj+ = 0 for j > h, which is set, not
// left to rounding. About 1400 flops a link.
#pragma once

#include <string>
#include <vector>

#include "algorithms/study/contacts/contact_row.hpp"
#include "algorithms/study/riccati/covariance_update.hpp"

namespace kalmarm {

struct UD : LinkFrames<UD> {
  static std::string name() { return "UD"; }
  static constexpr int resolution = 2;  // as for square roots: d is a sum of squares
  static constexpr bool exact_constraint = true;

  template <class T>
  struct Link {
    std::vector<T> storage;  // A, column by column, then w
    int rows = 0;            // that A can hold
    int filled = 0;          // rows that it holds
    Matrix6<T> U;            // U+ after the measurement
    Vector6<T> d;

    // Contacts may need more rows than there are. What is not filled has no weight.
    void append(const T& weight, const Vector6<T>& row) {
      if (filled == rows) {
        Link before = *this;
        rows += 6;
        storage.assign(7 * rows, T(0));
        A().topRows(filled) = before.A();
        w().head(filled) = before.w();
      }
      w()[filled] = weight;
      A().row(filled++) = row.transpose();
    }

    Eigen::Map<Eigen::Matrix<T, Eigen::Dynamic, 6>> A() { return {storage.data(), rows, 6}; }
    Eigen::Map<VectorX<T>> w() { return {storage.data() + 6 * rows, rows}; }
  };

  template <class T>
  struct Workspace {
    std::vector<Link<T>> links;
    VectorX<T> weighted_column;  // w a_j

    explicit Workspace(const Model<T>& model) : links(model.nv()) {
      int most = 0;
      for (int k = model.nv() - 1; k >= 0; --k) {
        Link<T>& link = links[k];
        link.rows += model.joint(k).body.massless() ? 0 : 6;
        link.storage.resize(7 * link.rows);
        most = std::max(most, link.rows);
        if (const int parent = model.parent(k); parent >= 0) links[parent].rows += 6;
      }
      weighted_column.resize(most);
    }
  };

  template <class T>
  static void set(int k, const LinkInertia<T>& inertia, Workspace<T>& ws) {
    Link<T>& link = ws.links[k];
    link.filled = inertia.massless ? 0 : 6;
    link.w().setZero();
    if (inertia.massless) return;
    link.A().template topRows<6>() = inertia.weighted.V.transpose();
    link.w().template head<6>() = inertia.weighted.w;
  }

  template <class T>
  static void add_contact(const ContactRow<T>& row, Workspace<T>& ws) {
    ws.links[row.link].append(row.d, row.e);
  }

  template <class T, class Row>
  static T update(int k, const Row& H, const T& r, Workspace<T>& ws, Vector6<T>& g) {
    Link<T>& link = ws.links[k];
    auto A = link.A();
    auto w = link.w();
    Matrix6<T>& U = link.U;
    Vector6<T>& d = link.d;

    // U, d of P-
    U.setIdentity();
    if (ws.weighted_column.size() < link.rows) ws.weighted_column.resize(link.rows);
    auto wa = ws.weighted_column.head(link.rows);
    for (int j = 5; j >= 0; --j) {
      wa = w.cwiseProduct(A.col(j));
      d[j] = wa.dot(A.col(j));
      if (!(d[j] > T(0))) continue;
      for (int i = 0; i < j; ++i) {
        U(i, j) = wa.dot(A.col(i)) / d[j];
        A.col(i) -= U(i, j) * A.col(j);
      }
    }

    // U, d of P+; s becomes P- H'
    const Vector6<T> f = column(Matrix6<T>(U.transpose()), H);
    Vector6<T> s = Vector6<T>::Zero();
    T alpha = r;
    for (int j = 0; j < 6; ++j) {
      const T v = d[j] * f[j];
      const T beta = alpha + f[j] * v;
      const T ratio = alpha > T(0) ? f[j] / alpha : T(0);
      if (beta > T(0)) d[j] *= alpha / beta;
      s[j] = v;
      for (int i = 0; i < j; ++i) {
        const T u = U(i, j);
        U(i, j) = u - ratio * s[i];
        s[i] += v * u;
      }
      alpha = beta;
    }
    if constexpr (std::is_same_v<Row, UnitRow>)
      if (r == T(0)) U.row(H.axis).tail(5 - H.axis).setZero();
    g = s / alpha;
    return alpha;
  }

  template <class T>
  static void add(int k, int parent, const Transform<T>& phi, Workspace<T>& ws) {
    const Link<T>& link = ws.links[k];
    Link<T>& to = ws.links[parent];
    for (int i = 0; i < 6; ++i)
      to.append(link.d[i], phi.force_to_parent(Vector6<T>(link.U.col(i))));
  }

  // P+(k) x = U diag(d) U' x.
  template <class T>
  static Vector6<T> P_plus_times(int k, const Vector6<T>& x, const Workspace<T>& ws) {
    const Link<T>& link = ws.links[k];
    return link.U * link.d.cwiseProduct(Vector6<T>(link.U.transpose() * x));
  }
};

}  // namespace kalmarm
