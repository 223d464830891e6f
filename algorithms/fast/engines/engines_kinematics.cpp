#include <Eigen/Geometry>
#include <algorithm>
#include <memory>
#include <vector>

#include "algorithms/fast/engine/instances.hpp"
#include "algorithms/fast/engines/engines.hpp"
#include "algorithms/fast/frames/kinematics_kernel.hpp"
#include "algorithms/spatial/lanes.hpp"

namespace kalmarm {
namespace {

// The quaternion of a rotation, by columns, with w >= 0.
template <class S>
void quaternion_of(const S* rotation, S* wxyz) {
  Eigen::Quaternion<S> q{
      Eigen::Matrix<S, 3, 3>(Eigen::Map<const Eigen::Matrix<S, 3, 3>>(rotation))};
  if (q.w() < S(0)) q.coeffs() = -q.coeffs();
  wxyz[0] = q.w();
  wxyz[1] = q.x();
  wxyz[2] = q.y();
  wxyz[3] = q.z();
}

// One state in double, rows with a state in every lane of packs of S.
template <class S>
class EngineOfKinematics final : public KinematicsEngine<S> {
 public:
  EngineOfKinematics(const RobotModel& robot, const std::vector<Frame>& frames,
                     const std::vector<int>& bodies)
      : given_(model_of(robot)),
        frames_(frames),
        bodies_(bodies),
        shapes_(kinematic_shapes(given_.nv(), static_cast<int>(frames.size()),
                                 static_cast<int>(bodies.size()))),
        in_double_(given_),
        lowered_(given_.template cast<S>()),
        one_(in_double_, given_.gravity(), frames, bodies),
        q_(given_.nq()),
        qd_(given_.nv()),
        qdd_(given_.nv()) {}

  void answer(const KinematicsCall<S>& call) override {
    one_.fill(call, in_double(call.q, q_), in_double(call.qd, qd_), in_double(call.qdd, qdd_));
    for (int i = 0; i < kinematics; ++i) {
      const auto what = static_cast<Kinematic>(i);
      if (!call.out[i] || what == Kinematic::quaternions) continue;
      const std::vector<double>& from = one_.result(what);
      std::copy(from.begin(), from.end(), call.out[i]);
    }
    if (!call[Kinematic::quaternions]) return;
    double wxyz[4];
    for (std::size_t f = 0; f < frames_.size(); ++f) {
      quaternion_of(one_.result(Kinematic::rotations).data() + 9 * f, wxyz);
      std::copy_n(wxyz, 4, call[Kinematic::quaternions] + 4 * f);
    }
  }

  void reserve_workers(int count) override {
    while (static_cast<int>(workers_.size()) < count)
      workers_.push_back(std::make_unique<Worker>(given_, lowered_, frames_, bodies_));
  }

  void answer_rows(int worker, int count, const KinematicsCall<S>& call) override {
    Worker& w = *workers_[worker];
    for (int first = 0; first < count; first += lanes) {
      const int states = std::min(lanes, count - first), left = count - first;
      const auto load = [&](const S* rows, std::vector<P>& packs) -> const P* {
        if (!rows) return nullptr;
        const int width = static_cast<int>(packs.size());
        to_lanes(rows + std::ptrdiff_t(first) * width, width, states, left, packs);
        return packs.data();
      };
      w.kernel.fill(call, load(call.q, w.q), load(call.qd, w.qd), load(call.qdd, w.qdd));
      for (int i = 0; i < kinematics; ++i) {
        if (!call.out[i]) continue;
        const auto what = static_cast<Kinematic>(i);
        S* const out = call.out[i] + std::ptrdiff_t(first) * shapes_[i].size();
        if (what == Kinematic::quaternions)
          store_quaternions(w, states, out);
        else
          from_lanes(w.kernel.result(what), shapes_[i].size(), states, out);
      }
    }
  }

 private:
  using P = StateLanes<S>;
  static constexpr int lanes = Lanes<P>::count;

  struct Worker {
    KinematicsKernel<P> kernel;
    std::vector<P> q, qd, qdd;

    Worker(const Model<double>& given, const LoweredModel<S>& lowered,
           const std::vector<Frame>& frames, const std::vector<int>& bodies)
        : kernel(lowered, given.gravity(), frames, bodies),
          q(given.nq()),
          qd(given.nv()),
          qdd(given.nv()) {}
  };

  static const double* in_double(const S* x, std::vector<double>& memory) {
    if constexpr (std::is_same_v<S, double>) return x;
    if (!x) return nullptr;
    std::copy_n(x, memory.size(), memory.begin());
    return memory.data();
  }

  void store_quaternions(const Worker& w, int states, S* out) const {
    const std::vector<P>& rotations = w.kernel.result(Kinematic::rotations);
    S rotation[9];
    for (int i = 0; i < states; ++i)
      for (std::size_t f = 0; f < frames_.size(); ++f) {
        for (int j = 0; j < 9; ++j) rotation[j] = rotations[9 * f + j][i];
        quaternion_of(rotation, out + (i * frames_.size() + f) * 4);
      }
  }

  Model<double> given_;
  std::vector<Frame> frames_;
  std::vector<int> bodies_;
  std::array<KinematicShape, kinematics> shapes_;
  LoweredModel<double> in_double_;
  LoweredModel<S> lowered_;
  KinematicsKernel<double> one_;
  std::vector<double> q_, qd_, qdd_;
  std::vector<std::unique_ptr<Worker>> workers_;
};

}  // namespace

template <class S>
std::unique_ptr<KinematicsEngine<S>> make_engine_of_kinematics(const RobotModel& robot,
                                                               const std::vector<Frame>& frames,
                                                               const std::vector<int>& bodies) {
  return std::make_unique<EngineOfKinematics<S>>(robot, frames, bodies);
}
template std::unique_ptr<KinematicsEngine<float>> make_engine_of_kinematics(
    const RobotModel&, const std::vector<Frame>&, const std::vector<int>&);
template std::unique_ptr<KinematicsEngine<double>> make_engine_of_kinematics(
    const RobotModel&, const std::vector<Frame>&, const std::vector<int>&);

}  // namespace kalmarm
