#include "outcomes.hpp"

#include <cstdint>
#include <cstdio>

namespace kalmarm::python {
namespace {

// The layout of the dtype.
struct Record {
  std::int8_t status, rung;
  bool near_singular, widened;
  std::int32_t joint, steps;
  double D, scale, error;

  Record() = default;
  explicit Record(const Outcome& o)
      : status(static_cast<std::int8_t>(o.status)),
        rung(static_cast<std::int8_t>(o.rung)),
        near_singular(o.near_singular),
        widened(o.widened),
        joint(o.joint),
        steps(o.steps),
        D(o.D),
        scale(o.scale),
        error(o.error) {}
};

nb::handle dtype, error;  // live as long as the module, which is never unloaded

std::string at(const Outcome& outcome, const std::vector<std::string>& names) {
  if (outcome.joint < 0 || outcome.joint >= static_cast<int>(names.size())) return "";
  char numbers[96];
  std::snprintf(numbers, sizeof numbers, "': D = %.3g, scale %.3g", outcome.D, outcome.scale);
  return " at '" + names[outcome.joint] + numbers;
}

std::string why(const Outcome& warns, const std::vector<std::string>& names) {
  return warns.near_singular ? "nearly singular" + at(warns, names)
                             : "its own estimate of the error is above 1 %";
}

void warn(const std::string& message) {
  if (PyErr_WarnEx(PyExc_RuntimeWarning, message.c_str(), 1) < 0) throw nb::python_error();
}

nb::object records(int ndim, const npy_intp* shape) {
  auto* const descr =
      reinterpret_cast<PyArray_Descr*>(nb::object(nb::borrow(dtype)).release().ptr());
  PyObject* const array = PyArray_NewFromDescr(&PyArray_Type, descr, ndim, shape, nullptr, nullptr,
                                               0, nullptr);  // takes the reference
  if (!array) throw nb::python_error();
  return nb::steal(array);
}

nb::object record_of(const Inputs& inputs, const Outcome* outcomes) {
  const std::span<const npy_intp> leading = inputs.leading();
  nb::object array = records(static_cast<int>(leading.size()), leading.data());
  auto* const to = data_of<Record>(array);
  for (int i = 0; i < inputs.count(); ++i) to[i] = Record(outcomes[i]);
  return inputs.is_single()
             ? nb::steal(PyArray_Return(reinterpret_cast<PyArrayObject*>(array.release().ptr())))
             : array;
}

[[noreturn]] void raise(const Inputs& inputs, const Outcome& outcome,
                        const std::vector<std::string>& names) {
  std::string message =
      inputs.call() + std::string(": ") + to_string(outcome.status) + at(outcome, names);
  if (const std::string input = inputs.not_finite(0); !input.empty())
    message += ": " + input;
  else if (outcome.status == Outcome::Status::not_finite)
    message += ": the result overflows";
  const nb::object instance = error(message.c_str());
  nb::object array = records(0, nullptr);
  *data_of<Record>(array) = Record(outcome);
  instance.attr("outcome") =
      nb::steal(PyArray_Return(reinterpret_cast<PyArrayObject*>(array.release().ptr())));
  PyErr_SetObject(error.ptr(), instance.ptr());
  throw nb::python_error();
}

// One warning of all rows that warn, for the reason of the first.
void warn_of_rows(const Inputs& inputs, const Outcome* outcomes,
                  const std::vector<std::string>& names) {
  constexpr int listed = 5;
  int count = 0, first = 0;
  std::string rows;
  for (int i = 0; i < inputs.count(); ++i) {
    if (!outcomes[i].warns()) continue;
    if (count == 0) first = i;
    if (count < listed) rows += (count ? ", " : "") + std::to_string(i);
    ++count;
  }
  if (count == 0) return;
  warn(inputs.call() + std::string(": ") + std::to_string(count) + " of " +
       std::to_string(inputs.count()) + " rows warn (" + rows + (count > listed ? ", ..." : "") +
       "), row " + std::to_string(first) + ": " + why(outcomes[first], names));
}

}  // namespace

void bind_outcomes(nb::module_& module) {
  nb::dict layout;
  nb::list names, formats, offsets;
  const auto add = [&](const char* name, const char* format, std::size_t offset) {
    names.append(name), formats.append(format), offsets.append(offset);
  };
  add("status", "i1", offsetof(Record, status));
  add("rung", "i1", offsetof(Record, rung));
  add("near_singular", "?", offsetof(Record, near_singular));
  add("widened", "?", offsetof(Record, widened));
  add("joint", "i4", offsetof(Record, joint));
  add("steps", "i4", offsetof(Record, steps));
  add("D", "f8", offsetof(Record, D));
  add("scale", "f8", offsetof(Record, scale));
  add("error", "f8", offsetof(Record, error));
  layout["names"] = names;
  layout["formats"] = formats;
  layout["offsets"] = offsets;
  layout["itemsize"] = sizeof(Record);
  dtype = nb::object(nb::module_::import_("numpy").attr("dtype")(layout)).release();
  module.attr("outcome_dtype") = dtype;

  error = PyErr_NewExceptionWithDoc(
      "kalmarm.DynamicsError",
      "A state for which there is no answer that could be used; `outcome` is its record.",
      PyExc_ArithmeticError, nullptr);
  module.attr("DynamicsError") = error;
}

void check(const Inputs& inputs, const Outcome& outcome, const std::vector<std::string>& names) {
  if (!outcome) raise(inputs, outcome, names);
  if (outcome.warns()) warn(inputs.call() + std::string(": ") + why(outcome, names));
}

nb::object answered(const Inputs& inputs, const nb::object& result, bool status,
                    const Outcome* outcomes, const std::vector<std::string>& names) {
  if (status) return nb::make_tuple(result, record_of(inputs, outcomes));
  if (inputs.is_single())
    check(inputs, *outcomes, names);
  else
    warn_of_rows(inputs, outcomes, names);
  return result;
}

}  // namespace kalmarm::python
