// Robots of bodies, their mechanics followed from body to body without links or frames, and the same
// robots lowered by hand.
#pragma once

#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/fast/lowering/zero_terms.hpp"
#include "algorithms/fast/test/support.hpp"
#include "kalmarm/model_builder.hpp"

namespace kalmarm::test {

using Vector = Vector3<double>;
using Matrix = Matrix3<double>;

inline Vector vector_of(const std::array<double, 3>& x) { return Vector(x.data()); }

inline Matrix turn_of(const std::array<double, 4>& wxyz) {
  return Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]).normalized().toRotationMatrix();
}

inline Matrix inertia_of(const BodyParameters& body) {
  const auto& [xx, yy, zz, xy, xz, yz] = body.inertia;
  Matrix I;
  I << xx, xy, xz, xy, yy, yz, xz, yz, zz;
  return I;
}

// Bodies with the gravity that pulls them.
struct Robot {
  std::vector<BodyParameters> bodies = {};
  std::array<double, 3> gravity = {0.3, 0.1, -9.81};

  ModelBuilder builder() const {
    ModelBuilder out;
    out.set_gravity(gravity);
    for (std::size_t i = 0; i < bodies.size(); ++i)
      EXPECT_EQ(out.add_body(bodies[i]), static_cast<int>(i));
    return out;
  }
  RobotModel build() const { return builder().build(); }
};

// A body on its way: pose and velocity of its frame in the world's axes.
struct Moving {
  Matrix R = Matrix::Identity();
  Vector p = Vector::Zero(), w = p, v = p;  // v of the origin p
};

// Every body at q and qd, from the bodies' parameters alone.
inline std::vector<Moving> follow(const Robot& robot, const VectorX<double>& q,
                                  const VectorX<double>& qd) {
  std::vector<Moving> all;
  int i = 0, k = 0;  // next entries of q and qd
  for (const BodyParameters& body : robot.bodies) {
    const Moving parent = body.parent < 0 ? Moving() : all[body.parent];
    const auto carried = [&](const Vector& d) {
      Moving m = parent;
      m.p += d;
      m.v += parent.w.cross(d);
      return m;
    };
    const Matrix placed = parent.R * turn_of(body.rotation);
    const Vector d = parent.R * vector_of(body.position), axis = vector_of(body.axis).normalized();
    Moving m;
    switch (body.joint) {
      case JointType::fixed:
        m = carried(d);
        m.R = placed;
        break;
      case JointType::hinge:
        m = carried(d);
        m.R = placed * Eigen::AngleAxisd(q[i++] - body.reference, axis).toRotationMatrix();
        m.w += placed * axis * qd[k++];
        break;
      case JointType::slide:
        m = carried(d + placed * axis * (q[i++] - body.reference));
        m.R = placed;
        m.v += placed * axis * qd[k++];
        break;
      case JointType::ball:
        m = carried(d);
        m.R = placed * turn_of({q[i], q[i + 1], q[i + 2], q[i + 3]});
        m.w += m.R * qd.segment<3>(k);
        i += 4;
        k += 3;
        break;
      case JointType::free:
        m = carried(d + placed * q.segment<3>(i));
        m.R = placed * turn_of({q[i + 3], q[i + 4], q[i + 5], q[i + 6]});
        m.v += placed * qd.segment<3>(k);
        m.w += m.R * qd.segment<3>(k + 3);
        i += 7;
        k += 6;
        break;
    }
    all.push_back(m);
  }
  return all;
}

inline int dof_of(JointType joint) {
  switch (joint) {
    case JointType::fixed:
      return 0;
    case JointType::ball:
      return 3;
    case JointType::free:
      return 6;
    default:
      return 1;
  }
}

// Of the bodies and the rotors.
inline double kinetic_energy(const Robot& robot, const VectorX<double>& q,
                             const VectorX<double>& qd) {
  const std::vector<Moving> moving = follow(robot, q, qd);
  double twice = 0;
  int k = 0;
  for (std::size_t b = 0; b < moving.size(); ++b) {
    const BodyParameters& body = robot.bodies[b];
    const Moving& m = moving[b];
    const bool stands = body.joint == JointType::fixed && body.parent < 0;
    const Vector c = m.R * vector_of(body.center_of_mass), w = m.R.transpose() * m.w;
    if (!stands)
      twice += body.mass * (m.v + m.w.cross(c)).squaredNorm() + w.dot(inertia_of(body) * w);
    for (int i = 0; i < dof_of(body.joint); ++i, ++k) twice += body.armature * qd[k] * qd[k];
  }
  return twice / 2;
}

inline double potential_energy(const Robot& robot, const VectorX<double>& q) {
  int nv = 0;
  for (const BodyParameters& body : robot.bodies) nv += dof_of(body.joint);
  const std::vector<Moving> moving = follow(robot, q, VectorX<double>::Zero(nv));
  double energy = 0;
  for (std::size_t b = 0; b < moving.size(); ++b) {
    const BodyParameters& body = robot.bodies[b];
    const Vector c = moving[b].p + moving[b].R * vector_of(body.center_of_mass);
    energy -= body.mass * vector_of(robot.gravity).dot(c);
  }
  return energy;
}

// A frame whose z axis is n, orthogonal to the last digits wherever n points.
inline Matrix frame_along(const Vector& n) {
  int least = 0;
  n.cwiseAbs().minCoeff(&least);
  Matrix R;
  R.col(2) = n;
  R.col(0) = Vector(Vector::Unit(least)).cross(n).normalized();
  R.col(1) = n.cross(R.col(0));
  return R;
}

// The same robot, lowered by what kalmarm/robot_model.hpp says, with other frames about the axes;
// bodies that are fixed are summed up about the centre of mass of all.
inline Model<double> lowered_by_hand(const Robot& robot) {
  struct Welded {
    double mass = 0;
    Vector moment = Vector::Zero();  // mass times centre of mass
    Matrix I = Matrix::Zero();       // about the link's origin
  };
  struct Frame {
    int link = -1;
    Matrix R = Matrix::Identity();
    Vector p = Vector::Zero();
  };
  std::vector<Joint<double>> joints;
  std::vector<Welded> links;
  std::vector<Frame> frames;
  int nq = 0;
  const auto push = [&](Joint<double> joint, int positions) {
    joint.q_index = nq;
    nq += positions;
    joints.push_back(joint);
    links.emplace_back();
    return static_cast<int>(joints.size()) - 1;
  };
  const auto push_followers = [&](Joint<double> first, int positions) {
    Joint<double> follower;
    follower.coordinate = Coordinate::follower;
    follower.slides = first.slides;
    follower.r = first.r;
    follower.parent = push(first, positions);
    follower.parent = push(follower, 0);
    return push(follower, 0);
  };
  for (const BodyParameters& body : robot.bodies) {
    const Frame parent = body.parent < 0 ? Frame() : frames[body.parent];
    Frame at{parent.link, parent.R * turn_of(body.rotation),
             parent.p + parent.R * vector_of(body.position)};
    Joint<double> joint;
    joint.parent = at.link;
    joint.translation = at.p;
    joint.r = body.armature;
    joint.rotation = Eigen::Quaterniond(at.R);
    const Eigen::Quaterniond to_axis(frame_along(vector_of(body.axis).normalized()));
    switch (body.joint) {
      case JointType::fixed:
        break;
      case JointType::slide:
        joint.slides = true;
        joint.coordinate = Coordinate::distance;
        [[fallthrough]];
      case JointType::hinge:
        joint.ref = body.reference;
        joint.rotation = Eigen::Quaterniond(at.R) * to_axis;
        at = {push(joint, 1), to_axis.conjugate().toRotationMatrix(), Vector::Zero()};
        break;
      case JointType::ball:
        joint.coordinate = Coordinate::quaternion;
        at = {push_followers(joint, 4)};
        break;
      case JointType::free: {
        joint.coordinate = Coordinate::position;
        joint.slides = true;
        Joint<double> ball;
        ball.parent = push_followers(joint, 3);
        ball.coordinate = Coordinate::quaternion;
        ball.r = body.armature;
        at = {push_followers(ball, 4)};
        break;
      }
    }
    if (at.link >= 0) {
      Welded& link = links[at.link];
      const Vector c = at.p + at.R * vector_of(body.center_of_mass);
      link.mass += body.mass;
      link.moment += body.mass * c;
      link.I += at.R * inertia_of(body) * at.R.transpose() +
                body.mass * (c.squaredNorm() * Matrix::Identity() - c * c.transpose());
    }
    frames.push_back(at);
  }
  std::vector<std::string> names;
  for (std::size_t k = 0; k < joints.size(); ++k) {
    names.push_back("dof" + std::to_string(k));
    if (links[k].I.isZero(0)) continue;
    const Vector c = links[k].moment / links[k].mass;
    const Matrix I =
        links[k].I - links[k].mass * (c.squaredNorm() * Matrix::Identity() - c * c.transpose());
    const Eigen::SelfAdjointEigenSolver<Matrix> eigen(I);
    Matrix axes = eigen.eigenvectors();
    if (axes.determinant() < 0) axes.col(0) *= -1;
    joints[k].body = {links[k].mass, c, Eigen::Quaterniond(axes), eigen.eigenvalues()};
  }
  return {joints, names, nq, vector_of(robot.gravity)};
}

// --- robots

inline BodyParameters random_parameters(Random& random, int parent, JointType joint) {
  BodyParameters out;
  out.name = "body";
  out.parent = parent;
  out.joint = joint;
  const Vector axis = random.vector3(), position = 0.3 * random.vector3();
  out.axis = plain(axis);
  out.position = plain(position);
  out.rotation = plain(random.quaternion());
  out.reference = random.uniform(-1, 1);
  if (random.chance(0.4)) out.armature = random.uniform(0.01, 0.1);
  const RigidBody<double> body = random_body(random);
  const Matrix E = body.axes.normalized().toRotationMatrix();
  const Matrix I = E * body.moments.asDiagonal() * E.transpose();
  out.mass = body.mass;
  out.center_of_mass = plain(body.com);
  out.inertia = {I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2), I(1, 2)};
  return out;
}

// Joints of all types on branches, with bodies that are fixed to each other and to the base between
// them.
inline Robot everything_by_hand(std::uint64_t seed) {
  Random random(seed);
  Robot robot;
  const JointType types[] = {JointType::hinge, JointType::fixed, JointType::slide, JointType::ball,
                             JointType::fixed, JointType::free,  JointType::hinge};
  for (int b = 0; b < 14; ++b) {
    const JointType joint = b == 0 ? JointType::fixed : b == 1 ? JointType::fixed : types[b % 7];
    const int parent = b < 2 ? b - 1 : random.chance(0.1) ? -1 : b - 1 - random.below(2);
    robot.bodies.push_back(random_parameters(random, parent, joint));
  }
  return robot;
}

struct Asked {
  Dynamics<double> robot;
  State<double> state;

  explicit Asked(const Robot& given, std::uint64_t seed = 7)
      : robot(given.build(),
              {.question = {.want = {Want::mass, Want::inverse_dynamics, Want::acceleration}}}) {
    Random random(seed);
    state = {random.vector(robot.nq()), random.vector(robot.nv()), random.vector(robot.nv())};
  }

  MatrixX<double> mass() {
    MatrixX<double> M = poisoned<double>(robot.nv(), robot.nv());
    robot.mass(state.q, M);
    return M;
  }
  VectorX<double> bias() {
    VectorX<double> tau = poisoned<double>(robot.nv());
    robot.bias(state.q, state.qd, tau);
    return tau;
  }
};

inline const std::vector<Vector>& axes() {
  static const std::vector<Vector> all{{1, 0, 0},  {0, 1, 0},    {0, 0, 1},  {-1, 0, 0},
                                       {0, -1, 0}, {0, 0, -1},   {1, 2, -3}, {-0.1, 0.02, -5},
                                       {3, 4, 0},  {1e-9, 0, -1}};
  return all;
}

}  // namespace kalmarm::test
