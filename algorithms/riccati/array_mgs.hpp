// Covariance update, square-root array by modified Gram-Schmidt: P = A'A is never formed.
//
// The rows of A are the link's physical noise sources, W'(k), and those left over from its
// children:
//   A-(k) = [W'(k); A+(c) phi'(k,c) for every child c],      P- = A-'A-  (3.6)
//   D(k)  = a_h'a_h + r,   g(k) = A-' a_h / D                a_h: column of A- at the joint's axis
//   [0; A-] <- [0; A-] - [sqrt r; a_h] g'                    (3.6): now P+ = A'A
//   A+(k) = R of the Gram-Schmidt QR of what is left: 5 rows (r = 0) or 6
// With r = 0 column h is zero from then on: HP+ = 0 exactly.
// Gram-Schmidt works row by row: the rounding error of a row is relative to that row, so that heavy
// links do not spoil light ones. About 1300 flops a link.
#pragma once

#include <vector>

#include "algorithms/model/random_model.hpp"

namespace kalmarm {

struct ArrayMGS {
  static constexpr const char* name = "ArrayMGS";
  // D is a sum of squares of entries with an error of u: zero shows as u^2.
  static constexpr int resolution = 2;
  static constexpr bool exact_constraint = true;

  template <class T>
  struct Link {
    std::vector<T> storage;  // A-, column by column
    int rows = 0;            // that A- can hold
    int filled = 0;          // rows that it holds
    Matrix6<T> W_plus;       // P+ = W_plus W_plus': rows of A+ as columns
    int columns = 0;         // of W_plus in use

    Eigen::Map<Eigen::Matrix<T, Eigen::Dynamic, 6>> A() { return {storage.data(), rows, 6}; }
  };

  template <class T>
  struct Workspace {
    std::vector<Link<T>> links;

    explicit Workspace(const Model<T>& model) : links(model.nv()) {
      for (int k = model.nv() - 1; k >= 0; --k) {
        const Joint<T>& joint = model.joint(k);
        Link<T>& link = links[k];
        link.columns = joint.r > T(0) ? 6 : 5;
        link.rows += (joint.body.massless() ? 0 : 6) + (joint.r > T(0) ? 1 : 0);
        link.storage.resize(6 * link.rows);
        if (joint.parent >= 0) links[joint.parent].rows += link.columns;
      }
    }
  };

  template <class T>
  static void start(const Model<T>& model, Workspace<T>& ws) {
    for (int k = 0; k < model.nv(); ++k) {
      Link<T>& link = ws.links[k];
      link.filled = 0;
      if (model.joint(k).body.massless()) continue;
      link.A().template topRows<6>() = model.W(k).transpose();
      link.filled = 6;
    }
  }

  template <class T>
  static T measure(const Model<T>& model, int k, Workspace<T>& ws, Vector6<T>& g) {
    using std::sqrt;
    const Joint<T>& joint = model.joint(k);
    const int h = joint.axis();
    Link<T>& link = ws.links[k];
    auto A = link.A();

    // innovation and gain
    const bool noisy = joint.r > T(0);
    if (noisy) A.row(link.filled).setZero();
    const T d = A.col(h).squaredNorm();
    const T D = d + joint.r;
    for (int j = 0; j < 6; ++j) g[j] = j == h ? d / D : A.col(h).dot(A.col(j)) / D;

    // A <- A - a_h g', with the noise as one more row
    for (int j = 0; j < 6; ++j)
      if (j != h) A.col(j) -= g[j] * A.col(h);
    if (noisy) {
      A.col(h) *= joint.r / D;
      A.row(link.filled) = -sqrt(joint.r) * g.transpose();
    }

    // A+ = R, one row after another
    link.W_plus.setZero();
    int row = 0;
    for (int j = 0; j < 6; ++j) {
      if (j == h && !noisy) continue;
      if (const T norm = A.col(j).norm(); norm > T(0)) {
        A.col(j) /= norm;
        link.W_plus(j, row) = norm;
        for (int i = j + 1; i < 6; ++i) {
          if (i == h && !noisy) continue;
          const T x = A.col(j).dot(A.col(i));
          A.col(i) -= x * A.col(j);
          link.W_plus(i, row) = x;
        }
      }
      ++row;
    }
    return D;
  }

  template <class T>
  static void propagate(const Model<T>& model, int k, const Transform<T>& phi, Workspace<T>& ws) {
    const Link<T>& link = ws.links[k];
    Link<T>& parent = ws.links[model.parent(k)];
    auto A = parent.A();
    for (int i = 0; i < link.columns; ++i)
      A.row(parent.filled++) = phi.force_to_parent(Vector6<T>(link.W_plus.col(i))).transpose();
  }

  // P+(k) x = W+ W+' x.
  template <class T>
  static Vector6<T> P_plus_times(int k, const Vector6<T>& x, const Workspace<T>& ws) {
    const Matrix6<T>& W = ws.links[k].W_plus;
    return W * Vector6<T>(W.transpose() * x);
  }
};

}  // namespace kalmarm
