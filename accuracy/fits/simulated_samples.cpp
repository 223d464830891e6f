#include "accuracy/fits/simulated_samples.hpp"

#include <algorithm>
#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>

#include "accuracy/fits/prediction.hpp"
#include "algorithms/study/derivatives/mass_jacobian.hpp"
#include "robots/loader/input_error.hpp"
#include "robots/scene/memory_limit.hpp"
#include "robots/scene/mujoco_solver.hpp"

namespace kalmarm {
namespace {

void add_torques(const Scene& hidden, Samples& samples) {
  MujocoSolver mujoco(mujoco_of(hidden));
  const JointFriction friction = friction_of(hidden);
  const int nv = hidden.model.nv();
  VectorX<double> tau(nv);
  MatrixX<double> M(nv, nv);
  samples.mass.resize(lower_triangle_size(nv), samples.count());
  for (int i = 0; i < samples.count(); ++i) {
    mujoco.inverse_dynamics(samples.q.col(i), samples.qd.col(i), samples.qdd.col(i), tau);
    for (int k = 0; k < nv; ++k) {
      const double v = samples.qd(k, i);
      samples.tau(k, i) = tau[k] + friction.viscous[k] * v + friction.coulomb[k] * coulomb_sign(v);
    }
    mujoco.mass(samples.q.col(i), M);
    for (int row = 0; row < nv; ++row)
      for (int col = 0; col <= row; ++col)
        samples.mass(lower_triangle_row(row, col), i) = M(row, col);
  }
}

void add_noise(double noise, std::uint64_t seed, Samples& samples) {
  boost::random::mt19937_64 random(seed);
  boost::random::normal_distribution<double> normal;
  const VectorX<double> deviation = noise * row_sizes(samples.tau);
  for (int i = 0; i < samples.count(); ++i)
    for (int k = 0; k < deviation.size(); ++k) samples.tau(k, i) += deviation[k] * normal(random);
}

}  // namespace

SimulatedSamples simulate_samples(const Scene& hidden, const SimulationOptions& options) {
  const double numbers = hidden.model.nq() + 3 * hidden.model.nv() +
                         lower_triangle_size(hidden.model.nv()) +
                         body_parameters * hidden.model.nv() * hidden.model.nv();  // of a regressor
  refuse_large(std::to_string(options.count) + " samples of " + hidden.name,
               1.25 * options.count * numbers * sizeof(double));
  ExcitationOptions train{.count = options.count,
                          .period = options.period,
                          .speed = options.speed,
                          .seed = options.seed};
  ExcitationOptions test = train;
  test.count = std::max(1, options.count / 4);
  test.seed = options.seed + 1;
  test.candidates = 1;
  Excitation excitation = excite(hidden, train);
  SimulatedSamples out{std::move(excitation.samples), excite(hidden, test).samples,
                       excitation.condition};
  std::uint64_t seed = options.seed;
  for (Samples* samples : {&out.train, &out.test}) {
    add_torques(hidden, *samples);
    if (options.noise > 0) add_noise(options.noise, seed, *samples);
    seed += 0x9e3779b97f4a7c15;  // another stream
  }
  return out;
}

void check_same_joints(const Scene& robot, const Scene& hidden) {
  const Model<double>&a = robot.model, &b = hidden.model;
  if (a.nv() != b.nv() || a.nq() != b.nq())
    throw InputError(hidden.name + " has " + std::to_string(b.nv()) + " degrees of freedom, " +
                     robot.name + " has " + std::to_string(a.nv()));
  for (int k = 0; k < a.nv(); ++k) {
    if (a.name(k) != b.name(k))
      throw InputError("joint " + std::to_string(k) + " is '" + b.name(k) + "' in " + hidden.name +
                       " and '" + a.name(k) + "' in " + robot.name);
    if (a.parent(k) != b.parent(k) || a.joint(k).coordinate != b.joint(k).coordinate)
      throw InputError("joint '" + a.name(k) +
                       "' is another kind of joint, or hangs elsewhere, in " + hidden.name +
                       " than in " + robot.name);
  }
}

}  // namespace kalmarm
