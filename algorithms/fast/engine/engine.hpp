// What answers for one part of a robot (dynamics/plan.hpp). Those of the fast path are compiled
// once a scalar and an instruction set; plain numbers cross the boundary, as in kalmarm/views.hpp.
//
// q holds nq numbers, vectors nv of the part's model; matrices are column-major, nv x nv. Of rows,
// one state is one row. On failure a result is not to be used. Only what was wanted when the engine
// was made may be called.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <type_traits>

#include "algorithms/fast/lowering/zeros.hpp"
#include "algorithms/model/selection.hpp"
#include "kalmarm/dynamics.hpp"

namespace kalmarm {

// Of two answers that are one result: a failure, else the first warning, else what took a second
// look; with the largest estimate of an error.
inline Outcome worse(const Outcome& a, const Outcome& b) {
  if (!a) return a;
  if (!b) return b;
  const auto rank = [](const Outcome& one) { return one.warns() ? 2 : one.recomputed ? 1 : 0; };
  Outcome out = rank(b) > rank(a) ? b : a;
  out.error = std::fmax(a.error, b.error);  // NaN: there is none
  out.recomputed = a.recomputed || b.recomputed;
  out.rung = std::max(a.rung, b.rung);
  return out;
}

// Of lanes of S that answer.
template <class S>
Outcome answered_in_lanes() {
  constexpr bool narrow = std::is_same_v<S, float>;
  return {.rung = narrow ? Outcome::Rung::float_lanes : Outcome::Rung::float64};
}

template <class T>
class Engine {
 public:
  virtual ~Engine() = default;

  // Whether diagonal, log_det and selected are answered without the whole of M^-1.
  virtual bool answers_in_part() const = 0;

  virtual Outcome forward_dynamics(const T* q, const T* qd, const T* tau, T* a) = 0;

  // The same and X = M^-1 B, of m columns, by the factors of the same sweep where it is that of the
  // conventional form. B and X do not overlap. Factors that are kept are lost.
  virtual Outcome forward_dynamics(const T* q, const T* qd, const T* tau, T* a, int m, const T* B,
                                   T* X) {
    const Outcome of_a = forward_dynamics(q, qd, tau, a);
    if (!of_a) return of_a;
    const Outcome of_D = factor(q);
    return of_D ? worse(of_a, worse(of_D, solve(m, B, X))) : of_D;
  }

  // Memory for rows of `what`, which is wanted, by so many workers: numbered from 0, they may be called
  // at the same time.
  virtual void reserve_workers(Want what, int count) = 0;
  // Rows: returns how many failed.
  virtual int forward_dynamics(int worker, int count, const T* q, const T* qd, const T* tau, T* a,
                               Outcome* outcomes) = 0;
  // The same B for every row, X: m columns a row. left_over[i]: of row i one state is to be asked.
  virtual void forward_dynamics(int /*worker*/, int count, const T* /*q*/, const T* /*qd*/,
                                const T* /*tau*/, T* /*a*/, Outcome* /*outcomes*/, int /*m*/,
                                const T* /*B*/, T* /*X*/, char* left_over) {
    leave(count, left_over);
  }
  virtual void inverse_dynamics(int worker, int count, const T* q, const T* qd, const T* qdd,
                                T* tau) = 0;

  // Rows of M, M^-1, M^-1 tau (tau and x do not overlap), parts of M^-1, and derivatives, of which those
  // that are null are left out. left_over[i]: of row i one state is to be asked; else outcomes[i] is
  // that of the row.
  virtual void mass(int /*worker*/, int count, const T* /*q*/, T* /*M*/, Outcome* /*outcomes*/,
                    char* left_over) {
    leave(count, left_over);
  }
  virtual void inverse(int /*worker*/, int count, const T* /*q*/, T* /*X*/, Outcome* /*outcomes*/,
                       char* left_over) {
    leave(count, left_over);
  }
  virtual void solve(int /*worker*/, int count, const T* /*q*/, const T* /*tau*/, T* /*x*/,
                     Outcome* /*outcomes*/, char* left_over) {
    leave(count, left_over);
  }
  virtual void diagonal(int /*worker*/, int count, const T* /*q*/, T* /*x*/, Outcome* /*outcomes*/,
                        char* left_over) {
    leave(count, left_over);
  }
  virtual void log_det(int /*worker*/, int count, const T* /*q*/, T* /*x*/, Outcome* /*outcomes*/,
                       char* left_over) {
    leave(count, left_over);
  }
  virtual void selected(int /*worker*/, int count, const T* /*q*/, T* /*X*/, Outcome* /*outcomes*/,
                        char* left_over) {
    leave(count, left_over);
  }
  virtual void derivatives(int /*worker*/, int count, const T* /*q*/, const T* /*qd*/,
                           const T* /*tau*/, T* /*da_dq*/, T* /*da_dqd*/, T* /*da_dtau*/, T* /*a*/,
                           Outcome* /*outcomes*/, char* left_over) {
    leave(count, left_over);
  }

  virtual void inverse_dynamics(const T* q, const T* qd, const T* qdd, T* tau) = 0;
  virtual void mass(const T* q, T* M) = 0;
  virtual Outcome inverse(const T* q, T* X) = 0;
  virtual Outcome factor(const T* q) = 0;
  // By the factors of the last `factor`, which was ok; the worst outcome of the columns. taus and X do
  // not overlap.
  virtual Outcome solve(int columns, const T* taus, T* X) = 0;
  virtual Outcome diagonal(const T* q, T* x) = 0;
  virtual Outcome log_det(const T* q, T& x) = 0;
  virtual Outcome selected(const T* q, T* X) = 0;  // of EngineOptions::selection
  virtual Outcome derivatives(const T* q, const T* qd, const T* tau, T* da_dq, T* da_dqd,
                              T* da_dtau, T* a) = 0;

  // Rows of forward dynamics, each with joint noise r (nv) of its own in place of the robot's: of joints
  // that have some, and not less. left_over[i]: row i is not answered, and a robot with its r is to be
  // asked.
  virtual void forward_dynamics(int /*worker*/, int count, const T* /*q*/, const T* /*qd*/,
                                const T* /*tau*/, const T* /*r*/, T* /*a*/, Outcome* /*outcomes*/,
                                char* left_over) {
    leave(count, left_over);
  }

 private:
  static void leave(int count, char* left_over) { std::fill_n(left_over, count, char(1)); }
};

// By which kernels: those of 6-D vectors, the same without velocity terms, of slides alone.
enum class Kernel { spatial, spatial_at_rest, translational };

const char* to_string(Kernel kernel);

struct EngineOptions {
  double tolerance = default_tolerance<double>;
  Kernel kernel = Kernel::spatial;
  Zeros zeros = Zeros::left_out;
  std::set<Want> want;                    // what memory is taken for
  Selection selection;                    // of `selected`
  Triangles triangles = Triangles::both;  // of M and M^-1 of one state, that have to be filled

  bool wants(Want what) const { return want.contains(what); }
  // Whether any of it is made of factors alone.
  bool wants_factors() const {
    return wants(Want::solve) || wants(Want::inverse) || wants(Want::diagonal) ||
           wants(Want::log_det) || selection.size() > 0;
  }
};

// Of the fast path, for float and double: kernels for the best instruction set there is.
template <class T>
std::unique_ptr<Engine<T>> make_engine(const RobotModel& robot, const EngineOptions& options);

}  // namespace kalmarm
