// What records of the fast path's kernels give, by operations done one by one, against multi-precision and against
// the library.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

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
    Dynamics<double> library(plain(model),
                             spatial({Want::acceleration, Want::inverse_dynamics, Want::mass,
                                      Want::inverse, Want::diagonal, Want::solve}));
    const auto of = [&](GeneratedTask task) { return record<T>(task, model); };
    const TaskRecord a = of(GeneratedTask::forward_dynamics),
                     tau = of(GeneratedTask::inverse_dynamics), M = of(GeneratedTask::mass),
                     X = of(GeneratedTask::inverse_mass), d = of(GeneratedTask::diagonal),
                     x = of(GeneratedTask::solve);
    Errors of_a, of_tau, of_M, of_X, of_d, of_x;
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
      (void)library.diagonal(exact.q, y);
      of_d.add(truth.diagonal(evaluated<T>(d, {state.q})), truth.diagonal(y));
      (void)library.factor(exact.q);
      (void)library.solve(exact.tau, y);
      of_x.add(truth.solution(evaluated<T>(x, {state.q, state.tau})), truth.solution(y));
    }
    const std::string name = family.name;
    of_a.expect_alike<T>(name + ": forward_dynamics");
    of_tau.expect_alike<T>(name + ": inverse_dynamics");
    of_M.expect_alike<T>(name + ": mass");
    of_X.expect_alike<T>(name + ": inverse_mass");
    of_d.expect_alike<T>(name + ": diagonal");
    of_x.expect_alike<T>(name + ": solve");
  }
}

// A judged task, what it judges, and the error of its result as it is estimated.
struct JudgedTask {
  GeneratedTask task, plain;
  double (*error)(const Truth&, const VectorX<double>& x);
};
const JudgedTask judged_tasks[] = {
    {GeneratedTask::judged_forward_dynamics, GeneratedTask::forward_dynamics,
     [](const Truth& truth, const VectorX<double>& a) { return truth.energy(a); }},
    {GeneratedTask::judged_inverse_mass, GeneratedTask::inverse_mass,
     [](const Truth& truth, const VectorX<double>& x) {
       const auto n = std::lround(std::sqrt(x.size()));
       return truth.inverse(MatrixX<double>(x.reshaped(n, n)));
     }},
    {GeneratedTask::judged_diagonal, GeneratedTask::diagonal,
     [](const Truth& truth, const VectorX<double>& x) { return truth.diagonal(x); }},
    {GeneratedTask::judged_solve, GeneratedTask::solve,
     [](const Truth& truth, const VectorX<double>& x) {
       const VectorX<double> exact = truth.solution();
       return (x - exact).norm() / exact.norm();
     }}};

template <class T>
std::vector<T> numbers(const TaskRecord& record, const State<T>& state) {
  std::vector<T> out;
  for (const Argument& input : record.inputs) {
    const VectorX<T>& x = input.name == "q" ? state.q : input.name == "qd" ? state.qd : state.tau;
    out.insert(out.end(), x.begin(), x.end());
  }
  return out;
}

// Where the margin is above zero, the error is at most what is estimated; the result is that of the plain task to the
// last bit.
TYPED_TEST(Record, OfAJudgedTaskEstimatesItsError) {
  using T = TypeParam;
  for (const JudgedTask& judged : judged_tasks) {
    int accepted = 0;
    for (const Family& family : all_families()) {
      const Model<double> model = rounded<T>(family.make(1));
      const TaskRecord record = kalmarm::record<T>(judged.task, model),
                       plain = kalmarm::record<T>(judged.plain, model);
      for (int seed = 0; seed < states; ++seed) {
        const State<double> exact = rounded<T>(random_state(model, seed));
        const std::vector<T> inputs = numbers<T>(record, exact.cast<T>()),
                             out = record.graph.evaluate<T>(record.results, inputs);
        const std::string name = to_string(judged.task) + " of " + family.name;
        const std::size_t size = record.outputs[0].size;
        ASSERT_TRUE(std::equal(out.begin(), out.begin() + size,
                               plain.graph.evaluate<T>(plain.results, inputs).begin()))
            << name;
        const T error = out[size], margin = out[size + 1];
        ASSERT_GE(error, 0) << name;
        if (!(margin > 0)) continue;
        ++accepted;
        const VectorX<T> x = Eigen::Map<const VectorX<T>>(out.data(), size);
        EXPECT_LE(judged.error(Truth(model, exact), x.template cast<double>()), error)
            << name << " " << seed;
      }
    }
    EXPECT_GE(accepted, states * static_cast<int>(all_families().size()) / 2)
        << to_string(judged.task);
  }
}

// A result that is not finite, as of inputs that are not, is never accepted.
TYPED_TEST(Record, OfAJudgedTaskRefusesWhatIsNoNumber) {
  using T = TypeParam;
  for (const JudgedTask& judged : judged_tasks)
    for (const Family& family : all_families()) {
      const Model<double> model = rounded<T>(family.make(1));
      const TaskRecord record = kalmarm::record<T>(judged.task, model);
      const std::vector<T> given = numbers<T>(record, random_state(model, 1).cast<T>());
      for (std::size_t i = 0; i < given.size(); ++i)
        for (const T no_number : {T(NAN), std::numeric_limits<T>::infinity()}) {
          std::vector<T> inputs = given;
          inputs[i] = no_number;
          const std::vector<T> x = record.graph.evaluate<T>(record.results, inputs);
          const bool is_finite = std::all_of(x.begin(), x.begin() + record.outputs[0].size,
                                             [](T number) { return std::isfinite(number); });
          EXPECT_TRUE(is_finite || !(x.back() > 0))
              << to_string(judged.task) << " of " << family.name << ", input " << i;
        }
    }
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
