// Whether ten numbers of a load, (1) of fast/kinematics/loads.hpp, are those of a body that can be: its pseudo-inertia
//   J = [m h'; h Sigma],  Sigma = tr(I) / 2 1 - I = integral of r r' dm                     (1)
// is positive semidefinite, as far as rounding of the numbers lets see. Bodies with room to spare, whose
//   S = m Sigma - h h'                                                                      (2)
// has minors well above their rounding, are told by these, about 40 flops; others by elimination, the largest first.
#pragma once

#include <array>

#include "algorithms/spatial/spatial.hpp"

namespace kalmarm {

namespace detail {

// By the minors of (2).
template <class T>
bool is_clearly_body(const T* pi) {
  const T m = pi[0], half = (pi[4] + pi[5] + pi[6]) / T(2), room = T(64) * T(unit_roundoff<T>());
  const T xx = m * (half - pi[4]) - pi[1] * pi[1], yy = m * (half - pi[5]) - pi[2] * pi[2],
          zz = m * (half - pi[6]) - pi[3] * pi[3], xy = -(m * pi[7] + pi[1] * pi[2]),
          xz = -(m * pi[8] + pi[1] * pi[3]), yz = -(m * pi[9] + pi[2] * pi[3]);
  const T size = m * half, least = room * size;  // of the terms of all entries
  const T minor = xx * yy - xy * xy;
  const T det = zz * minor - xz * (xz * yy - yz * xy) - yz * (xx * yz - xy * xz);
  return m > T(0) && xx > least && minor > least * size && det > least * size * size;
}

// By elimination of (1).
template <class T>
bool is_semidefinite(const T* pi) {
  const T half = (pi[4] + pi[5] + pi[6]) / T(2);
  std::array<std::array<T, 4>, 4> J = {{{pi[0], pi[1], pi[2], pi[3]},
                                        {pi[1], half - pi[4], -pi[7], -pi[8]},
                                        {pi[2], -pi[7], half - pi[5], -pi[9]},
                                        {pi[3], -pi[8], -pi[9], half - pi[6]}}};
  constexpr int roundings = 16;
  const T rounded = T(roundings) * T(unit_roundoff<T>()) * half;  // of moments
  std::array<bool, 4> done{};
  for (int step = 0; step < 4; ++step) {
    int i = 0;  // the mass, then the largest moment that is left
    for (int j = 1; j < 4 && step > 0; ++j)
      if (!done[j] && (done[i] || J[j][j] > J[i][i])) i = j;
    done[i] = true;
    const T pivot = J[i][i], nothing = step == 0 ? T(0) : rounded;
    if (!(pivot >= -nothing)) return false;
    for (int j = 1; j < 4; ++j) {
      if (done[j]) continue;
      if (!(pivot > nothing)) {  // x^2 <= J(i,i) J(j,j) of what is positive
        if (!(J[i][j] * J[i][j] <= T(4) * nothing * half)) return false;
        continue;
      }
      for (int l = 1; l < 4; ++l)
        if (!done[l]) J[j][l] -= J[i][j] * J[i][l] / pivot;
    }
  }
  return true;
}

}  // namespace detail

template <class T>
bool is_body(const T* pi) {
  return detail::is_clearly_body(pi) || detail::is_semidefinite(pi);
}

}  // namespace kalmarm
