// Kalman filter and Bryson-Frazier smoother on the factors of any covariance update: M^-1 = (I -
// L*) D^-1 (I - L), (3.3), one right-hand side in O(N).
//
//   filter, tips to base:
//     z-(k) = b(k) + sum over children c of phi(k,c) z+(c)     (4.4)
//     e-(k) = tau(k) - H z-                                    (4.2)
//     e+(k) = e- / D                                           (4.6)
//     z+(k) = z- + g e- + P+ c(k)                              (4.5)
//   smoother, base to tips:
//     l+(k) = phi'(k) l-(parent) + c(k)                        (4.10)
//     a(k)  = e+(k) - g' l+                                    (4.9)
//     l-(k) = l+ + H' a                                        (4.11), corrected
// The velocity-product accelerations c(k) and the base acceleration l-(base) = -gravity enter where
// they arise (random_model.hpp): the paper gathers them in b instead. z is then the force still
// missing at link k, P+ c included. With r = 0 two identities hold exactly, H z+ = tau and H l- =
// e+ - sum over j != h of g_j l+_j; where the update makes HP+ = 0 exact they are used instead of
// the sums, which keeps near-parallel axes accurate.
//
// M^-1 column by column: column j needs the filter only on the path from j to the base, and the
// smoother on DoF 0..j, since M^-1 is symmetric. O(N^2) altogether.
#pragma once

#include <string>
#include <vector>

#include "algorithms/inverse_mass/factors.hpp"

namespace kalmarm {

template <class Update>
struct Sequential {
  static std::string name() { return std::string("Sequential<") + Update::name + ">"; }
  static constexpr const char* equation = "M^-1 = (I - L*) D^-1 (I - L), (3.3)";
  template <class T>
  static constexpr bool supports = true;

  template <class T>
  struct Workspace {
    Factors<T, Update> factors;
    std::vector<Vector6<T>> z, l;
    std::vector<T> e;  // e-, then e+

    explicit Workspace(const Model<T>& model)
        : factors(model), z(model.nv()), l(model.nv()), e(model.nv()) {}
  };

  template <class T>
  static Outcome factor(const Model<T>& model, const RandomModel<T>& rm, Workspace<T>& ws) {
    return kalmarm::factor(model, rm, ws.factors);
  }

  // a (nv) from tau (nv), with the bias of rm, after factor. About 220 flops a link.
  template <class T>
  static void acceleration(const Model<T>& model, const RandomModel<T>& rm, const VectorX<T>& tau,
                           Workspace<T>& ws, VectorX<T>& a) {
    const Factors<T, Update>& f = ws.factors;
    for (int k = 0; k < model.nv(); ++k) ws.z[k] = rm.b[k];
    for (int k = model.nv() - 1; k >= 0; --k) {
      const Joint<T>& joint = model.joint(k);
      const int h = joint.axis();
      Vector6<T>& z = ws.z[k];
      const T e = tau[k] - z[h];  // (4.2)
      ws.e[k] = e / f.D[k];       // (4.6)
      if (joint.parent < 0) continue;
      z += f.g[k] * e + Update::template P_plus_times<T>(k, rm.c[k], f.update);  // (4.5)
      if (Update::exact_constraint && joint.r == T(0)) z[h] = tau[k];
      ws.z[joint.parent] += rm.phi[k].force_to_parent(z);  // (4.4)
    }
    const Vector6<T> l0 = base_acceleration(model);
    for (int k = 0; k < model.nv(); ++k) {
      const int parent = model.parent(k);
      ws.l[k] = rm.phi[k].motion_from_parent(parent < 0 ? l0 : ws.l[parent]) + rm.c[k];  // (4.10)
      a[k] = smooth(model.joint(k), f.g[k], ws.e[k], ws.l[k]);
    }
  }

  // M^-1 (nv x nv), both triangles, after factor.
  template <class T>
  static void inverse(const Model<T>& model, const RandomModel<T>& rm, Workspace<T>& ws,
                      MatrixX<T>& X) {
    const Factors<T, Update>& f = ws.factors;
    for (int j = 0; j < model.nv(); ++j) {
      // filter with tau = e_j: zero outboard of j and on other branches
      for (int k = 0; k <= j; ++k) ws.e[k] = T(0);
      ws.e[j] = T(1) / f.D[j];
      Vector6<T> z = f.g[j];
      if (Update::exact_constraint && model.joint(j).r == T(0)) z[model.joint(j).axis()] = T(1);
      for (int child = j, k = model.parent(j); k >= 0; child = k, k = model.parent(k)) {
        z = rm.phi[child].force_to_parent(z);
        const int h = model.joint(k).axis();
        const T e = -z[h];
        ws.e[k] = e / f.D[k];
        z += f.g[k] * e;
        if (Update::exact_constraint && model.joint(k).r == T(0)) z[h] = T(0);
      }
      // smoother
      for (int k = 0; k <= j; ++k) {
        const int parent = model.parent(k);
        if (parent < 0)
          ws.l[k].setZero();
        else
          ws.l[k] = rm.phi[k].motion_from_parent(ws.l[parent]);
        X(j, k) = X(k, j) = smooth(model.joint(k), f.g[k], ws.e[k], ws.l[k]);
      }
    }
  }

 private:
  // a(k) by (4.9), and l+ becomes l- by (4.11).
  template <class T>
  static T smooth(const Joint<T>& joint, const Vector6<T>& g, const T& e_plus, Vector6<T>& l) {
    const int h = joint.axis();
    if (Update::exact_constraint && joint.r == T(0)) {
      const T l_plus = l[h];
      l[h] = T(0);
      l[h] = e_plus - g.dot(l);
      return l[h] - l_plus;
    }
    const T a = e_plus - g.dot(l);
    l[h] += a;
    return a;
  }
};

}  // namespace kalmarm
