#include "accuracy/contenders/advice.hpp"

#include <algorithm>
#include <stdexcept>

#include "algorithms/dynamics/check_model.hpp"
#include "algorithms/model/plain.hpp"
#include "robots/loader/input_error.hpp"

namespace kalmarm {
namespace {

constexpr int largest_dense = 200;  // DoF

TrialStates rows_of(const Scene& scene, const std::vector<State>& states) {
  TrialStates out;
  out.count = static_cast<int>(states.size());
  out.nq = scene.model.nq();
  out.nv = scene.model.nv();
  const auto append = [](std::vector<double>& rows, const VectorX<double>& row) {
    rows.insert(rows.end(), row.begin(), row.end());
  };
  for (const State& state : states) {
    append(out.q, state.q);
    append(out.qd, state.qd);
    append(out.tau, state.tau);
  }
  return out;
}

bool is_ladder(const VariantTraits& traits) { return traits.kind == VariantKind::ladder; }

// The registry's contenders, the ladder first.
std::vector<RegisteredVariant<double>> contenders(int nv, Calls calls) {
  std::vector<RegisteredVariant<double>> ladder, others;
  for (const auto& variant : registered_variants<double>()) {
    const VariantTraits& traits = variant.traits;
    if (!traits.contender || (traits.dense && nv > largest_dense)) continue;
    (is_ladder(traits) ? ladder : others).push_back(variant);
  }
  if (calls == Calls::of_one_state) ladder.insert(ladder.end(), others.begin(), others.end());
  return ladder;
}

}  // namespace

std::unique_ptr<Advisor> make_advisor(const Scene& scene, const QuestionOptions& asked,
                                      const Question& question, const std::vector<State>& states,
                                      const std::string& precision, Calls calls) {
  auto out = std::make_unique<Advisor>(plain(scene.model), question, rows_of(scene, states));
  const bool held = fits_float(plain(scene.model));
  if (!held && precision == to_string(Precision::float32))
    throw InputError(scene.name + ": float32 does not hold a number of its file");
  const bool in_rows = calls == Calls::of_rows;
  const auto add = [&]<class T>(T, const RegisteredVariant<double>& variant, Precision in) {
    const Contender by{variant.name, to_string(in)};
    if (!precision.empty() && precision != by.precision) return;
    if (in == Precision::float32 && !held) return;
    const Advisor* const advisor = out.get();
    const auto make = [&scene, &asked, advisor, by, in_rows] {
      const DynamicsOptions options = asked_of(by, asked, advisor->question());
      return make_trial(make_robot<T>(by, scene, options), options.question.want,
                        6 * static_cast<int>(options.question.frames.size()), advisor->states(),
                        in_rows);
    };
    out->add({variant.name, in, make, is_ladder(variant.traits)});
  };
  for (const auto& variant : contenders(scene.model.nv(), calls)) {
    const bool answers_in_double = is_ladder(variant.traits) && !in_rows && precision.empty();
    if (!answers_in_double) add(float(), variant, Precision::float32);
    add(double(), variant, Precision::float64);
  }
  return out;
}

Advice advise(Advisor& advisor, double tolerance) {
  try {
    return advisor.advise(tolerance);
  } catch (const std::invalid_argument& e) {
    throw InputError(e.what());
  }
}

}  // namespace kalmarm
