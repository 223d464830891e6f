// Section 4: filtering and smoothing, with bias. Truth is the acceleration of the motion, its
// spatial accelerations, and conditional means from the outboard measurements at once.
#pragma once

#include "accuracy/paper/rows.hpp"
#include "accuracy/paper/section_3.hpp"
#include "accuracy/paper/setting.hpp"

namespace kalmarm {

// The smoother with (4.11) as printed: e+ where a belongs.
template <class T>
VectorX<T> smoothed_as_printed(const Setting<T>& s) {
  VectorX<T> a(s.n());
  std::vector<Vector6<T>> l(s.n());
  for (int k = 0; k < s.n(); ++k) {
    const int parent = s.process.parent[k];
    l[k].setZero();
    if (parent >= 0) l[k] = s.process.phi[k].transpose() * l[parent];
    a[k] = s.fs.e_plus[k] - s.cov.g[k].dot(l[k]);
    l[k] += s.process.H[k] * s.fs.e_plus[k];
  }
  return a;
}

template <class T>
void section_4(const Setting<T>& s, Rows& rows) {
  rows.section("4");
  const auto& op = s.op;
  const auto& loop = s.loop;
  const auto& fs = s.fs;
  const MatrixX<T> I_minus_L = s.identity() - loop.L;
  const VectorX<T> T_centred = s.tau - s.bias, D_inverse = s.udu->D.cwiseInverse();
  const char* const bias =
      "(4.4) carries the bias b, so what is filtered is T less its mean Hφb. True as printed for "
      "b = 0.";

  const auto solve = [&](const VectorX<T>& torque) -> VectorX<T> {
    return I_minus_L.transpose() * D_inverse.cwiseProduct(I_minus_L * torque);
  };
  rows.erratum({"(4.1)", "", "a = (I − L*)D⁻¹(I − L)T", "a = (I − L*)D⁻¹(I − L)(T − Hφb)", bias},
               residual(solve(s.tau), s.a), residual(solve(T_centred), s.a));

  const VectorX<T> e_minus = s.udu->solve_U(T_centred);
  rows.erratum(
      {"(4.2)", "", "e⁻ = (I − L)T", "e⁻ = (I − L)(T − Hφb)", bias},
      residual(VectorX<T>(I_minus_L * s.tau), e_minus),
      worst({residual(VectorX<T>(I_minus_L * T_centred), e_minus), residual(fs.e_minus, e_minus)}));
  const Conditionals<T> known(s);
  const VectorX<T> z_minus = stacked(known.z_minus), z_plus = stacked(known.z_plus);
  rows.erratum({"(4.3)", "", "Z = ΨPH*D⁻¹T = ΨgT", "Z = φb + Ψg(T − Hφb)", bias},
               residual(VectorX<T>(loop.Psi * (loop.g * s.tau)), z_minus),
               residual(VectorX<T>(op.phi * op.b + loop.Psi * (loop.g * T_centred)), z_minus));
  rows.holds({"(4.4)", "", "z⁻(k) = φ(k,k−1) z⁺(k−1) + b(k)"},
             residual(stacked(fs.z_minus), z_minus));
  rows.holds({"(4.5)", "", "z⁺(k) = z⁻(k) + g(k)e⁻(k)"}, residual(stacked(fs.z_plus), z_plus));
  const VectorX<T> e_plus = D_inverse.cwiseProduct(e_minus);
  rows.holds({"(4.6)", "", "e⁺ = D⁻¹e⁻"}, residual(fs.e_plus, e_plus));

  rows.holds({"(4.7)", "", "a = (I − L*)e⁺"},
             residual(VectorX<T>(I_minus_L.transpose() * e_plus), s.a));
  VectorX<T> l_plus = VectorX<T>::Zero(6 * s.n());
  for (int k = 0; k < s.n(); ++k)
    if (const int p = s.process.parent[k]; p >= 0)
      l_plus.template segment<6>(6 * k) =
          s.process.phi[k].transpose() * s.l_minus.template segment<6>(6 * p);
  const VectorX<T> He = op.H.transpose() * e_plus;
  rows.holds({"(4.8)", "", "λ = Ψ*H*e⁺ (λ⁺, where (2.9) has λ⁻)"},
             residual(VectorX<T>(loop.Psi.transpose() * He), l_plus));
  rows.holds({"(4.9)", "", "a = e⁺ − g*λ"},
             worst({residual(VectorX<T>(e_plus - loop.g.transpose() * l_plus), s.a),
                    residual(fs.a, s.a)}));
  rows.holds({"(4.10)", "", "λ⁺(k−1) = φᵀ(k,k−1) λ⁻(k)"},
             worst({residual(VectorX<T>(op.Phi.transpose() * (op.H.transpose() * s.a)), l_plus),
                    residual(stacked(fs.l_plus), l_plus)}));
  const VectorX<T> l_minus = l_plus + op.H.transpose() * s.a;
  rows.erratum(
      {"(4.11)", "", "λ⁻(k) = λ⁺(k) + Hᵀ(k)e⁺(k)", "λ⁻(k) = λ⁺(k) + Hᵀ(k)a(k), a = e⁺ − gᵀλ⁺",
       "The joint adds its own acceleration a to that of the body before it; the residual "
       "e⁺ would leave out what the co-state contributes. The residual shown is that of "
       "a."},
      residual(smoothed_as_printed(s), s.a),
      worst({residual(l_minus, s.l_minus), residual(stacked(fs.l_minus), s.l_minus)}));
}

}  // namespace kalmarm
