// Section 3: sequential estimation. Truth is M = U D U' by elimination, which is unique, and what a
// joint's filter may know: the measurements of the joints outboard of it, used all at once.
#pragma once

#include "accuracy/paper/rows.hpp"
#include "accuracy/paper/setting.hpp"

namespace kalmarm {

// The Gaussian x(k) of a joint, given the measurements of some joints, from R and M.
template <class T>
struct Conditional {
  Matrix6<T> P;
  Vector6<T> mean;

  Conditional(const Setting<T>& s, int k, const std::vector<int>& given) {
    const auto m = static_cast<Eigen::Index>(given.size());
    const MatrixX<T> HR = s.op.H * s.op.R.template middleCols<6>(6 * k);  // cov(tau, x(k))
    const VectorX<T> phi_b = s.op.phi * s.op.b, T_centred = s.tau - s.op.H * phi_b;
    MatrixX<T> C(m, m), B(m, 6);
    VectorX<T> t(m);
    for (Eigen::Index i = 0; i < m; ++i) {
      t[i] = T_centred[given[i]];
      B.row(i) = HR.row(given[i]);
      for (Eigen::Index j = 0; j < m; ++j) C(i, j) = s.op.M(given[i], given[j]);
    }
    P = s.op.R.template block<6, 6>(6 * k, 6 * k);
    mean = phi_b.template segment<6>(6 * k);
    if (m == 0) return;
    const MatrixX<T> gain = C.llt().solve(B).transpose();
    P -= gain * B;
    mean += gain * t;
  }
};

// Of every joint, before and after its own measurement.
template <class T>
struct Conditionals {
  std::vector<Matrix6<T>> P_minus, P_plus;
  std::vector<Vector6<T>> z_minus, z_plus;

  explicit Conditionals(const Setting<T>& s) {
    for (int k = 0; k < s.n(); ++k) {
      std::vector<int> outboard;
      for (int m = k + 1; m < s.n(); ++m)
        for (int i = s.process.parent[m]; i >= k; i = s.process.parent[i])
          if (i == k) outboard.push_back(m);
      const Conditional<T> before(s, k, outboard);
      outboard.push_back(k);
      const Conditional<T> after(s, k, outboard);
      P_minus.push_back(before.P);
      P_plus.push_back(after.P);
      z_minus.push_back(before.mean);
      z_plus.push_back(after.mean);
    }
  }
};

// What the filter makes of a disturbance b(j) = d(j), with all measurements zero: its transitions.
template <class T>
FilterSmoother<T> response(const Setting<T>& s, const VectorX<T>& d) {
  Process<T> disturbed = s.process;
  for (int k = 0; k < s.n(); ++k) disturbed.b[k] = d.template segment<6>(6 * k);
  FilterSmoother<T> fs(disturbed);
  filter(disturbed, s.cov, VectorX<T>(VectorX<T>::Zero(s.n())), fs);
  return fs;
}

template <class T>
void section_3(const Setting<T>& s, Rows& rows) {
  rows.section("3");
  const auto& op = s.op;
  const auto& loop = s.loop;
  const MatrixX<T> D = loop.D.asDiagonal(), D_inverse = loop.D.cwiseInverse().asDiagonal();
  const MatrixX<T> I_plus_K = s.identity() + loop.K, I_minus_L = s.identity() - loop.L;
  const MatrixX<T> U_inverse = s.udu->solve_U(s.identity());

  rows.holds({"(3.1)", "Result 3.3", "M = (I + K)D(I + K*)"},
             residual(MatrixX<T>(I_plus_K * D * I_plus_K.transpose()), s.M));
  rows.holds({"(3.2)", "Result 3.5", "(I + K)⁻¹ = I − L"},
             worst({residual(I_minus_L, U_inverse),
                    residual(MatrixX<T>(I_plus_K * I_minus_L), s.identity())}));
  rows.holds({"(3.3)", "", "M⁻¹ = (I − L*)D⁻¹(I − L)"},
             residual(MatrixX<T>(I_minus_L.transpose() * D_inverse * I_minus_L), s.X));

  const MatrixX<T> r = block_diagonal<T>(s.cov.r_minus);
  rows.holds({"(3.4)", "Result 3.1", "R = r + Φr + rΦ*"},
             residual(MatrixX<T>(r + op.Phi * r + r * op.Phi.transpose()), op.R));
  std::vector<Matrix6<T>> R_blocks;
  for (int k = 0; k < s.n(); ++k) R_blocks.push_back(op.R.template block<6, 6>(6 * k, 6 * k));
  rows.erratum(
      {"(3.5)", "Result 3.1", "r⁻(k) = 0; r⁻(k) = φ r⁺(k−1) φᵀ + M(k), r⁺ = r⁻",
       "r⁺(0) = 0; r⁻(k) = φ r⁺(k−1) φᵀ + M(k), r⁺ = r⁻",
       "The initial condition belongs to r⁺(0), before the first body; at every k it would "
       "make r zero. Perhaps the scan, not the print."},
      1, residual(r, block_diagonal<T>(R_blocks)));

  const Conditionals<T> known(s);
  const MatrixX<T> P_minus = block_diagonal<T>(known.P_minus),
                   P_plus = block_diagonal<T>(known.P_plus);
  rows.holds({"(3.6)", "", "P⁻ = φP⁺φᵀ + M, D = HP⁻Hᵀ, P⁺ = P⁻ − P⁻HᵀHP⁻/D"},
             worst({residual(loop.P_minus, P_minus), residual(loop.D, s.udu->D),
                    static_cast<double>((loop.P_plus - P_plus).norm() / P_minus.norm())}));
  const MatrixX<T> PH = loop.P_minus * op.H.transpose(), Phi_PH = op.Phi * PH;
  rows.erratum(
      {"(3.7)", "Result 3.2", "R = P + ΦP + PΦ* + ΦPHD⁻¹HPΦ*", "R = P + ΦP + PΦ* + ΦPH*D⁻¹HPΦ*",
       "A star is missing: PH is not conformable, PH* is. Perhaps the scan, not the print. P is "
       "P⁻."},
      not_evaluable,
      residual(MatrixX<T>(loop.P_minus + op.Phi * loop.P_minus + loop.P_minus * op.Phi.transpose() +
                          Phi_PH * D_inverse * Phi_PH.transpose()),
               op.R));
  const MatrixX<T> K = op.H * op.Phi * loop.P_minus * op.H.transpose() * D_inverse;
  VectorX<T> HPH = (op.H * PH).diagonal() + op.r;
  rows.holds({"(3.8)", "Result 3.3", "K = HΦPH*D⁻¹, D = HPH*"},
             worst({residual(MatrixX<T>(s.identity() + K), s.udu->U), residual(HPH, s.udu->D)}));

  VectorX<T> d(6 * s.n());
  for (Eigen::Index i = 0; i < d.size(); ++i) d[i] = s.op.b[i] + T(1);
  const FilterSmoother<T> fs = response(s, d);
  const VectorX<T> z_minus = stacked(fs.z_minus), z_plus = stacked(fs.z_plus);
  VectorX<T> propagated = VectorX<T>::Zero(6 * s.n());
  for (int k = 0; k < s.n(); ++k)
    if (const int p = s.process.parent[k]; p >= 0)
      propagated.template segment<6>(6 * p) += s.process.phi[k] * fs.z_plus[k];
  rows.holds({"(3.9)", "", "ψ(k⁻,k−1⁺) = φ(k,k−1), ψ(k⁺,k⁻) = I − g(k)H(k)"},
             worst({residual(VectorX<T>(loop.I_gH * z_minus), z_plus),
                    residual(VectorX<T>(propagated + d), z_minus)}));

  MatrixX<T> gain = MatrixX<T>::Zero(6 * s.n(), s.n());
  for (int k = 0; k < s.n(); ++k)
    gain.template block<6, 1>(6 * k, k) = known.P_minus[k] * s.process.H[k] / s.udu->D[k];
  rows.holds({"(3.10)", "", "g(k) = P⁻(k)Hᵀ(k)D⁻¹(k)"}, residual(loop.g, gain));
  rows.holds({"(3.11)", "", "Ψ = [ψ(k,m)], lower triangular, zero on its diagonal"},
             residual(VectorX<T>(d + loop.Psi * (loop.I_gH * d)), z_minus));

  // Psi by a linear equation, without (3.9)
  const MatrixX<T> Psi = (s.identity6() + op.Phi * loop.g * op.H).partialPivLu().solve(op.Phi);
  rows.erratum({"(3.12)", "Result 3.4", "Ψ = (I − gH)Φ", "Ψ = (I − ΨgH)Φ = (I + ΦgH)⁻¹Φ",
                "The loop closes at every joint in between, not at the last one alone: Ψ has to "
                "stand on both sides."},
               residual(MatrixX<T>(loop.I_gH * op.Phi), Psi),
               worst({residual(loop.Psi, Psi),
                      residual(MatrixX<T>(op.Phi - loop.Psi * loop.g * (op.H * op.Phi)), Psi)}));
  rows.holds({"(3.13)", "Result 3.5", "(I + K)⁻¹ = I − L"}, residual(I_minus_L, U_inverse));
  const MatrixX<T> L = op.H * loop.Psi * loop.P_minus * op.H.transpose() * D_inverse;
  rows.holds({"(3.14)", "Result 3.5", "L = HΨPH*D⁻¹"},
             residual(MatrixX<T>(s.identity() - L), U_inverse));
  const MatrixX<T> KL = loop.K * loop.L, LK = loop.L * loop.K;
  const double size = static_cast<double>(I_plus_K.norm());
  rows.holds({"KL = LK", "Result 3.5", "K = L + KL, K = L + LK, LK = KL"},
             worst({static_cast<double>((loop.L + KL - loop.K).norm()) / size,
                    static_cast<double>((loop.L + LK - loop.K).norm()) / size,
                    static_cast<double>((LK - KL).norm()) / size}));
}

}  // namespace kalmarm
