#include "kalmarm/operational_space.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "algorithms/fast/claims/arithmetic.hpp"
#include "algorithms/fast/claims/constants.hpp"
#include "algorithms/model/short_text.hpp"
#include "algorithms/spatial/spatial.hpp"

namespace kalmarm {
namespace {

[[noreturn]] void refuse(const std::string& what) {
  throw std::invalid_argument("operational inertia: " + what);
}

void check(const char* name, const std::string& shape, bool fits, const std::string& needed) {
  if (!fits) refuse(std::string(name) + " is " + shape + ", needed " + needed);
}

}  // namespace

template <class T>
struct OperationalInertia<T>::Memory {
  MatrixX<double> Y, V;
  VectorX<double> S, w;
  Eigen::SelfAdjointEigenSolver<MatrixX<double>> eigen;

  explicit Memory(int k) : Y(k, k), V(k, k), S(k), w(k), eigen(k) {}
};

template <class T>
OperationalInertia<T>::OperationalInertia(int rows, const Regularisation& how, int alike)
    : rows_(rows), alike_(alike), how_(how) {
  if (rows < 1 || alike < 1 || rows % alike != 0)
    refuse("of " + std::to_string(rows) + " rows, each " + std::to_string(alike) + " alike");
  if (!(how.damping >= 0 && std::isfinite(how.damping)))
    refuse("damping " + short_text("%g", how.damping));
  if (!(how.clamp >= 1)) refuse("clamp " + short_text("%g", how.clamp) + ", which is below 1");
  memory_ = std::make_unique<Memory>(rows);
}

template <class T>
OperationalInertia<T>::~OperationalInertia() = default;
template <class T>
OperationalInertia<T>::OperationalInertia(OperationalInertia&&) noexcept = default;
template <class T>
OperationalInertia<T>& OperationalInertia<T>::operator=(OperationalInertia&&) noexcept = default;

template <class T>
Outcome OperationalInertia<T>::compute(MatrixView<const T> X, MatrixView<T> Lambda,
                                       double error_of_X) {
  const std::string needed = detail::shape(rows_, rows_);
  check("X", X.shape(), X.fits(rows_, rows_), needed);
  check("the result", Lambda.shape(), Lambda.fits(rows_, rows_), needed);
  return invert(X.data(), Lambda.data(), error_of_X);
}

template <class T>
int OperationalInertia<T>::compute(RowsView<const T> X, RowsView<T> Lambda,
                                   std::span<Outcome> outcomes, std::span<const Outcome> of_X) {
  const auto count = static_cast<std::ptrdiff_t>(outcomes.size());
  const std::ptrdiff_t size = std::ptrdiff_t(rows_) * rows_;
  const std::string needed = detail::shape(count, size);
  check("rows of X", X.shape(), X.fits(count, size), needed);
  check("rows of the result", Lambda.shape(), Lambda.fits(count, size), needed);
  if (!of_X.empty() && of_X.size() != outcomes.size())
    refuse(std::to_string(of_X.size()) + " outcomes of X, needed " + std::to_string(count));
  int failed = 0;
  for (std::ptrdiff_t i = 0; i < count; ++i) {
    T* const to = Lambda.data() + i * size;
    const Outcome given = of_X.empty() ? Outcome{} : of_X[i];
    Outcome& outcome = outcomes[i];
    if (given) {
      outcome = invert(X.data() + i * size, to, given.error);
      outcome.near_singular = given.near_singular;
    } else {
      outcome = {.status = given.status};
      std::fill_n(to, size, std::numeric_limits<T>::quiet_NaN());
    }
    outcome.rung = given.rung;
    failed += !outcome;
  }
  return failed;
}

template <class T>
Outcome OperationalInertia<T>::invert(const T* X, T* Lambda, double error_of_X) {
  auto& [Y, V, S, w, eigen] = *memory_;
  Eigen::Map<MatrixX<T>> result(Lambda, rows_, rows_);
  const auto failed = [&](const Outcome& outcome) {
    result.setConstant(std::numeric_limits<T>::quiet_NaN());
    return outcome;
  };
  Y = Eigen::Map<const MatrixX<T>>(X, rows_, rows_).template cast<double>();
  if (!(Y.template triangularView<Eigen::Lower>().toDenseMatrix() * 0).isZero(0))
    return failed({.status = Outcome::Status::not_finite});
  for (int i = 0; i < rows_; i += alike_) {
    const double mean = Y.diagonal().segment(i, alike_).mean();
    if (!(mean > 0)) return failed({.status = Outcome::Status::singular, .joint = i});
    S.segment(i, alike_).setConstant(1 / std::sqrt(mean));
  }
  Y = S.asDiagonal() * Y * S.asDiagonal();  // (1)
  eigen.compute(Y);
  if (eigen.info() != Eigen::Success) return failed({.status = Outcome::Status::not_finite});
  const VectorX<double>& of_Y = eigen.eigenvalues();
  const double least = of_Y[0], largest = of_Y[rows_ - 1];
  w = of_Y.cwiseMax(largest / how_.clamp).array() + how_.damping;  // (2)
  const double eta = std::fmax(error_of_X, rounding_constant * double(unit_roundoff<T>()));
  Outcome out{.D = least, .scale = largest, .error = rows_ * eta / w[0]};  // (4)
  if (!(w[0] > 0 && out.error < 1)) {
    out.status = Outcome::Status::singular;
    return failed(out);
  }
  V = S.asDiagonal() * eigen.eigenvectors() * w.cwiseSqrt().cwiseInverse().asDiagonal();
  Y.setZero();
  Y.template selfadjointView<Eigen::Lower>().rankUpdate(V);  // (3)
  result = Y.template selfadjointView<Eigen::Lower>().toDenseMatrix().template cast<T>();
  if (!(result * T(0)).isZero(0)) return failed({.status = Outcome::Status::not_finite});
  return out;
}

template class OperationalInertia<float>;
template class OperationalInertia<double>;

}  // namespace kalmarm
