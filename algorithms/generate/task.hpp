// What a function of generated code works out, and the record of it: the kernels of the fast path, run once on
// numbers that record (recorded.hpp).
#pragma once

#include <string>
#include <vector>

#include "algorithms/generate/graph.hpp"
#include "algorithms/model/model.hpp"
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
};

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

// By kernels whose constants are rounded to S (float or double). tolerance: by which a judged task accepts.
template <class S>
TaskRecord record(GeneratedTask task, const Model<double>& model,
                  double tolerance = default_tolerance<S>);

}  // namespace kalmarm
