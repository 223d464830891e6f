#include "robot.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <span>
#include <thread>

#include "forces.hpp"
#include "lock.hpp"
#include "outcomes.hpp"

namespace kalmarm::python {
namespace {

constexpr int derivatives_fields = 4;

template <class T>
bool is_finite(const T* x, npy_intp count) {
  unsigned bad = 0;
  for (npy_intp i = 0; i < count; ++i) bad |= x[i] - x[i] != 0;
  return bad == 0;
}

// Of a result that comes without one.
template <class T>
Outcome outcome_of(const T* x, npy_intp count) {
  Outcome out;
  if (!is_finite(x, count)) out.status = Outcome::Status::not_finite;
  return out;
}

}  // namespace

int cores(const char* call, int threads, int states) {
  if (threads < 0)
    throw nb::value_error(
        (std::string(call) + ": " + std::to_string(threads) + " threads").c_str());
  // To ask takes longer than a call of a few states.
  static const int all = std::max(static_cast<int>(std::thread::hardware_concurrency()), 1);
  return std::clamp(threads == 0 ? all : std::min(threads, all), 1, std::max(states, 1));
}

Robot::Robot(RobotModel model, DynamicsOptions options, bool compiled_float, bool compiled_double)
    : model_(std::move(model)),
      options_(std::move(options)),
      compiled_float_(compiled_float),
      compiled_double_(compiled_double),
      rows_(6 * static_cast<int>(options_.question.frames.size())),
      forces_(6 * static_cast<int>(options_.question.acted_on.size())),
      contacts_(6 * static_cast<int>(options_.question.contacts.size())),
      loads_(10 * static_cast<int>(options_.question.loaded.size())) {
  if (model_.nv() == 0) throw nb::value_error("the robot has no joint, so no degree of freedom");
  names_with_rows_ = model_.names;
  for (int i = 0; i < rows_; ++i)
    names_with_rows_.push_back((i % 6 < 3 ? "turning of frame " : "moving of frame ") +
                               std::to_string(i / 6));
  const WithoutLock released(compiled_float_ || compiled_double_);  // which takes seconds
  asked_ = workers_.of<double>().take()->dynamics.asked();
  if (compiled_float_) (void)workers_.of<float>().take();
}

std::vector<std::string> Robot::compiled() {
  std::vector<std::string> out;
  const auto add = [&](const char* dtype, const std::vector<std::string>& notes) {
    for (const std::string& note : notes) out.push_back(dtype + (" " + note));
  };
  if (compiled_double_) add("float64", workers_.of<double>().take()->dynamics.notes());
  if (compiled_float_) add("float32", workers_.of<float>().take()->dynamics.notes());
  return out;
}

PlanSummary Robot::plan() { return summary_of(workers_.of<double>().take()->dynamics.plan()); }

void Robot::need(const char* call, Want want) const {
  if (options_.question.wants(want)) return;
  const bool frames = is_of_frames(want) && options_.question.frames.empty();
  throw nb::value_error((std::string(call) + (frames ? ": no frames are asked about"
                                                     : ": the robot's question does not want it"))
                            .c_str());
}

template <class One, class All>
nb::object Robot::rows(const Inputs& inputs, int threads, bool status, const nb::object& result,
                       npy_intp width, const One& one, const All& all,
                       const std::vector<std::string>* given_names) {
  const std::vector<std::string>& names = given_names ? *given_names : model_.names;
  const int count = inputs.count();
  return inputs.with_scalar([&]<class T>(T) {
    constexpr T nan = std::numeric_limits<T>::quiet_NaN();
    T* const to = data_of<T>(result);
    const auto worker = workers_.of<T>().take();
    if (inputs.is_single()) {
      Outcome outcome;
      {
        const WithoutLock released(model_.nv() >= large);
        outcome = one(worker->dynamics, to);
        if (!outcome) std::fill_n(to, width, nan);
      }
      return answered(inputs, result, status, &outcome, names);
    }
    const int used = cores(inputs.call(), threads, count);
    worker->outcomes.resize(count);
    {
      const WithoutLock released(count > 1 || model_.nv() >= large);
      const int failed = all(worker->dynamics, RowsView<T>(to, count, width),
                             std::span<Outcome>(worker->outcomes), used);
      for (int i = 0; failed > 0 && i < count; ++i)
        if (!worker->outcomes[i]) std::fill_n(to + i * width, width, nan);
    }
    return answered(inputs, result, status, worker->outcomes.data(), names);
  });
}

nb::object Robot::forward_dynamics(nb::handle q, nb::handle qd, nb::handle tau, nb::handle out,
                                   bool status, int threads, nb::handle forces,
                                   const std::string& axes, nb::handle loads, nb::handle gravity) {
  constexpr const char* call = "forward_dynamics";
  need(call, Want::acceleration);
  const int nq = model_.nq, nv = model_.nv();
  const WithForces given(call, {{"q", q, nq}, {"qd", qd, nv}, {"tau", tau, nv}}, forces, forces_,
                         axes, loads, loads_, gravity);
  Inputs in(call, given.all());
  return rows(
      in, threads, status, in.result(out, {asked_}), asked_,
      [&]<class T>(Dynamics<T>& dynamics, T* a) {
        return dynamics.forward_dynamics(vector<T>(in, 0, 0, nq), vector<T>(in, 1, 0, nv),
                                         vector<T>(in, 2, 0, nv), {a, asked_},
                                         given.of_state<T>(in));
      },
      [&]<class T>(Dynamics<T>& dynamics, RowsView<T> a, std::span<Outcome> outcomes, int used) {
        return dynamics.forward_dynamics(rows_of<T>(in, 0, nq), rows_of<T>(in, 1, nv),
                                         rows_of<T>(in, 2, nv), a, outcomes, used,
                                         given.of_rows<T>(in));
      });
}

template <class Given>
nb::object Robot::newton_euler(const char* call, const Given& given, nb::handle out, bool status,
                               int threads, int qd, int qdd) {
  need(call, Want::inverse_dynamics);
  Inputs in(call, given.all());
  const int nq = model_.nq, nv = model_.nv(), count = in.count();
  const nb::object result = in.result(out, {asked_});
  return in.with_scalar([&]<class T>(T) {
    T* const tau = data_of<T>(result);
    const auto worker = workers_.of<T>().take();
    std::vector<T>& zeros = worker->zeros;
    if (const std::size_t needed = std::size_t(count) * nv; qdd < 0 && zeros.size() < needed)
      zeros.resize(needed, T(0));
    const auto rows = [&](int i) {
      return RowsView<const T>(i < 0 ? zeros.data() : in.data<T>(i), count, nv);
    };
    if (in.is_single()) {
      Outcome outcome;
      {
        const WithoutLock released(nv >= large);
        worker->dynamics.inverse_dynamics(vector<T>(in, 0, 0, nq),
                                          VectorView<const T>(rows(qd).data(), nv),
                                          VectorView<const T>(rows(qdd).data(), nv), {tau, asked_},
                                          given.template of_state<T>(in));
        outcome = outcome_of(tau, asked_);
        if (!outcome) std::fill_n(tau, asked_, std::numeric_limits<T>::quiet_NaN());
      }
      return answered(in, result, status, &outcome, model_.names);
    }
    const int used = cores(in.call(), threads, count);
    bool looks = status;  // else all rows are ok
    {
      const WithoutLock released(count > 1 || nv >= large);
      worker->dynamics.inverse_dynamics(RowsView<const T>(in.data<T>(0), count, nq), rows(qd),
                                        rows(qdd), RowsView<T>(tau, count, asked_), used,
                                        given.template of_rows<T>(in));
      looks = looks || !is_finite(tau, npy_intp(count) * asked_);
      if (looks) {
        worker->outcomes.resize(count);
        for (int i = 0; i < count; ++i) {
          T* const row = tau + std::ptrdiff_t(i) * asked_;
          worker->outcomes[i] = outcome_of(row, asked_);
          if (!worker->outcomes[i]) std::fill_n(row, asked_, std::numeric_limits<T>::quiet_NaN());
        }
      }
    }
    return looks ? answered(in, result, status, worker->outcomes.data(), model_.names) : result;
  });
}

nb::object Robot::inverse_dynamics(nb::handle q, nb::handle qd, nb::handle qdd, nb::handle out,
                                   bool status, int threads, nb::handle forces,
                                   const std::string& axes, nb::handle loads, nb::handle gravity) {
  constexpr const char* call = "inverse_dynamics";
  const int nv = model_.nv();
  const WithForces given(call, {{"q", q, model_.nq}, {"qd", qd, nv}, {"qdd", qdd, nv}}, forces,
                         forces_, axes, loads, loads_, gravity);
  return newton_euler(call, given, out, status, threads, 1, 2);
}

nb::object Robot::bias(nb::handle q, nb::handle qd, nb::handle out, bool status, int threads,
                       nb::handle forces, const std::string& axes, nb::handle loads,
                       nb::handle gravity) {
  constexpr const char* call = "bias";
  const WithForces given(call, {{"q", q, model_.nq}, {"qd", qd, model_.nv()}}, forces, forces_,
                         axes, loads, loads_, gravity);
  return newton_euler(call, given, out, status, threads, 1, -1);
}

nb::object Robot::gravity(nb::handle q, nb::handle out, bool status, int threads, nb::handle loads,
                          nb::handle gravity) {
  constexpr const char* call = "gravity";
  const WithForces given(call, {{"q", q, model_.nq}}, nb::none(), 0, "local", loads, loads_,
                         gravity);
  return newton_euler(call, given, out, status, threads, -1, -1);
}

nb::object Robot::mass_matrix(nb::handle q, nb::handle out, bool status, int threads,
                              nb::handle loads) {
  need("mass_matrix", Want::mass);
  const WithForces given("mass_matrix", {{"q", q, model_.nq}}, nb::none(), 0, "local", loads,
                         loads_);
  Inputs in("mass_matrix", given.all());
  const npy_intp size = npy_intp(asked_) * asked_;
  return rows(
      in, threads, status, in.result(out, {asked_, asked_}), size,
      [&]<class T>(Dynamics<T>& dynamics, T* M) {
        dynamics.mass(vector<T>(in, 0, 0, model_.nq), {M, asked_, asked_},
                      given.of_state<T>(in).loads);
        return outcome_of(M, size);
      },
      [&]<class T>(Dynamics<T>& dynamics, RowsView<T> M, std::span<Outcome> outcomes, int used) {
        return dynamics.mass(rows_of<T>(in, 0, model_.nq), M, outcomes, used,
                             given.of_rows<T>(in).loads);
      });
}

nb::object Robot::inverse_mass_matrix(nb::handle q, nb::handle out, bool status, int threads,
                                      nb::handle contacts, const std::string& axes,
                                      nb::handle loads) {
  need("inverse_mass_matrix", Want::inverse);
  const WithForces given("inverse_mass_matrix", {{"q", q, model_.nq}}, contacts, contacts_, axes,
                         loads, loads_, nb::none(), contacts_argument);
  Inputs in("inverse_mass_matrix", given.all());
  return rows(
      in, threads, status, in.result(out, {asked_, asked_}), npy_intp(asked_) * asked_,
      [&]<class T>(Dynamics<T>& dynamics, T* X) {
        return dynamics.inverse_mass(vector<T>(in, 0, 0, model_.nq), {X, asked_, asked_},
                                     given.of_state<T>(in));
      },
      [&]<class T>(Dynamics<T>& dynamics, RowsView<T> X, std::span<Outcome> outcomes, int used) {
        return dynamics.inverse_mass(rows_of<T>(in, 0, model_.nq), X, outcomes, used,
                                     given.of_rows<T>(in));
      });
}

nb::object Robot::diagonal(nb::handle q, nb::handle out, bool status, int threads,
                           nb::handle contacts, const std::string& axes, nb::handle loads) {
  need("diagonal", Want::diagonal);
  const WithForces given("diagonal", {{"q", q, model_.nq}}, contacts, contacts_, axes, loads,
                         loads_, nb::none(), contacts_argument);
  Inputs in("diagonal", given.all());
  return rows(
      in, threads, status, in.result(out, {asked_}), asked_,
      [&]<class T>(Dynamics<T>& dynamics, T* x) {
        return dynamics.diagonal(vector<T>(in, 0, 0, model_.nq), {x, asked_},
                                 given.of_state<T>(in));
      },
      [&]<class T>(Dynamics<T>& dynamics, RowsView<T> x, std::span<Outcome> outcomes, int used) {
        return dynamics.diagonal(rows_of<T>(in, 0, model_.nq), x, outcomes, used,
                                 given.of_rows<T>(in));
      });
}

nb::object Robot::log_det(nb::handle q, nb::handle out, bool status, int threads,
                          nb::handle contacts, const std::string& axes, nb::handle loads) {
  need("log_det", Want::log_det);
  const WithForces given("log_det", {{"q", q, model_.nq}}, contacts, contacts_, axes, loads, loads_,
                         nb::none(), contacts_argument);
  Inputs in("log_det", given.all());
  return rows(
      in, threads, status, in.result(out, {}), 1,
      [&]<class T>(Dynamics<T>& dynamics, T* x) {
        return dynamics.log_det(vector<T>(in, 0, 0, model_.nq), *x, given.of_state<T>(in));
      },
      [&]<class T>(Dynamics<T>& dynamics, RowsView<T> x, std::span<Outcome> outcomes, int used) {
        return dynamics.log_det(rows_of<T>(in, 0, model_.nq), x, outcomes, used,
                                given.of_rows<T>(in));
      });
}

nb::object Robot::operational(nb::handle q, nb::handle out, bool status, int threads,
                              nb::handle contacts, const std::string& axes, nb::handle loads) {
  need("operational", Want::operational);
  const WithForces given("operational", {{"q", q, model_.nq}}, contacts, contacts_, axes, loads,
                         loads_, nb::none(), contacts_argument);
  Inputs in("operational", given.all());
  return rows(
      in, threads, status, in.result(out, {rows_, rows_}), npy_intp(rows_) * rows_,
      [&]<class T>(Dynamics<T>& dynamics, T* X) {
        return dynamics.operational(vector<T>(in, 0, 0, model_.nq), {X, rows_, rows_},
                                    given.of_state<T>(in));
      },
      [&]<class T>(Dynamics<T>& dynamics, RowsView<T> X, std::span<Outcome> outcomes, int used) {
        return dynamics.operational(rows_of<T>(in, 0, model_.nq), X, outcomes, used,
                                    given.of_rows<T>(in));
      });
}

nb::object Robot::operational_inertia(nb::handle q, nb::handle out, const Regularisation& how,
                                      bool status, int threads) {
  constexpr const char* call = "operational_inertia";
  need(call, Want::operational);
  Inputs in(call, {{"q", q, model_.nq}});
  return rows(
      in, threads, status, in.result(out, {rows_, rows_}), npy_intp(rows_) * rows_,
      [&]<class T>(Dynamics<T>& dynamics, T* X) {
        const Outcome of_X =
            dynamics.operational(vector<T>(in, 0, 0, model_.nq), {X, rows_, rows_});
        if (!of_X) return of_X;
        const Outcome outcome = OperationalInertia<T>(rows_, how)
                                    .compute(MatrixView<const T>(X, rows_, rows_),
                                             MatrixView<T>(X, rows_, rows_), of_X.error);
        return of_inertia(outcome, of_X);
      },
      [&]<class T>(Dynamics<T>& dynamics, RowsView<T> X, std::span<Outcome> outcomes, int used) {
        std::vector<Outcome> of_X(outcomes.size());
        static_cast<void>(  // counted below
            dynamics.operational(rows_of<T>(in, 0, model_.nq), X, of_X, used));
        const int failed = OperationalInertia<T>(rows_, how).compute(X, X, outcomes, of_X);
        for (std::size_t i = 0; i < outcomes.size(); ++i)
          outcomes[i] = of_inertia(outcomes[i], of_X[i]);
        return failed;
      },
      &names_with_rows_);
}

nb::object Robot::operational_space(nb::handle q, nb::handle J, int k, int alike,
                                    const Regularisation& how, bool status, int threads) {
  constexpr const char* call = "operational_space";
  need(call, Want::inverse);
  const int n = asked_;
  Inputs in(call, {{"q", q, model_.nq}, {"J", J, k * n}});
  const nb::object inertia = in.result(nb::none(), {k, k}, "inertia"),
                   inverse = in.result(nb::none(), {k, n}, "inverse"),
                   projector = in.result(nb::none(), {n, n}, "projector");
  std::vector<std::string> names = model_.names;
  for (int i = 0; i < k; ++i) names.push_back("row " + std::to_string(i) + " of J");
  const auto of_rows = [&]<class T>(const std::vector<T>& W, std::span<const Outcome> given,
                                    RowsView<T> Lambda, std::span<Outcome> outcomes) {
    const int failed =
        OperationalInertia<T>(k, how, alike)
            .compute(W, rows_of<T>(in, 1, k * n),
                     {.inertia = Lambda,
                      .inverse = RowsView<T>(data_of<T>(inverse), in.count(), k * n),
                      .projector = RowsView<T>(data_of<T>(projector), in.count(), n * n)},
                     outcomes, given);
    for (std::size_t i = 0; i < outcomes.size(); ++i)
      outcomes[i] = of_inertia(outcomes[i], given[i]);
    return failed;
  };
  const nb::object outcome = rows(
      in, threads, status, inertia, npy_intp(k) * k,
      [&]<class T>(Dynamics<T>& dynamics, T* Lambda) {
        std::vector<T> W(std::size_t(n) * n);
        const Outcome given =
            dynamics.inverse_mass(vector<T>(in, 0, 0, model_.nq), MatrixView<T>(W.data(), n, n));
        Outcome out;
        static_cast<void>(  // `out` says it
            of_rows(W, std::span(&given, 1), RowsView<T>(Lambda, 1, k * k), std::span(&out, 1)));
        return out;
      },
      [&]<class T>(Dynamics<T>& dynamics, RowsView<T> Lambda, std::span<Outcome> outcomes,
                   int used) {
        std::vector<T> W(outcomes.size() * n * n);
        std::vector<Outcome> given(outcomes.size());
        static_cast<void>(  // counted below
            dynamics.inverse_mass(rows_of<T>(in, 0, model_.nq), W, given, used));
        return of_rows(W, given, Lambda, outcomes);
      },
      &names);
  return nb::make_tuple(inertia, transposed(inverse), transposed(projector),
                        status ? outcome[1] : nb::none());
}

Outcome Robot::of_inertia(Outcome outcome, const Outcome& given) const {
  if (!given) return given;
  if (outcome.joint >= 0) outcome.joint += model_.nv();
  outcome.near_singular = given.near_singular;
  return outcome;
}

nb::object Robot::operational_diagonal(nb::handle q, nb::handle out, bool status, int threads,
                                       nb::handle contacts, const std::string& axes,
                                       nb::handle loads) {
  need("operational_diagonal", Want::operational_diagonal);
  const WithForces given("operational_diagonal", {{"q", q, model_.nq}}, contacts, contacts_, axes,
                         loads, loads_, nb::none(), contacts_argument);
  Inputs in("operational_diagonal", given.all());
  return rows(
      in, threads, status, in.result(out, {rows_}), rows_,
      [&]<class T>(Dynamics<T>& dynamics, T* x) {
        return dynamics.operational_diagonal(vector<T>(in, 0, 0, model_.nq),
                                             VectorView<T>(x, rows_), given.of_state<T>(in));
      },
      [&]<class T>(Dynamics<T>& dynamics, RowsView<T> x, std::span<Outcome> outcomes, int used) {
        return dynamics.operational_diagonal(rows_of<T>(in, 0, model_.nq), x, outcomes, used,
                                             given.of_rows<T>(in));
      });
}

nb::object Robot::solve(nb::handle q, nb::handle tau, nb::handle out, bool status, int threads,
                        nb::handle contacts, const std::string& axes, nb::handle loads) {
  need("solve", Want::solve);
  const WithForces given("solve", {{"q", q, model_.nq}, {"tau", tau, asked_}}, contacts, contacts_,
                         axes, loads, loads_, nb::none(), contacts_argument);
  Inputs in("solve", given.all());
  return rows(
      in, threads, status, in.result(out, {asked_}), asked_,
      [&]<class T>(Dynamics<T>& dynamics, T* x) {
        const Outcome outcome =
            dynamics.factor(vector<T>(in, 0, 0, model_.nq), given.of_state<T>(in));
        if (!outcome) return outcome;
        return dynamics.solve(MatrixView<const T>(in.data<T>(1), asked_, 1),
                              MatrixView<T>(x, asked_, 1));
      },
      [&]<class T>(Dynamics<T>& dynamics, RowsView<T> x, std::span<Outcome> outcomes, int used) {
        return dynamics.solve(rows_of<T>(in, 0, model_.nq), rows_of<T>(in, 1, asked_), x, outcomes,
                              used, given.of_rows<T>(in));
      });
}

nb::object Robot::derivatives(nb::handle q, nb::handle qd, nb::handle tau, nb::handle out,
                              bool status, int threads, nb::handle forces, const std::string& axes,
                              nb::handle loads, nb::handle gravity) {
  constexpr const char* call = "forward_dynamics_derivatives";
  need(call, Want::derivatives);
  const int nq = model_.nq, nv = model_.nv();
  const WithForces given(call, {{"q", q, nq}, {"qd", qd, nv}, {"tau", tau, nv}}, forces, forces_,
                         axes, loads, loads_, gravity);
  Inputs in(call, given.all());
  DerivativeArrays arrays(in, out, asked_);
  const auto& fields = arrays.fields;

  const npy_intp size = npy_intp(asked_) * asked_;
  const auto lose = [&]<class T>(T, int i) {
    for (int field = 0; field < 3; ++field)
      std::fill_n(data_of<T>(fields[field]) + i * size, size, std::numeric_limits<T>::quiet_NaN());
  };
  const nb::object outcome = rows(
      in, threads, status, fields[3], asked_,
      [&]<class T>(Dynamics<T>& dynamics, T* a) {
        const auto matrix = [&](int field) {
          return MatrixView<T>(data_of<T>(fields[field]), asked_, asked_);
        };
        const Outcome one = dynamics.derivatives(
            vector<T>(in, 0, 0, nq), vector<T>(in, 1, 0, nv), vector<T>(in, 2, 0, nv),
            {.dq = matrix(0), .dqd = matrix(1), .dtau = matrix(2)}, {a, asked_},
            given.of_state<T>(in));
        if (!one) lose(T(), 0);
        return one;
      },
      [&]<class T>(Dynamics<T>& dynamics, RowsView<T> a, std::span<Outcome> outcomes, int used) {
        const auto matrices = [&](int field) {
          return RowsView<T>(data_of<T>(fields[field]), in.count(), size);
        };
        const int failed = dynamics.derivatives(
            rows_of<T>(in, 0, nq), rows_of<T>(in, 1, nv), rows_of<T>(in, 2, nv),
            {.dq = matrices(0), .dqd = matrices(1), .dtau = matrices(2)}, a, outcomes, used,
            given.of_rows<T>(in));
        for (int i = 0; failed > 0 && i < in.count(); ++i)
          if (!outcomes[i]) lose(T(), i);
        return failed;
      });
  const nb::object result = arrays.tuple();
  return status ? nb::make_tuple(result, outcome[1]) : result;
}

std::unique_ptr<Factors> Robot::factor(nb::handle q, nb::handle contacts, const std::string& axes,
                                       nb::handle loads) {
  need("factor", Want::solve);
  const WithForces given("factor", {{"q", q, model_.nq}}, contacts, contacts_, axes, loads, loads_,
                         nb::none(), contacts_argument);
  Inputs in("factor", given.all());
  if (!in.is_single()) throw nb::value_error("factor: of one state; solve(q, tau) takes many");
  return in.with_scalar([&]<class T>(T) {
    auto worker = workers_.of<T>().take();
    Outcome outcome;
    {
      const WithoutLock released(model_.nv() >= large);
      outcome = worker->dynamics.factor(vector<T>(in, 0, 0, model_.nq), given.of_state<T>(in));
    }
    check(in, outcome, model_.names);
    return std::make_unique<Factors>(std::move(worker), asked_, model_.names);
  });
}

nb::object Factors::solve(nb::handle tau, nb::handle out) {
  Inputs in("solve", {{"tau", tau, asked_}});
  const nb::object result = in.result(out, {asked_});
  in.with_scalar([&]<class T>(T) {
    auto* const worker = std::get_if<typename Workers<T>::Loan>(&worker_);
    if (!worker)
      throw nb::type_error(std::is_same_v<T, float>
                               ? "solve: tau is float32, the factors are float64"
                               : "solve: tau is float64, the factors are float32");
    T* const x = data_of<T>(result);
    Outcome outcome;
    {
      std::unique_lock lock(mutex_, std::try_to_lock);
      const WithoutLock released(!lock || in.count() > 1 || asked_ >= large);
      if (!lock) lock.lock();
      outcome = (*worker)->dynamics.solve(MatrixView<const T>(in.data<T>(0), asked_, in.count()),
                                          MatrixView<T>(x, asked_, in.count()));
      for (int i = 0; !outcome && i < in.count(); ++i) {
        T* const row = x + std::ptrdiff_t(i) * asked_;
        if (!is_finite(row, asked_)) std::fill_n(row, asked_, std::numeric_limits<T>::quiet_NaN());
      }
    }
    if (outcome || in.is_single()) check(in, outcome, names_);
  });
  return result;
}

Recommendation Robot::recommend(double tolerance, nb::handle q, nb::handle qd,
                                nb::handle tau) const {
  const int nq = model_.nq, nv = model_.nv();
  Inputs in("recommend", {{"q", q, nq}, {"qd", qd, nv}, {"tau", tau, nv}});
  if (in.type() != NPY_DOUBLE) throw nb::type_error("recommend: states are needed in float64");
  RecommendOptions options{.tolerance = tolerance};
  const std::set<Want> want = options.question.want;
  options.question = options_.question;
  if (options.question.want.empty()) options.question.want = want;
  const RowsView<const double> q_rows(in.data<double>(0), in.count(), nq),
      qd_rows(in.data<double>(1), in.count(), nv), tau_rows(in.data<double>(2), in.count(), nv);
  const WithoutLock released;
  return kalmarm::recommend(model_, q_rows, qd_rows, tau_rows, options);
}

double Robot::time_forward_dynamics(nb::handle q, nb::handle qd, nb::handle tau, nb::handle out,
                                    int calls, bool singly, int threads) {
  const int nq = model_.nq, nv = model_.nv();
  Inputs in("_time_forward_dynamics", {{"q", q, nq}, {"qd", qd, nv}, {"tau", tau, nv}});
  const nb::object result = in.result(out, {asked_});
  const int count = in.count();
  return in.with_scalar([&]<class T>(T) {
    const auto worker = workers_.of<T>().take();
    worker->outcomes.resize(count);
    const WithoutLock released;
    const auto start = std::chrono::steady_clock::now();
    for (int call = 0; call < calls; ++call)
      if (singly)
        for (int i = 0; i < count; ++i)
          worker->outcomes[i] = worker->dynamics.forward_dynamics(
              vector<T>(in, 0, i, nq), vector<T>(in, 1, i, nv), vector<T>(in, 2, i, nv),
              {data_of<T>(result) + std::ptrdiff_t(i) * asked_, asked_});
      else
        static_cast<void>(worker->dynamics.forward_dynamics(  // how long, not how well
            RowsView<const T>(in.data<T>(0), count, nq),
            RowsView<const T>(in.data<T>(1), count, nv),
            RowsView<const T>(in.data<T>(2), count, nv),
            RowsView<T>(data_of<T>(result), count, asked_), worker->outcomes, threads));
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  });
}

DerivativeArrays::DerivativeArrays(Inputs& in, nb::handle out, npy_intp n) {
  const bool given = !out.is_none();
  if (given && (!PyTuple_Check(out.ptr()) || nb::len(out) != derivatives_fields))
    throw nb::type_error(
        (std::string(in.call()) + ": out is not what an earlier call returned").c_str());
  const auto matrices = [&](int i, const char* name) {
    fields[i] = in.result(given ? untransposed(out[i]) : nb::none(), {n, n}, name);
  };
  matrices(0, "out.dq");
  matrices(1, "out.dqd");
  matrices(2, "out.dtau");
  fields[3] = in.result(given ? nb::object(out[3]) : nb::none(), {n}, "out.a");
}

nb::object DerivativeArrays::tuple() const {
  static const nb::handle type =  // lives as long as the interpreter
      nb::object(nb::module_::import_("kalmarm.results").attr("Derivatives")).release();
  return type(transposed(fields[0]), transposed(fields[1]), transposed(fields[2]), fields[3]);
}

}  // namespace kalmarm::python
