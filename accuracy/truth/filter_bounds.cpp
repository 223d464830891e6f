#include "accuracy/truth/filter_bounds.hpp"

#include <vector>

namespace kalmarm {
namespace {

enum class Side { below, above };

// (4)
void make_bound(Matrix6<Ball>& P, Side side) {
  Vector6<Ball> margin = Vector6<Ball>::Zero();
  for (int j = 0; j < 6; ++j)
    for (int i = 0; i < 6; ++i) {
      margin[i] += radius(P(i, j));
      P(i, j) = centre(P(i, j));
    }
  for (int i = 0; i < 6; ++i)
    P(i, i) = side == Side::below ? lower_end(P(i, i) - margin[i]) : upper_end(P(i, i) + margin[i]);
}

// visit(k, P, D) for every link, tips first. False where a D is not positive for certain.
template <class Visit>
bool filter(const Model<Ball>& model, const LinkKinematics<Ball>& kin, const VectorX<Ball>& theta,
            Side side, const Visit& visit) {
  const int nv = model.nv();
  std::vector<Matrix6<Ball>> inertias(nv);
  for (int k = 0; k < nv; ++k) inertias[k] = model.M(k).matrix();
  for (int k = nv - 1; k >= 0; --k) {
    Matrix6<Ball>& P = inertias[k];
    make_bound(P, side);
    const int axis = model.joint(k).axis(), parent = model.parent(k);
    const Vector6<Ball> PH = P.col(axis);
    const Ball D = PH[axis] + model.joint(k).r - theta[k];
    if (!(D > Ball(0))) return false;
    visit(k, P, D);
    if (parent >= 0) {
      const Vector6<Ball> g = PH / D;
      for (int j = 0; j < 6; ++j)
        for (int i = 0; i <= j; ++i) P(i, j) = P(j, i) = P(i, j) - g[i] * PH[j];  // (2)
      inertias[parent] += kin.phi[k].congruence(P);                               // (1)
    }
  }
  return true;
}

}  // namespace

std::optional<FactorBalls> factor_balls(const Model<Ball>& model, const LinkKinematics<Ball>& kin) {
  const int nv = model.nv();
  const VectorX<Ball> zero = VectorX<Ball>::Zero(nv);
  FactorBalls out{VectorX<Ball>(nv), MatrixX<Ball>(6, nv)};
  MatrixX<Ball> diagonals(6, nv);
  const bool definite =
      filter(model, kin, zero, Side::below, [&](int k, const Matrix6<Ball>& P, const Ball& D) {
        out.D[k] = D;
        out.g.col(k) = P.col(model.joint(k).axis());
        diagonals.col(k) = P.diagonal();
      });
  if (!definite) return {};
  filter(model, kin, zero, Side::above, [&](int k, const Matrix6<Ball>& P, const Ball& D) {
    const Vector6<Ball> W = P.diagonal() - diagonals.col(k);
    out.D[k] = hull(out.D[k], D);
    const Ball& W_hh = W[model.joint(k).axis()];
    for (int c = 0; c < 6; ++c)
      out.g(c, k) = widened(out.g(c, k), sqrt(upper_end(W[c] * W_hh))) / out.D[k];  // (6)
  });
  return out;
}

bool exceeds(const Model<Ball>& model, const LinkKinematics<Ball>& kin,
             const VectorX<Ball>& theta) {
  return filter(model, kin, theta, Side::below, [](int, const Matrix6<Ball>&, const Ball&) {});
}

}  // namespace kalmarm
