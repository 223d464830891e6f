// A plan: what of a robot a question needs, worked out once per model, so that a call (answer.hpp)
// asks nothing but what to compute.
//
// rule               leaves out                           where
// locked_joints      the DoF of joints that are locked    any is: composite bodies
// (reduction.hpp) untouched_trees    trees without a DoF or site asked    the base carries several,
// and it is not
//                                                         log det M that is asked
// massless_branches  branches without inertia or noise    none of their DoF or sites is asked
// separate_trees     zero blocks of M and M^-1            the base carries several that are asked
// translations       angles                               a tree of slides alone (planar/)
// planes             3 of 6 dimensions                    a tree that moves in a plane (planar/)
// zero_terms         turns by zero and right angles       axes are parallel or at a right angle
//                                                         (structured/zero_terms.hpp)
// rest               velocity terms                       qd = 0
// partial_answers    the rest of M^-1                     its diagonal, a block of at most half its
//                                                         rows, sites or log det M are asked
// A tree hangs on the fixed base once joints are locked: a humanoid whose pelvis is locked has one
// for each limb.
//
// Without locked_joints they are links like others, held by a joint noise r = 1 / u^2, which leaves
// g = 0 and a = 0 (answer.hpp): the same answer at the price of the whole robot.
#pragma once

#include <vector>

#include "algorithms/pruning/question.hpp"
#include "algorithms/pruning/reduction.hpp"
#include "algorithms/structured/structured_model.hpp"

namespace kalmarm {

enum class Kernel { spatial, spatial_at_rest, planar, translational };

const char* to_string(Kernel kernel);

// Trees that are solved together.
struct Part {
  Reduction reduction;
  Kernel kernel = Kernel::spatial;
  Zeros zeros = Zeros::left_out;    // of a spatial kernel
  bool block = false;               // of M^-1 a block is asked for, and is worked out alone
  std::vector<int> asked;           // DoF of its model
  std::vector<int> site_index;      // in the question, of its sites
  std::vector<Site<double>> sites;  // on its links
};

// A rule that left something out, and the DoF of the whole that it is about.
struct Acted {
  Rule rule;
  std::vector<int> dofs;
};

struct Plan {
  Question question;
  int nv = 0;              // of the whole robot
  std::vector<int> asked;  // DoF of the whole, in the order of the answer
  std::vector<Part> parts;
  std::vector<Acted> acted;
  std::vector<int> singular;     // DoF that move no inertia, asked about: M has no inverse
  bool partial_answers = false;  // the rule holds, whether or not it had something to leave out
};

// The rules that a variant of the registry can follow: all on the fast path, others those that
// give it a smaller model.
std::set<Rule> rules_for(const std::string& variant);

Plan make_plan(const Model<double>& whole, const Question& question, const std::set<Rule>& rules);

}  // namespace kalmarm
