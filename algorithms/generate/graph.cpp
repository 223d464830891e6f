#include "algorithms/generate/graph.hpp"

#include <algorithm>
#include <cmath>

namespace kalmarm {

int Graph::node(Operation operation, int a, int b, int c, double value) {
  const auto [known, is_new] =
      known_.try_emplace({operation, a, b, c, value}, static_cast<int>(nodes_.size()));
  if (is_new) nodes_.push_back({operation, a, b, c, value});
  return known->second;
}

int Graph::input() { return node(Operation::input, inputs_++); }

// Of both zeros the positive one: they are equal, and so the same key.
int Graph::constant(double value) {
  return node(Operation::constant, -1, -1, -1, value == 0 ? 0 : value);
}

int Graph::add(int a, int b) {
  if (is_constant(a) && is_constant(b)) return constant(nodes_[a].value + nodes_[b].value);
  if (is_constant(a, 0)) return b;
  if (is_constant(b, 0)) return a;
  if (is_negated(b)) return subtract(a, nodes_[b].a);
  if (is_negated(a)) return subtract(b, nodes_[a].a);
  return node(Operation::add, std::min(a, b), std::max(a, b));
}

int Graph::subtract(int a, int b) {
  if (is_constant(a) && is_constant(b)) return constant(nodes_[a].value - nodes_[b].value);
  if (a == b) return constant(0);
  if (is_constant(b, 0)) return a;
  if (is_constant(a, 0)) return negate(b);
  if (is_negated(b)) return add(a, nodes_[b].a);
  return node(Operation::subtract, a, b);
}

int Graph::multiply(int a, int b) {
  if (is_constant(a) && is_constant(b)) return constant(nodes_[a].value * nodes_[b].value);
  for (const auto& [x, y] : {std::pair{a, b}, std::pair{b, a}}) {
    if (is_constant(x, 0)) return x;
    if (is_constant(x, 1)) return y;
    if (is_constant(x, -1)) return negate(y);
  }
  if (is_negated(a)) return negate(multiply(nodes_[a].a, b));
  if (is_negated(b)) return negate(multiply(a, nodes_[b].a));
  return node(Operation::multiply, std::min(a, b), std::max(a, b));
}

int Graph::divide(int a, int b) {
  if (is_constant(a) && is_constant(b)) return constant(nodes_[a].value / nodes_[b].value);
  if (is_constant(a, 0) || is_constant(b, 1)) return a;
  if (is_negated(a)) return negate(divide(nodes_[a].a, b));
  if (is_negated(b)) return negate(divide(a, nodes_[b].a));
  return node(Operation::divide, a, b);
}

int Graph::negate(int a) {
  const Node& at = nodes_[a];
  if (is_constant(a)) return constant(-at.value);
  if (is_negated(a)) return at.a;
  if (at.operation == Operation::subtract) return subtract(at.b, at.a);
  return node(Operation::negate, a);
}

int Graph::minimum(int a, int b) {
  if (a == b) return a;
  if (is_constant(a) && is_constant(b)) return nodes_[a].value < nodes_[b].value ? a : b;
  return node(Operation::minimum, a, b);
}

int Graph::zero_where_less(int a, int b, int c) {
  if (is_constant(a) && is_constant(b)) return nodes_[a].value < nodes_[b].value ? constant(0) : c;
  if (is_constant(c, 0)) return c;
  return node(Operation::zero_where_less, a, b, c);
}

int Graph::unary(Operation operation, int a) {
  if (is_constant(a)) {
    const double x = nodes_[a].value;
    return constant(operation == Operation::sine     ? std::sin(x)
                    : operation == Operation::cosine ? std::cos(x)
                                                     : std::sqrt(x));
  }
  return node(operation, a);
}

std::vector<int> Graph::uses(std::span<const int> outputs) const {
  std::vector<int> uses(nodes_.size(), 0);
  for (const int output : outputs) ++uses[output];
  for (int i = static_cast<int>(nodes_.size()) - 1; i >= 0; --i) {
    if (uses[i] == 0 || nodes_[i].operation == Operation::input) continue;
    for (const int operand : {nodes_[i].a, nodes_[i].b, nodes_[i].c})
      if (operand >= 0) ++uses[operand];
  }
  return uses;
}

OperationCount Graph::count(std::span<const int> outputs) const {
  const std::vector<int> needed = uses(outputs);
  OperationCount out;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (needed[i] == 0) continue;
    switch (nodes_[i].operation) {
      case Operation::input:
      case Operation::constant:
      case Operation::negate:
        break;
      case Operation::add:
      case Operation::subtract:
        ++out.sums;
        break;
      case Operation::multiply:
        ++out.products;
        break;
      case Operation::divide:
        ++out.quotients;
        break;
      default:
        ++out.others;
    }
  }
  return out;
}

template <class S>
std::vector<S> Graph::evaluate(std::span<const int> outputs, std::span<const S> inputs) const {
  const std::vector<int> needed = uses(outputs);
  std::vector<S> x(nodes_.size());
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (needed[i] == 0) continue;
    const auto& [operation, a, b, c, value] = nodes_[i];
    switch (operation) {
      case Operation::input:
        x[i] = inputs[a];
        break;
      case Operation::constant:
        x[i] = static_cast<S>(value);
        break;
      case Operation::add:
        x[i] = x[a] + x[b];
        break;
      case Operation::subtract:
        x[i] = x[a] - x[b];
        break;
      case Operation::multiply:
        x[i] = x[a] * x[b];
        break;
      case Operation::divide:
        x[i] = x[a] / x[b];
        break;
      case Operation::negate:
        x[i] = -x[a];
        break;
      case Operation::sine:
        x[i] = std::sin(x[a]);
        break;
      case Operation::cosine:
        x[i] = std::cos(x[a]);
        break;
      case Operation::square_root:
        x[i] = std::sqrt(x[a]);
        break;
      case Operation::minimum:
        x[i] = x[a] < x[b] ? x[a] : x[b];
        break;
      case Operation::zero_where_less:
        x[i] = x[a] < x[b] ? S(0) : x[c];
        break;
    }
  }
  std::vector<S> out;
  for (const int output : outputs) out.push_back(x[output]);
  return out;
}

template std::vector<float> Graph::evaluate(std::span<const int>, std::span<const float>) const;
template std::vector<double> Graph::evaluate(std::span<const int>, std::span<const double>) const;

}  // namespace kalmarm
