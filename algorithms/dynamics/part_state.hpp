// A part of a plan at work: its engine, its state, and what is copied to and from it.
#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "algorithms/dynamics/copies.hpp"
#include "algorithms/dynamics/plan.hpp"
#include "algorithms/fast/claims/tuning.hpp"
#include "algorithms/model/plain.hpp"

namespace kalmarm {

template <class T>
struct PartState {
  static constexpr int rows_at_once = 64;  // states that are gathered at once

  struct Rows {
    std::vector<T> q, qd, tau_or_qdd, out, r, log_det;
    // Where the engine may have rows of them: M, M^-1, J M^-1 J', or one after the other three derivatives.
    std::vector<T> matrices;
    std::vector<Outcome> outcomes;
    std::vector<char> left_over;
  };

  struct Kinematics {
    Model<T> model;
    LinkKinematics<T> kin;

    explicit Kinematics(const Model<T>& m) : model(m), kin(model) {}
  };

  RobotModel robot;  // that the engine is made of,
  EngineOptions made_by;
  MakeEngine<T> make;
  std::unique_ptr<Engine<T>> engine;
  bool in_part = false;
  bool block = false;   // M^-1 by `selected`: not all of it is asked for
  bool sums_D = false;  // log det M by it: no D is that of a locked joint
  bool at_rest = false;
  int nq, nv, selected = 0;
  std::vector<int> dofs;  // of the whole
  std::vector<Site<T>> sites;
  std::unique_ptr<Kinematics> kinematics;  // of the sites, where M^-1 is formed
  Copies q_in, v_in;                       // state of the whole -> of the part
  std::vector<int> free_dofs;              // of the part: those that are not locked
  Copies asked;                            // DoF of the part -> of the result
  Copies block_out, frames_out;            // row of `selected`, or of J -> row of the result
  VectorX<T> q, qd, tau_or_qdd, a;
  MatrixX<T> X, selection, J, XJ, M, derivatives[3];
  Eigen::LLT<MatrixX<T>> llt;
  std::vector<Rows> rows;  // of every worker

  PartState(const Plan& plan, const Part& part, double tolerance, Triangles triangles,
            const MakeEngine<T>& make, bool nothing_to_copy);

  // One state of a robot that has the joint noise r (nv), where this one has some: of an engine that
  // is made for it.
  Outcome of_noise(const T* r, const T* q_part, const T* qd_part, const T* tau, T* out) const {
    RobotModel noisy = robot;
    for (int k = 0; k < nv; ++k)
      if (double& armature = noisy.links[k].armature; armature > 0)
        armature = static_cast<double>(r[k]);
    EngineOptions options = made_by;
    options.want = {Want::acceleration};
    options.selection = {};
    return make(noisy, options)->forward_dynamics(q_part, qd_part, tau, out);
  }

  void gather_q(const T* from) { q_in(from, q.data()); }

  void gather(const T* q_whole, const T* qd_whole, const T* tau_or_qdd_whole) {
    q_in(q_whole, q.data());
    if (!at_rest) v_in(qd_whole, qd.data());
    v_in(tau_or_qdd_whole, tau_or_qdd.data());
  }

  // r_rows: joint noise, null where the robot's is taken.
  void gather_rows(Rows& r, int states, const T* q_rows, std::ptrdiff_t q_width, const T* qd_rows,
                   const T* tau_or_qdd_rows, std::ptrdiff_t v_width,
                   const T* r_rows = nullptr) const {
    for (int i = 0; i < states; ++i) {
      q_in(q_rows + i * q_width, r.q.data() + i * nq);
      if (!at_rest) v_in(qd_rows + i * v_width, r.qd.data() + i * nv);
      v_in(tau_or_qdd_rows + i * v_width, r.tau_or_qdd.data() + i * nv);
      if (r_rows) v_in(r_rows + i * v_width, r.r.data() + i * nv);
    }
  }

  void gather_q(Rows& r, int states, const T* q_rows, std::ptrdiff_t q_width) const {
    for (int i = 0; i < states; ++i) q_in(q_rows + i * q_width, r.q.data() + i * nq);
  }

  // Torques of DoF that are not asked about are zero.
  void gather_asked(Rows& r, int states, const T* tau_rows, std::ptrdiff_t tau_width) const {
    std::fill_n(r.tau_or_qdd.data(), std::ptrdiff_t(states) * nv, T(0));
    for (int i = 0; i < states; ++i)
      asked.back(tau_rows + i * tau_width, r.tau_or_qdd.data() + i * nv);
  }

  Outcome of_whole(Outcome outcome) const {
    if (outcome.joint >= 0) outcome.joint = dofs[outcome.joint];
    return outcome;
  }

  // Memory for the rows of so many workers.
  void reserve_rows(Want what, int workers) {
    while (static_cast<int>(rows.size()) < workers) {
      Rows& r = rows.emplace_back();
      for (int i = 0; i < rows_at_once; ++i) r.q.insert(r.q.end(), q.begin(), q.end());
      r.qd.assign(std::size_t(rows_at_once) * nv, T(0));
      r.tau_or_qdd = r.out = r.r = r.qd;
      r.log_det.resize(rows_at_once);
      r.outcomes.resize(rows_at_once);
      r.left_over.resize(rows_at_once);
    }
    const std::size_t size = rows_at_once * numbers_of_matrices(what);
    for (Rows& r : rows) r.matrices.resize(std::max(r.matrices.size(), size));
  }

  // Of a row of `what`; 0 where rows have no matrices or are not worked out together.
  std::size_t numbers_of_matrices(Want what) const {
    const std::size_t size = std::size_t(nv) * nv;
    switch (what) {
      case Want::mass:
      case Want::inverse:
        return block || nv > most_rows_in_lanes ? 0 : size;
      case Want::operational:
        return std::size_t(selected) * selected;
      case Want::derivatives:
        return nv > most_derivatives_in_lanes ? 0 : 3 * size;
      default:
        return 0;
    }
  }

  // Of all DoF that are free.
  Outcome log_det_by_cholesky(T& x);
};

template <class T>
PartState<T>::PartState(const Plan& plan, const Part& part, double tolerance, Triangles triangles,
                        const MakeEngine<T>& maker, bool nothing_to_copy)
    : make(maker),
      nq(part.reduction.model.nq()),
      nv(part.reduction.model.nv()),
      dofs(part.reduction.dofs),
      q(nq),
      qd(VectorX<T>::Zero(nv)),
      tau_or_qdd(qd),
      a(nv) {
  const auto wants = [&](Want what) { return plan.question.want.contains(what); };
  const Reduction& reduction = part.reduction;
  const Question& question = plan.question;
  Model<double> model = reduction.model;
  // Large enough for g = P H' / D to vanish beside 1, small enough for g^2 not to underflow.
  const T infinite = T(1) / (unit_roundoff<T>() * unit_roundoff<T>());
  const double infinite_noise = infinite < T(0x1p996) ? static_cast<double>(infinite) : 0x1p996;
  std::vector<char> locked(plan.nv, 0);
  for (const int k : question.locked) locked[k] = 1;
  bool holds_locked = false;
  for (int k = 0; k < model.nv(); ++k)
    if (locked[reduction.dofs[k]]) {
      model.set_noise(k, infinite_noise);
      holds_locked = true;
    }

  at_rest = question.at_rest;
  // What is locked by noise keeps its place and stands still.
  for (int i = 0; i < nq; ++i) q[i] = T(question.q[reduction.q_whole[i]]);
  for (int k = 0; k < nv; ++k) {
    if (locked[reduction.dofs[k]]) continue;
    free_dofs.push_back(k);
    v_in.add(reduction.dofs[k], k);
    const Joint<double>& joint = model.joint(k);
    for (int i = 0; i < q_entries(joint.coordinate); ++i)
      q_in.add(reduction.q_whole[joint.q_index + i], joint.q_index + i);
  }

  EngineOptions options;
  options.tolerance = tolerance;
  // Without partial answers the rest of M^-1 is read off the whole of it.
  options.triangles = plan.partial_answers ? triangles : Triangles::both;
  options.kernel = part.kernel;
  options.zeros = part.zeros;
  options.want = question.want;
  if (part.block) options.selection.dofs = part.asked;
  if (wants(Want::operational)) options.selection.frames = part.frames;
  if (!plan.partial_answers || holds_locked) {
    if (wants(Want::log_det)) options.want.insert(Want::mass);
  }
  if (!plan.partial_answers) {
    options.selection = {};
    if (wants(Want::diagonal) || wants(Want::operational)) options.want.insert(Want::inverse);
  }
  robot = plain(model);
  made_by = options;
  engine = make(robot, options);
  in_part = plan.partial_answers && engine->answers_in_part();
  block = in_part && part.block;
  sums_D = in_part && !holds_locked;

  int row = 0;
  for (const int k : part.asked) {
    const int place =
        static_cast<int>(std::lower_bound(plan.asked.begin(), plan.asked.end(), reduction.dofs[k]) -
                         plan.asked.begin());
    asked.add(k, place);
    if (block) block_out.add(row++, place);
  }
  if (wants(Want::operational)) {
    for (const int frame : part.frame_index)
      for (int i = 0; i < 6; ++i) frames_out.add(row++, 6 * frame + i);
    for (const Frame& frame : part.frames) sites.push_back(site_of(frame).template cast<T>());
  }
  selected = row;
  selection.resize(row, row);
  if (!in_part && !sites.empty()) {
    kinematics = std::make_unique<Kinematics>(model.template cast<T>());
    J.resize(6 * static_cast<int>(sites.size()), nv);
    XJ.resize(nv, J.rows());
  }
  const bool by_cholesky = wants(Want::log_det) && !sums_D;
  const bool copies = !nothing_to_copy;
  const bool whole = (copies && wants(Want::inverse) && !block) || (copies && wants(Want::mass)) ||
                     by_cholesky ||
                     (!in_part && (wants(Want::diagonal) || wants(Want::operational)));
  if (whole) X.resize(nv, nv);
  if (copies && wants(Want::derivatives))
    for (MatrixX<T>& X : derivatives) X.resize(nv, nv);
  if (by_cholesky) {
    M.resize(free_dofs.size(), free_dofs.size());
    llt = Eigen::LLT<MatrixX<T>>(M.rows());
  }
}

template <class T>
Outcome PartState<T>::log_det_by_cholesky(T& x) {
  using std::log;
  engine->mass(q.data(), X.data());
  for (int j = 0; j < M.cols(); ++j)
    for (int i = 0; i < M.rows(); ++i) M(i, j) = X(free_dofs[i], free_dofs[j]);
  llt.compute(M);
  if (llt.info() != Eigen::Success) return {.status = Outcome::Status::indefinite};
  x = T(0);
  for (int k = 0; k < M.rows(); ++k) x += T(2) * log(llt.matrixLLT()(k, k));
  return {};
}

}  // namespace kalmarm
