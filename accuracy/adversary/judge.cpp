#include "accuracy/adversary/judge.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "accuracy/contender.hpp"
#include "accuracy/measures.hpp"
#include "accuracy/truth.hpp"

namespace kalmarm::adversary {
namespace {

using Wide = long double;

constexpr double largest_error = 1e300;
constexpr int draws = 3;  // for kS
constexpr unsigned most_digits = 400;

// From 0 to 1: how near a warning or refusal is to the border.
double nearness(const Outcome& outcome) {
  if (outcome.warns() && !outcome.near_singular) return 1 / (1 + std::log10(outcome.error / 0.01));
  if (!(outcome.D > 0) || !(outcome.scale > 0)) return 0;
  return std::clamp(1 + std::log10(outcome.D / outcome.scale) / 40, 0.0, 1.0);
}

template <class T>
class JudgeOf final : public Judge {
 public:
  JudgeOf(const std::string& variant, const std::string& precision) : by_{variant, precision} {
    // throws for an unknown variant
    answer(decode({1, std::vector<double>(static_cast<std::size_t>(length_of(1)), 0.5)}));
  }

  Verdict look(const Mechanism& m) override {
    const Answer given = answer(m);
    Verdict out{.outcome = given.outcome};
    if (!out.silent()) return out;
    try {
      const Truth<T> exact = truth<T>(m.model.template cast<T>(), m.state.q.cast<T>(),
                                      {{m.state.tau.cast<T>(), m.state.qd.cast<T>()}},
                                      {.digits = most_digits, .matrices = false, .draws = draws});
      out.known = exact.outcome && !exact.responses[0].a.isZero(Real(0));
      if (!out.known) return out;
      const VectorX<Wide> a = exact.responses[0].a.template cast<Wide>();
      const double error = quotient<Wide>((given.a.template cast<Wide>() - a).norm(), a.norm());
      out.error = error <= largest_error ? error : largest_error;
      out.kS = exact.responses[0].kS.relative;
      out.size = static_cast<double>(a.norm());
    } catch (const std::runtime_error&) {  // not within the digits
      out.known = false;
    }
    return out;
  }

 private:
  struct Answer {
    Outcome outcome;
    VectorX<T> a;
  };

  Answer answer(const Mechanism& m) const {
    const Scene scene = generated_scene("", m.model);
    QuestionOptions wanted;
    wanted.want = {"acceleration"};
    Dynamics<T> robot =
        make_robot<T>(by_, scene, asked_of(by_, wanted, question_of(scene, wanted)));
    const VectorX<T> q = m.state.q.cast<T>(), qd = m.state.qd.cast<T>(),
                     tau = m.state.tau.cast<T>();
    VectorX<T> a = VectorX<T>::Constant(qd.size(), std::numeric_limits<T>::quiet_NaN());
    const Outcome outcome = robot.forward_dynamics(q, qd, tau, a);
    return {outcome, a};
  }

  Contender by_;
};

}  // namespace

double Verdict::value(double K) const {
  if (!silent()) return told - (outcome ? 2 : 3) + nearness(outcome);
  if (!known) return nothing;
  double value = std::log10(error);
  if (kS > K) value -= 2 * std::log10(kS / K);
  if (size < smallest) value -= 2 * std::log10(smallest / size);
  return std::max(told, value);
}

std::unique_ptr<Judge> make_judge(const std::string& variant, const std::string& precision) {
  if (precision == "float32") return std::make_unique<JudgeOf<float>>(variant, precision);
  return std::make_unique<JudgeOf<double>>(variant, precision);
}

}  // namespace kalmarm::adversary
