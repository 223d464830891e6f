// Covariance updates in square-root array form: P = A'A is never formed.
//
// The rows of A are the link's physical noise sources, W'(k), and those left over from its
// children. One orthogonal transformation does the measurement and the compression (Kaminski,
// Bryson and Schmidt, 1971, for a tree; y = A H' is a column of A where H is a unit row):
//   A-(k) = [W'(k); A+(c) phi'(k,c) for every child c],   P- = A-'A-                     (3.6)
//   Q' [sqrt r  0 ]   [sqrt D   sqrt D g']
//      [   y    A-] = [   0        A+    ]                D, g, A+: (3.6), (3.10)
// A+(k) has at most 5 rows where r = 0, else 6. With r = 0 and a unit row, its column h is exactly
// zero: HP+ = 0. Q is made by
//   ArrayMGS          modified Gram-Schmidt. Row by row a_i <- a_i - (y_i / D) sum_j y_j a_j;
//                     the rounding error of a row is relative to that row: heavy links do not
//                     spoil light ones
//   ArrayGivens       rotations of two rows at a time, which leave exact zeros
//   ArrayHouseholder  reflections; a row's error is relative to the largest row
//   ArrayPivoted      the same, largest entry of the column first, largest column first
//                     (Powell and Reid, 1969)
//   Potter            reflections compress A-, then A+ = A- - y g' / (1 + sqrt(r / D))
//                     (Potter, 1963)
//
// The bias can be carried in the same form (WithBias). With b(k) = W zeta(k),
//   zeta(k) = (((J3 - J2) / sqrt J1) w2 w3, ... cyclic;  sqrt m (w x v_c))     w in principal axes
// in which no mass appears but under a root, since |J3 - J2| <= J1, the transformation takes zeta
// as one more column to (y0; zeta+), and across the joint z- = A-'zeta- becomes
//   sqrt D g y0 + A+'zeta+,   where zeta+ <- zeta+ + A+ c(k) adds P+ c               (4.5)
// About 1300 flops a link, rotations 1500.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "algorithms/study/contacts/contact_row.hpp"
#include "algorithms/study/riccati/covariance_update.hpp"

namespace kalmarm {
namespace array {

// Columns of an array: A, zeta, y.
inline constexpr int zeta = 6, y = 7, width = 8;

template <class T>
using Row = Eigen::Matrix<T, 1, width>;
template <class T>
using Rows = Eigen::Matrix<T, Eigen::Dynamic, width, Eigen::RowMajor>;

// What a method leaves: D, the first row over sqrt D, and A+.
template <class T>
struct Reduced {
  T D = T(0);
  Row<T> lead = Row<T>::Zero();  // (g', y0 / sqrt D, .)
  Eigen::Matrix<T, 6, width, Eigen::RowMajor> A;
  int rows = 0;  // of A
};

// Input: rows [0, m) of A, whose column c is y. skip: the column of A that vanishes, or -1.
struct MGS {
  static constexpr const char* name = "ArrayMGS";
  static constexpr bool noise_is_a_row = false;  // sqrt r enters as a number
  static constexpr bool exact_zeros = true;

  template <class T>
  static void reduce(Rows<T>& A, int m, int c, int h, const T& r, int skip, Reduced<T>& out) {
    using std::sqrt;
    out.D = A.col(c).head(m).squaredNorm() + r;
    const T root = sqrt(out.D);
    const Row<T> sum = subtract(A, m, c, root);
    out.lead = sum / root;
    if (c == h)  // a - a (1 - r / D) without cancellation
      for (int i = 0; i < m; ++i) A(i, h) *= r / out.D;
    if (r > T(0)) A.row(m++) = -sqrt(r) * out.lead;

    out.rows = 0;
    for (int j = 0; j < 6; ++j) {
      if (j == skip) continue;
      const T norm = A.col(j).head(m).norm();
      if (!(norm > T(0))) continue;
      out.A.row(out.rows++) = subtract(A, m, j, norm);
      A.col(j).head(m).setZero();
    }
  }

 private:
  // With q = a_j / norm, returns q'A and takes q (q'A) from all columns but j. Where there is one
  // row alone q is +-1, and zeros come out exact.
  template <class T>
  static Row<T> subtract(Rows<T>& A, int m, int j, const T& norm) {
    Row<T> sum = Row<T>::Zero();
    for (int i = 0; i < m; ++i) sum += T(A(i, j) / norm) * A.row(i);
    for (int i = 0; i < m; ++i) {
      const T a = A(i, j);
      A.row(i) -= T(a / norm) * sum;
      A(i, j) = a;
    }
    return sum;
  }
};

// Step makes column j zero below row t, by rows [t, m).
template <class Step>
struct Orthogonal {
  static constexpr const char* name = Step::name;
  static constexpr bool noise_is_a_row = true;
  static constexpr bool exact_zeros = true;

  template <class T>
  static void reduce(Rows<T>& A, int m, int c, int, const T&, int skip, Reduced<T>& out) {
    Step::eliminate(A, 0, m, c);
    out.D = m > 0 ? T(A(0, c) * A(0, c)) : T(0);
    if (m > 0) out.lead = A.row(0) / T(A(0, c));
    compress(A, m > 0 ? 1 : 0, m, skip, out);
  }

  // A <- R, from row t on.
  template <class T>
  static void compress(Rows<T>& A, int t, int m, int skip, Reduced<T>& out) {
    out.rows = 0;
    unsigned left = 0x3f & ~(skip < 0 ? 0u : 1u << skip);
    while (left && t < m) {
      const int j = Step::next_column(A, t, m, left);
      left &= ~(1u << j);
      Step::eliminate(A, t, m, j);
      if (A(t, j) == T(0)) continue;
      out.A.row(out.rows++) = A.row(t++);
    }
  }
};

struct FirstColumn {
  template <class T>
  static int next_column(const Rows<T>&, int, int, unsigned left) {
    return __builtin_ctz(left);
  }
};

struct GivensStep : FirstColumn {
  static constexpr const char* name = "ArrayGivens";

  // Of any matrix, by rows.
  template <class Matrix>
  static void eliminate(Matrix& A, int t, int m, int j) {
    using std::sqrt;
    using T = typename Matrix::Scalar;
    using Row = Eigen::Matrix<T, 1, Matrix::ColsAtCompileTime>;
    for (int i = t + 1; i < m; ++i) {
      if (A(i, j) == T(0)) continue;
      const T a = A(t, j), b = A(i, j), length = sqrt(a * a + b * b);
      const T c = length > T(0) ? T(a / length) : T(1), s = length > T(0) ? T(b / length) : T(0);
      const Row top = A.row(t), bottom = A.row(i);
      A.row(t) = c * top + s * bottom;
      A.row(i) = c * bottom - s * top;
      A(t, j) = length;
      A(i, j) = T(0);
    }
  }
};

// x where s is positive, else -x.
template <class T>
T with_sign(const T& x, const T& s) {
  return s > T(0) ? x : T(-x);
}

struct HouseholderStep : FirstColumn {
  static constexpr const char* name = "ArrayHouseholder";

  template <class T>
  static void eliminate(Rows<T>& A, int t, int m, int j) {
    using std::abs;
    if (m - t < 2) return;
    const T norm = A.col(j).segment(t, m - t).norm();
    if (!(norm > T(0))) return;
    const T pivot = A(t, j), alpha = with_sign(T(-norm), pivot);
    A(t, j) = pivot - alpha;  // column j holds the reflection's vector v while it acts
    Row<T> sum = Row<T>::Zero();
    for (int i = t; i < m; ++i) sum += A(i, j) * A.row(i);
    sum /= T(norm * (norm + abs(pivot)));  // v'v / 2
    for (int i = t; i < m; ++i) A.row(i) -= T(A(i, j)) * sum;
    A(t, j) = alpha;
    A.col(j).segment(t + 1, m - t - 1).setZero();
  }
};

struct PivotedStep {
  static constexpr const char* name = "ArrayPivoted";

  template <class T>
  static int next_column(const Rows<T>& A, int t, int m, unsigned left) {
    int best = __builtin_ctz(left);
    T most = T(-1);
    for (unsigned rest = left; rest; rest &= rest - 1) {
      const int j = __builtin_ctz(rest);
      const T size = A.col(j).segment(t, m - t).squaredNorm();
      if (size > most) most = size, best = j;
    }
    return best;
  }

  template <class T>
  static void eliminate(Rows<T>& A, int t, int m, int j) {
    if (m - t < 2) return;
    Eigen::Index row = 0;
    A.col(j).segment(t, m - t).cwiseAbs().maxCoeff(&row);
    A.row(t).swap(A.row(t + row));
    HouseholderStep::eliminate(A, t, m, j);
  }
};

struct PotterUpdate {
  static constexpr const char* name = "Potter";
  static constexpr bool noise_is_a_row = false;
  static constexpr bool exact_zeros = false;

  template <class T>
  static void reduce(Rows<T>& A, int m, int c, int, const T& r, int, Reduced<T>& out) {
    using std::sqrt;
    Orthogonal<HouseholderStep>::compress(A, 0, m, -1, out);
    Row<T> sum = Row<T>::Zero();  // f'A, f = A H': column c
    for (int i = 0; i < out.rows; ++i) sum += T(out.A(i, c)) * out.A.row(i);
    out.D = sum[c] + r;
    out.lead = sum / out.D;
    const T gamma = T(1) / (T(1) + T(sqrt(T(r / out.D))));
    for (int i = 0; i < out.rows; ++i) out.A.row(i) -= T(gamma * out.A(i, c)) * out.lead;
  }
};

}  // namespace array

template <class Method, bool with_bias = false>
struct Array : LinkFrames<Array<Method, with_bias>> {
  static std::string name() { return Method::name; }
  // D is a sum of squares of entries with an error of u: zero shows as u^2.
  static constexpr int resolution = 2;
  static constexpr bool exact_constraint = Method::exact_zeros;

  template <class T>
  struct Link {
    array::Rows<T> A;  // A-, what is left of it after the measurement is scratch
    int filled = 0;    // rows that it holds
    array::Reduced<T> plus;

    // Contacts may need more than there are; one stays free for the noise.
    auto append() {
      if (filled + 1 == A.rows()) A.conservativeResize(filled + 7, Eigen::NoChange);
      return A.row(filled++);
    }
  };

  template <class T>
  struct Workspace {
    std::vector<Link<T>> links;

    explicit Workspace(const Model<T>& model) : links(model.nv()) {
      std::vector<int> rows(model.nv(), 0);
      for (int k = model.nv() - 1; k >= 0; --k) {
        const Joint<T>& joint = model.joint(k);
        rows[k] += joint.body.massless() ? 0 : 6;
        links[k].A.resize(rows[k] + 1, array::width);  // and one for the noise
        if (joint.parent >= 0) rows[joint.parent] += 6;
      }
    }
  };

  template <class T>
  static void start(const Model<T>& model, const LinkKinematics<T>& kin, Workspace<T>& ws) {
    LinkFrames<Array>::start(model, kin, ws);
    if constexpr (with_bias)
      for (int k = 0; k < model.nv(); ++k) set_bias(model, k, kin.v[k], ws.links[k]);
  }

  template <class T>
  static void propagate(const Model<T>& model, const LinkKinematics<T>& kin, int k,
                        Workspace<T>& ws) {
    if constexpr (with_bias) {
      auto A = ws.links[k].plus.A.topRows(ws.links[k].plus.rows);
      A.col(array::zeta) += A.template leftCols<6>() * kin.c[k];
    }
    LinkFrames<Array>::propagate(model, kin, k, ws);
  }

  template <class T>
  static void set(int k, const LinkInertia<T>& inertia, Workspace<T>& ws) {
    Link<T>& link = ws.links[k];
    link.filled = inertia.massless ? 0 : 6;
    if (inertia.massless) return;
    link.A.template topRows<6>().setZero();
    link.A.template topLeftCorner<6, 6>() = inertia.W.transpose();
  }

  template <class T>
  static void add_contact(const ContactRow<T>& row, Workspace<T>& ws) {
    using std::sqrt;
    auto to = ws.links[row.link].append();
    to.setZero();
    to.template head<6>() = sqrt(row.d) * row.e.transpose();
  }

  template <class T, class HRow>
  static T update(int k, const HRow& H, const T& r, Workspace<T>& ws, Vector6<T>& g) {
    using std::sqrt;
    constexpr bool unit_row = std::is_same_v<HRow, UnitRow>;
    Link<T>& link = ws.links[k];
    const bool noise_row = r > T(0) && Method::noise_is_a_row;
    int h = -1, c = array::y, m = link.filled;
    if constexpr (unit_row) h = H.axis;
    if (unit_row && !noise_row)
      c = h;
    else
      for (int i = 0; i < m; ++i)
        link.A(i, c) = dot(H, Vector6<T>(link.A.row(i).template head<6>()));
    if (noise_row) {
      link.A.row(m).setZero();
      link.A(m++, c) = sqrt(r);
    }
    Method::reduce(link.A, m, c, h, r, r > T(0) ? -1 : h, link.plus);
    g = link.plus.lead.template head<6>();
    return link.plus.D;
  }

  template <class T>
  static void add(int k, int parent, const Transform<T>& phi, Workspace<T>& ws) {
    const array::Reduced<T>& plus = ws.links[k].plus;
    Link<T>& to = ws.links[parent];
    for (int i = 0; i < plus.rows; ++i) {
      auto row = to.append();
      row.template head<6>() =
          phi.force_to_parent(Vector6<T>(plus.A.row(i).template head<6>())).transpose();
      row[array::zeta] = plus.A(i, array::zeta);
      row[array::y] = T(0);
    }
  }

  // P+(k) x = A+'A+ x.
  template <class T>
  static Vector6<T> P_plus_times(int k, const Vector6<T>& x, const Workspace<T>& ws) {
    const array::Reduced<T>& plus = ws.links[k].plus;
    Vector6<T> out = Vector6<T>::Zero();
    for (int i = 0; i < plus.rows; ++i) {
      const Vector6<T> row = plus.A.row(i).template head<6>();
      out += row * row.dot(x);
    }
    return out;
  }

  // y0 / sqrt D of joint k: what the bias of its outboard side adds to e+.
  template <class T>
  static const T& bias_innovation(int k, const Workspace<T>& ws) {
    return ws.links[k].plus.lead[array::zeta];
  }

 private:
  template <class T>
  static void set_bias(const Model<T>& model, int k, const Vector6<T>& v, Link<T>& link) {
    using std::sqrt;
    if (model.inertia(k).massless) return;
    const RigidBody<T>& body = model.joint(k).body;
    const Vector3<T> w = v.template head<3>();
    const Vector3<T> principal =
        model.inertia(k).weighted.V.template topLeftCorner<3, 3>().transpose() * w;
    const Vector3<T>& J = body.moments;
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      const T difference = J[l] - J[j];  // zero where J(i) is, by the triangle inequality
      link.A(i, array::zeta) =
          J[i] > T(0) ? T(difference / sqrt(J[i]) * principal[j] * principal[l]) : T(0);
    }
    const Vector3<T> v_c = v.template tail<3>() + w.cross(body.com);
    link.A.col(array::zeta).template segment<3>(3) = sqrt(body.mass) * w.cross(v_c);
  }
};

using ArrayMGS = Array<array::MGS>;
using ArrayGivens = Array<array::Orthogonal<array::GivensStep>>;
using ArrayHouseholder = Array<array::Orthogonal<array::HouseholderStep>>;
using ArrayPivoted = Array<array::Orthogonal<array::PivotedStep>>;
using Potter = Array<array::PotterUpdate>;

// The same update with the bias in its array.
template <class Update>
struct WithBiasOf;
template <class Method>
struct WithBiasOf<Array<Method>> {
  using type = Array<Method, true>;
};
template <class Update>
using WithBias = typename WithBiasOf<Update>::type;

}  // namespace kalmarm
