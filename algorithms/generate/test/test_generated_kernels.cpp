// Dynamics by generated code: what it accepts is as right as it says, what it does not the loops answer, and whatever
// keeps code from being there, they answer all.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>

#include "algorithms/dynamics/test/door_support.hpp"
#include "algorithms/fast/test/mechanisms_that_lose.hpp"
#include "algorithms/fast/test/support.hpp"
#include "algorithms/test/singular.hpp"
#include "algorithms/test/temporary_folder.hpp"

namespace kalmarm::test {
namespace {

namespace fs = std::filesystem;

// A compiler that is a script: first it does as told, then it compiles.
std::string script(const TemporaryFolder& folder, const std::string& name,
                   const std::string& before) {
  const std::string path = folder / name;
  put(path, "#!/bin/sh\n" + before + "\nexec " KALMARM_TEST_COMPILER " \"$@\"\n");
  fs::permissions(path, fs::perms::owner_all);
  return path;
}

// For all tests: code that is compiled quickly.
class GeneratedKernels : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    fs::permissions(folder_->path(), fs::perms::owner_all);
    quick_ = script(*folder_, "quick", "set -- \"$@\" -O0");
  }
  static void TearDownTestSuite() { delete folder_; }

  static CodeOptions quick() { return {.compiler = {quick_}, .folder = *folder_ / "cache"}; }

  static DynamicsOptions generated(DynamicsOptions options = {}) {
    if (options.question.want.empty())
      options.question.want = {Want::acceleration, Want::inverse_dynamics, Want::mass};
    options.kernels = Kernels::generated;
    options.code = quick();
    return options;
  }
  static DynamicsOptions loops(DynamicsOptions options) {
    options.kernels = Kernels::loops;
    return options;
  }

  static const TemporaryFolder& folder() { return *folder_; }

 private:
  static inline TemporaryFolder* folder_ = nullptr;
  static inline std::string quick_;
};

bool says(const std::vector<std::string>& notes, const std::string& what) {
  return std::any_of(notes.begin(), notes.end(), [&](const std::string& note) {
    EXPECT_EQ(note.find('\n'), std::string::npos) << note;
    return note.find(what) != std::string::npos;
  });
}
template <class T>
bool all_generated(const Dynamics<T>& robot) {
  return !robot.notes().empty() && !says(robot.notes(), "loops answer");
}

struct Asked {
  std::string name;
  Model<double> model;
};
std::vector<Asked> mechanisms() {
  std::vector<Asked> out;
  for (const Family& family : all_families()) out.push_back({family.name, family.make(1)});
  for (int seed = 1; seed <= 4; ++seed) out.push_back({"wild", wild(seed)});
  out.push_back({"growing", growing(1, 1e8)});
  out.push_back({"com_inboard", com_inboard(10)});
  return out;
}

// What one call for a gives.
template <class T>
struct Answer {
  VectorX<T> a;
  Outcome outcome;

  Answer(Dynamics<T>& robot, const State<T>& state) : a(poisoned<T>(robot.nv())) {
    outcome = robot.forward_dynamics(state.q, state.qd, state.tau, a);
  }
};

bool same(double x, double y) { return x == y || (x != x && y != y); }

// To the last bit: one answered both.
template <class T>
bool same(const VectorX<T>& x, const VectorX<T>& y) {
  for (Eigen::Index i = 0; i < x.size(); ++i)
    if (!same(double(x[i]), double(y[i]))) return false;
  return x.size() == y.size();
}
bool same(const Outcome& x, const Outcome& y) {
  return x.status == y.status && x.rung == y.rung && x.joint == y.joint && same(x.error, y.error);
}

TEST_F(GeneratedKernels, AreAsRightAsTheySay) {
  int by_code = 0;
  for (const Asked& asked : mechanisms()) {
    SCOPED_TRACE(asked.name);
    const Model<double>& model = asked.model;
    const DynamicsOptions options = generated({.rules = rules_of_sweeps()});
    Dynamics<double> robot(plain(model), options), by_loops(plain(model), loops(options));
    EXPECT_EQ(robot.notes().size(), 3U);
    for (int seed = 0; seed < 8; ++seed) {
      const State<double> state = random_state(model, seed);
      const Truth truth(model, state);
      const Answer<double> x(robot, state), y(by_loops, state);
      ASSERT_EQ(x.outcome.status, y.outcome.status) << seed;
      EXPECT_EQ(x.outcome.near_singular, y.outcome.near_singular) << seed;
      if (!x.outcome) continue;
      if (x.outcome.rung == Outcome::Rung::float64) {
        EXPECT_LE(truth.energy(x.a), x.outcome.error) << seed;
        ++by_code;
      } else if (y.outcome.rung != Outcome::Rung::float64) {
        EXPECT_TRUE(same(x.a, y.a) && same(x.outcome, y.outcome)) << seed;
      }
      VectorX<double> tau = poisoned<double>(model.nv()), of_loops = tau;
      robot.inverse_dynamics(state.q, state.qd, state.tau, tau);
      by_loops.inverse_dynamics(state.q, state.qd, state.tau, of_loops);
      EXPECT_LE(truth.torque(tau), 2 * truth.torque(of_loops) + 16 * unit_roundoff<double>())
          << seed;
      MatrixX<double> M = poisoned<double>(model.nv(), model.nv()), M_of_loops = M;
      robot.mass(state.q, M);
      by_loops.mass(state.q, M_of_loops);
      EXPECT_LE(truth.mass(M), 2 * truth.mass(M_of_loops) + 16 * unit_roundoff<double>()) << seed;
    }
  }
  EXPECT_GT(by_code, 100);
}

template <class T>
class GeneratedRows : public GeneratedKernels {};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(GeneratedRows, Precisions, PrecisionName);

TYPED_TEST(GeneratedRows, AreAsRightAsTheySay) {
  using T = TypeParam;
  constexpr int count = 21;
  const Outcome::Rung first =
      std::is_same_v<T, float> ? Outcome::Rung::float_lanes : Outcome::Rung::float64;
  int by_code = 0, climbed = 0;
  for (const Asked& asked : mechanisms()) {
    SCOPED_TRACE(asked.name);
    const Model<double> model = rounded<T>(asked.model);
    const DynamicsOptions options = this->generated({.rules = rules_of_sweeps()});
    Dynamics<T> robot(plain(model), options), by_loops(plain(model), this->loops(options));
    Rows<T> x(model, count), y(model, count);
    EXPECT_EQ(x.forward_dynamics(robot), y.forward_dynamics(by_loops));
    for (int i = 0; i < count; ++i) {
      ASSERT_EQ(x.outcomes[i].status, y.outcomes[i].status) << i;
      if (!x.outcomes[i]) continue;
      const State<double> state = rounded<T>(random_state(model, i));
      const VectorX<T> a = Eigen::Map<const VectorX<T>>(&x.a[i * model.nv()], model.nv());
      const bool is_first = x.outcomes[i].rung == first;
      if (is_first) {
        EXPECT_LE(Truth(model, state).energy(a), x.outcomes[i].error) << i;
      }
      (is_first ? by_code : climbed) += 1;
    }
    for (std::size_t i = count * model.nv(); i < x.a.size(); ++i) ASSERT_EQ(x.a[i], T(-77));
    Rows<T> torques(model, count);
    torques.inverse_dynamics(robot);
    std::vector<T> M(count * model.nv() * model.nv(), T(NAN));
    std::vector<Outcome> outcomes(count);
    EXPECT_EQ(robot.mass(torques.q, M, outcomes), 0);
    for (int i = 0; i < count; ++i) {
      const State<double> state = rounded<T>(random_state(model, i));
      const Truth truth(model, state);
      const int n = model.nv();
      EXPECT_LE(truth.torque(VectorX<T>(Eigen::Map<const VectorX<T>>(&torques.a[i * n], n))),
                200 * n * unit_roundoff<T>())
          << i;
      EXPECT_LE(truth.mass(MatrixX<T>(Eigen::Map<const MatrixX<T>>(&M[i * n * n], n, n))),
                200 * n * unit_roundoff<T>())
          << i;
      EXPECT_EQ(outcomes[i].rung, first);
    }
  }
  EXPECT_GT(by_code, 200);
  EXPECT_GT(climbed, 0);
}

// M^-1, its diagonal and solves of rows.
TYPED_TEST(GeneratedRows, OfFactorsAreWithinTheTolerance) {
  using T = TypeParam;
  constexpr int count = 11;
  const Outcome::Rung first =
      std::is_same_v<T, float> ? Outcome::Rung::float_lanes : Outcome::Rung::float64;
  int by_code = 0;
  const std::vector<Asked> all = mechanisms();
  for (std::size_t i = 0; i < all.size(); i += 4) {  // all would compile for minutes
    const Asked& asked = all[i];
    SCOPED_TRACE(asked.name);
    const Model<double> model = rounded<T>(asked.model);
    const std::ptrdiff_t n = model.nv();
    const DynamicsOptions options =
        this->generated({.question = {.want = {Want::inverse, Want::diagonal, Want::solve}},
                         .rules = rules_of_sweeps()});
    Dynamics<T> robot(plain(model), options), by_loops(plain(model), this->loops(options));
    Rows<T> states(model, count);
    const auto compare = [&](std::ptrdiff_t width, const auto& call, const auto& error) {
      std::vector<T> x(count * width, T(NAN)), y = x;
      std::vector<Outcome> of_x(count), of_y(count);
      EXPECT_EQ(call(robot, x, of_x), call(by_loops, y, of_y));
      for (int i = 0; i < count; ++i) {
        ASSERT_EQ(of_x[i].status, of_y[i].status) << i;
        if (!of_x[i] || of_x[i].rung != first) continue;
        ++by_code;
        const Truth truth(model, rounded<T>(random_state(model, i)));
        const VectorX<double> numbers =
            Eigen::Map<const VectorX<T>>(&x[i * width], width).template cast<double>();
        EXPECT_LE(error(truth, numbers), robot.tolerance()) << i;
        EXPECT_TRUE(std::isnan(of_x[i].error));  // as the loops, which tell one where they refine
      }
    };
    compare(
        n * n,
        [&](Dynamics<T>& by, std::vector<T>& X, std::vector<Outcome>& outcomes) {
          return by.inverse_mass(states.q, X, outcomes);
        },
        [n](const Truth& truth, const VectorX<double>& X) {
          return truth.inverse(MatrixX<double>(X.reshaped(n, n)));
        });
    compare(
        n,
        [&](Dynamics<T>& by, std::vector<T>& x, std::vector<Outcome>& outcomes) {
          return by.diagonal(states.q, x, outcomes);
        },
        [](const Truth& truth, const VectorX<double>& x) { return truth.diagonal(x); });
    compare(
        n,
        [&](Dynamics<T>& by, std::vector<T>& x, std::vector<Outcome>& outcomes) {
          return by.solve(states.q, states.tau, x, outcomes);
        },
        [](const Truth& truth, const VectorX<double>& x) {
          const VectorX<double> exact = truth.solution();
          return (x - exact).norm() / exact.norm();
        });
  }
  EXPECT_GT(by_code, 100);
}

// Of rows, by columns. What is left out, all three are the loops'.
TYPED_TEST(GeneratedRows, OfDerivativesAreAsNearToTheTruthAsTheLoops) {
  using T = TypeParam;
  constexpr int count = 5;
  int by_code = 0;
  const std::vector<Asked> all = mechanisms();
  for (std::size_t i = 0; i < all.size(); i += 5) {  // all would compile for minutes
    const Asked& asked = all[i];
    SCOPED_TRACE(asked.name);
    const Model<double> model = rounded<T>(asked.model);
    const Eigen::Index n = model.nv(), square = n * n;
    const DynamicsOptions options = this->generated({.question = {.want = {Want::derivatives}}});
    Dynamics<T> robot(plain(model), options), by_loops(plain(model), this->loops(options));
    by_code += all_generated(robot);
    Rows<T> states(model, count);
    struct Matrices {
      VectorX<T> dq, dqd, dtau, a;
      std::vector<Outcome> outcomes;
    };
    const auto call = [&](Dynamics<T>& by, bool all_three) {
      Matrices out{poisoned<T>(count * square), poisoned<T>(count * square),
                   poisoned<T>(count * square), poisoned<T>(count * n),
                   std::vector<Outcome>(count)};
      const auto rows = [&](VectorX<T>& x) { return RowsView<T>(x.data(), count, square); };
      DerivativeRows<T> wanted{.dq = rows(out.dq)};
      if (all_three) wanted.dqd = rows(out.dqd), wanted.dtau = rows(out.dtau);
      (void)by.derivatives(states.q, states.qd, states.tau, wanted,
                           RowsView<T>(out.a.data(), count, n), out.outcomes);
      return out;
    };
    const Matrices x = call(robot, true), y = call(by_loops, true);
    for (int row = 0; row < count; ++row) {
      ASSERT_EQ(x.outcomes[row].status, y.outcomes[row].status) << row;
      if (!x.outcomes[row]) continue;
      const TrueDerivatives truth(model, rounded<T>(random_state(model, row)));
      const auto error = [&](const Matrices& of) {
        AccelerationDerivatives<T> out(model.nv());
        out.dq = of.dq.segment(row * square, square).reshaped(n, n);
        out.dqd = of.dqd.segment(row * square, square).reshaped(n, n);
        out.dtau = of.dtau.segment(row * square, square).reshaped(n, n);
        out.a = of.a.segment(row * n, n);
        return truth.error(out.template cast<double>());
      };
      EXPECT_LE(error(x), 4 * error(y) + 64 * unit_roundoff<T>()) << row;
    }
    EXPECT_TRUE(same(call(robot, false).dq, call(by_loops, false).dq));
  }
  EXPECT_GE(by_code, 5);  // of com_inboard none is accepted
}

// One state of M^-1: by code where it is faster, in the bits of a row of its own there; the loops' factors are not touched.
TEST_F(GeneratedKernels, OfFactorsOfOneStateAreWithinTheTolerance) {
  for (const int n : {5, 20}) {
    const Model<double> model = chain(1, n);
    const DynamicsOptions options =
        generated({.question = {.want = {Want::inverse, Want::diagonal, Want::solve}}});
    Dynamics<double> robot(plain(model), options);
    EXPECT_TRUE(all_generated(robot));
    for (int seed = 0; seed < 5; ++seed) {
      const State<double> state = random_state(model, seed), other = random_state(model, seed + 50);
      MatrixX<double> X = poisoned<double>(n, n);
      VectorX<double> d = poisoned<double>(n), x = d;
      ASSERT_TRUE(robot.factor(other.q));
      const Outcome of_X = robot.inverse_mass(state.q, X), of_d = robot.diagonal(state.q, d);
      ASSERT_TRUE(of_X && of_d);
      const Truth truth(model, state);
      EXPECT_LE(truth.inverse(X), robot.tolerance());
      EXPECT_LE(truth.diagonal(d), robot.tolerance());
      const Outcome of_x = robot.solve(state.tau, x);
      State<double> solved = other;
      solved.tau = state.tau;
      const VectorX<double> exact = Truth(model, solved).solution();
      EXPECT_TRUE(of_x);
      EXPECT_LE((x - exact).norm(), robot.tolerance() * exact.norm());
    }
  }
}

// Of more rows than one worker takes at once, some of which climb.
TYPED_TEST(GeneratedRows, AreTheSameBitsOnAnyNumberOfThreads) {
  using T = TypeParam;
  constexpr int count = 300;
  const Model<double> model = rounded<T>(chain(1, 4));
  Dynamics<T> robot(plain(model), this->generated({.question = {.want = {Want::acceleration}}}));
  Rows<T> one(model, count), many(model, count);
  for (int i = 7; i < count; i += 31) one.q[i * model.nq()] = many.q[i * model.nq()] = T(1e7);
  EXPECT_EQ(one.forward_dynamics(robot), 0);
  EXPECT_EQ(many.forward_dynamics(robot, 3), 0);
  EXPECT_EQ(one.a, many.a);
  for (int i = 0; i < count; ++i) EXPECT_TRUE(same(one.outcomes[i], many.outcomes[i])) << i;
}

// Singular mechanisms are refused, and say at which joint, as the loops do; their neighbours are not.
TEST_F(GeneratedKernels, RefuseWhatTheLoopsRefuse) {
  int refused = 0;
  for (const auto& list : {singular_mechanisms(1), regular_mechanisms(1)})
    for (const Mechanism& mechanism : list) {
      SCOPED_TRACE(mechanism.name);
      const DynamicsOptions options = generated({.question = {.want = {Want::acceleration}}});
      Dynamics<double> robot(plain(mechanism.model), options);
      Dynamics<double> by_loops(plain(mechanism.model), loops(options));
      State<double> state = random_state(mechanism.model, 1);
      state.q = mechanism.q;
      const Answer<double> x(robot, state), y(by_loops, state);
      EXPECT_EQ(x.outcome.status, y.outcome.status);
      EXPECT_EQ(x.outcome.joint, y.outcome.joint);
      refused += !x.outcome;
    }
  EXPECT_GT(refused, 0);
}

TYPED_TEST(GeneratedRows, LeaveToTheLoopsWhatTheyCannotAnswer) {
  using T = TypeParam;
  const Model<double> model = rounded<T>(chain(1, 4));
  DynamicsOptions options = this->generated(
      {.question = {.want = {Want::acceleration, Want::solve, Want::mass, Want::inverse_dynamics},
                    .acted_on = {{.link = 3}}}});
  Dynamics<T> robot(plain(model), options), by_loops(plain(model), this->loops(options));
  EXPECT_FALSE(says(robot.notes(), "loops answer"));
  const State<T> state = random_state(model, 1).template cast<T>();
  // Angles that are far, and states that are none.
  for (const T angle : {T(1e8), T(NAN), std::numeric_limits<T>::infinity()})
    for (int rows : {1, 9}) {
      State<T> one = state;
      one.q[2] = angle;
      std::vector<T> q, v, tau;
      for (int i = 0; i < rows; ++i) {
        q.insert(q.end(), one.q.begin(), one.q.end());
        v.insert(v.end(), one.qd.begin(), one.qd.end());
        tau.insert(tau.end(), one.tau.begin(), one.tau.end());
      }
      const auto asked = [&](Dynamics<T>& by) {
        std::vector<T> out(3 * rows * 4 + rows * 16, T(-1));
        T* const at = out.data();
        std::vector<Outcome> outcomes(2 * rows);
        (void)by.forward_dynamics(q, v, tau, RowsView<T>(at, rows, 4),
                                  std::span(outcomes).first(rows));
        by.inverse_dynamics(q, v, tau, RowsView<T>(at + rows * 4, rows, 4), 1);
        (void)by.mass(q, RowsView<T>(at + rows * 8, rows, 16), std::span(outcomes).last(rows));
        return std::pair(out, outcomes);
      };
      const auto [x, of_x] = asked(robot);
      const auto [y, of_y] = asked(by_loops);
      for (std::size_t i = 0; i < x.size(); ++i) EXPECT_TRUE(same(x[i], y[i])) << angle << i;
      for (std::size_t i = 0; i < of_x.size(); ++i) EXPECT_TRUE(same(of_x[i], of_y[i])) << angle;
    }
  // Forces, and results that stand where inputs do.
  const VectorX<T> force = VectorX<T>::LinSpaced(6, T(1), T(2));
  const auto both = [&](auto call) {
    VectorX<T> x = state.tau, y = state.tau;
    const Outcome of_x = call(robot, x), of_y = call(by_loops, y);
    EXPECT_TRUE(same(x, y));
    EXPECT_TRUE(same(of_x, of_y));
  };
  both([&](Dynamics<T>& by, VectorX<T>& a) {
    return by.forward_dynamics(state.q, state.qd, state.tau, a, {.on = force});
  });
  both(
      [&](Dynamics<T>& by, VectorX<T>& a) { return by.forward_dynamics(state.q, state.qd, a, a); });
  both([&](Dynamics<T>& by, VectorX<T>& a) {
    by.inverse_dynamics(state.q, state.qd, a, a);
    return Outcome{};
  });
}

// Every row has bodies of its own on two frames, and answers that agree with the loops' to what both may be wrong; without
// loads the loops answer.
TYPED_TEST(GeneratedRows, TakeLoadsOfEveryRow) {
  using T = TypeParam;
  constexpr int count = 21;
  int by_code = 0;
  for (const Model<double>& exact : {chain(1, 6), tree(1), ball_in_chain(1), floating_base(1)}) {
    const Model<double> model = rounded<T>(exact);
    const int n = model.nv(), last = end_of_joint(model, n - 1);
    const DynamicsOptions options =
        this->generated({.question = {.want = {Want::acceleration, Want::inverse_dynamics,
                                               Want::mass, Want::inverse, Want::derivatives},
                                      .loaded = {{last, {1, -0.5, 0.25, 0}, {0.125, 0, 0.25}},
                                                 {end_of_joint(model, n / 2)}}},
                         .rules = rules_of_sweeps()});
    Dynamics<T> robot(plain(model), options), by_loops(plain(model), this->loops(options));
    const double own[] = {1.25, .125,  .25,   -.25, .5,   .625, .75,   .03125, .0625,    .03125,
                          0.75, -.125, .0625, .25,  .375, .25,  .3125, .03125, -.015625, .015625};
    std::vector<T> loads;
    for (int i = 0; i < count; ++i)
      for (const double x : own) loads.push_back(T(x * (1 + i) / 8));
    const auto answers = [&](Dynamics<T>& by, const LoadRows<T>& given) {
      Rows<T> rows(model, count);
      const ForceRows<T> extra{.axes = Axes::local, .loads = given};
      std::vector<VectorX<T>> all;
      std::vector<bool> failed;
      const auto keep = [&](const std::vector<T>& x, std::size_t width) {
        VectorX<T>& part = all.emplace_back(x.size());
        for (std::size_t i = 0; i < x.size(); ++i) part[i] = rows.outcomes[i / width] ? x[i] : T(0);
        for (const Outcome& one : rows.outcomes) failed.push_back(!one);
      };
      std::vector<T> a(count * n), M(count * n * n), X(M), dq(M), dqd(M), dtau(M);
      (void)by.forward_dynamics(rows.q, rows.qd, rows.tau, a, rows.outcomes, 1, extra);
      keep(a, n);
      (void)by.inverse_mass(rows.q, X, rows.outcomes, 1, {.loads = given});
      keep(X, n * n);
      (void)by.derivatives(rows.q, rows.qd, rows.tau,
                           {.dq = RowsView<T>(dq.data(), count, n * n),
                            .dqd = RowsView<T>(dqd.data(), count, n * n),
                            .dtau = RowsView<T>(dtau.data(), count, n * n)},
                           a, rows.outcomes, 1, extra);
      keep(dq, n * n), keep(dqd, n * n), keep(dtau, n * n);
      (void)by.mass(rows.q, M, rows.outcomes, 1, given);
      keep(M, n * n);
      by.inverse_dynamics(rows.q, rows.qd, rows.tau, a, 1, extra);
      keep(a, n);
      return std::pair(all, failed);
    };
    const auto agree = [&](const LoadRows<T>& given, bool exactly) {
      const auto [x, failed] = answers(robot, given);
      const auto [y, failed_there] = answers(by_loops, given);
      EXPECT_EQ(failed, failed_there);
      for (std::size_t i = 0; i < x.size(); ++i) {
        SCOPED_TRACE(i);
        // Derivatives, which tell no error, are as near as those without loads.
        if (exactly)
          EXPECT_EQ(x[i], y[i]);
        else
          EXPECT_LE((x[i] - y[i]).norm(), T(64 * default_tolerance<T>) * y[i].norm());
        by_code += x[i] != y[i];
      }
    };
    agree(RowsView<const T>(loads.data(), count, 20), false);
    agree({}, true);
  }
  EXPECT_GT(by_code, 10);
}

// Factors that are kept are not touched by what generated code answers.
TEST_F(GeneratedKernels, LeaveFactorsThatAreKept) {
  const Model<double> model = chain(1, 5);
  Dynamics<double> robot(plain(model),
                         generated({.question = {.want = {Want::acceleration, Want::solve}}}));
  const State<double> state = random_state(model, 1), other = random_state(model, 2);
  ASSERT_TRUE(robot.factor(state.q));
  (void)Answer<double>(robot, other);
  VectorX<double> x = poisoned<double>(5);
  ASSERT_TRUE(robot.solve(state.tau, x));
  EXPECT_LE(Truth(model, state).solution(x), 1e-12);
}

// Parts, locked joints and DoF asked about: code is of what is left of the robot.
TEST_F(GeneratedKernels, AnswerQuestions) {
  struct Case {
    Model<double> model;
    Question question;
  };
  const std::set<Want> want = {Want::acceleration, Want::inverse_dynamics, Want::mass};
  const Model<double> trees = forest(1), arm = chain(1, 6);
  const std::vector<double> at(arm.nq(), 0.4);
  for (const Case& one : std::vector<Case>{{trees, {.want = want}},
                                           {arm, {.want = want, .locked = {2, 4}, .q = at}},
                                           {arm, {.want = want, .dofs = {1, 5}}},
                                           {arm, {.want = want, .at_rest = true}}}) {
    const DynamicsOptions options = generated({.question = one.question});
    Dynamics<double> robot(plain(one.model), options);
    Dynamics<double> by_loops(plain(one.model), loops(options));
    EXPECT_TRUE(says(robot.notes(), "mass: generated code"));
    EXPECT_EQ(says(robot.notes(), "at rest"), one.question.at_rest);
    const State<double> state = random_state(one.model, 3);
    const int n = robot.asked();
    VectorX<double> x = poisoned<double>(n), y = x;
    ASSERT_TRUE(robot.forward_dynamics(state.q, state.qd, state.tau, x));
    ASSERT_TRUE(by_loops.forward_dynamics(state.q, state.qd, state.tau, y));
    EXPECT_LE((x - y).norm(), 1e-9 * y.norm());
    robot.inverse_dynamics(state.q, state.qd, state.tau, x);
    by_loops.inverse_dynamics(state.q, state.qd, state.tau, y);
    EXPECT_LE((x - y).norm(), 1e-12 * y.norm());
    MatrixX<double> X = poisoned<double>(n, n), Y = X;
    robot.mass(state.q, X);
    by_loops.mass(state.q, Y);
    EXPECT_LE((X - Y).norm(), 1e-12 * Y.norm());
  }
}

// What is compiled once is taken by the next that asks, without its compiler being asked for code.
TEST_F(GeneratedKernels, AreCompiledOnce) {
  const TemporaryFolder own;
  const std::string compiler =
      script(own, "counting", "case \"$*\" in *-shared*) echo >> '" + own / "made" + "';; esac");
  DynamicsOptions options = generated();
  options.code = {.compiler = {compiler}, .folder = own / "cache"};
  const Model<double> model = one_hinge(1);
  const auto notes = [&] { return Dynamics<double>(plain(model), options).notes(); };
  EXPECT_FALSE(says(notes(), " before: "));
  for (const std::string& note : notes())
    EXPECT_NE(note.find(" before: "), std::string::npos) << note;
  EXPECT_EQ(content(own / "made").size(), 3U);
  struct stat folder = {};
  ASSERT_EQ(stat((own / "cache").c_str(), &folder), 0);
  EXPECT_EQ(folder.st_mode & 0777, 0700U);
}

TEST_F(GeneratedKernels, AreThoseThatAreNamed) {
  DynamicsOptions options = generated();
  options.code.tasks = {Want::mass};
  options.code.rows = false;
  const Model<double> model = one_hinge(1);
  Dynamics<double> robot(plain(model), options);
  EXPECT_EQ(robot.notes().size(), 1U);
  EXPECT_TRUE(all_generated(robot));
  options.code.tasks = {Want::acceleration};
  options.tolerance = 1e-14;
  EXPECT_TRUE(says(Dynamics<double>(plain(model), options).notes(), "refined"));
  EXPECT_TRUE(says(Dynamics<float>(plain(model), options).notes(), "loops answer"));
}

// --- what can go wrong: the loops answer, a note says why in a line, and nothing is left behind

class NoGeneratedKernels : public GeneratedKernels {
 protected:
  // Of a robot that has to be made for it.
  static void expect_loops(CodeOptions code, const std::string& why,
                           const Model<double>& model = chain(2, 3)) {
    SCOPED_TRACE(why);
    DynamicsOptions options = generated();
    options.code = std::move(code);
    Dynamics<double> robot(plain(model), options), by_loops(plain(model), loops(options));
    for (const std::string& note : robot.notes())
      EXPECT_NE(note.find("the library's loops answer: "), std::string::npos) << note;
    EXPECT_TRUE(says(robot.notes(), why)) << robot.notes()[0];
    const State<double> state = random_state(model, 1);
    const Answer<double> x(robot, state), y(by_loops, state);
    EXPECT_TRUE(same(x.a, y.a));
    EXPECT_TRUE(same(x.outcome, y.outcome));
  }
};

TEST_F(NoGeneratedKernels, WithoutACompiler) {
  expect_loops({.compiler = {"/no/compiler"}, .folder = folder() / "none"}, "/no/compiler");
  expect_loops({.compiler = {"no-compiler-of-this-name"}, .folder = folder() / "none"},
               "no-compiler-of-this-name");
}

TEST_F(NoGeneratedKernels, ByACompilerThatFailsOrTakesTooLong) {
  const TemporaryFolder own;
  const auto by = [&](const std::string& before) {
    return CodeOptions{
        .compiler = {script(own, "compiler", before)}, .folder = own / "cache", .limit = 20};
  };
  expect_loops(by("echo broken; exit 1"), "broken");
  expect_loops(by("case \"$*\" in *-shared*) exit 0;; esac"), "has not written");
  expect_loops(by("case \"$*\" in *-shared*) kill -9 $$;; esac"), "failed");
  CodeOptions slow = by("case \"$*\" in *' -c '*) sleep 1000;; esac");
  slow.limit = 1;
  expect_loops(slow, "longer than 1 s");
  EXPECT_TRUE(fs::is_empty(own / "cache"));
}

// A cosine that is wrong; what is not written; a library of something else.
TEST_F(NoGeneratedKernels, OfWrongResults) {
  const TemporaryFolder own;
  const auto by = [&](const std::string& name, const std::string& files, const std::string& edit) {
    const std::string change = "for file; do case \"$file\" in *" + files + ") sed -i '" + edit +
                               "' \"$file\";; esac; done";
    return CodeOptions{.compiler = {script(own, name, change)}, .folder = own / "cache"};
  };
  expect_loops(by("one", "robot.c", "s/(0\\.5\\*rr/(0.50001*rr/"), "results are wrong");
  expect_loops(by("rows", "robot_rows.c", "s/(0\\.5\\*rr/(0.50001*rr/"), "results are wrong");
  expect_loops(by("nothing", ".c", "s/^void robot_/void other_/"), "has not all functions");
}

TEST_F(NoGeneratedKernels, InAFolderThatIsNotOurs) {
  const TemporaryFolder own;
  const auto in = [&](const std::string& path) {
    CodeOptions code = quick();
    code.folder = path;
    return code;
  };
  fs::create_directory(own / "open");
  fs::permissions(own / "open", fs::perms::all);
  expect_loops(in(own / "open"), "no folder of this user alone");
  EXPECT_TRUE(fs::is_empty(own / "open"));
  put(own / "file", "");
  expect_loops(in(own / "file"), "no folder of this user alone");
  expect_loops(in("/proc/kalmarm"), "cannot make /proc/kalmarm");
  fs::create_directory(own / "of_others");
  fs::permissions(own / "of_others", fs::perms::owner_all);
  if (geteuid() == 0 && chown((own / "of_others").c_str(), 65534, 65534) == 0) {
    expect_loops(in(own / "of_others"), "no folder of this user alone");
    EXPECT_TRUE(fs::is_empty(own / "of_others"));
  }
}

// Files of 2 kB at most, as on a disk that is full, and where nothing may be written.
TEST_F(NoGeneratedKernels, InAFolderThatIsFullOrReadOnly) {
  const TemporaryFolder own;
  const auto in_another_process = [&](const auto& restrict_it) {
    const pid_t child = fork();
    if (child == 0) {
      restrict_it();
      CodeOptions code = quick();
      code.folder = own / "cache";
      const Dynamics<double> robot(plain(one_hinge(3)), [&] {
        DynamicsOptions options = generated();
        options.code = code;
        return options;
      }());
      _exit(robot.notes().size() == 3 && !all_generated(robot) &&
                    !says(robot.notes(), "generated code")
                ? 0
                : 1);
    }
    int status = -1;
    waitpid(child, &status, 0);
    return status == 0;
  };
  EXPECT_TRUE(in_another_process([] {
    std::signal(SIGXFSZ, SIG_IGN);
    const rlimit few = {2000, 2000};
    setrlimit(RLIMIT_FSIZE, &few);
  }));
  EXPECT_TRUE(fs::is_empty(own / "cache"));
  if (geteuid() != 0) {
    fs::permissions(own / "cache", fs::perms::owner_read | fs::perms::owner_exec);
    EXPECT_TRUE(in_another_process([] {}));
    fs::permissions(own / "cache", fs::perms::owner_all);
  }
}

TEST_F(NoGeneratedKernels, OfARobotThatIsTooLarge) {
  expect_loops(quick(), "at most 100", chain(1, 101));
}

}  // namespace
}  // namespace kalmarm::test
