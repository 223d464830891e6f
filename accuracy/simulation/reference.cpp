#include "accuracy/simulation/reference.hpp"

#include <stdexcept>

#include "accuracy/truth/udu.hpp"
#include "accuracy/truth/world_mechanics.hpp"
#include "algorithms/study/estimation/operators.hpp"

namespace kalmarm {
namespace {

constexpr double agreement = 1e-30;

}  // namespace

const MatrixX<Real>& Reference::operator[](Quantity quantity) const {
  switch (quantity) {
    case Quantity::M:
      return M;
    case Quantity::P:
      return P;
    case Quantity::D:
      return D;
    default:
      return Lambda;
  }
}

Reference reference(const Model<Real>& model, const VectorX<Real>& q) {
  const int n = model.nv();
  LinkKinematics<Real> kin(model);
  const VectorX<Real> at_rest = VectorX<Real>::Zero(n);
  set_position(model, q, kin);
  set_velocity(model, at_rest, kin);
  const Process<Real> process(model, kin);
  const Operators<Real> op(process);
  const MatrixX<Real> HR = op.H * op.R;

  Reference out;
  out.M = WorldMechanics<Real>(model, q).mass();
  if (!((op.M - out.M).norm() <= agreement * out.M.norm()))
    throw std::runtime_error("H R H* is not the mass matrix of the world frame");

  const UDU<Real> factors(out.M);
  out.D = factors.D.asDiagonal();

  const MatrixX<Real> E = factors.solve_U(HR).transpose();
  MatrixX<Real> G_D = MatrixX<Real>::Zero(6 * n, n);
  for (int j = 0; j < n; ++j)
    for (int k = process.parent[j]; k >= 0; k = process.parent[k])
      G_D.col(j).segment<6>(6 * k) = E.col(j).segment<6>(6 * k);
  const MatrixX<Real> G = G_D * factors.D.cwiseInverse().asDiagonal();
  const MatrixX<Real> G_E = G * E.transpose();
  out.P = op.R - G_E - G_E.transpose() + G * G_D.transpose();

  const MatrixX<Real> V = factors.solve_U(op.H * op.Phi);
  out.Lambda = V.transpose() * factors.D.cwiseInverse().asDiagonal() * V;
  return out;
}

Exact::Exact(const MatrixX<Real>& A)
    : high(A.cast<double>()), low((A - high.cast<Real>()).cast<double>()) {}

double relative_error(const MatrixX<double>& C, const Exact& exact) {
  const double error = ((C - exact.high) - exact.low).norm();
  return error == 0 ? 0 : error / exact.high.norm();
}

}  // namespace kalmarm
