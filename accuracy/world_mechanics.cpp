#include "accuracy/world_mechanics.hpp"

namespace kalmarm {
namespace {

using Quaternion = Eigen::Quaternion<Real>;
using Vector = Vector3<Real>;

Vector rotate(const Quaternion& Q, const Vector& x) {  // Q x Q* / |Q|^2
  const Quaternion y = Q * Quaternion(Real(0), x[0], x[1], x[2]) * Q.conjugate();
  return y.vec() / Q.squaredNorm();
}

struct Motion {
  Vector w0 = Vector::Zero(), w = Vector::Zero(), al = Vector::Zero(), a = Vector::Zero();
};

struct Wrench {  // of a link, then of all outboard
  Vector F = Vector::Zero(), N = Vector::Zero();
};

struct Composite {  // of a link, then of all outboard
  Real m = 0;
  Vector h = Vector::Zero();
  Matrix3<Real> J = Matrix3<Real>::Zero();
};

}  // namespace

WorldMechanics::WorldMechanics(const Model<Real>& model, const VectorX<Real>& q)
    : model_(model), poses_(model.nv()) {
  const Quaternion next_axis(Real(1), Real(1), Real(1), Real(1));  // x -> y -> z -> x
  const Pose base;
  for (int k = 0; k < model.nv(); ++k) {
    const Joint<Real>& joint = model.joint(k);
    const Pose& parent = joint.parent < 0 ? base : poses_[joint.parent];
    Pose& link = poses_[k];
    const Quaternion placed = parent.Q * joint.rotation;
    const int i = joint.q_index;
    link.p = parent.p + rotate(parent.Q, joint.translation);
    switch (joint.coordinate) {
      case Coordinate::angle: {
        const Real half = (q[i] - joint.ref) / 2;
        link.Q = placed * Quaternion(cos(half), Real(0), Real(0), sin(half));
        break;
      }
      case Coordinate::distance:
        link.Q = placed;
        link.p += rotate(placed, Vector(Real(0), Real(0), q[i] - joint.ref));
        break;
      case Coordinate::quaternion:
        link.Q = placed * Quaternion(q[i], q[i + 1], q[i + 2], q[i + 3]) * next_axis;
        break;
      case Coordinate::position:
        link.Q = placed * next_axis;
        link.p += rotate(placed, q.segment<3>(i));
        break;
      case Coordinate::follower:
        link.Q = parent.Q * next_axis;
        link.p = parent.p;
        break;
    }
    link.z = rotate(link.Q, Vector(Real(0), Real(0), Real(1)));
    const RigidBody<Real>& body = joint.body;
    if (body.massless()) continue;
    link.c = rotate(link.Q, body.com);
    const Quaternion B = link.Q * body.axes;
    for (int j = 0; j < 3; ++j)
      link.I.col(j) = rotate(B, body.moments.cwiseProduct(rotate(B.conjugate(), Vector::Unit(j))));
  }
}

Vector WorldMechanics::turn(int k) const {
  return model_.joint(k).slides ? Vector(Vector::Zero()) : poses_[k].z;
}

Vector WorldMechanics::shift(int k) const {
  const Pose& link = poses_[k];
  return model_.joint(k).slides ? link.z : Vector(link.p.cross(link.z));
}

VectorX<Real> WorldMechanics::torque(const VectorX<Real>& qd, const VectorX<Real>& qdd,
                                     const Vector& gravity) const {
  const int nv = model_.nv();
  std::vector<Motion> motions(nv);
  std::vector<Wrench> wrenches(nv);
  const Pose base_pose;
  Motion base;
  base.a = -gravity;
  for (int k = 0; k < nv; ++k) {
    const Joint<Real>& joint = model_.joint(k);
    const Pose& pose = poses_[k];
    const Motion& parent = joint.parent < 0 ? base : motions[joint.parent];
    Motion& link = motions[k];

    // (1), (2)
    const Vector d = pose.p - (joint.parent < 0 ? base_pose : poses_[joint.parent]).p;
    link.w0 = joint.coordinate == Coordinate::follower ? parent.w0 : parent.w;
    link.w = parent.w;
    link.al = parent.al;
    link.a = parent.a + parent.al.cross(d) + parent.w.cross(parent.w.cross(d));
    if (joint.slides) {
      link.a += 2 * qd[k] * parent.w.cross(pose.z) + qdd[k] * pose.z;
    } else {
      link.w += qd[k] * pose.z;
      link.al += qd[k] * link.w0.cross(pose.z) + qdd[k] * pose.z;
    }

    // (3)
    if (joint.body.massless()) continue;
    const RigidBody<Real>& body = joint.body;
    const Vector& c = pose.c;
    const Vector f = body.mass * (link.a + link.al.cross(c) + link.w.cross(link.w.cross(c)));
    wrenches[k] = {
        f, pose.I * link.al + link.w.cross(Vector(pose.I * link.w)) + (pose.p + c).cross(f)};
  }

  // (4)
  VectorX<Real> tau(nv);
  for (int k = nv - 1; k >= 0; --k) {
    const Joint<Real>& joint = model_.joint(k);
    tau[k] = turn(k).dot(wrenches[k].N) + shift(k).dot(wrenches[k].F) + joint.r * qdd[k];
    if (joint.parent < 0) continue;
    wrenches[joint.parent].F += wrenches[k].F;
    wrenches[joint.parent].N += wrenches[k].N;
  }
  return tau;
}

MatrixX<Real> WorldMechanics::mass() const {
  const int nv = model_.nv();
  std::vector<Vector> w(nv), v(nv);
  std::vector<Composite> sides(nv);
  for (int k = 0; k < nv; ++k) {
    const RigidBody<Real>& body = model_.joint(k).body;
    const Pose& pose = poses_[k];
    w[k] = turn(k);
    v[k] = shift(k);
    if (body.massless()) continue;
    const Vector r = pose.p + pose.c;
    Composite& link = sides[k];
    link.m = body.mass;
    link.h = body.mass * r;
    link.J = pose.I;
    link.J.diagonal().array() += body.mass * r.squaredNorm();
    link.J -= body.mass * r * r.transpose();
  }

  MatrixX<Real> M = MatrixX<Real>::Zero(nv, nv);
  for (int j = nv - 1; j >= 0; --j) {
    const Composite& side = sides[j];
    const Vector l = side.m * v[j] + w[j].cross(side.h);
    const Vector L = side.J * w[j] + side.h.cross(v[j]);
    for (int i = j; i >= 0; i = model_.parent(i))
      M(i, j) = M(j, i) = w[i].dot(L) + v[i].dot(l);  // (5)
    M(j, j) += model_.joint(j).r;
    if (const int p = model_.parent(j); p >= 0) {
      sides[p].m += side.m;
      sides[p].h += side.h;
      sides[p].J += side.J;
    }
  }
  return M;
}

}  // namespace kalmarm
