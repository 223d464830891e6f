// Columns of kinematics by definition, to check those that are timed: of the last link's frame, and of the
// momentum of all bodies, (angular; linear), 6 x nv, in the base's axes; and J of links in their own axes.
#pragma once

#include <vector>

#include "algorithms/model/link_kinematics.hpp"
#include "algorithms/model/site.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm {

class KinematicsCheck {
 public:
  KinematicsCheck(const Model<double>& model, const VectorX<double>& q)
      : model_(model), kin_(model), at_(model.nv()) {
    set_position(model, q, kin_);
    for (int k = 0; k < model.nv(); ++k) {
      const int parent = model.parent(k);
      const Transform<double> of_base{Matrix3<double>::Identity(), Vector3<double>::Zero()};
      const Transform<double>& on = parent < 0 ? of_base : at_[parent];
      at_[k] = {on.R * kin_.phi[k].R, on.p + on.R * kin_.phi[k].p};
    }
  }

  // J of the last link's origin.
  MatrixX<double> frame() const { return jacobian(model_.nv() - 1, Vector3<double>::Zero()); }

  // J of links' frames in their axes.
  MatrixX<double> local(const std::vector<int>& links) const {
    std::vector<Site<double>> sites;
    for (const int link : links) sites.push_back({.link = link});
    MatrixX<double> J(6 * links.size(), model_.nv());
    site_jacobian<double>(model_, kin_, sites, J);
    return J;
  }

  // The centroidal momentum matrix.
  MatrixX<double> momentum() const {
    const int nv = model_.nv();
    MatrixX<double> A = MatrixX<double>::Zero(6, nv);
    Vector3<double> center = Vector3<double>::Zero();
    double mass = 0;
    for (int k = 0; k < nv; ++k) {
      mass += body(k).mass;
      center += body(k).mass * center_of(k);
    }
    center /= mass;
    for (int k = 0; k < nv; ++k) {
      const MatrixX<double> J = jacobian(k, body(k).com);
      const Matrix3<double> I = at_[k].R * model_.inertia(k).I_cm * at_[k].R.transpose();
      A.topRows(3) += I * J.topRows(3) + body(k).mass *
                                             cross_matrix(Vector3<double>(center_of(k) - center)) *
                                             J.bottomRows(3);
      A.bottomRows(3) += body(k).mass * J.bottomRows(3);
    }
    return A;
  }

 private:
  const RigidBody<double>& body(int k) const { return model_.joint(k).body; }
  Vector3<double> center_of(int k) const { return at_[k].p + at_[k].R * body(k).com; }

  MatrixX<double> jacobian(int link, const Vector3<double>& point) const {
    MatrixX<double> J(6, model_.nv());
    site_jacobian<double>(model_, kin_, {Site<double>{.link = link, .translation = point}}, J);
    J.topRows(3) = at_[link].R * J.topRows(3);
    J.bottomRows(3) = at_[link].R * J.bottomRows(3);
    return J;
  }

  const Model<double>& model_;
  LinkKinematics<double> kin_;
  std::vector<Transform<double>> at_;
};

}  // namespace kalmarm
