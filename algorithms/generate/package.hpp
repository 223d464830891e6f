// The files of a robot's generated code.
//
//   NAME.h          functions, sizes, names of the DoF, the home position
//   NAME.c          one state a call: C99, no library, no heap
//   NAME_rows.c     rows of states, one in every lane: C with vectors of gcc (12 or later) or clang
//   NAME_test.c     a program that compares NAME.c with the truth
//   NAME.md         what it computes
#pragma once

#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "algorithms/generate/task.hpp"

namespace kalmarm {

// What a function is to give: of its first results.
struct TaskCheck {
  struct Result {
    std::vector<double> truth = {};  // empty: not compared
    double bound = 0;                // of its error, relative in the Euclidean norm
  };

  GeneratedTask task;
  std::vector<std::vector<double>> inputs;
  std::vector<Result> results;
};

// What a judged function says of its errors in many states.
struct ErrorsTold {
  GeneratedTask task;
  int states = 0, refused = 0;     // refused: margin is not above 0
  double median = 0, largest = 0;  // of the others' errors
};

// Whether its last results are an error and a margin.
bool is_judged(const TaskRecord& record);

struct PackageOptions {
  std::string name;  // of the files and, as an identifier, of what they define
  std::vector<GeneratedTask> tasks = {};
  bool rows = false;
  std::optional<double> tolerance = {};  // of judged tasks; empty: default_tolerance<S>
  Question question = {};                // as task.hpp takes it
  std::vector<std::string> loaded = {};  // names of its frames
  std::vector<std::string> frames = {};
  Gravity gravity = Gravity::constant;
};

// Thrown where a function would be longer than compilers take.
struct TooLarge : std::invalid_argument {
  using std::invalid_argument::invalid_argument;
};

inline constexpr int most_generated_dofs = 100;  // the record of a matrix stays below 1 GB
inline constexpr int most_generated_operations =
    100'000;  // of a function; gcc takes a minute for so many

// S: float or double. home: nq numbers.
template <class S>
class Package {
 public:
  // Throws TooLarge.
  Package(const Model<double>& model, const std::vector<double>& home,
          const PackageOptions& options);
  // Of records that are there, in the place of the options' tasks.
  Package(const Model<double>& model, const std::vector<double>& home,
          const PackageOptions& options, std::vector<TaskRecord> records);

  const std::vector<TaskRecord>& records() const { return records_; }

  // By names of files.
  std::map<std::string, std::string> files(const std::vector<TaskCheck>& checks,
                                           const std::vector<ErrorsTold>& errors = {}) const;

 private:
  std::string header() const;
  std::string one_state() const;
  std::string rows() const;
  std::string test(const std::vector<TaskCheck>& checks) const;
  std::string description(const std::vector<ErrorsTold>& errors) const;
  std::vector<std::string> question() const;             // a line each
  std::string function(const TaskRecord& record) const;  // its name
  std::string row_function(const TaskRecord& record) const;

  PackageOptions options_;
  std::string id_;
  std::vector<TaskRecord> records_;
  std::vector<double> home_;
  std::vector<std::string> dofs_;         // enumerators
  std::vector<std::string> asked_;        // of results, where they are of some
  std::vector<std::string> coordinates_;  // and of first entries of q, with their values
  int nq_, nv_;
};

}  // namespace kalmarm
