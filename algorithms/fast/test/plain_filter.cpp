#include "algorithms/fast/test/plain_filter.hpp"

#include "algorithms/model/inverse_dynamics.hpp"
#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/study/inverse_mass/sequential.hpp"
#include "algorithms/study/riccati/conventional.hpp"

namespace kalmarm::test {

using Plain = Sequential<Conventional>;

template <class T>
VectorX<T> plain_acceleration(const Model<double>& parameters, const State<T>& state,
                              Outcome* outcome) {
  const Model<T> model = parameters.cast<T>();
  LinkKinematics<T> kin(model);
  typename Plain::template Workspace<T> ws(model);
  VectorX<T> a(model.nv());
  set_position(model, state.q, kin);
  set_velocity(model, state.qd, kin);
  const Outcome factored = Plain::factor(model, kin, ws);
  if (outcome) *outcome = factored;
  Plain::acceleration(model, kin, state.tau, ws, a);
  return a;
}

template <class T>
MatrixX<T> plain_inverse(const Model<double>& parameters, const VectorX<T>& q, Outcome* outcome) {
  const Model<T> model = parameters.cast<T>();
  LinkKinematics<T> kin(model);
  typename Plain::template Workspace<T> ws(model);
  MatrixX<T> X(model.nv(), model.nv());
  set_position(model, q, kin);
  *outcome = Plain::factor(model, kin, ws);
  Plain::inverse(model, kin, ws, X);
  return X;
}

template <class T>
MatrixX<T> plain_mass(const Model<double>& parameters, const VectorX<T>& q) {
  const Model<T> model = parameters.cast<T>();
  LinkKinematics<T> kin(model);
  CompositeInertia<T> composite(model);
  MatrixX<T> M(model.nv(), model.nv());
  set_position(model, q, kin);
  mass_matrix(model, kin, composite, Eigen::Ref<MatrixX<T>>(M));
  return M;
}

template <class T>
VectorX<T> plain_torque(const Model<double>& parameters, const State<T>& state) {
  const Model<T> model = parameters.cast<T>();
  LinkKinematics<T> kin(model);
  InverseDynamics<T> ws(model);
  VectorX<T> tau(model.nv());
  set_position(model, state.q, kin);
  set_velocity(model, state.qd, kin);
  inverse_dynamics(model, kin, state.tau, ws, Eigen::Ref<VectorX<T>>(tau));
  return tau;
}

#define INSTANTIATE(T)                                                                     \
  template VectorX<T> plain_acceleration(const Model<double>&, const State<T>&, Outcome*); \
  template MatrixX<T> plain_inverse(const Model<double>&, const VectorX<T>&, Outcome*);    \
  template MatrixX<T> plain_mass(const Model<double>&, const VectorX<T>&);                 \
  template VectorX<T> plain_torque(const Model<double>&, const State<T>&);
INSTANTIATE(float)
INSTANTIATE(double)
#undef INSTANTIATE

}  // namespace kalmarm::test
