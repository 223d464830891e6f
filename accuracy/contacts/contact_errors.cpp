#include "accuracy/contacts/contact_errors.hpp"

#include <cmath>
#include <limits>
#include <span>

#include "accuracy/programs/common/csv.hpp"
#include "accuracy/truth/move.hpp"
#include "algorithms/study/contact_variants.hpp"
#include "algorithms/study/contacts/standing_ladder.hpp"
#include "algorithms/test/multiprecision.hpp"

namespace kalmarm::contact_errors {
namespace {

using Exact = FixedReal<100>;

template <class T, class V>
Outcome solve(const Model<T>& model, const VectorX<T>& q, std::span<const ContactRow<T>> contacts,
              const VectorX<T>& b, VectorX<T>& x) {
  LinkKinematics<T> kin(model);
  set_position(model, q, kin);
  typename V::template Workspace<T> ws(model);
  const Outcome outcome = solve_standing<V>(model, kin, contacts, b, ws, x);
  if (outcome && !(x.squaredNorm() < std::numeric_limits<T>::infinity()))
    return {.status = Outcome::Status::not_finite};
  return outcome;
}

// H x = b in precision R.
template <class R>
struct Problem {
  Model<R> model;
  VectorX<R> q, b;
  std::vector<ContactRow<R>> contacts;

  template <class T>
  Problem(const Model<T>& of_model, const VectorX<T>& at, const std::vector<ContactRow<T>>& rows,
          const VectorX<T>& right)
      : model(of_model.template cast<R>()), q(at.template cast<R>()), b(right.template cast<R>()) {
    for (const ContactRow<T>& row : rows) contacts.push_back(row.template cast<R>());
  }

  Outcome solve(VectorX<R>& x) const {
    x.resize(model.nv());
    return contact_errors::solve<R, Sequential<ArrayGivens>>(model, q, contacts, b, x);
  }

  void move(Move<R>& by) {
    model = by.moved(model);
    by(q);
    by(b);
    for (ContactRow<R>& row : contacts) by(row.e), by(row.d);
  }
};

// kS, to the two digits that long double leaves of differences.
double condition(const Problem<long double>& problem) {
  constexpr int draws = 4;
  constexpr long double delta = 1e-9L;
  constexpr double infinite = std::numeric_limits<double>::infinity();
  Move<long double> by(delta, 1);
  long double sum = 0;
  VectorX<long double> x, of_moved;
  if (!problem.solve(x)) return infinite;
  for (int draw = 0; draw < draws; ++draw) {
    Problem<long double> moved = problem;
    moved.move(by);
    if (!moved.solve(of_moved)) return infinite;
    sum += (of_moved - x).squaredNorm();
  }
  return static_cast<double>(std::sqrt(sum / (draws * x.squaredNorm())) / delta);
}

// One mechanism, state, right-hand side and stiffness.
template <class T>
class Answers {
 public:
  Answers(const Model<T>& model, const VectorX<T>& q, const std::vector<ContactRow<T>>& contacts,
          const VectorX<T>& b, std::string begin, std::string state)
      : model_(model),
        q_(q),
        contacts_(contacts),
        b_(b),
        begin_(std::move(begin)),
        state_(std::move(state)) {
    VectorX<Exact> x;
    truth_ = Problem<Exact>(model, q, contacts, b).solve(x);
    x_ = x.template cast<long double>();
    if (truth_) kS_ = condition({model, q, contacts, b});
  }

  template <class V>
  void add() {
    VectorX<T> x(model_.nv());
    add(V::name(), kalmarm::contact_errors::solve<T, V>(model_, q_, contacts_, b_, x), x);
  }

  void add_ladder(double tolerance) {
    VectorX<T> x(model_.nv());
    StandingLadder<T> ladder(model_.template cast<double>(), contacts_, tolerance);
    add(ladder.name(tolerance), ladder(q_, b_, x), x);
  }

  const std::string& text() const { return text_; }

 private:
  void add(const std::string& variant, const Outcome& outcome, const VectorX<T>& x) {
    text_ += begin_ + ',' + field(variant) + ',' + state_ + ',' + to_string(outcome.status) +
             (outcome.warns() ? ",1," : ",0,");
    if (outcome && truth_)
      text_ +=
          number(static_cast<double>((x.template cast<long double>() - x_).norm() / x_.norm()));
    text_ += truth_ ? ',' + number(kS_) + '\n' : ",\n";
  }

  const Model<T>& model_;
  const VectorX<T>& q_;
  const std::vector<ContactRow<T>>& contacts_;
  const VectorX<T>& b_;
  std::string begin_, state_, text_;
  Outcome truth_;
  VectorX<long double> x_;
  double kS_ = 0;
};

template <class T>
std::string rows_of(const Scene& scene, const State& state, int number_of_state,
                    const Standing& standing, const std::vector<double>& stiffness,
                    std::uint64_t seed, const char* precision) {
  const Model<T> model = scene.model.cast<T>();
  const VectorX<T> q = state.q.template cast<T>();
  const std::vector<ContactRow<double>> contacts = contacts_of(scene.model, standing, seed);
  const VectorX<T> b = state.tau.template cast<T>();
  std::string text;
  for (const double d : stiffness) {
    const std::vector<ContactRow<T>> rows = stiffened<T>(contacts, d);
    Answers<T> answers(model, q, rows, b,
                       field(scene.name) + ',' + std::to_string(model.nv()) + ',' +
                           std::to_string(rows.size()) + ',' + number(d) + ',' + precision,
                       std::to_string(number_of_state));
    for_each_contact_variant([&]<class V>() { answers.template add<V>(); });
    answers.add_ladder(default_tolerance<T>);
    if (std::is_same_v<T, double>) answers.add_ladder(last_bits);
    text += answers.text();
  }
  return text;
}

}  // namespace

std::string rows(const Scene& scene, const State& state, int number, const Standing& standing,
                 const std::vector<double>& stiffness, std::uint64_t seed,
                 const std::string& precision) {
  return precision == "float32"
             ? rows_of<float>(scene, state, number, standing, stiffness, seed, "float32")
             : rows_of<double>(scene, state, number, standing, stiffness, seed, "float64");
}

}  // namespace kalmarm::contact_errors
