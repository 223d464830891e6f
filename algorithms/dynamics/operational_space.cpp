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

template <class Rows>
void check_rows(const char* name, const Rows& rows, std::size_t count, std::ptrdiff_t width) {
  const auto n = static_cast<std::ptrdiff_t>(count);
  check(name, rows.shape(), rows.fits(n, width), detail::shape(n, width));
}

// What is told of an error, or where nothing is, that of rounding.
template <class T>
double least_error(double told) {
  return std::fmax(told, rounding_constant * double(unit_roundoff<T>()));
}

// A result, where it is wanted: NaN where there is none.
template <class T>
Outcome written(Outcome out, const MatrixX<double>& X, T* to) {
  if (!to) return out;
  Eigen::Map<MatrixX<T>> result(to, X.rows(), X.cols());
  if (out) result = X.template cast<T>();
  if (out && !(result * T(0)).isZero(0)) out = {.status = Outcome::Status::not_finite};
  if (!out) result.setConstant(std::numeric_limits<T>::quiet_NaN());
  return out;
}

// one(i, given) of every row; returns how many failed.
template <class One>
int of_rows(std::span<Outcome> outcomes, const char* name, std::span<const Outcome> given,
            const One& one) {
  if (!given.empty() && given.size() != outcomes.size())
    refuse(std::to_string(given.size()) + " outcomes of " + name + ", needed " +
           std::to_string(outcomes.size()));
  int failed = 0;
  for (std::ptrdiff_t i = 0; i < std::ssize(outcomes); ++i) {
    const Outcome of_row = given.empty() ? Outcome{} : given[i];
    Outcome& outcome = outcomes[i];
    outcome = of_row ? one(i, of_row) : one(i, {.status = of_row.status});
    outcome.near_singular = of_row.near_singular;
    outcome.rung = of_row.rung;
    failed += !outcome;
  }
  return failed;
}

}  // namespace

template <class T>
struct OperationalInertia<T>::Memory {
  MatrixX<double> Y, V;  // Y: X, then Lambda
  VectorX<double> S, w;
  Eigen::SelfAdjointEigenSolver<MatrixX<double>> eigen;
  MatrixX<double> inverse_mass, Jt, MJ, inverse, projector;  // of calls with J
  VectorX<double> scale;

  explicit Memory(int k) : Y(k, k), V(k, k), S(k), w(k), eigen(k) {}

  void reserve(int n) {
    if (Jt.rows() == n) return;
    const Eigen::Index k = Y.rows();
    for (MatrixX<double>* const wide : {&Jt, &MJ, &inverse}) wide->resize(n, k);
    for (MatrixX<double>* const square : {&inverse_mass, &projector}) square->resize(n, n);
    scale.resize(n);
  }
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
  return of_X(X.data(), Lambda.data(), {.error = error_of_X});
}

template <class T>
Outcome OperationalInertia<T>::compute(MatrixView<const T> inverse_mass, MatrixView<const T> Jt,
                                       const OperationalResults<MatrixView<T>>& out, double error) {
  const auto n = static_cast<int>(Jt.rows_of(rows_));
  const auto check_one = [](const char* name, const auto& X, int rows, int columns) {
    check(name, X.shape(), X.fits(rows, columns) && !X.is_row_major(),
          detail::shape(rows, columns) + ", column-major");
  };
  const std::string of_M = detail::shape(n, n);
  check("M^-1", inverse_mass.shape(), inverse_mass.fits(n, n), of_M);
  check_one("J'", Jt, n, rows_);
  if (out.inertia)
    check("the inertia", out.inertia.shape(), out.inertia.fits(rows_, rows_),
          detail::shape(rows_, rows_));
  if (out.inverse) check_one("the inverse", out.inverse, n, rows_);
  if (out.projector) check_one("the projector", out.projector, n, n);
  return of_J(n, inverse_mass.data(), Jt.data(),
              {out.inertia.data(), out.inverse.data(), out.projector.data()}, {.error = error});
}

template <class T>
int OperationalInertia<T>::compute(RowsView<const T> X, RowsView<T> Lambda,
                                   std::span<Outcome> outcomes, std::span<const Outcome> of_X) {
  const std::ptrdiff_t size = std::ptrdiff_t(rows_) * rows_;
  check_rows("X", X, outcomes.size(), size);
  check_rows("the result", Lambda, outcomes.size(), size);
  return of_rows(outcomes, "X", of_X, [&](std::ptrdiff_t i, const Outcome& given) {
    return this->of_X(X.data() + i * size, Lambda.data() + i * size, given);
  });
}

template <class T>
int OperationalInertia<T>::compute(RowsView<const T> inverse_mass, RowsView<const T> Jt,
                                   const OperationalResults<std::optional<RowsView<T>>>& out,
                                   std::span<Outcome> outcomes,
                                   std::span<const Outcome> of_inverse_mass) {
  const std::ptrdiff_t k = rows_, count = std::max<std::ptrdiff_t>(std::ssize(outcomes), 1),
                       n = Jt.size() / (count * k);
  check_rows("J'", Jt, outcomes.size(), n * k);
  check_rows("M^-1", inverse_mass, outcomes.size(), n * n);
  const auto rows_of = [&](const char* name, const std::optional<RowsView<T>>& rows,
                           std::ptrdiff_t width) {
    if (rows) check_rows(name, *rows, outcomes.size(), width);
    return [to = rows ? rows->data() : nullptr, width](std::ptrdiff_t i) {
      return to ? to + i * width : nullptr;
    };
  };
  const auto inertia = rows_of("the inertia", out.inertia, k * k);
  const auto inverse = rows_of("the inverse", out.inverse, n * k);
  const auto projector = rows_of("the projector", out.projector, n * n);
  return of_rows(outcomes, "M^-1", of_inverse_mass, [&](std::ptrdiff_t i, const Outcome& given) {
    return of_J(static_cast<int>(n), inverse_mass.data() + i * n * n, Jt.data() + i * n * k,
                {inertia(i), inverse(i), projector(i)}, given);
  });
}

template <class T>
Outcome OperationalInertia<T>::of_X(const T* X, T* Lambda, const Outcome& given) {
  MatrixX<double>& Y = memory_->Y;
  Y = Eigen::Map<const MatrixX<T>>(X, rows_, rows_).template cast<double>();
  const Outcome out = given ? invert(given.error) : given;
  return written(out, Y, Lambda);
}

template <class T>
Outcome OperationalInertia<T>::of_J(int n, const T* inverse_mass, const T* Jt_given,
                                    const OperationalResults<T*>& results, const Outcome& given) {
  memory_->reserve(n);
  MatrixX<double>&Y = memory_->Y, &Jt = memory_->Jt, &MJ = memory_->MJ, &W = memory_->inverse_mass,
  &inverse = memory_->inverse, &projector = memory_->projector;
  Outcome out = given;
  if (given) {
    W = Eigen::Map<const MatrixX<T>>(inverse_mass, n, n).template cast<double>();
    Jt = Eigen::Map<const MatrixX<T>>(Jt_given, n, rows_).template cast<double>();
    MJ.noalias() = W.template selfadjointView<Eigen::Lower>() * Jt;
    Y.noalias() = Jt.transpose() * MJ;
    memory_->scale = W.diagonal().cwiseAbs().cwiseSqrt();
    double largest = 0;  // of (7), but for rows that no joint moves, of which 0 / 0 is left out
    for (int i = 0; i < rows_; ++i) {
      const double most = Jt.col(i).cwiseAbs().dot(memory_->scale);
      largest = std::fmax(largest, most * most / Y(i, i));
    }
    out = invert(largest * least_error<T>(given.error));
  }
  if (out) {
    inverse.noalias() = MJ * Y;  // (5)
    projector.noalias() = -inverse * Jt.transpose();
    projector.diagonal().array() += 1;  // (6)
  }
  const auto write = [&](Outcome of_all) {
    of_all = written(of_all, Y, results.inertia);
    of_all = written(of_all, inverse, results.inverse);
    return written(of_all, projector, results.projector);
  };
  const Outcome all = write(out);
  return out && !all ? write(all) : all;
}

// Y: X, of which the lower triangle is looked at, then Lambda.
template <class T>
Outcome OperationalInertia<T>::invert(double error_of_X) {
  auto& [Y, V, S, w, eigen, inverse_mass, Jt, MJ, inverse, projector, scale] = *memory_;
  if (!(Y.template triangularView<Eigen::Lower>().toDenseMatrix() * 0).isZero(0))
    return {.status = Outcome::Status::not_finite};
  for (int i = 0; i < rows_; i += alike_) {
    const double mean = Y.diagonal().segment(i, alike_).mean();
    if (!(mean > 0)) return {.status = Outcome::Status::singular, .joint = i};
    S.segment(i, alike_).setConstant(1 / std::sqrt(mean));
  }
  Y = S.asDiagonal() * Y * S.asDiagonal();  // (1)
  eigen.compute(Y);
  if (eigen.info() != Eigen::Success) return {.status = Outcome::Status::not_finite};
  const VectorX<double>& of_Y = eigen.eigenvalues();
  const double least = of_Y[0], largest = of_Y[rows_ - 1];
  w = of_Y.cwiseMax(largest / how_.clamp).array() + how_.damping;  // (2)
  Outcome out{
      .D = least, .scale = largest, .error = rows_ * least_error<T>(error_of_X) / w[0]};  // (4)
  if (!(w[0] > 0 && out.error < 1)) {
    out.status = Outcome::Status::singular;
    return out;
  }
  V = S.asDiagonal() * eigen.eigenvectors() * w.cwiseSqrt().cwiseInverse().asDiagonal();
  Y.setZero();
  Y.template selfadjointView<Eigen::Lower>().rankUpdate(V);  // (3)
  Y.template triangularView<Eigen::StrictlyUpper>() = Y.transpose();
  return out;
}

template class OperationalInertia<float>;
template class OperationalInertia<double>;

}  // namespace kalmarm
