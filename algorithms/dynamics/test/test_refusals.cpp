// What the door refuses: sizes, numbers with gaps between, calls that the question does not want,
// models and questions that contradict themselves.
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "algorithms/dynamics/test/door_support.hpp"

namespace kalmarm::test {
namespace {

template <class T>
using RowMajor = Eigen::Matrix<T, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// --- views

template <class View, class V>
constexpr bool takes = std::is_convertible_v<V, View>;

static_assert(takes<VectorView<const double>, const VectorX<double>&>);
static_assert(takes<VectorView<const double>, const std::vector<double>&>);
static_assert(takes<VectorView<double>, VectorX<double>&>);
static_assert(!takes<VectorView<double>, const VectorX<double>&>, "a result is written");
static_assert(!takes<VectorView<double>, VectorX<float>&>);
static_assert(!takes<VectorView<const float>, const VectorX<double>&>);
using Sum = decltype(std::declval<VectorX<double>>() + std::declval<VectorX<double>>());
static_assert(!takes<VectorView<const double>, Sum>, "an expression holds no numbers");

static_assert(takes<RowsView<const double>, const RowMajor<double>&>);
static_assert(takes<RowsView<const double>, const std::vector<double>&>);
static_assert(takes<RowsView<const double>, const VectorX<double>&>);
static_assert(!takes<RowsView<const double>, const MatrixX<double>&>, "its states are columns");
static_assert(!takes<RowsView<double>, MatrixX<double>&>);
static_assert(!takes<RowsView<const double>, Eigen::Block<MatrixX<double>>>);
static_assert(takes<RowsView<const double>, RowsView<double>>);
static_assert(takes<RowsView<const double>, RowsView<double>&>);
static_assert(takes<RowsView<double>, RowsView<double>&>, "a view with a name");
static_assert(!takes<RowsView<double>, RowsView<const double>>);

static_assert(takes<MatrixView<double>, MatrixX<double>&>);
static_assert(takes<MatrixView<double>, RowMajor<double>&>, "M is symmetric");
static_assert(!takes<MatrixView<double>, const MatrixX<double>&>);

TEST(Views, KeepTheShapeOfWhatTheyAreMadeFrom) {
  RowMajor<double> states(3, 4);
  RowsView<double> rows(states);
  const RowsView<const double> read(rows), copy(read);
  EXPECT_EQ(rows.shape(), "3 x 4");
  EXPECT_EQ(read.shape(), "3 x 4");
  EXPECT_EQ(copy.shape(), "3 x 4");
  EXPECT_FALSE(copy.fits(4, 3));
  VectorX<double> flat(12);
  EXPECT_TRUE(RowsView<const double>(flat).fits(4, 3));
  EXPECT_TRUE(RowsView<const double>(flat).fits(3, 4));
}

TEST(Views, GapsAreRefused) {
  MatrixX<double> X(6, 6);
  RowMajor<double> rows(6, 6);
  EXPECT_THROW((void)VectorView<double>(X.row(1)), std::invalid_argument);
  EXPECT_NO_THROW((void)VectorView<double>(X.col(1)));
  EXPECT_NO_THROW((void)VectorView<double>(rows.row(1)));
  EXPECT_THROW((void)VectorView<double>(rows.col(1)), std::invalid_argument);
  Eigen::Map<VectorX<double>, 0, Eigen::InnerStride<2>> every_other(X.data(), 9);
  EXPECT_THROW((void)VectorView<double>(every_other), std::invalid_argument);
  EXPECT_THROW((void)RowsView<double>(rows.leftCols(3)), std::invalid_argument);
  EXPECT_NO_THROW((void)RowsView<double>(rows.topRows(3)));
  EXPECT_NO_THROW((void)RowsView<double>(rows.topLeftCorner(1, 3)));
  EXPECT_THROW((void)MatrixView<double>(X.topRows(3)), std::invalid_argument);
  EXPECT_NO_THROW((void)MatrixView<double>(X.leftCols(3)));
  EXPECT_THROW((void)MatrixView<double>(rows.leftCols(3)), std::invalid_argument);
}

template <class T>
class Refusals : public testing::Test {};

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Refusals, Precisions, PrecisionName);

// --- sizes

// The message names the call, the argument and both sizes.
template <class F>
void expect_refused(const std::string& call, const std::string& what, const std::string& given,
                    const std::string& needed, const F& f) {
  try {
    f();
    ADD_FAILURE() << call << " takes " << what << " of size " << given;
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(error.what(),
              call + ": " + what + " has size " + given + ", " + needed + " is needed");
  }
}

TYPED_TEST(Refusals, WrongSizesAreRefusedAtEveryCall) {
  using T = TypeParam;
  using V = VectorX<T>;
  using M = MatrixX<T>;
  const Model<double> model = floating_base(5);
  DynamicsOptions options;
  options.question = about({0, 7, 9}, model);  // 3 asked about, 18 rows of J
  Dynamics<T> robot = dynamics_of<T>(model, options);
  const int nq = robot.nq(), nv = robot.nv();
  ASSERT_NE(nq, nv);
  ASSERT_EQ(robot.asked(), 3);
  const auto number = [](int n) { return std::to_string(n); };
  const auto square = [](int n) { return std::to_string(n) + " x " + std::to_string(n); };
  V q = random_state(model, 5).q.template cast<T>();
  V v = V::Zero(nv), asked(3), q_long(nq + 1), v_short(nv - 1), four(4);
  M X(3, 3), wide(3, 4), J(18, 18);
  T x;
  std::vector<Outcome> outcomes(2);
  RowMajor<T> qs(2, nq), vs(2, nv), out(2, 3), qs_long(2, nq + 1), vs_many(3, nv), out_wide(2, 4);

  const auto refused = [&](const char* call, const char* what, const std::string& given,
                           const std::string& needed,
                           const auto& f) { expect_refused(call, what, given, needed, f); };
  const std::string q_given = number(nq + 1), q_needed = number(nq), v_given = number(nv - 1),
                    v_needed = number(nv);

  refused("forward_dynamics", "q", q_given, q_needed,
          [&] { (void)robot.forward_dynamics(q_long, v, v, asked); });
  refused("forward_dynamics", "qd", v_given, v_needed,
          [&] { (void)robot.forward_dynamics(q, v_short, v, asked); });
  refused("forward_dynamics", "tau", v_given, v_needed,
          [&] { (void)robot.forward_dynamics(q, v, v_short, asked); });
  refused("forward_dynamics", "the result", "4", "3",
          [&] { (void)robot.forward_dynamics(q, v, v, four); });

  const std::string qs_needed = "2 x " + q_needed, vs_needed = "2 x " + v_needed;
  refused("forward_dynamics", "q", "2 x " + q_given, qs_needed,
          [&] { (void)robot.forward_dynamics(qs_long, vs, vs, out, outcomes); });
  refused("forward_dynamics", "qd", "3 x " + v_needed, vs_needed,
          [&] { (void)robot.forward_dynamics(qs, vs_many, vs, out, outcomes); });
  refused("forward_dynamics", "tau", "3 x " + v_needed, vs_needed,
          [&] { (void)robot.forward_dynamics(qs, vs, vs_many, out, outcomes); });
  refused("forward_dynamics", "the result", "2 x 4", "2 x 3",
          [&] { (void)robot.forward_dynamics(qs, vs, vs, out_wide, outcomes); });
  refused("forward_dynamics", "q", q_needed, qs_needed,
          [&] { (void)robot.forward_dynamics(std::vector<T>(nq), vs, vs, out, outcomes); });

  refused("inverse_dynamics", "q", q_given, q_needed,
          [&] { robot.inverse_dynamics(q_long, v, v, asked); });
  refused("inverse_dynamics", "qd", v_given, v_needed,
          [&] { robot.inverse_dynamics(q, v_short, v, asked); });
  refused("inverse_dynamics", "qdd", v_given, v_needed,
          [&] { robot.inverse_dynamics(q, v, v_short, asked); });
  refused("inverse_dynamics", "the result", "4", "3",
          [&] { robot.inverse_dynamics(q, v, v, four); });
  refused("inverse_dynamics", "q", "2 x " + q_given, qs_needed,
          [&] { robot.inverse_dynamics(qs_long, vs, vs, out, 1); });
  refused("inverse_dynamics", "qd", "3 x " + v_needed, vs_needed,
          [&] { robot.inverse_dynamics(qs, vs_many, vs, out, 1); });
  refused("inverse_dynamics", "qdd", "3 x " + v_needed, vs_needed,
          [&] { robot.inverse_dynamics(qs, vs, vs_many, out, 1); });
  refused("inverse_dynamics", "the result", "2 x 4", "2 x 3",
          [&] { robot.inverse_dynamics(qs, vs, vs, out_wide, 2); });

  refused("bias", "q", q_given, q_needed, [&] { robot.bias(q_long, v, asked); });
  refused("bias", "qd", v_given, v_needed, [&] { robot.bias(q, v_short, asked); });
  refused("bias", "the result", "4", "3", [&] { robot.bias(q, v, four); });
  refused("gravity", "q", q_given, q_needed, [&] { robot.gravity(q_long, asked); });
  refused("gravity", "tau", "4", "3", [&] { robot.gravity(q, four); });
  refused("mass", "q", q_given, q_needed, [&] { robot.mass(q_long, X); });
  refused("mass", "M", "3 x 4", square(3), [&] { robot.mass(q, wide); });
  refused("inverse_mass", "q", q_given, q_needed, [&] { (void)robot.inverse_mass(q_long, X); });
  refused("inverse_mass", "X", "3 x 4", square(3), [&] { (void)robot.inverse_mass(q, wide); });
  refused("factor", "q", q_given, q_needed, [&] { (void)robot.factor(q_long); });
  refused("diagonal", "q", q_given, q_needed, [&] { (void)robot.diagonal(q_long, asked); });
  refused("diagonal", "x", "4", "3", [&] { (void)robot.diagonal(q, four); });
  refused("log_det", "q", q_given, q_needed, [&] { (void)robot.log_det(q_long, x); });
  refused("operational", "q", q_given, q_needed, [&] { (void)robot.operational(q_long, J); });
  refused("operational", "X", "3 x 3", square(18), [&] { (void)robot.operational(q, X); });
  refused("operational_diagonal", "q", q_given, q_needed,
          [&] { (void)robot.operational_diagonal(q_long, J); });
  refused("operational_diagonal", "x", "4", "18",
          [&] { (void)robot.operational_diagonal(q, four); });

  ASSERT_TRUE(robot.factor(q));
  const std::string columns = "3 x any, column-major,", square_columns = "3 x 3, column-major,";
  refused("solve", "tau", "4 x 1", columns, [&] { (void)robot.solve(four, asked); });
  refused("solve", "tau", "4", columns, [&] { (void)robot.solve(std::vector<T>(4), asked); });
  refused("solve", "x", "4 x 1", "3 x 1, column-major,", [&] { (void)robot.solve(asked, four); });
  refused("solve", "x", "3 x 4", square_columns, [&] { (void)robot.solve(X, wide); });
  RowMajor<T> by_rows(3, 3);
  refused("solve", "tau", "3 x 3", columns, [&] { (void)robot.solve(by_rows, X); });
  refused("solve", "x", "3 x 3", square_columns, [&] { (void)robot.solve(X, by_rows); });
  EXPECT_THROW((void)robot.solve(X, X), std::invalid_argument);

  refused("derivatives", "q", q_given, q_needed,
          [&] { (void)robot.derivatives(q_long, v, v, {.dq = X}, asked); });
  refused("derivatives", "qd", v_given, v_needed,
          [&] { (void)robot.derivatives(q, v_short, v, {.dq = X}, asked); });
  refused("derivatives", "tau", v_given, v_needed,
          [&] { (void)robot.derivatives(q, v, v_short, {.dq = X}, asked); });
  refused("derivatives", "the result", "4", "3",
          [&] { (void)robot.derivatives(q, v, v, {.dq = X}, four); });
  refused("derivatives", "dq", "3 x 4", square_columns,
          [&] { (void)robot.derivatives(q, v, v, {.dq = wide}, asked); });
  refused("derivatives", "dqd", "3 x 4", square_columns,
          [&] { (void)robot.derivatives(q, v, v, {.dqd = wide}, asked); });
  refused("derivatives", "dtau", "3 x 4", square_columns,
          [&] { (void)robot.derivatives(q, v, v, {.dtau = wide}, asked); });
  refused("derivatives", "dq", "3 x 3", square_columns,
          [&] { (void)robot.derivatives(q, v, v, {.dq = by_rows}, asked); });
  EXPECT_TRUE(robot.derivatives(q, v, v, {.dtau = by_rows}, asked)) << "it is symmetric";
}

// --- what is wanted

TYPED_TEST(Refusals, CallsThatAreNotWantedThrow) {
  using T = TypeParam;
  const Model<double> model = floating_base(5);
  const State<T> s = random_state(model, 3).template cast<T>();
  const int nv = model.nv();
  VectorX<T> x(nv), of_J(18);
  MatrixX<T> X(nv, nv), J(18, 18);
  T number;
  std::vector<Outcome> outcomes(1);
  using Robot = Dynamics<T>;
  const std::vector<std::pair<Want, std::function<void(Robot&)>>> calls{
      {Want::acceleration, [&](Robot& r) { (void)r.forward_dynamics(s.q, s.qd, s.tau, x); }},
      {Want::acceleration,
       [&](Robot& r) { (void)r.forward_dynamics(s.q, s.qd, s.tau, x, outcomes); }},
      {Want::inverse_dynamics, [&](Robot& r) { r.inverse_dynamics(s.q, s.qd, s.tau, x); }},
      {Want::inverse_dynamics, [&](Robot& r) { r.inverse_dynamics(s.q, s.qd, s.tau, x, 1); }},
      {Want::inverse_dynamics, [&](Robot& r) { r.bias(s.q, s.qd, x); }},
      {Want::inverse_dynamics, [&](Robot& r) { r.gravity(s.q, x); }},
      {Want::mass, [&](Robot& r) { r.mass(s.q, X); }},
      {Want::inverse, [&](Robot& r) { (void)r.inverse_mass(s.q, X); }},
      {Want::solve, [&](Robot& r) { (void)r.factor(s.q), (void)r.solve(s.tau, x); }},
      {Want::derivatives, [&](Robot& r) { (void)r.derivatives(s.q, s.qd, s.tau, {.dq = X}, x); }},
      {Want::diagonal, [&](Robot& r) { (void)r.diagonal(s.q, x); }},
      {Want::log_det, [&](Robot& r) { (void)r.log_det(s.q, number); }},
      {Want::operational, [&](Robot& r) { (void)r.operational(s.q, J); }},
      {Want::operational_diagonal, [&](Robot& r) { (void)r.operational_diagonal(s.q, of_J); }}};
  for (const auto& [wanted, unused] : calls) {
    DynamicsOptions options;
    options.question = about(all_but(nv, {}), model);
    options.question.want = {wanted};
    Robot robot = dynamics_of<T>(model, options);
    for (const auto& [want, call] : calls) {
      SCOPED_TRACE(std::string(to_string(wanted)) + ", and called is " + to_string(want));
      try {
        call(robot);
        EXPECT_EQ(want, wanted);
      } catch (const std::logic_error& error) {
        EXPECT_NE(want, wanted);
        EXPECT_EQ(error.what(), std::string("the question does not want ") + to_string(want));
      }
    }
  }
}

TEST(Dynamics, SolvesNothingBeforeItHasFactored) {
  Dynamics<double> robot = dynamics_of<double>(chain(1, 3), {});
  VectorX<double> x(3);
  EXPECT_THROW((void)robot.solve(x, x), std::logic_error);
}

template <class F>
std::string refusal(const F& f) {
  try {
    f();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

TEST(Dynamics, RefusesModelsThatContradictThemselves) {
  const auto refused = [](const auto& change) {
    RobotModel model = plain(floating_base(5));
    change(model);
    return refusal([&] { (void)Dynamics<double>(model); });
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::string dof7 = "robot model: DoF 'dof7': ";
  EXPECT_EQ(refused([](RobotModel&) {}), "");
  EXPECT_EQ(refused([](RobotModel& m) { m.names.pop_back(); }), "robot model: 16 names for 17 DoF");
  EXPECT_EQ(refused([](RobotModel& m) { m.links[7].parent = 7; }),
            dof7 + "parent 7 does not come before it");
  EXPECT_EQ(refused([](RobotModel& m) { m.links[7].parent = -2; }),
            dof7 + "parent -2 does not come before it");
  EXPECT_EQ(refused([](RobotModel& m) { m.links[1].parent = -1; }),
            "robot model: DoF 'dof1': a follower that follows nothing");
  EXPECT_EQ(refused([](RobotModel& m) { m.links[7].q_index = 19; }), dof7 + "q[19] of 19");
  EXPECT_EQ(refused([&](RobotModel& m) { m.links[7].reference = nan; }), dof7 + "reference is nan");
  EXPECT_EQ(refused([&](RobotModel& m) { m.links[7].rotation[2] = nan; }),
            dof7 + "rotation is nan");
  EXPECT_EQ(refused([&](RobotModel& m) { m.links[7].translation[1] = nan; }),
            dof7 + "translation is nan");
  EXPECT_EQ(refused([&](RobotModel& m) { m.links[7].armature = nan; }), dof7 + "armature is nan");
  EXPECT_EQ(refused([&](RobotModel& m) { m.links[7].mass = nan; }), dof7 + "mass is nan");
  EXPECT_EQ(refused([&](RobotModel& m) { m.links[7].center_of_mass[0] = nan; }),
            dof7 + "centre of mass is nan");
  EXPECT_EQ(refused([&](RobotModel& m) { m.links[7].inertia_axes[0] = nan; }),
            dof7 + "inertia axes is nan");
  EXPECT_EQ(refused([&](RobotModel& m) { m.links[7].principal_moments[0] = nan; }),
            dof7 + "principal moment is nan");
  EXPECT_EQ(refused([](RobotModel& m) { m.links[7].armature = -1; }), dof7 + "armature is -1");
  EXPECT_EQ(refused([](RobotModel& m) { m.links[7].mass = -1; }), dof7 + "mass is -1");
  EXPECT_EQ(refused([](RobotModel& m) { m.nq = 20; }), "robot model: nq is 20, its joints read 19");
  EXPECT_EQ(refused([](RobotModel& m) { m.links[8].q_index = m.links[7].q_index; }),
            "robot model: DoF 'dof8': q[8] is another joint's");
}

TEST(Dynamics, RefusesWhatNoRobotCanBe) {
  const auto refused = [](const auto& change) {
    RobotModel model = plain(floating_base(5));
    change(model);
    return refusal([&] { (void)Dynamics<double>(model); });
  };
  const double nan = std::numeric_limits<double>::quiet_NaN(),
               infinite = std::numeric_limits<double>::infinity();
  const std::string dof7 = "robot model: DoF 'dof7': ";
  using M = RobotModel;
  EXPECT_EQ(refused([](M& m) { m.links[7].rotation = {}; }),
            dof7 + "rotation: a quaternion of no length");
  EXPECT_EQ(refused([](M& m) {
              m.links[7].rotation = {0, 1e-200, 0, 0};
            }),
            dof7 + "rotation: a quaternion of no length");
  EXPECT_EQ(refused([](M& m) { m.links[7].inertia_axes = {}; }),
            dof7 + "inertia axes: a quaternion of no length");
  EXPECT_EQ(refused([](M& m) { m.links[7].rotation = {0, 3, 0, 4}; }), "") << "of any other length";
  EXPECT_EQ(refused([&](M& m) { m.gravity[1] = nan; }), "robot model: gravity is nan");
  EXPECT_EQ(refused([&](M& m) { m.gravity[2] = -infinite; }), "robot model: gravity is -inf");
  EXPECT_EQ(refused([](M& m) {
              m.links[7].principal_moments = {0.1, -0.1, 0.1};
            }),
            dof7 + "principal moment is -0.1");
  EXPECT_EQ(refused([](M& m) {
              m.links[7].principal_moments = {0.1, 0.1, 5};
            }),
            "")
      << "no solid body has them, but the loader takes them as given";
  EXPECT_EQ(refused([](M& m) {
              m.links[7].principal_moments = {-1e-18, 0.1, 0.1};
            }),
            "")
      << "rounding";
  EXPECT_EQ(refused([](M& m) { m.links[7].coordinate = static_cast<Coordinate>(77); }),
            dof7 + "coordinate 77 is none");
  EXPECT_EQ(refused([](M& m) { m.links[7].slides = !m.links[7].slides; }),
            dof7 + "its coordinate is an angle or a quaternion, but it slides");
  EXPECT_EQ(refused([](M& m) { m.links[1].slides = false; }),
            "robot model: DoF 'dof1': of one joint a DoF slides and another turns");
  EXPECT_NE(refused([](M& m) { m.links[2].coordinate = Coordinate::angle; }), "")
      << "two DoF of a position";
  EXPECT_EQ(refusal([] { (void)dynamics_of<double>(floating_base(5), {.tolerance = 1e-17}); }),
            "options: tolerance 1e-17 is not within 8.88e-16 and 1");
}

TEST(Dynamics, RefusesWhatItsScalarDoesNotHold) {
  RobotModel model = plain(floating_base(5));
  model.links[7].mass = 1e50;
  EXPECT_EQ(refusal([&] { (void)Dynamics<double>(model); }), "");
  EXPECT_EQ(refusal([&] { (void)Dynamics<float>(model); }),
            "robot model: DoF 'dof7': mass is 1e50, more than 3.40282e38");
}

template <class F>
std::string wrong_use(const F& f) {
  try {
    f();
  } catch (const std::logic_error& error) {
    return error.what();
  }
  return "";
}

// Every call, since each of them would follow a null pointer.
TYPED_TEST(Refusals, ObjectsThatWereMovedFromAnswerNothing) {
  using T = TypeParam;
  const Model<double> model = floating_base(5);
  const State<T> s = random_state(model, 3).template cast<T>();
  const int nv = model.nv();
  DynamicsOptions options;
  options.question = about(all_but(nv, {}), model);
  Dynamics<T> robot = dynamics_of<T>(model, options);
  Dynamics<T> moved = std::move(robot);
  VectorX<T> x(nv);
  MatrixX<T> X(nv, nv), J(18, 18);
  T number;
  std::vector<Outcome> outcomes(1);
  using Robot = Dynamics<T>;
  const std::vector<std::function<void(Robot&)>> calls{
      [&](Robot& r) { (void)r.plan(); },
      [&](Robot& r) { (void)r.forward_dynamics(s.q, s.qd, s.tau, x); },
      [&](Robot& r) { (void)r.forward_dynamics(s.q, s.qd, s.tau, x, outcomes); },
      [&](Robot& r) { r.inverse_dynamics(s.q, s.qd, s.tau, x); },
      [&](Robot& r) { r.inverse_dynamics(s.q, s.qd, s.tau, x, 1); },
      [&](Robot& r) { r.bias(s.q, s.qd, x); },
      [&](Robot& r) { r.gravity(s.q, x); },
      [&](Robot& r) { r.mass(s.q, X); },
      [&](Robot& r) { (void)r.inverse_mass(s.q, X); },
      [&](Robot& r) { (void)r.factor(s.q); },
      [&](Robot& r) { (void)r.solve(s.tau, x); },
      [&](Robot& r) { (void)r.derivatives(s.q, s.qd, s.tau, {.dq = X}, x); },
      [&](Robot& r) { (void)r.diagonal(s.q, x); },
      [&](Robot& r) { (void)r.log_det(s.q, number); },
      [&](Robot& r) { (void)r.operational(s.q, J); }};
  ASSERT_TRUE(moved.factor(s.q));
  for (const auto& call : calls) {
    EXPECT_EQ(wrong_use([&] { call(robot); }), "Dynamics: was moved from, and answers nothing");
    EXPECT_EQ(wrong_use([&] { call(moved); }), "");
  }
}

TEST(Dynamics, RefusesQuestionsThatHoldNoNumbersOrTurns) {
  const Model<double> model = floating_base(5);  // q: 3 lengths, a quaternion, hinges
  const auto refused = [&](const Question& question) {
    return refusal([&] { (void)dynamics_of<double>(model, {.question = question}); });
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> q(model.nq(), 0);
  EXPECT_EQ(refused({.locked = {3, 4, 5}, .q = q}),
            "question: the quaternion of the locked DoF 'dof3' has no length");
  q[3] = 1;
  EXPECT_EQ(refused({.locked = {3, 4, 5}, .q = q}), "");
  q[8] = nan;
  EXPECT_EQ(refused({.locked = {3, 4, 5}, .q = q}), "") << "of a joint that is free";
  EXPECT_EQ(refused({.locked = {7}, .q = q}),
            "question: q[8] of the locked DoF 'dof7' is not finite");
  const std::string bad =
      "question: a frame on link 2 has a quaternion of no length or a number that is not finite";
  EXPECT_EQ(refused({.frames = {Frame{2, {0, 0, 0, 0}}}}), bad);
  EXPECT_EQ(refused({.frames = {Frame{2, {1, 0, 0, 0}, {0, nan, 0}}}}), bad);
}

TEST(Dynamics, RefusesQuestionsThatContradictThemselves) {
  const Model<double> model = floating_base(5);
  const auto refused = [&](const Question& question) {
    return refusal([&] { (void)dynamics_of<double>(model, {.question = question}); });
  };
  const std::vector<double> q(model.nq(), 0);
  EXPECT_EQ(refused({.dofs = {3, 17}}), "question: DoF 17 of a robot with 17");
  EXPECT_EQ(refused({.dofs = {-1}}), "question: DoF -1 of a robot with 17");
  EXPECT_EQ(refused({.dofs = {3, 3}}), "question: DoF are named once, in rising order");
  EXPECT_EQ(refused({.dofs = {4, 3}}), "question: DoF are named once, in rising order");
  EXPECT_EQ(refused({.dofs = {7}, .locked = {7}, .q = q}),
            "question: DoF 'dof7' is locked and asked about");
  EXPECT_EQ(refused({.locked = {1}, .q = q}),
            "question: DoF 'dof1': of a joint all DoF are locked or none");
  EXPECT_EQ(refused({.frames = {Frame{17}}}), "question: a frame on link 17 of a robot with 17");
  EXPECT_EQ(refused({.locked = {7}}), "question: q holds 0 numbers, 19 are needed");
  EXPECT_EQ(refused({.q = {1, 2}}), "question: q holds 2 numbers, 19 are needed");
}

}  // namespace
}  // namespace kalmarm::test
