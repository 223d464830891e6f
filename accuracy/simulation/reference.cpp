#include "accuracy/simulation/reference.hpp"

#include <stdexcept>

#include "accuracy/world_frame.hpp"

namespace kalmarm {
namespace {

constexpr double agreement = 1e-30;

// R, and H Phi with one row a joint.
struct Operators {
  MatrixX<Real> R, H_Phi;

  explicit Operators(const Process<Real>& process)
      : R(MatrixX<Real>::Zero(6 * process.size(), 6 * process.size())),
        H_Phi(MatrixX<Real>::Zero(process.size(), 6 * process.size())) {
    std::vector<Matrix6<Real>> phi(process.size());  // phi(i,k) for i inboard of k and i = k
    for (int k = 0; k < process.size(); ++k) {
      phi[k].setIdentity();
      for (int i = k; process.parent[i] >= 0; i = process.parent[i]) {
        const int p = process.parent[i];
        phi[p] = process.phi[i] * phi[i];
        H_Phi.block<1, 6>(p, 6 * k) = process.H[p].transpose() * phi[p];
      }
      for (int j = k; j >= 0; j = process.parent[j]) {
        const Matrix6<Real> M_phi = process.M[k] * phi[j].transpose();
        for (int i = j; i >= 0; i = process.parent[i])
          R.block<6, 6>(6 * i, 6 * j) += phi[i] * M_phi;
      }
    }
    R.triangularView<Eigen::StrictlyLower>() = R.transpose();
  }
};

// M = U D U*, U upper triangular.
struct Factors {
  MatrixX<Real> U;
  VectorX<Real> D;

  explicit Factors(MatrixX<Real> M) : U(MatrixX<Real>::Identity(M.rows(), M.cols())), D(M.rows()) {
    for (int j = static_cast<int>(M.rows()) - 1; j >= 0; --j) {
      D[j] = M(j, j);
      U.col(j).head(j) = M.col(j).head(j) / D[j];
      const VectorX<Real> u = U.col(j).head(j);
      M.topLeftCorner(j, j) -= u * M.row(j).head(j);
    }
  }

  MatrixX<Real> solve_U(const MatrixX<Real>& B) const {
    return U.triangularView<Eigen::UnitUpper>().solve(B);
  }
};

// Rows of H R, or H A for any A with six rows a link.
MatrixX<Real> seen_by_joints(const Process<Real>& process, const MatrixX<Real>& A) {
  MatrixX<Real> out(process.size(), A.cols());
  for (int k = 0; k < process.size(); ++k)
    out.row(k) = process.H[k].transpose() * A.middleRows<6>(6 * k);
  return out;
}

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
  RandomModel<Real> rm(model);
  const VectorX<Real> at_rest = VectorX<Real>::Zero(n);
  set_position(model, q, rm);
  set_velocity(model, at_rest, rm);
  const Process<Real> process(model, rm);
  const Operators operators(process);
  const MatrixX<Real> H_R = seen_by_joints(process, operators.R);

  Reference out;
  out.M = world_frame(model, q, at_rest).M;
  MatrixX<Real> M = seen_by_joints(process, H_R.transpose());
  for (int k = 0; k < n; ++k) M(k, k) += process.r[k];
  if (!((M - out.M).norm() <= agreement * out.M.norm()))
    throw std::runtime_error("H R H* is not the mass matrix of the world frame");

  const Factors factors(out.M);
  out.D = factors.D.asDiagonal();

  const MatrixX<Real> E = factors.solve_U(H_R).transpose();
  MatrixX<Real> G_D = MatrixX<Real>::Zero(6 * n, n);
  for (int j = 0; j < n; ++j)
    for (int k = process.parent[j]; k >= 0; k = process.parent[k])
      G_D.col(j).segment<6>(6 * k) = E.col(j).segment<6>(6 * k);
  const MatrixX<Real> G = G_D * factors.D.cwiseInverse().asDiagonal();
  const MatrixX<Real> G_E = G * E.transpose();
  out.P = operators.R - G_E - G_E.transpose() + G * G_D.transpose();

  const MatrixX<Real> V = factors.solve_U(operators.H_Phi);
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
