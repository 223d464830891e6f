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
enum Field {
  dq,
  dqd,
  dtau,
  inertias_field,
  dqdd,
  armature_field,
  forces_field,
  loads_field,
  gravity_field
};
constexpr int fields = gravity_field + 1;

// Outcomes of results that come without any.
template <class T>
void look_at(std::span<const Result> results, std::span<Outcome> outcomes) {
  for (const Result& one : results) {
    if (one.array.is_none()) continue;
    for (std::size_t row = 0; row < outcomes.size(); ++row) {
      const T* const x = data_of<T>(one.array) + row * one.width;
      if (!std::all_of(x, x + one.width, [](T y) { return std::isfinite(y); }))
        outcomes[row].status = Outcome::Status::not_finite;
    }
  }
}

// The derivatives that a call is asked for.
class Wanted {
 public:
  std::array<Result, fields> results;

  Wanted(Inputs& in, int nv, bool inertias, bool armature) : in_(in) {
    if (inertias)
      results[inertias_field] = {in.result(nb::none(), {nv, 10}, "inertias"), 10 * npy_intp(nv)};
    if (armature) add(armature_field, "armature", nv);
  }
  void add(Field field, const char* name, npy_intp width) {
    results[field] = {in_.result(nb::none(), {width}, name), width};
  }

  nb::object named() const { return python::named("Gradients", results); }
  template <class T>
  RowsOfVectorJacobian<T> rows(int count) const {
    const auto field = [&](Field one) { return rows_in<T>(results[one], count); };
    return {.dq = field(dq),
            .dqd = field(dqd),
            .dtau = field(results[dqdd].array.is_none() ? dtau : dqdd),
            .inertias = field(inertias_field),
            .armature = field(armature_field),
            .forces = field(forces_field),
            .loads = field(loads_field),
            .gravity = field(gravity_field)};
  }

 private:
  Inputs& in_;
};

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

template <class Call>
nb::object Robot::products(Inputs& in, std::span<const Result> results, const nb::object& value,
                           bool status, int threads, const Call& call) {
  return in.with_scalar([&]<class T>(T) {
    const auto worker = gradients_.of<T>().take();
    const int count = in.count(), used = cores(in.call(), threads, count);
    std::vector<Outcome>& outcomes = worker->outcomes;
    outcomes.assign(count, Outcome{});
    {
      const WithoutLock released(count > 1 || model_.nv() >= large);
      call(worker->dynamics, std::span(outcomes), used);
      for (int i = 0; i < count; ++i)
        if (!outcomes[i]) lose<T>(results, i);
    }
    return answered(in, value, status, outcomes.data(), model_.names);
  });
}

nb::object Robot::vector_jacobian(Want of, nb::handle q, nb::handle qd, nb::handle x, nb::handle w,
                                  bool inertias, bool armature, bool status, int threads,
                                  nb::handle forces, nb::handle loads, nb::handle gravity) {
  const Names names = names_of(of);
  need(names.vjp, of);
  const int nq = model_.nq, nv = model_.nv();
  std::vector<Argument> arguments{{"q", q, nq}};
  if (of != Want::solve) arguments.push_back({"qd", qd, nv});
  arguments.push_back({names.x, x, nv});
  arguments.push_back({"w", w, nv});
  const WithForces given(names.vjp, arguments, forces, forces_, "local", loads, loads_, gravity);
  Inputs in(names.vjp, given.all());
  Wanted wanted(in, nv, inertias, armature);
  wanted.add(dq, "dq", nv);
  if (of != Want::solve) wanted.add(dqd, "dqd", nv);
  of == Want::inverse_dynamics ? wanted.add(dqdd, "dqdd", nv) : wanted.add(dtau, "dtau", nv);
  if (!forces.is_none()) wanted.add(forces_field, "forces", forces_);
  if (!loads.is_none()) wanted.add(loads_field, "loads", loads_);
  if (!gravity.is_none()) wanted.add(gravity_field, "gravity", numbers_of_gravity);
  return products(
      in, wanted.results, wanted.named(), status, threads,
      [&]<class T>(Gradients<T>& robot, std::span<Outcome> outcomes, int used) {
        const auto rows = [&](int i) { return rows_of<T>(in, i, i == 0 ? nq : nv); };
        const RowsOfVectorJacobian<T> out = wanted.template rows<T>(in.count());
        if (of == Want::acceleration) {
          static_cast<void>(robot.forward_dynamics_vjp(rows(0), rows(1), rows(2), rows(3), out,
                                                       outcomes, used, given.of_rows<T>(in)));
        } else if (of == Want::solve) {
          static_cast<void>(robot.solve_vjp(rows(0), rows(1), rows(2), out, outcomes, used,
                                            given.of_rows<T>(in).loads));
        } else {
          robot.inverse_dynamics_vjp(rows(0), rows(1), rows(2), rows(3), out, used,
                                     given.of_rows<T>(in));
          look_at<T>(wanted.results, outcomes);
        }
      });
}

nb::object Robot::operational_vjp(nb::handle q, nb::handle W, bool inertias, bool armature,
                                  bool status, int threads, nb::handle loads) {
  constexpr const char* call = "operational_vjp";
  need(call, Want::operational);
  const int nq = model_.nq, of_W = rows_ * rows_;
  const WithForces given(call, {{"q", q, nq}, {"W", W, of_W}}, nb::none(), 0, "local", loads,
                         loads_);
  Inputs in(call, given.all());
  Wanted wanted(in, model_.nv(), inertias, armature);
  wanted.add(dq, "dq", model_.nv());
  if (!loads.is_none()) wanted.add(loads_field, "loads", loads_);
  return products(
      in, wanted.results, wanted.named(), status, threads,
      [&]<class T>(Gradients<T>& robot, std::span<Outcome> outcomes, int used) {
        static_cast<void>(robot.operational_vjp(rows_of<T>(in, 0, nq), rows_of<T>(in, 1, of_W),
                                                wanted.template rows<T>(in.count()), outcomes, used,
                                                given.of_rows<T>(in).loads));
      });
}

nb::object Robot::jacobian_vector(Want of, nb::handle q, nb::handle qd, nb::handle x, nb::handle dq,
                                  nb::handle dqd, nb::handle dx, bool status, int threads,
                                  nb::handle forces, nb::handle loads, nb::handle gravity) {
  const Names names = names_of(of);
  need(names.jvp, of);
  const int nq = model_.nq, nv = model_.nv();
  std::vector<Argument> arguments{{"q", q, nq}};
  if (of != Want::solve) arguments.push_back({"qd", qd, nv});
  arguments.push_back({names.x, x, nv});
  arguments.push_back({"dq", dq, nv});
  if (of != Want::solve) arguments.push_back({"dqd", dqd, nv});
  arguments.push_back({names.dx, dx, nv});
  const WithForces given(names.jvp, arguments, forces, forces_, "local", loads, loads_, gravity);
  Inputs in(names.jvp, given.all());
  const std::array<Result, 1> result{{{in.result(nb::none(), {nv}), nv}}};
  return products(
      in, result, result[0].array, status, threads,
      [&]<class T>(Gradients<T>& robot, std::span<Outcome> outcomes, int used) {
        const auto rows = [&](int i) { return rows_of<T>(in, i, i == 0 ? nq : nv); };
        const RowsView<T> to = *rows_in<T>(result[0], in.count());
        if (of == Want::acceleration) {
          static_cast<void>(robot.forward_dynamics_jvp(rows(0), rows(1), rows(2), rows(3), rows(4),
                                                       rows(5), to, outcomes, used,
                                                       given.of_rows<T>(in)));
        } else if (of == Want::solve) {
          static_cast<void>(robot.solve_jvp(rows(0), rows(1), rows(2), rows(3), to, outcomes, used,
                                            given.of_rows<T>(in).loads));
        } else {
          robot.inverse_dynamics_jvp(rows(0), rows(1), rows(2), rows(3), rows(4), rows(5), to, used,
                                     given.of_rows<T>(in));
          look_at<T>(result, outcomes);
        }
      });
}

}  // namespace kalmarm::python
