// What a variant of the registry is and can do, so that no program has to read it off a name.
#pragma once

#include <optional>
#include <set>
#include <string>

#include "kalmarm/dynamics.hpp"

namespace kalmarm {

// What factors M.
enum class VariantKind {
  composite,      // nothing: it gives M alone
  batch,          // a Cholesky factorisation of M
  sequential,     // the filter, D and g
  closed_form,    // the filter, M^-1 by Result 6.1
  factored_bias,  // the filter, with the bias among its square roots
  stacked,        // an orthogonal factorisation of all equations at once
  refined,        // another variant, and the residual of its answer
  scan,           // runs of links, combined two by two
  ladder,         // Dynamics at a tolerance: the first precision that is enough
  rung,           // one precision of the ladder alone
};

constexpr const char* to_string(VariantKind kind) {
  switch (kind) {
    case VariantKind::composite:
      return "composite";
    case VariantKind::batch:
      return "batch";
    case VariantKind::sequential:
      return "sequential";
    case VariantKind::closed_form:
      return "closed_form";
    case VariantKind::factored_bias:
      return "factored_bias";
    case VariantKind::stacked:
      return "stacked";
    case VariantKind::refined:
      return "refined";
    case VariantKind::scan:
      return "scan";
    case VariantKind::ladder:
      return "ladder";
    case VariantKind::rung:
      return "rung";
  }
  return "";
}

constexpr bool is_of_ladder(VariantKind kind) {
  return kind == VariantKind::ladder || kind == VariantKind::rung;
}

struct VariantTraits {
  VariantKind kind;
  bool contender = true;         // one to choose; else an exhibit of the accuracy laboratory
  bool in_world_frame = false;   // P stands in the world's axes
  bool dense = false;            // takes memory for nv x nv numbers, and time for nv^3
  bool mixed_precision = false;  // has factors of a lower precision than its results
  bool generated = false;        // code for one robot, which gives no verdict of its own
  std::optional<double> tolerance = {};  // of the ladder; empty: its default
  // Of the ladder: answers are refined in any case, and Outcome::error is in the norm of the task.
  bool refined = false;
  std::set<Want> wants = {Want::acceleration, Want::solve, Want::inverse};  // by itself
  std::string citation = "";

  bool gives(Want want) const { return wants.contains(want); }
};

}  // namespace kalmarm
