// What records of the fast path's kernels give, by operations done one by one, against multi-precision and against
// the library.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "algorithms/fast/test/support.hpp"
#include "algorithms/generate/task.hpp"
#include "algorithms/spatial/principal_axes.hpp"
#include "kalmarm/implicit_step.hpp"

namespace kalmarm::test {
namespace {

// What a state is and, of some tasks, what else they are given.
template <class T>
std::vector<T> numbers(const TaskRecord& record, const State<T>& state,
                       const std::map<std::string, VectorX<T>>& more = {}) {
  std::vector<T> out;
  for (const Argument& input : record.inputs) {
    const VectorX<T>& x = input.name == "q"                            ? state.q
                          : input.name == "qd"                         ? state.qd
                          : input.name == "tau" || input.name == "qdd" ? state.tau
                                                                       : more.at(input.name);
    out.insert(out.end(), x.begin(), x.end());
  }
  return out;
}

// The results, by their names.
template <class T>
std::map<std::string, VectorX<T>> evaluated(const TaskRecord& record, const State<T>& state,
                                            const std::map<std::string, VectorX<T>>& more = {}) {
  const std::vector<T> x = record.graph.evaluate<T>(record.results, numbers(record, state, more));
  std::map<std::string, VectorX<T>> out;
  const T* next = x.data();
  for (const Argument& output : record.outputs) {
    out[output.name] = Eigen::Map<const VectorX<T>>(next, output.size);
    next += output.size;
  }
  return out;
}
// A matrix that stands row by row.
template <class T>
MatrixX<T> matrix(const VectorX<T>& rows) {
  const auto n = std::lround(std::sqrt(rows.size()));
  return rows.reshaped(n, n).transpose();
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

// Of the records of a model's tasks, to which a question may add: their truth is that of `whole`.
template <class T>
void expect_every_task(const std::string& name, const Model<double>& model,
                       const Model<double>& whole, const Question& question = {},
                       const std::map<std::string, VectorX<T>>& more = {}, int count = states,
                       Gravity gravity = Gravity::constant) {
  const int nv = model.nv();
  Dynamics<double> library(
      plain(whole), spatial({Want::acceleration, Want::inverse_dynamics, Want::mass, Want::inverse,
                             Want::diagonal, Want::solve}));
  using enum GeneratedTask;
  const auto of = [&](GeneratedTask task) {
    return record<T>(task, model, question, default_tolerance<T>, gravity);
  };
  const TaskRecord a = of(forward_dynamics), tau = of(inverse_dynamics), M = of(mass),
                   X = of(inverse_mass), d = of(diagonal), x = of(solve);
  Errors of_a, of_tau, of_M, of_X, of_d, of_x;
  for (int seed = 0; seed < count; ++seed) {
    const State<double> exact = rounded<T>(random_state(model, seed));
    const State<T> state = exact.cast<T>();
    const auto by = [&](const TaskRecord& record) {
      return evaluated<T>(record, state, more).at(record.outputs[0].name);
    };
    const Truth truth(whole, exact);
    VectorX<double> y = poisoned<double>(nv);
    MatrixX<double> Y = poisoned<double>(nv, nv);
    (void)library.forward_dynamics(exact.q, exact.qd, exact.tau, y);
    of_a.add(truth.acceleration(by(a)), truth.acceleration(y));
    library.inverse_dynamics(exact.q, exact.qd, exact.tau, y);
    of_tau.add(truth.torque(by(tau)), truth.torque(y));
    library.mass(exact.q, Y);
    of_M.add(truth.mass(matrix(by(M))), truth.mass(Y));
    (void)library.inverse_mass(exact.q, Y);
    of_X.add(truth.inverse(matrix(by(X))), truth.inverse(Y));
    (void)library.diagonal(exact.q, y);
    of_d.add(truth.diagonal(by(d)), truth.diagonal(y));
    (void)library.factor(exact.q);
    (void)library.solve(exact.tau, y);
    of_x.add(truth.solution(by(x)), truth.solution(y));
  }
  of_a.expect_alike<T>(name + ": forward_dynamics");
  of_tau.expect_alike<T>(name + ": inverse_dynamics");
  of_M.expect_alike<T>(name + ": mass");
  of_X.expect_alike<T>(name + ": inverse_mass");
  of_d.expect_alike<T>(name + ": diagonal");
  of_x.expect_alike<T>(name + ": solve");
}

TYPED_TEST(Record, OfEveryTaskIsAsNearToTheTruthAsTheLibrary) {
  using T = TypeParam;
  for (const Family& family : all_families()) {
    const Model<double> model = rounded<T>(family.make(1));
    expect_every_task<T>(family.name, model, model);
  }
}

// The robot with the body welded to its last link.
TYPED_TEST(Record, OfALoadIsThatOfTheRobotWithItsBody) {
  using T = TypeParam;
  const RigidBody<double> body{0.75, {0.25, -0.125, 0.5}, {1, 0, 0, 0}, {0.25, 0.375, 0.5}};
  const SpatialInertia<double> own(body);
  VectorX<double> load(10);
  load << own.m, own.h, own.I(0, 0), own.I(1, 1), own.I(2, 2), own.I(0, 1), own.I(0, 2),
      own.I(1, 2);
  for (const Family& family : all_families()) {
    const Model<double> model = rounded<T>(family.make(1));
    const int last = model.nv() - 1;
    const Frame frame{last, {0.5, 0.5, -0.5, 0.5}, {0.125, 0, 0.25}};
    const Site<double> site = site_of(frame);
    std::vector<Joint<double>> joints;
    for (int k = 0; k < model.nv(); ++k) joints.push_back(model.joint(k));
    RigidBody<double> held = body;
    held.com = site.translation + rotation(site.rotation) * body.com;
    held.axes = site.rotation * body.axes;
    joints[last].body = welded(joints[last].body, held);
    expect_every_task<T>(std::string(family.name) + " with a load", model,
                         Model<double>(joints, model.names(), model.nq(), model.gravity()),
                         {.loaded = {frame}}, {{"loads", load.template cast<T>()}});
  }
}

TYPED_TEST(Record, OfGravityThatIsGivenIsThatOfTheRobotThere) {
  using T = TypeParam;
  const Vector3<double> given(1.5, -2.25, -4.75);
  for (const Family& family : all_families()) {
    const Model<double> there = rounded<T>(family.make(1));
    std::vector<Joint<double>> joints;
    for (int k = 0; k < there.nv(); ++k) joints.push_back(there.joint(k));
    expect_every_task<T>(std::string(family.name) + " in another gravity", there,
                         Model<double>(joints, there.names(), there.nq(), given), {},
                         {{"gravity", given.template cast<T>()}}, states, Gravity::input);
  }
}

// G of force_noise.hpp is that of the gravity given and the model's own: where these are the same, up to sqrt(2) times
// the error is told.
TYPED_TEST(Record, OfGravityThatIsGivenTellsItsError) {
  using T = TypeParam;
  for (const Family& family : all_families()) {
    const Model<double> model = rounded<T>(family.make(1));
    const VectorX<T> own = model.gravity().template cast<T>();
    const auto task = GeneratedTask::judged_forward_dynamics;
    const TaskRecord constant = record<T>(task, model),
                     input = record<T>(task, model, {}, default_tolerance<T>, Gravity::input);
    for (int seed = 0; seed < states; ++seed) {
      const State<T> state = rounded<T>(random_state(model, seed)).template cast<T>();
      const T told = evaluated<T>(input, state, {{"gravity", own}}).at("error")[0],
              least = evaluated<T>(constant, state).at("error")[0];
      EXPECT_GE(told, T(0.999) * least) << family.name;
      EXPECT_LE(told, T(1.415) * least) << family.name;
    }
  }
}

// J M^-1 J' of frames on the last link and in the middle. A direction that moves by a tilt of 1e-12 alone, and so by
// nothing in float32, is no measure there.
TYPED_TEST(Record, OfFramesIsAsNearToTheTruthAsTheLibrary) {
  using T = TypeParam;
  for (const Family& family : all_families()) {
    const Model<double> model = rounded<T>(family.make(1));
    const int last = model.nv() - 1;
    int middle = last / 2;
    while (model.joint(middle).coordinate == Coordinate::follower) --middle;
    if (middle > 0) --middle;  // the last DoF of a joint
    const std::vector<Frame> frames = {{last, {1, 0.25, -0.5, 0.125}, {0.125, 0, 0.25}},
                                       {middle, {1, 0, 0, 0}, {0, 0.5, 0}},
                                       {last, {1, 0, 0, 0}, {0.5, 0, 0}}};
    const int rows = 6 * static_cast<int>(frames.size());
    DynamicsOptions options = spatial({Want::operational});
    options.question.frames = frames;
    Dynamics<double> library(plain(model), options);
    const TaskRecord record =
        kalmarm::record<T>(GeneratedTask::operational, model, {.frames = frames});
    Errors errors;
    for (int seed = 0; seed < states; ++seed) {
      const State<double> exact = rounded<T>(random_state(model, seed));
      const Truth truth(model, exact);
      MatrixX<double> Y = poisoned<double>(rows, rows);
      (void)library.operational(exact.q, Y);
      const VectorX<T> X = evaluated<T>(record, exact.cast<T>()).at("X");
      errors.add(truth.selected({{}, frames}, matrix(X)), truth.selected({{}, frames}, Y));
    }
    // In float32 a direction that moves by a tilt of 1e-12 alone is of no digit.
    if (std::is_same_v<T, double> || std::string(family.name) != "tilted_1e-12")
      errors.template expect_alike<T>(family.name);
  }
}

TYPED_TEST(Record, OfDerivativesIsAsNearToTheTruthAsTheLibrary) {
  using T = TypeParam;
  for (const Family& family : all_families()) {
    const Model<double> model = rounded<T>(family.make(1));
    Dynamics<double> library(plain(model), spatial({Want::derivatives}));
    const TaskRecord record = kalmarm::record<T>(GeneratedTask::derivatives, model);
    Errors errors;
    for (int seed = 0; seed < 2; ++seed) {
      const State<double> exact = rounded<T>(random_state(model, seed));
      const TrueDerivatives truth(model, exact);
      AccelerationDerivatives<double> y(model.nv()), x(model.nv());
      (void)library.derivatives(exact.q, exact.qd, exact.tau,
                                {.dq = y.dq, .dqd = y.dqd, .dtau = y.dtau}, y.a);
      const auto by = evaluated<T>(record, exact.cast<T>());
      x.a = by.at("a").template cast<double>();
      x.dq = matrix(by.at("da_dq")).transpose().template cast<double>();
      x.dqd = matrix(by.at("da_dqd")).transpose().template cast<double>();
      x.dtau = matrix(by.at("da_dtau")).transpose().template cast<double>();
      errors.add(truth.error(x), truth.error(y));
    }
    errors.template expect_alike<T>(family.name);
  }
}

// (M + h B + h^2 K) a = tau - B v - K (q - q0 + h v) - bias: that of the robot with this joint noise at this torque.
// Gains are powers of two, from slack to stiff.
TYPED_TEST(Record, OfAnImplicitStepIsAsNearToTheTruthAsTheLibrary) {
  using T = TypeParam;
  constexpr double h = 1.0 / 64;
  for (const Family& family : all_families()) {
    const Model<double> model = rounded<T>(family.make(1));
    const int nv = model.nv();
    VectorX<double> b(nv), k(nv), q0(nv);
    Model<double> stiff = model;
    for (int i = 0; i < nv; ++i) {
      b[i] = std::ldexp(1, i % 7 - 3);
      k[i] = i % 3 == 0 ? 0 : std::ldexp(1, i % 17);
      q0[i] = 0.25 * (i % 5 - 2);
      if (takes_spring(plain(model).links[i]))
        stiff.set_noise(i, model.joint(i).r + h * b[i] + h * h * k[i]);
    }
    const std::map<std::string, VectorX<T>> gains = {{"damping", b.template cast<T>()},
                                                     {"stiffness", k.template cast<T>()},
                                                     {"reference", q0.template cast<T>()},
                                                     {"h", VectorX<T>::Constant(1, T(h))}};
    Dynamics<double> library(plain(stiff), spatial({Want::acceleration}));
    const TaskRecord record = kalmarm::record<T>(GeneratedTask::judged_implicit_step, model);
    Errors errors;
    for (int seed = 0; seed < states; ++seed) {
      const State<double> exact = rounded<T>(random_state(model, seed));
      State<double> at_end = exact;
      for (int i = 0; i < nv; ++i) {
        if (!takes_spring(plain(model).links[i])) continue;
        const double q = exact.q[model.joint(i).q_index], v = exact.qd[i];
        at_end.tau[i] -= b[i] * v + k[i] * (q - q0[i] + h * v);
      }
      const Truth truth(stiff, at_end);
      VectorX<double> y = poisoned<double>(nv);
      (void)library.forward_dynamics(at_end.q, at_end.qd, at_end.tau, y);
      const auto by = evaluated<T>(record, exact.cast<T>(), gains);
      errors.add(truth.acceleration(by.at("a")), truth.acceleration(y));
      EXPECT_TRUE(!(by.at("margin")[0] > 0) || truth.energy(by.at("a")) <= by.at("error")[0])
          << family.name;
    }
    errors.template expect_alike<T>(family.name);
  }
}

// At rest, and of some DoF: the same numbers as of the whole question, by fewer operations.
TYPED_TEST(Record, OfAQuestionHasTheNumbersOfTheWholeByFewerOperations) {
  using T = TypeParam;
  using enum GeneratedTask;
  int of_some = 0, of_whole = 0;
  for (const Family& family : all_families()) {
    const Model<double> model = rounded<T>(family.make(1));
    const int nv = model.nv();
    const Question question{.dofs = {0, nv - 1}, .at_rest = true};
    State<T> state = rounded<T>(random_state(model, 3)).template cast<T>();
    state.qd.setZero();
    for (const GeneratedTask task :
         {forward_dynamics, inverse_dynamics, mass, inverse_mass, solve, derivatives}) {
      const TaskRecord whole = kalmarm::record<T>(task, model),
                       some = kalmarm::record<T>(task, model, question);
      const auto x = evaluated<T>(whole, state), y = evaluated<T>(some, state);
      for (const auto& [name, numbers] : x) {
        const VectorX<T>& asked = y.at(name);
        if (numbers.size() == nv)
          EXPECT_EQ(asked, numbers(std::array{0, nv - 1})) << family.name << to_string(task);
        else
          EXPECT_EQ(matrix(asked), matrix(numbers)(std::array{0, nv - 1}, std::array{0, nv - 1}))
              << family.name << to_string(task);
      }
      const auto flops = [](const TaskRecord& r) { return r.graph.count(r.results).flops(); };
      EXPECT_LE(flops(some), flops(whole)) << family.name << to_string(task);
      of_some += flops(some);
      of_whole += flops(whole);
    }
  }
  EXPECT_LT(3 * of_some, 2 * of_whole);
}

// Of slides P, D and g are constants, and so is M^-1.
TEST(RecordOfSlides, HasNoOperationInTheInverse) {
  Random random(1);
  Builder builder;
  for (int k = 0; k < 5; ++k) builder.add(random_joint(random, k - 1, Coordinate::distance));
  const TaskRecord record = kalmarm::record<double>(GeneratedTask::inverse_mass, builder.build());
  EXPECT_EQ(record.graph.count(record.results).flops(), 0);
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

// Trees, three of them in one robot, and on a free body: hinges, slides, a ball joint, armature. In float64, where one
// state of the library is a measure of one.
TEST(RecordOfRandomTrees, IsAsNearToTheTruthAsTheLibrary) {
  using T = double;
  for (int seed = 1; seed <= 200; ++seed) {
    const Model<double> model = rounded<T>(seed % 4 == 0   ? everything(seed)
                                           : seed % 4 == 1 ? tree(seed)
                                           : seed % 4 == 2 ? forest(seed)
                                                           : floating_base(seed));
    expect_every_task<T>("tree " + std::to_string(seed), model, model, {}, {}, 1);
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
