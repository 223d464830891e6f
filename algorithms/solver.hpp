// One variant on one model behind a run-time interface: what programs, benchmarks and tests hold. A
// peer (MuJoCo …) implements the same interface. The virtual call costs about a nanosecond.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "algorithms/model/random_model.hpp"
#include "algorithms/outcome.hpp"

namespace kalmarm {

template <class T>
class Solver {
 public:
  virtual ~Solver() = default;

  // a = M^-1 (tau - bias): forward dynamics with gravity, velocity terms and armature. From the
  // state to a, kinematics included. q: nq, qd, tau and a: nv. On failure a is not to be used.
  virtual Outcome acceleration(const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau,
                               VectorX<T>& a) = 0;

  // Factors of M(q), kinematics included, which are kept for any number of `solve`.
  virtual Outcome factor(const VectorX<T>& q) = 0;

  // x = M^-1 tau, by the factors of the last `factor`, which was ok. tau and x: nv.
  virtual void solve(const VectorX<T>& tau, VectorX<T>& x) = 0;

  // M^-1, both triangles (nv x nv), kinematics included. On failure X is not to be used.
  virtual Outcome inverse(const VectorX<T>& q, MatrixX<T>& X) = 0;

  // D(k) (nv) and g(k) (6 x nv) of M = (I + K) D (I + K*). False where the variant has no such
  // factors.
  virtual bool has_factors() const = 0;
  virtual Outcome factors(const VectorX<T>& q, VectorX<T>& D, MatrixX<T>& g) = 0;

  // P+(k) x, of the state that was factored last.
  virtual Vector6<T> P_plus_times(int k, const Vector6<T>& x) const = 0;
};

// A variant in precision T, ready to be made for a model.
template <class T>
struct RegisteredVariant {
  std::string name;      // such as "Sequential<ArrayMGS>"
  std::string equation;  // what it evaluates
  bool contender;        // one to choose; else an exhibit of the accuracy laboratory
  std::function<std::unique_ptr<Solver<T>>(const Model<T>&)> make;
};

// All variants that support T, contenders first, in the registry's order (registry.hpp). Compiled
// for float and double in registry_*.cpp; another T instantiates it in one place of its own.
template <class T>
std::vector<RegisteredVariant<T>> registered_variants();

// Those of the fast path, which are among them: float and double, registry_structured.cpp.
template <class T>
std::vector<RegisteredVariant<T>> structured_variants();

// The variant of that name on a model; null where there is none in precision T.
template <class T>
std::unique_ptr<Solver<T>> make_solver(const std::string& name, const Model<T>& model) {
  for (const RegisteredVariant<T>& variant : registered_variants<T>())
    if (variant.name == name) return variant.make(model);
  return nullptr;
}

}  // namespace kalmarm
