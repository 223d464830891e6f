#include "algorithms/generate/graph.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace kalmarm {

namespace {

// Of an operation that is no input or constant.
template <class S>
S applied(Operation operation, const S& a, const S& b, const S& c) {
  switch (operation) {
    case Operation::add:
      return a + b;
    case Operation::subtract:
      return a - b;
    case Operation::multiply:
      return a * b;
    case Operation::divide:
      return a / b;
    case Operation::negate:
      return -a;
    case Operation::sine:
      return std::sin(a);
    case Operation::cosine:
      return std::cos(a);
    case Operation::square_root:
      return std::sqrt(a);
    case Operation::minimum:
      return a < b ? a : b;
    case Operation::with_sign:
      return b > 0 ? a : -a;
    case Operation::zero_where_less:
      return a < b ? S(0) : c;
    case Operation::input:
    case Operation::constant:
      break;
  }
  return S(0);
}

}  // namespace

int Graph::known(const Node& node, std::uint64_t constant) {
  const auto [known, is_new] = known_.try_emplace(
      {node.operation, node.a, node.b, node.c, constant}, static_cast<int>(nodes_.size()));
  if (is_new) nodes_.push_back(node);
  return known->second;
}

int Graph::input(double value) { return known({Operation::input, inputs_++, -1, -1, value}); }

// Of both zeros the positive one.
int Graph::constant(double value) {
  const double kept = value == 0 ? 0 : value;
  return known({Operation::constant, -1, -1, -1, kept}, std::bit_cast<std::uint64_t>(kept));
}

int Graph::node(Operation operation, int a, int b, int c) {
  const auto at = [&](int operand) { return operand < 0 ? 0 : value(operand); };
  const double result = applied(operation, at(a), at(b), at(c));
  const auto unknown = [&](int operand) { return operand >= 0 && !is_constant(operand); };
  if (!unknown(a) && !unknown(b) && !unknown(c)) return constant(result);
  return known({operation, a, b, c, result});
}

int Graph::add(int a, int b) {
  if (is_constant(a, 0)) return b;
  if (is_constant(b, 0)) return a;
  if (is_negated(b)) return subtract(a, nodes_[b].a);
  if (is_negated(a)) return subtract(b, nodes_[a].a);
  return node(Operation::add, std::min(a, b), std::max(a, b));
}

int Graph::subtract(int a, int b) {
  if (a == b) return constant(0);
  if (is_constant(b, 0)) return a;
  if (is_constant(a, 0)) return negate(b);
  if (is_negated(b)) return add(a, nodes_[b].a);
  return node(Operation::subtract, a, b);
}

int Graph::multiply(int a, int b) {
  if (is_constant(a) && is_constant(b)) return node(Operation::multiply, a, b);
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
  if (is_constant(a) && is_constant(b)) return node(Operation::divide, a, b);
  if (is_constant(a, 0) || is_constant(b, 1)) return a;
  if (is_negated(a)) return negate(divide(nodes_[a].a, b));
  if (is_negated(b)) return negate(divide(a, nodes_[b].a));
  return node(Operation::divide, a, b);
}

int Graph::negate(int a) {
  const Node& at = nodes_[a];
  if (is_negated(a)) return at.a;
  if (at.operation == Operation::subtract) return subtract(at.b, at.a);
  return node(Operation::negate, a);
}

int Graph::minimum(int a, int b) { return a == b ? a : node(Operation::minimum, a, b); }

int Graph::with_sign(int a, int b) {
  if (is_constant(b)) return nodes_[b].value > 0 ? a : negate(a);
  return node(Operation::with_sign, a, b);
}

int Graph::zero_where_less(int a, int b, int c) {
  if (is_constant(a) && is_constant(b)) return nodes_[a].value < nodes_[b].value ? constant(0) : c;
  if (is_constant(c, 0)) return c;
  return node(Operation::zero_where_less, a, b, c);
}

int Graph::unary(Operation operation, int a) { return node(operation, a); }

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
      case Operation::square_root:
        ++out.roots;
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
    const Node& node = nodes_[i];
    const auto at = [&](int operand) { return operand < 0 ? S(0) : x[operand]; };
    x[i] = node.operation == Operation::input ? inputs[node.a]
           : node.operation == Operation::constant
               ? static_cast<S>(node.value)
               : applied(node.operation, at(node.a), at(node.b), at(node.c));
  }
  std::vector<S> out;
  for (const int output : outputs) out.push_back(x[output]);
  return out;
}

template std::vector<float> Graph::evaluate(std::span<const int>, std::span<const float>) const;
template std::vector<double> Graph::evaluate(std::span<const int>, std::span<const double>) const;

}  // namespace kalmarm
