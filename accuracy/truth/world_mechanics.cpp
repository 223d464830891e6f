#include "accuracy/truth/world_mechanics.hpp"

namespace kalmarm {
namespace {

template <class S>
Vector3<S> rotate(const Eigen::Quaternion<S>& Q, const Vector3<S>& x) {  // Q x Q* / |Q|^2
  const Eigen::Quaternion<S> y = Q * Eigen::Quaternion<S>(S(0), x[0], x[1], x[2]) * Q.conjugate();
  return y.vec() / Q.squaredNorm();
}

template <class S>
struct Motion {
  Vector3<S> w0 = Vector3<S>::Zero(), w = w0, al = w0, a = w0;
};

template <class S>
struct Wrench {  // of a link, then of all outboard
  Vector3<S> F = Vector3<S>::Zero(), N = F;
};

template <class S>
struct Composite {  // of a link, then of all outboard
  S m = S(0);
  Vector3<S> h = Vector3<S>::Zero();
  Matrix3<S> J = Matrix3<S>::Zero();
};

}  // namespace

Orientation<Ball> Orientation<Ball>::turned(const Eigen::Quaternion<Ball>& q) const {
  const Eigen::Quaternion<Ball> product = C * q;
  Orientation out;
  Ball radii = 0;  // squared
  for (int i = 0; i < 4; ++i) {
    const Ball e = radius(product.coeffs()[i]);
    out.C.coeffs()[i] = centre(product.coeffs()[i]);
    radii += e * e;
  }
  const Ball length = out.C.norm(), d = sqrt(radii) / length;
  out.s = upper_end(s * (Ball(1) + d) + d);
  for (int i = 0; i < 4; ++i) out.Q.coeffs()[i] = widened(out.C.coeffs()[i], out.s * length);
  return out;
}

template <class S>
WorldMechanics<S>::WorldMechanics(const Model<S>& model, const VectorX<S>& q)
    : model_(model), poses_(model.nv()) {
  using Quaternion = Eigen::Quaternion<S>;
  const Quaternion next_axis(S(1), S(1), S(1), S(1));  // x -> y -> z -> x
  const Pose base;
  for (int k = 0; k < model.nv(); ++k) {
    const Joint<S>& joint = model.joint(k);
    const Pose& parent = joint.parent < 0 ? base : poses_[joint.parent];
    Pose& link = poses_[k];
    const Orientation<S>& inboard = parent.orientation;
    const int i = joint.q_index;
    link.p = parent.p + rotate(inboard.Q, joint.translation);
    Quaternion turn(S(1), S(0), S(0), S(0));
    switch (joint.coordinate) {
      case Coordinate::angle: {
        const S half = (q[i] - joint.ref) / S(2);
        turn = Quaternion(cos(half), S(0), S(0), sin(half));
        break;
      }
      case Coordinate::distance:
        link.p += rotate<S>(inboard.Q * joint.rotation, {S(0), S(0), q[i] - joint.ref});
        break;
      case Coordinate::quaternion:
        turn = Quaternion(q[i], q[i + 1], q[i + 2], q[i + 3]) * next_axis;
        break;
      case Coordinate::position:
        turn = next_axis;
        link.p += rotate<S>(inboard.Q * joint.rotation, q.template segment<3>(i));
        break;
      case Coordinate::follower:
        turn = next_axis;
        link.p = parent.p;
        break;
    }
    const bool follows = joint.coordinate == Coordinate::follower;
    link.orientation = inboard.turned(follows ? turn : joint.rotation * turn);
    const Quaternion& Q = link.orientation.Q;
    link.z = rotate<S>(Q, Vector3<S>::UnitZ());
    const RigidBody<S>& body = joint.body;
    if (body.massless()) continue;
    link.c = rotate(Q, body.com);
    const Quaternion B = Q * body.axes;
    for (int j = 0; j < 3; ++j)
      link.I.col(j) =
          rotate<S>(B, body.moments.cwiseProduct(rotate<S>(B.conjugate(), Vector3<S>::Unit(j))));
  }
}

template <class S>
Vector3<S> WorldMechanics<S>::turn(int k) const {
  return model_.joint(k).slides ? Vector3<S>(Vector3<S>::Zero()) : poses_[k].z;
}

template <class S>
Vector3<S> WorldMechanics<S>::shift(int k) const {
  const Pose& link = poses_[k];
  return model_.joint(k).slides ? link.z : Vector3<S>(link.p.cross(link.z));
}

template <class S>
VectorX<S> WorldMechanics<S>::torque(const VectorX<S>& qd, const VectorX<S>& qdd,
                                     const Vector3<S>& gravity) const {
  const int nv = model_.nv();
  std::vector<Motion<S>> motions(nv);
  std::vector<Wrench<S>> wrenches(nv);
  const Pose base_pose;
  Motion<S> base;
  base.a = -gravity;
  for (int k = 0; k < nv; ++k) {
    const Joint<S>& joint = model_.joint(k);
    const Pose& pose = poses_[k];
    const Motion<S>& parent = joint.parent < 0 ? base : motions[joint.parent];
    Motion<S>& link = motions[k];

    // (1), (2)
    const Vector3<S> d = pose.p - (joint.parent < 0 ? base_pose : poses_[joint.parent]).p;
    link.w0 = joint.coordinate == Coordinate::follower ? parent.w0 : parent.w;
    link.w = parent.w;
    link.al = parent.al;
    link.a = parent.a + parent.al.cross(d) + parent.w.cross(parent.w.cross(d));
    if (joint.slides) {
      link.a += S(2) * qd[k] * parent.w.cross(pose.z) + qdd[k] * pose.z;
    } else {
      link.w += qd[k] * pose.z;
      link.al += qd[k] * link.w0.cross(pose.z) + qdd[k] * pose.z;
    }

    // (3)
    if (joint.body.massless()) continue;
    const RigidBody<S>& body = joint.body;
    const Vector3<S>& c = pose.c;
    const Vector3<S> f = body.mass * (link.a + link.al.cross(c) + link.w.cross(link.w.cross(c)));
    wrenches[k] = {
        f, pose.I * link.al + link.w.cross(Vector3<S>(pose.I * link.w)) + (pose.p + c).cross(f)};
  }

  // (4)
  VectorX<S> tau(nv);
  for (int k = nv - 1; k >= 0; --k) {
    const Joint<S>& joint = model_.joint(k);
    tau[k] = turn(k).dot(wrenches[k].N) + shift(k).dot(wrenches[k].F) + joint.r * qdd[k];
    if (joint.parent < 0) continue;
    wrenches[joint.parent].F += wrenches[k].F;
    wrenches[joint.parent].N += wrenches[k].N;
  }
  return tau;
}

template <class S>
MatrixX<S> WorldMechanics<S>::mass() const {
  const int nv = model_.nv();
  std::vector<Vector3<S>> w(nv), v(nv);
  std::vector<Composite<S>> sides(nv);
  for (int k = 0; k < nv; ++k) {
    const RigidBody<S>& body = model_.joint(k).body;
    const Pose& pose = poses_[k];
    w[k] = turn(k);
    v[k] = shift(k);
    if (body.massless()) continue;
    const Vector3<S> r = pose.p + pose.c;
    Composite<S>& link = sides[k];
    link.m = body.mass;
    link.h = body.mass * r;
    link.J = pose.I;
    link.J.diagonal().array() += body.mass * r.squaredNorm();
    link.J -= body.mass * r * r.transpose();
  }

  MatrixX<S> M = MatrixX<S>::Zero(nv, nv);
  for (int j = nv - 1; j >= 0; --j) {
    const Composite<S>& side = sides[j];
    const Vector3<S> l = side.m * v[j] + w[j].cross(side.h);
    const Vector3<S> L = side.J * w[j] + side.h.cross(v[j]);
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

template class WorldMechanics<Real>;
template class WorldMechanics<Ball>;

}  // namespace kalmarm
