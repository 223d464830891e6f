// The operations of a calculation as a graph: each node is an input, a constant, or an operation on earlier
// nodes, and no two nodes are the same operation on the same operands.
//
// What is known is folded away when a node is asked for,
//   operations on constants;  0 x = 0,  1 x = x,  x + 0 = x,  x - x = 0
//   signs outwards:  (-x) y = -(x y),  x + (-y) = x - y,  -(x - y) = y - x,  -(-x) = x
// and nothing else: sums are not regrouped, so that errors are those of the calculation as it stands.
// 0 x = 0 takes every x to be finite.
//
// Every node has the value that it takes in one reference state, that of the values inputs are given with: NaN where
// they are given with none.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <tuple>
#include <vector>

namespace kalmarm {

enum class Operation {
  input,
  constant,
  add,
  subtract,
  multiply,
  divide,
  negate,
  sine,
  cosine,
  square_root,
  minimum,
  with_sign,        // a where b > 0, else -a
  zero_where_less,  // c, but 0 where a < b
};

struct Node {
  Operation operation;
  int a = -1, b = -1, c = -1;  // operands; of an input its number
  double value = 0;            // of a constant, or in the reference state
};

// Operations of the nodes that some output needs.
struct OperationCount {
  int sums = 0, products = 0, quotients = 0, roots = 0, others = 0;
  int flops() const { return sums + products + quotients; }
};

class Graph {
 public:
  int input(double value = std::numeric_limits<double>::quiet_NaN());  // the next one
  int constant(double value);
  int add(int a, int b);
  int subtract(int a, int b);
  int multiply(int a, int b);
  int divide(int a, int b);
  int negate(int a);
  int minimum(int a, int b);
  int with_sign(int a, int b);
  int zero_where_less(int a, int b, int c);
  int unary(Operation operation, int a);  // sine, cosine, square_root

  int inputs() const { return inputs_; }
  double value(int node) const { return nodes_[node].value; }
  const std::vector<Node>& nodes() const { return nodes_; }
  bool is_constant(int node) const { return nodes_[node].operation == Operation::constant; }
  bool is_constant(int node, double value) const {
    return is_constant(node) && nodes_[node].value == value;
  }

  // Of every node, how many nodes and outputs that are needed have it as an operand; 0: none.
  std::vector<int> uses(std::span<const int> outputs) const;
  OperationCount count(std::span<const int> outputs) const;

  // The outputs for given inputs, every operation rounded to S (float or double).
  template <class S>
  std::vector<S> evaluate(std::span<const int> outputs, std::span<const S> inputs) const;

 private:
  int node(Operation operation, int a, int b = -1, int c = -1);
  int known(const Node& node, std::uint64_t constant = 0);  // by its bits
  bool is_negated(int node) const { return nodes_[node].operation == Operation::negate; }

  int inputs_ = 0;
  std::vector<Node> nodes_;
  std::map<std::tuple<Operation, int, int, int, std::uint64_t>, int> known_;
};

}  // namespace kalmarm
