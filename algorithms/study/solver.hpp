// One variant on one model behind a run-time interface: what programs, benchmarks and tests hold. A
// peer (MuJoCo …) implements the same interface. The virtual call costs about a nanosecond.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "algorithms/model/link_kinematics.hpp"
#include "algorithms/study/variant_traits.hpp"
#include "kalmarm/outcome.hpp"

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

  // M (nv x nv), both triangles, kinematics included.
  virtual void mass(const VectorX<T>& q, MatrixX<T>& M) = 0;

  // D(k) (nv) and g(k) (6 x nv) of M = (I + K) D (I + K*). False where the variant has no such
  // factors, or does not show them.
  virtual bool has_factors() const { return false; }
  virtual Outcome factors(const VectorX<T>& q, VectorX<T>& /*D*/, MatrixX<T>& /*g*/) {
    return factor(q);
  }

  // P+(k) x, of the state that was factored last.
  virtual Vector6<T> P_plus_times(int /*k*/, const Vector6<T>& /*x*/) const {
    return Vector6<T>::Constant(T(std::numeric_limits<double>::quiet_NaN()));
  }
};

// A variant in precision T, ready to be made for a model.
template <class T>
struct RegisteredVariant {
  std::string name;      // such as "Sequential<ArrayMGS>"
  std::string equation;  // what it evaluates
  VariantTraits traits;
  std::function<std::unique_ptr<Solver<T>>(const Model<T>&)> make;
  // Whether it answers for that model at all; it is not to be made for others.
  std::function<bool(const Model<T>&)> takes = [](const Model<T>&) { return true; };
};

// All variants that support T and give what is wanted, contenders first, in the registry's order
// (registry.hpp). Compiled for float and double in registry_*.cpp; another T instantiates it in one
// place of its own.
template <class T>
std::vector<RegisteredVariant<T>> registered_variants(Want want = Want::inverse);

// The ladder at its tolerances, which is among them, contenders first: float and double,
// registry_ladder.cpp. So is its last rung alone.
template <class T>
std::vector<RegisteredVariant<T>> ladder_variants();
RegisteredVariant<double> two_doubles_variant();

// The square-root form on the fast path's frames, which is among them likewise: registry_square_root.cpp.
template <class T>
RegisteredVariant<T> square_root_variant();

// Code for one robot of variants of the registry, worked out operation by operation: Generated<X>, exhibits, float and
// double (generated/generated_variants.hpp).
template <class T>
std::vector<RegisteredVariant<T>> evaluated_variants();

// The registry's, and then these.
template <class T>
std::vector<RegisteredVariant<T>> all_variants() {
  std::vector<RegisteredVariant<T>> out = registered_variants<T>();
  if constexpr (std::is_floating_point_v<T>)
    for (RegisteredVariant<T>& variant : evaluated_variants<T>()) out.push_back(std::move(variant));
  return out;
}

// The variant of that name on a model; null where there is none in precision T, or it does not take
// the model.
template <class T>
std::unique_ptr<Solver<T>> make_solver(const std::string& name, const Model<T>& model) {
  for (const RegisteredVariant<T>& variant : all_variants<T>())
    if (variant.name == name && variant.takes(model)) return variant.make(model);
  return nullptr;
}

}  // namespace kalmarm
