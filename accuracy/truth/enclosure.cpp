#include "accuracy/truth/enclosure.hpp"

#include <algorithm>

namespace kalmarm {
namespace {

constexpr Eigen::Index block = 256;  // columns of M X at a time, for the memory

// |x - y| at most.
Ball distance(const Ball& x, const Ball& y) { return upper_end(abs(x - y)); }

// Of a bound of an error; no error is no error of nothing too.
Ball relative(const Ball& error, const Ball& size) {
  return error == Ball(0) ? Ball(0) : upper_end(error / size);
}

// NaN is larger than any number, and stays.
void enlarge(Ball& worst, const Ball& x) {
  if (!is_nan(worst) && !(x <= worst)) worst = x;
}

template <class Matrix>
auto balls(const Matrix& A) {
  return A.template cast<Ball>().eval();
}

template <class T>
LinkKinematics<Ball> placed(const Model<Ball>& model, const VectorX<T>& q) {
  LinkKinematics<Ball> kin(model);
  set_position(model, VectorX<Ball>(balls(q)), kin);
  return kin;
}

}  // namespace

template <class T>
Enclosure::Enclosure(const Model<T>& model, const VectorX<T>& q, const VectorX<Real>& x)
    : model_(model.template cast<Ball>()),
      kin_(placed(model_, q)),
      world_(model_, kin_.q),
      theta_(model.nv()),
      root_(model.nv()) {
  for (int k = 0; k < model.nv(); ++k) {
    theta_[k] = centre(Ball(1) / (Ball(2 * model.nv()) * Ball(x[k])));
    root_[k] = sqrt(Ball(1) / theta_[k]);
  }
  definite_ = exceeds(model_, kin_, theta_);
}

const MatrixX<Ball>& Enclosure::M() const {
  if (M_.size() == 0) M_ = world_.mass();
  return M_;
}

const std::optional<FactorBalls>& Enclosure::factors() const {
  if (!factors_) factors_ = factor_balls(model_, kin_);
  return *factors_;
}

MatrixX<Real> Enclosure::mass() const { return M().unaryExpr(&rounded); }

VectorX<Real> Enclosure::torque(const VectorX<Real>& qd, const VectorX<Real>& qdd,
                                const Vector3<Real>& gravity) const {
  return world_.torque(balls(qd), balls(qdd), balls(gravity)).unaryExpr(&rounded);
}

// |r|_theta at most.
Ball Enclosure::theta_norm(const VectorX<Ball>& r) const {
  Ball square = 0;
  for (Eigen::Index k = 0; k < r.size(); ++k) {
    const Ball part = upper_end(abs(r[k]) * root_[k]);
    square += part * part;
  }
  return upper_end(sqrt(square));
}

double Enclosure::mass_width(const MatrixX<Real>& given) const {
  const VectorX<Ball> scale = M().diagonal().unaryExpr([](const Ball& x) { return sqrt(x); });
  Ball worst = 0;
  for (Eigen::Index j = 0; j < given.cols(); ++j)
    for (Eigen::Index i = 0; i < given.rows(); ++i)
      enlarge(worst, relative(distance(M()(i, j), Ball(given(i, j))), scale[i] * scale[j]));
  return bound_of(worst);
}

// (4)
double Enclosure::inverse_width(const MatrixX<Real>& X) const {
  if (!definite_) return bound_of(Ball(1) / Ball(0));
  const Eigen::Index n = X.rows();
  Ball rows = 0, columns = 0;
  for (Eigen::Index begin = 0; begin < n; begin += block) {
    const Eigen::Index count = std::min(block, n - begin);
    MatrixX<Ball> R = product(M(), balls(X.middleCols(begin, count)));
    for (Eigen::Index j = 0; j < count; ++j) {
      const Eigen::Index k = begin + j;
      R(k, j) -= Ball(1);
      const Ball scale = sqrt(Ball(X(k, k)));
      enlarge(columns, relative(theta_norm(R.col(j)), scale));
      enlarge(rows, relative(root_[k], scale));
    }
  }
  return bound_of(rows * columns);
}

double Enclosure::D_width(const VectorX<Real>& D) const {
  if (!factors()) return bound_of(Ball(1) / Ball(0));
  Ball worst = 0;
  for (Eigen::Index k = 0; k < D.size(); ++k)
    enlarge(worst, relative(distance(factors()->D[k], Ball(D[k])), abs(Ball(D[k]))));
  return bound_of(worst);
}

double Enclosure::g_width(const MatrixX<Real>& g) const {
  if (!factors()) return bound_of(Ball(1) / Ball(0));
  Ball worst = 0;
  for (Eigen::Index k = 0; k < g.cols(); ++k) {
    Ball error = 0, size = 0;  // squares
    for (int i = 0; i < 6; ++i) {
      const Ball given(g(i, k)), d = distance(factors()->g(i, k), given);
      error += d * d;
      size += given * given;
    }
    enlarge(worst, relative(upper_end(sqrt(error)), sqrt(size)));
  }
  return bound_of(worst);
}

AccelerationWidth Enclosure::acceleration_width(const VectorX<Real>& qd, const VectorX<Real>& tau,
                                                const Vector3<Real>& gravity,
                                                const VectorX<Real>& a) const {
  return acceleration_width(residual(qd, tau, gravity, a), a);
}

VectorX<Ball> Enclosure::residual(const VectorX<Real>& qd, const VectorX<Real>& tau,
                                  const Vector3<Real>& gravity, const VectorX<Real>& a) const {
  return balls(tau) - world_.torque(balls(qd), balls(a), balls(gravity));
}

// (3)
AccelerationWidth Enclosure::acceleration_width(const VectorX<Ball>& residual,
                                                const VectorX<Real>& a) const {
  if (!definite_) return {};
  const VectorX<Ball> given = balls(a), zero = VectorX<Ball>::Zero(a.size());
  const Ball error = theta_norm(residual);
  const VectorX<Ball> Ma =
      M_.size() > 0 ? VectorX<Ball>(M_ * given) : world_.torque(zero, given, Vector3<Ball>::Zero());
  Ball componentwise = 0;
  for (Eigen::Index k = 0; k < a.size(); ++k)
    enlarge(componentwise, relative(upper_end(error * root_[k]), abs(given[k])));
  return {
      bound_of(relative(upper_end(error * sqrt(root_.squaredNorm())), sqrt(given.squaredNorm()))),
      bound_of(relative(error, sqrt(given.dot(Ma)))), bound_of(componentwise)};
}

template Enclosure::Enclosure(const Model<float>&, const VectorX<float>&, const VectorX<Real>&);
template Enclosure::Enclosure(const Model<double>&, const VectorX<double>&, const VectorX<Real>&);

}  // namespace kalmarm
