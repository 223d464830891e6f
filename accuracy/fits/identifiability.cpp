#include "accuracy/fits/identifiability.hpp"

#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>

#include "accuracy/fits/jacobians.hpp"
#include "algorithms/study/derivatives/regressor.hpp"

namespace kalmarm {
namespace {

constexpr double seen = 1e-9;  // of the largest singular value, or of the longest column

// 1 / x of what is not rounding beside the largest; else 0.
VectorX<double> inverse_or_zero(VectorX<double> x) {
  const double least = seen * x.maxCoeff();
  for (double& value : x) value = value > least ? 1 / value : 0;
  return x;
}

}  // namespace

RankAndCondition rank_and_condition(const MatrixX<double>& R) {
  const MatrixX<double> scaled = R * inverse_or_zero(R.colwise().norm().transpose()).asDiagonal();
  const VectorX<double> sigma = Eigen::BDCSVD<MatrixX<double>>(scaled).singularValues();
  RankAndCondition out;
  while (out.rank < sigma.size() && sigma[out.rank] > seen * sigma[0]) ++out.rank;
  if (out.rank > 0) out.condition = sigma[0] / sigma[out.rank - 1];
  return out;
}

RankAndCondition regressor_condition(const Scene& scene, const Samples& samples) {
  const Model<double>& model = scene.model;
  LinkKinematics<double> kin(model);
  Regressor<double> ws(model);
  const int nv = model.nv();
  MatrixX<double> rows(nv * samples.count(), body_parameters * nv);
  RowMatrixX<double> Y(nv, body_parameters * nv);
  for (int i = 0; i < samples.count(); ++i) {
    set_position(model, samples.q.col(i), kin);
    set_velocity(model, samples.qd.col(i), kin);
    regressor<double>(model, kin, samples.qdd.col(i), ws, Y);
    rows.middleRows(i * nv, nv) = Y;
  }
  StackedTriangle triangle(static_cast<int>(rows.cols()));
  triangle.add(rows);
  return rank_and_condition(triangle.R());
}

BaseParameters base_parameters(const MatrixX<double>& R, const VectorX<double>& units) {
  BaseParameters out;
  const auto [rank, condition] = rank_and_condition(R * units.asDiagonal());
  out.rank = rank;
  out.condition = condition;
  const int n = static_cast<int>(R.cols());
  const VectorX<double> norms = (R * units.asDiagonal()).colwise().norm();
  const Eigen::ColPivHouseholderQR<MatrixX<double>> qr(R * units.asDiagonal());
  const Eigen::VectorXi order = qr.colsPermutation().indices();
  const MatrixX<double> T = qr.matrixR().topRows(rank);
  // beta = map theta, in units first: [1  R1^-1 R2] on the permuted columns
  MatrixX<double> map = MatrixX<double>::Zero(rank, n);
  const MatrixX<double> tail =
      T.leftCols(rank).triangularView<Eigen::Upper>().solve(T.rightCols(n - rank));
  for (int i = 0; i < rank; ++i) {
    map(i, order[i]) = 1;
    out.columns.push_back(order[i]);
  }
  for (int j = rank; j < n; ++j) map.col(order[j]) = tail.col(j - rank);
  for (int j = 0; j < n; ++j)
    if (norms[j] <= seen * norms.maxCoeff()) out.unseen.push_back(j);
  for (int i = 0; i < rank; ++i) {
    const int column = order[i];
    for (double& entry : map.row(i))
      if (std::abs(entry) < 1e-7) entry = 0;
    map.row(i) = map.row(i) * units.cwiseInverse().asDiagonal() * units[column];
    if ((map.row(i).array() != 0).count() == 1) out.alone.push_back(column);
  }
  std::sort(out.alone.begin(), out.alone.end());
  out.map = std::move(map);
  return out;
}

std::vector<std::string> in_words(const BaseParameters& base,
                                  const std::vector<std::string>& names) {
  std::vector<std::string> out;
  for (int i = 0; i < base.rank; ++i) {
    std::string text = names[base.columns[i]];
    for (int j = 0; j < base.map.cols(); ++j) {
      if (j == base.columns[i] || base.map(i, j) == 0) continue;
      char number[32];
      std::snprintf(number, sizeof number, " %c %.3g ", base.map(i, j) < 0 ? '-' : '+',
                    std::abs(base.map(i, j)));
      text += number + names[j];
    }
    out.push_back(text);
  }
  return out;
}

MatrixX<double> linear_triangle(const Mechanics<double>& robot, const FreeParameters& free,
                                const Samples& samples, const ResidualOptions& options) {
  constexpr int at_once = 50;
  const int n = free.columns(), rows = kalmarm::rows(options.kind, robot.model.nv());
  SampleJacobian sample(robot.model, free, options);
  StackedTriangle triangle(n + 1);
  MatrixX<double> J(rows, n);
  VectorX<double> r(rows);
  const VectorX<double> p = free.values_of(robot);
  for (int first = 0; first < samples.count(); first += at_once) {
    const int count = std::min(at_once, samples.count() - first);
    MatrixX<double> block(count * rows, n + 1);
    for (int i = 0; i < count; ++i) {
      sample.evaluate(robot, samples, first + i, r.data(), &J);
      block.middleRows(i * rows, rows) << J, J * p - r;
    }
    triangle.add(block);
  }
  return triangle.R();
}

MatrixX<double> jacobian_triangle(const Mechanics<double>& robot, const FreeParameters& free,
                                  const Samples& samples, const ResidualOptions& options) {
  return linear_triangle(robot, free, samples, options).leftCols(free.columns());
}

MatrixX<double> columns_of_file(const Scene& scene, const FreeParameters& free) {
  MatrixX<double> out = MatrixX<double>::Identity(free.columns(), free.columns());
  for (std::size_t b = 0; b < free.bodies.size(); ++b) {
    const LinkFrame frame = frame_of_body(scene, free.bodies[b]);
    const Matrix3<double> R = frame.R.toRotationMatrix(), one = Matrix3<double>::Identity();
    const Vector3<double>& p = frame.p;
    for (int j = 0; j < body_parameters; ++j) {
      const SpatialInertia<double> M =
          spatial_inertia<double>(InertialVector<double>::Unit(body_parameters, j));
      SpatialInertia<double> moved;
      moved.m = M.m;
      moved.h = R.transpose() * (M.h - M.m * p);
      // of r - p in the place of r
      const Matrix3<double> I = M.I - 2 * p.dot(M.h) * one + M.h * p.transpose() +
                                p * M.h.transpose() +
                                M.m * (p.squaredNorm() * one - p * p.transpose());
      moved.I = R.transpose() * I * R;
      const auto first = static_cast<Eigen::Index>(body_parameters * b);
      out.col(first + j).segment<body_parameters>(first) = inertial_parameters(moved);
    }
  }
  return out;
}

Lost lost_parameters(const Scene& scene, const Mechanics<double>& robot, const FreeParameters& free,
                     Residual kind, const MatrixX<double>& R) {
  const int n = free.columns(), nv = scene.model.nv();
  const std::vector<State> states = random_states(scene, 3 * n / nv + 10, 1);
  Samples random;
  const auto count = static_cast<Eigen::Index>(states.size());
  random.time = VectorX<double>::LinSpaced(count, 0, 1);
  random.q.resize(scene.model.nq(), count);
  random.qd.resize(nv, count);
  random.qdd.resize(nv, count);
  random.tau = MatrixX<double>::Zero(nv, count);
  random.mass = MatrixX<double>::Ones(lower_triangle_size(nv), count);
  for (int i = 0; i < count; ++i) {
    random.q.col(i) = states[i].q;
    random.qd.col(i) = states[i].qd;
    random.qdd.col(i) = states[i].tau;  // N(0,1) as well
  }
  // of the other residuals M^-1 takes nothing away
  const Residual linear = is_linear(kind) ? kind : Residual::inverse_dynamics;
  const VectorX<double> units = column_units(robot, free);
  const MatrixX<double> J =
      jacobian_triangle(robot, free, random, residual_options(linear, robot, random));
  const BaseParameters base = base_parameters(J * columns_of_file(scene, free).inverse(), units);
  Lost out{base.rank, {}};
  const Eigen::JacobiSVD<MatrixX<double>> svd(R * units.asDiagonal(), Eigen::ComputeFullV);
  const int rank = rank_and_condition(R * units.asDiagonal()).rank;
  if (rank >= base.rank) return out;
  const MatrixX<double> unseen = svd.matrixV().rightCols(n - rank);
  for (int i = 0; i < base.rank; ++i) {
    const VectorX<double> row =
        base.map.row(i).transpose().cwiseProduct(units) / units[base.columns[i]];
    if ((row.transpose() * unseen).norm() > 1e-6 * row.norm())
      out.columns.push_back(base.columns[i]);
  }
  return out;
}

VectorX<double> column_units(const Mechanics<double>& robot, const FreeParameters& free) {
  double mass = 0, moment = 0;
  for (const int k : free.bodies) {
    mass += robot.model.M(k).m;
    moment += robot.model.M(k).I.trace();
  }
  const double m = free.bodies.empty() ? 1 : mass / static_cast<double>(free.bodies.size());
  const double l = mass > 0 ? std::sqrt(moment / mass) : 1;
  VectorX<double> out = VectorX<double>::Ones(free.columns());
  for (std::size_t b = 0; b < free.bodies.size(); ++b)
    out.segment<body_parameters>(body_parameters * b) << m, VectorX<double>::Constant(3, m * l),
        VectorX<double>::Constant(6, m * l * l);
  return out;
}

std::vector<std::string> column_names(const FreeParameters& free,
                                      const std::vector<std::string>& bodies,
                                      const std::vector<std::string>& dofs) {
  std::vector<std::string> out;
  for (const int k : free.bodies)
    for (const char* name : inertial_names)
      out.push_back(std::string(name) + "(" + bodies[k] + ")");
  for (const int k : free.armature) out.push_back("armature(" + dofs[k] + ")");
  for (const int k : free.viscous) out.push_back("viscous(" + dofs[k] + ")");
  for (const int k : free.coulomb) out.push_back("coulomb(" + dofs[k] + ")");
  return out;
}

}  // namespace kalmarm
