// The ladder as variants of the registry, so that programs, benchmarks and tests judge it like any
// other: Dynamics at a tolerance, what a user gets, and the last of its rungs by itself.
//
// At tolerance 1 double answers alone but where no digit of a D is left, so that no rung of it
// alone is needed; nor of refined double, which is what last_bits gives of all but a few mechanisms
// (Outcome::rung says of which).
//
// Rung<generated>: generated code as the ladder's first rung (generate/generated_engine.hpp), which the others answer
// after. The code's record is evaluated in the place of what a compiler makes of it, so that ten thousand mechanisms take
// minutes.
#include "algorithms/fast/certified/wide_acceleration.hpp"
#include "algorithms/fast/certified/wide_factors.hpp"
#include "algorithms/fast/claims/claims.hpp"
#include "algorithms/generate/task.hpp"
#include "algorithms/model/plain.hpp"
#include "algorithms/study/solver.hpp"
#include "kalmarm/dynamics.hpp"

namespace kalmarm {
namespace {

template <class T>
class LadderSolver : public Solver<T> {
 public:
  LadderSolver(const Model<T>& model, std::optional<double> tolerance)
      : dynamics_(
            plain(model.template cast<double>()),
            {.tolerance = tolerance,
             .question = {.want = {Want::acceleration, Want::solve, Want::inverse, Want::mass}}}) {}

  Outcome acceleration(const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau,
                       VectorX<T>& a) override {
    return dynamics_.forward_dynamics(q, qd, tau, a);
  }
  Outcome factor(const VectorX<T>& q) override { return dynamics_.factor(q); }
  void solve(const VectorX<T>& tau, VectorX<T>& x) override {
    (void)dynamics_.solve(VectorView<const T>(tau), VectorView<T>(x));
  }
  Outcome inverse(const VectorX<T>& q, MatrixX<T>& X) override {
    return dynamics_.inverse_mass(q, X);
  }
  void mass(const VectorX<T>& q, MatrixX<T>& M) override { dynamics_.mass(q, M); }

 private:
  Dynamics<T> dynamics_;
};

template <class T>
class GeneratedRungSolver final : public LadderSolver<T> {
 public:
  explicit GeneratedRungSolver(const Model<T>& model)
      : LadderSolver<T>(model, {}),
        acceleration_(GeneratedTask::judged_forward_dynamics, model),
        solve_(GeneratedTask::judged_solve, model),
        inverse_(GeneratedTask::judged_inverse_mass, model) {}

  Outcome acceleration(const VectorX<T>& q, const VectorX<T>& qd, const VectorX<T>& tau,
                       VectorX<T>& a) override {
    const std::vector<T> x = acceleration_(q, qd, tau);
    if (!(x.back() > 0)) return LadderSolver<T>::acceleration(q, qd, tau, a);
    std::copy_n(x.begin(), a.size(), a.data());
    return {.error = x[a.size()]};
  }
  Outcome factor(const VectorX<T>& q) override {
    q_ = q;
    return LadderSolver<T>::factor(q);
  }
  void solve(const VectorX<T>& tau, VectorX<T>& x) override {
    const std::vector<T> of_code = solve_(q_, tau);
    if (!(of_code.back() > 0)) return LadderSolver<T>::solve(tau, x);
    std::copy_n(of_code.begin(), x.size(), x.data());
  }
  Outcome inverse(const VectorX<T>& q, MatrixX<T>& X) override {
    const std::vector<T> x = inverse_(q);
    if (!(x.back() > 0)) return LadderSolver<T>::inverse(q, X);
    std::copy_n(x.begin(), X.size(), X.data());  // symmetric to the bit
    return {};
  }

 private:
  class Code {
   public:
    Code(GeneratedTask task, const Model<T>& model)
        : record_(record<T>(task, model.template cast<double>())) {}

    // The result, its error, its margin.
    template <class... Given>
    std::vector<T> operator()(const Given&... given) const {
      std::vector<T> in;
      (in.insert(in.end(), given.begin(), given.end()), ...);
      return record_.graph.template evaluate<T>(record_.results, in);
    }

   private:
    TaskRecord record_;
  };

  Code acceleration_, solve_, inverse_;
  VectorX<T> q_;
};

// Two doubles for one number, of states that are finite; others are refused, as Dynamics does.
class TwoDoublesSolver final : public Solver<double> {
 public:
  explicit TwoDoublesSolver(const Model<double>& model)
      : acceleration_(plain(model)), factors_(plain(model), of_factors()) {}

  Outcome acceleration(const VectorX<double>& q, const VectorX<double>& qd,
                       const VectorX<double>& tau, VectorX<double>& a) override {
    if (!q.allFinite() || !qd.allFinite() || !tau.allFinite()) return not_finite;
    return acceleration_.acceleration({.want = Want::acceleration,
                                       .q = q.data(),
                                       .qd = qd.data(),
                                       .tau = tau.data(),
                                       .out = a.data()});
  }
  Outcome factor(const VectorX<double>& q) override {
    return q.allFinite() ? factors_.factor({.want = Want::solve, .q = q.data()}) : not_finite;
  }
  void solve(const VectorX<double>& tau, VectorX<double>& x) override {
    (void)factors_.solve(1, tau.data(), x.data());
  }
  Outcome inverse(const VectorX<double>& q, MatrixX<double>& X) override {
    if (!q.allFinite()) return not_finite;
    return factors_.inverse({.want = Want::inverse, .q = q.data(), .out = X.data()});
  }
  void mass(const VectorX<double>&, MatrixX<double>& M) override {
    M.setConstant(std::numeric_limits<double>::quiet_NaN());
  }

 private:
  static EngineOptions of_factors() {
    EngineOptions out;
    out.want = {Want::solve, Want::inverse};
    return out;
  }

  static constexpr Outcome not_finite{.status = Outcome::Status::not_finite};

  WideAcceleration acceleration_;
  WideFactors factors_;
};

constexpr const char* citation = "Rodriguez 1987; frames after Denavit and Hartenberg";

struct Tolerance {
  const char* name;
  std::optional<double> value;  // empty: the default
  bool contender = false;
};
constexpr Tolerance tolerances[] = {{"Ladder<default>", {}, true},
                                    {"Ladder<last_bits>", last_bits, true},
                                    {"Ladder<1>", 1.0},
                                    {"Ladder<1e-3>", 1e-3},
                                    {"Ladder<1e-6>", 1e-6},
                                    {"Ladder<1e-9>", 1e-9},
                                    {"Ladder<1e-12>", 1e-12}};

template <class T>
RegisteredVariant<T> ladder_at(const Tolerance& asked) {
  const std::optional<double> tolerance = asked.value;
  // M is the same at every tolerance.
  std::set<Want> wants = {Want::acceleration, Want::solve, Want::inverse};
  if (asked.contender) wants.insert(Want::mass);
  const bool refined = tolerance && *tolerance < least_tolerance_of_double;
  return {asked.name,
          refined ? "(3.6), (4.1) to (4.11), refined by residuals in twice the precision"
                  : "(3.6), (4.1) to (4.11), written out for frames on the axes",
          {.kind = VariantKind::ladder,
           .contender = asked.contender,
           .tolerance = tolerance,
           .refined = refined,
           .wants = std::move(wants),
           .citation = citation},
          [tolerance](const Model<T>& model) {
            return std::unique_ptr<Solver<T>>(std::make_unique<LadderSolver<T>>(model, tolerance));
          }};
}

}  // namespace

template <class T>
std::vector<RegisteredVariant<T>> ladder_variants() {
  std::vector<RegisteredVariant<T>> out;
  for (const Tolerance& one : tolerances)
    if (one.contender || *one.value > unit_roundoff<T>()) out.push_back(ladder_at<T>(one));
  RegisteredVariant<T> generated = ladder_at<T>({"Rung<generated>", {}});
  generated.traits.kind = VariantKind::rung;  // else programs ask Dynamics in its place
  generated.make = [](const Model<T>& model) {
    return std::unique_ptr<Solver<T>>(std::make_unique<GeneratedRungSolver<T>>(model));
  };
  out.push_back(std::move(generated));
  return out;
}

RegisteredVariant<double> two_doubles_variant() {
  return {"Rung<two_doubles>",
          "(3.6), (4.1) to (4.11) in two doubles for one number",
          {.kind = VariantKind::rung, .contender = false, .citation = citation},
          [](const Model<double>& model) {
            return std::unique_ptr<Solver<double>>(std::make_unique<TwoDoublesSolver>(model));
          }};
}

template std::vector<RegisteredVariant<float>> ladder_variants<float>();
template std::vector<RegisteredVariant<double>> ladder_variants<double>();

}  // namespace kalmarm
