// How wrong an answer is, in one state of one robot, for one task: a, or M^-1.
//
// The error is that of measures.hpp: |da| / |a| of an acceleration, max |dX_ij| / sqrt(X_ii X_jj)
// of X = M^-1. It is against the robot as its file gives it, in float64: that of float32 includes
// the rounding of the robot's parameters. States are such that float32 holds them exactly.
//
// Two kinds of truth. A search asks a Judge some thousand times, which compares with a variant that
// is accurate enough to tell the error: float32 with FactoredBias<ArrayGivens> in float64, right to
// 1e-13; float64 with WideRefined<FactoredBias<ArrayGivens>>, right to 4e-16. What a search has
// found is looked at again by `verify`, against multi-precision (truth.hpp).
//
// Where torque, gravity and velocity nearly cancel, digits of a are lost by subtraction whatever
// the algorithm: a state in which |a| is less than a tenth of what one of them causes by itself is
// no fair one.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "algorithms/study/solver.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm::limits {

// The ladder at its default tolerance, a Cholesky factorisation, and the ladder to the last bits.
inline constexpr std::array variants = {"Ladder<default>", "Batch<SparseLTDL>",
                                        "Ladder<last_bits>"};
inline constexpr int searched_variants = 2;  // the first; the last is as accurate as its judge

struct Answer {
  double error = 0;  // NaN where it was refused, 1e300 for what is larger or no number
  bool refused = false, warned = false;

  bool silent() const;  // more than 1 % wrong, neither refused nor warned
};

// The state in numbers that float32 holds.
State held_by_float(const State& state);

// T: float or double, the precision of the variants.
template <class T>
class Judge {
 public:
  Judge(const Model<double>& model, Want task);  // acceleration or inverse

  // The state that is judged next. 1 where it is a fair one; below 1 where it is not, and by how
  // much: |a| over a tenth of the largest part. 0 where even what is compared with refuses.
  double set_state(const State& state);

  Answer operator()(int variant);

 private:
  double fairness();

  Want task_;
  State state_;
  std::unique_ptr<Solver<double>> reference_, plain_;
  std::vector<std::unique_ptr<Solver<T>>> solvers_;
  VectorX<double> zero_, a_, gravity_, bias_;  // a, and of it what gravity, and velocity too, cause
  MatrixX<double> X_;
};

// Of every variant in float32, then in float64, against multi-precision. Empty where there is no
// truth: M is singular.
std::optional<std::vector<Answer>> verify(const Model<double>& model, Want task,
                                          const State& state);

}  // namespace kalmarm::limits
