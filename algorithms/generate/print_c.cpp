#include "algorithms/generate/print_c.hpp"

#include <map>

#include "algorithms/generate/c_text.hpp"

namespace kalmarm {
namespace {

bool is_sum(const Node& node) {
  return node.operation == Operation::add || node.operation == Operation::subtract;
}

template <class S>
class Printer {
 public:
  explicit Printer(const TaskRecord& record)
      : nodes_(record.graph.nodes()),
        uses_(record.graph.uses(record.results)),
        in_sum_(nodes_.size(), false),
        names_(nodes_.size()) {
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      if (uses_[i] == 0 || !is_sum(nodes_[i])) continue;
      for (const int operand : {nodes_[i].a, nodes_[i].b})
        in_sum_[operand] = uses_[operand] == 1 && nodes_[operand].operation == Operation::multiply;
    }
    name_inputs(record.inputs);
    name_results(record);
  }

  std::string run() {
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      if (uses_[i] == 0) continue;
      state(static_cast<int>(i));
      const auto [first, last] = results_.equal_range(static_cast<int>(i));
      for (auto result = first; result != last; ++result)
        text_ += "  " + result->second + " = " + as_number(result->first) + ";\n";
    }
    return std::move(text_);
  }

 private:
  void name_inputs(const std::vector<Argument>& inputs) {
    std::vector<std::string> entries;
    for (const Argument& input : inputs) {
      std::string unused = "  (void)" + input.name + ";\n";
      for (int i = 0; i < input.size; ++i)
        entries.push_back(input.name + "[" + std::to_string(i) + "]");
      unused_.push_back({entries.size(), unused});
    }
    std::vector<bool> used(entries.size(), false);
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      if (nodes_[i].operation != Operation::input) continue;
      names_[i] = entries[nodes_[i].a];
      used[nodes_[i].a] = uses_[i] > 0;
    }
    std::size_t first = 0;
    for (const auto& [end, line] : unused_) {
      bool any = false;
      for (; first < end; ++first) any |= used[first];
      if (!any) text_ += line;
    }
  }

  void name_results(const TaskRecord& record) {
    auto node = record.results.begin();
    for (const Argument& output : record.outputs)
      for (int i = 0; i < output.size; ++i)
        results_.emplace(*node++, output.name + "[" + std::to_string(i) + "]");
  }

  void state(int i) {
    const Node& node = nodes_[i];
    switch (node.operation) {
      case Operation::input:
      case Operation::constant:
      case Operation::negate:
        return;
      case Operation::sine:
      case Operation::cosine:
        names_[i] = of_angle(node);
        return;
      default:
        if (in_sum_[i]) return;
        names_[i] = "t" + std::to_string(statements_++);
        text_ += "  const number " + names_[i] + " = " + value(node) + ";\n";
    }
  }

  // Sine and cosine of an angle are worked out together, where the first is asked for.
  std::string of_angle(const Node& node) {
    const auto [known, is_new] = angles_.try_emplace(node.a, static_cast<int>(angles_.size()));
    const std::string number = std::to_string(known->second);
    if (is_new)
      text_ += "  number s" + number + ", c" + number + ";\n  sin_cos(" + as_number(node.a) +
               ", &s" + number + ", &c" + number + ");\n";
    return (node.operation == Operation::sine ? "s" : "c") + number;
  }

  std::string value(const Node& node) const {
    switch (node.operation) {
      case Operation::add:
        return operand(node.a) + " + " + operand(node.b);
      case Operation::subtract:
        return operand(node.a) + " - " + operand(node.b);
      case Operation::multiply:
        return operand(node.a) + "*" + operand(node.b);
      case Operation::divide:
        return operand(node.a) + "/" + operand(node.b);
      case Operation::square_root:
        return "root(" + as_number(node.a) + ")";
      case Operation::minimum:
        return "least(" + as_number(node.a) + ", " + as_number(node.b) + ")";
      case Operation::with_sign:
        return "with_sign(" + as_number(node.a) + ", " + as_number(node.b) + ")";
      default:
        return "zero_where_less(" + as_number(node.a) + ", " + as_number(node.b) + ", " +
               as_number(node.c) + ")";
    }
  }

  // Of a sum, product or quotient.
  std::string operand(int i) const {
    const Node& node = nodes_[i];
    if (node.operation == Operation::constant) return c_number(static_cast<S>(node.value));
    if (node.operation == Operation::negate) return "-" + operand(node.a);
    return in_sum_[i] ? value(node) : names_[i];
  }

  // By itself, where C does not make a number of a constant.
  std::string as_number(int i) const {
    const std::string text = operand(i);
    return nodes_[i].operation == Operation::constant ? "all(" + text + ")" : text;
  }

  const std::vector<Node>& nodes_;
  std::vector<int> uses_;
  std::vector<bool> in_sum_;
  std::vector<std::string> names_;
  std::multimap<int, std::string> results_;
  std::vector<std::pair<std::size_t, std::string>> unused_;  // end of an input, and what says so
  std::map<int, int> angles_;
  int statements_ = 0;
  std::string text_;
};

}  // namespace

template <class S>
std::string c_statements(const TaskRecord& record) {
  return Printer<S>(record).run();
}

template std::string c_statements<float>(const TaskRecord&);
template std::string c_statements<double>(const TaskRecord&);

}  // namespace kalmarm
