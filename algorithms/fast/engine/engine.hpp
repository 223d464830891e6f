// What answers for one part of a robot (dynamics/plan.hpp). Those of the fast path are compiled
// once a scalar and an instruction set; plain numbers cross the boundary, as in kalmarm/views.hpp.
//
// A call (call.hpp) holds the numbers of the part's model. On failure a result is not to be used. Only
// what was wanted when the engine was made may be asked.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>
#include <type_traits>
#include <utility>
#include <vector>

#include "algorithms/fast/lowering/zeros.hpp"
#include "algorithms/model/selection.hpp"
#include "kalmarm/call.hpp"
#include "kalmarm/dynamics.hpp"

namespace kalmarm {

// Of two answers that are one result: a failure, else the first warning, else the higher rung; with the
// largest estimate of an error.
inline Outcome worse(const Outcome& a, const Outcome& b) {
  if (!a) return a;
  if (!b) return b;
  Outcome out = std::pair(b.warns(), b.rung) > std::pair(a.warns(), a.rung) ? b : a;
  out.error = std::fmax(a.error, b.error);  // NaN: there is none
  out.rung = std::max(a.rung, b.rung);
  return out;
}

inline bool all_finite(std::ptrdiff_t count, const double* x) {
  double check = 0;
  for (std::ptrdiff_t i = 0; i < count; ++i) check += x[i] * 0;
  return check == 0;
}

// A copy of what factors depend on: q, and contacts and loads where there are some.
template <class T>
class KeptPosition {
 public:
  explicit KeptPosition(const Widths& width) : q_(width.nq), contacts_(width.c), loads_(width.l) {}

  void keep(const Call<T>& call) {
    const auto copy = [](const T* from, std::vector<T>& to) -> const T* {
      if (from) std::copy_n(from, to.size(), to.data());
      return from ? to.data() : nullptr;
    };
    kept_ = {.want = Want::solve,
             .q = copy(call.q, q_),
             .contacts = copy(call.contacts, contacts_),
             .loads = copy(call.loads, loads_),
             .axes = call.axes};
  }

  const Call<T>& call() const { return kept_; }

 private:
  std::vector<T> q_, contacts_, loads_;
  Call<T> kept_{.want = Want::solve};
};

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

  // Whether diagonal, log_det, operational and its diagonal are answered without the whole of M^-1.
  virtual bool answers_in_part() const = 0;

  // One state. Factors that are kept are lost, but by `mass` and `inverse_dynamics`. B and X of
  // accelerations, tau and out of solves do not overlap.
  virtual Outcome answer(const Call<T>& call) = 0;

  // Memory for rows of `want`, which is wanted, by so many workers: numbered from 0, they may be called
  // at the same time.
  virtual void reserve_workers(Want want, int count) = 0;
  // One outcome a row, of inverse dynamics none. Joint noise is given for a robot that moves, and looked
  // at for joints that have some, which is not less.
  virtual void answer_rows(int worker, int count, const Call<T>& call, Outcome* outcomes) = 0;

  // At call.q, with contacts where there are some.
  virtual Outcome factor(const Call<T>& call) = 0;
  // By the factors of the last `factor`, which was ok; the worst outcome of the columns. taus and X do
  // not overlap.
  virtual Outcome solve(int columns, const T* taus, T* X) = 0;
};

// By which kernels: those of 6-D vectors, the same without velocity terms, of slides alone.
enum class Kernel { spatial, spatial_at_rest, translational };

const char* to_string(Kernel kernel);

struct EngineOptions {
  double tolerance = default_tolerance<double>;
  Kernel kernel = Kernel::spatial;
  Zeros zeros = Zeros::left_out;
  std::set<Want> want;                    // what memory is taken for
  Selection selection;                    // of Want::operational and its diagonal
  CallFrames frames;                      // of calls
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
