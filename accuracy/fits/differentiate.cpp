#include "accuracy/fits/differentiate.hpp"

#include <Eigen/QR>
#include <algorithm>

#include "robots/input_error.hpp"

namespace kalmarm {

void differentiate(Samples& samples, const LocalPolynomial& filter) {
  const int count = samples.count(), terms = filter.degree + 1;
  const int width = std::min(2 * filter.half_width + 1, count);
  if (filter.degree < 1 || width < terms)
    throw InputError("differentiation by polynomials of degree " + std::to_string(filter.degree) +
                     " over " + std::to_string(width) + " of " + std::to_string(count) +
                     " samples: the degree must be at least 1 and below the number of samples");
  samples.qdd.resizeLike(samples.qd);
  MatrixX<double> A(width, terms);  // s_j^p
  for (int i = 0; i < count; ++i) {
    const int first = std::clamp(i - filter.half_width, 0, count - width);
    VectorX<double> s = samples.time.segment(first, width).array() - samples.time[i];
    const double scale = s.cwiseAbs().maxCoeff();
    s /= scale;
    A.col(0).setOnes();
    for (int p = 1; p < terms; ++p) A.col(p) = A.col(p - 1).cwiseProduct(s);
    const MatrixX<double> c =
        A.householderQr().solve(samples.qd.middleCols(first, width).transpose());
    samples.qdd.col(i) = c.row(1).transpose() / scale;
  }
}

}  // namespace kalmarm
