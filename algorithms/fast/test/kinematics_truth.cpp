#include "algorithms/fast/test/kinematics_truth.hpp"

#include "algorithms/fast/test/exact.hpp"
#include "algorithms/model/plain.hpp"

namespace kalmarm::test {
namespace {

using Rows3 = Eigen::Matrix<Mp, 3, Eigen::Dynamic>;

// v x each column.
Rows3 crossed(const Vector3<Mp>& v, const Rows3& X) {
  Rows3 out(3, X.cols());
  for (int j = 0; j < X.cols(); ++j) out.col(j) = v.cross(Vector3<Mp>(X.col(j)));
  return out;
}

// J' and J' qd of a frame at `at`, whose axes are R.
void in_axes(Axes axes, const WorldLink& at, const Matrix3<Mp>& R, MatrixX<Mp>& J,
             Vector6<Mp>& bias) {
  switch (axes) {
    case Axes::aligned:
      J << at.Jw, at.Jv;
      bias << at.dw, at.dv;
      return;
    case Axes::local:
      J << R.transpose() * at.Jw, R.transpose() * at.Jv;
      bias << R.transpose() * at.dw, R.transpose() * (at.dv - at.w.cross(at.v));
      return;
    case Axes::world:
      J << at.Jw, at.Jv + crossed(at.o, at.Jw);
      bias << at.dw, at.dv - at.dw.cross(at.o) - at.w.cross(at.v);
      return;
  }
}

// The place of a frame, and R of its axes.
WorldLink place_of(const World& world, const Frame& frame, Matrix3<Mp>& R) {
  const Site<Mp> site = site_of(frame).cast<Mp>();
  const WorldLink at = world.frame(site.link, site.translation);
  R = at.R * rotate_basis(site.rotation);
  return at;
}

}  // namespace

VectorX<Mp> torques_of(const Push& push, const World& world, int nv) {
  VectorX<Mp> out = VectorX<Mp>::Zero(nv);
  MatrixX<Mp> J(6, nv);
  Vector6<Mp> bias;
  Matrix3<Mp> R;
  for (std::size_t i = 0; i < push.frames.size(); ++i) {
    const WorldLink at = place_of(world, push.frames[i], R);
    in_axes(push.axes, at, R, J, bias);
    out += J.transpose() * push.forces.segment<6>(6 * i).cast<Mp>();
  }
  return out;
}

std::array<MatrixX<double>, kinematics> true_kinematics(const Model<double>& model,
                                                        const State<double>& state,
                                                        const std::vector<Frame>& frames,
                                                        Axes axes) {
  const Model<Mp> wide = model.cast<Mp>();
  const VectorX<Mp> qd = state.qd.cast<Mp>(), qdd = state.tau.cast<Mp>();
  const World world(wide, state.q.cast<Mp>(), qd);
  const int nv = model.nv(), F = static_cast<int>(frames.size());
  const auto shapes = kinematic_shapes(nv, F, nv);
  std::array<MatrixX<Mp>, kinematics> out;
  for (int i = 0; i < kinematics; ++i) out[i].setZero(shapes[i].rows, shapes[i].columns);
  const auto result = [&](Kinematic what) -> MatrixX<Mp>& { return out[static_cast<int>(what)]; };
  for (int f = 0; f < F; ++f) {
    Matrix3<Mp> R;
    const WorldLink at = place_of(world, frames[f], R);
    MatrixX<Mp> J(6, nv);
    Vector6<Mp> bias;
    in_axes(axes, at, R, J, bias);
    result(Kinematic::positions).col(f) = at.o;
    result(Kinematic::rotations).middleCols<3>(3 * f) = R;
    Eigen::Quaternion<Mp> q(R);
    if (q.w() < 0) q.coeffs() = -q.coeffs();
    result(Kinematic::quaternions).col(f) << q.w(), q.x(), q.y(), q.z();
    result(Kinematic::jacobians).middleCols<6>(6 * f) = J.transpose();
    result(Kinematic::velocities).col(f) = J * qd;
    result(Kinematic::accelerations).col(f) = J * qdd + bias;
  }
  Mp mass = 0;
  Rows3 of_center = Rows3::Zero(3, nv), angular = of_center;
  Vector3<Mp> center(0, 0, 0), drift(0, 0, 0), angular_drift(0, 0, 0);
  for (int k = 0; k < nv; ++k) {
    const Mp m = wide.joint(k).body.mass;
    mass += m;
    center += m * world.of_body(k).c;
    of_center += m * world.of_body(k).Jc;
    drift += m * world.of_body(k).ac;
  }
  center /= mass;
  for (int k = 0; k < nv; ++k) {
    const WorldBody& body = world.of_body(k);
    const WorldLink link = world.frame(k, Vector3<Mp>::Zero());
    const Mp m = wide.joint(k).body.mass;
    const Vector3<Mp> arm = m * (body.c - center);
    angular += body.I * link.Jw + crossed(arm, body.Jc);
    angular_drift += body.I * link.dw + link.w.cross(body.I * link.w) + arm.cross(body.ac);
  }
  MatrixX<Mp> A(6, nv);
  A << angular, of_center;
  Vector6<Mp> rate;
  rate << angular_drift, drift;
  result(Kinematic::center) = center;
  result(Kinematic::center_velocity) = of_center * qd / mass;
  result(Kinematic::center_acceleration) = (of_center * qdd + drift) / mass;
  result(Kinematic::center_jacobian) = of_center.transpose() / mass;
  result(Kinematic::momentum) = A * qd;
  result(Kinematic::momentum_rate) = A * qdd + rate;
  result(Kinematic::momentum_matrix) = A.transpose();
  result(Kinematic::kinetic_energy)(0, 0) = world.kinetic_energy();
  result(Kinematic::potential_energy)(0, 0) = world.potential_energy();
  std::array<MatrixX<double>, kinematics> rounded;
  for (int i = 0; i < kinematics; ++i) rounded[i] = out[i].cast<double>();
  return rounded;
}

MatrixX<double> mass_rate(const Model<double>& model, const State<double>& state) {
  const Model<Mp> wide = model.cast<Mp>();
  const State<Mp> at = state.cast<Mp>();
  const Mp h("1e-12");
  const auto mass = [&](const Mp& time) {
    State<Mp> later = at;
    for (int k = 0; k < model.nv(); ++k) later = moved(wide, later, k, Mp(time * at.qd[k]));
    return World(wide, later.q, later.qd).mass_matrix();
  };
  return MatrixX<Mp>((mass(h) - mass(-h)) / (2 * h)).cast<double>();
}

}  // namespace kalmarm::test
