#include "robots/scene/couplings.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "robots/loader/files/read_file.hpp"
#include "robots/loader/imposed_rows.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/loader/mujoco_shim.hpp"

namespace kalmarm {

Couplings::Couplings(const Scene& scene) : model_(scene.model) {
  if (scene.file.empty()) throw InputError("scene '" + scene.name + "' has no couplings of joints");
  install_mujoco_handlers();
  const int nv = model_.nv();
  for (int k = 0; k < nv; ++k) followers_.push_back({k});
  const std::vector<NamedCoupling> couplings =
      linear_couplings(read_file(scene.file, scene.read).spec.get());
  if (couplings.empty()) throw InputError(scene.file + ": has no couplings of joints");
  for (const auto& [k, of, offset, ratio] : couplings_of(scene.mujoco->get(), couplings)) {
    if (followers_[k].of != k)
      throw InputError("the coupling of joint '" + model_.name(k) + "' is not the only one");
    followers_[k] = {of, offset, ratio};  // (1)
  }

  std::vector<Follower> resolved;
  for (int k = 0; k < nv; ++k) {
    resolved.push_back(followed(k));
    if (resolved[k].of == k) left_.push_back(k);
  }
  followers_ = std::move(resolved);
  const int free = static_cast<int>(left_.size());
  G_ = MatrixX<double>::Zero(nv, free);
  A_ = MatrixX<double>::Zero(nv - free, nv);
  for (int k = 0, row = 0; k < nv; ++k) {
    const auto [of, offset, ratio] = followers_[k];
    if (of >= 0) G_(k, std::lower_bound(left_.begin(), left_.end(), of) - left_.begin()) = ratio;
    if (of == k) continue;
    A_(row, k) = 1;
    if (of >= 0) A_(row, of) = -ratio;
    ++row;
  }
}

Couplings::Follower Couplings::followed(int k) const {
  Follower out{k};
  for (int steps = 0; out.of >= 0 && followers_[out.of].of != out.of; ++steps) {
    if (steps > model_.nv())
      throw InputError("joint '" + model_.name(k) + "' is coupled to itself");
    const Follower& next = followers_[out.of];
    out = {next.of, out.offset + out.ratio * next.offset, out.ratio * next.ratio};
  }
  return out;
}

State Couplings::imposed(State state) const {
  for (int k = 0; k < model_.nv(); ++k) {
    const auto [of, offset, ratio] = followers_[k];
    if (of == k) continue;
    const int q = model_.joint(k).q_index;
    state.q[q] = offset + (of < 0 ? 0 : ratio * state.q[model_.joint(of).q_index]);
    state.qd[k] = of < 0 ? 0 : ratio * state.qd[of];
  }
  return state;
}

State Couplings::checked(const State& state, const std::string& where) const {
  State out = imposed(state);
  for (int k = 0; k < model_.nv(); ++k) {
    const int q = model_.joint(k).q_index;
    if (followers_[k].of == k) continue;
    if (std::abs(out.q[q] - state.q[q]) > 1e-9 || std::abs(out.qd[k] - state.qd[k]) > 1e-9)
      throw InputError(where + "joint '" + model_.name(k) + "' is coupled: qpos[" +
                       std::to_string(q) + "] must be " + std::to_string(out.q[q]) + " and qvel[" +
                       std::to_string(k) + "] " + std::to_string(out.qd[k]));
  }
  return out;
}

MatrixX<double> Couplings::mass(const MatrixX<double>& M) const { return G_.transpose() * M * G_; }

MatrixX<double> Couplings::inverse(const MatrixX<double>& X) const {
  const MatrixX<double> XA = X * A_.transpose();
  const MatrixX<double> Y = X - XA * (A_ * XA).llt().solve(XA.transpose());
  return Y(left_, left_);
}

VectorX<double> Couplings::acceleration(const MatrixX<double>& X, const VectorX<double>& a) const {
  const MatrixX<double> XA = X * A_.transpose();
  const VectorX<double> qdd = a - XA * (A_ * XA).llt().solve(A_ * a);
  return qdd(left_);
}

}  // namespace kalmarm
