// The rows of constraints in one state: e, e', J and what a_ref of (2) of kalmarm/constrained_dynamics.hpp is made of.
//
// With p, R, w, v, z, c the pose, velocities and, of qdd = 0, accelerations of a frame in the base's axes, and 1 - 2 what
// frame 1 has more than frame 2,
//   point:  e = p1 - p2,  e' = v1 - v2,  dJ/dt qd = c1 - c2                                   (1)
//   pose:   (w, u) the quaternion of R2' R1,  e = 2 s u,  N = s (w 1 - [u x]) R2'
//           e' = N (w1 - w2),  dJ/dt qd = N (z1 - z2 - w2 x (w1 - w2)) - s/2 |w1 - w2|^2 u     (2)
//   coupling: x = J2 q - l0,  e = J1 q - P(x),  J = J1 - P'(x) J2,  dJ/dt qd = -P''(x) (J2 qd)^2  (3)
#pragma once

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "algorithms/spatial/spatial.hpp"
#include "kalmarm/constraint.hpp"
#include "kalmarm/implicit_step.hpp"

namespace kalmarm {

// Of the frames of a state, as KinematicResults has them in aligned axes; without motion the last two are null.
template <class T>
struct FrameNumbers {
  const T *positions, *rotations, *jacobians, *velocities = nullptr, *accelerations = nullptr;
};

// Of m rows. `reach` and `spread` are sums of the sizes of what J and a_ref are differences of.
struct RowNumbers {
  MatrixX<double> Jt, reach;  // nv x m, zero but at what moves a row
  VectorX<double> e, rate, target, spread, R;

  RowNumbers(int nv, int m)
      : Jt(MatrixX<double>::Zero(nv, m)), reach(Jt), e(m), rate(m), target(m), spread(m), R(m) {}
};

inline double share(const Impedance& d, double r) {
  if (!(d.width > 0) || r >= d.width) return d.most;
  const double x = r / d.width, m = d.midpoint, p = d.power;
  const double y =
      x <= m ? x * std::pow(x / m, p - 1) : 1 - (1 - x) * std::pow((1 - x) / (1 - m), p - 1);
  return d.least + y * (d.most - d.least);
}

class ConstraintRows {
 public:
  // constraints: checked.
  ConstraintRows(const RobotModel& robot, const std::vector<Constraint>& constraints)
      : nv_(robot.nv()) {
    for (int k = 0; k < nv_; ++k)
      q_of_.push_back(takes_spring(robot.links[k]) ? robot.links[k].q_index : -1);
    for (const Constraint& constraint : constraints) {
      Held held{constraint, static_cast<int>(of_.size()), static_cast<int>(frames_.size()), {}};
      of_.resize(of_.size() + constraint.rows(), static_cast<int>(held_.size()));
      std::vector<char> moves(nv_, 0);
      if (constraint.kind == Constraint::Kind::coupling) {
        held.constraint.other.resize(nv_, 0);
        for (int k = 0; k < nv_; ++k)
          moves[k] = constraint.jacobian[k] != 0 || held.constraint.other[k] != 0;
      } else {
        for (const Frame& frame : {constraint.first, constraint.second}) {
          frames_.push_back(frame);
          for (int k = frame.link; k >= 0; k = robot.links[k].parent) moves[k] = 1;
        }
      }
      for (int k = 0; k < nv_; ++k)
        if (moves[k]) held.moved.push_back(k);
      held_.push_back(std::move(held));
    }
  }

  int count() const { return static_cast<int>(of_.size()); }
  const std::vector<Frame>& frames() const { return frames_; }
  int constraint_of(int row) const { return of_[row]; }
  // How many rows from this first one on have their unit and their axes in common.
  int alike(int row) const {
    return held_[of_[row]].constraint.kind == Constraint::Kind::coupling ? 1 : 3;
  }
  const std::vector<int>& moved_by(int row) const { return held_[of_[row]].moved; }

  // qd: null where nothing moves, as `at` says then.
  template <class T>
  void evaluate(const FrameNumbers<T>& at, const T* q, const T* qd, RowNumbers& out) const {
    for (const Held& held : held_) {
      if (held.constraint.kind == Constraint::Kind::coupling)
        couple(held, q, qd, out);
      else
        close(held, at, out);
      weigh(held, out);
    }
  }

 private:
  struct Held {
    Constraint constraint;
    int row, frame;          // the first ones
    std::vector<int> moved;  // DoF by which it moves
  };

  template <class T>
  struct Placed {
    Vector3<double> p, w, v, z, c;
    Matrix3<double> R;
    const T* jacobian;

    Placed(const FrameNumbers<T>& at, int frame, std::ptrdiff_t nv)
        : jacobian(at.jacobians + 6 * nv * frame) {
      const auto three = [](const T* from) -> Vector3<double> {
        return Eigen::Map<const Vector3<T>>(from).template cast<double>();
      };
      p = three(at.positions + 3 * frame);
      R = Eigen::Map<const Matrix3<T>>(at.rotations + 9 * frame).template cast<double>();
      w.setZero(), v.setZero(), z.setZero(), c.setZero();
      if (!at.velocities) return;
      w = three(at.velocities + 6 * frame), v = three(at.velocities + 6 * frame + 3);
      z = three(at.accelerations + 6 * frame), c = three(at.accelerations + 6 * frame + 3);
    }
  };

  template <class T>
  void close(const Held& held, const FrameNumbers<T>& at, RowNumbers& out) const {
    const Placed<T> one(at, held.frame, nv_), two(at, held.frame + 1, nv_);
    const Constraint& constraint = held.constraint;
    const double k = constraint.stiffness, b = constraint.damping;
    const bool turns = constraint.kind == Constraint::Kind::pose;
    const int moving = held.row + (turns ? 3 : 0);
    const auto put = [&](int row, const Vector3<double>& e, const Vector3<double>& rate,
                         const Vector3<double>& curvature, double spread) {
      out.e.segment<3>(row) = e;
      out.rate.segment<3>(row) = rate;
      out.target.segment<3>(row) =
          constraint.velocity_terms ? -curvature : Vector3<double>::Zero().eval();
      out.spread.segment<3>(row).setConstant(spread);
    };
    put(moving, one.p - two.p, one.v - two.v, one.c - two.c,  // (1)
        one.c.norm() + two.c.norm() + b * (one.v.norm() + two.v.norm()) +
            k * (one.p.norm() + two.p.norm()));
    for (const int j : held.moved)
      for (int i = 0; i < 3; ++i) {
        const double x = one.jacobian[(3 + i) * nv_ + j], y = two.jacobian[(3 + i) * nv_ + j];
        out.Jt(j, moving + i) = x - y;
        out.reach(j, moving + i) = std::abs(x) + std::abs(y);
      }
    if (!turns) return;
    const double s = constraint.turning;
    Eigen::Quaternion<double> turn(Matrix3<double>(two.R.transpose() * one.R));
    if (turn.w() < 0) turn.coeffs() *= -1;
    const Vector3<double> u = turn.vec(), w = one.w - two.w;
    Matrix3<double> N = -s * cross_matrix(u);
    N.diagonal().array() += s * turn.w();
    N = N * two.R.transpose();
    put(held.row, 2 * s * u, N * w,
        N * (one.z - two.z - two.w.cross(w)) - s / 2 * w.squaredNorm() * u,  // (2)
        s * (one.z.norm() + two.z.norm() + one.w.squaredNorm() + two.w.squaredNorm() +
             b * (one.w.norm() + two.w.norm()) + k));
    for (const int j : held.moved) {
      Vector3<double> x, y;
      for (int i = 0; i < 3; ++i) {
        x[i] = one.jacobian[i * nv_ + j];
        y[i] = two.jacobian[i * nv_ + j];
      }
      out.Jt.block<1, 3>(j, held.row) = N * (x - y);
      out.reach.block<1, 3>(j, held.row).setConstant(s * (x.norm() + y.norm()));
    }
  }

  template <class T>
  void couple(const Held& held, const T* q, const T* qd, RowNumbers& out) const {
    const Constraint& constraint = held.constraint;
    const std::array<double, 5>& c = constraint.polynomial;
    double length = 0, rate = 0, x = -constraint.reference, x_rate = 0, size = 0, speed = 0;
    for (const int j : held.moved) {
      const double J = constraint.jacobian[j], other = constraint.other[j], at = q[q_of_[j]],
                   moves = qd ? qd[j] : T(0);
      length += J * at, rate += J * moves, x += other * at, x_rate += other * moves;
      size += std::abs(J * at), speed += std::abs(J * moves);
    }
    double P = 0, slope = 0, curve = 0;  // of P(x)
    for (int i = 4; i >= 0; --i) {
      curve = curve * x + 2 * slope;
      slope = slope * x + P;
      P = P * x + c[i];
    }
    const int row = held.row;
    const double bends = curve * x_rate * x_rate;
    out.e[row] = length - P;  // (3)
    out.rate[row] = rate - slope * x_rate;
    out.target[row] = constraint.velocity_terms ? bends : 0;
    out.spread[row] = std::abs(bends) + constraint.damping * (speed + std::abs(slope * x_rate)) +
                      constraint.stiffness * (size + std::abs(P));
    for (const int j : held.moved) {
      const double J = constraint.jacobian[j], other = slope * constraint.other[j];
      out.Jt(j, row) = J - other;
      out.reach(j, row) = std::abs(J) + std::abs(other);
    }
  }

  // From dJ/dt qd to a_ref, and R.
  void weigh(const Held& held, RowNumbers& out) const {
    const Constraint& constraint = held.constraint;
    const int row = held.row, rows = constraint.rows();
    const double d =
        constraint.impedance ? share(*constraint.impedance, out.e.segment(row, rows).norm()) : 1;
    out.target.segment(row, rows) -= constraint.damping * out.rate.segment(row, rows) +
                                     constraint.stiffness * d * out.e.segment(row, rows);
    const double gives = constraint.impedance ? (1 - d) / d : 1;
    const int turning = constraint.kind == Constraint::Kind::pose ? 3 : 0;
    out.R.segment(row, turning).setConstant(constraint.compliance[0] * gives);
    out.R.segment(row + turning, rows - turning).setConstant(constraint.compliance[1] * gives);
  }

  int nv_;
  std::vector<int> q_of_;  // of every DoF, its entry of q where it has a length
  std::vector<int> of_;    // of every row, its constraint
  std::vector<Frame> frames_;
  std::vector<Held> held_;
};

}  // namespace kalmarm
