// Arrays of numbers, in and out of a call. NumPy's own C interface: a call of one state takes less
// time than the import of a DLPack capsule.
#pragma once

#include <nanobind/nanobind.h>

#define NPY_NO_DEPRECATED_API NPY_1_22_API_VERSION
#define PY_ARRAY_UNIQUE_SYMBOL kalmarm_numpy
#ifndef KALMARM_IMPORTS_NUMPY
#define NO_IMPORT_ARRAY
#endif
#include <numpy/arrayobject.h>

#include <array>
#include <initializer_list>
#include <kalmarm/views.hpp>
#include <span>
#include <string>

namespace kalmarm::python {

namespace nb = nanobind;

struct Argument {
  const char* name;
  nb::handle value;
  int width;  // of its last dimension
};

// What a call is given: arrays of one dtype, float32 or float64, whose last dimension has a width
// that the robot knows, and whose leading ones, which count the states, are broadcast as NumPy does
// it; all but the first may also be one number. An array that lies otherwise than side by side is
// copied; lists take the dtype of the arrays, float64 where there are none.
class Inputs {
 public:
  static constexpr int most_arguments = 17;  // of acceleration_jvp of a step
  static constexpr int most = 10 + 11;       // with the results, of acceleration_vjp of a step

  // Throws TypeError and ValueError, with the call, the argument and both shapes.
  Inputs(const char* call, std::span<const Argument> arguments);
  Inputs(const char* call, std::initializer_list<Argument> arguments)
      : Inputs(call, std::span(arguments.begin(), arguments.size())) {}

  const char* call() const { return call_; }
  int type() const { return type_; }                   // NPY_FLOAT or NPY_DOUBLE
  bool is_single() const { return dimensions_ == 0; }  // one state, without a leading dimension
  int count() const { return count_; }
  std::string not_finite(int row) const;  // the first entry of a row that is not: "q[1] is nan"
  std::span<const npy_intp> leading() const { return {leading_.data(), dimensions_}; }

  template <class T>
  const T* data(int i) const {
    return static_cast<const T*>(PyArray_DATA(array(i)));
  }

  // f(T()) of the scalar that the arrays hold.
  template <class F>
  auto with_scalar(const F& f) const {
    return type_ == NPY_FLOAT ? f(float()) : f(double());
  }

  // An array of the shape leading + trailing: `out`, or a new one where that is None. Throws
  // TypeError and ValueError where `out` cannot take the result in its place: in the memory of no
  // input and of no other result.
  nb::object result(nb::handle out, std::initializer_list<npy_intp> trailing,
                    const char* name = "out");

 private:
  PyArrayObject* array(int i) const { return reinterpret_cast<PyArrayObject*>(arrays_[i].ptr()); }
  std::string where(int argument) const { return call_ + (": " + std::string(names_[argument])); }
  bool broadcasts(std::span<const npy_intp> leading);  // whether leading_ is now of all
  void add_apart(nb::object array, const char* name);

  const char* call_;
  std::array<nb::object, most> arrays_;
  std::array<const char*, most> names_;
  int given_ = 0, arguments_ = 0, type_ = NPY_NOTYPE, count_ = 1;
  std::array<npy_intp, NPY_MAXDIMS> leading_;
  std::size_t dimensions_ = 0;  // of leading_
};

// Of argument i one state, by its row, or all.
template <class T>
VectorView<const T> vector(const Inputs& in, int i, std::ptrdiff_t row, int width) {
  return {in.data<T>(i) + row * width, width};
}
template <class T>
RowsView<const T> rows_of(const Inputs& in, int i, int width) {
  return {in.data<T>(i), in.count(), width};
}

inline PyArrayObject* array_of(const nb::object& array) {
  return reinterpret_cast<PyArrayObject*>(array.ptr());
}
template <class T>
T* data_of(const nb::object& array) {
  return static_cast<T*>(PyArray_DATA(array_of(array)));
}

// A view of matrices whose columns were written one after another.
nb::object transposed(const nb::object& matrices);
// The matrices of which `view` is a transposed(); as it is where it is no array of them.
nb::object untransposed(nb::handle view);

}  // namespace kalmarm::python
