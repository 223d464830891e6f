#include "configuration.hpp"

#include <nanobind/stl/optional.h>

#include <cstdint>
#include <kalmarm/configuration.hpp>
#include <optional>
#include <random>

#include "lock.hpp"

namespace kalmarm::python {
namespace {

using nb::literals::operator""_a;

template <class T>
RowsView<const T> rows(const Inputs& in, int i, int width) {
  return {in.data<T>(i), in.count(), width};
}

template <class T>
RowsView<T> rows(const Inputs& in, const nb::object& result, std::ptrdiff_t width) {
  return {data_of<T>(result), in.count(), width};
}

// Both results of call(rows of the inputs, rows of the results), a matrix of each state.
template <class Call>
nb::tuple matrices(Inputs& in, int width_of_second, const RobotModel& model, const Call& call) {
  const int nv = model.nv();
  const nb::object first = in.result(nb::none(), {nv, nv}),
                   second = in.result(nb::none(), {nv, nv});
  in.with_scalar([&]<class T>(T) {
    const std::ptrdiff_t size = std::ptrdiff_t(nv) * nv;
    const WithoutLock released(in.count() > 1 || nv >= large);
    call(rows<T>(in, 0, model.nq), rows<T>(in, 1, width_of_second), rows<T>(in, first, size),
         rows<T>(in, second, size));
  });
  return nb::make_tuple(transposed(first), transposed(second));
}

nb::object integrate(const Robot& robot, nb::handle q, nb::handle v, nb::handle out) {
  const RobotModel& model = robot.model();
  const int nq = model.nq, nv = model.nv();
  Inputs in("integrate", {{"q", q, nq}, {"v", v, nv}});
  const nb::object result = in.result(out, {nq});
  in.with_scalar([&]<class T>(T) {
    const WithoutLock released(in.count() > 1 || nv >= large);
    kalmarm::integrate(model, in.count(), rows<T>(in, 0, nq), rows<T>(in, 1, nv),
                       rows<T>(in, result, nq));
  });
  return result;
}

nb::object difference(const Robot& robot, nb::handle q0, nb::handle q1, nb::handle out) {
  const RobotModel& model = robot.model();
  const int nq = model.nq, nv = model.nv();
  Inputs in("difference", {{"q0", q0, nq}, {"q1", q1, nq}});
  const nb::object result = in.result(out, {nv});
  in.with_scalar([&]<class T>(T) {
    const WithoutLock released(in.count() > 1 || nv >= large);
    kalmarm::difference(model, in.count(), rows<T>(in, 0, nq), rows<T>(in, 1, nq),
                        rows<T>(in, result, nv));
  });
  return result;
}

nb::tuple integrate_jacobians(const Robot& robot, nb::handle q, nb::handle v) {
  const RobotModel& model = robot.model();
  Inputs in("integrate_jacobians", {{"q", q, model.nq}, {"v", v, model.nv()}});
  return matrices(in, model.nv(), model, [&](const auto&... views) {
    kalmarm::integrate_jacobians(model, in.count(), views...);
  });
}

nb::tuple difference_jacobians(const Robot& robot, nb::handle q0, nb::handle q1) {
  const RobotModel& model = robot.model();
  Inputs in("difference_jacobians", {{"q0", q0, model.nq}, {"q1", q1, model.nq}});
  return matrices(in, model.nq, model, [&](const auto&... views) {
    kalmarm::difference_jacobians(model, in.count(), views...);
  });
}

// `count` states, or one without a leading dimension.
nb::object random_configuration(const Robot& robot, nb::handle lower, nb::handle upper,
                                std::uint64_t seed, std::optional<npy_intp> count) {
  const RobotModel& model = robot.model();
  const int nq = model.nq;
  Inputs in("random_configuration", {{"lower", lower, nq}, {"upper", upper, nq}});
  if (!in.is_single())
    throw nb::value_error("random_configuration: lower and upper are one for all states, (nq,)");
  const nb::object result =
      count ? in.result(nb::none(), {*count, nq}) : in.result(nb::none(), {nq});
  in.with_scalar([&]<class T>(T) {
    std::mt19937_64 generator(seed);
    const std::ptrdiff_t rows = count.value_or(1);
    const WithoutLock released(rows > 1 || model.nv() >= large);
    kalmarm::random(model, rows, VectorView<const T>(in.data<T>(0), nq),
                    VectorView<const T>(in.data<T>(1), nq), generator,
                    RowsView<T>(data_of<T>(result), rows, nq));
  });
  return result;
}

}  // namespace

#define KALMARM_ARRAY "numpy.typing.ArrayLike"
#define KALMARM_RESULT "numpy.typing.NDArray[typing.Any]"
#define KALMARM_ONE(name, first, second)                                                \
  nb::sig("def " name "(self, " first ": " KALMARM_ARRAY ", " second ": " KALMARM_ARRAY \
          ", out: "                                                                     \
          "typing.Any = None) -> " KALMARM_RESULT)
#define KALMARM_TWO(name, first, second)                                                \
  nb::sig("def " name "(self, " first ": " KALMARM_ARRAY ", " second ": " KALMARM_ARRAY \
          ") -> "                                                                       \
          "tuple[" KALMARM_RESULT ", " KALMARM_RESULT "]")

void bind_configuration(nb::class_<Robot>& robot) {
  robot
      .def("integrate", &integrate, "q"_a, "v"_a, "out"_a = nb::none(),
           KALMARM_ONE("integrate", "q", "v"),
           R"(q moved by the displacement v: q + v, and quaternions turned.

q (..., nq), v (..., nv) [rad or m] in the axes of qd, such as dt * qd -> (..., nq). Quaternions are
turned to q exp(v / 2), of unit length. What is not finite passes into its own joint's entries.)")
      .def("difference", &difference, "q0"_a, "q1"_a, "out"_a = nb::none(),
           KALMARM_ONE("difference", "q0", "q1"),
           R"(The displacement v for which integrate(q0, v) is q1.

q0 and q1 (..., nq) -> (..., nv) [rad or m]. Quaternions: the shorter turn, at most pi; q and -q are
the same rotation.)")
      .def("integrate_jacobians", &integrate_jacobians, "q"_a, "v"_a,
           KALMARM_TWO("integrate_jacobians", "q", "v"),
           R"(Derivatives of integrate(q, v) by q and by v: (dq, dv).

q (..., nq), v (..., nv) -> two (..., nv, nv), in displacements on both sides: column j is for a
change of q along DoF j's velocity. Identities but for the blocks of quaternions.)")
      .def("difference_jacobians", &difference_jacobians, "q0"_a, "q1"_a,
           KALMARM_TWO("difference_jacobians", "q0", "q1"),
           R"(Derivatives of difference(q0, q1) by q0 and by q1: (d0, d1).

q0 and q1 (..., nq) -> two (..., nv, nv), as those of integrate_jacobians.)")
      .def("_random_configuration", &random_configuration, "lower"_a, "upper"_a, "seed"_a,
           "count"_a.none(),
           nb::sig("def _random_configuration(self, lower: " KALMARM_ARRAY ", upper: " KALMARM_ARRAY
                   ", seed: int, count: int | None) -> " KALMARM_RESULT));
}

}  // namespace kalmarm::python
