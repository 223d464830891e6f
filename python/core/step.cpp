#include "step.hpp"

#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <tuple>
#include <vector>

#include "forces.hpp"
#include "gradients.hpp"
#include "lock.hpp"
#include "outcomes.hpp"

namespace kalmarm::python {
namespace {

using nb::literals::operator""_a;

Scheme scheme_of(const std::string& name) {
  if (name == "springs_at_end") return Scheme::springs_at_end;
  if (name == "springs_at_start") return Scheme::springs_at_start;
  throw nb::value_error(
      ("scheme '" + name + "' is unknown: springs_at_end, springs_at_start").c_str());
}

// jacobian, armature, damping, stiffness, reference, imposed
using Row = std::tuple<std::vector<double>, double, double, double, double, bool>;

std::vector<CoupledRow> coupled(const std::vector<Row>& rows) {
  std::vector<CoupledRow> out;
  for (const auto& [jacobian, armature, damping, stiffness, reference, imposed] : rows)
    out.push_back({jacobian, armature, damping, stiffness, reference, imposed});
  return out;
}

// The places of gains among the arguments of a call, -1: not given.
struct GainArguments {
  int damping, stiffness, reference, armature;

  GainArguments(std::vector<Argument>& arguments, const Step::Gains& given, int nv,
                std::array<const char*, 4> names = {"damping", "stiffness", "reference",
                                                    "armature"}) {
    const auto place = [&](const char* name, nb::handle value) {
      if (value.is_none()) return -1;
      arguments.push_back({name, value, nv});
      return static_cast<int>(arguments.size()) - 1;
    };
    damping = place(names[0], given.damping);
    stiffness = place(names[1], given.stiffness);
    reference = place(names[2], given.reference);
    armature = place(names[3], given.armature);
  }

  template <class T>
  GainRows<T> of_rows(const Inputs& in, int nv) const {
    const auto rows = [&](int i) -> RowsView<const T> {
      if (i < 0) return {nullptr, 0, 0};
      return {in.data<T>(i), in.count(), nv};
    };
    return {rows(damping), rows(stiffness), rows(reference), rows(armature)};
  }
};

}  // namespace

Step::Step(const Robot& robot, double h, JointTerms terms, Scheme scheme)
    : model_(robot.model()),
      h_(h),
      terms_(std::move(terms)),
      scheme_(scheme),
      options_{.tolerance = robot.options().tolerance},
      forces_(6 * static_cast<int>(robot.options().question.acted_on.size())),
      loads_(10 * static_cast<int>(robot.options().question.loaded.size())),
      contacts_(6 * static_cast<int>(robot.options().question.contacts.size())) {
  options_.question.acted_on = robot.options().question.acted_on;
  options_.question.loaded = robot.options().question.loaded;
  options_.question.contacts = robot.options().question.contacts;
  if (model_.nv() == 0) throw nb::value_error("the robot has no joint, so no degree of freedom");
  static_cast<void>(workers_.of<double>().take());  // refuses here what is bad
}

RobotModel Step::stiff_model() const {
  RobotModel out = model_;
  for (int k = 0; k < out.nv(); ++k) {
    const double b = terms_.damping.empty() ? 0 : terms_.damping[k];
    const bool at_end = scheme_ == Scheme::springs_at_end && !terms_.stiffness.empty();
    out.links[k].armature += h_ * (b + (at_end ? h_ * terms_.stiffness[k] : 0));
  }
  return out;
}

nb::object Step::acceleration(nb::handle q, nb::handle qd, nb::handle tau, nb::handle out,
                              const Gains& gains, bool status, int threads, nb::handle forces,
                              const std::string& axes, nb::handle loads, nb::handle gravity,
                              nb::handle contacts) {
  constexpr const char* call = "acceleration";
  const int nq = model_.nq, nv = model_.nv();
  std::vector<Argument> arguments = {{"q", q, nq}, {"qd", qd, nv}, {"tau", tau, nv}};
  const GainArguments given(arguments, gains, nv);
  const bool has_gains = arguments.size() > 3;
  const WithForces standing(call, arguments, contacts, contacts_, axes, nb::none(), 0, nb::none(),
                            contacts_argument);
  const WithForces acting(call, standing.all(), forces, forces_, axes, loads, loads_, gravity);
  Inputs in(call, acting.all());
  const nb::object result = in.result(out, {nv});
  const int count = in.count();
  return in.with_scalar([&]<class T>(T) {
    T* const a = data_of<T>(result);
    const auto worker = workers_.of<T>().take();
    std::vector<Outcome>& outcomes = worker->outcomes;
    outcomes.resize(std::max(count, 1));
    if (in.is_single() && !has_gains) {
      outcomes[0] = worker->dynamics.acceleration(vector<T>(in, 0, 0, nq), vector<T>(in, 1, 0, nv),
                                                  vector<T>(in, 2, 0, nv), {a, nv},
                                                  acting.of_state<T>(in), standing.of_state<T>(in));
    } else {
      const int used = cores(in.call(), threads, count);
      outcomes.resize(count);
      const WithoutLock released;
      static_cast<void>(worker->dynamics.acceleration(
          rows_of<T>(in, 0, nq), rows_of<T>(in, 1, nv), rows_of<T>(in, 2, nv),
          given.of_rows<T>(in, nv), RowsView<T>(a, count, nv), outcomes, used,
          acting.of_rows<T>(in), standing.of_rows<T>(in)));
    }
    for (int i = 0; i < count; ++i)
      if (!outcomes[i])
        std::fill_n(a + std::ptrdiff_t(i) * nv, nv, std::numeric_limits<T>::quiet_NaN());
    return answered(in, result, status, outcomes.data(), model_.names);
  });
}

nb::object Step::derivatives(nb::handle q, nb::handle qd, nb::handle tau, nb::handle out,
                             bool status, nb::handle forces, const std::string& axes,
                             nb::handle loads, nb::handle gravity) {
  constexpr const char* call = "derivatives";
  const int nq = model_.nq, nv = model_.nv();
  const WithForces acting(call, {{"q", q, nq}, {"qd", qd, nv}, {"tau", tau, nv}}, forces, forces_,
                          axes, loads, loads_, gravity);
  Inputs in(call, acting.all());
  DerivativeArrays arrays(in, out, nv);
  const int count = in.count();
  return in.with_scalar([&]<class T>(T) {
    T *const dq = data_of<T>(arrays.fields[0]), *const dqd = data_of<T>(arrays.fields[1]),
             *const dtau = data_of<T>(arrays.fields[2]), *const a = data_of<T>(arrays.fields[3]);
    const auto worker = workers_.of<T>().take();
    std::vector<Outcome>& outcomes = worker->outcomes;
    outcomes.resize(count);
    {
      const WithoutLock released;
      const std::ptrdiff_t size = std::ptrdiff_t(nv) * nv;
      for (std::ptrdiff_t i = 0; i < count; ++i) {
        outcomes[i] = worker->dynamics.derivatives(vector<T>(in, 0, i, nq), vector<T>(in, 1, i, nv),
                                                   vector<T>(in, 2, i, nv),
                                                   {.dq = {dq + i * size, nv, nv},
                                                    .dqd = {dqd + i * size, nv, nv},
                                                    .dtau = {dtau + i * size, nv, nv}},
                                                   {a + i * nv, nv}, acting.of_state<T>(in, i));
        if (outcomes[i]) continue;
        for (T* X : {dq, dqd, dtau})
          std::fill_n(X + i * size, size, std::numeric_limits<T>::quiet_NaN());
        std::fill_n(a + i * nv, nv, std::numeric_limits<T>::quiet_NaN());
      }
    }
    return answered(in, arrays.tuple(), status, outcomes.data(), model_.names);
  });
}

nb::object Step::vector_jacobian(nb::handle q, nb::handle qd, nb::handle tau, nb::handle w,
                                 const Gains& gains, bool inertias, bool status, int threads,
                                 nb::handle forces, nb::handle loads, nb::handle gravity) {
  constexpr const char* call = "acceleration_vjp";
  const int nq = model_.nq, nv = model_.nv();
  std::vector<Argument> arguments = {{"q", q, nq}, {"qd", qd, nv}, {"tau", tau, nv}, {"w", w, nv}};
  const GainArguments given(arguments, gains, nv);
  const WithForces acting(call, arguments, forces, forces_, "local", loads, loads_, gravity);
  Inputs in(call, acting.all());
  // In the order of kalmarm.StepGradients.
  enum {
    dq,
    dqd,
    dtau,
    damping,
    stiffness,
    reference,
    by_inertias,
    by_armature,
    by_forces,
    by_loads,
    by_gravity,
    a,
    fields
  };
  std::array<Result, fields> results;
  for (const auto& [field, name] : {std::pair{dq, "dq"},
                                    {dqd, "dqd"},
                                    {dtau, "dtau"},
                                    {damping, "damping"},
                                    {stiffness, "stiffness"},
                                    {reference, "reference"},
                                    {by_armature, "armature"},
                                    {a, "a"}})
    results[field] = {in.result(nb::none(), {nv}, name), nv};
  if (inertias)
    results[by_inertias] = {in.result(nb::none(), {nv, 10}, "inertias"), 10 * npy_intp(nv)};
  if (!forces.is_none()) results[by_forces] = {in.result(nb::none(), {forces_}, "forces"), forces_};
  if (!loads.is_none()) results[by_loads] = {in.result(nb::none(), {loads_}, "loads"), loads_};
  if (!gravity.is_none()) results[by_gravity] = {in.result(nb::none(), {3}, "gravity"), 3};
  return in.with_scalar([&]<class T>(T) {
    const auto worker = gradients_.of<T>().take();
    const int count = in.count(), used = cores(in.call(), threads, count);
    std::vector<Outcome>& outcomes = worker->outcomes;
    outcomes.assign(count, Outcome{});
    {
      const WithoutLock released;
      const auto field = [&](int one) { return rows_in<T>(results[one], count); };
      const int failed = worker->dynamics.acceleration_vjp(
          rows_of<T>(in, 0, nq), rows_of<T>(in, 1, nv), rows_of<T>(in, 2, nv),
          rows_of<T>(in, 3, nv),
          {.dq = field(dq),
           .dv = field(dqd),
           .dtau = field(dtau),
           .damping = field(damping),
           .stiffness = field(stiffness),
           .reference = field(reference),
           .inertias = field(by_inertias),
           .armature = field(by_armature),
           .forces = field(by_forces),
           .loads = field(by_loads),
           .gravity = field(by_gravity),
           .result = field(a)},
          outcomes, used, given.of_rows<T>(in, nv), acting.of_rows<T>(in));
      for (int i = 0; failed > 0 && i < count; ++i)
        if (!outcomes[i]) lose<T>(results, i);
    }
    return answered(in, named("StepGradients", results), status, outcomes.data(), model_.names);
  });
}

nb::object Step::jacobian_vector(nb::handle q, nb::handle qd, nb::handle tau, nb::handle dq,
                                 nb::handle dqd, nb::handle dtau, const Gains& gains,
                                 const Gains& along, bool status, int threads, nb::handle forces,
                                 nb::handle loads, nb::handle gravity) {
  constexpr const char* call = "acceleration_jvp";
  const int nq = model_.nq, nv = model_.nv();
  std::vector<Argument> arguments = {{"q", q, nq},   {"qd", qd, nv},   {"tau", tau, nv},
                                     {"dq", dq, nv}, {"dqd", dqd, nv}, {"dtau", dtau, nv}};
  const GainArguments given(arguments, gains, nv),
      directions(arguments, along, nv, {"ddamping", "dstiffness", "dreference", "darmature"});
  const WithForces acting(call, arguments, forces, forces_, "local", loads, loads_, gravity);
  Inputs in(call, acting.all());
  const std::array<Result, 1> result{{{in.result(nb::none(), {nv}), nv}}};
  return in.with_scalar([&]<class T>(T) {
    const auto worker = gradients_.of<T>().take();
    const int count = in.count(), used = cores(in.call(), threads, count);
    std::vector<Outcome>& outcomes = worker->outcomes;
    outcomes.assign(count, Outcome{});
    {
      const WithoutLock released;
      const auto rows = [&](int i) { return rows_of<T>(in, i, i == 0 ? nq : nv); };
      const int failed = worker->dynamics.acceleration_jvp(
          rows(0), rows(1), rows(2), rows(3), rows(4), rows(5), *rows_in<T>(result[0], count),
          outcomes, used, given.of_rows<T>(in, nv), directions.of_rows<T>(in, nv),
          acting.of_rows<T>(in));
      for (int i = 0; failed > 0 && i < count; ++i)
        if (!outcomes[i]) lose<T>(result, i);
    }
    return answered(in, result[0].array, status, outcomes.data(), model_.names);
  });
}

nb::tuple Step::advance(nb::handle q, nb::handle qd, nb::handle a, nb::handle out) const {
  const int nq = model_.nq, nv = model_.nv();
  Inputs in("advance", {{"q", q, nq}, {"qd", qd, nv}, {"a", a, nv}});
  const bool given = !out.is_none();
  if (given && (!PyTuple_Check(out.ptr()) || nb::len(out) != 2))
    throw nb::type_error("advance: out is not what an earlier call returned");
  const nb::object next_q = in.result(given ? nb::object(out[0]) : nb::none(), {nq}, "out.q"),
                   next_qd = in.result(given ? nb::object(out[1]) : nb::none(), {nv}, "out.qd");
  in.with_scalar([&]<class T>(T) {
    T *const to_q = data_of<T>(next_q), *const to_qd = data_of<T>(next_qd);
    const std::ptrdiff_t count = in.count();
    std::copy_n(in.data<T>(0), count * nq, to_q);
    std::copy_n(in.data<T>(1), count * nv, to_qd);
    const WithoutLock released;
    for (std::ptrdiff_t i = 0; i < count; ++i)
      kalmarm::advance(model_, h_, vector<T>(in, 2, i, nv), VectorView<T>(to_q + i * nq, nq),
                       VectorView<T>(to_qd + i * nv, nv));
  });
  return nb::make_tuple(next_q, next_qd);
}

#define KALMARM_STATE \
  "(self, q: numpy.typing.ArrayLike, qd: numpy.typing.ArrayLike, tau: numpy.typing.ArrayLike, "
#define KALMARM_FORCES                                                                      \
  ", forces: typing.Any = None, axes: str = 'aligned', loads: typing.Any = None, gravity: " \
  "typing.Any = None"

void bind_step(nb::module_& m) {
  const nb::kw_only options;
  nb::class_<Step>(m, "ImplicitStep")
      .def(
          "__init__",
          [](Step* self, const Robot& robot, double h, std::vector<double> damping,
             std::vector<double> stiffness, std::vector<double> reference,
             const std::vector<Row>& rows, const std::string& scheme) {
            new (self) Step(
                robot, h,
                {std::move(damping), std::move(stiffness), std::move(reference), coupled(rows)},
                scheme_of(scheme));
          },
          "robot"_a, "h"_a, "damping"_a, "stiffness"_a, "reference"_a, "rows"_a, "scheme"_a)
      .def_prop_ro("h", &Step::h, "[s]")
      .def_prop_ro("scheme",
                   [](const Step& self) {
                     return self.scheme() == Scheme::springs_at_end ? "springs_at_end"
                                                                    : "springs_at_start";
                   })
      .def_prop_ro("_stiff_model", &Step::stiff_model)
      .def_prop_ro("_armature",
                   [](const Step& self) {
                     std::vector<double> out;
                     for (const LinkParameters& link : self.model().links)
                       out.push_back(link.armature);
                     return out;
                   })
      .def(
          "acceleration",
          [](Step& self, nb::handle q, nb::handle qd, nb::handle tau, nb::handle out,
             nb::handle damping, nb::handle stiffness, nb::handle reference, nb::handle armature,
             bool status, int threads, nb::handle forces, const std::string& axes, nb::handle loads,
             nb::handle gravity, nb::handle contacts) {
            return self.acceleration(q, qd, tau, out, {damping, stiffness, reference, armature},
                                     status, threads, forces, axes, loads, gravity, contacts);
          },
          "q"_a, "qd"_a, "tau"_a, "out"_a = nb::none(), options, "damping"_a = nb::none(),
          "stiffness"_a = nb::none(), "reference"_a = nb::none(), "armature"_a = nb::none(),
          "status"_a = false, "threads"_a = 1, "forces"_a = nb::none(), "axes"_a = "aligned",
          "loads"_a = nb::none(), "gravity"_a = nb::none(), "contacts"_a = nb::none(),
          nb::sig("def acceleration" KALMARM_STATE
                  "out: typing.Any = None, *, damping: typing.Any = None, stiffness: typing.Any = "
                  "None, reference: typing.Any = None, armature: typing.Any = None, status: bool = "
                  "False, threads: int = "
                  "1" KALMARM_FORCES ", contacts: typing.Any = None) -> typing.Any"),
          R"(a = (qd+ - qd) / h of the step.

q (..., nq), qd and tau (..., nv) -> a (..., nv).

damping, stiffness, reference: (..., nv), of every state its own, in place of the step's, and armature in
place of the robot's. References cost nothing; the others 1.2 times the time of a step, but below a tolerance of 1e-12 every
state then is a robot that is made anew. ValueError with the row and the DoF where one is
negative or not finite, where a ball or free joint has a spring, and where dampers, springs or
armatures stand beside rows of the step.

forces (..., 6 f), loads and gravity: as of Robot.forward_dynamics, where the step begins. contacts (..., 6 c): rows of
(M + h B + h^2 K + J'DJ) a = tau - bias, as of Robot.solve.)")
      .def("derivatives", &Step::derivatives, "q"_a, "qd"_a, "tau"_a, "out"_a = nb::none(), options,
           "status"_a = false, "forces"_a = nb::none(), "axes"_a = "aligned",
           "loads"_a = nb::none(), "gravity"_a = nb::none(),
           nb::sig("def derivatives" KALMARM_STATE
                   "out: typing.Any = None, *, status: bool = False" KALMARM_FORCES
                   ") -> typing.Any"),
           R"(Derivatives of the step's acceleration by q, qd and tau, analytically, and a itself.

q (..., nq), qd and tau (..., nv) -> Derivatives(dq, dqd, dtau, a), as those of
Robot.forward_dynamics_derivatives; dtau is the inverse of M + h B + h^2 K. forces turn with their
frames: axes "local" is needed.)")
      .def(
          "_vector_jacobian",
          [](Step& self, nb::handle q, nb::handle qd, nb::handle tau, nb::handle w,
             nb::handle damping, nb::handle stiffness, nb::handle reference, nb::handle armature,
             bool inertias, bool status, int threads, nb::handle forces, nb::handle loads,
             nb::handle gravity) {
            return self.vector_jacobian(q, qd, tau, w, {damping, stiffness, reference, armature},
                                        inertias, status, threads, forces, loads, gravity);
          },
          "q"_a, "qd"_a, "tau"_a, "w"_a, "damping"_a.none(), "stiffness"_a.none(),
          "reference"_a.none(), "armature"_a.none(), "inertias"_a, "status"_a, "threads"_a,
          "forces"_a.none(), "loads"_a.none(), "gravity"_a.none())
      .def(
          "_jacobian_vector",
          [](Step& self, nb::handle q, nb::handle qd, nb::handle tau, nb::handle dq, nb::handle dqd,
             nb::handle dtau, nb::handle damping, nb::handle stiffness, nb::handle reference,
             nb::handle armature, nb::handle ddamping, nb::handle dstiffness, nb::handle dreference,
             nb::handle darmature, bool status, int threads, nb::handle forces, nb::handle loads,
             nb::handle gravity) {
            return self.jacobian_vector(q, qd, tau, dq, dqd, dtau,
                                        {damping, stiffness, reference, armature},
                                        {ddamping, dstiffness, dreference, darmature}, status,
                                        threads, forces, loads, gravity);
          },
          "q"_a, "qd"_a, "tau"_a, "dq"_a, "dqd"_a, "dtau"_a, "damping"_a.none(),
          "stiffness"_a.none(), "reference"_a.none(), "armature"_a.none(), "ddamping"_a.none(),
          "dstiffness"_a.none(), "dreference"_a.none(), "darmature"_a.none(), "status"_a,
          "threads"_a, "forces"_a.none(), "loads"_a.none(), "gravity"_a.none())
      .def("advance", &Step::advance, "q"_a, "qd"_a, "a"_a, "out"_a = nb::none(),
           nb::sig("def advance(self, q: numpy.typing.ArrayLike, qd: numpy.typing.ArrayLike, a: "
                   "numpy.typing.ArrayLike, out: tuple[numpy.typing.NDArray[typing.Any], "
                   "numpy.typing.NDArray[typing.Any]] | None = None) -> "
                   "tuple[numpy.typing.NDArray[typing.Any], numpy.typing.NDArray[typing.Any]]"),
           "(q, qd) after h with the accelerations a: qd + h a, and q moved along it, quaternions "
           "turned. out: such a pair of arrays.");
}

}  // namespace kalmarm::python
