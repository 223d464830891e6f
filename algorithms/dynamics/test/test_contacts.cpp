// Contacts with the world: what is made of factors is that of H = M + J'DJ, against truth in 50 digits, for any
// stiffness; one state and rows.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "algorithms/dynamics/test/door_support.hpp"
#include "kalmarm/implicit_step.hpp"

namespace kalmarm::test {
namespace {

constexpr Axes all_axes[] = {Axes::local, Axes::world, Axes::aligned};
constexpr double all_stiffness[] = {1, 1e4, 1e8, 1e12};

const std::set<Want> of_factors{Want::inverse, Want::diagonal, Want::log_det, Want::solve};

// Three directions at a point of one link, four rows on another, and one on the base, where it does nothing.
Push some_contacts(const Model<double>& model, Axes axes, double d, std::uint64_t seed) {
  Random random(seed);
  const int last = end_of_joint(model, model.nv() - 1),
            middle = end_of_joint(model, model.nv() / 2);
  Push out;
  out.axes = axes;
  for (int i = 0; i < 3; ++i) out.frames.push_back({last, {1, 0.2, -0.3, 0.1}, {0.1, 0, 0.2}});
  for (int i = 0; i < 4; ++i) out.frames.push_back({middle, {1, 0, 0, 0}, {0, 0.1 * i, 0}});
  out.frames.push_back({-1});
  out.forces = rounded<float>(VectorX<double>(std::sqrt(d) * random.vector(6 * 8)));
  return out;
}

template <class T>
Dynamics<T> standing_robot(const Model<double>& model, const Push& contacts,
                           DynamicsOptions options) {
  options.question.contacts = contacts.frames;
  return dynamics_of<T>(model, options);
}

double euclid(const VectorX<double>& x, const VectorX<double>& exact) {
  return (x - exact).norm() / exact.norm();
}

template <class T>
class Standing : public testing::Test {};
using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Standing, Precisions, PrecisionName);

// H^-1 tau is within the tolerance or warns, whatever the stiffness and the axes, by kept factors and by rows.
TYPED_TEST(Standing, SolvesAreThoseOfH) {
  using T = TypeParam;
  const double u = static_cast<double>(unit_roundoff<T>());
  for (const Family& family : families_and_robots())
    for (const Axes axes : all_axes)
      for (const double d : all_stiffness) {
        SCOPED_TRACE(std::string(family.name) + " " + std::to_string(d));
        const Model<double> model = rounded<T>(family.make(3));
        const int nv = model.nv();
        const State<T> s = random_state(model, 5).template cast<T>();
        const Push contacts = some_contacts(model, axes, d, 8);
        const VectorX<double> exact =
            Truth(model, s.template cast<double>(), {}, contacts).solution();
        const VectorX<T> w = contacts.forces.cast<T>();
        Dynamics<T> robot =
            standing_robot<T>(model, contacts, {.question = {.want = {Want::solve}}});
        VectorX<T> x = poisoned<T>(nv);
        ASSERT_TRUE(robot.factor(s.q, {w, axes}));
        const Outcome outcome = robot.solve(s.tau, x);
        ASSERT_TRUE(outcome);
        EXPECT_FALSE(outcome.warns());
        EXPECT_LE(euclid(x.template cast<double>(), exact), default_tolerance<T>);
        VectorX<T> q(2 * s.q.size()), tau(2 * nv), ww(2 * w.size()), rows = poisoned<T>(2 * nv);
        q << s.q, s.q;
        tau << s.tau, s.tau;
        ww << w, w;
        std::vector<Outcome> outcomes(2);
        ASSERT_EQ(robot.solve(q, tau, rows, outcomes, 1, {ww, axes}), 0);
        for (int i = 0; i < 2; ++i)
          EXPECT_LE(euclid(rows.segment(i * nv, nv).template cast<double>(), exact),
                    std::max(default_tolerance<T>, 4 * u));
      }
}

// Each row of states has its own contacts, whichever rung answers it: in lanes, one after another, refined.
TYPED_TEST(Standing, RowsHaveContactsOfTheirOwn) {
  using T = TypeParam;
  for (const double tolerance : {default_tolerance<T>, last_bits})
    for (const double d : all_stiffness) {
      SCOPED_TRACE(std::to_string(tolerance) + " " + std::to_string(d));
      const Model<double> model = rounded<T>(floating_base(3));
      const int nv = model.nv(), nq = model.nq(), count = 11;
      VectorX<T> q(count * nq), tau(count * nv), w(count * 48), x = poisoned<T>(count * nv);
      Dynamics<T> robot =
          standing_robot<T>(model, some_contacts(model, Axes::local, d, 0),
                            {.tolerance = tolerance, .question = {.want = {Want::solve}}});
      for (int i = 0; i < count; ++i) {
        const State<T> s = random_state(model, i).template cast<T>();
        q.segment(i * nq, nq) = s.q, tau.segment(i * nv, nv) = s.tau;
        w.segment(i * 48, 48) = some_contacts(model, Axes::local, d, i).forces.template cast<T>();
      }
      std::vector<Outcome> outcomes(count);
      ASSERT_EQ(robot.solve(q, tau, x, outcomes, 1, {w, Axes::local}), 0);
      for (int i = 0; i < count; ++i) {
        const State<double> s = random_state(model, i).template cast<T>().template cast<double>();
        const Truth truth(model, s, {}, some_contacts(model, Axes::local, d, i));
        EXPECT_LE(euclid(x.segment(i * nv, nv).template cast<double>(), truth.solution()),
                  std::max(tolerance, 2 * static_cast<double>(unit_roundoff<T>())))
            << i;
      }
    }
}

// All digits where they are asked for, by residuals in twice the precision or in two doubles.
TEST(Contacts, RefinedSolvesHaveAllDigits) {
  for (const Family& family : families_and_robots())
    for (const double d : all_stiffness) {
      SCOPED_TRACE(std::string(family.name) + " " + std::to_string(d));
      const Model<double> model = family.make(4);
      const State<double> s = random_state(model, 6);
      const Push contacts = some_contacts(model, Axes::aligned, d, 9);
      Dynamics<double> robot = standing_robot<double>(
          model, contacts, {.tolerance = last_bits, .question = {.want = {Want::solve}}});
      VectorX<double> x = poisoned<double>(model.nv());
      ASSERT_TRUE(robot.factor(s.q, {contacts.forces, contacts.axes}));
      ASSERT_TRUE(robot.solve(s.tau, x));
      EXPECT_LE(euclid(x, Truth(model, s, {}, contacts).solution()), 2 * unit_roundoff<double>());
    }
}

// H^-1, its diagonal and blocks, and log det H, one state and rows, within what the outcome says.
TYPED_TEST(Standing, WhatIsReadOffFactorsIsThatOfH) {
  using T = TypeParam;
  const double u = static_cast<double>(unit_roundoff<T>());
  for (const Family& family : families_and_robots())
    for (const double d : all_stiffness) {
      SCOPED_TRACE(std::string(family.name) + " " + std::to_string(d));
      const Model<double> model = rounded<T>(family.make(3));
      const int nv = model.nv();
      const State<T> s = random_state(model, 5).template cast<T>();
      const Push contacts = some_contacts(model, Axes::aligned, d, 8);
      const VectorX<T> w = contacts.forces.cast<T>();
      const Truth truth(model, s.template cast<double>(), {}, contacts);
      const Selection selection{.dofs = {}, .frames = some_frames(model)};
      Question question;
      question.want = of_factors;
      question.want.insert({Want::operational, Want::operational_diagonal});
      question.frames = selection.frames;
      Dynamics<T> robot = standing_robot<T>(model, contacts, {.question = question});
      const int k = selection.size();
      const StateContacts<T> here{w, contacts.axes};
      MatrixX<T> X = MatrixX<T>::Zero(nv, nv), B = MatrixX<T>::Zero(k, k);
      VectorX<T> diagonal = poisoned<T>(nv);
      T log_det = T(0);
      const double most = default_tolerance<T>;
      const auto verify = [&] {
        EXPECT_LE(truth.inverse(X), most);
        EXPECT_LE(truth.selected(selection, B), most);
        EXPECT_LE(truth.diagonal(diagonal), most);
        EXPECT_LE(truth.log_det(static_cast<double>(log_det)), most + u * truth.log_det_size());
      };
      ASSERT_TRUE(robot.inverse_mass(s.q, X, here));
      ASSERT_TRUE(robot.diagonal(s.q, diagonal, here));
      ASSERT_TRUE(robot.log_det(s.q, log_det, here));
      ASSERT_TRUE(robot.operational(s.q, B, here));
      verify();
      VectorX<T> q(3 * s.q.size()), www(3 * w.size()),
          many = poisoned<T>(3 * nv * nv), of_many = poisoned<T>(3 * nv), logs = poisoned<T>(3),
          blocks = poisoned<T>(3 * k * k);
      q << s.q, s.q, s.q;
      www << w, w, w;
      std::vector<Outcome> outcomes(3);
      const ContactRows<T> all{www, contacts.axes};
      ASSERT_EQ(robot.inverse_mass(q, many, outcomes, 1, all), 0);
      ASSERT_EQ(robot.diagonal(q, of_many, outcomes, 1, all), 0);
      ASSERT_EQ(robot.log_det(q, logs, outcomes, 1, all), 0);
      ASSERT_EQ(robot.operational(q, blocks, outcomes, 1, all), 0);
      X = Eigen::Map<MatrixX<T>>(many.data() + nv * nv, nv, nv);
      diagonal = of_many.segment(nv, nv);
      log_det = logs[1];
      B = Eigen::Map<MatrixX<T>>(blocks.data() + k * k, k, k);
      verify();
    }
}

// Six rows that are the columns of L, L L' the inertia of a link's body, stand for that body once more.
TEST(Contacts, TheRowsOfABodyAreThatBody) {
  for (const Family& family : families_and_robots()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = family.make(5);
    const int last = model.nv() - 1;
    const Matrix6<double> M = model.inertia(last).M.matrix();
    if (M.llt().info() != Eigen::Success) continue;  // a point
    const Matrix6<double> L = M.llt().matrixL();
    Push rows{std::vector<Frame>(6, Frame{last}), VectorX<double>(36), Axes::local};
    for (int i = 0; i < 6; ++i) rows.forces.segment<6>(6 * i) = L.col(i);
    std::vector<Joint<double>> joints;
    std::vector<std::string> names;
    for (int k = 0; k <= last; ++k) {
      joints.push_back(model.joint(k));
      names.push_back(model.name(k));
    }
    joints[last].body.mass *= 2;
    joints[last].body.moments *= 2;
    const State<double> s = random_state(model, 2);
    Dynamics<double> robot =
        standing_robot<double>(model, rows, {.question = {.want = {Want::solve}}});
    VectorX<double> x = poisoned<double>(model.nv());
    ASSERT_TRUE(robot.factor(s.q, {rows.forces, rows.axes}));
    ASSERT_TRUE(robot.solve(s.tau, x));
    const Model<double> twice(joints, names, model.nq(), model.gravity());
    EXPECT_LE(euclid(x, Truth(twice, s).solution()), default_tolerance<double>);
  }
}

// The test of D looks at the robot without its contacts: what they alone hold is refused.
TEST(Contacts, DoNotHoldWhatHasNoInertia) {
  Random random(3);
  Builder builder;
  builder.add(random_joint(random, -1));
  builder.add_massless(random_joint(random, 0));
  const Model<double> model = builder.build();
  const State<double> s = random_state(model, 1);
  const Push contacts{{{1}}, random.vector(6), Axes::local};
  Dynamics<double> robot =
      standing_robot<double>(model, contacts, {.question = {.want = {Want::solve}}});
  const Outcome outcome = robot.factor(s.q, {contacts.forces, contacts.axes});
  EXPECT_EQ(outcome.status, Outcome::Status::singular);
  EXPECT_EQ(outcome.joint, 1);
}

// Factors that another call has overwritten are made again, with the contacts that they had.
TEST(Contacts, AreKeptWithTheFactors) {
  const Model<double> model = floating_base(2);
  const State<double> s = random_state(model, 3);
  Push contacts = some_contacts(model, Axes::aligned, 1e3, 4);
  Dynamics<double> robot = standing_robot<double>(
      model, contacts, {.question = {.want = {Want::solve, Want::diagonal}}});
  VectorX<double> before = poisoned<double>(model.nv()), after = before, diagonal = before;
  ASSERT_TRUE(robot.factor(s.q, {contacts.forces, contacts.axes}));
  ASSERT_TRUE(robot.solve(s.tau, before));
  contacts.forces.setZero();
  ASSERT_TRUE(robot.diagonal(s.q, diagonal));
  ASSERT_TRUE(robot.solve(s.tau, after));
  EXPECT_EQ(after, before);
}

// Joints that are locked, and DoF that are not asked about.
TEST(Contacts, StandOnWhatIsLeftOfTheRobot) {
  for (const Family& family : families_and_robots()) {
    SCOPED_TRACE(family.name);
    const Model<double> model = family.make(6);
    const State<double> s = random_state(model, 7);
    const Push contacts = some_contacts(model, Axes::world, 1e2, 5);
    Question question;
    question.want = {Want::inverse};
    question.contacts = contacts.frames;
    question.locked = some_locked(model);
    question.q.assign(s.q.data(), s.q.data() + s.q.size());
    const std::vector<int> free = all_but(model.nv(), question.locked);
    const int n = static_cast<int>(free.size());
    const MatrixX<double> H = Truth(model, s, {}, contacts).M()(free, free);
    for (const std::set<Rule>& rules : {all_rules(), std::set<Rule>{}}) {
      Dynamics<double> robot = dynamics_of<double>(model, {.question = question, .rules = rules});
      MatrixX<double> X = MatrixX<double>::Zero(n, n);
      ASSERT_TRUE(robot.inverse_mass(s.q, X, {contacts.forces, contacts.axes}));
      EXPECT_LE((X * H - MatrixX<double>::Identity(n, n)).norm(), 1e-7);
    }
  }
}

TEST(Contacts, WhatDoesNotFitIsRefused) {
  const Model<double> model = floating_base(1);
  const State<double> s = random_state(model, 1);
  const Push contacts = some_contacts(model, Axes::local, 10, 1);
  const auto refused = [](const char* what, const auto& call) {
    try {
      call();
    } catch (const std::invalid_argument& e) {
      EXPECT_NE(std::string(e.what()).find(what), std::string::npos) << e.what();
      return;
    }
    ADD_FAILURE() << what;
  };
  Dynamics<double> robot = standing_robot<double>(model, contacts, {});
  const VectorX<double> few = contacts.forces.head(6);
  refused("factor: contacts has size 6, 48 is needed", [&] { (void)robot.factor(s.q, {few}); });
  Dynamics<double> without = dynamics_of<double>(model, {});
  refused("factor: contacts has size 6, 0 is needed", [&] { (void)without.factor(s.q, {few}); });
  refused("not the last of its joint", [&] {
    (void)standing_robot<double>(model, {{{0}}, few}, {});
  });
  refused("log det of M with contacts",
          [&] { (void)standing_robot<double>(model, contacts, {.rules = {Rule::locked_joints}}); });
  VectorX<double> wrong = contacts.forces;
  wrong[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(robot.factor(s.q, {wrong, Axes::local}).status, Outcome::Status::not_finite);
}

// A step on contacts: (M + h b + J'DJ) a = tau - b v - bias, with a tendon beside, one state and rows; factors that are
// kept are those of before.
TEST(Contacts, StepsStandOnThem) {
  const double h = 0.01, b = 0.5;
  for (const Family& family : robots())
    for (const bool coupled : {false, true})
      for (const double d : all_stiffness) {
        SCOPED_TRACE(std::string(family.name) + (coupled ? " coupled " : " ") + std::to_string(d));
        Model<double> model = family.make(3);
        const int nv = model.nv(), nq = model.nq();
        const State<double> s = random_state(model, 5);
        const Push contacts = some_contacts(model, Axes::aligned, d, 8);
        JointTerms terms{.damping = std::vector<double>(nv, b)};
        std::vector<double> J(nv, 0);
        for (int k = 0; k < nv; ++k)
          if (is_single(model, k)) J[k] = 0.1 * (k + 1);
        const CoupledRow tendon{.jacobian = J, .armature = 0.3, .damping = 2};
        if (coupled) terms.rows = {tendon};
        DynamicsOptions options;
        options.question.contacts = contacts.frames;
        ImplicitStep<double> step(plain(model), h, terms, Scheme::springs_at_end, options);
        VectorX<double> a = poisoned<double>(nv), before = a, after = a;
        ASSERT_TRUE(step.factor(s.q));
        ASSERT_TRUE(step.solve(s.tau, before));
        const Outcome outcome =
            step.acceleration(s.q, s.qd, s.tau, a, {}, {contacts.forces, contacts.axes});
        ASSERT_TRUE(outcome);
        ASSERT_TRUE(step.solve(s.tau, after));
        EXPECT_EQ(before, after);

        const VectorX<double> bias = dense_mechanics(model, s).bias;
        const Eigen::Map<const VectorX<double>> along(J.data(), nv);
        for (int k = 0; k < nv; ++k) model.set_noise(k, model.joint(k).r + h * b);
        VectorX<double> torque = s.tau - b * s.qd - bias;
        if (coupled) torque -= tendon.damping * along.dot(s.qd) * along;
        // In 50 digits, whatever d is; of the tendon by Sherman and Morrison.
        const auto solution = [&](const VectorX<double>& right) {
          State<double> at = s;
          at.tau = right;
          return Truth(model, at, {}, contacts).solution();
        };
        VectorX<double> exact = solution(torque);
        if (coupled) {
          const VectorX<double> y = solution(along);
          const double W = tendon.armature + h * tendon.damping;
          exact -= W * along.dot(exact) / (1 + W * along.dot(y)) * y;
        }
        EXPECT_LE(euclid(a, exact), 1e-9);
        const int count = 3;
        VectorX<double> q = s.q.replicate(count, 1), v = s.qd.replicate(count, 1),
                        tau = s.tau.replicate(count, 1), w = contacts.forces.replicate(count, 1),
                        rows = poisoned<double>(count * nv);
        ASSERT_EQ(q.size(), count * nq);
        std::vector<Outcome> outcomes(count);
        ASSERT_EQ(step.acceleration(q, v, tau, rows, outcomes, 1, {}, {w, contacts.axes}), 0);
        for (int i = 0; i < count; ++i) EXPECT_LE(euclid(rows.segment(i * nv, nv), a), 1e-9);
        EXPECT_THROW(
            static_cast<void>(step.acceleration(q, v, tau, {.damping = v.cwiseAbs().eval()}, rows,
                                                outcomes, 1, {}, {w, contacts.axes})),
            std::invalid_argument);
      }
}

}  // namespace
}  // namespace kalmarm::test
