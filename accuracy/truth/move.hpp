// Parameters that are moved by a little each, up or down at random: what an answer that is as good
// as its parameters may differ by (structured_condition.hpp).
#pragma once

#include <boost/random/mersenne_twister.hpp>
#include <boost/random/uniform_smallint.hpp>
#include <cstdint>
#include <utility>
#include <vector>

#include "algorithms/model/model.hpp"

namespace kalmarm {

// One draw of signs s after another: x becomes x (1 + s delta).
template <class S>
class Move {
 public:
  Move(const S& delta, std::uint64_t seed) : up_(1 + delta), down_(1 - delta), random_(seed) {}

  void operator()(S& x) { x *= sign_(random_) ? up_ : down_; }

  template <class Derived>
  void operator()(Eigen::MatrixBase<Derived>& x) {
    for (S& entry : x.reshaped()) (*this)(entry);
  }

  template <class Vector>
  Vector moved(Vector x) {
    (*this)(x);
    return x;
  }

  Model<S> moved(const Model<S>& model) {
    std::vector<Joint<S>> joints;
    joints.reserve(model.nv());
    for (int k = 0; k < model.nv(); ++k) {
      Joint<S>& joint = joints.emplace_back(model.joint(k));
      (*this)(joint.ref);
      (*this)(joint.rotation.coeffs());
      (*this)(joint.translation);
      (*this)(joint.r);
      (*this)(joint.body.mass);
      (*this)(joint.body.com);
      (*this)(joint.body.axes.coeffs());
      (*this)(joint.body.moments);
    }
    return {std::move(joints), model.names(), model.nq(), moved(model.gravity())};
  }

 private:
  S up_, down_;
  boost::random::mt19937_64 random_;
  boost::random::uniform_smallint<int> sign_{0, 1};
};

}  // namespace kalmarm
