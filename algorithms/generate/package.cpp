#include "algorithms/generate/package.hpp"

#include <algorithm>
#include <cstdio>
#include <set>
#include <type_traits>

#include "algorithms/generate/c_text.hpp"
#include "algorithms/generate/preamble.hpp"
#include "algorithms/generate/print_c.hpp"
#include "algorithms/spatial/sincos.hpp"
#include "kalmarm/tolerance.hpp"
#include "kalmarm/version.hpp"

namespace kalmarm {
namespace {

template <class S>
const char* c_type() {
  return std::is_same_v<S, float> ? "float" : "double";
}

// a of every x, with commas between.
template <class List, class Text>
std::string joined(const List& list, const Text& text, const char* between = ", ") {
  std::string out;
  for (const auto& x : list) out += (out.empty() ? "" : between) + text(x);
  return out;
}

template <class S>
std::string numbers(const std::vector<double>& x) {
  return joined(x, [](double number) { return c_number(static_cast<S>(number)); });
}

// Two digits, for people.
std::string short_number(double x) {
  char out[32];
  std::snprintf(out, sizeof out, "%.1e", x);
  return out;
}

std::string in_capitals(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return name;
}

// Of a function of one state, or of its kernel; results overlap nothing where the function itself is.
std::string arrays(const TaskRecord& record, const std::string& type,
                   const std::string& of_results = "") {
  const auto array = [](const Argument& x, const std::string& how) {
    return x.name + "[" + how + std::to_string(x.size) + "]";
  };
  return joined(record.inputs,
                [&](const Argument& x) { return "const " + type + " " + array(x, ""); }) +
         ", " + joined(record.outputs, [&](const Argument& x) {
           return type + " " + array(x, of_results);
         });
}

// Of a function of rows.
std::string pointers(const TaskRecord& record, const std::string& type) {
  return joined(record.inputs, [&](const Argument& x) { return "const " + type + " *" + x.name; }) +
         ", " + joined(record.outputs, [&](const Argument& x) { return type + " *" + x.name; });
}

FunctionsUsed used_by(const std::vector<TaskRecord>& records) {
  FunctionsUsed out;
  for (const TaskRecord& record : records) {
    const std::vector<int> uses = record.graph.uses(record.results);
    for (std::size_t i = 0; i < uses.size(); ++i) {
      if (uses[i] == 0) continue;
      const Operation operation = record.graph.nodes()[i].operation;
      out.sines |= operation == Operation::sine || operation == Operation::cosine;
      out.roots |= operation == Operation::square_root;
    }
  }
  return out;
}

const char* meaning(GeneratedTask task) {
  switch (task) {
    case GeneratedTask::forward_dynamics:
      return "accelerations a = M^-1 (tau - bias)";
    case GeneratedTask::judged_forward_dynamics:
      return "accelerations a = M^-1 (tau - bias); error: of a, relative, in the norm of M";
    case GeneratedTask::inverse_dynamics:
      return "torques tau = M qdd + bias";
    case GeneratedTask::mass:
      return "mass matrix M, row by row";
    case GeneratedTask::inverse_mass:
      return "X = M^-1, row by row";
    case GeneratedTask::judged_inverse_mass:
      return "X = M^-1, row by row; error: of X(i,j), relative to sqrt(X(i,i) X(j,j))";
    case GeneratedTask::diagonal:
      return "x(i) = M^-1(i,i)";
    case GeneratedTask::judged_diagonal:
      return "x(i) = M^-1(i,i); error: of x(i), relative";
    case GeneratedTask::solve:
      return "x = M^-1 tau";
    case GeneratedTask::judged_solve:
      return "x = M^-1 tau; error: of x, relative, in Euclid's norm";
    case GeneratedTask::operational:
      return "X = J M^-1 J', row by row: moments, then forces, of each frame in its own axes";
    case GeneratedTask::derivatives:
    case GeneratedTask::judged_derivatives:
      return "a = M^-1 (tau - bias), and da/dq, da/dqd and da/dtau = M^-1, column by column; q is "
             "varied along qd";
    case GeneratedTask::implicit_step:
      return "a = (v - qd)/h of a step to v: M a = tau - bias - damping v - stiffness (q + h v - "
             "reference), of hinges and slides";
    case GeneratedTask::judged_implicit_step:
      return "a = (v - qd)/h of a step to v: M a = tau - bias - damping v - stiffness (q + h v - "
             "reference), of hinges and slides; error: of a, relative, in the norm of M + h "
             "damping "
             "+ h^2 stiffness";
  }
  return "";
}

// In a cell of a table of Markdown.
std::string in_cell(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '|' ? std::string("\\|") : std::string(1, c);
  return out;
}

std::string table_of(const std::vector<ErrorsTold>& errors) {
  std::string out =
      "\nErrors that they tell in random states, positions in the joints' ranges, velocities and "
      "torques drawn from N(0, 1):\n\n"
      "| task | states | median | largest | not to be used |\n|---|---|---|---|---|\n";
  for (const ErrorsTold& of : errors) {
    out += "| `" + to_string(of.task) + "` | " + std::to_string(of.states) + " | ";
    out += of.refused < of.states ? short_number(of.median) + " | " + short_number(of.largest)
                                  : "- | -";
    out += " | " + std::to_string(of.refused) + " |\n";
  }
  return out;
}

constexpr const char* of_margin =
    "not above 0, or NaN, where rounding may have moved a result further than is accepted, which "
    "is then not to be used";

template <class S>
std::vector<TaskRecord> records_of(const Model<double>& model, const PackageOptions& options) {
  if (model.nv() > most_generated_dofs)
    throw TooLarge(std::to_string(model.nv()) + " DoF; code is generated for at most " +
                   std::to_string(most_generated_dofs));
  std::vector<TaskRecord> out;
  const double tolerance = options.tolerance.value_or(default_tolerance<S>);
  for (const GeneratedTask task : options.tasks)
    out.push_back(record<S>(task, model, options.question, tolerance, options.gravity));
  return out;
}

constexpr const char* generated = "generated by Kalmarm " KALMARM_VERSION;

}  // namespace

bool is_judged(const TaskRecord& record) {
  const auto& out = record.outputs;
  return std::any_of(out.begin(), out.end(), [](const Argument& x) { return x.name == "margin"; });
}

template <class S>
Package<S>::Package(const Model<double>& model, const std::vector<double>& home,
                    const PackageOptions& options)
    : Package(model, home, options, records_of<S>(model, options)) {}

template <class S>
Package<S>::Package(const Model<double>& model, const std::vector<double>& home,
                    const PackageOptions& options, std::vector<TaskRecord> records)
    : options_(options),
      id_(c_identifier(options.name)),
      records_(std::move(records)),
      home_(home),
      nq_(model.nq()),
      nv_(model.nv()) {
  if (id_.empty() || (id_[0] >= '0' && id_[0] <= '9')) id_ = "robot_" + id_;
  std::set<std::string> taken;
  for (int k = 0; k < nv_; ++k) {
    dofs_.push_back(unique_identifier(id_ + "_dof_", model.name(k), taken));
    const Joint<double>& joint = model.joint(k);
    if (joint.coordinate != Coordinate::follower)
      coordinates_.push_back(unique_identifier(id_ + "_q_", model.name(k), taken) + " = " +
                             std::to_string(joint.q_index));
  }
  for (const int k : options.question.dofs)
    asked_.push_back(unique_identifier(id_ + "_asked_", model.name(k), taken));
  for (const TaskRecord& record : records_) {
    const int flops = record.graph.count(record.results).flops();
    if (flops > most_generated_operations)
      throw TooLarge(to_string(record.task) + " takes " + std::to_string(flops) +
                     " operations; code is generated for at most " +
                     std::to_string(most_generated_operations));
  }
}

template <class S>
std::string Package<S>::function(const TaskRecord& record) const {
  return id_ + "_" + to_string(record.task);
}
template <class S>
std::string Package<S>::row_function(const TaskRecord& record) const {
  return function(record) + "_rows";
}

template <class S>
std::vector<std::string> Package<S>::question() const {
  const auto listed = [](const std::vector<std::string>& names) {
    return joined(names, c_identifier);
  };
  std::vector<std::string> out;
  if (options_.question.at_rest) out.push_back("At rest: qd is zero, and no input");
  if (!options_.loaded.empty())
    out.push_back(
        "loads: of what each of these frames carries, m, m c (3), and Ixx, Iyy, Izz, Ixy, "
        "Ixz, Iyz about its origin and in its axes: " +
        listed(options_.loaded));
  if (options_.gravity == Gravity::input) out.push_back("gravity: in the base's axes, m/s^2");
  if (!options_.frames.empty()) out.push_back("J is of the frames " + listed(options_.frames));
  return out;
}

template <class S>
std::string Package<S>::header() const {
  const std::string guard = in_capitals(id_) + "_H", nq = std::to_string(nq_),
                    nv = std::to_string(nv_);
  std::string out = std::string("/* Dynamics of one robot, ") + generated +
                    ". Units: m, kg, s, rad. */\n#ifndef " + guard + "\n#define " + guard + "\n\n";
  if (options_.rows) out += "#include <stddef.h>\n\n";
  out += "#ifdef __cplusplus\nextern \"C\" {\n#endif\n\n";
  out += "enum { " + id_ + "_nq = " + nq + ", " + id_ + "_nv = " + nv + " };\n\n";
  int k = 0;
  out += "/* Of a degree of freedom: its number in qd, qdd, tau and a. */\nenum {\n  " +
         joined(
             dofs_, [&](const std::string& name) { return name + " = " + std::to_string(k++); },
             ",\n  ") +
         "\n};\n\n";
  k = 0;
  if (!asked_.empty())
    out += "/* Results are of these DoF. */\nenum {\n  " +
           joined(
               asked_, [&](const std::string& name) { return name + " = " + std::to_string(k++); },
               ",\n  ") +
           "\n};\n\n";
  out += "/* Of a joint: its first number in q. */\nenum {\n  " +
         joined(
             coordinates_, [](const std::string& name) { return name; }, ",\n  ") +
         "\n};\n\n";
  out += std::string("extern const ") + c_type<S>() + " " + id_ + "_home[" + nq + "]; /* q */\n\n";
  out += "/* Results must not overlap inputs. */\n\n";
  if (std::any_of(records_.begin(), records_.end(), is_judged))
    out += std::string("/* margin: ") + of_margin + ". */\n\n";
  for (const std::string& line : question()) out += "/* " + line + ". */\n\n";
  for (const TaskRecord& record : records_) {
    out += std::string("/* ") + meaning(record.task) + " */\nvoid " + function(record) + "(" +
           arrays(record, c_type<S>()) + ");\n";
    if (options_.rows)
      out += "void " + row_function(record) + "(size_t rows, " + pointers(record, c_type<S>()) +
             ");\n";
    out += "\n";
  }
  return out + "#ifdef __cplusplus\n}\n#endif\n\n#endif\n";
}

template <class S>
std::string Package<S>::one_state() const {
  std::string out = std::string("/* ") + generated + ": one state a call, C99. */\n#include \"" +
                    options_.name + ".h\"\n\n";
  out += preamble_of_one_state<S>(used_by(records_));
  out += std::string("\nconst ") + c_type<S>() + " " + id_ + "_home[" + std::to_string(nq_) +
         "] = {" + numbers<S>(home_) + "};\n";
  for (const TaskRecord& record : records_)
    out += "\nvoid " + function(record) + "(" + arrays(record, "number", "restrict ") + ")\n{\n" +
           c_statements<S>(record) + "}\n";
  return out;
}

template <class S>
std::string Package<S>::rows() const {
  std::string out =
      std::string("/* ") + generated +
      ": rows of states, one in every lane; gcc from 12 on, or clang. */\n#include \"" +
      options_.name + ".h\"\n\n" + preamble_of_rows<S>(used_by(records_));
  for (const TaskRecord& record : records_) {
    out += "\nstatic void " + to_string(record.task) + "(" + arrays(record, "number", "restrict ") +
           ")\n{\n" + c_statements<S>(record) + "}\n\n";
    out += "void " + row_function(record) + "(size_t rows, " + pointers(record, "real") + ")\n{\n";
    const auto of = [](const Argument& x) { return x.name + "_lanes"; };
    for (const auto* list : {&record.inputs, &record.outputs})
      for (const Argument& x : *list)
        out += "  number " + of(x) + "[" + std::to_string(x.size) + "];\n";
    out +=
        "  for (size_t row = 0; row < rows; row += LANES) {\n"
        "    const size_t left = rows - row, states = left < (size_t)LANES ? left : "
        "(size_t)LANES;\n";
    for (const Argument& x : record.inputs) {
      const std::string width = std::to_string(x.size);
      out += "    load(" + x.name + " + row*" + width + ", " + width + ", states, left, " + of(x) +
             ");\n";
    }
    out += "    " + to_string(record.task) + "(" + joined(record.inputs, of) + ", " +
           joined(record.outputs, of) + ");\n";
    for (const Argument& x : record.outputs) {
      const std::string width = std::to_string(x.size);
      out +=
          "    store(" + of(x) + ", " + width + ", states, " + x.name + " + row*" + width + ");\n";
    }
    out += "  }\n}\n";
  }
  return out;
}

template <class S>
std::string Package<S>::test(const std::vector<TaskCheck>& checks) const {
  const std::string type = c_type<S>();
  std::string out = std::string("/* ") + generated +
                    ": compares its functions with the truth, worked out in multi-precision. "
                    "*/\n#include <stdio.h>\n\n#include \"" +
                    options_.name + ".h\"\n\n" +
                    "static int wrong;\n\n"
                    "/* |x - truth| <= bound |truth| */\n"
                    "static void compare(const char *what, int n, const " +
                    type +
                    " *x, const double *truth, double bound)\n"
                    "{\n"
                    "  double error = 0, size = 0;\n"
                    "  for (int i = 0; i < n; ++i) {\n"
                    "    error += (x[i] - truth[i])*(x[i] - truth[i]);\n"
                    "    size += truth[i]*truth[i];\n"
                    "  }\n"
                    "  if (error <= bound*bound*size) return;\n"
                    "  printf(\"%s: (error/|truth|)^2 is %g, at most %g is right\\n\", what, "
                    "error/size, bound*bound);\n"
                    "  ++wrong;\n"
                    "}\n\nint main(void)\n{\n";
  std::size_t answers = 0;
  for (const TaskCheck& check : checks) {
    const TaskRecord& record =
        *std::find_if(records_.begin(), records_.end(),
                      [&](const TaskRecord& one) { return one.task == check.task; });
    out += "  {\n";
    for (std::size_t i = 0; i < record.inputs.size(); ++i)
      out += "    static const " + type + " " + record.inputs[i].name + "[] = {" +
             numbers<S>(check.inputs[i]) + "};\n";
    for (const Argument& x : record.outputs)
      out += "    " + type + " " + x.name + "[" + std::to_string(x.size) + "];\n";
    const auto name = [](const Argument& x) { return x.name; };
    out += "    " + function(record) + "(" + joined(record.inputs, name) + ", " +
           joined(record.outputs, name) + ");\n";
    for (std::size_t i = 0; i < check.results.size(); ++i) {
      const auto& [truth, bound] = check.results[i];
      if (truth.empty()) continue;
      out += "    {\n      static const double truth[] = {" + numbers<double>(truth) +
             "};\n      compare(\"" + to_string(check.task) + "\", " +
             std::to_string(truth.size()) + ", " + record.outputs[i].name + ", truth, " +
             c_number(bound) + ");\n    }\n";
      ++answers;
    }
    out += "  }\n";
  }
  return out + "  printf(\"%d of " + std::to_string(answers) +
         " answers are wrong\\n\", wrong);\n  return wrong > 0;\n}\n";
}

template <class S>
std::string Package<S>::description(const std::vector<ErrorsTold>& errors) const {
  std::string out =
      "# " + id_ + "\nDynamics of one robot of " + std::to_string(nv_) +
      " degrees of freedom in `" + c_type<S>() + "`, " + generated +
      ". Units are m, kg, s and rad; q, qd and tau are in the order of the robot's file.\n\n"
      "| function | gives | additions, multiplications, divisions |\n|---|---|---|\n";
  for (const TaskRecord& record : records_)
    out += "| `" + function(record) + "` | " + in_cell(meaning(record.task)) + " | " +
           std::to_string(record.graph.count(record.results).flops()) + " |\n";
  if (std::any_of(records_.begin(), records_.end(), is_judged))
    out += std::string("\n`error` is an estimate. `margin`: ") + of_margin + ".\n";
  if (!errors.empty()) out += table_of(errors);
  for (const TaskRecord& record : records_)
    if (record.graph.count(record.results).flops() > most_operations_of_one_state(record.task))
      out += "\n`" + function(record) +
             "`: for one state Kalmarm's library is faster on the robots that were measured.\n";
  for (const std::string& line : question()) out += "\n" + line + ".\n";
  if (!asked_.empty())
    out += "\nResults are of the DoF " +
           joined(asked_, [](const std::string& x) { return "`" + x + "`"; }) + ".\n";
  const std::string& name = options_.name;
  out += "\n`" + name + ".c` is C99 without a library" +
         (used_by(records_).roots ? " but for `sqrt`" : "") + ", heap or branch on a state; `" +
         name +
         ".h` has its sizes, the numbers of its joints and the home position. Angles beyond " +
         c_number(detail::SinCosConstants<S>::farthest) +
         " rad give NaN.\n\n```sh\ncc -O3 -march=native -ffp-contract=fast -c " + name + ".c\n" +
         (options_.rows ? "cc -O3 -march=native -ffp-contract=fast -fno-math-errno -c " + name +
                              "_rows.c  # many states a call: gcc 12 or later, or clang\n"
                        : "") +
         "cc -O3 -march=native -ffp-contract=fast " + name + "_test.c " + name +
         ".c -lm && ./a.out  # compares with the truth\n```\n";
  return out;
}

template <class S>
std::map<std::string, std::string> Package<S>::files(const std::vector<TaskCheck>& checks,
                                                     const std::vector<ErrorsTold>& errors) const {
  std::map<std::string, std::string> out = {{options_.name + ".h", header()},
                                            {options_.name + ".c", one_state()},
                                            {options_.name + "_test.c", test(checks)},
                                            {options_.name + ".md", description(errors)}};
  if (options_.rows) out[options_.name + "_rows.c"] = rows();
  return out;
}

template class Package<float>;
template class Package<double>;

}  // namespace kalmarm
