// Answers of a plan allocate nothing, whatever is asked and whichever rules are on.
#include <gtest/gtest.h>

#include "algorithms/pruning/answer.hpp"
#include "algorithms/test/allocations.hpp"
#include "algorithms/test/models.hpp"

namespace kalmarm::test {
namespace {

template <class T>
void expect_no_allocation(const Model<double>& model, const Question& question,
                          const std::set<Rule>& rules) {
  const Plan plan = make_plan(model, question, rules);
  Answer<T> answer(plan, solvers_of<T>("Structured"));
  const State<T> state = random_state(model, 5).cast<T>();
  const int n = answer.nv(), rows = answer.rows();
  VectorX<T> x(n);
  MatrixX<T> X(n, n), Y(rows, rows);
  T log_det(0);
  const auto expect_none = [](const char* what, const auto& call) {
    const long before = allocations;
    const bool ok = call();
    EXPECT_EQ(allocations - before, 0) << what;
    EXPECT_TRUE(ok) << what;
  };
  expect_none("acceleration",
              [&] { return bool(answer.acceleration(state.q, state.qd, state.tau, x)); });
  expect_none("inverse", [&] { return bool(answer.inverse(state.q, X)); });
  expect_none("diagonal", [&] { return bool(answer.diagonal(state.q, x)); });
  expect_none("operational", [&] { return bool(answer.operational(state.q, Y)); });
  if (question.dofs.empty())
    expect_none("log_det", [&] { return bool(answer.log_det(state.q, log_det)); });
  expect_none("mass", [&] { return answer.mass(state.q, X), true; });
}

TEST(Answers, AllocateNothing) {
  const std::set<Rule> all(all_rules().begin(), all_rules().end());
  for (Model<double> (*make)(std::uint64_t) : {forest, tree, slides, armature}) {
    const Model<double> model = make(3);
    Question question;
    question.want = {Want::acceleration, Want::inverse, Want::diagonal,
                     Want::mass,         Want::log_det, Want::operational};
    question.q = VectorX<double>::Zero(model.nq());
    question.sites = {Site<double>{.link = model.nv() - 1}};
    for (const std::set<Rule>& rules : {all, std::set<Rule>()}) {
      expect_no_allocation<double>(model, question, rules);
      expect_no_allocation<float>(model, question, rules);
      Question some = question;
      some.want.erase(Want::log_det);
      some.dofs = {1, 4};
      some.locked = {0, 2};
      expect_no_allocation<double>(model, some, rules);
    }
  }
}

}  // namespace
}  // namespace kalmarm::test
