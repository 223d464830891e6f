// Answers to what is asked of a robot, as matrices, and how wrong one is:
//
//   acceleration   a              |da| / |a|
//   solve          x = M^-1 tau   |dx| / |x|
//   inverse        X = M^-1       max |dX_ij| / sqrt(X_ii X_jj)
//   diagonal       of M^-1        max |dx_i| / x_i
//   log_det        L = log det M  |dL| / max(1, |L|): of det M, dL is the relative error
//   derivatives    A of a by q,   the largest |dA| / |A|, Frobenius' norm. A derivative by q or qd
//                  qd and tau     below `smallest_derivative` is left out: it is a difference of
//                                 larger ones, or zero
#pragma once

#include <cassert>
#include <vector>

#include "accuracy/measures/measures.hpp"
#include "kalmarm/question.hpp"

namespace kalmarm::adversary {

inline constexpr double smallest_derivative = 0.01;  // 1/s^2 or 1/s

// Of one task: a column, a matrix, a number, or the three derivatives.
template <class S>
using Answer = std::vector<MatrixX<S>>;

inline const std::vector<Want>& tasks() {
  static const std::vector<Want> all{Want::acceleration, Want::inverse, Want::solve,
                                     Want::diagonal,     Want::log_det, Want::derivatives};
  return all;
}

// NaN where a number of the difference is.
template <class S>
double error_of(Want task, const Answer<S>& difference, const Answer<S>& exact) {
  using std::abs, std::sqrt;
  const MatrixX<S>&d = difference[0], &x = exact[0];
  double worst = 0;
  switch (task) {
    case Want::inverse: {
      const VectorX<S> scale = x.diagonal().cwiseSqrt();
      for (Eigen::Index j = 0; j < x.cols(); ++j)
        for (Eigen::Index i = 0; i < x.rows(); ++i)
          worst = larger(worst, quotient<S>(abs(d(i, j)), scale[i] * scale[j]));
      return worst;
    }
    case Want::diagonal:
      for (Eigen::Index i = 0; i < x.size(); ++i)
        worst = larger(worst, quotient<S>(abs(d(i)), x(i)));
      return worst;
    case Want::log_det:
      return static_cast<double>(S(abs(d(0)) / (abs(x(0)) > S(1) ? abs(x(0)) : S(1))));
    case Want::derivatives:
      for (std::size_t i = 0; i < exact.size(); ++i) {
        const bool by_tau = i == 2;
        if (by_tau || exact[i].norm() >= S(smallest_derivative))
          worst = larger(worst, quotient<S>(difference[i].norm(), exact[i].norm()));
      }
      return worst;
    default:
      assert(task == Want::acceleration || task == Want::solve);
      return quotient<S>(d.norm(), x.norm());
  }
}

}  // namespace kalmarm::adversary
