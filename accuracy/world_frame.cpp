#include "accuracy/world_frame.hpp"

#include <vector>

namespace kalmarm {
namespace {

using Quaternion = Eigen::Quaternion<Real>;
using Vector = Vector3<Real>;

Vector rotate(const Quaternion& Q, const Vector& x) {  // Q x Q* / |Q|^2
  const Quaternion y = Q * Quaternion(Real(0), x[0], x[1], x[2]) * Q.conjugate();
  return y.vec() / Q.squaredNorm();
}

// I x of a body whose principal axes stand as B in the world.
Vector rotational_inertia(const RigidBody<Real>& body, const Quaternion& B, const Vector& x) {
  return rotate(B, body.moments.cwiseProduct(rotate(B.conjugate(), x)));
}

struct Link {
  Quaternion Q{Real(1), Real(0), Real(0), Real(0)};
  Vector p = Vector::Zero(), z = Vector::Zero();
  Vector w0 = Vector::Zero(), w = Vector::Zero(), al = Vector::Zero(), a = Vector::Zero();
  Vector F = Vector::Zero(), N = Vector::Zero();  // of the link, then of all outboard
  Real m = 0;
  Vector h = Vector::Zero();
  Matrix3<Real> J = Matrix3<Real>::Zero();
};

// Q and p.
void set_pose(const Joint<Real>& joint, const VectorX<Real>& q, const Link& parent, Link& link) {
  const Quaternion placed = parent.Q * joint.rotation;
  const Quaternion next_axis(Real(1), Real(1), Real(1), Real(1));  // x -> y -> z -> x
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
}

// (1), (2)
void set_motion(const Joint<Real>& joint, const Real& qd, const Link& parent, Link& link) {
  const Vector d = link.p - parent.p;
  link.z = rotate(link.Q, Vector(Real(0), Real(0), Real(1)));
  link.w0 = joint.coordinate == Coordinate::follower ? parent.w0 : parent.w;
  link.w = parent.w;
  link.al = parent.al;
  link.a = parent.a + parent.al.cross(d) + parent.w.cross(parent.w.cross(d));
  if (joint.slides) {
    link.a += 2 * qd * parent.w.cross(link.z);
  } else {
    link.w += qd * link.z;
    link.al += qd * link.w0.cross(link.z);
  }
}

// (3), and m, h, J of the link alone
void set_inertia(const RigidBody<Real>& body, Link& link) {
  const Quaternion B = link.Q * body.axes;
  const Vector c = rotate(link.Q, body.com), r = link.p + c;
  const Vector f = body.mass * (link.a + link.al.cross(c) + link.w.cross(link.w.cross(c)));
  link.F = f;
  link.N = rotational_inertia(body, B, link.al) +
           link.w.cross(rotational_inertia(body, B, link.w)) + r.cross(f);
  link.m = body.mass;
  link.h = body.mass * r;
  for (int i = 0; i < 3; ++i) link.J.col(i) = rotational_inertia(body, B, Vector::Unit(i));
  link.J.diagonal().array() += body.mass * r.squaredNorm();
  link.J -= body.mass * r * r.transpose();
}

}  // namespace

WorldFrame world_frame(const Model<Real>& model, const VectorX<Real>& q, const VectorX<Real>& qd) {
  const int nv = model.nv();
  Link base;
  base.a = -model.gravity();
  std::vector<Link> links(nv);
  for (int k = 0; k < nv; ++k) {
    const Joint<Real>& joint = model.joint(k);
    const Link& parent = joint.parent < 0 ? base : links[joint.parent];
    set_pose(joint, q, parent, links[k]);
    set_motion(joint, qd[k], parent, links[k]);
    set_inertia(joint.body, links[k]);
  }

  // w and v of a unit rate
  std::vector<Vector> w(nv), v(nv);
  for (int k = 0; k < nv; ++k) {
    const Link& link = links[k];
    const bool slides = model.joint(k).slides;
    w[k] = slides ? Vector(Vector::Zero()) : link.z;
    v[k] = slides ? link.z : Vector(link.p.cross(link.z));
  }

  WorldFrame out{MatrixX<Real>::Zero(nv, nv), VectorX<Real>(nv)};
  for (int j = nv - 1; j >= 0; --j) {
    const Link& link = links[j];
    out.bias[j] = w[j].dot(link.N) + v[j].dot(link.F);  // (4)
    const Vector l = link.m * v[j] + w[j].cross(link.h);
    const Vector L = link.J * w[j] + link.h.cross(v[j]);
    for (int i = j; i >= 0; i = model.parent(i))
      out.M(i, j) = out.M(j, i) = w[i].dot(L) + v[i].dot(l);  // (5)
    out.M(j, j) += model.joint(j).r;
    if (const int p = model.parent(j); p >= 0) {
      links[p].F += link.F;
      links[p].N += link.N;
      links[p].m += link.m;
      links[p].h += link.h;
      links[p].J += link.J;
    }
  }
  return out;
}

}  // namespace kalmarm
