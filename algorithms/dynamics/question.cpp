#include "kalmarm/question.hpp"

namespace kalmarm {

const std::set<Rule>& all_rules() {
  static const std::set<Rule> all{
      Rule::locked_joints,  Rule::untouched_trees, Rule::massless_branches,
      Rule::separate_trees, Rule::translations,    Rule::zero_terms,
      Rule::rest,           Rule::partial_answers};
  return all;
}

const char* to_string(Rule rule) {
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
    case Rule::zero_terms:
      return "zero_terms";
    case Rule::rest:
      return "rest";
    case Rule::partial_answers:
      return "partial_answers";
  }
  return "?";
}

const char* to_string(Want want) {
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
    case Want::operational_diagonal:
      return "operational_diagonal";
    case Want::solve:
      return "solve";
    case Want::inverse_dynamics:
      return "inverse_dynamics";
    case Want::derivatives:
      return "derivatives";
  }
  return "?";
}

}  // namespace kalmarm
