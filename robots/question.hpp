// A question as users put it on a command line, in the names of their file (pruning/question.hpp).
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "algorithms/pruning/question.hpp"
#include "robots/scene.hpp"

namespace kalmarm {

struct QuestionOptions {
  std::vector<std::string> want, dofs, sites, locked, free, without;
  bool at_rest = false, no_pruning = false;

  // All but --want, whose words are a program's own.
  void add_to(CLI::App& app) {
    const auto list = [&](const char* name, std::vector<std::string>& values, const char* help) {
      return app.add_option(name, values, help)->delimiter(',');
    };
    list("--dofs", dofs, "joints that are asked about (patterns such as 'left_*'); else all");
    list("--site", sites, "sites or bodies of J M^-1 J' (want operational), 6 rows each");
    auto* const lock = list("--locked", locked,
                            "joints that stand still, JOINT or JOINT=VALUE [rad or m]; patterns");
    list("--free", free, "the only joints that are not locked")->excludes(lock);
    app.add_flag("--at-rest", at_rest, "velocities are zero");
    auto* const off = app.add_flag("--no-pruning", no_pruning, "leave nothing out, to compare");
    list("--without", without, "rules that are not to be used")->excludes(off);
  }

  // Whether it is about a part of the robot.
  bool selects() const { return !dofs.empty() || !locked.empty() || !free.empty(); }
};

// Joints are those of the file, and of several DoF all are meant; patterns are those of a shell.
// Locked joints stand where the file starts unless a value is given. Throws InputError: unknown
// names (with the nearest ones), joints that are locked and asked about, sites that are missing or
// not wanted.
Question question_of(const Scene& scene, const QuestionOptions& options);

// The rules that are left by --no-pruning and --without. Throws InputError where one is unknown.
std::set<Rule> rules_of(const QuestionOptions& options);

// The state as the question has it: where a joint is locked and what is at rest is overwritten.
State asked_state(const Scene& scene, const Question& question, State state);

// The same of a state that a user gave. Throws InputError with `where` if it says otherwise.
State checked_state(const Scene& scene, const Question& question, const State& state,
                    const std::string& where);

}  // namespace kalmarm
