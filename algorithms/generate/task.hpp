// What a function of generated code works out, and the record of it: the kernels of the fast path, run once on
// numbers that record (recorded.hpp).
#pragma once

#include <string>
#include <vector>

#include "algorithms/generate/graph.hpp"
#include "algorithms/model/model.hpp"
#include "kalmarm/question.hpp"
#include "kalmarm/tolerance.hpp"

namespace kalmarm {

// Judged: with the estimated error, and the least margin of what the result rests on.
enum class GeneratedTask {
  forward_dynamics,  // a = M^-1 (tau - bias)
  judged_forward_dynamics,
  inverse_dynamics,  // tau = M qdd + bias
  mass,              // M
  inverse_mass,      // M^-1
  judged_inverse_mass,
  diagonal,  // of M^-1
  judged_diagonal,
  solve,  // M^-1 tau
  judged_solve,
  operational,         // J M^-1 J' of the question's frames
  derivatives,         // of a with respect to q, qd and tau, each by columns
  judged_derivatives,  // whose margin alone is told
  implicit_step,  // a of a step with springs and dampers at hinges and slides, whose gains are inputs
  judged_implicit_step,
};

inline constexpr GeneratedTask generated_tasks[] = {
    GeneratedTask::forward_dynamics,
    GeneratedTask::judged_forward_dynamics,
    GeneratedTask::inverse_dynamics,
    GeneratedTask::mass,
    GeneratedTask::inverse_mass,
    GeneratedTask::judged_inverse_mass,
    GeneratedTask::diagonal,
    GeneratedTask::judged_diagonal,
    GeneratedTask::solve,
    GeneratedTask::judged_solve,
    GeneratedTask::operational,
    GeneratedTask::derivatives,
    GeneratedTask::judged_derivatives,
    GeneratedTask::implicit_step,
    GeneratedTask::judged_implicit_step,
};

// Operations of a function beyond which the library answers one state faster: its code does not stay in the first
// cache, or the library has columns that share registers (docs/generated.md, Times).
int most_operations_of_one_state(GeneratedTask task);

// Of the function and the command line.
std::string to_string(GeneratedTask task);

// An argument of a function: an array of so many numbers, one after another among the graph's inputs or outputs.
struct Argument {
  std::string name;
  int size;
};

struct TaskRecord {
  GeneratedTask task = {};
  Graph graph;
  std::vector<Argument> inputs, outputs;
  std::vector<int> results;  // nodes
};

// `input`: three numbers of every call, in the base's axes [m/s^2], of tasks that it enters.
enum class Gravity { constant, input };

// By kernels whose constants are rounded to S (float or double). Of the question:
//   dofs        results are those of these DoF; empty: of all
//   frames      of `operational`, which needs some
//   acted_on    the input `forces`, six numbers a frame in its own axes (kalmarm/dynamics.hpp)
//   loaded      the input `loads`, ten numbers a frame (likewise)
//   at_rest     qd is zero, and no input
// tolerance: by which a judged task accepts. `want` is the task's, contacts are none; joints that are locked are left out before (reduction.hpp).
template <class S>
TaskRecord record(GeneratedTask task, const Model<double>& model, const Question& question = {},
                  double tolerance = default_tolerance<S>, Gravity gravity = Gravity::constant);

}  // namespace kalmarm
