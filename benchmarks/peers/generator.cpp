// The only file that is compiled for CppADCodeGen's numbers. Of Pinocchio's 24 kinds of joints it
// takes the four that a Mechanism has: with all of them gcc takes five times as long, and 5 GB.
//
// The steps and the options are those of Pinocchio's own CodeGenABA, CodeGenRNEA, CodeGenCRBA and
// CodeGenMinv, but for what makes faster code or an answer as asked:
//   aba and crba are LOCAL: of chain:7's right angles less is left than of WORLD's
//   rotations by right angles have exact zeros (exact_rotations)
//   matrices are written whole, and constants with all of their digits
#include "benchmarks/peers/generator.hpp"

#include <pinocchio/fwd.hpp>
// Pinocchio's numbers come after this.
#include <cppad/cg.hpp>
namespace CppAD {
// CppAD would derive it from that of cg::CG, which CppADCodeGen 2.4.3 leaves without max_digits10.
CPPAD_NUMERIC_LIMITS(double, AD<cg::CG<double>>)
}  // namespace CppAD

#include <algorithm>
#include <cmath>
#include <limits>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/codegen/cppadcg.hpp>

#include "benchmarks/peers/pinocchio_model.hpp"

namespace kalmarm {
namespace {

namespace pin = pinocchio;
namespace cg = CppAD::cg;

using Recorded = CppAD::AD<cg::CG<double>>;
using RecordedVector = Eigen::Matrix<Recorded, -1, 1>;

template <class T, int options>
struct FourJoints {
  using Scalar = T;
  static constexpr int Options = options;

  using JointModelVariant = boost::variant<
      pin::JointModelRevoluteTpl<T, options, 2>, pin::JointModelPrismaticTpl<T, options, 2>,
      pin::JointModelSphericalTpl<T, options>, pin::JointModelFreeFlyerTpl<T, options>>;
  using JointDataVariant = boost::variant<
      pin::JointDataRevoluteTpl<T, options, 2>, pin::JointDataPrismaticTpl<T, options, 2>,
      pin::JointDataSphericalTpl<T, options>, pin::JointDataFreeFlyerTpl<T, options>>;
};

// A right angle in a file becomes cos(pi/2) = 6e-17 in a rotation, which costs the generated code
// operations. Entries within a few roundings of 0, 1 and -1 are these.
Mechanism exact_rotations(Mechanism mechanism) {
  constexpr double rounding = 4 * std::numeric_limits<double>::epsilon();
  for (Mechanism::Joint& joint : mechanism.joints)
    for (double& x : joint.R)
      if (std::abs(x - std::round(x)) <= rounding) x = std::round(x);
  return mechanism;
}

// Rows of a symmetric matrix of which Pinocchio fills the upper triangle.
template <class Matrix>
RecordedVector whole(const Matrix& upper) {
  const int n = static_cast<int>(upper.rows());
  RecordedVector out(n * n);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) out[i * n + j] = upper(std::min(i, j), std::max(i, j));
  return out;
}

}  // namespace

std::map<std::string, std::string> generate(const Mechanism& mechanism, Task task) {
  const auto model = make_model<FourJoints>(exact_rotations(mechanism)).template cast<Recorded>();
  pin::DataTpl<Recorded, 0, FourJoints> data(model);
  const bool is_matrix = task == Task::inverse || task == Task::mass;
  const int nv = model.nv;

  RecordedVector x = RecordedVector::Zero(model.nq + (is_matrix ? 0 : 2 * nv));
  CppAD::Independent(x);
  const RecordedVector q = x.head(model.nq);
  RecordedVector y;
  if (task == Task::acceleration) {
    y = pin::aba(model, data, q, x.segment(model.nq, nv).eval(), x.tail(nv).eval(),
                 pin::Convention::LOCAL);
  } else if (task == Task::inverse_dynamics) {
    y = pin::rnea(model, data, q, x.segment(model.nq, nv).eval(), x.tail(nv).eval());
  } else if (task == Task::inverse) {
    pin::computeMinverse(model, data, q);
    y = whole(data.Minv);
  } else {
    pin::crba(model, data, q, pin::Convention::LOCAL);
    y = whole(data.M);
  }
  CppAD::ADFun<cg::CG<double>> function;
  function.Dependent(x, y);
  function.optimize("no_compare_op");

  cg::ModelCSourceGen<double> source(function, "generated");
  source.setCreateForwardZero(true);
  source.setParameterPrecision(std::numeric_limits<double>::max_digits10);
  cg::ModelLibraryCSourceGen<double> library(source);
  struct Files : cg::ModelLibraryProcessor<double> {
    using cg::ModelLibraryProcessor<double>::ModelLibraryProcessor;
    using cg::ModelLibraryProcessor<double>::getSources;
  };
  return Files(library).getSources(source);
}

}  // namespace kalmarm
