// What a variant says of mechanisms whose mass matrix is singular, of those that only look so, and
// of NaN.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "algorithms/study/solver.hpp"
#include "algorithms/test/models.hpp"
#include "algorithms/test/singular.hpp"

namespace kalmarm::test {
namespace {

constexpr int seeds = 20;

template <class T>
struct Reply {
  Outcome acceleration, inverse;
  VectorX<T> a;
  MatrixX<T> X;
};

template <class T>
Reply<T> ask(Solver<T>& solver, const VectorX<double>& q, int nv) {
  Reply<T> reply;
  reply.a.setZero(nv);
  reply.X.setZero(nv, nv);
  const VectorX<T> ones = VectorX<T>::Ones(nv);
  reply.acceleration = solver.acceleration(q.cast<T>(), ones, ones, reply.a);
  reply.inverse = solver.inverse(q.cast<T>(), reply.X);
  return reply;
}

std::string describe(const Outcome& o) {
  return std::string(to_string(o.status)) + " at " + std::to_string(o.joint) + ", D/scale " +
         std::to_string(std::log10(std::abs(o.D) / o.scale)) + " (log10)";
}

template <class T>
class Outcomes : public testing::Test {
 protected:
  using Check = std::function<void(const std::string& variant, const Mechanism&, Solver<T>&)>;

  static void for_each(const std::vector<Mechanism>& mechanisms, bool exhibits,
                       const Check& check) {
    for (const RegisteredVariant<T>& variant : registered_variants<T>())
      for (const Mechanism& mechanism : mechanisms) {
        if (!variant.traits.contender && !exhibits) continue;
        const Model<T> model = mechanism.model.template cast<T>();
        if (!variant.takes(model)) continue;
        SCOPED_TRACE(variant.name + " on " + mechanism.name);
        check(variant.name, mechanism, *variant.make(model));
      }
  }
};

struct PrecisionName {
  template <class T>
  static std::string GetName(int) {
    return std::is_same_v<T, float> ? "float32" : "float64";
  }
};

// What is admitted: batch forms may miss a mechanism that is singular twice over (batch.hpp), QR
// one whose M(k,k) is rounding itself, and the test of singularity.hpp knows the rounding of link
// frames.
bool misses_singularity(const std::string& variant, const std::string& mechanism) {
  if (variant == "StackedQR") return mechanism == "point_mass_on_an_inner_axis";
  return variant.find("Batch") != std::string::npos &&
         mechanism == "point_mass_on_three_hinges_that_meet";
}

// D of a singular mechanism is no more than rounding. The study's variants say so by the size of what
// D is summed from, of which rounding leaves u; the library's forms by the error that D may have.
double lost_below(const std::string& variant) {
  for (const char* const on_axis_frames : {"Ladder<", "Rung<", "AxisFrames<"})
    if (variant.starts_with(on_axis_frames)) return 1;
  return 1e-3;
}

using Precisions = testing::Types<float, double>;
TYPED_TEST_SUITE(Outcomes, Precisions, PrecisionName);

TYPED_TEST(Outcomes, SingularMechanismIsReportedWithItsJoint) {
  for (int seed = 0; seed < 20 * seeds; ++seed) {
    SCOPED_TRACE(seed);
    this->for_each(
        singular_mechanisms(seed), seed < seeds,
        [](const std::string& variant, const Mechanism& mechanism, Solver<TypeParam>& solver) {
          if (variant.find("World") != std::string::npos) return;  // in_world_frame.hpp
          const auto reply = ask(solver, mechanism.q, mechanism.model.nv());
          const bool gap = misses_singularity(variant, mechanism.name);
          for (const Outcome& outcome : {reply.acceleration, reply.inverse}) {
            if (gap && outcome) continue;
            ASSERT_FALSE(outcome);
            EXPECT_TRUE(std::ranges::count(mechanism.joints, outcome.joint)) << describe(outcome);
            EXPECT_LE(std::abs(outcome.D), lost_below(variant) * outcome.scale)
                << describe(outcome);
          }
        });
  }
}

TYPED_TEST(Outcomes, RegularMechanismIsSolved) {
  for (int seed = 0; seed < seeds; ++seed) {
    SCOPED_TRACE(seed);
    this->for_each(regular_mechanisms(seed), seed < 3,
                   [](const std::string&, const Mechanism& mechanism, Solver<TypeParam>& solver) {
                     const auto reply = ask(solver, mechanism.q, mechanism.model.nv());
                     EXPECT_TRUE(reply.acceleration) << describe(reply.acceleration);
                     EXPECT_TRUE(reply.inverse) << describe(reply.inverse);
                     EXPECT_TRUE(reply.a.allFinite() && reply.X.allFinite());
                   });
  }
}

TYPED_TEST(Outcomes, LongStretchedChainIsRegularForTheFilters) {
  // kappa(M) = 2.6e11, D(k) / M(k,k) down to 1e-8; but every D is known to a few u.
  const Mechanism mechanism{"straight_chain", straight_chain(512), VectorX<double>::Zero(512), {}};
  this->for_each({mechanism}, false,
                 [](const std::string&, const Mechanism& mechanism, Solver<TypeParam>& solver) {
                   if (!solver.has_factors()) return;
                   const auto reply = ask(solver, mechanism.q, mechanism.model.nv());
                   EXPECT_TRUE(reply.acceleration) << describe(reply.acceleration);
                   EXPECT_TRUE(reply.inverse) << describe(reply.inverse);
                 });
}

TEST(OutcomesInDouble, HeavyTipIsRegular) {
  for (const RegisteredVariant<double>& variant : registered_variants<double>()) {
    if (variant.traits.mixed_precision) continue;  // u of float32 times 1e6 is not small
    Random random(55);
    Builder builder;
    for (int k = 0; k < 12; ++k) {
      Joint<double> joint = random_joint(random, k - 1);
      if (k == 11) joint.body.mass *= 1e6, joint.body.moments *= 1e6;
      builder.add(joint);
    }
    const Model<double> model = builder.build();
    const auto reply = ask(*variant.make(model), random_state(model, 56).q, model.nv());
    EXPECT_TRUE(reply.acceleration) << variant.name << describe(reply.acceleration);
    EXPECT_TRUE(reply.inverse) << variant.name << describe(reply.inverse);
  }
}

// Where M does not depend on that entry of q, its inverse may well be ok.
TYPED_TEST(Outcomes, NaNPositionIsNeverAnsweredWithNaN) {
  std::vector<Mechanism> mechanisms;
  for (const Family& family : families()) {
    const Model<double> model = family.make(57);
    mechanisms.push_back({family.name, model, random_state(model, 58).q, {}});
  }
  this->for_each(mechanisms, true,
                 [](const std::string&, const Mechanism& mechanism, Solver<TypeParam>& solver) {
                   const int nv = mechanism.model.nv();
                   const auto before = ask(solver, mechanism.q, nv);
                   for (int i = 0; i < mechanism.q.size(); ++i) {
                     VectorX<double> q = mechanism.q;
                     q[i] = std::numeric_limits<double>::quiet_NaN();
                     const auto reply = ask(solver, q, nv);
                     EXPECT_TRUE(!reply.acceleration || reply.a.allFinite()) << "q[" << i << "]";
                     EXPECT_TRUE(!reply.inverse || reply.X.allFinite()) << "q[" << i << "]";
                   }
                   const auto after = ask(solver, mechanism.q, nv);
                   EXPECT_EQ(before.a, after.a);
                   EXPECT_EQ(before.X, after.X);
                 });
}

}  // namespace
}  // namespace kalmarm::test
