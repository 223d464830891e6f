// A plan: what of a robot a question needs, worked out once per model, so that a call
// (execution.hpp) decides nothing any more.
//
// rule               leaves out                           where
// locked_joints      the DoF of joints that are locked    any is: composite bodies (reduction.hpp)
// untouched_trees    trees without a DoF or frame asked   the base carries several, and it is not
//                                                         log det M that is asked
// massless_branches  branches without inertia or noise    none of their DoF or frames is asked, no force acts, no contact
//                                                         or load
// separate_trees     zero blocks of M and M^-1            the base carries several that are asked
// translations       angles                               a tree of slides alone, on which no force acts from outside, no
//                                                         contact and no load (fast/translational/)
// zero_terms         turns by zero and right angles       axes are parallel or at a right angle
//                                                         (fast/lowering/zero_terms.hpp)
// rest               velocity terms                       qd = 0
// partial_answers    the rest of M^-1                     its diagonal, a block of at most half its
//                                                         rows, frames or log det M are asked
//
// A tree hangs on the fixed base once joints are locked: a humanoid whose pelvis is locked has one
// for each limb. Without locked_joints they are links like others, held by a joint noise r = 1/u^2,
// which leaves g = 0 and a = 0: the same answer at the price of the whole robot.
#pragma once

#include <vector>

#include "algorithms/dynamics/reduction.hpp"
#include "algorithms/fast/engine/engine.hpp"
#include "kalmarm/question.hpp"

namespace kalmarm {

// Trees that are solved together.
struct Part {
  Reduction reduction;
  Kernel kernel = Kernel::spatial;
  Zeros zeros = Zeros::left_out;  // of a spatial kernel
  bool block = false;             // of M^-1 a block is asked for, and is worked out alone
  std::vector<int> asked;         // DoF of its model
  std::vector<int> frame_index;   // in the question, of its frames
  std::vector<Frame> frames;      // on its links
  std::vector<int> acted_index, contact_index, loaded_index;  // likewise, of the frames of calls
  CallFrames of_calls;
};

// A rule that left something out, and the DoF of the whole that it is about.
struct Acted {
  Rule rule;
  std::vector<int> dofs;
};

struct Plan {
  Question question;       // `want` and `q` are filled
  int nv = 0;              // of the whole robot
  std::vector<int> asked;  // DoF of the whole, in the order of the answer
  std::vector<Part> parts;
  std::vector<Acted> acted;
  std::vector<int> singular;     // DoF that move no inertia, asked about: M has no inverse
  bool partial_answers = false;  // the rule holds, whether or not it had something to leave out
};

// The rules that the fast path can follow within a tolerance. Other variants follow those that give them a
// smaller model: model_rules().
std::set<Rule> rules_for(double tolerance);
const std::set<Rule>& model_rules();

// Throws std::invalid_argument where the question contradicts itself or the model: DoF that are not
// there or not in rising order, locked and asked about, part of a joint locked, q of another size.
Plan make_plan(const Model<double>& whole, const Question& question, const std::set<Rule>& rules);

}  // namespace kalmarm
