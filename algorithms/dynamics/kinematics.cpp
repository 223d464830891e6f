#include "kalmarm/kinematics.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "algorithms/dynamics/check_model.hpp"
#include "algorithms/dynamics/threads.hpp"
#include "algorithms/fast/frames/kinematics_engine.hpp"

namespace kalmarm {
namespace {

// Rows that a worker takes at once.
constexpr int rows_of_a_worker = 64;

[[noreturn]] void refuse(const std::string& what) {
  throw std::invalid_argument("kinematics: " + what);
}

template <class View>
struct Named {
  const char* name;
  View KinematicResults<View>::*view;
};
template <class View>
constexpr Named<View> named[] = {
    {"positions", &KinematicResults<View>::positions},
    {"rotations", &KinematicResults<View>::rotations},
    {"quaternions", &KinematicResults<View>::quaternions},
    {"jacobians", &KinematicResults<View>::jacobians},
    {"velocities", &KinematicResults<View>::velocities},
    {"accelerations", &KinematicResults<View>::accelerations},
    {"center", &KinematicResults<View>::center},
    {"center_velocity", &KinematicResults<View>::center_velocity},
    {"center_acceleration", &KinematicResults<View>::center_acceleration},
    {"center_jacobian", &KinematicResults<View>::center_jacobian},
    {"momentum", &KinematicResults<View>::momentum},
    {"momentum_rate", &KinematicResults<View>::momentum_rate},
    {"momentum_matrix", &KinematicResults<View>::momentum_matrix},
    {"kinetic_energy", &KinematicResults<View>::kinetic_energy},
    {"potential_energy", &KinematicResults<View>::potential_energy},
    {"coriolis", &KinematicResults<View>::coriolis},
    {"regressor", &KinematicResults<View>::regressor}};

[[noreturn]] void refuse_size(const char* name, const std::string& given,
                              const std::string& needed) {
  refuse(std::string(name) + " has size " + given + ", " + needed + " is needed");
}

// Of one state, and of `count` rows.
template <class T>
T* checked(const char* name, const MatrixView<T>& X, KinematicShape shape, std::ptrdiff_t) {
  if (!X) return nullptr;
  const bool vector = shape.columns == 1 || shape.rows == 1;
  if (!X.fits(shape.rows, shape.columns) || (X.is_row_major() && !vector))
    refuse_size(name, X.shape(), detail::shape(shape.rows, shape.columns) + ", column-major,");
  return X.data();
}
template <class T>
T* checked(const char* name, const std::optional<RowsView<T>>& X, KinematicShape shape,
           std::ptrdiff_t count) {
  if (!X) return nullptr;
  if (!X->fits(count, shape.size()))
    refuse_size(name, X->shape(), detail::shape(count, shape.size()));
  return X->data();
}

template <class T, class View>
KinematicsCall<T> call_of(const KinematicResults<View>& out,
                          const std::array<KinematicShape, kinematics>& shapes,
                          std::ptrdiff_t count) {
  KinematicsCall<T> call{.axes = out.axes};
  for (int i = 0; i < kinematics; ++i)
    call.out[i] = checked(named<View>[i].name, out.*named<View>[i].view, shapes[i], count);
  return call;
}

template <class T>
void need_motion(const KinematicsCall<T>& call) {
  if (call.qd || !call.wants_motion()) return;
  for (int i = 0; i < kinematics; ++i) {
    KinematicsCall<T> one;
    one.out[i] = call.out[i];
    if (one.wants_motion()) refuse(std::string(named<MatrixView<T>>[i].name) + " needs qd");
  }
}

}  // namespace

template <class T>
Kinematics<T>::Kinematics(const RobotModel& model, const std::vector<Frame>& frames,
                          std::vector<int> bodies)
    : nq_(model.nq), nv_(model.nv()), frames_(static_cast<int>(frames.size())) {
  check_model(model, std::is_same_v<T, float> ? std::numeric_limits<float>::max()
                                              : std::numeric_limits<double>::max());
  for (const Frame& frame : frames) check_frame("kinematics", frame, nv_);
  for (const LinkParameters& link : model.links) mass_ += link.mass;
  for (const int body : bodies)
    if (body < 0 || body >= nv_)
      refuse("a body on link " + std::to_string(body) + " of a robot with " + std::to_string(nv_));
  if (bodies.empty()) {
    bodies.resize(nv_);
    std::iota(bodies.begin(), bodies.end(), 0);
  }
  bodies_ = static_cast<int>(bodies.size());
  engine_ = make_kinematics<T>(model, frames, bodies);
  threads_ = std::make_unique<Threads>();
}

template <class T>
Kinematics<T>::~Kinematics() = default;
template <class T>
Kinematics<T>::Kinematics(Kinematics&&) noexcept = default;
template <class T>
Kinematics<T>& Kinematics<T>::operator=(Kinematics&&) noexcept = default;

template <class T>
KinematicsEngine<T>& Kinematics<T>::engine() const {
  if (!engine_) throw std::logic_error("Kinematics: was moved from, and answers nothing");
  return *engine_;
}

template <class T>
void Kinematics<T>::of_state(const VectorView<const T>& q, const VectorView<const T>* qd,
                             const VectorView<const T>* qdd, const StateKinematics<T>& out) {
  const auto check = [](const char* name, const VectorView<const T>& x, int size) {
    if (x.size() != size) refuse_size(name, std::to_string(x.size()), std::to_string(size));
    return x.data();
  };
  KinematicsCall<T> call = call_of<T>(out, kinematic_shapes(nv_, frames_, bodies_), 1);
  call.q = check("q", q, nq_);
  if (qd) call.qd = check("qd", *qd, nv_);
  if (qdd) call.qdd = check("qdd", *qdd, nv_);
  need_motion(call);
  engine().answer(call);
}

template <class T>
void Kinematics<T>::of_rows(const RowsView<const T>& q, const RowsView<const T>* qd,
                            const RowsView<const T>* qdd, const RowsOfKinematics<T>& out,
                            int threads) {
  const std::ptrdiff_t count = nq_ > 0 ? q.size() / nq_ : 0;
  const auto check = [&](const char* name, const RowsView<const T>& x, int width) {
    if (!x.fits(count, width)) refuse_size(name, x.shape(), detail::shape(count, width));
    return x.data();
  };
  const auto shapes = kinematic_shapes(nv_, frames_, bodies_);
  KinematicsCall<T> call = call_of<T>(out, shapes, count);
  call.q = check("q", q, nq_);
  if (qd) call.qd = check("qd", *qd, nv_);
  if (qdd) call.qdd = check("qdd", *qdd, nv_);
  need_motion(call);
  KinematicsEngine<T>& all = engine();
  if (count == 1) return all.answer(call);  // in less time than lanes
  threads = std::max(threads, 1);
  all.reserve_workers(threads);
  const auto block = [&](int worker, int i) {
    const std::ptrdiff_t first = std::ptrdiff_t(i) * rows_of_a_worker;
    KinematicsCall<T> some = call;
    some.q += first * nq_;
    if (some.qd) some.qd += first * nv_;
    if (some.qdd) some.qdd += first * nv_;
    for (int j = 0; j < kinematics; ++j)
      if (some.out[j]) some.out[j] += first * shapes[j].size();
    all.answer_rows(
        worker, static_cast<int>(std::min<std::ptrdiff_t>(rows_of_a_worker, count - first)), some);
  };
  const auto blocks = static_cast<int>((count + rows_of_a_worker - 1) / rows_of_a_worker);
  if (threads == 1)
    for (int i = 0; i < blocks; ++i) block(0, i);
  else
    threads_->run(threads, blocks, block);
}

template class Kinematics<float>;
template class Kinematics<double>;

}  // namespace kalmarm
