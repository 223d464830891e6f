// Linear couplings of joints, imposed exactly: equality constraints of joints in MJCF, <mimic> in
// URDF. The file's other constraints stay ignored.
//
//   q_i = offset + c1 q_j                   of the file (loader/imposed_rows.hpp); without j, c1 = 0  (1)
//   qd = G u,  qdd = G u'                   u: the velocities of the DoF that are left           (2)
//   M' = G^T M G                            G is constant                                        (3)
//   M' u' = G^T (tau - bias)                                                                     (4)
//
// With A v = 0 the couplings of velocities, so A G = 0, and S picks the DoF that are left, S G = 1,
// the same of X = M^-1 and a = X (tau - bias), which any variant gives:
//   G M'^-1 G^T = X - X A^T (A X A^T)^-1 A X,  M'^-1 = S (...) S^T                               (5)
//   qdd = a - X A^T (A X A^T)^-1 A a,          u' = S qdd                                        (6)
#pragma once

#include <string>
#include <vector>

#include "robots/scene/scene.hpp"

namespace kalmarm {

class Couplings {
 public:
  // Of the scene's file, those that are active. Throws InputError with the joint: a coupling that is
  // not linear, a joint that is coupled twice or to itself, a scene without couplings.
  explicit Couplings(const Scene& scene);

  const std::vector<int>& left() const { return left_; }  // DoF, in order

  State imposed(State state) const;

  // The same of a state that a user gave. Throws InputError with `where` if it says otherwise.
  State checked(const State& state, const std::string& where) const;

  MatrixX<double> mass(const MatrixX<double>& M) const;                                    // (3)
  MatrixX<double> inverse(const MatrixX<double>& X) const;                                 // (5)
  VectorX<double> acceleration(const MatrixX<double>& X, const VectorX<double>& a) const;  // u' (6)

 private:
  // q_k = offset + ratio q_of; of < 0: constant. A DoF that is left is its own.
  struct Follower {
    int of;
    double offset = 0, ratio = 1;
  };

  Follower followed(int k) const;  // by a DoF that is left, or constant

  Model<double> model_;
  std::vector<Follower> followers_;
  std::vector<int> left_;
  MatrixX<double> G_, A_;
};

}  // namespace kalmarm
