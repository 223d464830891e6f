// Which variant, and which precision, is enough for a robot in given states?
//
// What is lost, in units of the unit roundoff u, is worked out in float64 at every state:
//   cancellation  R = max over k of scale(k) / D(k), by the recursion S of singularity.hpp
//   parameters    kS: what rounding the parameters costs, whatever the algorithm
//                 (structured_condition.hpp)
//   observed      |a - a'| / (u |a'|), a by Sequential<Conventional>, a' by the recommended one:
//                 it sees what velocities and gravity cost
//   cholesky      the condition bound of M scaled to unit diagonal (condition.hpp)
// What a variant errs by is predicted as
//   Sequential<Conventional>    acceleration: margin u max(R, kS, observed); inverse: margin u R
//   Batch<SparseLTDL>           inverse: margin u cholesky
//   the recommended one         margin (u + u_wide max(R, kS)), for the inverse without kS: what
//                               is left is lost in the residual, in long double
//   the same in float32         margin u kS, since its parameters are rounded; inverse: R for kS
// The cheapest with a prediction within the tolerance is chosen, float32 before float64: it takes
// half the memory, and as long. The last one is recommended where nothing is, or where the chosen
// one fails or warns; it estimates its own error.
//
// margin = 16: on the quick families of `stress` and on 1500 wild mechanisms an acceleration errs
// by at most 10 u max(R, kS, observed), 1.6 u max(...) in 99 per cent of the quick cases; an
// inverse by at most 2.7 u R and 4.2 u cholesky.
#pragma once

#include <memory>
#include <string>

#include "accuracy/task.hpp"
#include "algorithms/model/model.hpp"

namespace kalmarm {

inline constexpr const char* recommended_variant = "WideRefined<FactoredBias<ArrayGivens>>";

// In units of u; infinite where nothing is left.
struct Loss {
  double cancellation = 1, parameters = 1, observed = 1, cholesky = 1;

  void worsen(const Loss& other);  // the larger of each
};

// Of the task in position q. 0.3 ms for 12 joints. Without cholesky that stays 1, and nothing
// is O(nv^2).
class LossPredictor {
 public:
  LossPredictor(const Model<double>& model, bool cholesky);
  ~LossPredictor();

  Loss operator()(const VectorX<double>& q, const Task<double>& task);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

struct Request {
  bool acceleration = true, inverse = false;
  double tolerance = 1e-6;     // on |da| / |a|, and on M^-1 scaled by its diagonal
  std::string precision = "";  // float32 or float64; empty: either
};

struct Choice {
  std::string variant, precision;
  double predicted = 0;  // error; beyond the tolerance where nothing is good enough
};

// Throws InputError where the tolerance is below u.
Choice recommend(const Loss& loss, const Request& request);

}  // namespace kalmarm
