// Truth in 50 digits, from the definitions of mechanics (algorithms/test/dense_mechanics.hpp). Two
// files compile it: truth.cpp, behind doubles, and test_equations.cpp.
#pragma once

#include <algorithm>

#include "algorithms/fast/test/truth.hpp"
#include "algorithms/test/dense_mechanics.hpp"

namespace kalmarm::test {

// J' of the forces (nv).
VectorX<Mp> torques_of(const Push& push, const World& world, int nv);

struct Exact {
  MatrixX<Mp> M;
  Eigen::LDLT<MatrixX<Mp>> ldlt;
  VectorX<Mp> bias, a;
  Mp size;  // |M^-1 tau|_M + |M^-1 bias|_M

  // M is H where there are contacts.
  Exact(const Model<Mp>& model, const State<Mp>& state, const Push& push = {},
        const Push& contacts = {}) {
    const World world(model, state.q, state.qd);
    bias = world.bias() - torques_of(push, world, model.nv());
    M = world.mass_matrix();
    for (std::size_t i = 0; i < contacts.frames.size(); ++i) {
      const VectorX<Mp> row =
          torques_of({{contacts.frames[i]}, contacts.forces.segment<6>(6 * i), contacts.axes},
                     world, model.nv());
      M += row * row.transpose();
    }
    ldlt.compute(M);
    a = ldlt.solve(state.tau - bias);
    size = sqrt(Mp(state.tau.dot(ldlt.solve(state.tau)))) + sqrt(Mp(bias.dot(ldlt.solve(bias))));
  }

  MatrixX<Mp> inverse() const { return ldlt.solve(MatrixX<Mp>::Identity(M.rows(), M.cols())); }

  double error(const VectorX<Mp>& x) const {
    const VectorX<Mp> d = x - a;
    return Mp(sqrt(Mp(d.dot(M * d))) / size).convert_to<double>();
  }
};

// An error of tau(k) is measured by sqrt(M(k,k)) (|qdd|_M + |bias|_M^-1), of which |tau(k)| is no
// more. qdd stands in tau of the state.
struct ExactTorque {
  VectorX<Mp> tau, scale;

  ExactTorque(const Exact& exact, const VectorX<Mp>& qdd) {
    tau = exact.M * qdd + exact.bias;
    const Mp size =
        sqrt(Mp(qdd.dot(exact.M * qdd))) + sqrt(Mp(exact.bias.dot(exact.ldlt.solve(exact.bias))));
    scale = size * exact.M.diagonal().cwiseSqrt();
  }

  double error(const VectorX<Mp>& x) const {
    const VectorX<Mp> d = x - tau;
    return d.cwiseQuotient(scale).cwiseAbs().maxCoeff().convert_to<double>();
  }
};

// Largest of the four relative errors. What ought to be zero is held against 1.
inline double error(const AccelerationDerivatives<Mp>& x,
                    const AccelerationDerivatives<Mp>& truth) {
  const auto relative = [](const auto& is, const auto& should) {
    const Mp size = should.norm(), d = (is - should).norm();
    return static_cast<double>(size > Mp(1e-20) ? Mp(d / size) : d);
  };
  return std::max({relative(x.dq, truth.dq), relative(x.dqd, truth.dqd),
                   relative(x.dtau, truth.dtau), relative(x.a, truth.a)});
}

// q moved by h along the velocity of DoF k.
State<Mp> moved(const Model<Mp>& model, State<Mp> state, int k, const Mp& h);

// tau = M a + bias - J'f does not change with q and qd, so that da = -M^-1 d(M a + bias - J'f) at this a, and da/dtau = M^-1.
// By central differences of what stands in brackets, whose error is about the square of the step, 1e-34.
AccelerationDerivatives<Mp> differences(const Model<Mp>& model, const State<Mp>& state,
                                        const Push& push = {});

}  // namespace kalmarm::test
