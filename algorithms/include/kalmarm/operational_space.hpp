// The inertia that a robot shows to forces on its frames, Lambda = (J M^-1 J')^-1, with a verdict.
//
// X = J M^-1 J' is what Dynamics::operational gives, or chosen rows and columns of it. With
//   Y = S X S,  S(i) = (mean of X(j,j) over the rows j that are alike)^-1/2                   (1)
//   Y = V diag(w) V',  w rising
//   w'(i) = max(w(i), w_max / clamp) + damping                                               (2)
//   Lambda = S V diag(1/w') V' S                                                             (3)
// Rows that are alike have their unit in common: the three of a frame's turning, the three of its moving. So neither
// units nor the frames' axes matter to w, and w_max / w_min is a condition number. Without damping and clamp (3) is
// X^-1; with them forces stay bounded where the robot cannot move its frames in some direction, and do not bring the
// acceleration that was asked for there.
//
// Where X(i,j) may be wrong by eta sqrt(X(i,i) X(j,j)), Lambda(i,j) is by about
//   error sqrt(Lambda(i,i) Lambda(j,j)),  error = k eta / w'_min                             (4)
// for k rows. An error of 1 or more says nothing: X cannot be told from singular, and there is no answer.
//
// With M^-1 itself (Dynamics::inverse_mass) and any J, such as chosen rows of a frame's in aligned axes
// (kinematics.hpp), X is formed here, and there are
//   J^ = M^-1 J' Lambda,  the dynamically consistent inverse, J J^ = 1                       (5)
//   N = 1 - J^ J,  J N = 0: torques N' tau do not accelerate what J is of                    (6)
// Where M^-1(i,j) may be wrong by epsilon sqrt(M^-1(i,i) M^-1(j,j)), X is by (4)'s
//   eta = epsilon max over i of (sum over j of |J(i,j)| M^-1(j,j)^1/2)^2 / X(i,i)            (7)
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <span>

#include "kalmarm/export.hpp"
#include "kalmarm/outcome.hpp"
#include "kalmarm/views.hpp"

namespace kalmarm {

struct Regularisation {
  double damping = 0;                                      // of (2), beside 1
  double clamp = std::numeric_limits<double>::infinity();  // the largest condition number
};

// Each may be left out.
template <class View>
struct OperationalResults {
  View inertia = {};    // k x k: Lambda
  View inverse = {};    // n x k: J^ of (5)
  View projector = {};  // n x n: N of (6)
};

template <class T>
class KALMARM_EXPORT OperationalInertia {
 public:
  // Of X with so many rows, of which each so many that follow each other are alike. Throws std::invalid_argument
  // where rows are no multiple of these, damping is negative or clamp below 1.
  explicit OperationalInertia(int rows, const Regularisation& how = {}, int alike = 3);
  ~OperationalInertia();
  OperationalInertia(OperationalInertia&&) noexcept;
  OperationalInertia& operator=(OperationalInertia&&) noexcept;

  // Lambda (k x k) by (3), symmetric to the last bit. X is symmetric: of its columns what is below the diagonal
  // is read. error_of_X: eta of (4), that of X's own outcome where it has one; at least 4 u of T is taken. About
  // 25 k^3 flops in double.
  //
  // X may be Lambda. Outcome: `error` by (4); D is w_min and scale w_max; singular with `joint` the first of the
  // rows alike that no joint moves, -1 where there are none; not_finite. Lambda is then NaN. std::invalid_argument
  // where sizes are wrong.
  Outcome compute(MatrixView<const T> X, MatrixView<T> Lambda, double error_of_X = 0);

  // Of rows, each with a matrix; of_X: what Dynamics said of these, where it did: a row that failed fails here, and
  // one that warned warns. Returns how many failed; no row disturbs another.
  [[nodiscard]] int compute(RowsView<const T> X, RowsView<T> Lambda, std::span<Outcome> outcomes,
                            std::span<const Outcome> of_X = {});

  // Of M^-1 (n x n), whose lower triangle is read, and J' (n x k), with `error` that of M^-1's outcome as above:
  // by (5) to (7), 2 n^2 k + 2 n k^2 flops more, and n^2 k for N. The first call for so many n takes memory.
  Outcome compute(MatrixView<const T> inverse_mass, MatrixView<const T> Jt,
                  const OperationalResults<MatrixView<T>>& out, double error = 0);

  // Of rows, each with its own of all; of_inverse_mass: what Dynamics said of these.
  [[nodiscard]] int compute(RowsView<const T> inverse_mass, RowsView<const T> Jt,
                            const OperationalResults<std::optional<RowsView<T>>>& out,
                            std::span<Outcome> outcomes,
                            std::span<const Outcome> of_inverse_mass = {});

 private:
  struct Memory;

  // One state each; on failure results are NaN.
  Outcome of_X(const T* X, T* Lambda, const Outcome& given);
  Outcome of_J(int n, const T* inverse_mass, const T* Jt, const OperationalResults<T*>& out,
               const Outcome& given);
  Outcome invert(double error_of_X);

  int rows_, alike_;
  Regularisation how_;
  std::unique_ptr<Memory> memory_;
};

}  // namespace kalmarm
