#include "accuracy/fits/differentiate.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>

#include "accuracy/fits/quaternion_rates.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

// Coefficients of t - t_i in the polynomial around sample i of every row of x: (1), scale taken
// out, a row a power.
MatrixX<double> coefficients(const VectorX<double>& time, const MatrixX<double>& x, int i,
                             const LocalPolynomial& filter) {
  const int count = static_cast<int>(time.size()), terms = filter.degree + 1;
  const int width = std::min(2 * filter.half_width + 1, count);
  const int first = std::clamp(i - filter.half_width, 0, count - width);
  VectorX<double> s = time.segment(first, width).array() - time[i];
  const double scale = s.cwiseAbs().maxCoeff();
  s /= scale;
  MatrixX<double> A(width, terms);  // s_j^p
  A.col(0).setOnes();
  for (int p = 1; p < terms; ++p) A.col(p) = A.col(p - 1).cwiseProduct(s);
  MatrixX<double> c = A.householderQr().solve(x.middleCols(first, width).transpose());
  for (int p = 1; p < terms; ++p) c.row(p) /= std::pow(scale, p);
  return c;
}

// Angles without jumps of whole turns, quaternions without changes of sign.
MatrixX<double> continuous(const Model<double>& model, MatrixX<double> q) {
  for (int k = 0; k < model.nv(); ++k) {
    const Joint<double>& joint = model.joint(k);
    for (int i = 1; i < q.cols(); ++i) {
      if (joint.coordinate == Coordinate::angle) {
        const double turn = 2 * std::numbers::pi,
                     jump = q(joint.q_index, i - 1) - q(joint.q_index, i);
        q(joint.q_index, i) += turn * std::round(jump / turn);
      } else if (joint.coordinate == Coordinate::quaternion) {
        auto now = q.block<4, 1>(joint.q_index, i);
        if (now.dot(q.block<4, 1>(joint.q_index, i - 1)) < 0) now *= -1;
      }
    }
  }
  return q;
}

void refuse_gaps(const VectorX<double>& time) {
  const auto count = time.size() - 1;
  const VectorX<double> steps = time.tail(count) - time.head(count);
  VectorX<double> sorted = steps;
  std::nth_element(sorted.begin(), sorted.begin() + count / 2, sorted.end());
  const double median = sorted[count / 2];
  const Eigen::Index gap = std::find_if(steps.begin(), steps.end(),
                                        [&](double step) { return step > longest_step * median; }) -
                           steps.begin();
  if (gap == count) return;
  char text[200];
  std::snprintf(text, sizeof text,
                "after time %.7g comes a step of %.3g, the median is %.3g: positions are not "
                "differentiated across a gap",
                time[gap], steps[gap], median);
  throw InputError(text);
}

// (2) of DoF k, where `c` are the coefficients of all positions; a joint of several DoF is done at
// its first.
void set_rates(const Joint<double>& joint, int k, const MatrixX<double>& c, int i,
               Samples& samples) {
  const int q = joint.q_index;
  switch (joint.coordinate) {
    case Coordinate::angle:
    case Coordinate::distance:
      samples.qd(k, i) = c(1, q);
      samples.qdd(k, i) = 2 * c(2, q);
      break;
    case Coordinate::position:
      samples.qd.block<3, 1>(k, i) = c.block<1, 3>(1, q).transpose();
      samples.qdd.block<3, 1>(k, i) = 2 * c.block<1, 3>(2, q).transpose();
      break;
    case Coordinate::quaternion: {
      const auto power = [&](int p) { return Eigen::Vector4d(c.block<1, 4>(p, q).transpose()); };
      const QuaternionRates rates = quaternion_rates(power(0), power(1), 2 * power(2));
      samples.qd.block<3, 1>(k, i) = rates.omega;
      samples.qdd.block<3, 1>(k, i) = rates.omega_dot;
      break;
    }
    case Coordinate::follower:
      break;
  }
}

}  // namespace

void differentiate(Samples& samples, const LocalPolynomial& filter) {
  const int count = samples.count(), width = std::min(2 * filter.half_width + 1, count);
  if (filter.degree < 1 || width <= filter.degree)
    throw InputError("differentiation by polynomials of degree " + std::to_string(filter.degree) +
                     " over " + std::to_string(width) + " of " + std::to_string(count) +
                     " samples: the degree must be at least 1 and below the number of samples");
  samples.qdd.resizeLike(samples.qd);
  for (int i = 0; i < count; ++i)
    samples.qdd.col(i) = coefficients(samples.time, samples.qd, i, filter).row(1).transpose();
}

void differentiate_positions(Samples& samples, const Model<double>& model,
                             const LocalPolynomial& filter) {
  const int count = samples.count(), h = filter.half_width;
  if (filter.degree < 2 || 2 * h < filter.degree)
    throw InputError("second derivatives by polynomials of degree " +
                     std::to_string(filter.degree) + " over " + std::to_string(2 * h + 1) +
                     " samples: the degree must be at least 2 and below the number of samples");
  if (count < 2 * h + 2)
    throw InputError(std::to_string(count) + " samples of positions without velocities, at least " +
                     std::to_string(2 * h + 2) + " are needed");
  refuse_gaps(samples.time);
  const MatrixX<double> x = continuous(model, samples.q);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  samples.qd.setConstant(model.nv(), count, nan);
  samples.qdd.setConstant(model.nv(), count, nan);
  for (int i = h; i < count - h; ++i) {
    const MatrixX<double> c = coefficients(samples.time, x, i, filter);
    for (int k = 0; k < model.nv(); ++k) set_rates(model.joint(k), k, c, i, samples);
  }
  samples = part(samples, h, count - 2 * h);
}

}  // namespace kalmarm
