// Truth of the tests, from the definitions of mechanics: dense Jacobians in world axes, 50 digits.
// All that it shares with the library is the list of joints. Energy and momentum come with it.
//
//   M   = sum over bodies of m Jc'Jc + Jw' I Jw, and diag(r)
//   tau = r a + sum over bodies of Jc' m (Jc a + ac - gravity) + Jw'(I (Jw a + dw) + w x I w)
// ac and dw at q'' = a = 0. So tau = M a + bias, and the bias is tau at a = 0.
// A ball or free joint moves its body at once: there are no massless links here.
#pragma once

#include <Eigen/Cholesky>
#include <vector>

#include "algorithms/model/model.hpp"
#include "algorithms/test/multiprecision.hpp"

namespace kalmarm::test {

using Mp = FixedReal<50>;

struct WorldLink {
  Matrix3<Mp> R = Matrix3<Mp>::Identity();                         // to world axes
  Vector3<Mp> o = Vector3<Mp>::Zero();                             // origin
  Vector3<Mp> w = Vector3<Mp>::Zero(), v = Vector3<Mp>::Zero();    // angular velocity; of o
  Vector3<Mp> dw = Vector3<Mp>::Zero(), dv = Vector3<Mp>::Zero();  // their rates at q'' = 0
  Eigen::Matrix<Mp, 3, Eigen::Dynamic> Jw, Jv;                     // w = Jw q', v = Jv q'
};

// What a body needs: centre of mass, its velocity, its acceleration at q'' = 0, inertia about it,
// all in world axes.
struct WorldBody {
  Vector3<Mp> c, vc, ac;
  Matrix3<Mp> I;
  Eigen::Matrix<Mp, 3, Eigen::Dynamic> Jc;
};

inline Matrix3<Mp> rotate_basis(const Eigen::Quaternion<Mp>& q) {
  Matrix3<Mp> R;
  for (int i = 0; i < 3; ++i) {
    Eigen::Quaternion<Mp> e(0, 0, 0, 0);
    e.vec()[i] = 1;
    R.col(i) = (q * e * q.conjugate()).vec() / q.squaredNorm();
  }
  return R;
}

inline Matrix3<Mp> about_z(const Mp& angle) {
  return Eigen::AngleAxis<Mp>(angle, Vector3<Mp>::UnitZ()).toRotationMatrix();
}

class World {
 public:
  World(const Model<Mp>& model, const VectorX<Mp>& q, const VectorX<Mp>& qd)
      : model_(model), qd_(qd) {
    for (int k = 0; k < model.nv(); ++k) {
      const Joint<Mp>& joint = model.joint(k);
      if (joint.coordinate == Coordinate::follower) {
        links_.push_back(links_.back());
        continue;
      }
      const WorldLink parent = joint.parent < 0 ? fixed_base() : links_[joint.parent];
      const Matrix3<Mp> E = parent.R * rotate_basis(joint.rotation);
      const Vector3<Mp> d = parent.R * joint.translation;
      const int i = joint.q_index;
      switch (joint.coordinate) {
        case Coordinate::angle:
          links_.push_back(carried(parent, d));
          links_.back().R = E * about_z(q[i]) * about_z(-joint.ref);  // their sum may lose ref
          turn(parent.w, E.col(2), k);
          break;
        case Coordinate::distance:
          links_.push_back(carried(parent, d + (q[i] - joint.ref) * E.col(2)));
          links_.back().R = E;
          slide(parent.w, E.col(2), k);
          break;
        case Coordinate::quaternion:
          links_.push_back(carried(parent, d));
          links_.back().R =
              E * rotate_basis(Eigen::Quaternion<Mp>(q[i], q[i + 1], q[i + 2], q[i + 3]));
          turn(parent.w, links_.back().R, k);
          break;
        case Coordinate::position:
          links_.push_back(carried(parent, d + E * q.segment<3>(i)));
          links_.back().R = E;
          slide(parent.w, E, k);
          break;
        case Coordinate::follower:
          break;
      }
    }
    for (int k = 0; k < model.nv(); ++k) bodies_.push_back(body(k));
  }

  const WorldBody& of_body(int k) const { return bodies_[k]; }
  // A frame's motion: at `translation` from the origin of a link, -1 the base, in the link's axes.
  WorldLink frame(int link, const Vector3<Mp>& translation) const {
    const WorldLink on = link < 0 ? fixed_base() : links_[link];
    return carried(on, on.R * translation);
  }

  MatrixX<Mp> mass_matrix() const {
    const int nv = model_.nv();
    MatrixX<Mp> M = MatrixX<Mp>::Zero(nv, nv);
    std::vector<int> movers;  // DoF that move the body: the other columns are zero
    for (int k = 0; k < nv; ++k) {
      M(k, k) += model_.joint(k).r;
      if (model_.joint(k).body.massless()) continue;
      const auto &Jc = bodies_[k].Jc, &Jw = links_[k].Jw;
      movers.clear();
      for (int j = 0; j < nv; ++j)
        if ((Jc.col(j).array() != 0).any() || (Jw.col(j).array() != 0).any()) movers.push_back(j);
      for (const int j : movers) {
        const Vector3<Mp> momentum = model_.joint(k).body.mass * Jc.col(j);
        const Vector3<Mp> spin = bodies_[k].I * Jw.col(j);
        for (const int i : movers)
          if (i >= j) M(i, j) += Jc.col(i).dot(momentum) + Jw.col(i).dot(spin);
      }
    }
    return M.selfadjointView<Eigen::Lower>();
  }

  VectorX<Mp> bias() const { return torque(VectorX<Mp>::Zero(model_.nv())); }

  // tau (nv) of the accelerations a (nv).
  VectorX<Mp> torque(const VectorX<Mp>& a) const {
    VectorX<Mp> tau(model_.nv());
    for (int k = 0; k < model_.nv(); ++k) tau[k] = model_.joint(k).r * a[k];
    for (int k = 0; k < model_.nv(); ++k) {
      const WorldLink& link = links_[k];
      const WorldBody& b = bodies_[k];
      const Vector3<Mp> ac = b.Jc * a + b.ac, dw = link.Jw * a + link.dw;
      const Vector3<Mp> force = model_.joint(k).body.mass * (ac - model_.gravity());
      const Vector3<Mp> moment = b.I * dw + link.w.cross(b.I * link.w);
      tau += b.Jc.transpose() * force + link.Jw.transpose() * moment;
    }
    return tau;
  }

  // Of the bodies and the rotors.
  Mp kinetic_energy() const {
    Mp twice = 0;
    for (int k = 0; k < model_.nv(); ++k) {
      twice += model_.joint(k).body.mass * bodies_[k].vc.squaredNorm();
      twice += links_[k].w.dot(bodies_[k].I * links_[k].w);
      twice += model_.joint(k).r * qd_[k] * qd_[k];
    }
    return twice / 2;
  }

  Mp potential_energy() const {
    Mp energy = 0;
    for (int k = 0; k < model_.nv(); ++k)
      energy -= model_.joint(k).body.mass * model_.gravity().dot(bodies_[k].c);
    return energy;
  }

  // (angular about the world's origin; linear).
  Vector6<Mp> momentum() const {
    Vector6<Mp> sum = Vector6<Mp>::Zero();
    for (int k = 0; k < model_.nv(); ++k) {
      const Vector3<Mp> linear = model_.joint(k).body.mass * bodies_[k].vc;
      sum.head<3>() += bodies_[k].c.cross(linear) + bodies_[k].I * links_[k].w;
      sum.tail<3>() += linear;
    }
    return sum;
  }

 private:
  WorldLink fixed_base() const {
    WorldLink base;
    base.Jw.setZero(3, model_.nv());
    base.Jv.setZero(3, model_.nv());
    return base;
  }

  // The parent's motion at distance d from its origin.
  static WorldLink carried(const WorldLink& parent, const Vector3<Mp>& d) {
    WorldLink link = parent;
    link.o += d;
    link.v += parent.w.cross(d);
    link.dv += parent.dw.cross(d) + parent.w.cross(parent.w.cross(d));
    for (int j = 0; j < link.Jv.cols(); ++j)
      link.Jv.col(j) += Vector3<Mp>(parent.Jw.col(j)).cross(d);
    return link;
  }

  // Turning about the columns of `axes`, which are DoF k, k + 1 …
  template <class Axes>
  void turn(const Vector3<Mp>& w, const Axes& axes, int k) {
    WorldLink& link = links_.back();
    const Vector3<Mp> own = axes * qd_.segment(k, axes.cols());
    link.w += own;
    link.dw += w.cross(own);
    link.Jw.middleCols(k, axes.cols()) = axes;
  }

  // Sliding along them.
  template <class Axes>
  void slide(const Vector3<Mp>& w, const Axes& axes, int k) {
    WorldLink& link = links_.back();
    const Vector3<Mp> own = axes * qd_.segment(k, axes.cols());
    link.v += own;
    link.dv += 2 * w.cross(own);
    link.Jv.middleCols(k, axes.cols()) = axes;
  }

  WorldBody body(int k) const {
    const WorldLink& link = links_[k];
    const RigidBody<Mp>& parameters = model_.joint(k).body;
    const WorldLink at = carried(link, link.R * parameters.com);
    const Matrix3<Mp> axes = link.R * rotate_basis(parameters.axes);
    return {at.o, at.v, at.dv, axes * parameters.moments.asDiagonal() * axes.transpose(), at.Jv};
  }

  const Model<Mp>& model_;
  const VectorX<Mp> qd_;
  std::vector<WorldLink> links_;
  std::vector<WorldBody> bodies_;
};

}  // namespace kalmarm::test
