// Which tolerance of Dynamics is enough for a robot in given states, and for rows of states, which
// lanes of float32 may answer, which precision?
//
// Every candidate answers the question in every state and is compared with the reference, Dynamics
// in float64 to its last bits, which knows its own error, e_ref = Outcome::error: infinite where it
// warns or fails.
// A candidate's error in a state, x from the candidate and x_ref from the reference:
//   acceleration, solve, inverse_dynamics   |x - x_ref| / |x_ref|                       (1)
//   inverse, mass, operational              max |x - x_ref|_ij / sqrt(x_ref_ii x_ref_jj) (2)
//   diagonal                                max |x - x_ref|_i / x_ref_i                 (3)
//   log_det                                 |x - x_ref|: relative, of det M             (4)
// In float32 it holds what rounding the parameters and the state costs. A state in which the
// candidate fails or warns counts as an infinite error. Over all states
//   predicted = margin max(u, worst error) + max e_ref                                  (5)
// with u of the candidate's precision.
//
// Of the candidates predicted within the tolerance the fastest is advised, but for those that are there
// to be compared with; of those whose times
// differ by no more than a clock can tell on a shared machine (`alike`) the first in the list:
// float32 stands before float64, since in batches it takes half the time.
//
// margin is for 500 times as many states of the same kind. Where |x| happens to be small a relative error
// is large. That all n numbers of x are below eps has a probability of about eps^n, so that among N times as
// many states the least |x| is about N^(1/n) times smaller:
//   margin = max(5, min(25, 500^(1/n))) of acceleration and solve, else 3                 (6)
// With it 200 states predict 1.1 to 12 times the largest error of a in 10^5 others, on each of the eleven
// shipped robots and in both precisions (test_advice.cpp). With a margin of 3 the prediction was 2.6 times too
// small on two_link, which has two joints, and 1.4 times on cassie. In the states themselves (5) cannot be below
// the error unless the reference errs and does not know it.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/advisor/trial.hpp"
#include "kalmarm/recommend.hpp"

namespace kalmarm {

struct Candidate {
  std::string variant;
  Precision precision;
  std::function<std::unique_ptr<Trial>()> make;
  bool advised = true;  // or else compared with alone
};

// Over all states.
struct Observation {
  double median = 0, worst = 0;  // error; infinite where the candidate failed or warned
  double predicted = 0;          // (5)
  int failures = 0, warnings = 0;
};

struct Advice {
  int candidate = 0;  // the most accurate where none is enough
  bool enough = false;
  std::string reason;
};

class Advisor {
 public:
  using Clock = std::function<double()>;  // [ns], since any moment
  static double steady_clock();

  // The question of `model`, with every want named; no derivatives. Throws std::invalid_argument.
  Advisor(const RobotModel& model, const Question& question, TrialStates states,
          Clock clock = steady_clock);
  ~Advisor();

  // In the order in which they are preferred.
  void add(Candidate candidate);
  // Dynamics in float64, and of rows in float32 before it, since lanes of float32 answer rows alone;
  // no tolerance: the default one of each.
  void add(std::optional<double> tolerance, const std::string& variant, bool in_rows);

  const std::vector<Candidate>& candidates() const;
  const Observation& observe(int candidate);  // once each: a call of every state
  double nanoseconds(int candidate);          // of a call, measured for all candidates at once
  Advice advise(double tolerance);            // throws std::invalid_argument below the roundoff

  const Question& question() const;
  const TrialStates& states() const;
  double reference_error() const;  // max e_ref; infinite where the reference fails or warns

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace kalmarm
