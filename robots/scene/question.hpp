// A question as users put it on a command line, in the names of their file (kalmarm/question.hpp).
#pragma once

#include <string>
#include <vector>

#include "kalmarm/question.hpp"
#include "robots/scene/scene.hpp"

namespace CLI {
class App;
}

namespace kalmarm {

struct QuestionOptions {
  std::vector<std::string> want, dofs, sites, locked, free, without;
  std::vector<std::string> loaded;  // sites, bodies or links, as `sites`
  bool at_rest = false, no_pruning = false;

  // All but --want, whose words are a program's own.
  void add_to(CLI::App& app);
  // What is asked, without how: --dofs, --site, --locked, --free, --at-rest.
  void add_parts_to(CLI::App& app);

  // Whether it is about a part of the robot.
  bool selects() const { return !dofs.empty() || !locked.empty() || !free.empty(); }
};

// Joints are those of the file, and of several DoF all are meant; patterns are those of a shell.
// Locked joints stand where the file starts unless a value is given. Throws InputError: unknown
// names (with the nearest ones), joints that are locked and asked about, sites that are missing or
// not wanted.
Question question_of(const Scene& scene, const QuestionOptions& options);

// The rules that are left by --no-pruning and --without.
// Throws InputError where one is unknown.
std::set<Rule> rules_of(const QuestionOptions& options);

// The state as the question has it: where a joint is locked and what is at rest is overwritten.
State asked_state(const Scene& scene, const Question& question, State state);

// The same of a state that a user gave. Throws InputError with `where` if it says otherwise.
State checked_state(const Scene& scene, const Question& question, const State& state,
                    const std::string& where);

}  // namespace kalmarm
