#include "algorithms/advisor/advisor.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <tuple>

#include "algorithms/dynamics/check_model.hpp"
#include "algorithms/dynamics/plan.hpp"
#include "algorithms/model/short_text.hpp"

namespace kalmarm {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr double as_many_states = 500, least_margin = 5, most_margin = 25,
                 margin_of_other_wants = 3;  // (6)
constexpr double alike = 1.15;               // times that differ by less are one
constexpr int timed_states = 32, rounds = 7;
constexpr double patience =
    5e6;  // [ns] a candidate that takes so long for its states is timed once
constexpr std::size_t kept_numbers = 8 << 20;  // of reference answers; more are worked out again

double roundoff(Precision precision) {
  return precision == Precision::float32 ? unit_roundoff<float>() : unit_roundoff<double>();
}

// (6); n: numbers of an answer.
double margin(const std::set<Want>& want, int n) {
  if (!want.contains(Want::acceleration) && !want.contains(Want::solve))
    return margin_of_other_wants;
  return std::clamp(std::pow(as_many_states, 1.0 / n), least_margin, most_margin);
}

// error / size, where no error is no error of nothing too.
double quotient(double error, double size) { return error == 0 ? 0 : error / size; }

// The larger; NaN counts as infinite.
void raise(double& to, double error) {
  if (!(error <= to)) to = std::isnan(error) ? infinite : error;
}

// (1) to (4), of n numbers, or n x n where they are a matrix.
double error_of(Want want, const double* x, const double* exact, int n) {
  double worst = 0;
  switch (want) {
    case Want::inverse:
    case Want::mass:
    case Want::operational:
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i)
          raise(worst, quotient(std::abs(x[i + j * n] - exact[i + j * n]),
                                std::sqrt(exact[i + i * n] * exact[j + j * n])));
      return worst;
    case Want::diagonal:
    case Want::operational_diagonal:
      for (int i = 0; i < n; ++i)
        raise(worst, quotient(std::abs(x[i] - exact[i]), std::abs(exact[i])));
      return worst;
    case Want::log_det:
      raise(worst, std::abs(*x - *exact));
      return worst;
    default: {
      const Eigen::Map<const VectorX<double>> a(x, n), b(exact, n);
      raise(worst, quotient((a - b).norm(), b.norm()));
      return worst;
    }
  }
}

Question checked(const Question& question) {
  if (question.want.empty() || question.want.contains(Want::derivatives))
    throw std::invalid_argument("advice is about chosen results, without derivatives");
  return question;
}

}  // namespace

const char* to_string(Precision precision) {
  return precision == Precision::float32 ? "float32" : "float64";
}

struct Advisor::Parts {
  // A candidate, and what is known of it.
  struct Entry {
    std::unique_ptr<Trial> trial;
    std::optional<Observation> observation;
    double nanoseconds = -1;
  };

  RobotModel model;
  Question question;
  TrialStates states;
  Clock now;
  int asked, rows;
  std::unique_ptr<Trial> reference;
  std::vector<VectorX<double>> kept;  // answers of the reference, of the first states
  double reference_error = 0;
  std::vector<Candidate> candidates;
  std::vector<Entry> entries;

  Parts(const RobotModel& robot, const Question& what, TrialStates where, Clock clock)
      : model(robot),
        question(checked(what)),
        states(std::move(where)),
        now(std::move(clock)),
        rows(6 * static_cast<int>(question.frames.size())) {
    Dynamics<double> dynamics(
        model, {.tolerance = last_bits, .question = question, .rules = model_rules()});
    asked = dynamics.asked();
    reference = std::make_unique<TrialBy<double>>(std::move(dynamics), question.want, rows, states);
    for (int i = 0; i < states.count; ++i) {
      reference->poison();
      const Outcome outcome = reference->answer(i);
      const double known =
          std::isnan(outcome.error) ? unit_roundoff<double>() : outcome.error;  // of M alone
      raise(reference_error, !outcome || outcome.near_singular ? infinite : known);
      VectorX<double> result = reference->result();
      if ((kept.size() + 1) * result.size() <= kept_numbers) kept.push_back(std::move(result));
    }
  }

  VectorX<double> exact(int state) {
    if (static_cast<std::size_t>(state) < kept.size()) return kept[state];
    reference->poison();
    static_cast<void>(reference->answer(state));  // judged when it was asked first
    return reference->result();
  }

  Entry& entry(int candidate) {
    Entry& out = entries[candidate];
    if (!out.trial) out.trial = candidates[candidate].make();
    return out;
  }

  // Of a whole answer.
  double error(const VectorX<double>& result, const VectorX<double>& truth) const {
    double worst = 0;
    std::ptrdiff_t at = 0;
    for (const Want want : question.want) {
      const int size = trial_size(want, asked, rows);
      const bool square = want == Want::inverse || want == Want::mass;
      const int n = square ? asked : want == Want::operational ? rows : size;
      raise(worst, error_of(want, result.data() + at, truth.data() + at, n));
      at += size;
    }
    return worst;
  }

  Observation observe(int candidate) {
    Trial& trial = *entry(candidate).trial;
    Observation out;
    std::vector<double> errors;
    for (int i = 0; i < states.count; ++i) {
      trial.poison();
      const Outcome outcome = trial.answer(i);
      out.failures += !outcome;
      out.warnings += outcome.warns();
      errors.push_back(!outcome || outcome.warns() ? infinite : error(trial.result(), exact(i)));
      raise(out.worst, errors.back());
    }
    std::ranges::nth_element(errors, errors.begin() + states.count / 2);
    out.median = errors[states.count / 2];
    const double u = roundoff(candidates[candidate].precision);
    out.predicted = margin(question.want, asked) * std::max(u, out.worst) + reference_error;
    return out;
  }

  // A call of every candidate: the least mean over the states, of rounds that take turns.
  void measure_times() {
    const int count = std::min(states.count, timed_states);
    for (int round = 0; round < rounds; ++round)
      for (int i = 0; i < static_cast<int>(candidates.size()); ++i) {
        Entry& one = entry(i);
        if (round > 0 && one.nanoseconds * count > patience) continue;
        const double start = now();
        one.trial->answer_first(count);  // how long, not how well
        const double mean = (now() - start) / count;
        if (round == 0 || mean < one.nanoseconds) one.nanoseconds = mean;
      }
  }
};

double Advisor::steady_clock() {
  const std::chrono::duration<double, std::nano> since_start =
      std::chrono::steady_clock::now().time_since_epoch();
  return since_start.count();
}

Advisor::Advisor(const RobotModel& model, const Question& question, TrialStates states, Clock clock)
    : parts_(std::make_unique<Parts>(model, question, std::move(states), std::move(clock))) {}

Advisor::~Advisor() = default;

void Advisor::add(Candidate candidate) {
  parts_->candidates.push_back(std::move(candidate));
  parts_->entries.emplace_back();
}

void Advisor::add(std::optional<double> tolerance, const std::string& variant, bool in_rows) {
  const auto make = [this, tolerance, in_rows]<class T>(T) {
    Dynamics<T> dynamics(parts_->model, {.tolerance = tolerance, .question = parts_->question});
    return make_trial(std::move(dynamics), parts_->question.want, parts_->rows, parts_->states,
                      in_rows);
  };
  if (in_rows && fits_float(parts_->model))
    add({variant, Precision::float32, [make] { return make(float()); }});
  add({variant, Precision::float64, [make] { return make(double()); }});
}

const std::vector<Candidate>& Advisor::candidates() const { return parts_->candidates; }

const Observation& Advisor::observe(int candidate) {
  std::optional<Observation>& known = parts_->entry(candidate).observation;
  if (!known) known = parts_->observe(candidate);
  return *known;
}

double Advisor::nanoseconds(int candidate) {
  if (parts_->entries[candidate].nanoseconds < 0) parts_->measure_times();
  return parts_->entries[candidate].nanoseconds;
}

const Question& Advisor::question() const { return parts_->question; }
const TrialStates& Advisor::states() const { return parts_->states; }
double Advisor::reference_error() const { return parts_->reference_error; }

namespace {

std::string name_of(const Candidate& candidate) {
  return candidate.variant + " in " + to_string(candidate.precision);
}

}  // namespace

Advice Advisor::advise(double tolerance) {
  if (!(tolerance >= unit_roundoff<double>()))
    throw std::invalid_argument("tolerance " + short_text("%.3g", tolerance) +
                                " is below the roundoff of float64, " +
                                short_text("%.3g", unit_roundoff<double>()));
  std::vector<int> by_time;
  for (int i = 0; i < static_cast<int>(parts_->candidates.size()); ++i)
    if (parts_->candidates[i].advised) by_time.push_back(i);
  std::ranges::stable_sort(by_time, {}, [&](int i) { return nanoseconds(i); });

  Advice out;
  double limit = infinite;  // of the times that are like the best
  std::string rejected;     // the fastest that is not enough
  for (const int i : by_time) {
    if (nanoseconds(i) > limit) break;
    const Observation& seen = observe(i);
    if (seen.predicted <= tolerance) {
      if (!out.enough) limit = alike * nanoseconds(i);
      if (!out.enough || i < out.candidate) out.candidate = i;
      out.enough = true;
    } else if (rejected.empty() && !out.enough) {
      rejected = name_of(parts_->candidates[i]) +
                 (seen.worst < infinite ? " errs by " + short_text("%.1e", seen.worst)
                                        : std::string(" warns or fails"));
    }
  }
  if (!out.enough)
    out.candidate = *std::ranges::min_element(by_time, {}, [&](int i) {
      const Observation& seen = observe(i);
      return std::tuple(seen.predicted, seen.worst, seen.failures, seen.warnings, nanoseconds(i));
    });

  const Observation& seen = observe(out.candidate);
  const std::string of_states = " in " + std::to_string(parts_->states.count) +
                                (parts_->states.count == 1 ? " state" : " states");
  const std::string within = out.enough ? "within " : "BEYOND ";
  out.reason = name_of(parts_->candidates[out.candidate]) +
               (seen.worst < infinite ? " errs by at most " + short_text("%.1e", seen.worst)
                                      : std::string(" warns or fails")) +
               of_states + ", predicted " + short_text("%.1e", seen.predicted) + ", " + within +
               short_text("%.3g", tolerance) + ", at " + time_text(nanoseconds(out.candidate)) +
               " a call; ";
  if (!out.enough)
    out.reason += "nothing that was tried is more accurate";
  else if (rejected.empty())
    out.reason += "nothing that was tried is faster";
  else
    out.reason += "faster, but not enough: " + rejected;
  return out;
}

namespace detail {

Recommendation recommend(const RobotModel& model, int count, const double* q, const double* qd,
                         const double* tau, const RecommendOptions& options) {
  const auto rows = [count](const double* first, int width) {
    return std::vector<double>(first, first + std::ptrdiff_t(count) * width);
  };
  const int nq = model.nq, nv = model.nv();
  Advisor advisor(model, options.question,
                  {count, nq, nv, rows(q, nq), rows(qd, nv), rows(tau, nv)});
  advisor.add({}, "the default tolerance", options.rows);
  advisor.add(last_bits, "the last bits", options.rows);
  const Advice advice = advisor.advise(options.tolerance);
  const Observation& seen = advisor.observe(advice.candidate);
  const Candidate& advised = advisor.candidates()[advice.candidate];
  const bool refined = 2 * advice.candidate >= static_cast<int>(advisor.candidates().size());
  const bool in_float = advised.precision == Precision::float32;
  return {.tolerance = refined    ? last_bits
                       : in_float ? default_tolerance<float>
                                  : default_tolerance<double>,
          .precision = advised.precision,
          .worst = seen.worst,
          .predicted = seen.predicted,
          .nanoseconds = advisor.nanoseconds(advice.candidate),
          .enough = advice.enough,
          .reason = advice.reason};
}

}  // namespace detail
}  // namespace kalmarm
