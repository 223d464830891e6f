#include "arrays.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace kalmarm::python {
namespace {

using std::string_literals::operator""s;

std::string text(std::span<const npy_intp> shape, const std::string& first = "") {
  std::string out = "(" + first;
  for (std::size_t i = 0; i < shape.size(); ++i)
    out += (out.size() == 1 ? "" : ", ") + std::to_string(shape[i]);
  return out + (shape.size() + !first.empty() == 1 ? ",)" : ")");
}

std::span<const npy_intp> shape_of(PyArrayObject* array) {
  return {PyArray_DIMS(array), static_cast<std::size_t>(PyArray_NDIM(array))};
}

std::string dtype_name(PyArrayObject* array) {
  return nb::steal<nb::str>(PyObject_Str(reinterpret_cast<PyObject*>(PyArray_DESCR(array))))
      .c_str();
}

bool is_float(int type) { return type == NPY_FLOAT || type == NPY_DOUBLE; }

nb::object checked(PyObject* object) {
  if (!object) throw nb::python_error();
  return nb::steal(object);
}

bool is_sequence(nb::handle value) {
  return PyList_Check(value.ptr()) || PyTuple_Check(value.ptr()) || PyFloat_Check(value.ptr()) ||
         PyLong_Check(value.ptr());
}

bool is_masked(nb::handle array) {
  return !PyArray_CheckExact(array.ptr()) &&
         nb::isinstance(array, nb::module_::import_("numpy.ma").attr("MaskedArray"));
}

// Without a copy where the object lends its memory. `where` is called for a message alone.
template <class Where>
nb::object lent(nb::handle value, const Where& where) {
  if (PyArray_Check(value.ptr())) {
    if (is_masked(value))
      throw nb::type_error(
          (where() + " is a masked array, and masks are not kept: give its filled()").c_str());
    return nb::borrow(value);
  }
  if (nb::hasattr(value, "__dlpack__"))
    return nb::module_::import_("numpy").attr("from_dlpack")(value);
  return checked(PyArray_FromAny(value.ptr(), nullptr, 0, 0, 0, nullptr));
}

}  // namespace

Inputs::Inputs(const char* call, std::span<const Argument> arguments) : call_(call) {
  bool has_sequences = false;
  for (const Argument& argument : arguments) {
    const int i = given_++;
    names_.at(i) = argument.name;
    if (is_sequence(argument.value)) {
      has_sequences = true;
      continue;
    }
    arrays_[i] = lent(argument.value, [&] { return where(i); });
    const int type = PyArray_TYPE(array(i));
    if (!is_float(type))
      throw nb::type_error(
          (where(i) + " is " + dtype_name(array(i)) + ", float32 or float64 is needed").c_str());
    if (type_ == NPY_NOTYPE) type_ = type;
    if (type != type_)
      throw nb::type_error((where(i) + " is " + (type == NPY_FLOAT ? "float32" : "float64") +
                            ", arrays before it are " +
                            (type_ == NPY_FLOAT ? "float32" : "float64") +
                            ": one dtype for all is needed")
                               .c_str());
  }
  arguments_ = given_;
  if (type_ == NPY_NOTYPE) type_ = NPY_DOUBLE;
  constexpr int side_by_side = NPY_ARRAY_C_CONTIGUOUS | NPY_ARRAY_ALIGNED | NPY_ARRAY_NOTSWAPPED;
  for (int i = 0; has_sequences && i < given_; ++i)
    if (!arrays_[i].is_valid())
      arrays_[i] = checked(PyArray_FromAny(arguments[i].value.ptr(), PyArray_DescrFromType(type_),
                                           0, 0, side_by_side, nullptr));
  for (int i = 0; i < given_; ++i)
    if (!PyArray_ISCARRAY_RO(array(i)))
      arrays_[i] = checked(PyArray_FromArray(array(i), PyArray_DescrFromType(type_), side_by_side));

  npy_intp count = 1;
  for (int i = 0; i < given_; ++i) {
    const std::span<const npy_intp> shape = shape_of(array(i));
    const npy_intp width = arguments[i].width;
    const bool is_number = shape.empty() && i > 0;
    if (is_number ||
        (!shape.empty() && shape.back() == width && broadcasts(shape.first(shape.size() - 1))))
      continue;
    std::vector<npy_intp> needed(leading_.begin(), leading_.begin() + dimensions_);
    needed.push_back(width);
    throw nb::value_error((where(i) + " has shape " + text(shape) + ", " + text(needed) +
                           (i == 0 ? " or " + text({&width, 1}, "...") : "") + " is needed")
                              .c_str());
  }
  for (const npy_intp n : leading()) count *= n;
  if (count > std::numeric_limits<int>::max())
    throw nb::value_error((call_ + ": more than 2^31 states"s).c_str());
  count_ = static_cast<int>(count);
  for (int i = 0; i < given_; ++i) {
    const std::span<const npy_intp> shape = shape_of(array(i));
    if (shape.size() == dimensions_ + 1 &&
        std::equal(leading_.begin(), leading_.begin() + dimensions_, shape.begin()))
      continue;
    std::vector<npy_intp> needed(leading_.begin(), leading_.begin() + dimensions_);
    needed.push_back(arguments[i].width);
    nb::object repeated =
        checked(PyArray_SimpleNew(static_cast<int>(needed.size()), needed.data(), type_));
    if (PyArray_CopyInto(array_of(repeated), array(i)) < 0) throw nb::python_error();
    arrays_[i] = std::move(repeated);
  }
}

bool Inputs::broadcasts(std::span<const npy_intp> shape) {
  if (shape.size() > dimensions_) {
    const std::size_t more = shape.size() - dimensions_;
    std::copy_backward(leading_.begin(), leading_.begin() + dimensions_,
                       leading_.begin() + shape.size());
    std::fill_n(leading_.begin(), more, 1);
    dimensions_ = shape.size();
  }
  for (std::size_t i = 0; i < shape.size(); ++i) {
    npy_intp& ours = leading_[dimensions_ - shape.size() + i];
    if (ours == 1) ours = shape[i];
    if (shape[i] != ours && shape[i] != 1) return false;
  }
  return true;
}

std::string Inputs::not_finite(int row) const {
  return with_scalar([&]<class T>(T) -> std::string {
    for (int i = 0; i < arguments_; ++i) {
      const npy_intp width = PyArray_DIM(array(i), PyArray_NDIM(array(i)) - 1);
      const T* const x = data<T>(i) + row * width;
      for (npy_intp k = 0; k < width; ++k)
        if (!std::isfinite(x[k]))
          return names_[i] + "["s + std::to_string(k) + "] is " +
                 (std::isnan(x[k]) ? "nan"
                  : x[k] > 0       ? "inf"
                                   : "-inf");
    }
    return {};
  });
}

nb::object Inputs::result(nb::handle out, std::initializer_list<npy_intp> trailing,
                          const char* name) {
  std::array<npy_intp, NPY_MAXDIMS + 2> shape;
  const auto end = std::ranges::copy(trailing, std::ranges::copy(leading(), shape.begin()).out).out;
  const int ndim = static_cast<int>(end - shape.begin());
  if (out.is_none()) return checked(PyArray_SimpleNew(ndim, shape.data(), type_));

  const auto where = [&] { return call_ + ": "s + name; };
  if (is_sequence(out)) throw nb::type_error((where() + " is no array").c_str());
  nb::object lender = lent(out, where);
  PyArrayObject* const array = array_of(lender);
  if (PyArray_TYPE(array) != type_)
    throw nb::type_error((where() + " is " + dtype_name(array) + ", " +
                          (type_ == NPY_FLOAT ? "float32" : "float64") +
                          " is needed, as the states are")
                             .c_str());
  const std::span<const npy_intp> needed(shape.data(), ndim);
  if (!std::ranges::equal(shape_of(array), needed))
    throw nb::value_error(
        (where() + " has shape " + text(shape_of(array)) + ", " + text(needed) + " is needed")
            .c_str());
  if (!PyArray_ISCARRAY(array))
    throw nb::value_error((where() + " has to be writeable and contiguous").c_str());
  add_apart(lender, name);
  return lender;
}

void Inputs::add_apart(nb::object out, const char* name) {
  const char* const begin = PyArray_BYTES(array_of(out));
  const char* const end = begin + PyArray_NBYTES(array_of(out));
  for (int i = 0; i < given_; ++i) {
    const char* const other = PyArray_BYTES(array(i));
    if (begin < other + PyArray_NBYTES(array(i)) && other < end)
      throw nb::value_error(
          (call_ + ": "s + name + " lies in the same memory as " + names_[i]).c_str());
  }
  names_.at(given_) = name;
  arrays_[given_++] = std::move(out);
}

nb::object transposed(const nb::object& matrices) {
  PyArrayObject* const array = array_of(matrices);
  return checked(PyArray_SwapAxes(array, PyArray_NDIM(array) - 2, PyArray_NDIM(array) - 1));
}

nb::object untransposed(nb::handle view) {
  if (!PyArray_Check(view.ptr()) || PyArray_NDIM(reinterpret_cast<PyArrayObject*>(view.ptr())) < 2)
    return nb::borrow(view);
  return transposed(nb::borrow(view));
}

}  // namespace kalmarm::python
