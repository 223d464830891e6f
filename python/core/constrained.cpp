#include "constrained.hpp"

#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <optional>
#include <tuple>
#include <utility>

#include "forces.hpp"
#include "lock.hpp"
#include "outcomes.hpp"

namespace kalmarm::python {
namespace {

using nb::literals::operator""_a;

// In the order of Constraint; the kind as a number, the impedance as least, most, width, midpoint, power.
using Given = std::tuple<std::string, int, Frame, Frame, double, std::vector<double>,
                         std::vector<double>, double, std::array<double, 5>, double, double, bool,
                         std::array<double, 2>, std::optional<std::array<double, 5>>>;

Constraint constraint_of(const Given& given) {
  const auto& [name, kind, first, second, turning, jacobian, other, reference, polynomial,
               stiffness, damping, velocity_terms, compliance, impedance] = given;
  Constraint out = {.name = name,
                    .kind = static_cast<Constraint::Kind>(kind),
                    .first = first,
                    .second = second,
                    .turning = turning,
                    .jacobian = jacobian,
                    .other = other,
                    .reference = reference,
                    .polynomial = polynomial,
                    .stiffness = stiffness,
                    .damping = damping,
                    .velocity_terms = velocity_terms,
                    .compliance = compliance};
  if (impedance) {
    const auto& [least, most, width, midpoint, power] = *impedance;
    out.impedance = Impedance{least, most, width, midpoint, power};
  }
  return out;
}

}  // namespace

Constrained::Constrained(const Robot& robot, std::vector<Constraint> constraints, double proximal,
                         int iterations)
    : model_(robot.model()),
      constraints_(std::move(constraints)),
      options_{.tolerance = robot.options().tolerance,
               .proximal = proximal,
               .iterations = iterations,
               .acted_on = robot.options().question.acted_on},
      outside_(6 * static_cast<int>(options_.acted_on.size())),
      names_(model_.names) {
  for (const Constraint& constraint : constraints_) names_.push_back(constraint.name);
  m_ = workers_.of<double>().take()->dynamics.rows();  // refuses what is bad
}

template <class One, class All>
nb::object Constrained::answer(const Inputs& given, bool status, int threads, const One& one,
                               const All& all) {
  Inputs in = given;
  const int nv = model_.nv(), count = in.count();
  const nb::object x = in.result(nb::none(), {nv}), forces = in.result(nb::none(), {m_}, "forces");
  return in.with_scalar([&]<class T>(T) {
    const auto worker = workers_.of<T>().take();
    std::vector<Outcome>& outcomes = worker->outcomes;
    outcomes.resize(std::max(count, 1));
    T *const to_x = data_of<T>(x), *const to_forces = data_of<T>(forces);
    if (in.is_single()) {
      outcomes[0] = one(worker->dynamics, VectorView<T>(to_x, nv), VectorView<T>(to_forces, m_));
    } else {
      const int used = cores(in.call(), threads, count);
      outcomes.resize(count);
      const WithoutLock released;
      all(worker->dynamics, RowsView<T>(to_x, count, nv), RowsView<T>(to_forces, count, m_),
          std::span<Outcome>(outcomes), used);
    }
    return answered(in, nb::make_tuple(x, forces), status, outcomes.data(), names_);
  });
}

nb::object Constrained::forward_dynamics(nb::handle q, nb::handle qd, nb::handle tau, bool status,
                                         int threads, nb::handle outside, const std::string& axes) {
  constexpr const char* call = "forward_dynamics";
  const int nq = model_.nq, nv = model_.nv();
  const WithForces acting(call, {{"q", q, nq}, {"qd", qd, nv}, {"tau", tau, nv}}, outside, outside_,
                          axes, nb::none(), 0);
  const Inputs in(call, acting.all());
  return answer(
      in, status, threads,
      [&]<class T>(ConstrainedDynamics<T>& robot, VectorView<T> a, VectorView<T> forces) {
        return robot.forward_dynamics(vector<T>(in, 0, 0, nq), vector<T>(in, 1, 0, nv),
                                      vector<T>(in, 2, 0, nv), a, forces, acting.of_state<T>(in));
      },
      [&]<class T>(ConstrainedDynamics<T>& robot, RowsView<T> a, RowsView<T> forces,
                   std::span<Outcome> outcomes, int used) {
        return robot.forward_dynamics(rows_of<T>(in, 0, nq), rows_of<T>(in, 1, nv),
                                      rows_of<T>(in, 2, nv), a, forces, outcomes, used,
                                      acting.of_rows<T>(in));
      });
}

nb::object Constrained::impulse(nb::handle q, nb::handle qd, bool status, int threads) {
  const int nq = model_.nq, nv = model_.nv();
  const Inputs in("impulse", {{"q", q, nq}, {"qd", qd, nv}});
  return answer(
      in, status, threads,
      [&]<class T>(ConstrainedDynamics<T>& robot, VectorView<T> after, VectorView<T> impulses) {
        return robot.impulse(vector<T>(in, 0, 0, nq), vector<T>(in, 1, 0, nv), after, impulses);
      },
      [&]<class T>(ConstrainedDynamics<T>& robot, RowsView<T> after, RowsView<T> impulses,
                   std::span<Outcome> outcomes, int used) {
        return robot.impulse(rows_of<T>(in, 0, nq), rows_of<T>(in, 1, nv), after, impulses,
                             outcomes, used);
      });
}

nb::object Constrained::solve(nb::handle q, nb::handle b, bool status, int threads) {
  const int nq = model_.nq, nv = model_.nv();
  const Inputs in("solve", {{"q", q, nq}, {"b", b, nv}});
  return answer(
      in, status, threads,
      [&]<class T>(ConstrainedDynamics<T>& robot, VectorView<T> x, VectorView<T> forces) {
        return robot.solve(vector<T>(in, 0, 0, nq), vector<T>(in, 1, 0, nv), x, forces);
      },
      [&]<class T>(ConstrainedDynamics<T>& robot, RowsView<T> x, RowsView<T> forces,
                   std::span<Outcome> outcomes, int used) {
        return robot.solve(rows_of<T>(in, 0, nq), rows_of<T>(in, 1, nv), x, forces, outcomes, used);
      });
}

nb::tuple Constrained::evaluate(nb::handle q, nb::handle qd) {
  const int nq = model_.nq, nv = model_.nv(), m = m_;
  std::vector<Argument> arguments = {{"q", q, nq}};
  const bool moves = !qd.is_none();
  if (moves) arguments.push_back({"qd", qd, nv});
  Inputs in("evaluate", arguments);
  const nb::object e = in.result(nb::none(), {m}), J = in.result(nb::none(), {m, nv}, "jacobian"),
                   rate = moves ? in.result(nb::none(), {m}, "rate") : nb::none();
  in.with_scalar([&]<class T>(T) {
    const auto worker = workers_.of<T>().take();
    for (std::ptrdiff_t i = 0; i < in.count(); ++i) {
      ConstraintState<T> out{.error = {data_of<T>(e) + i * m, m, 1},
                             .jacobian = {data_of<T>(J) + i * m * nv, nv, m}};
      if (!moves) {
        worker->dynamics.evaluate(vector<T>(in, 0, i, nq), out);
        continue;
      }
      out.rate = {data_of<T>(rate) + i * m, m, 1};
      worker->dynamics.evaluate(vector<T>(in, 0, i, nq), vector<T>(in, 1, i, nv), out);
    }
  });
  return nb::make_tuple(e, rate, J);
}

#define KALMARM_ARRAY "numpy.typing.ArrayLike"

void bind_constrained(nb::module_& module) {
  nb::class_<Constrained>(module, "ConstrainedDynamics")
      .def(
          "__init__",
          [](Constrained* self, const Robot& robot, const std::vector<Given>& constraints,
             double proximal, int iterations) {
            std::vector<Constraint> all;
            for (const Given& given : constraints) all.push_back(constraint_of(given));
            new (self) Constrained(robot, std::move(all), proximal, iterations);
          },
          "robot"_a, "constraints"_a, "proximal"_a, "iterations"_a)
      .def_prop_ro("rows", &Constrained::rows, "m, of all constraints together.")
      .def("_forward_dynamics", &Constrained::forward_dynamics, "q"_a, "qd"_a, "tau"_a, "status"_a,
           "threads"_a, "forces"_a.none(), "axes"_a,
           nb::sig("def _forward_dynamics(self, q: " KALMARM_ARRAY ", qd: " KALMARM_ARRAY
                   ", tau: " KALMARM_ARRAY ", status: bool, threads: int, forces: typing.Any"
                   ", axes: str) -> typing.Any"))
      .def("_impulse", &Constrained::impulse, "q"_a, "qd"_a, "status"_a, "threads"_a,
           nb::sig("def _impulse(self, q: " KALMARM_ARRAY ", qd: " KALMARM_ARRAY
                   ", status: bool, threads: int) -> typing.Any"))
      .def("_solve", &Constrained::solve, "q"_a, "b"_a, "status"_a, "threads"_a,
           nb::sig("def _solve(self, q: " KALMARM_ARRAY ", b: " KALMARM_ARRAY
                   ", status: bool, threads: int) -> typing.Any"))
      .def("_evaluate", &Constrained::evaluate, "q"_a, "qd"_a.none(),
           nb::sig("def _evaluate(self, q: " KALMARM_ARRAY
                   ", qd: typing.Any) -> tuple[typing.Any, typing.Any, typing.Any]"));
}

}  // namespace kalmarm::python
