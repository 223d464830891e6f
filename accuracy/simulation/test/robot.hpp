// A mechanism in a state, ready to be sampled.
#pragma once

#include <gtest/gtest.h>

#include "accuracy/simulation/reference.hpp"
#include "algorithms/test/models.hpp"

namespace kalmarm::test {

inline constexpr unsigned digits = 60;
inline constexpr std::uint64_t seed = 7;
inline constexpr Quantity quantities[] = {Quantity::M, Quantity::P, Quantity::D, Quantity::Lambda};

template <class T>
struct Robot {
  Model<T> model;
  VectorX<T> q;
  Process<T> process;
  Covariances<T> cov;
  Simulation<T> simulation;

  explicit Robot(const Model<double>& any, double speed = 1)
      : model(any.cast<T>()),
        q(random_state(any, seed).q.template cast<T>()),
        process(in_state(any, speed)),
        cov(gains()),
        simulation(process, cov) {}

 private:
  Process<T> in_state(const Model<double>& any, double speed) {
    LinkKinematics<T> kin(model);
    const VectorX<double> qd = speed * random_state(any, seed).qd;
    set_position(model, q, kin);
    set_velocity(model, VectorX<T>(qd.template cast<T>()), kin);
    return {model, kin};
  }

  Covariances<T> gains() {
    Covariances<T> out(process);
    EXPECT_TRUE(set_state_covariances(process, out));
    set_co_state_covariances(process, out);
    return out;
  }
};

inline Reference reference_of(const Model<double>& model) {
  const Digits precision(digits);
  return reference(model.cast<Real>(), random_state(model, seed).q.cast<Real>());
}

}  // namespace kalmarm::test
