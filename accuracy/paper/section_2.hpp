// Section 2: conditional means from all measurements at once. Truth is the motion that tau causes:
// E(X/T) are its spatial forces, E(W/T) its inertial forces.
#pragma once

#include "accuracy/paper/rows.hpp"
#include "accuracy/paper/setting.hpp"

namespace kalmarm {

template <class T>
MatrixX<T> diagonal_blocks(const MatrixX<T>& A) {
  MatrixX<T> out = MatrixX<T>::Zero(A.rows(), A.cols());
  for (Eigen::Index k = 0; k < A.rows(); k += 6)
    out.template block<6, 6>(k, k) = A.template block<6, 6>(k, k);
  return out;
}

template <class T>
void section_2(const Setting<T>& s, Rows& rows) {
  rows.section("2");
  const auto& op = s.op;
  const auto& batch = s.batch;
  const auto& sigma = s.sigma;
  const MatrixX<T> HR = op.H * op.R;

  rows.holds({"(2.1)", "", "E(X/T) = φb + G(T − Hφb)"},
             worst({residual(batch.X_mean, s.force), residual(stacked(s.fs.x_mean), s.force)}));
  // the error is uncorrelated with every measurement
  rows.holds({"(2.2)", "", "G = RH*(HRH*)⁻¹, R = φQφ*"},
             residual(MatrixX<T>(batch.G * s.M), MatrixX<T>(HR.transpose())));
  const MatrixX<T> R = sigma.X * sigma.X.transpose();
  rows.holds({"(2.3)", "", "E[(X − φb)(X − φb)*] = φQφ* = R"}, residual(op.R, R));

  // one draw of W with its mean b, and of the joint noise: all sigma points at once
  const VectorX<T> W = op.b + sigma.W.rowwise().sum(), X = op.phi * W;
  const VectorX<T> noise = sigma.tau.rowwise().sum() - op.H * (op.phi * (W - op.b));
  const VectorX<T> tau = op.H * X + noise;
  FilterSmoother<T> fs(s.process);
  filter(s.process, s.cov, tau, fs);
  smooth(s.process, s.cov, fs);
  set_conditional_means(s.process, fs);
  const VectorX<T> error = X - stacked(fs.x_mean);
  const MatrixX<T> I_GH = s.identity6() - batch.G * op.H;
  const VectorX<T> G_noise = batch.G * noise;
  rows.erratum({"(2.4)", "", "X − E(X/T) = (I − GH)φW", "X − E(X/T) = (I − GH)φ(W − b)",
                "W has the mean b, which the estimate already contains: its deviation from b is "
                "meant, here and in the sentence before (2.11). True as printed for b = 0."},
               residual(VectorX<T>(I_GH * (op.phi * W) - G_noise), error),
               residual(VectorX<T>(I_GH * (op.phi * (W - op.b)) - G_noise), error));

  const MatrixX<T> X_error = sigma.X - sigma.X_mean;
  const MatrixX<T> P = X_error * X_error.transpose();
  std::vector<Matrix6<T>> P_smoothed, W_smoothed;
  for (int k = 0; k < s.n(); ++k) {
    P_smoothed.push_back(smoothed_state_covariance(s.cov, k));
    W_smoothed.push_back(smoothed_input_covariance(s.process, s.cov, k));
  }
  rows.holds(
      {"(2.5)", "", "P = (I − GH)R(I − GH)*"},
      worst({residual(batch.P, P), residual(block_diagonal<T>(P_smoothed), diagonal_blocks(P))}));
  const MatrixX<T> GHR = batch.G * HR;
  rows.holds(
      {"(2.6)", "", "P = (I − GH)R = R(I − GH)* = R − RH*(HRH*)⁻¹HR"},
      worst({residual(MatrixX<T>(I_GH * op.R), P), residual(MatrixX<T>(op.R * I_GH.transpose()), P),
             residual(MatrixX<T>(op.R - GHR), P)}));
  const MatrixX<T> noise_left = op.r.asDiagonal() * s.X * HR;
  rows.holds({"HP = 0", "", "HP = 0, PH* = 0, HPH* = 0 (with joint noise: HP = rM⁻¹HR)"},
             static_cast<double>((op.H * (I_GH * op.R) - noise_left).norm() / HR.norm()));

  const VectorX<T> X_b = s.X * batch.T_centred;
  const VectorX<T> W_mean = op.b + op.Q * (op.phi.transpose() * (op.H.transpose() * X_b));
  rows.holds({"(2.7)", "", "E(W/T) = b + Qφ*H*(HRH*)⁻¹(T − Hφb)"},
             worst({residual(W_mean, s.net_force), residual(stacked(s.fs.w_mean), s.net_force)}));
  rows.holds({"(2.8)", "", "a = M⁻¹(T − Hφb), M = HRH*"},
             worst({residual(batch.a, s.a), residual(op.M, s.M)}));
  rows.holds({"(2.9)", "", "λ = φ*H*a"}, residual(batch.lambda, s.l_minus));
  rows.holds({"(2.10)", "", "E(W/T) = b + Qλ"}, residual(batch.W_mean, s.net_force));

  const MatrixX<T> W_error = sigma.W - sigma.W_mean;
  const MatrixX<T> W_cov = W_error * W_error.transpose();
  rows.holds({"(2.11)", "", "E[ŴŴ*] = Q − Qφ*H*M⁻¹HφQ"},
             worst({residual(batch.W_cov, W_cov),
                    residual(block_diagonal<T>(W_smoothed), diagonal_blocks(W_cov))}));
}

}  // namespace kalmarm
