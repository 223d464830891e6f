// What data say about the parameters: the rank of the Jacobian J of the residuals with respect to
// the columns of parameters.hpp, and the combinations that it sees.
//
// J is kept as the triangle R of J = Q R, to which samples are added by orthogonal reduction. Its
// columns are divided by their units (kg, kg m, kg m^2 …: sizes of the robot), J U = Q R U. With
// column pivoting, R U P = Q [R1 R2; 0 0], R1 of full rank: the data see the base parameters
//   beta = theta_1 + R1^-1 R2 theta_2        theta = U P (theta_1; theta_2), in units
// and nothing else. The singular values of J with columns of unit length decide the rank.
//
// A fit has the parameters of a link in its own axes, z along the joint. They are reported in
// the frames of the file's bodies: theta_file = B theta, J_file = J B^-1.
#pragma once

#include <string>
#include <vector>

#include "accuracy/fits/parameters.hpp"
#include "accuracy/fits/residuals.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm {

// R of the QR factorisation of rows that come one after the other.
class StackedTriangle {
 public:
  explicit StackedTriangle(int columns) : R_(MatrixX<double>::Zero(columns, columns)) {}

  void add(const Eigen::Ref<const MatrixX<double>>& rows) {
    MatrixX<double> stack(R_.rows() + rows.rows(), R_.cols());
    stack << R_, rows;
    R_ = Eigen::HouseholderQR<MatrixX<double>>(stack)
             .matrixQR()
             .topRows(R_.cols())
             .triangularView<Eigen::Upper>();
  }

  const MatrixX<double>& R() const { return R_; }

 private:
  MatrixX<double> R_;
};

struct RankAndCondition {
  int rank = 0;
  double condition = 0;  // of the columns of unit length, over the rank

  bool better_than(const RankAndCondition& other) const {
    return rank > other.rank || (rank == other.rank && condition < other.condition);
  }
};

// Columns shorter than 1e-9 of the longest, and singular values below 1e-9 of the largest, are
// zero: those of what no motion can excite are near 1e-15.
RankAndCondition rank_and_condition(const MatrixX<double>& R);

// Of the regressor of torques, over the inertial parameters of all links.
RankAndCondition regressor_condition(const Scene& scene, const Samples& samples);

struct BaseParameters {
  int rank = 0;
  double condition = 0;
  std::vector<int> columns;  // of theta_1, one for each
  MatrixX<double> map;       // beta = map theta, rank x columns
  std::vector<int> unseen;   // columns that the data do not see at all
  std::vector<int> alone;    // columns that the data see on their own
};

// R of J, units of its columns.
BaseParameters base_parameters(const MatrixX<double>& R, const VectorX<double>& units);

// Every base parameter in words, such as "Izz(link2) + 0.31 m(link3)".
std::vector<std::string> in_words(const BaseParameters& base,
                                  const std::vector<std::string>& names);

// B of the free parameters: bodies' theta about the origin and in the axes of the file's body; 1 of the
// others, and of families.
MatrixX<double> columns_of_file(const Scene& scene, const FreeParameters& free);

// Base parameters, in the file's frames, that random motion would show and the data, with R of
// J_file, do not.
struct Lost {
  int rank = 0;              // of random motion
  std::vector<int> columns;  // that lead those which are lost, wholly or in part
};
Lost lost_parameters(const Scene& scene, const Mechanics<double>& robot, const FreeParameters& free,
                     Residual kind, const MatrixX<double>& R);

// Triangle of the residuals' Jacobian over the columns, of all samples.
MatrixX<double> jacobian_triangle(const Mechanics<double>& robot, const FreeParameters& free,
                                  const Samples& samples, const ResidualOptions& options);

// The same of [J  J p - r], p the robot's columns: of a residual that is linear in them, R and y
// with |R p - y| = |r|.
MatrixX<double> linear_triangle(const Mechanics<double>& robot, const FreeParameters& free,
                                const Samples& samples, const ResidualOptions& options);

// Names of the columns, such as "Ixx(link3)" and "armature(joint2)".
std::vector<std::string> column_names(const FreeParameters& free,
                                      const std::vector<std::string>& bodies,
                                      const std::vector<std::string>& dofs);

// Sizes by which columns are measured: the robot's mean mass m, radius l = sqrt(tr I_o / m) of the
// bodies; m, m l, m l^2; of armature and friction 1.
VectorX<double> column_units(const Mechanics<double>& robot, const FreeParameters& free);

}  // namespace kalmarm
