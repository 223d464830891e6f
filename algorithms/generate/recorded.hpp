// A scalar that records what is done with it as nodes of a graph (graph.hpp). A kernel runs once on these numbers;
// what it asks of them is what every state takes, since its branches depend on the model alone.
//
// A number that depends on an input is equal to nothing else. Which of two is less is decided in the reference state of
// the inputs, where they are given one: the record is right for every state that decides alike. Without one the question is an
// error. One that was never set is zero, as workspaces of numbers are.
#pragma once

#include <Eigen/Core>
#include <cassert>
#include <limits>
#include <stdexcept>

#include "algorithms/fast/kinematics/column_lanes.hpp"
#include "algorithms/generate/graph.hpp"

namespace kalmarm {

class Recorded {
 public:
  Recorded() = default;
  Recorded(double x) : node_(graph().constant(x)) {}

  static Recorded input(double value = std::numeric_limits<double>::quiet_NaN()) {
    return of(graph().input(value));
  }
  int node() const { return at(); }
  explicit operator double() const { return graph().value(at()); }  // in the reference state

  friend Recorded operator+(Recorded a, Recorded b) { return of(graph().add(a.at(), b.at())); }
  friend Recorded operator-(Recorded a, Recorded b) { return of(graph().subtract(a.at(), b.at())); }
  friend Recorded operator*(Recorded a, Recorded b) { return of(graph().multiply(a.at(), b.at())); }
  friend Recorded operator/(Recorded a, Recorded b) { return of(graph().divide(a.at(), b.at())); }
  friend Recorded operator-(Recorded a) { return of(graph().negate(a.at())); }
  friend Recorded& operator+=(Recorded& a, Recorded b) { return a = a + b; }
  friend Recorded& operator-=(Recorded& a, Recorded b) { return a = a - b; }
  friend Recorded& operator*=(Recorded& a, Recorded b) { return a = a * b; }
  friend Recorded& operator/=(Recorded& a, Recorded b) { return a = a / b; }
  friend bool operator==(Recorded a, Recorded b) { return a.at() == b.at(); }
  friend bool operator<(Recorded a, Recorded b) {
    const double x(a), y(b);
    if (x != x || y != y) throw std::logic_error("a branch on numbers without a reference state");
    return x < y;
  }
  friend bool operator>(Recorded a, Recorded b) { return b < a; }
  friend bool operator<=(Recorded a, Recorded b) { return !(b < a); }
  friend bool operator>=(Recorded a, Recorded b) { return !(a < b); }

  friend Recorded with_sign(Recorded a, Recorded b) {
    return of(graph().with_sign(a.at(), b.at()));
  }
  friend Recorded abs(Recorded a) { return with_sign(a, a); }
  friend Recorded min(Recorded a, Recorded b) { return of(graph().minimum(a.at(), b.at())); }
  friend Recorded max(Recorded a, Recorded b) { return -min(-a, -b); }
  friend Recorded zero_where_less(Recorded a, Recorded b, Recorded c) {
    return of(graph().zero_where_less(a.at(), b.at(), c.at()));
  }
  friend Recorded sqrt(Recorded a) { return of(graph().unary(Operation::square_root, a.at())); }
  // As spatial/sincos.hpp has it.
  friend void sin_cos(const Recorded& x, const Recorded& offset, Recorded& sin_x, Recorded& cos_x) {
    const int angle = graph().add(x.at(), offset.at());
    sin_x = of(graph().unary(Operation::sine, angle));
    cos_x = of(graph().unary(Operation::cosine, angle));
  }

 private:
  friend class Recording;

  static Recorded of(int node) {
    Recorded out;
    out.node_ = node;
    return out;
  }
  static Graph& graph() {
    assert(recording_);
    return *recording_;
  }
  int at() const { return node_ < 0 ? graph().constant(0) : node_; }

  static inline thread_local Graph* recording_ = nullptr;
  int node_ = -1;
};

// While it lives, what this thread does with Recorded goes into a graph.
class Recording {
 public:
  explicit Recording(Graph& graph) : before_(Recorded::recording_) {
    Recorded::recording_ = &graph;
  }
  ~Recording() { Recorded::recording_ = before_; }
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;

 private:
  Graph* before_;
};

}  // namespace kalmarm

// Columns one by one.
template <int n>
struct kalmarm::detail::ColumnsOf<kalmarm::Recorded, n> {
  using Lane = Recorded;
  static constexpr int count = 1;

  static Lane unit(int i) { return i == 0; }
  static const Lane& column(const Lane& x, int) { return x; }
};

// Kernels ask for its infinity.
template <>
struct std::numeric_limits<kalmarm::Recorded> : std::numeric_limits<double> {};

template <>
struct Eigen::NumTraits<kalmarm::Recorded> : Eigen::GenericNumTraits<kalmarm::Recorded> {
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 1,
    AddCost = 1,
    MulCost = 1
  };
  static double epsilon() { return std::numeric_limits<double>::epsilon(); }
  static double dummy_precision() { return Eigen::NumTraits<double>::dummy_precision(); }
};
