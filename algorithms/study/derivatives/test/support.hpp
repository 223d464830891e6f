// What the tests of the derivatives share: mechanisms at shifted parameters, and the derivatives of
// any function of them along a direction, by differences in 50 digits and by dual numbers.
#pragma once

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "algorithms/study/derivatives/factor_direction.hpp"
#include "algorithms/study/inverse_mass/sequential.hpp"
#include "algorithms/study/riccati/conventional.hpp"
#include "algorithms/test/dense_mechanics.hpp"
#include "algorithms/test/models.hpp"

namespace kalmarm::test {

using Jet = ceres::Jet<double, 1>;

struct Case {
  Model<double> model;
  State<double> state;
  VectorX<double> qdd;

  explicit Case(const Family& family)
      : model(family.make(71)),
        state(random_state(model, 72)),
        qdd(Random(73).vector(model.nv())) {}
};

inline ParameterVector<double> random_direction(const Case& at, std::uint64_t seed) {
  Random random(seed);
  ParameterVector<double> out(at.model);
  for (InertialVector<double>& theta : out.theta) theta = random.vector(body_parameters);
  out.r = random.vector(at.model.nv());
  out.tau = random.vector(at.model.nv());
  return out;
}

// The case at its parameters plus step times a direction, factored and solved.
template <class T>
struct Mechanism {
  Model<T> model;
  LinkKinematics<T> kin;
  typename Sequential<Conventional>::Workspace<T> ws;
  VectorX<T> qdd, tau, a;

  Mechanism(const Case& at, const ParameterVector<double>& direction, const T& step)
      : model(shifted(at.model, direction, step)),
        kin(model),
        ws(model),
        qdd(at.qdd.cast<T>()),
        tau(at.state.tau.cast<T>() + step * direction.tau.cast<T>()),
        a(model.nv()) {
    set_position(model, VectorX<T>(at.state.q.cast<T>()), kin);
    set_velocity(model, VectorX<T>(at.state.qd.cast<T>()), kin);
    EXPECT_TRUE(factor(model, kin, ws.factors));
    Sequential<Conventional>::acceleration(model, kin, tau, ws, a);
  }

 private:
  static Model<T> shifted(const Model<double>& model, const ParameterVector<double>& direction,
                          const T& step) {
    Model<T> out = model.cast<T>();
    for (int k = 0; k < model.nv(); ++k) {
      const InertialVector<double>& theta = direction.theta[k];
      if (!theta.isZero(0))
        out.set_inertia(
            k, spatial_inertia<T>(inertial_parameters(out.M(k)) + step * theta.template cast<T>()));
      out.set_noise(k, out.joint(k).r + step * direction.r[k]);
    }
    return out;
  }
};

// Named quantities of a mechanism, each as one list of numbers.
template <class T>
using Quantities = std::map<std::string, VectorX<T>>;

// Derivatives of what f(mechanism) gives, along a direction.
template <class F>
Quantities<double> by_differences(const Case& at, const ParameterVector<double>& direction,
                                  const F& f) {
  const Mp step("1e-15");
  const Quantities<Mp> plus = f(Mechanism<Mp>(at, direction, step));
  const Quantities<Mp> minus = f(Mechanism<Mp>(at, direction, Mp(-step)));
  Quantities<double> out;
  for (const auto& [name, value] : plus)
    out[name] = ((value - minus.at(name)) / (2 * step)).eval().template cast<double>();
  return out;
}

template <class F>
Quantities<double> by_jets(const Case& at, ParameterVector<double> direction, const F& f) {
  for (int k = 0; k < at.model.nv(); ++k)  // a massless link's centre of mass would be 0/0
    if (at.model.inertia(k).massless) direction.theta[k].setZero();
  Quantities<double> out;
  for (const auto& [name, value] : f(Mechanism<Jet>(at, direction, Jet(0, 0))))
    out[name] = value.unaryExpr([](const Jet& x) { return x.v[0]; }).template cast<double>();
  return out;
}

// Every quantity in `truth`, relative to the largest of its numbers.
inline void expect_near(const Quantities<double>& derivatives, const Quantities<double>& truth,
                        double tolerance) {
  ASSERT_EQ(derivatives.size(), truth.size());
  for (const auto& [name, value] : truth)
    EXPECT_LE((derivatives.at(name) - value).norm(), tolerance * value.norm()) << name;
}

class Derivatives : public testing::TestWithParam<Family> {
 protected:
  static constexpr double tolerance = 1e-12, jet_tolerance = 1e-13;
  const Case at_{GetParam()};
};

inline std::string family_name(const testing::TestParamInfo<Family>& info) {
  return info.param.name;
}

inline void PrintTo(const Family& family, std::ostream* out) { *out << family.name; }

}  // namespace kalmarm::test
