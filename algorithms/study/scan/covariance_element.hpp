// What a block of links does to the filter, as an element of an associative operation, after
// Särkkä and García-Fernández (2021), for a noise-free robot.
//
// A block is a run of links c-1 … m of a path, with what hangs on it; its root is m, c is the next
// joint outboard, and z+(c) = x the force that comes in there, of any covariance X = P+(c). With
// D°, g°, P° the filter of the block alone, (3.6) and (3.10) begun with X = 0, and psi the closed
// loop of those gains, psi(k+,c+) = (I - gH) phi(k,.) ... (I - gH) phi(.,c):
//   n(k) = H(k) psi(k-,c+)                        for the links k of the path              (1)
//   A = psi(m+,c+),   C = P°+(m),   J = sum over k of n(k)' n(k) / D°(k)                   (2)
//   P+(m) = C + A X (I + J X)^-1 A'                                                        (3)
// Proof. x is independent of the links' own noise. Where x is known the block's filter is the one
// with X = 0; it leaves z+(m) = A x + an error of covariance C, and innovations e°(k) - n(k) x that
// are white, of variance D°(k), and independent of that error. So the block measures x with
// information J: x has the covariance (X^-1 + J)^-1 = X (I + J X)^-1 then, and (3) follows. No step
// asks for joint noise. C and J are the P and, of the block's own gains, the Lambda of the paper.
//
// Where r = 0 a measurement is exact, and 1/D° is all that can be infinite: (A, C, J) exists if no
// D°(k) is zero. The recursion begins with X = 0, so a massless link at the block's tip would have
// D° = 0 in a mechanism that is regular. Hence a cut is made only where the block's tip has a body
// with M > 0 (blocks.hpp), and then
//   D°(k) = 0 in the block   =>   the whole mechanism is singular                          (4)
// Proof. D° = 0 says that some q' of the block's joints moves neither mass nor rotor of the block
// while its base stands still. The tip's body moves in no direction then, since M > 0; so with all
// joints outboard at rest nothing outboard moves either, and q' is in the null space of M.
//
// Two elements, 1 outboard of 2, are one:
//   A = A2 F^-1 A1,   C = A2 F^-1 C1 A2' + C2,   J = J1 + A1' J2 F^-1 A1,   F = I + C1 J2  (5)
// which is associative, since composition of (3) is; (3) itself is (5) with A1 = 0, C1 = X.
//
// An outermost block has no x: A = 0, and J is void. Nor has one that forgets x: A contracts along
// most chains, and where no entry is above u^4 it is zero, as if the block were the outermost. What
// is left out of P+ is u^8 X then, and u^4 x of forces.
#pragma once

#include <Eigen/LU>
#include <string>

#include "algorithms/study/riccati/conventional.hpp"

namespace kalmarm::scan {

// u^4.
template <class T>
T negligible() {
  const T u = unit_roundoff<T>();
  return u * u * u * u;
}

template <class T>
bool forgotten(const Matrix6<T>& A) {
  return A.cwiseAbs().maxCoeff() <= negligible<T>();
}

// A <- (I - gH) A, and n = H A of before. Where g(h) = 1 its row h becomes zero to the last bit.
template <class T>
Vector6<T> measure_transition(int h, const Vector6<T>& g, Matrix6<T>& A) {
  const Vector6<T> n = A.row(h);
  A.noalias() -= g * n.transpose();
  return n;
}

// A <- phi A.
template <class T>
void propagate_transition(const Transform<T>& phi, Matrix6<T>& A) {
  for (int j = 0; j < 6; ++j) A.col(j) = phi.force_to_parent(Vector6<T>(A.col(j)));
}

// C and J as they stand, (5) by elimination.
struct Conventional {
  using Update = kalmarm::Conventional;
  static std::string name() { return "Conventional"; }

  template <class T>
  using Covariance = Matrix6<T>;  // P+

  template <class T>
  struct Element {
    bool closed = true;  // A = 0
    Matrix6<T> A, C, J;
  };

  template <class T>
  static void begin_information(Element<T>& e) {
    e.J.setZero();
  }

  template <class T>
  static void add_information(const Vector6<T>& n, const T& D, Element<T>& e) {
    e.J.noalias() += Vector6<T>(n / D) * n.transpose();
  }

  template <class T>
  static void set_covariance(int k, const typename Update::Workspace<T>& ws, Element<T>& e) {
    e.C = ws.P[k];
  }

  // P-(k) += phi X phi'.
  template <class T>
  static void add(const Matrix6<T>& X, int k, const Transform<T>& phi,
                  typename Update::Workspace<T>& ws) {
    ws.P[k] += phi.congruence(X);
  }

  template <class T>
  static const Matrix6<T>& covariance(const Element<T>& e) {
    return e.C;
  }
  template <class T>
  static const Matrix6<T>& information(const Element<T>& e) {
    return e.J;
  }

  // (3).
  template <class T>
  static void apply(const Element<T>& e, const Matrix6<T>& X, Matrix6<T>& out) {
    if (e.closed) {
      out = e.C;
      return;
    }
    const Matrix6<T> F = Matrix6<T>::Identity() + X * e.J;
    out = e.C + e.A * F.partialPivLu().solve(X) * e.A.transpose();
    out.template triangularView<Eigen::StrictlyLower>() = out.transpose();
  }

  // (5).
  template <class T>
  static void combine(const Element<T>& outer, const Element<T>& inner, Element<T>& out) {
    out.closed = outer.closed || inner.closed;
    apply(inner, outer.C, out.C);
    if (out.closed) return;
    const Matrix6<T> F = Matrix6<T>::Identity() + outer.C * inner.J;
    const Matrix6<T> FA = F.partialPivLu().solve(outer.A);
    out.A = inner.A * FA;
    out.J = outer.J + outer.A.transpose() * inner.J * FA;
    out.J.template triangularView<Eigen::StrictlyLower>() = out.J.transpose();
  }
};

}  // namespace kalmarm::scan
