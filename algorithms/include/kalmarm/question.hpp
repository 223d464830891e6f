// What is asked of a robot, and the rules by which work is left out that the answer does not need.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "kalmarm/export.hpp"
#include "kalmarm/robot_model.hpp"

namespace kalmarm {

enum class Want {
  acceleration,          // a = M^-1 (tau - bias): forward dynamics
  inverse,               // M^-1
  diagonal,              // of M^-1
  log_det,               // log det M
  mass,                  // M
  operational,           // J M^-1 J' of the frames: what forces there accelerate them by
  operational_diagonal,  // of that
  solve,                 // factors of M, and M^-1 tau for any number of tau
  inverse_dynamics,      // tau = M qdd + bias, bias and gravity alone
  derivatives,           // of a with respect to q, qd and tau
};

// What is asked about the question's frames, and means nothing without any.
constexpr bool is_of_frames(Want want) {
  return want == Want::operational || want == Want::operational_diagonal;
}

// Joints that are locked stand still, at the positions in q; what is asked is of the mechanism with
// the others free. M and M^-1 are theirs.
struct Question {
  std::set<Want> want = {};        // empty: all, of frames where there are some
  std::vector<int> dofs = {};      // asked about, in rising order; empty: all that are free
  std::vector<Frame> frames = {};  // of Want::operational and its diagonal
  // On which forces act from outside (dynamics.hpp), each on the last DoF of a joint. On the base they do nothing;
  // a frame that is named twice has two.
  std::vector<Frame> acted_on = {};
  // Where contacts resist (dynamics.hpp), a row each, on the last DoF of a joint; of three directions at a point a
  // frame is named three times. On the base they do nothing.
  std::vector<Frame> contacts = {};
  // Where a state may add bodies (dynamics.hpp), each on the last DoF of a joint. On the base they do nothing.
  std::vector<Frame> loaded = {};
  std::vector<int> locked = {};  // DoF, in rising order; of a joint all or none
  std::vector<double> q = {};    // nq: the entries of joints that are locked are used
  bool at_rest = false;          // qd is 0, and is not looked at

  bool wants(Want what) const {
    return want.empty() ? !is_of_frames(what) || !frames.empty() : want.contains(what);
  }
};

// What each leaves out stands in docs/questions.md.
enum class Rule {
  locked_joints,
  untouched_trees,
  massless_branches,
  separate_trees,
  translations,
  zero_terms,
  rest,
  partial_answers,
};

KALMARM_EXPORT const std::set<Rule>& all_rules();

KALMARM_EXPORT const char* to_string(Rule rule);
KALMARM_EXPORT const char* to_string(Want want);

}  // namespace kalmarm
