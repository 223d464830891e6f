// Section 6: the inverse in closed form. Truth is the inverse of M by elimination.
#pragma once

#include "accuracy/paper/rows.hpp"
#include "accuracy/paper/section_5.hpp"
#include "accuracy/paper/setting.hpp"
#include "algorithms/study/solver.hpp"

namespace kalmarm {

// (6.1) and (6.2) as printed, with one Psi in both places and one Lambda.
template <class T>
struct PrintedInverse {
  double by_6_1, by_6_2;

  PrintedInverse(const Setting<T>& s, const MatrixX<T>& Psi, const MatrixX<T>& L) {
    const auto& g = s.loop.g;
    const auto& H = s.op.H;
    const MatrixX<T> D_inverse = s.loop.D.cwiseInverse().asDiagonal();
    const MatrixX<T> cross = (g.transpose() * L - D_inverse * H) * (Psi * g);
    by_6_1 =
        residual(MatrixX<T>(D_inverse + g.transpose() * L * g + cross + cross.transpose()), s.X);
    const MatrixX<T>& P = s.loop.P_minus;
    const MatrixX<T> A = (P * L - s.identity6()) * Psi * P;
    const MatrixX<T> S = P + P * L * P + A + A.transpose(), HD = H.transpose() * D_inverse;
    by_6_2 = residual(MatrixX<T>(HD.transpose() * S * HD), s.X);
  }
};

template <class T>
void section_6(const Setting<T>& s, Rows& rows) {
  rows.section("6");
  const auto& op = s.op;
  const auto& loop = s.loop;
  const auto& g = loop.g;
  const MatrixX<T> D_inverse = loop.D.cwiseInverse().asDiagonal();

  double printed_1 = not_evaluable, printed_2 = not_evaluable;
  for (const MatrixX<T>& Psi :
       {loop.Psi, MatrixX<T>(loop.I_gH * loop.Psi), MatrixX<T>(loop.Psi * loop.I_gH),
        MatrixX<T>(loop.I_gH * loop.Psi * loop.I_gH)})
    for (const MatrixX<T>* L : {&loop.L_plus, &loop.L_minus}) {
      const PrintedInverse<T> printed(s, Psi, *L);
      printed_1 = std::min(printed_1, printed.by_6_1);
      printed_2 = std::min(printed_2, printed.by_6_2);
    }

  // (6.1), corrected: + to + with Lambda, - to + with H*D^-1; across branches on a tree
  const MatrixX<T> branches = across_branches(s);
  const MatrixX<T> cross =
      (g.transpose() * loop.L_plus * loop.I_gH - D_inverse * op.H) * (loop.Psi * g);
  const MatrixX<T> by_6_1 = D_inverse + g.transpose() * loop.L_plus * g + cross +
                            cross.transpose() + g.transpose() * branches * g;
  MatrixX<T> kernel(s.n(), s.n());
  VectorX<T> a(s.n());
  const auto solver = make_solver<T>("ClosedForm<Conventional>", s.model);
  const bool solved = solver->inverse(s.q, kernel) && solver->acceleration(s.q, s.qd, s.tau, a);
  const double failed = solved ? 0 : not_evaluable;
  rows.erratum({"(6.1)", "Result 6.1", "M⁻¹ = D⁻¹ + g*Λg + g*Ψ*(Λg − H*D⁻¹) + (g*Λ − D⁻¹H)Ψg",
                "M⁻¹ = D⁻¹ + g*Λ⁺g + g*Ψ*((I − gH)*Λ⁺g − H*D⁻¹) + (g*Λ⁺(I − gH) − D⁻¹H)Ψg",
                "Two different Ψ are needed: + to + side with Λ, − to + side with H*D⁻¹. No single "
                "one does; the residual printed is that of the best. A tree adds g*…g across "
                "branches."},
               printed_1, worst({residual(by_6_1, s.X), residual(kernel, s.X), failed}));

  const MatrixX<T>& P = loop.P_minus;
  const MatrixX<T> A = (P * loop.L_plus * loop.I_gH - s.identity6()) * loop.Psi * P;
  const MatrixX<T> S = P + P * loop.L_plus * P + A + A.transpose() + P * branches * P;
  const MatrixX<T> HD = op.H.transpose() * D_inverse;
  const MatrixX<T> noise = D_inverse * op.r.asDiagonal() * D_inverse;
  rows.erratum({"(6.2)", "Result 6.1", "S = P + PΛP + PΨ*(ΛP − I) + (PΛ − I)ΨP, M⁻¹ = D⁻¹HSH*D⁻¹",
                "S = P + PΛ⁺P + PΨ*((I − gH)*Λ⁺P − I) + (PΛ⁺(I − gH) − I)ΨP, P = P⁻",
                "The same two Ψ as in (6.1). Joint noise adds D⁻¹rD⁻¹ to M⁻¹, since then HPH* is "
                "D − r."},
               printed_2, residual(MatrixX<T>(HD.transpose() * S * HD + noise), s.X));

  const VectorX<T> torque = s.tau - s.bias;
  rows.holds({"(6.3)", "", "Ma = T (bias neglected)"}, residual(VectorX<T>(op.M * s.a), torque));
  rows.holds({"(6.4)", "", "a = M⁻¹T (bias neglected; M⁻¹ by Result 6.1)"},
             worst({residual(VectorX<T>(by_6_1 * torque), s.a), residual(a, s.a), failed}));
}

}  // namespace kalmarm
