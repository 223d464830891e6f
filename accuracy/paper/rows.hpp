// The rows of the program `paper`: one a numbered equation, a result or a definition.
//
// A residual is |left - right| / |right| in Frobenius norms, over all blocks at once. An equation
// is evaluated as it is printed, with one Psi for all places, the one that (3.11) to (3.14), (4.3)
// and (4.8) need (operators.hpp). Where the print leaves out on which side of a joint P, Lambda or
// lambda stands, the side that fits best counts. The corrected form is compared with truth.
#pragma once

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <string>
#include <vector>

#include "accuracy/measures/real.hpp"
#include "algorithms/spatial/spatial.hpp"

namespace kalmarm {

inline constexpr double not_evaluable = std::numeric_limits<double>::infinity();

// What a row says, apart from numbers.
struct Equation {
  std::string id;              // "(3.12)", "M(k)", "log det"
  std::string result;          // "Result 3.4", or empty
  std::string statement;       // as printed
  std::string corrected = {};  // empty where it holds as printed
  std::string note = {};       // why, for an erratum
};

struct Row {
  Equation equation;
  std::string section;  // "1" to "6", "beyond"
  double printed;       // residual; infinite where the printed form cannot be evaluated
  double residual;      // of the corrected form
};

template <class A, class B>
double residual(const A& left, const B& right) {
  const auto size = right.norm();
  if (size == 0) return static_cast<double>(left.norm());
  return static_cast<double>((left - right).norm() / size);
}

// The largest; NaN if one is.
inline double worst(std::initializer_list<double> residuals) {
  double out = 0;
  for (const double r : residuals) out = larger(out, r);
  return out;
}

inline double best(std::initializer_list<double> residuals) { return std::min(residuals); }

class Rows {
 public:
  void section(const std::string& name) { section_ = name; }

  // True as printed.
  void holds(const Equation& equation, double residual) {
    rows_.push_back({equation, section_, residual, residual});
  }
  // Printed with an error.
  void erratum(const Equation& equation, double printed, double corrected) {
    rows_.push_back({equation, section_, printed, corrected});
  }

  const std::vector<Row>& all() const { return rows_; }

 private:
  std::string section_;
  std::vector<Row> rows_;
};

}  // namespace kalmarm
