// Section 5: covariance analysis. Truth is the sigma points' second moments, sent through process,
// filter and smoother, and phi* H* M^-1 H phi, the covariance of the co-states with M^-1 by
// elimination.
#pragma once

#include "accuracy/paper/rows.hpp"
#include "accuracy/paper/section_2.hpp"
#include "accuracy/paper/setting.hpp"
#include "algorithms/study/estimation/covariance_analysis.hpp"

namespace kalmarm {

// Beyond the paper: the blocks (i,j) of A* Lambda A for joints on different branches, with the
// deepest common joint c in the middle and A = psi(c-,.+): zero on a chain.
template <class T>
MatrixX<T> across_branches(const Setting<T>& s) {
  MatrixX<T> out = MatrixX<T>::Zero(6 * s.n(), 6 * s.n());
  const auto psi = [&](int k, int m) {
    return Matrix6<T>(s.loop.Psi.template block<6, 6>(6 * k, 6 * m));
  };
  const auto inboard = [&](int m, int k) {  // k on the way from m to the base
    while (m > k) m = s.process.parent[m];
    return m == k;
  };
  for (int i = 0; i < s.n(); ++i)
    for (int j = 0; j < i; ++j) {
      if (inboard(i, j)) continue;
      int c = s.process.parent[j];
      while (c >= 0 && !inboard(i, c)) c = s.process.parent[c];
      if (c < 0) continue;
      const Matrix6<T> block = psi(c, i).transpose() * s.cov.L_minus[c] * psi(c, j);
      out.template block<6, 6>(6 * i, 6 * j) = block;
      out.template block<6, 6>(6 * j, 6 * i) = block.transpose();
    }
  return out;
}

template <class T>
void section_5(const Setting<T>& s, Rows& rows) {
  rows.section("5");
  const auto& op = s.op;
  const auto& loop = s.loop;
  const auto& sigma = s.sigma;
  const MatrixX<T> Psi_t = loop.Psi.transpose();

  const MatrixX<T> tau_tau = sigma.tau * sigma.tau.transpose();
  const VectorX<T> mean = op.H * (op.phi * op.b);
  rows.erratum(
      {"(5.1)", "Result 5.1", "M = E(TT*) = HRH*", "M = E[(T − Hφb)(T − Hφb)*] = HRH*",
       "M is the covariance of T; the second moment contains the mean too. True as printed "
       "for b = 0."},
      residual(MatrixX<T>(tau_tau + mean * mean.transpose()), s.M),
      worst({residual(tau_tau, s.M), residual(op.M, s.M)}));

  const MatrixX<T> error = sigma.X - sigma.Z_minus, P = error * error.transpose();
  const auto one_psi = [&](const MatrixX<T>& A) {
    return residual(MatrixX<T>(A + loop.Psi * A + A * Psi_t), P);
  };
  const MatrixX<T> Psi_P = loop.Psi * loop.P_plus;
  MatrixX<T> by_recursion;
  state_error_covariance(s.process, s.cov, by_recursion);
  rows.erratum(
      {"(5.2)", "Result 5.2", "E[(X − Z)(X − Z)*] = P + ΨP + PΨ*",
       "E[(X − Z)(X − Z)*] = P⁻ + ΨP⁺ + P⁺Ψ*",
       "Off the diagonal the error starts on the + side of a joint, after its measurement. "
       "P⁻ throughout needs another Ψ, from the − to the − side."},
      best({one_psi(loop.P_minus), one_psi(loop.P_plus)}),
      worst({residual(MatrixX<T>(loop.P_minus + Psi_P + Psi_P.transpose()), P),
             residual(by_recursion, P)}));
  VectorX<T> mean_square(1), trace(1);
  mean_square[0] = error.squaredNorm();
  trace[0] = loop.P_minus.trace();
  rows.holds({"(5.3)", "Result 5.2", "E[(X − Z)*(X − Z)] = Tr[P]"}, residual(trace, mean_square));
  const MatrixX<T> D = loop.D.asDiagonal();
  rows.holds({"(5.4)", "Result 5.3", "E[(e⁻)(e⁻)*] = D"},
             worst({residual(MatrixX<T>(sigma.e_minus * sigma.e_minus.transpose()), D),
                    residual(loop.D, s.udu->D)}));

  const MatrixX<T> l_plus = sigma.l_plus * sigma.l_plus.transpose();
  const MatrixX<T> H_Psi = op.H * loop.Psi;
  const MatrixX<T> middle = H_Psi.transpose() * loop.D.cwiseInverse().asDiagonal() * H_Psi;
  const auto one_lambda = [&](const MatrixX<T>& A) {
    return residual(MatrixX<T>(A + A * loop.Psi + Psi_t * A), l_plus);
  };
  const MatrixX<T> L_Psi = loop.L_plus * loop.I_gH * loop.Psi;
  co_state_covariance(s.process, s.cov, by_recursion);
  rows.erratum(
      {"(5.5)", "Result 5.4", "E(λλ*) = Ψ*H*D⁻¹HΨ = Λ + ΛΨ + Ψ*Λ",
       "E(λλ*) = Ψ*H*D⁻¹HΨ = Λ⁺ + Λ⁺(I − gH)Ψ + Ψ*(I − gH)*Λ⁺",
       "The first equality is true. In the second the loop also closes at the inboard "
       "joint: its Ψ goes from the + to the + side. On a tree a third term joins the "
       "branches."},
      best({one_lambda(loop.L_plus), one_lambda(loop.L_minus)}),
      worst({residual(middle, l_plus), residual(by_recursion, l_plus),
             residual(MatrixX<T>(loop.L_plus + L_Psi + L_Psi.transpose() + across_branches(s)),
                      l_plus)}));

  const MatrixX<T> H_phi = op.H * op.phi, H_Phi = op.H * op.Phi;
  rows.holds({"(5.6)", "Result 5.4", "Λ⁻(k) = (I − gH)ᵀΛ⁺(k)(I − gH) + HᵀH/D"},
             residual(loop.L_minus, diagonal_blocks<T>(H_phi.transpose() * s.X * H_phi)));
  const MatrixX<T> L_plus = diagonal_blocks<T>(H_Phi.transpose() * s.X * H_Phi);
  rows.holds({"(5.7)", "Result 5.4", "Λ⁺(k−1) = φᵀ(k,k−1) Λ⁻(k) φ(k,k−1)"},
             residual(loop.L_plus, L_plus));
}

}  // namespace kalmarm
