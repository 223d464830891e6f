// One call: what is asked, of one state or of rows of states, and where its numbers stand.
//
//   want               q  and        out                          numbers a row of out
//   acceleration       qd tau        a [X = M^-1 B]               n  [n m]
//   inverse_dynamics   qd tau        torques of tau as qdd        n
//   mass                             M                            n^2
//   inverse                          M^-1                         n^2
//   solve              tau           M^-1 tau                     n
//   diagonal                         of M^-1                      n
//   log_det                          log det M                    1
//   operational                      a block of M^-1, J M^-1 J'   k^2
//   operational_diagonal             of that                      k
//   derivatives        qd tau        a, and dX of those wanted    n, n^2 each
//
// To a, torques and derivatives forces from outside may be given, six numbers of every frame of
// Question::acted_on; to what is made of factors alone, contacts, six of every frame of Question::contacts, which
// make H = M + J'DJ of M. Accelerations also take joint noise r and columns B.
//
// Matrices are column-major. n: DoF that are asked about, of an engine all; k: rows of J, of an engine
// those of its selection. qd and tau have nv numbers a row, tau of `solve` n.
#pragma once

#include <array>
#include <cstddef>

#include "kalmarm/question.hpp"

namespace kalmarm {

// Numbers a row.
struct Widths {
  std::ptrdiff_t nq, nv, n, k;
  std::ptrdiff_t f = 0, c = 0;  // six a frame that is acted on, and a contact

  std::ptrdiff_t tau(Want want) const { return want == Want::solve ? n : nv; }

  std::ptrdiff_t out(Want want) const {
    switch (want) {
      case Want::mass:
      case Want::inverse:
        return n * n;
      case Want::operational:
        return k * k;
      case Want::operational_diagonal:
        return k;
      case Want::log_det:
        return 1;
      default:
        return n;
    }
  }
};

// Null: not given or not wanted.
template <class T>
struct Call {
  Want want;
  const T* q = nullptr;
  const T* qd = nullptr;
  const T* tau = nullptr;
  T* out = nullptr;
  std::array<T*, 3> derivatives = {};  // da/dq, da/dqd, da/dtau
  const T* forces = nullptr;
  const T* contacts = nullptr;
  Axes axes = Axes::local;  // of forces, and of contacts
  const T* r = nullptr;     // joint noise in the place of the robot's
  int m = 0;                // columns of B, the same of every row, and of X
  const T* B = nullptr;
  T* X = nullptr;

  // Of the rows from i on.
  Call from(std::ptrdiff_t i, const Widths& width) const {
    Call rest = *this;
    const auto skip = [i](auto*& x, std::ptrdiff_t numbers) {
      if (x) x += i * numbers;
    };
    skip(rest.q, width.nq);
    skip(rest.qd, width.nv);
    skip(rest.tau, width.tau(want));
    skip(rest.out, width.out(want));
    for (T*& X : rest.derivatives) skip(X, width.n * width.n);
    skip(rest.forces, width.f);
    skip(rest.contacts, width.c);
    skip(rest.r, width.nv);
    skip(rest.X, width.n * m);
    return rest;
  }
};

}  // namespace kalmarm
