// Planar and translational mechanisms against truth of the world frame in three dimensions: every
// answer, in float and double; which mechanisms they are; and their promises: flops, outcomes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "algorithms/planar/planar_solver.hpp"
#include "algorithms/planar/test/support.hpp"
#include "algorithms/planar/translational_solver.hpp"

namespace kalmarm::test {
namespace {

template <class T>
MatrixX<T> poisoned_matrix(int rows, int columns) {
  return MatrixX<T>::Constant(rows, columns, std::numeric_limits<T>::quiet_NaN());
}

// Two DoF, and sites on the base, on the last link and on another.
template <class T>
Selection<T> some_selection(const Model<double>& model) {
  Random random(9);
  Selection<double> selection;
  selection.dofs = {model.nv() - 1, model.nv() / 2};
  for (const int link : {-1, model.nv() - 1, model.nv() / 3})
    selection.sites.push_back({link, random.quaternion(), 0.3 * random.vector3()});
  Selection<T> out{selection.dofs, {}};
  for (const Site<double>& site : selection.sites) out.sites.push_back(site.cast<T>());
  return out;
}

MatrixX<Mp> columns_of(const Selection<Mp>& selection, const Model<Mp>& model,
                       const VectorX<Mp>& q) {
  RandomModel<Mp> rm(model);
  set_position(model, q, rm);
  const int dofs = static_cast<int>(selection.dofs.size());
  MatrixX<Mp> J(6 * selection.sites.size(), model.nv());
  site_jacobian(model, rm, selection.sites, Eigen::Ref<MatrixX<Mp>>(J));
  MatrixX<Mp> B = MatrixX<Mp>::Zero(model.nv(), selection.size());
  for (int j = 0; j < dofs; ++j) B(selection.dofs[j], j) = 1;
  B.rightCols(J.rows()) = J.transpose();
  return B;
}

// Largest |X - exact| / sqrt(diagonal diagonal) of entries i, j that move. What cannot move is zero.
template <class T>
double error(const MatrixX<T>& X, const MatrixX<Mp>& exact) {
  Mp worst = 0;
  for (int i = 0; i < X.rows(); ++i)
    for (int j = 0; j < X.cols(); ++j) {
      const Mp size = sqrt(Mp(exact(i, i) * exact(j, j)));
      const Mp d = abs(Mp(Mp(X(i, j)) - exact(i, j)));
      const Mp relative = size == 0 ? d : Mp(d / size);
      if (!(relative <= worst)) worst = relative;
    }
  return worst.convert_to<double>();
}

// Errors of every answer in units of the roundoff.
struct Errors {
  double acceleration = 0, solve = 0, inverse = 0, diagonal = 0, log_det = 0, selected = 0;

  double worst() const {
    return std::max({acceleration, solve, inverse, diagonal, log_det, selected});
  }
};

template <class T, class PartialSolverOf>
Errors errors(const Model<double>& drawn, std::uint64_t seed) {
  const Model<T> model = drawn.cast<T>();
  const int nv = model.nv();
  const State<T> state = random_state(drawn, seed + 1000).template cast<T>();
  const Model<Mp> exact = model.template cast<Mp>();
  const Truth truth(exact, state.template cast<Mp>());
  const MatrixX<Mp> inverse =
      Eigen::LDLT<MatrixX<Mp>>(truth.M).solve(MatrixX<Mp>::Identity(nv, nv));
  const double u = static_cast<double>(unit_roundoff<T>());
  PartialSolverOf solver(model);
  Errors out;

  VectorX<T> a = poisoned<T>(nv), x = a, diagonal = a;
  EXPECT_TRUE(solver.acceleration(state.q, state.qd, state.tau, a));
  out.acceleration = truth.error(a) / u;

  EXPECT_TRUE(solver.factor(state.q));
  solver.solve(state.tau, x);
  const VectorX<Mp> tau = state.tau.template cast<Mp>(), solved = inverse * tau;
  const VectorX<Mp> d = x.template cast<Mp>() - solved;
  out.solve = Mp(sqrt(Mp(d.dot(truth.M * d) / solved.dot(tau)))).convert_to<double>() / u;

  MatrixX<T> X = poisoned_matrix<T>(nv, nv);
  EXPECT_TRUE(solver.inverse(state.q, X));
  EXPECT_TRUE(X == X.transpose());
  out.inverse = error(X, inverse) / u;

  EXPECT_TRUE(solver.diagonal(state.q, diagonal));
  for (int k = 0; k < nv; ++k) {
    const Mp relative = abs(Mp(Mp(diagonal[k]) / inverse(k, k) - 1));
    out.diagonal = std::max(out.diagonal, relative.convert_to<double>() / u);
  }

  T log_det = std::numeric_limits<T>::quiet_NaN();
  EXPECT_TRUE(solver.log_det(state.q, log_det));
  Mp exact_log_det = 0, size = 1;
  const VectorX<Mp> D = Eigen::LLT<MatrixX<Mp>>(truth.M).matrixLLT().diagonal();
  for (int k = 0; k < nv; ++k) {
    exact_log_det += 2 * log(D[k]);
    size += abs(Mp(2 * log(D[k])));
  }
  out.log_det = Mp(abs(Mp(Mp(log_det) - exact_log_det)) / size).convert_to<double>() / u;

  const Selection<T> selection = some_selection<T>(drawn);
  Selection<Mp> selection_mp{selection.dofs, {}};
  for (const Site<T>& site : selection.sites)
    selection_mp.sites.push_back(site.template cast<Mp>());
  const MatrixX<Mp> B = columns_of(selection_mp, exact, state.q.template cast<Mp>());
  solver.select(selection);
  MatrixX<T> S = poisoned_matrix<T>(selection.size(), selection.size());
  EXPECT_TRUE(solver.selected(state.q, S));
  EXPECT_TRUE(S == S.transpose());
  out.selected = error(S, MatrixX<Mp>(B.transpose() * inverse * B)) / u;
  return out;
}

template <class T, template <class> class SolverOf>
void expect_accurate(const std::vector<Family>& families, int seeds, double bound) {
  for (const Family& family : families) {
    Errors worst;
    for (int seed = 0; seed < seeds; ++seed) {
      SCOPED_TRACE(std::string(family.name) + " seed " + std::to_string(seed));
      const Errors e = errors<T, SolverOf<T>>(family.make(seed), seed);
      for (const auto& part : {&Errors::acceleration, &Errors::solve, &Errors::inverse,
                               &Errors::diagonal, &Errors::log_det, &Errors::selected}) {
        EXPECT_LE(e.*part, bound);
        worst.*part = std::max(worst.*part, e.*part);
      }
    }
    testing::Test::RecordProperty(
        family.name, std::to_string(worst.acceleration) + " " + std::to_string(worst.solve) + " " +
                         std::to_string(worst.inverse) + " " + std::to_string(worst.diagonal) +
                         " " + std::to_string(worst.log_det) + " " +
                         std::to_string(worst.selected));
  }
}

template <class T>
class Planar_ : public testing::Test {};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Planar_, Precisions, PrecisionName);

TYPED_TEST(Planar_, EveryAnswerAgreesWithTruth) {
  expect_accurate<TypeParam, PlanarSolver>(planar_families(), 10, 60);
}

TYPED_TEST(Planar_, EveryTranslationalAnswerAgreesWithTruth) {
  expect_accurate<TypeParam, TranslationalSolver>(translational_families(), 10, 60);
}

}  // namespace
}  // namespace kalmarm::test
