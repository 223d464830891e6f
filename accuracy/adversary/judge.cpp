#include "accuracy/adversary/judge.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "accuracy/adversary/exact.hpp"
#include "accuracy/contenders/contender.hpp"
#include "algorithms/dynamics/plan.hpp"
#include "kalmarm/tolerance.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm::adversary {
namespace {

using Wide = long double;

constexpr double largest_error = 1e300;
// Rows of states: as many as two of the widest registers hold, which is what a batch takes at once.
constexpr int rows = 32, row_of_the_state = 5;

// From 0 to 1: how near a warning or refusal is to the border.
double nearness(const Outcome& outcome) {
  if (outcome.warns() && !outcome.near_singular) return 1 / (1 + std::log10(outcome.error / 0.01));
  if (!(outcome.D > 0) || !(outcome.scale > 0)) return 0;
  return std::clamp(1 + std::log10(outcome.D / outcome.scale) / 40, 0.0, 1.0);
}

double capped(double error) { return error <= largest_error ? error : largest_error; }

// The error as Outcome::error tells it: in the measure of the task, but of an acceleration that is
// nothing beside gravity and what velocities bring (measures.hpp).
double error_as_claimed(Want task, const Answer<Wide>& difference, const Answer<Wide>& exact,
                        double nothing) {
  if (task != Want::acceleration) return error_of(task, difference, exact);
  return error_as_told<Wide>(difference[0].norm(), exact[0].norm(), nothing);
}

template <class T>
class JudgeOf final : public Judge {
 public:
  explicit JudgeOf(const Case& asked) : asked_(asked) {
    const Mechanism simple =
        decode({1, std::vector<double>(static_cast<std::size_t>(length_of(1)), 0.5)});
    try {
      answer(simple);  // throws for an unknown variant
    } catch (const std::logic_error& e) {
      throw InputError("variant '" + asked.variant + "': " + e.what());
    }
  }

  Verdict look(const Mechanism& m) override {
    const Given given = answer(m);
    Verdict without{.outcome = given.outcome};
    if (!without.silent()) return without;
    const bool with_kS = asked_.goal == Goal::error || !without.claims();
    const Exact exact = exact_answer<T>(asked_.task, m, with_kS);
    without.known = !exact.answer.empty();
    if (!without.known) return without;
    Answer<Wide> difference;
    for (std::size_t i = 0; i < exact.answer.size(); ++i)
      difference.push_back(given.answer[i].template cast<Wide>() - exact.answer[i]);
    return verdict_of(asked_, given.outcome, difference, exact.answer, exact.kS,
                      m.model.gravity().norm() + m.state.qd.squaredNorm());
  }

  Kernel kernel(const Mechanism& m) override {
    return robot(generated_scene("", m.model)).plan().parts.at(0).kernel;
  }

 private:
  struct Given {
    Outcome outcome;
    Answer<T> answer;
  };

  Dynamics<T> robot(const Scene& scene) const {
    const Contender by{asked_.variant, asked_.precision};
    QuestionOptions options;
    const Question question{.want = {asked_.task},
                            .at_rest = asked_.kernel == Kernel::spatial_at_rest};
    return make_robot<T>(by, scene, asked_of(by, options, question));
  }

  Given answer(const Mechanism& m) const {
    const Scene scene = generated_scene("", m.model);
    Dynamics<T> robot = this->robot(scene);
    const VectorX<T> q = m.state.q.cast<T>(), qd = m.state.qd.cast<T>(),
                     tau = m.state.tau.cast<T>();
    if (asked_.rows) return answer_in_rows(robot, scene, q, qd, tau);
    const Eigen::Index nv = qd.size();
    const T poison = std::numeric_limits<T>::quiet_NaN();
    MatrixX<T> column = MatrixX<T>::Constant(nv, 1, poison),
               square = MatrixX<T>::Constant(nv, nv, poison);
    switch (asked_.task) {
      case Want::inverse: {
        const Outcome outcome = robot.inverse_mass(q, square);
        return {outcome, {square}};
      }
      case Want::solve: {
        Outcome outcome = robot.factor(q);
        if (outcome) outcome = robot.solve(MatrixView<const T>(tau), MatrixView<T>(column));
        return {outcome, {column}};
      }
      case Want::diagonal: {
        VectorView<T> x(column.data(), nv);
        const Outcome outcome = robot.diagonal(q, x);
        return {outcome, {column}};
      }
      case Want::log_det: {
        T x = poison;
        const Outcome outcome = robot.log_det(q, x);
        return {outcome, {MatrixX<T>::Constant(1, 1, x)}};
      }
      case Want::derivatives: {
        MatrixX<T> dq = square, dqd = square, dtau = square;
        const Outcome outcome = robot.derivatives(q, qd, tau, {.dq = dq, .dqd = dqd, .dtau = dtau},
                                                  VectorView<T>(column.data(), nv));
        return {outcome, {dq, dqd, dtau}};
      }
      default: {
        const Outcome outcome =
            robot.forward_dynamics(q, qd, tau, VectorView<T>(column.data(), nv));
        return {outcome, {column}};
      }
    }
  }

  // The state among random ones, the same for every mechanism with as many DoF; the row that counts
  // says its own outcome.
  Given answer_in_rows(Dynamics<T>& robot, const Scene& scene, const VectorX<T>& q,
                       const VectorX<T>& qd, const VectorX<T>& tau) const {
    using Rows = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Eigen::Index nv = qd.size();
    const auto poisoned = [](Eigen::Index width) -> Rows {
      return Rows::Constant(rows, width, std::numeric_limits<T>::quiet_NaN());
    };
    Rows qs(rows, q.size()), qds(rows, nv), taus(rows, nv);
    const std::vector<State> others = random_states(scene, rows, 1);
    for (int i = 0; i < rows; ++i) {
      qs.row(i) = others[i].q.cast<T>();
      qds.row(i) = others[i].qd.cast<T>();
      taus.row(i) = others[i].tau.cast<T>();
    }
    qs.row(row_of_the_state) = q;
    qds.row(row_of_the_state) = qd;
    taus.row(row_of_the_state) = tau;
    std::vector<Outcome> outcomes(rows);
    const auto column = [](const Rows& all) -> MatrixX<T> {
      return all.row(row_of_the_state).transpose();
    };
    const auto square = [&](const Rows& all) -> MatrixX<T> { return column(all).reshaped(nv, nv); };
    switch (asked_.task) {
      case Want::inverse: {
        Rows X = poisoned(nv * nv);
        (void)robot.inverse_mass(qs, X, outcomes);
        return {outcomes[row_of_the_state], {square(X)}};
      }
      case Want::solve: {
        Rows x = poisoned(nv);
        (void)robot.solve(qs, taus, x, outcomes);
        return {outcomes[row_of_the_state], {column(x)}};
      }
      case Want::diagonal: {
        Rows x = poisoned(nv);
        (void)robot.diagonal(qs, x, outcomes);
        return {outcomes[row_of_the_state], {column(x)}};
      }
      case Want::log_det: {
        Rows x = poisoned(1);
        (void)robot.log_det(qs, x, outcomes);
        return {outcomes[row_of_the_state], {column(x)}};
      }
      case Want::derivatives: {
        Rows dq = poisoned(nv * nv), dqd = dq, dtau = dq, a = poisoned(nv);
        DerivativeRows<T> out;
        out.dq.emplace(dq);
        out.dqd.emplace(dqd);
        out.dtau.emplace(dtau);
        (void)robot.derivatives(qs, qds, taus, out, a, outcomes);
        return {outcomes[row_of_the_state], {square(dq), square(dqd), square(dtau)}};
      }
      default: {
        Rows a = poisoned(nv);
        (void)robot.forward_dynamics(qs, qds, taus, a, outcomes);
        return {outcomes[row_of_the_state], {column(a)}};
      }
    }
  }

  Case asked_;
};

}  // namespace

double promise(const std::string& precision) {
  return precision == "float32" ? default_tolerance<float> : default_tolerance<double>;
}

bool Verdict::claims() const { return outcome.error > 0 && std::isfinite(outcome.error); }

double Verdict::value(Goal goal, double K) const {
  if (!silent()) return told - (outcome ? 2 : 3) + nearness(outcome);
  if (!known) return nothing;
  double value = std::log10(goal == Goal::error ? error : excess);
  if (goal == Goal::error || !claims()) {
    if (kS > K) value -= 2 * std::log10(kS / K);
    if (size < smallest) value -= 2 * std::log10(smallest / size);
  }
  return std::max(told, value);
}

Verdict verdict_of(const Case& asked, const Outcome& outcome, const Answer<Wide>& difference,
                   const Answer<Wide>& exact, double kS, double brought) {
  Verdict out{.outcome = outcome};
  out.error = capped(error_of(asked.task, difference, exact));
  const double roundoff = asked.precision == "float32" ? 0x1p-24 : 0x1p-53;
  out.excess =
      capped(out.claims() ? error_as_claimed(asked.task, difference, exact, roundoff * brought) /
                                std::max(outcome.error, roundoff)
                          : out.error / promise(asked.precision));
  out.kS = kS;
  if (asked.task == Want::acceleration) out.size = static_cast<double>(exact[0].norm());
  return out;
}

std::unique_ptr<Judge> make_judge(const Case& asked) {
  if (asked.precision == "float32") return std::make_unique<JudgeOf<float>>(asked);
  return std::make_unique<JudgeOf<double>>(asked);
}

}  // namespace kalmarm::adversary
