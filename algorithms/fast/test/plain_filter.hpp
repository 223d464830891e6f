// What the fast path is to be as accurate as, compiled once for float and double: the plain filter,
// Sequential<Conventional>, and the composite and Newton-Euler algorithms of model/.
#pragma once

#include "algorithms/test/models.hpp"
#include "kalmarm/outcome.hpp"

namespace kalmarm::test {

// The outcome is that of the factors, by which a is worked out in any case.
template <class T>
VectorX<T> plain_acceleration(const Model<double>& model, const State<T>& state,
                              Outcome* outcome = nullptr);
template <class T>
MatrixX<T> plain_inverse(const Model<double>& model, const VectorX<T>& q, Outcome* outcome);
template <class T>
MatrixX<T> plain_mass(const Model<double>& model, const VectorX<T>& q);
template <class T>
VectorX<T> plain_torque(const Model<double>& model, const State<T>& state);  // qdd stands in tau

}  // namespace kalmarm::test
