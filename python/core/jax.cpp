#include "jax.hpp"

#include "kinematics.hpp"
#include "robot.hpp"
#include "step.hpp"

#if __has_include(<xla/ffi/api/ffi.h>)
#define KALMARM_HAS_XLA
#include <xla/ffi/api/ffi.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <exception>
#include <limits>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>
#endif

namespace kalmarm::python {

#ifdef KALMARM_HAS_XLA

namespace ffi = xla::ffi;

// Of each argument and each result how many numbers a row has, q: nq, v: nv, n: DoF that are asked about, m: n x n, l: of
// loads, g: of gravity, of all frames p: positions, o: rotations and j: Jacobians, and of outcomes e: the error, s: the status. What is given beside follows `given`, and the results
// of a derivative what it is by of that.
struct Task {
  const char* name;
  std::string_view given, linear, results;
};
constexpr std::array tasks = {
    Task{"forward_dynamics", "qvv", "", "nes"},
    Task{"inverse_dynamics", "qvv", "", "nes"},
    Task{"mass_matrix", "q", "", "mes"},
    Task{"solve", "qn", "", "nes"},
    Task{"forward_dynamics_vjp", "qvv", "n", "vvv"},
    Task{"inverse_dynamics_vjp", "qvv", "n", "vvv"},
    Task{"solve_vjp", "qn", "n", "vn"},
    Task{"forward_dynamics_jvp", "qvv", "vvv", "n"},
    Task{"inverse_dynamics_jvp", "qvv", "vvv", "n"},
    Task{"solve_jvp", "qn", "vn", "n"},
    Task{"step_acceleration", "qvvvvvv", "", "ves"},
    Task{"step_acceleration_vjp", "qvvvvvv", "v", "vvvvvvv"},
    Task{"step_acceleration_jvp", "qvvvvvv", "vvvvvvv", "v"},
    Task{"poses", "q", "", "po"},
    Task{"poses_and_jacobians", "q", "", "poj"},
};
constexpr std::size_t most = 16;  // arguments or results, with loads and gravity

// Whom a call asks: one of these.
struct Asked {
  Robot* robot = nullptr;
  Step* step = nullptr;
  KinematicsOfRobot* kinematics = nullptr;

  const RobotModel& model() const {
    return robot ? robot->model() : step ? step->model() : kinematics->model();
  }
  int frames() const { return kinematics ? kinematics->frames() : 0; }
};

// A call of rows: looks at the shapes of its buffers, and answers it.
class RobotRows {
 public:
  // beside, by: letters of what is given beside, and of what of that is derived by.
  RobotRows(Asked asked, const Task& task, int threads, std::string_view beside,
            std::string_view by)
      : asked_(asked), task_(task), threads_(threads), beside_(beside), by_(by) {}

  ffi::Error run(ffi::RemainingArgs arguments, ffi::RemainingRets results) {
    const std::string given = std::string(task_.given).append(beside_).append(task_.linear),
                      returned = std::string(task_.results).append(by_);
    if (arguments.size() != given.size() || results.size() != returned.size())
      return refused("the number of arguments or results");
    for (std::size_t i = 0; i < arguments.size(); ++i) {
      const auto buffer = arguments.get<ffi::AnyBuffer>(i);
      if (buffer.has_error() || !add(*buffer, given[i], in_[i]))
        return refused("argument " + std::to_string(i));
    }
    for (std::size_t i = 0; i < results.size(); ++i) {
      auto buffer = results.get<ffi::AnyBuffer>(i);
      if (buffer.has_error() || !add(**buffer, returned[i], out_[i]))
        return refused("result " + std::to_string(i));
    }
    if (count_ == 0) return ffi::Error::Success();
    if (type_ == ffi::DataType::F32)
      answer<float>(returned);
    else
      answer<double>(returned);
    return ffi::Error::Success();
  }

 private:
  ffi::Error refused(const std::string& what) const {
    return ffi::Error::InvalidArgument(std::string("kalmarm.jax.") + task_.name + ": " + what +
                                       " does not fit the robot");
  }

  std::int64_t width(char of) const {
    const RobotModel& model = asked_.model();
    const std::int64_t n = asked_.robot ? asked_.robot->asked() : model.nv();
    switch (of) {
      case 'q':
        return model.nq;
      case 'v':
        return model.nv();
      case 'm':
        return n * n;
      case 'p':
        return 3 * asked_.frames();
      case 'o':
        return 9 * asked_.frames();
      case 'j':
        return 6 * asked_.frames() * model.nv();
      case 'g':
        return numbers_of_gravity;
      case 'l':
        return asked_.robot ? asked_.robot->loads_ : asked_.step->loads_;
      case 'n':
        return n;
      default:
        return 1;
    }
  }

  // Where a buffer lies; false where it has not the rows and the type of those before it.
  bool add(const ffi::AnyBuffer& buffer, char of, void*& at) {
    const ffi::DataType type = buffer.element_type();
    const auto size = static_cast<std::int64_t>(buffer.element_count());
    if (count_ < 0) {
      type_ = type;
      count_ = size / width(of);
    }
    at = buffer.untyped_data();
    return (type_ == ffi::DataType::F32 || type_ == ffi::DataType::F64) &&
           type == (of == 's' ? ffi::DataType::S32 : type_) && size == count_ * width(of) &&
           count_ <= std::numeric_limits<int>::max();
  }

  template <class T>
  RowsView<const T> given(std::size_t i) const {
    return {static_cast<const T*>(in_[i]), count_, width(task_.given[i])};
  }
  template <class T>
  RowsView<const T> linear(std::size_t i) const {
    return {static_cast<const T*>(in_[task_.given.size() + beside_.size() + i]), count_,
            width(task_.linear[i])};
  }
  template <class T>
  RowsView<T> out(std::size_t i) const {
    return {static_cast<T*>(out_[i]), count_, width(task_.results[i])};
  }
  // What is given beside, or derived by: of a letter, after the first so many of all.
  template <class T>
  std::optional<RowsView<T>> of_letter(char letter, std::string_view letters,
                                       const std::array<void*, most>& all,
                                       std::size_t first) const {
    const std::size_t at = letters.find(letter);
    if (at == letters.npos) return {};
    return RowsView<T>(static_cast<T*>(all[first + at]), count_, width(letter));
  }
  template <class T>
  ForceRows<T> beside() const {
    const auto given = [&](char letter) {
      return of_letter<const T>(letter, beside_, in_, task_.given.size());
    };
    return {.axes = Axes::local, .loads = given('l'), .gravity = given('g')};
  }
  // Of a derivative, of robots or of steps.
  template <class T, class Rows>
  void add_beside(Rows& rows) const {
    rows.loads = of_letter<T>('l', by_, out_, task_.results.size());
    rows.gravity = of_letter<T>('g', by_, out_, task_.results.size());
  }
  template <class T>
  GainRows<T> gains() const {
    return {given<T>(3), given<T>(4), given<T>(5), given<T>(6)};
  }
  template <class T>
  RowsOfVectorJacobian<T> derivatives() const {
    RowsOfVectorJacobian<T> rows;
    rows.dq.emplace(out<T>(0));
    if (task_.given.size() == 3) rows.dqd.emplace(out<T>(1));
    rows.dtau.emplace(out<T>(task_.given.size() - 1));
    add_beside<T>(rows);
    return rows;
  }

  template <class T>
  void answer(const std::string& returned) const {
    const auto with = [&](auto worker) {
      worker->outcomes.assign(count_, Outcome());
      call<T>(worker->dynamics, worker->outcomes);
      for (std::int64_t row = 0; row < count_; ++row) tell<T>(returned, row, worker->outcomes[row]);
    };
    const auto ask = [&](auto& asked) {
      if (task_.linear.empty())
        with(asked.workers_.template of<T>().take());
      else
        with(asked.gradients_.template of<T>().take());
    };
    if (asked_.robot)
      ask(*asked_.robot);
    else if (asked_.step)
      ask(*asked_.step);
    else
      with(asked_.kinematics->workers_.of<T>().take());
  }

  template <class T>
  void tell(const std::string& returned, std::int64_t row, const Outcome& outcome) const {
    for (std::size_t i = 0; i < returned.size(); ++i) {
      const char of = returned[i];
      if (of == 'e')
        static_cast<T*>(out_[i])[row] = static_cast<T>(outcome.error);
      else if (of == 's')
        static_cast<std::int32_t*>(out_[i])[row] = static_cast<std::int32_t>(outcome.status);
      else if (!outcome)
        std::fill_n(static_cast<T*>(out_[i]) + row * width(of), width(of),
                    std::numeric_limits<T>::quiet_NaN());
    }
  }

  int used() const { return cores(task_.name, threads_, static_cast<int>(count_)); }
  bool is(const char* name) const { return task_.name == std::string_view(name); }

  // How many rows failed is counted by their outcomes.
  template <class T>
  void call(Dynamics<T>& dynamics, std::span<Outcome> outcomes) const {
    if (is("forward_dynamics")) {
      static_cast<void>(dynamics.forward_dynamics(given<T>(0), given<T>(1), given<T>(2), out<T>(0),
                                                  outcomes, used(), beside<T>()));
    } else if (is("inverse_dynamics")) {
      dynamics.inverse_dynamics(given<T>(0), given<T>(1), given<T>(2), out<T>(0), used(),
                                beside<T>());
      look_at<T>(outcomes);
    } else if (is("mass_matrix")) {
      static_cast<void>(dynamics.mass(given<T>(0), out<T>(0), outcomes, used(), beside<T>().loads));
    } else {
      static_cast<void>(
          dynamics.solve(given<T>(0), given<T>(1), out<T>(0), outcomes, used(), beside<T>()));
    }
  }
  template <class T>
  void call(Gradients<T>& gradients, std::span<Outcome> outcomes) const {
    if (is("forward_dynamics_vjp")) {
      static_cast<void>(gradients.forward_dynamics_vjp(given<T>(0), given<T>(1), given<T>(2),
                                                       linear<T>(0), derivatives<T>(), outcomes,
                                                       used(), beside<T>()));
    } else if (is("forward_dynamics_jvp")) {
      static_cast<void>(gradients.forward_dynamics_jvp(given<T>(0), given<T>(1), given<T>(2),
                                                       linear<T>(0), linear<T>(1), linear<T>(2),
                                                       out<T>(0), outcomes, used(), beside<T>()));
    } else if (is("inverse_dynamics_vjp")) {
      gradients.inverse_dynamics_vjp(given<T>(0), given<T>(1), given<T>(2), linear<T>(0),
                                     derivatives<T>(), used(), beside<T>());
      look_at<T>(outcomes);
    } else if (is("inverse_dynamics_jvp")) {
      gradients.inverse_dynamics_jvp(given<T>(0), given<T>(1), given<T>(2), linear<T>(0),
                                     linear<T>(1), linear<T>(2), out<T>(0), used(), beside<T>());
      look_at<T>(outcomes);
    } else if (is("solve_vjp")) {
      static_cast<void>(gradients.solve_vjp(given<T>(0), given<T>(1), linear<T>(0),
                                            derivatives<T>(), outcomes, used(), beside<T>().loads));
    } else {
      static_cast<void>(gradients.solve_jvp(given<T>(0), given<T>(1), linear<T>(0), linear<T>(1),
                                            out<T>(0), outcomes, used(), beside<T>().loads));
    }
  }

  template <class T>
  void call(ImplicitStep<T>& step, std::span<Outcome> outcomes) const {
    static_cast<void>(step.acceleration(given<T>(0), given<T>(1), given<T>(2), gains<T>(),
                                        out<T>(0), outcomes, used(), beside<T>()));
  }
  template <class T>
  void call(StepGradients<T>& step, std::span<Outcome> outcomes) const {
    if (is("step_acceleration_jvp")) {
      static_cast<void>(step.acceleration_jvp(
          given<T>(0), given<T>(1), given<T>(2), linear<T>(0), linear<T>(1), linear<T>(2),
          out<T>(0), outcomes, used(), gains<T>(),
          {linear<T>(3), linear<T>(4), linear<T>(5), linear<T>(6)}, beside<T>()));
      return;
    }
    RowsOfStepVectorJacobian<T> rows{.dq = out<T>(0),
                                     .dv = out<T>(1),
                                     .dtau = out<T>(2),
                                     .damping = out<T>(3),
                                     .stiffness = out<T>(4),
                                     .reference = out<T>(5),
                                     .armature = out<T>(6)};
    add_beside<T>(rows);
    static_cast<void>(step.acceleration_vjp(given<T>(0), given<T>(1), given<T>(2), linear<T>(0),
                                            rows, outcomes, used(), gains<T>(), beside<T>()));
  }

  template <class T>
  void call(Kinematics<T>& kinematics, std::span<Outcome>) const {
    RowsOfKinematics<T> rows{.axes = Axes::aligned};
    rows.positions = out<T>(0);
    rows.rotations = out<T>(1);
    if (task_.results.size() > 2) rows.jacobians = out<T>(2);
    kinematics.compute_rows(given<T>(0), rows, used());
  }

  // Of results that come without outcomes.
  template <class T>
  void look_at(std::span<Outcome> outcomes) const {
    for (std::size_t i = 0; i < task_.results.size(); ++i) {
      if (task_.results[i] == 'e' || task_.results[i] == 's') continue;
      const RowsView<T> x = out<T>(i);
      const std::int64_t size = width(task_.results[i]);
      for (std::size_t row = 0; row < outcomes.size(); ++row)
        if (!std::all_of(x.data() + row * size, x.data() + (row + 1) * size,
                         [](T number) { return std::isfinite(number); }))
          outcomes[row].status = Outcome::Status::not_finite;
    }
  }

  Asked asked_;
  const Task& task_;
  int threads_;
  std::string_view beside_, by_;
  ffi::DataType type_ = ffi::DataType::INVALID;
  std::int64_t count_ = -1;
  std::array<void*, most> in_ = {}, out_ = {};
};

namespace {

// Robots, steps and kinematics by number, from 1 on; kalmarm.jax keeps them.
class Table {
 public:
  std::int64_t number(Asked asked) {
    const std::lock_guard lock(mutex_);
    all_.push_back(asked);
    return std::ssize(all_);
  }
  Asked find(std::int64_t number) {
    const std::lock_guard lock(mutex_);
    return number > 0 && number <= std::ssize(all_) ? all_[number - 1] : Asked();
  }

 private:
  std::mutex mutex_;
  std::vector<Asked> all_;
} table;

template <std::size_t i>
ffi::Error run(ffi::RemainingArgs arguments, ffi::RemainingRets results, std::int64_t robot,
               std::int64_t threads, std::string_view beside, std::string_view by) {
  const Asked found = table.find(robot);
  const std::string_view name = tasks[i].name;
  if (name.starts_with("poses")   ? !found.kinematics
      : name.starts_with("step_") ? !found.step
                                  : !found.robot)
    return ffi::Error::InvalidArgument(
        "kalmarm.jax: a program of another process, whose robot is not known here");
  try {
    return RobotRows(found, tasks[i], static_cast<int>(threads), beside, by)
        .run(arguments, results);
  } catch (const std::exception& exception) {
    return ffi::Error::Internal(exception.what());
  }
}

template <std::size_t i>
XLA_FFI_Error* handle(XLA_FFI_CallFrame* frame) {
  static auto* const handler = ffi::Ffi::Bind()
                                   .RemainingArgs()
                                   .RemainingRets()
                                   .template Attr<std::int64_t>("robot")
                                   .template Attr<std::int64_t>("threads")
                                   .template Attr<std::string_view>("beside")
                                   .template Attr<std::string_view>("by")
                                   .To(&run<i>)
                                   .release();
  return handler->Call(frame);
}

template <std::size_t... i>
void add_targets(nb::dict& targets, std::index_sequence<i...>) {
  ((targets[tasks[i].name] = nb::capsule(reinterpret_cast<void*>(&handle<i>))), ...);
}

}  // namespace

void bind_jax(nb::module_& m) {
  m.def(
      "_jax_targets",
      [] {
        nb::dict targets;
        add_targets(targets, std::make_index_sequence<tasks.size()>());
        return targets;
      },
      "Handlers of XLA by the names of calls.");
  m.def(
      "_jax_number", [](Robot& robot) { return table.number({.robot = &robot}); }, nb::arg("robot"),
      "By which handlers find a robot, a step or kinematics, which from now on have to stay.");
  m.def(
      "_jax_number", [](Step& step) { return table.number({.step = &step}); }, nb::arg("step"));
  m.def(
      "_jax_number",
      [](KinematicsOfRobot& kinematics) { return table.number({.kinematics = &kinematics}); },
      nb::arg("kinematics"));
}

#else

void bind_jax(nb::module_&) {}

#endif

}  // namespace kalmarm::python
