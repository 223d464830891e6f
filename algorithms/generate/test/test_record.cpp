// What records of the fast path's kernels give, by operations done one by one, against multi-precision and against
// the library.
#include <gtest/gtest.h>

#include <algorithm>

#include "algorithms/fast/test/support.hpp"
#include "algorithms/generate/task.hpp"

namespace kalmarm::test {
namespace {

template <class T>
VectorX<T> evaluated(const TaskRecord& record, const std::vector<VectorX<T>>& inputs) {
  std::vector<T> given;
  for (const VectorX<T>& input : inputs) given.insert(given.end(), input.begin(), input.end());
  const std::vector<T> x = record.graph.evaluate<T>(record.results, given);
  return Eigen::Map<const VectorX<T>>(x.data(), record.outputs[0].size);
}
template <class T>
MatrixX<T> evaluated_matrix(const TaskRecord& record, const VectorX<T>& q, int nv) {
  return evaluated<T>(record, {q}).reshaped(nv, nv);
}

// Largest errors of states in units of roundoff, of the record and of the library. The library is asked in float64: one
// state of float32 it answers in that.
struct Errors {
  double record = 0, library = 0;

  void add(double of_record, double of_library) {
    record = std::max(record, of_record);
    library = std::max(library, of_library);
    is_number &= of_record == of_record;
  }
  template <class T>
  void expect_alike(const std::string& what) const {
    EXPECT_TRUE(is_number) << what;
    constexpr double times =
        std::is_same_v<T, double> ? 2 : 4;  // other numbers are rounded otherwise
    EXPECT_LE(record / unit_roundoff<T>(), times * library / unit_roundoff<double>() + 16) << what;
  }

 private:
  bool is_number = true;
};

template <class T>
class Record : public testing::Test {};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Record, Precisions, PrecisionName);

constexpr int states = 8;

TYPED_TEST(Record, OfEveryTaskIsAsNearToTheTruthAsTheLibrary) {
  using T = TypeParam;
  for (const Family& family : all_families()) {
    const Model<double> model = rounded<T>(family.make(1));
    const int nv = model.nv();
    Dynamics<double> library(plain(model), spatial({Want::acceleration, Want::inverse_dynamics,
                                                    Want::mass, Want::inverse, Want::solve}));
    const auto of = [&](GeneratedTask task) { return record<T>(task, model); };
    const TaskRecord a = of(GeneratedTask::forward_dynamics),
                     tau = of(GeneratedTask::inverse_dynamics), M = of(GeneratedTask::mass),
                     X = of(GeneratedTask::inverse_mass), x = of(GeneratedTask::solve);
    Errors of_a, of_tau, of_M, of_X, of_x;
    for (int seed = 0; seed < states; ++seed) {
      const State<double> exact = rounded<T>(random_state(model, seed));
      const State<T> state = exact.cast<T>();
      const Truth truth(model, exact);
      VectorX<double> y = poisoned<double>(nv);
      MatrixX<double> Y = poisoned<double>(nv, nv);
      (void)library.forward_dynamics(exact.q, exact.qd, exact.tau, y);
      of_a.add(truth.acceleration(evaluated<T>(a, {state.q, state.qd, state.tau})),
               truth.acceleration(y));
      library.inverse_dynamics(exact.q, exact.qd, exact.tau, y);
      of_tau.add(truth.torque(evaluated<T>(tau, {state.q, state.qd, state.tau})), truth.torque(y));
      library.mass(exact.q, Y);
      of_M.add(truth.mass(evaluated_matrix<T>(M, state.q, nv)), truth.mass(Y));
      (void)library.inverse_mass(exact.q, Y);
      of_X.add(truth.inverse(evaluated_matrix<T>(X, state.q, nv)), truth.inverse(Y));
      (void)library.factor(exact.q);
      (void)library.solve(exact.tau, y);
      of_x.add(truth.solution(evaluated<T>(x, {state.q, state.tau})), truth.solution(y));
    }
    const std::string name = family.name;
    of_a.expect_alike<T>(name + ": forward_dynamics");
    of_tau.expect_alike<T>(name + ": inverse_dynamics");
    of_M.expect_alike<T>(name + ": mass");
    of_X.expect_alike<T>(name + ": inverse_mass");
    of_x.expect_alike<T>(name + ": solve");
  }
}

// Where the margin is above zero, the error is at most what is estimated.
TYPED_TEST(Record, OfAJudgedAccelerationEstimatesItsError) {
  using T = TypeParam;
  int accepted = 0;
  for (const Family& family : all_families()) {
    const Model<double> model = rounded<T>(family.make(1));
    const TaskRecord record = kalmarm::record<T>(GeneratedTask::judged_forward_dynamics, model);
    for (int seed = 0; seed < states; ++seed) {
      const State<double> exact = rounded<T>(random_state(model, seed));
      const State<T> state = exact.cast<T>();
      std::vector<T> inputs(state.q.begin(), state.q.end());
      inputs.insert(inputs.end(), state.qd.begin(), state.qd.end());
      inputs.insert(inputs.end(), state.tau.begin(), state.tau.end());
      const std::vector<T> out = record.graph.evaluate<T>(record.results, inputs);
      const VectorX<T> a = Eigen::Map<const VectorX<T>>(out.data(), model.nv());
      const T error = out[model.nv()], margin = out[model.nv() + 1];
      ASSERT_GE(error, 0) << family.name;
      if (!(margin > 0)) continue;
      ++accepted;
      EXPECT_LE(Truth(model, exact).energy(a), error) << family.name << " " << seed;
    }
  }
  EXPECT_GE(accepted, states * static_cast<int>(all_families().size()) / 2);
}

// Of a chain whose axes are parallel and at right angles nothing is worked out that is zero.
TEST(RecordOfAStraightChain, HasFewerOperationsThanThatOfAnyChain) {
  const auto flops = [](const Model<double>& model) {
    const TaskRecord r = record<double>(GeneratedTask::forward_dynamics, model);
    return r.graph.count(r.results).flops();
  };
  EXPECT_LT(2 * flops(straight_chain(7)), flops(chain(1, 7)));
}

}  // namespace
}  // namespace kalmarm::test
