// A generated variant (algorithms/study/generated/generated_variants.hpp) as code that a C compiler has made, by
// $CC, cc, clang or gcc. What it made stays in folder_of({}), and is taken again.
#pragma once

#include <cstddef>

#include "algorithms/generate/c_library.hpp"
#include "algorithms/generate/package.hpp"
#include "algorithms/study/generated/generated_variants.hpp"

namespace kalmarm {

// A task of one robot in precision T (float or double).
template <class T>
class GeneratedCode {
 public:
  // task: forward_dynamics or inverse_mass. Throws std::exception where there is no code, which says why in one line.
  GeneratedCode(const GeneratedVariant& variant, GeneratedTask task, const Model<T>& model);

  // Of one state: a from q, qd and tau, or M^-1 from q.
  void acceleration(const T* q, const T* qd, const T* tau, T* a) const { a_(q, qd, tau, a); }
  void inverse(const T* q, T* X) const { X_(q, X); }
  // Of row-major rows.
  void acceleration(std::size_t rows, const T* q, const T* qd, const T* tau, T* a) const {
    a_rows_(rows, q, qd, tau, a);
  }
  void inverse(std::size_t rows, const T* q, T* X) const { X_rows_(rows, q, X); }

  int flops() const { return flops_; }

 private:
  explicit GeneratedCode(const Package<T>& package);

  CLibrary library_;
  int flops_ = 0;
  void (*a_)(const T*, const T*, const T*, T*) = nullptr;
  void (*X_)(const T*, T*) = nullptr;
  void (*a_rows_)(std::size_t, const T*, const T*, const T*, T*) = nullptr;
  void (*X_rows_)(std::size_t, const T*, T*) = nullptr;
};

}  // namespace kalmarm
