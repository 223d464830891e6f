#include "accuracy/fits/excitation.hpp"

#include <algorithm>
#include <boost/random/mersenne_twister.hpp>
#include <boost/random/normal_distribution.hpp>
#include <boost/random/uniform_real_distribution.hpp>
#include <cmath>
#include <numbers>

#include "accuracy/fits/identifiability.hpp"
#include "accuracy/fits/quaternion_rates.hpp"

namespace kalmarm {
namespace {

using Random = boost::random::mt19937_64;

// One series for every DoF.
struct Series {
  VectorX<double> x0;
  MatrixX<double> a, b;  // nv x harmonics
};

struct Motion {
  MatrixX<double> x, xd, xdd;  // nv x count
};

// Values, and first and second derivatives at evenly spaced times.
Motion motion(const Series& series, const VectorX<double>& time, double period) {
  const auto nv = series.x0.size(), count = time.size();
  Motion out{series.x0.replicate(1, count), MatrixX<double>::Zero(nv, count),
             MatrixX<double>::Zero(nv, count)};
  for (int l = 1; l <= series.a.cols(); ++l) {
    const double w = 2 * std::numbers::pi * l / period;
    const VectorX<double> a = series.a.col(l - 1), b = series.b.col(l - 1);
    const Eigen::RowVectorXd s = (w * time.array()).sin(), c = (w * time.array()).cos();
    out.x += a / w * s + b / (w * w) * c;
    out.xd += a * c - b / w * s;
    out.xdd += -a * w * s - b * c;
  }
  return out;
}

// Centre and half width of the values that DoF k may take, and its largest speed.
struct Limits {
  double centre, half, speed;
};

Limits limits(const Scene& scene, int k, double speed) {
  const Joint<double>& joint = scene.model.joint(k);
  switch (joint.coordinate) {
    case Coordinate::angle:
    case Coordinate::distance: {
      const auto [low, high] = scene.range[joint.q_index];
      return {(low + high) / 2, (high - low) / 2, joint.slides ? speed / 2 : speed};
    }
    case Coordinate::position:
      return {0, 1, speed / 2};
    case Coordinate::quaternion:
      return {0, 1, speed / 2};  // vector part of u: turns to 90 degrees
    case Coordinate::follower:
      break;
  }
  return limits(scene, k - 1, speed);
}

// Random coefficients: accelerations of about one size in all harmonics.
Series draw(const Scene& scene, const ExcitationOptions& options, Random& random) {
  boost::random::normal_distribution<double> normal;
  boost::random::uniform_real_distribution<double> shift(-0.3, 0.3);
  const int nv = scene.model.nv();
  Series out{VectorX<double>(nv), MatrixX<double>(nv, options.harmonics),
             MatrixX<double>(nv, options.harmonics)};
  for (double& x : out.a.reshaped()) x = normal(random);
  for (double& x : out.b.reshaped()) x = normal(random);
  for (int k = 0; k < nv; ++k) {
    const Limits limit = limits(scene, k, options.speed);
    out.x0[k] = limit.centre + shift(random) * limit.half;
  }
  return out;
}

// Shrinks or stretches every series until it touches its limits.
void fit_to_limits(const Scene& scene, const ExcitationOptions& options,
                   const VectorX<double>& time, Series& series) {
  const Motion free = motion(series, time, options.period);
  for (int k = 0; k < scene.model.nv(); ++k) {
    const Limits limit = limits(scene, k, options.speed);
    const double room = limit.half - std::abs(series.x0[k] - limit.centre);
    const double reach = (free.x.row(k).array() - series.x0[k]).abs().maxCoeff();
    const double speed = free.xd.row(k).cwiseAbs().maxCoeff();
    const double factor = std::min(room / reach, limit.speed / speed);
    series.a.row(k) *= factor;
    series.b.row(k) *= factor;
  }
}

Samples to_samples(const Scene& scene, const VectorX<double>& time, const Motion& motion) {
  const Model<double>& model = scene.model;
  const auto count = time.size();
  Samples out;
  out.time = time;
  out.q = MatrixX<double>::Zero(model.nq(), count);
  out.qd = motion.xd;
  out.qdd = motion.xdd;
  out.tau = MatrixX<double>::Zero(model.nv(), count);
  for (int k = 0; k < model.nv(); ++k) {
    const Joint<double>& joint = model.joint(k);
    const int i = joint.q_index;
    switch (joint.coordinate) {
      case Coordinate::angle:
      case Coordinate::distance:
        out.q.row(i) = motion.x.row(k);
        break;
      case Coordinate::position:
        out.q.middleRows<3>(i) = motion.x.middleRows<3>(k);
        break;
      case Coordinate::quaternion:
        for (int t = 0; t < count; ++t) {
          Eigen::Vector4d u, ud, udd;
          u << 1, motion.x.col(t).segment<3>(k);
          ud << 0, motion.xd.col(t).segment<3>(k);
          udd << 0, motion.xdd.col(t).segment<3>(k);
          const auto [omega, omega_dot] = quaternion_rates(u, ud, udd);
          out.q.col(t).segment<4>(i) = u.normalized();
          out.qd.col(t).segment<3>(k) = omega;
          out.qdd.col(t).segment<3>(k) = omega_dot;
        }
        break;
      case Coordinate::follower:
        break;
    }
  }
  return out;
}

VectorX<double> times(int count, double period) {
  return VectorX<double>::LinSpaced(count, 0, period * (count - 1) / count);
}

}  // namespace

Excitation excite(const Scene& scene, const ExcitationOptions& options) {
  Random random(options.seed);
  boost::random::normal_distribution<double> normal;
  const VectorX<double> all = times(options.count, options.period);
  const VectorX<double> few = times(std::min(options.count, 100), options.period);
  const auto judge = [&](const Series& series) {
    return regressor_condition(scene, to_samples(scene, few, motion(series, few, options.period)));
  };
  Series best;
  RankAndCondition of_best;
  for (int i = 0; i < options.candidates; ++i) {
    // the first half is drawn anew, the second moves the best a little
    Series candidate = best;
    if (2 * i <= options.candidates) {
      candidate = draw(scene, options, random);
    } else {
      const double size = candidate.a.norm() / std::sqrt(candidate.a.size());
      for (double& x : candidate.a.reshaped()) x += 0.2 * size * normal(random);
      for (double& x : candidate.b.reshaped()) x += 0.2 * size * normal(random);
    }
    fit_to_limits(scene, options, few, candidate);
    const RankAndCondition of_candidate = judge(candidate);
    if (i > 0 && !of_candidate.better_than(of_best)) continue;
    best = candidate;
    of_best = of_candidate;
  }
  fit_to_limits(scene, options, all, best);
  return {to_samples(scene, all, motion(best, all, options.period)), of_best.condition};
}

}  // namespace kalmarm
