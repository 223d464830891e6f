#include "kinematics.hpp"

#include <optional>
#include <utility>

#include "forces.hpp"
#include "lock.hpp"
#include "robot.hpp"

namespace kalmarm::python {
namespace {

template <class T>
using Field = std::optional<RowsView<T>> RowsOfKinematics<T>::*;

// How many numbers of a state a result has, of F frames, nv DoF and a regressor of so many bodies, and where it goes: in the order of
// KinematicResults.
template <class T>
struct Named {
  int numbers;
  Field<T> field;
};
template <class T>
std::vector<Named<T>> results_of(int F, int nv, int bodies) {
  using R = RowsOfKinematics<T>;
  return {{3 * F, &R::positions},
          {9 * F, &R::rotations},
          {4 * F, &R::quaternions},
          {6 * F * nv, &R::jacobians},
          {6 * F, &R::velocities},
          {6 * F, &R::accelerations},
          {3, &R::center},
          {3, &R::center_velocity},
          {3, &R::center_acceleration},
          {3 * nv, &R::center_jacobian},
          {6, &R::momentum},
          {6, &R::momentum_rate},
          {6 * nv, &R::momentum_matrix},
          {1, &R::kinetic_energy},
          {1, &R::potential_energy},
          {nv * nv, &R::coriolis},
          {10 * bodies * nv, &R::regressor}};
}

}  // namespace

KinematicsOfRobot::KinematicsOfRobot(RobotModel model, std::vector<Frame> frames,
                                     std::vector<int> bodies)
    : model_(std::move(model)), frames_(std::move(frames)), bodies_(std::move(bodies)) {
  workers_.of<double>().take();  // refuses what is wrong
}

double KinematicsOfRobot::mass() { return workers_.of<double>().take()->dynamics.mass(); }

nb::list KinematicsOfRobot::compute(const std::vector<int>& results, nb::handle q, nb::handle qd,
                                    nb::handle qdd, const std::string& axes, int threads) {
  const int nv = model_.nv();
  std::vector<Argument> given{{"q", q, model_.nq}};
  if (!qd.is_none()) given.push_back({"qd", qd, nv});
  if (!qdd.is_none()) given.push_back({"qdd", qdd, nv});
  if (qd.is_none() && !qdd.is_none()) throw nb::value_error("kinematics: qdd comes without qd");
  Inputs in("kinematics", given);
  return in.with_scalar([&]<class T>(T) {
    const int count = in.count();
    RowsOfKinematics<T> out{.axes = axes_of("kinematics", axes)};
    nb::list arrays;
    const std::vector<Named<T>> all =
        results_of<T>(frames(), nv, bodies_.empty() ? nv : static_cast<int>(bodies_.size()));
    for (const int i : results) {
      const auto& [numbers, field] = all.at(i);
      const nb::object array = in.result(nb::none(), {numbers});
      out.*field = RowsView<T>(data_of<T>(array), count, numbers);
      arrays.append(array);
    }
    const auto rows = [&](int i, int width) {
      return RowsView<const T>(in.data<T>(i), count, width);
    };
    const int used = cores(in.call(), threads, count);
    const auto worker = workers_.of<T>().take();
    const WithoutLock released(count > 1 || nv >= large);
    Kinematics<T>& robot = worker->dynamics;
    if (given.size() == 1)
      robot.compute_rows(rows(0, model_.nq), out, used);
    else if (given.size() == 2)
      robot.compute_rows(rows(0, model_.nq), rows(1, nv), out, used);
    else
      robot.compute_rows(rows(0, model_.nq), rows(1, nv), rows(2, nv), out, used);
    return arrays;
  });
}

}  // namespace kalmarm::python
