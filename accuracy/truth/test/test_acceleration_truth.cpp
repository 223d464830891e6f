// What campaigns judge by: as right as it says, which truth.hpp knows to more digits.
#include <gtest/gtest.h>

#include <string>

#include "accuracy/measures/measures.hpp"
#include "accuracy/truth/acceleration_truth.hpp"
#include "algorithms/test/models.hpp"

namespace kalmarm {
namespace {

using test::Random;

constexpr double promised = 0x1p-64;

struct Problem {
  Model<double> model;
  VectorX<double> q;
  std::vector<Task<double>> tasks;  // white innovations, full dynamics, tau = M a

  Problem(Model<double> of, std::uint64_t seed)
      : model(std::move(of)), q(test::random_state(model, seed).q) {
    Random random(seed);
    const VectorX<double> zero = VectorX<double>::Zero(model.nv());
    tasks = {{random.vector(model.nv()), zero, Drive::innovations, false},
             {random.vector(model.nv()), random.vector(model.nv())},
             {random.vector(model.nv()), zero, Drive::acceleration, false}};
  }

  // The torques as they are, so that two truths answer one question.
  template <class T>
  std::vector<Task<T>> driven_by(const Truth<T>& truth) const {
    std::vector<Task<T>> out;
    for (std::size_t i = 0; i < tasks.size(); ++i)
      out.push_back({truth.responses[i].tau, tasks[i].qd.template cast<T>(), Drive::torque,
                     tasks[i].gravity});
    return out;
  }

  template <class T>
  std::vector<Task<T>> rounded() const {
    std::vector<Task<T>> out;
    for (const Task<double>& task : tasks)
      out.push_back(
          {task.value.template cast<T>(), task.qd.template cast<T>(), task.drive, task.gravity});
    return out;
  }
};

class EveryAcceleration : public testing::TestWithParam<test::Family> {};

template <class T>
void expect_as_right_as_said(const Problem& problem) {
  const Model<T> model = problem.model.cast<T>();
  const VectorX<T> q = problem.q.cast<T>();
  const Truth<T> quick = acceleration_truth(model, q, problem.rounded<T>(), {.draws = 6});
  ASSERT_TRUE(quick.outcome);
  EXPECT_EQ(quick.digits, 38u);
  EXPECT_LE(quick.largest_width(), promised);
  const Truth<T> exact = truth(model, q, problem.driven_by(quick), {.draws = 6});
  const Digits digits(exact.digits);
  EXPECT_LE(matrix_error(quick.M, exact.M).scaled, quick.width.M + exact.width.M);
  for (std::size_t i = 0; i < exact.responses.size(); ++i) {
    SCOPED_TRACE(i);
    const Response<T>&said = quick.responses[i], &known = exact.responses[i];
    const AccelerationError error = acceleration_error(said.a, known.a, exact.M);
    EXPECT_LE(error.relative, said.width.relative + known.width.relative);
    EXPECT_LE(error.energy, said.width.energy + known.width.energy);
    EXPECT_NEAR(said.kS.relative / known.kS.relative, 1, 0.01);
    EXPECT_NEAR(said.kS.energy / known.kS.energy, 1, 0.01);
  }
}

TEST_P(EveryAcceleration, IsAsRightAsItSays) {
  for (const std::uint64_t seed : {1, 2}) {
    const Problem problem(GetParam().make(seed), seed);
    SCOPED_TRACE(seed);
    expect_as_right_as_said<float>(problem);
    expect_as_right_as_said<double>(problem);
  }
}

INSTANTIATE_TEST_SUITE_P(Families, EveryAcceleration, testing::ValuesIn(test::families()),
                         [](const auto& info) { return std::string(info.param.name); });

// The white torque is that of truth.hpp but for its last bit.
TEST(AccelerationTruth, DrivesByTheSameTorques) {
  const Problem problem(test::chain(3), 3);
  const auto quick = acceleration_truth(problem.model, problem.q, problem.tasks),
             exact = truth(problem.model, problem.q, problem.tasks);
  for (std::size_t i = 0; i < problem.tasks.size(); ++i)
    EXPECT_LE((quick.responses[i].tau - exact.responses[i].tau).norm(),
              0x1p-52 * exact.responses[i].tau.norm());
}

// Eight joints of a tip that is so heavy that 38 digits do not show the others.
Problem beyond_38_digits() {
  Random random(7);
  test::Builder builder;
  for (int k = 0; k < 8; ++k) {
    Joint<double> joint = test::random_joint(random, k - 1);
    if (k == 7) joint.body.moments *= 1e60;
    builder.add(joint);
  }
  return {builder.build(), 1};
}

TEST(AccelerationTruth, TakesTheDigitsThatTheProofNeeds) {
  const Problem problem = beyond_38_digits();
  const auto t = acceleration_truth(problem.model, problem.q, problem.tasks);
  ASSERT_TRUE(t.outcome);
  EXPECT_GT(t.digits, 38u);
  EXPECT_LE(t.largest_width(), 1e-25);
  EXPECT_THROW((void)acceleration_truth(problem.model, problem.q, problem.tasks, {.digits = 45}),
               NoTruth);
}

TEST(AccelerationTruth, SaysWhatIsSingular) {
  Problem problem(test::chain(1), 1);
  std::vector<Joint<double>> joints;
  for (int k = 0; k < problem.model.nv(); ++k) joints.push_back(problem.model.joint(k));
  joints.back().body.mass = 0;
  joints.back().body.moments.setZero();
  joints.back().r = 0;
  problem.model = {joints, problem.model.names(), problem.model.nq(), problem.model.gravity()};
  const auto t = acceleration_truth(problem.model, problem.q, problem.tasks);
  EXPECT_EQ(t.outcome.status, Outcome::Status::singular);
}

TEST(AccelerationTruth, LongChainNeedsNoMatrices) {
  const Problem problem(test::chain(1, 200), 1);
  const auto t = acceleration_truth(problem.model, problem.q, problem.tasks, {.matrices = false});
  ASSERT_TRUE(t.outcome);
  EXPECT_EQ(t.M.size(), 0);
  EXPECT_LE(t.largest_width(), promised);
}

}  // namespace
}  // namespace kalmarm
