// What rounding does to P-(k), beside the link's own body: for the test of every sweep
// (covariance/rounding_test.hpp).
//
// Errors of P of link k are below c u N in the order of positive semidefinite matrices, with a
// diagonal N whose entries are sums of P's (rounding_bound.hpp). They are charged to link k's P-:
//   P(i,i)                      the body's numbers, sums over children, the joint's update
//   P(x,x) + P(y,y) for x, y    Rz of the link's own joint. It leaves the row of zeros alone, so its
//                               errors are those of a P- that differs by no more; Tz(d) likewise
//   a turn's other axis, and p(i)^2 P(j,j) for moments     Rx, Rz and T(p) of children's phi
// The body M absorbs N where N <= e M, and trace(N M^-1) is such an e:
//   c u N <= e M,  e = c u sum over i of w(i) P(i,i)                                      (1)
// with weights w that depend on the robot alone. Where all joints from link k to the base have
// parallel axes, moments about z and forces along x and y are a problem of their own, and the only
// one on which a D depends: the weights of the others are 0.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <type_traits>
#include <vector>

#include "algorithms/fast/claims/arithmetic.hpp"
#include "algorithms/fast/claims/claims.hpp"
#include "algorithms/fast/claims/constants.hpp"
#include "algorithms/fast/lowering/least_inertia.hpp"
#include "algorithms/spatial/spatial.hpp"

namespace kalmarm {

// c of (1), times u, in units of the error that is accepted. A trace is up to six times the largest eigenvalue
// of N, which is what counts.
template <class S>
S rounding_unit(double error_of_D) {
  return S(rounding_constant_of_P / (6 * error_of_D)) * unit_roundoff<S>();
}

namespace detail {

// Squares of the largest terms that the bias of a link alone is summed from, over w^4: rows of its
// tensor and h, since b = (w x I w;  W h).
struct BiasTerms {
  Eigen::Array3d moments;
  double force;
};

template <class S>
BiasTerms bias_terms(const LoweredBody<S>& body) {
  const auto square = [](const S& x) { return static_cast<double>(x) * static_cast<double>(x); };
  const double xy = square(body.Ixy), xz = square(body.Ixz), yz = square(body.Iyz);
  const double x = square(body.Ixx) + xy + xz, y = xy + square(body.Iyy) + yz,
               z = xz + yz + square(body.Izz);
  return {{y + z, x + z, x + y}, square(body.h[0]) + square(body.h[1]) + square(body.h[2])};
}

// The largest that P's moments and forces of a link can be, wherever the joints stand. Where slides let
// its bodies go any distance, moment has no meaning. Of the robot's own bodies.
struct Largest {
  double moment = 0, force = 0;
  bool unbounded = false;
  bool loaded = false;  // by what a call may add to them
};

template <class S>
class WeightsOfLinks {
 public:
  // Bodies are written to; covariances: free_covariances; unit: rounding_unit. Of runs at once, only the
  // last DoF is tested.
  static std::vector<Largest> set(const std::vector<LoweredLink<S>>& links,
                                  const std::vector<LinkRun>& runs,
                                  const std::vector<Eigen::Matrix<double, 6, 6>>& covariances,
                                  double unit, std::vector<LoweredBody<S>>& bodies) {
    const int n = static_cast<int>(links.size());
    WeightsOfLinks all(links);
    std::vector<char> between(n, 0);
    for (const LinkRun& run : runs)
      for (int k = run.first; run.at_once && k < run.last; ++k) between[k] = 1;
    for (int k = 0; k < n; ++k) {
      all.weigh(k, links, covariances[k], unit, bodies[k]);
      if (between[k]) bodies[k].weights.leave_to_the_last();
    }
    std::vector<Largest> largest(n);
    std::vector<char> pending(n, 0);
    for (int k = n - 1; k >= 0; --k) {
      RoundingWeights<S>& w = bodies[k].weights;
      all.add_body(bodies[k], largest[k]);
      largest[k].loaded |= links[k].loaded;
      const bool bounded =
          !largest[k].unbounded && !largest[k].loaded && !links[k].slides && w.moment < S(no_body);
      const double most = bounded ? all.most(w, largest[k]) : no_body;
      w.tested = pending[k] || (!between[k] && !(most < 0.5));
      const int parent = links[k].parent;
      if (parent < 0) continue;
      if (w.tested) pending[parent] = 1;
      if (largest[k].unbounded || links[k].slides) largest[parent].unbounded = true;
      largest[parent].loaded |= largest[k].loaded;
      all.add_child(links[k], largest[k], largest[parent]);
    }
    return largest;
  }

 private:
  struct Children {
    Eigen::Array3d squares = Eigen::Array3d::Zero();  // the largest of p(i)^2
    bool tilted = false, turned = false;
  };

  explicit WeightsOfLinks(const std::vector<LoweredLink<S>>& links) : children_(links.size()) {
    for (const LoweredLink<S>& link : links) {
      if (link.parent < 0) continue;
      Children& at = children_[link.parent];
      const double d = link.slides ? 0 : static_cast<double>(link.d);
      const double aside = square(d * static_cast<double>(link.alpha.s));
      const Eigen::Array3d along(link.turned ? aside : 0, aside,
                                 square(d * static_cast<double>(link.alpha.c)));
      const Eigen::Array3d p = link.p.template cast<double>().array();
      at.squares = at.squares.max(p * p + along);
      at.tilted |= link.alpha.s != S(0);
      at.turned |= link.turned;
    }
  }

  static double square(double x) { return x * x; }

  void weigh(int k, const std::vector<LoweredLink<S>>& links,
             const Eigen::Matrix<double, 6, 6>& covariance, double unit,
             LoweredBody<S>& body) const {
    const LoweredLink<S>& link = links[k];
    const bool on_a_screw = link.kind == LoweredLink<S>::Kind::screws;
    const Children& children = children_[k];
    Eigen::Array<double, 6, 1> own = covariance.diagonal();
    if (!own.allFinite()) own.setZero();
    Eigen::Array<double, 6, 1> w = own;
    const auto turn = [&](int i, int j) {
      for (const int block : {0, 3}) {
        w[block + i] += own[block + j];
        w[block + j] += own[block + i];
      }
    };
    const auto move = [&](const Eigen::Array3d& squares) {
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          if (i != j) w[3 + j] += squares[3 - i - j] * own[i];
    };
    turn(0, 1);
    if (!on_a_screw) turn(1, 2), turn(0, 2);
    if (on_a_screw && !link.slides) move({0, 0, square(static_cast<double>(link.d))});
    if (children.tilted) turn(1, 2);
    if (children.turned) turn(0, 1);
    move(children.squares);

    const bool absorbs = own.maxCoeff() > 0;
    const auto weight = [&](double x) {
      return S(absorbs ? std::min(x * unit, no_body) : no_body);
    };
    RoundingWeights<S>& out = body.weights;
    out.unit = S(unit);
    out.Axx = weight(w[0]);
    out.Ayy = weight(w[1]);
    out.Azz = weight(w[2]);
    out.Cxx = weight(w[3]);
    out.Cyy = weight(w[4]);
    out.Czz = weight(w[5]);
    out.moment = weight(own.head<3>().sum());
    out.force = weight(own.tail<3>().sum());
    out.reach = S(children.squares.sum());
    const BiasTerms terms = bias_terms(body);
    if (absorbs)
      out.bias = weight((w.head<3>() * terms.moments).sum() + w.tail<3>().sum() * terms.force);
  }

  static void add_body(const LoweredBody<S>& body, Largest& to) {
    to.moment += static_cast<double>(body.Ixx + body.Iyy + body.Izz) / 2;
    to.force += static_cast<double>(body.m);
  }

  // Polar moments, of a child's side stretched out.
  static void add_child(const LoweredLink<S>& link, const Largest& child, Largest& to) {
    using std::sqrt;
    const Vector3<double> p = link.p.template cast<double>();
    const double away = p.norm() + std::abs(static_cast<double>(link.d));
    to.moment += square(sqrt(child.moment) + away * sqrt(child.force));
    to.force += child.force;
  }

  // Of e in (1), in units of what is not answered.
  static double most(const RoundingWeights<S>& w, const Largest& P) {
    return static_cast<double>(w.Axx + w.Ayy + w.Azz) * P.moment +
           static_cast<double>(w.Cxx + w.Cyy + w.Czz) * P.force;
  }

  std::vector<Children> children_;
};

}  // namespace detail

}  // namespace kalmarm
