// Truth in 50 digits behind doubles, so that tests of the door compile nothing of it. What is
// tested in float is exact as double: model and state are to be rounded first, cast<T>().
#pragma once

#include <limits>
#include <memory>
#include <vector>

#include "algorithms/model/selection.hpp"
#include "algorithms/test/models.hpp"

namespace kalmarm::test {

// The numbers of T.
template <class T, class Value>
auto rounded(const Value& value) {
  return value.template cast<T>().template cast<double>();
}

// Forces from outside, six numbers a frame, or rows of contacts, as those of kalmarm/dynamics.hpp.
struct Push {
  std::vector<Frame> frames = {};
  VectorX<double> forces = {};
  Axes axes = Axes::aligned;
};

// Relative errors of what the fast path answers about one state. Infinite where a number is NaN.
class Truth {
 public:
  // Forces from outside are a part of the bias; with contacts M is H.
  Truth(const Model<double>& model, const State<double>& state, const Push& push = {},
        const Push& contacts = {});

  // Of a = M^-1 (tau - bias): |d|_M / (|M^-1 tau|_M + |M^-1 bias|_M), |d| / |a|, |d|_M / |a|_M.
  template <class V>
  double acceleration(const V& a) const {
    return acceleration_error(wide(a));
  }
  template <class V>
  double relative(const V& a) const {
    return relative_error(wide(a));
  }
  template <class V>
  double energy(const V& a) const {
    return energy_error(wide(a));
  }

  // Of tau = M qdd + bias, qdd = tau of the state: of tau(k) relative to
  // sqrt(M(k,k)) (|qdd|_M + |bias|_M^-1), of which |tau(k)| is no more.
  template <class V>
  double torque(const V& tau) const {
    return torque_error(wide(tau));
  }

  VectorX<double> solution() const;  // M^-1 tau, rounded

  // Of x = M^-1 tau, in the norm of M.
  template <class V>
  double solution(const V& x) const {
    return solution_error(wide(x));
  }

  // Largest |X - exact| / sqrt(diagonal diagonal), since joints may have any units. What cannot
  // move is zero: its error is that of 1.
  template <class X>
  double mass(const X& M) const {
    return mass_error(wide(M));
  }
  template <class X>
  double inverse(const X& M) const {
    return inverse_error(wide(M));
  }
  template <class X>
  double selected(const Selection& selection, const X& block) const {
    return selected_error(selection, wide(block));
  }

  // Largest relative error of the diagonal of M^-1.
  template <class V>
  double diagonal(const V& x) const {
    return diagonal_error(wide(x));
  }

  double log_det(double x) const;  // |x - log det M|
  double log_det_size() const;     // 1 + sum of |log D|

  MatrixX<double> M() const;  // rounded

 private:
  struct Impl;

  template <class V>
  static auto wide(const V& x) {
    return x.template cast<double>().eval();
  }

  double acceleration_error(const VectorX<double>& a) const;
  double relative_error(const VectorX<double>& a) const;
  double energy_error(const VectorX<double>& a) const;
  double torque_error(const VectorX<double>& tau) const;
  double solution_error(const VectorX<double>& x) const;
  double mass_error(const MatrixX<double>& M) const;
  double inverse_error(const MatrixX<double>& X) const;
  double selected_error(const Selection& selection, const MatrixX<double>& X) const;
  double diagonal_error(const VectorX<double>& x) const;

  std::shared_ptr<const Impl> impl_;
};

// Kinetic energy of the bodies and rotors, and potential energy.
struct Energies {
  double kinetic, potential;
};
Energies energies(const Model<double>& model, const State<double>& state);

// D of every joint, M = (I + K) D (I + K*), rounded to double.
VectorX<double> innovation_covariances(const Model<double>& model, const VectorX<double>& q);

// Of a mechanism: M and bias rounded to double.
struct DenseMechanics {
  MatrixX<double> M;
  VectorX<double> bias;
};
DenseMechanics dense_mechanics(const Model<double>& model, const State<double>& state);

// J of frames, 6 rows each, rounded to double.
MatrixX<double> frame_jacobian(const Model<double>& model, const VectorX<double>& q,
                               const std::vector<Frame>& frames);

// Derivatives of forward dynamics, and a itself.
template <class T>
struct AccelerationDerivatives {
  MatrixX<T> dq, dqd, dtau;
  VectorX<T> a;

  explicit AccelerationDerivatives(int n)  // poisoned
      : dq(MatrixX<T>::Constant(n, n, T(std::numeric_limits<double>::quiet_NaN()))),
        dqd(dq),
        dtau(dq),
        a(n > 0 ? VectorX<T>(dq.col(0)) : VectorX<T>()) {}

  template <class U>
  AccelerationDerivatives<U> cast() const {
    AccelerationDerivatives<U> out(0);
    out.dq = dq.template cast<U>();
    out.dqd = dqd.template cast<U>();
    out.dtau = dtau.template cast<U>();
    out.a = a.template cast<U>();
    return out;
  }
};

// Derivatives of forward dynamics by central differences.
class TrueDerivatives {
 public:
  TrueDerivatives(const Model<double>& model, const State<double>& state, const Push& push = {});

  // Largest relative error of the four matrices and vectors, in the norm of Frobenius.
  double error(const AccelerationDerivatives<double>& x) const;
  AccelerationDerivatives<double> rounded() const;
  double condition() const;  // of M^-1, scaled to a diagonal of ones

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

}  // namespace kalmarm::test
