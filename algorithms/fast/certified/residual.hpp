// Residuals of the equation of motion in twice the precision of S, for one state or one in every
// lane:
//   r = tau - ID(q, q', x)          what x leaves of the torques                             (1)
//   r = tau - M(q) x                the same at rest, without gravity                        (2)
// by the kernels of rigid/inverse_dynamics.hpp, on a model that was lowered in that precision, from
// sines and cosines in that precision: float64 for float, pairs (spatial/pair.hpp) for double. q,
// q', tau and the parameters are exact as they stand, so r is that of the mechanism itself. x comes
// as a sum of two numbers, high + low, which need not round to `high`.
//
// (1) takes 171 flops a hinge of double, of pairs about 1390 and 200 for its sine and cosine.
#pragma once

#include <vector>

#include "algorithms/fast/certified/own_forces.hpp"
#include "algorithms/spatial/lanes.hpp"
#include "algorithms/spatial/pair_sincos.hpp"

namespace kalmarm {

namespace detail {

// How numbers T are carried in twice the precision: as `pieces` of Type, which have a part of the
// lanes each. Scalar: what a model is lowered in for them.
template <class T>
struct Carrier;

template <>
struct Carrier<float> {
  using Type = double;
  using Scalar = double;
  static constexpr int pieces = 1;

  static double widen(float x, int) { return x; }
  static double widen(float high, float low, int) {
    return static_cast<double>(high) + static_cast<double>(low);
  }
  static void difference(const float* a, const double* const (&b)[1], int n, float* r) {
    for (int k = 0; k < n; ++k) r[k] = static_cast<float>(a[k] - b[0][k]);
  }
};

template <int n>
struct Carrier<Pack<float, n>> {
  using Type = Pack<double, n / 2>;
  using Scalar = double;
  static constexpr int pieces = 2;

  static Type widen(const Pack<float, n>& x, int piece) {
    Half half;
    std::memcpy(&half, reinterpret_cast<const char*>(&x) + piece * sizeof half, sizeof half);
    return Type::of(__builtin_convertvector(half, typename Type::Vector));
  }
  static Type widen(const Pack<float, n>& high, const Pack<float, n>& low, int piece) {
    return widen(high, piece) + widen(low, piece);
  }
  static void difference(const Pack<float, n>* a, const Type* const (&b)[2], int count,
                         Pack<float, n>* r) {
    for (int piece = 0; piece < 2; ++piece)
      for (int k = 0; k < count; ++k) {
        const Type rest = widen(a[k], piece) - b[piece][k];
        const Half narrow = __builtin_convertvector(rest.v, Half);
        std::memcpy(reinterpret_cast<char*>(&r[k]) + piece * sizeof narrow, &narrow, sizeof narrow);
      }
  }

 private:
  typedef float Half __attribute__((vector_size(n / 2 * sizeof(float))));
};

template <class T>
requires std::is_same_v < typename Lanes<T>::Scalar,
double > struct Carrier<T> {
  using Type = Pair<T>;
  using Scalar = Pair<double>;
  static constexpr int pieces = 1;

  static Type widen(const T& x, int) { return x; }
  static Type widen(const T& high, const T& low, int) { return {high, low}; }
  static void difference(const T* a, const Type* const (&b)[1], int n, T* r) {
    for (int k = 0; k < n; ++k) {
      const Type rest = Type(a[k]) - b[0][k];
      r[k] = rest.hi + rest.lo;
    }
  }
};

// Double as it is: for answers that are to be right to float's digits.
template <class T>
struct SameCarrier {
  using Type = T;
  using Scalar = double;
  static constexpr int pieces = 1;

  static T widen(const T& x, int) { return x; }
  static T widen(const T& high, const T& low, int) { return high + low; }
  static void difference(const T* a, const T* const (&b)[1], int n, T* r) {
    for (int k = 0; k < n; ++k) r[k] = a[k] - b[0][k];
  }
};

}  // namespace detail

// Memory of one state, or of one state in every lane of T. C: in what numbers T are carried.
template <class T, class C = detail::Carrier<T>>
class TwiceResidual {
 public:
  using Wide = typename C::Type;
  using Model = LoweredModel<typename C::Scalar>;

  explicit TwiceResidual(const Model& model);

  // The equation that is to be solved. (1):
  void set_motion(const Model& model, const T* q, const T* qd, const T* tau);
  // (2):
  void set_mass(const Model& model, const T* q);
  void set_torque(const T* tau);

  // r (nv) of x = high + low; low may be null: zero.
  void of(const Model& model, const T* high, const T* low, T* r);

 private:
  struct Piece {
    InverseDynamicsWorkspace<Wide> workspace;
    std::vector<Wide> q, qd, x, torque;

    explicit Piece(const Model& model)
        : workspace(model), q(model.nq()), qd(model.nv()), x(model.nv()), torque(model.nv()) {}
  };

  void set_position(const Model& model, const T* q);

  bool moving_ = false;  // (1), else (2)
  std::vector<Piece> pieces_;
  std::vector<T> tau_;
};

template <class T, class C>
TwiceResidual<T, C>::TwiceResidual(const Model& model)
    : pieces_(C::pieces, Piece(model)), tau_(model.nv()) {}

template <class T, class C>
void TwiceResidual<T, C>::set_position(const Model& model, const T* q) {
  for (int i = 0; i < C::pieces; ++i) {
    Piece& piece = pieces_[i];
    for (int j = 0; j < model.nq(); ++j) piece.q[j] = C::widen(q[j], i);
    detail::set_placements(model, piece.q.data(), piece.workspace);
  }
}

template <class T, class C>
void TwiceResidual<T, C>::set_motion(const Model& model, const T* q, const T* qd, const T* tau) {
  moving_ = true;
  set_position(model, q);
  set_torque(tau);
  for (int i = 0; i < C::pieces; ++i)
    for (int k = 0; k < model.nv(); ++k) pieces_[i].qd[k] = C::widen(qd[k], i);
}

template <class T, class C>
void TwiceResidual<T, C>::set_mass(const Model& model, const T* q) {
  moving_ = false;
  set_position(model, q);
}

template <class T, class C>
void TwiceResidual<T, C>::set_torque(const T* tau) {
  std::copy_n(tau, tau_.size(), tau_.data());
}

template <class T, class C>
void TwiceResidual<T, C>::of(const Model& model, const T* high, const T* low, T* r) {
  const int nv = model.nv();
  const Wide* torques[C::pieces];
  for (int i = 0; i < C::pieces; ++i) {
    Piece& piece = pieces_[i];
    for (int k = 0; k < nv; ++k)
      piece.x[k] = low ? C::widen(high[k], low[k], i) : C::widen(high[k], i);
    const Wide* const x = piece.x.data();
    if (moving_) {
      detail::set_link_forces<true>(model, piece.qd.data(), x, piece.workspace);
      detail::sum_forces<true>(model, x, piece.workspace, piece.torque.data());
    } else {
      detail::set_link_forces<false>(model, x, x, piece.workspace);
      detail::sum_forces<false>(model, x, piece.workspace, piece.torque.data());
    }
    torques[i] = piece.torque.data();
  }
  C::difference(tau_.data(), torques, nv, r);
}

extern template class LoweredModel<Pair<double>>;
extern template LoweredModel<Pair<double>>::LoweredModel(const kalmarm::Model<Pair<double>>&,
                                                         Zeros);
extern template class TwiceResidual<double>;
extern template class TwiceResidual<Pack<double, padding<double>>>;

}  // namespace kalmarm
