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
// make H = M + J'DJ of M; to all of them loads, ten of every frame of Question::loaded. What weighs also takes
// gravity, three numbers, accelerations also joint noise r and columns B.
//
// Matrices are column-major. n: DoF that are asked about, of an engine all; k: rows of J, of an engine
// those of its selection. qd and tau have nv numbers a row, tau of `solve` n.
#pragma once

#include <array>
#include <cstddef>
#include <iterator>
#include <vector>

#include "kalmarm/question.hpp"

namespace kalmarm {

// The frames of which a call may have numbers for every state, as Question has them.
struct CallFrames {
  std::vector<Frame> acted_on, contacts, loaded;
};

// Of a force, or a row of a contact, and of a load.
inline constexpr std::ptrdiff_t numbers_of_force = 6, numbers_of_load = 10, numbers_of_gravity = 3;

// Numbers a row.
struct Widths {
  std::ptrdiff_t nq, nv, n, k;
  std::ptrdiff_t f, c, l;  // of all frames that are acted on, of contacts, of loads

  Widths(std::ptrdiff_t of_q, std::ptrdiff_t dofs, std::ptrdiff_t asked, std::ptrdiff_t rows_of_J,
         const CallFrames& frames = {})
      : nq(of_q),
        nv(dofs),
        n(asked),
        k(rows_of_J),
        f(numbers_of_force * std::ssize(frames.acted_on)),
        c(numbers_of_force * std::ssize(frames.contacts)),
        l(numbers_of_load * std::ssize(frames.loaded)) {}

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
  const T* loads = nullptr;
  const T* gravity = nullptr;  // else the robot's
  Axes axes = Axes::local;     // of forces, and of contacts
  const T* r = nullptr;        // joint noise in the place of the robot's
  int m = 0;                   // columns of B, the same of every row, and of X
  const T* B = nullptr;
  T* X = nullptr;
  bool B_of_rows = false;  // every row has its own B, of one column

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
    skip(rest.loads, width.l);
    skip(rest.gravity, numbers_of_gravity);
    skip(rest.r, width.nv);
    skip(rest.X, width.n * m);
    if (B_of_rows) skip(rest.B, width.n * m);
    return rest;
  }
};

}  // namespace kalmarm
