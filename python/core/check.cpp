#include "check.hpp"

#include <utility>
#include <vector>

#include "lock.hpp"
#include "outcomes.hpp"
#include "robot.hpp"

namespace kalmarm::python {

CheckOfRobot::CheckOfRobot(RobotModel model, double tolerance, double resolution)
    : model_(std::move(model)), options_{tolerance, resolution} {
  static_cast<void>(workers_.take());  // refuses here what is bad
}

nb::object CheckOfRobot::answer(const std::string& what, nb::handle q, nb::handle qd,
                                nb::handle tau, nb::handle x, int threads) {
  const int nq = model_.nq, nv = model_.nv();
  const bool is_matrix = what == "mass" || what == "inverse";
  std::vector<Argument> given{{"q", q, nq}};
  if (!qd.is_none()) given.push_back({"qd", qd, nv});
  if (!tau.is_none()) given.push_back({"tau", tau, nv});
  given.push_back({"the answer", x, is_matrix ? nv * nv : nv});
  Inputs in("check", given);
  const int count = in.count(), last = static_cast<int>(given.size()) - 1;
  const auto rows = [&](int i) { return rows_of<double>(in, i, given[i].width); };
  const int used = cores(in.call(), threads, count);
  const nb::object numbers = in.result(nb::none(), {4});
  const auto worker = workers_.take();
  AnswerCheck& check = worker->dynamics;
  std::vector<AnswerError> errors(count);
  {
    const WithoutLock released;
    if (what == "acceleration")
      check.forward_dynamics(rows(0), rows(1), rows(2), rows(3), errors, used);
    else if (what == "inverse_dynamics")
      check.inverse_dynamics(rows(0), rows(1), rows(2), rows(3), errors, used);
    else if (what == "solve")
      check.solve(rows(0), rows(1), rows(2), errors, used);
    else if (what == "mass")
      check.mass(rows(0), rows(last), errors, used);
    else
      check.inverse_mass(rows(0), rows(last), errors, used);
  }
  double* to = data_of<double>(numbers);
  worker->outcomes.clear();
  for (const AnswerError& one : errors) {
    *to++ = one.error;
    *to++ = one.euclid;
    *to++ = one.uncertainty;
    *to++ = static_cast<double>(one.verdict);
    worker->outcomes.push_back(one.outcome);
  }
  return answered(in, numbers, true, worker->outcomes.data(), {});
}

}  // namespace kalmarm::python
