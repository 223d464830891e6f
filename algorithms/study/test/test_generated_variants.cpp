// Records of the study's variants against multi-precision and against the variants that they are of.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "algorithms/fast/test/support.hpp"
#include "algorithms/generate/c_library.hpp"
#include "algorithms/generate/package.hpp"
#include "algorithms/generate/recorded.hpp"
#include "algorithms/study/generated/generated_variants.hpp"
#include "algorithms/test/temporary_folder.hpp"

namespace kalmarm::test {
namespace {

using enum GeneratedTask;

std::string inner_name(const std::string& generated) {
  const std::size_t first = std::string("Generated<").size();
  return generated.substr(first, generated.size() - first - 1);
}

const GeneratedVariant& generated(const std::string& inner) {
  return *std::ranges::find(generated_variants(), "Generated<" + inner + ">",
                            &GeneratedVariant::name);
}

OperationCount count(const std::string& inner, GeneratedTask task, const Model<double>& model) {
  const TaskRecord record = generated(inner).record(task, model);
  return record.graph.count(record.results);
}
int flops(const std::string& inner, GeneratedTask task, const Model<double>& model) {
  return count(inner, task, model).flops();
}

template <class T>
struct Answers {
  Outcome solved, inverted, factored;
  VectorX<T> a, x;
  MatrixX<T> X;

  Answers(Solver<T>& solver, const State<T>& state)
      : a(poisoned<T>(state.qd.size())), x(a), X(poisoned<T>(a.size(), a.size())) {
    solved = solver.acceleration(state.q, state.qd, state.tau, a);
    inverted = solver.inverse(state.q, X);
    factored = solver.factor(state.q);
    if (factored) solver.solve(state.tau, x);
  }

  bool all() const { return solved && inverted && factored; }
  bool none_is_nan() const { return a.allFinite() && X.allFinite() && x.allFinite(); }
};

// Of a, M^-1 tau and M^-1, of some states.
struct Errors {
  std::vector<double> a, x, X;

  template <class T>
  void add(const Truth& truth, const Answers<T>& answers) {
    a.push_back(truth.acceleration(answers.a));
    x.push_back(truth.solution(answers.x));
    X.push_back(truth.inverse(answers.X));
  }
};

double largest(const std::vector<double>& errors) {
  return errors.empty() ? 0 : *std::ranges::max_element(errors);
}
double median(std::vector<double> errors) {
  if (errors.empty()) return 0;
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  return *middle;
}

template <class T>
class GeneratedVariants : public testing::Test {
 protected:
  // Of every variant on every family that it takes, with its truths in some states.
  template <class Check>
  static void for_each(const std::function<State<double>(const Model<double>&, int)>& state,
                       int states, const Check& check) {
    for (const Family& family : all_families()) {
      const Model<double> model = rounded<T>(family.make(1));
      std::vector<State<T>> drawn;
      std::vector<Truth> truths;
      for (int i = 0; i < states; ++i) {
        const State<double> exact = rounded<T>(state(model, i));
        drawn.push_back(exact.cast<T>());
        truths.emplace_back(model, exact);
      }
      for (const RegisteredVariant<T>& variant : evaluated_variants<T>()) {
        SCOPED_TRACE(variant.name + " on " + family.name);
        const Model<T> narrow = model.cast<T>();
        if (!variant.takes(narrow)) continue;
        const auto solver = variant.make(narrow),
                   inner = make_solver<T>(inner_name(variant.name), narrow);
        Errors of_generated, of_inner;
        int failed = 0;
        for (int i = 0; i < states; ++i) {
          const Answers<T> answers(*solver, drawn[i]);
          if (!answers.all()) {
            EXPECT_FALSE(answers.none_is_nan());
            ++failed;
            continue;
          }
          of_generated.add(truths[i], answers);
          of_inner.add(truths[i], Answers<T>(*inner, drawn[i]));
        }
        check(variant.name, family.name, failed, of_generated, of_inner);
      }
    }
  }

  // The largest of few states varies more than the median does.
  static void expect_alike(const Errors& of_generated, const Errors& of_inner) {
    const double few = 16 * static_cast<double>(unit_roundoff<T>());
    for (const auto errors : {&Errors::a, &Errors::x, &Errors::X}) {
      EXPECT_LE(median(of_generated.*errors), 2 * median(of_inner.*errors) + few);
      EXPECT_LE(largest(of_generated.*errors), 4 * largest(of_inner.*errors) + few);
    }
  }
};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(GeneratedVariants, Precisions, PrecisionName);

// Below massless links the last column of A+ is zero but for rounding; where it is exactly zero, MGS divides by it.
bool may_fail(const std::string& variant, const std::string& family) {
  return variant == "Generated<Sequential<ArrayMGS>>" && family == "massless_links";
}

// Roundings differ, since constants are worked out in double.
TYPED_TEST(GeneratedVariants, ErrAtMostTwiceAsMuchAsWhatTheyAreOf) {
  constexpr int states = 16;
  this->for_each([](const Model<double>& model, int i) { return random_state(model, i); }, states,
                 [&](const std::string& variant, const std::string& family, int failed,
                     const Errors& of_generated, const Errors& of_inner) {
                   EXPECT_LE(failed, may_fail(variant, family) ? states / 2 : 0);
                   this->expect_alike(of_generated, of_inner);
                 });
}

// Joints at their references and turned by right angles: what a variant asks of values may be decided otherwise
// there than in the reference state of the record.
TYPED_TEST(GeneratedVariants, InSpecialPositionsAreRightOrFail) {
  int answered = 0;
  this->for_each(
      [](const Model<double>& model, int i) {
        State<double> state = random_state(model, 1);
        for (int k = 0; k < model.nv(); ++k) {
          const Joint<double>& joint = model.joint(k);
          if (joint.coordinate == Coordinate::angle || joint.coordinate == Coordinate::distance)
            state.q[joint.q_index] = joint.ref + i * 1.5707963267948966;
        }
        return state;
      },
      2,
      [&](const std::string&, const std::string&, int failed, const Errors& of_generated,
          const Errors& of_inner) {
        answered += 2 - failed;
        EXPECT_LE(largest(of_generated.a), 8 * largest(of_inner.a) + 1e-3);
        EXPECT_LE(largest(of_generated.X), 8 * largest(of_inner.X) + 1e-3);
      });
  EXPECT_GT(answered, 0);
}

TYPED_TEST(GeneratedVariants, NaNIsNeverAnswered) {
  using T = TypeParam;
  const Model<double> model = tree(1);
  for (const RegisteredVariant<T>& variant : evaluated_variants<T>()) {
    State<T> state = random_state(model, 1).template cast<T>();
    state.q[0] = std::numeric_limits<T>::quiet_NaN();
    EXPECT_FALSE(Answers<T>(*variant.make(model.cast<T>()), state).solved) << variant.name;
  }
}

// As C, of one state and of rows: those with roots, signs and weights.
TYPED_TEST(GeneratedVariants, CompiledGiveWhatTheirRecordsGive) {
  using T = TypeParam;
  const Model<double> model = chain(1, 3);
  const TemporaryFolder folder;
  for (const char* inner :
       {"Sequential<ArrayHouseholder>", "Sequential<ArrayGivens>", "Sequential<UD>"}) {
    const Package<T> package(model, std::vector<double>(model.nq(), 0.0),
                             {.name = "arm", .rows = true},
                             {generated(inner).record(forward_dynamics, model)});
    auto files = package.files({});
    files.erase("arm_test.c");
    files.erase("arm.md");
    const CLibrary library = make_library(
        files, {{KALMARM_TEST_COMPILER}, {"-O1", "-march=native", "-Wall", "-Wextra", "-Werror"}},
        folder.path());
    const auto one =
        library.function<void(const T*, const T*, const T*, T*)>("arm_forward_dynamics");
    const auto rows = library.function<void(std::size_t, const T*, const T*, const T*, T*)>(
        "arm_forward_dynamics_rows");
    ASSERT_TRUE(one && rows);
    const TaskRecord& record = package.records()[0];
    constexpr int states = 21, n = 3;
    std::vector<T> q, qd, tau, many(states * n);
    for (int i = 0; i < states; ++i) {
      const State<T> state = random_state(model, i).template cast<T>();
      q.insert(q.end(), state.q.begin(), state.q.end());
      qd.insert(qd.end(), state.qd.begin(), state.qd.end());
      tau.insert(tau.end(), state.tau.begin(), state.tau.end());
    }
    rows(states, q.data(), qd.data(), tau.data(), many.data());
    for (int i = 0; i < states; ++i) {
      VectorX<T> a = poisoned<T>(n);
      one(&q[i * n], &qd[i * n], &tau[i * n], a.data());
      std::vector<T> given(&q[i * n], &q[i * n] + n);
      given.insert(given.end(), &qd[i * n], &qd[i * n] + n);
      given.insert(given.end(), &tau[i * n], &tau[i * n] + n);
      const std::vector<T> x = record.graph.template evaluate<T>(record.results, given);
      const auto expected = Eigen::Map<const VectorX<T>>(x.data(), n);
      const T few = 1000 * unit_roundoff<T>() * expected.norm();
      EXPECT_LE((a - expected).norm(), few) << inner << " " << i;
      EXPECT_LE((Eigen::Map<const VectorX<T>>(&many[i * n], n) - expected).norm(), few)
          << inner << " " << i;
    }
  }
}

TEST(GeneratedVariant, IsTheSameToTheByteForTheSameRobot) {
  const auto files = [] {
    const Model<double> model = tree(1);
    return Package<double>(model, std::vector<double>(model.nq(), 0.0), {.name = "arm"},
                           {generated("Sequential<ArrayGivens>").record(inverse_mass, model)})
        .files({});
  };
  EXPECT_EQ(files(), files());
}

// By Cholesky one of a pivot; by Gram and Schmidt of D and of the five columns of A+, but for the base's.
TEST(GeneratedVariant, TakesTheRootsThatItsEquationsHave) {
  constexpr int n = 7;
  const Model<double> model = chain(1, n);
  const auto roots = [&](const char* inner) { return count(inner, forward_dynamics, model).roots; };
  for (const char* inner : {"Sequential<Conventional>", "Sequential<Joseph>", "Sequential<UD>",
                            "ClosedForm<Conventional>", "Batch<SparseLTDL>"})
    EXPECT_EQ(roots(inner), 0) << inner;
  EXPECT_EQ(roots("Batch<EigenLLT>"), n);
  for (const char* inner : {"Sequential<ArrayMGS>", "Sequential<ArrayHouseholder>"})
    EXPECT_EQ(roots(inner), 5 * (n - 1) + 1) << inner;
  EXPECT_GT(roots("Sequential<ArrayGivens>"), roots("Sequential<ArrayHouseholder>"));
}

// What the headers say of a link: kinematics, an update, a filter and a smoother.
TEST(GeneratedVariant, TakesAtMostTheOperationsOfItsHeaders) {
  constexpr int n = 12;
  const Model<double> model = chain(1, n);
  constexpr double others = 20 + 110 + 220;
  const auto expect = [&](const char* inner, double update) {
    const double per_link = double(flops(inner, forward_dynamics, model)) / n;
    EXPECT_LE(per_link, update + others) << inner;
    EXPECT_GE(per_link, (update + others) / 4) << inner << ": is it all there?";
  };
  expect("Sequential<Conventional>", 400);
  expect("Sequential<Joseph>", 480);
  expect("Sequential<UD>", 1400);
  expect("Sequential<ArrayMGS>", 1300);
  expect("Sequential<ArrayHouseholder>", 1300);
  expect("Sequential<ArrayGivens>", 1500);
}

TEST(GeneratedVariant, OfAStraightChainHasFewerOperations) {
  for (const GeneratedVariant& variant : generated_variants())
    EXPECT_LT(1.5 * flops(inner_name(variant.name), forward_dynamics, straight_chain(7)),
              flops(inner_name(variant.name), forward_dynamics, chain(1, 7)))
        << variant.name;
}

TEST(GeneratedVariant, OfTheLongestRobotTakenIsShortEnoughForCompilers) {
  for (const GeneratedVariant& variant : generated_variants())
    EXPECT_LE(flops(inner_name(variant.name), inverse_mass, chain(1, most_recorded_dofs)),
              most_generated_operations)
        << variant.name;
}

// A point on an axis that turns about nothing else.
TEST(GeneratedVariant, RefusesWhatIsRefusedInTheReferenceState) {
  Random random(1);
  Builder builder;
  Joint<double> joint = random_joint(random, -1);
  joint.body.com.setZero();
  joint.body.moments.setZero();
  builder.add(joint);
  const auto variant = evaluated_variants<double>().front();
  const auto solver = variant.make(builder.build());
  const VectorX<double> zero = VectorX<double>::Zero(1);
  VectorX<double> a = zero;
  const Outcome outcome = solver->acceleration(zero, zero, zero, a);
  EXPECT_EQ(outcome.status, Outcome::Status::singular);
  EXPECT_EQ(outcome.joint, 0);
}

TEST(Recorded, ABranchIsDecidedInTheReferenceState) {
  Graph graph;
  const Recording recording(graph);
  const Recorded x = Recorded::input(2), y = Recorded::input(3);
  EXPECT_TRUE(x < y && x * y > 5.0 && x <= y && !(x >= y));
  EXPECT_FALSE(x == 2.0);  // in another state it is not
  EXPECT_THROW((void)(Recorded::input() < x), std::logic_error);
}

}  // namespace
}  // namespace kalmarm::test
