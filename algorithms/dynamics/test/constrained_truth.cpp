#include "algorithms/dynamics/test/constrained_truth.hpp"

#include <Eigen/LU>

#include "algorithms/fast/test/exact.hpp"
#include "algorithms/model/plain.hpp"

namespace kalmarm::test {
namespace {

using Vector = VectorX<Mp>;

Vector errors(const Model<Mp>& model, const std::vector<Constraint>& constraints, const Vector& q) {
  const World world(model, q, Vector::Zero(model.nv()));
  Vector out(0);
  const auto append = [&](const Vector& e) {
    Vector longer(out.size() + e.size());
    longer << out, e;
    out = longer;
  };
  for (const Constraint& c : constraints) {
    if (c.kind == Constraint::Kind::coupling) {
      Mp length = 0, other = -c.reference, P = 0;
      for (int k = 0; k < model.nv(); ++k) {
        if (c.jacobian[k] != 0) length += c.jacobian[k] * q[model.joint(k).q_index];
        if (!c.other.empty() && c.other[k] != 0) other += c.other[k] * q[model.joint(k).q_index];
      }
      for (int i = 0; i < 5; ++i) {
        Mp power = c.polynomial[i];
        for (int j = 0; j < i; ++j) power *= other;
        P += power;
      }
      append(Vector::Constant(1, length - P));
      continue;
    }
    Vector3<Mp> p[2];
    Eigen::Quaternion<Mp> turns[2];
    for (int i = 0; i < 2; ++i) {
      const Site<Mp> site = site_of(i == 0 ? c.first : c.second).cast<Mp>();
      const WorldLink at = world.frame(site.link, site.translation);
      p[i] = at.o;
      turns[i] = Eigen::Quaternion<Mp>(Matrix3<Mp>(at.R * rotate_basis(site.rotation)));
    }
    if (c.kind == Constraint::Kind::pose) {
      Eigen::Quaternion<Mp> x = turns[1].conjugate() * turns[0];
      if (x.w() < 0) x.coeffs() = -x.coeffs();
      append(2 * Mp(c.turning) * x.vec());
    }
    append(p[0] - p[1]);
  }
  return out;
}

}  // namespace

ConstrainedTruth constrained_truth(const Model<double>& model, const State<double>& given,
                                   const std::vector<Constraint>& constraints, const Push& push) {
  const Model<Mp> wide = model.cast<Mp>();
  const State<Mp> state = given.cast<Mp>();
  const int nv = model.nv();
  const Mp h("1e-12");
  const auto along = [&](const State<Mp>& at, int k, const Mp& by) -> Vector {
    return errors(wide, constraints, moved(wide, at, k, by).q);
  };
  MatrixX<Mp> J(errors(wide, constraints, state.q).size(), nv);
  for (int k = 0; k < nv; ++k) J.col(k) = (along(state, k, h) - along(state, k, -h)) / (2 * h);
  const auto later = [&](State<Mp> at, const Mp& time) {
    for (int k = 0; k < nv; ++k) at = moved(wide, at, k, Mp(time * state.qd[k]));
    return at;
  };
  const auto rate_at = [&](const Mp& time) -> Vector {  // J qd
    const State<Mp> at = later(state, time);
    return (errors(wide, constraints, later(at, h).q) -
            errors(wide, constraints, later(at, -h).q)) /
           (2 * h);
  };
  const Vector e = errors(wide, constraints, state.q), rate = J * state.qd,
               curvature = (rate_at(h) - rate_at(-h)) / (2 * h);
  Vector target = -curvature, R = Vector::Zero(e.size());
  int row = 0;
  for (const Constraint& c : constraints)
    for (int i = 0; i < c.rows(); ++i, ++row) {
      target[row] -= c.damping * rate[row] + c.stiffness * e[row];
      R[row] = c.compliance[c.kind == Constraint::Kind::pose && i < 3 ? 0 : 1];
    }
  const Exact exact(wide, state, push);
  const MatrixX<Mp> X = exact.ldlt.solve(J.transpose());
  MatrixX<Mp> A = J * X;
  A.diagonal() += R;
  const Vector forces = A.fullPivLu().solve(target - J * exact.a), a = exact.a + X * forces;
  return {exact.M.cast<double>(), e.cast<double>(), rate.cast<double>(), a.cast<double>(),
          forces.cast<double>()};
}

}  // namespace kalmarm::test
