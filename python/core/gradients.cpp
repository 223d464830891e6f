#include "gradients.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "forces.hpp"
#include "lock.hpp"
#include "outcomes.hpp"
#include "robot.hpp"

namespace kalmarm::python {
namespace {

// In the order of kalmarm.Gradients.
enum Field { dq, dqd, dtau, inertias_field, dqdd, armature_field, forces_field, loads_field };
constexpr int fields = loads_field + 1;

// Of results that come without outcomes.
template <class T>
Outcome outcome_of(std::span<const Result> results, int row) {
  Outcome out;
  for (const Result& one : results) {
    if (one.array.is_none()) continue;
    const T* const x = data_of<T>(one.array) + row * one.width;
    if (!std::all_of(x, x + one.width, [](T y) { return std::isfinite(y); }))
      out.status = Outcome::Status::not_finite;
  }
  return out;
}

struct Names {
  const char *vjp, *jvp, *x, *dx;
};
Names names_of(Want of) {
  if (of == Want::acceleration)
    return {"forward_dynamics_vjp", "forward_dynamics_jvp", "tau", "dtau"};
  if (of == Want::inverse_dynamics)
    return {"inverse_dynamics_vjp", "inverse_dynamics_jvp", "qdd", "dqdd"};
  return {"solve_vjp", "solve_jvp", "tau", "dtau"};
}

}  // namespace

nb::object named(const char* type, std::span<const Result> results) {
  nb::list arrays;
  for (const Result& one : results) arrays.append(one.array);
  return nb::module_::import_("kalmarm.results").attr(type)(*arrays);
}

nb::object Robot::vector_jacobian(Want of, nb::handle q, nb::handle qd, nb::handle x, nb::handle w,
                                  bool inertias, bool armature, bool status, int threads,
                                  nb::handle forces, nb::handle loads) {
  const Names names = names_of(of);
  need(names.vjp, of);
  const int nq = model_.nq, nv = model_.nv();
  std::vector<Argument> arguments{{"q", q, nq}};
  if (of != Want::solve) arguments.push_back({"qd", qd, nv});
  arguments.push_back({names.x, x, nv});
  arguments.push_back({"w", w, nv});
  const WithForces given(names.vjp, arguments, forces, forces_, "local", loads, loads_);
  Inputs in(names.vjp, given.all());
  std::array<Result, fields> results;
  const auto want = [&](Field field, const char* name) {
    results[field] = {in.result(nb::none(), {nv}, name), nv};
  };
  want(dq, "dq");
  if (of != Want::solve) want(dqd, "dqd");
  of == Want::inverse_dynamics ? want(dqdd, "dqdd") : want(dtau, "dtau");
  if (inertias)
    results[inertias_field] = {in.result(nb::none(), {nv, 10}, "inertias"), 10 * npy_intp(nv)};
  if (armature) want(armature_field, "armature");
  if (!forces.is_none())
    results[forces_field] = {in.result(nb::none(), {forces_}, "forces"), forces_};
  if (!loads.is_none()) results[loads_field] = {in.result(nb::none(), {loads_}, "loads"), loads_};
  return in.with_scalar([&]<class T>(T) {
    const auto worker = gradients_.of<T>().take();
    const int count = in.count(), used = cores(in.call(), threads, count);
    std::vector<Outcome>& outcomes = worker->outcomes;
    outcomes.assign(count, Outcome{});
    {
      const WithoutLock released(count > 1 || nv >= large);
      const auto field = [&](Field one) { return rows_in<T>(results[one], count); };
      const RowsOfVectorJacobian<T> out{.dq = field(dq),
                                        .dqd = field(dqd),
                                        .dtau = field(of == Want::inverse_dynamics ? dqdd : dtau),
                                        .inertias = field(inertias_field),
                                        .armature = field(armature_field),
                                        .forces = field(forces_field),
                                        .loads = field(loads_field)};
      Gradients<T>& robot = worker->dynamics;
      int failed = 0;
      if (of == Want::acceleration)
        failed = robot.forward_dynamics_vjp(rows_of<T>(in, 0, nq), rows_of<T>(in, 1, nv),
                                            rows_of<T>(in, 2, nv), rows_of<T>(in, 3, nv), out,
                                            outcomes, used, given.of_rows<T>(in));
      else if (of == Want::solve)
        failed =
            robot.solve_vjp(rows_of<T>(in, 0, nq), rows_of<T>(in, 1, nv), rows_of<T>(in, 2, nv),
                            out, outcomes, used, given.of_rows<T>(in).loads);
      else
        robot.inverse_dynamics_vjp(rows_of<T>(in, 0, nq), rows_of<T>(in, 1, nv),
                                   rows_of<T>(in, 2, nv), rows_of<T>(in, 3, nv), out, used,
                                   given.of_rows<T>(in));
      for (int i = 0; of == Want::inverse_dynamics && i < count; ++i) {
        outcomes[i] = outcome_of<T>(results, i);
        failed += !outcomes[i];
      }
      for (int i = 0; failed > 0 && i < count; ++i)
        if (!outcomes[i]) lose<T>(results, i);
    }
    return answered(in, named("Gradients", results), status, outcomes.data(), model_.names);
  });
}

nb::object Robot::jacobian_vector(Want of, nb::handle q, nb::handle qd, nb::handle x, nb::handle dq,
                                  nb::handle dqd, nb::handle dx, bool status, int threads,
                                  nb::handle forces, nb::handle loads) {
  const Names names = names_of(of);
  need(names.jvp, of);
  const int nq = model_.nq, nv = model_.nv();
  std::vector<Argument> arguments{{"q", q, nq}};
  if (of != Want::solve) arguments.push_back({"qd", qd, nv});
  arguments.push_back({names.x, x, nv});
  arguments.push_back({"dq", dq, nv});
  if (of != Want::solve) arguments.push_back({"dqd", dqd, nv});
  arguments.push_back({names.dx, dx, nv});
  const WithForces given(names.jvp, arguments, forces, forces_, "local", loads, loads_);
  Inputs in(names.jvp, given.all());
  const std::array<Result, 1> result{{{in.result(nb::none(), {nv}), nv}}};
  return in.with_scalar([&]<class T>(T) {
    const auto worker = gradients_.of<T>().take();
    const int count = in.count(), used = cores(in.call(), threads, count);
    std::vector<Outcome>& outcomes = worker->outcomes;
    outcomes.assign(count, Outcome{});
    {
      const WithoutLock released(count > 1 || nv >= large);
      const auto rows = [&](int i) { return rows_of<T>(in, i, i == 0 ? nq : nv); };
      const RowsView<T> to = *rows_in<T>(result[0], count);
      Gradients<T>& robot = worker->dynamics;
      int failed = 0;
      if (of == Want::acceleration)
        failed = robot.forward_dynamics_jvp(rows(0), rows(1), rows(2), rows(3), rows(4), rows(5),
                                            to, outcomes, used, given.of_rows<T>(in));
      else if (of == Want::solve)
        failed = robot.solve_jvp(rows(0), rows(1), rows(2), rows(3), to, outcomes, used,
                                 given.of_rows<T>(in).loads);
      else
        robot.inverse_dynamics_jvp(rows(0), rows(1), rows(2), rows(3), rows(4), rows(5), to, used,
                                   given.of_rows<T>(in));
      for (int i = 0; of == Want::inverse_dynamics && i < count; ++i) {
        outcomes[i] = outcome_of<T>(result, i);
        failed += !outcomes[i];
      }
      for (int i = 0; failed > 0 && i < count; ++i)
        if (!outcomes[i]) lose<T>(result, i);
    }
    return answered(in, result[0].array, status, outcomes.data(), model_.names);
  });
}

}  // namespace kalmarm::python
