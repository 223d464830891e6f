// What is asked of a robot, and the rules by which work is left out that the answer does not need.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "algorithms/model/site.hpp"

namespace kalmarm {

enum class Want {
  acceleration,  // a = M^-1 (tau - bias)
  inverse,       // M^-1
  diagonal,      // of M^-1
  log_det,       // log det M
  mass,          // M
  operational,   // J M^-1 J' of the sites: what forces there accelerate them by
};

// Joints that are locked stand still, at the positions in q; what is asked is of the mechanism with
// the others free. M and M^-1 are theirs.
struct Question {
  std::set<Want> want;
  std::vector<int> dofs;            // asked about, in rising order; empty: all that are free
  std::vector<Site<double>> sites;  // of Want::operational
  std::vector<int> locked;          // DoF, in rising order; of a joint all or none
  VectorX<double> q;                // nq: the entries of joints that are locked are used
  bool at_rest = false;             // qd is 0, and is not looked at
};

// What each leaves out stands in plan.hpp.
enum class Rule {
  locked_joints,
  untouched_trees,
  massless_branches,
  separate_trees,
  translations,
  planes,
  zero_terms,
  rest,
  partial_answers,
};

inline const std::vector<Rule>& all_rules() {
  static const std::vector<Rule> all{
      Rule::locked_joints,  Rule::untouched_trees, Rule::massless_branches, Rule::separate_trees,
      Rule::translations,   Rule::planes,          Rule::zero_terms,        Rule::rest,
      Rule::partial_answers};
  return all;
}

inline const char* to_string(Rule rule) {
  switch (rule) {
    case Rule::locked_joints:
      return "locked_joints";
    case Rule::untouched_trees:
      return "untouched_trees";
    case Rule::massless_branches:
      return "massless_branches";
    case Rule::separate_trees:
      return "separate_trees";
    case Rule::translations:
      return "translations";
    case Rule::planes:
      return "planes";
    case Rule::zero_terms:
      return "zero_terms";
    case Rule::rest:
      return "rest";
    case Rule::partial_answers:
      return "partial_answers";
  }
  return "?";
}

inline const char* to_string(Want want) {
  switch (want) {
    case Want::acceleration:
      return "acceleration";
    case Want::inverse:
      return "inverse";
    case Want::diagonal:
      return "diagonal";
    case Want::log_det:
      return "log_det";
    case Want::mass:
      return "mass";
    case Want::operational:
      return "operational";
  }
  return "?";
}

}  // namespace kalmarm
