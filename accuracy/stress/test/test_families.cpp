// Every family is a valid mechanism at every value, has the closed forms that are known of it, and
// its value is what its name says.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <stdexcept>

#include "accuracy/measures/real.hpp"
#include "accuracy/stress/families.hpp"
#include "algorithms/model/mass_matrix.hpp"
#include "algorithms/study/solver.hpp"
#include "robots/scene/families.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm::stress {
namespace {

using Vec3 = Vector3<double>;

const std::vector<Family>& robots() {
  static const std::vector<Family> all = robot_families();
  return all;
}

std::vector<Family> everything() {
  std::vector<Family> all = families();
  all.insert(all.end(), robots().begin(), robots().end());
  return all;
}

const Family& family(const std::string& name) {
  for (const std::vector<Family>* all : {&families(), &robots()})
    for (const Family& one : *all)
      if (one.name == name) return one;
  throw std::runtime_error("no family " + name);
}

bool ends_with(const std::string& text, const std::string& end) { return text.ends_with(end); }

// Values for which a test of every link is cheap.
std::vector<double> affordable(const Family& one) {
  std::vector<double> values = one.full;
  values.insert(values.end(), one.quick.begin(), one.quick.end());
  if (one.parameter == "N") std::erase_if(values, [](double N) { return N > 2000; });
  return values;
}

// Everything but qd.
std::vector<double> numbers(const Case& c) {
  std::vector<double> all(c.q.begin(), c.q.end());
  const auto add = [&](const auto& v) { all.insert(all.end(), v.begin(), v.end()); };
  for (int k = 0; k < c.model.nv(); ++k) {
    const Joint<double>& joint = c.model.joint(k);
    const RigidBody<double>& body = joint.body;
    all.insert(all.end(), {double(joint.parent), double(joint.slides), double(joint.q_index),
                           double(joint.coordinate), joint.ref, joint.r, body.mass});
    add(joint.rotation.coeffs());
    add(joint.translation);
    add(body.com);
    add(body.axes.coeffs());
    add(body.moments);
  }
  add(c.model.gravity());
  return all;
}

MatrixX<double> mass_matrix_of(const Case& c) {
  LinkKinematics<double> kin(c.model);
  CompositeInertia<double> ws(c.model);
  MatrixX<double> M(c.model.nv(), c.model.nv());
  set_position(c.model, c.q, kin);
  mass_matrix<double>(c.model, kin, ws, M);
  return M;
}

// M^-1 tau with the digits in force.
Outcome factored(const Case& c) {
  const auto solver = make_solver<Real>("Sequential<ArrayMGS>", c.model.cast<Real>());
  const VectorX<Real> zero = VectorX<Real>::Zero(c.model.nv()), tau = zero.array() + Real(1);
  VectorX<Real> a(c.model.nv());
  return solver->acceleration(c.q.cast<Real>(), zero, tau, a);
}

TEST(StressFamilies, HaveNamesOfTheirOwn) {
  std::set<std::string> names;
  for (const Family& one : everything()) {
    EXPECT_TRUE(names.insert(one.name).second) << one.name;
    EXPECT_FALSE(one.parameter.empty() || one.describes.empty()) << one.name;
  }
}

TEST(StressFamilies, SweepFewValuesOrMany) {
  for (const Family& one : everything()) {
    SCOPED_TRACE(one.name);
    for (const std::vector<double>& sweep : {one.quick, one.full}) {
      EXPECT_TRUE(std::is_sorted(sweep.begin(), sweep.end()));
      EXPECT_EQ(std::set<double>(sweep.begin(), sweep.end()).size(), sweep.size());
    }
    if (one.name == "wild") continue;
    EXPECT_GE(one.quick.size(), 3u);
    EXPECT_LE(one.quick.size(), 6u);
    EXPECT_GT(one.full.size(), one.quick.size());
    EXPECT_TRUE(one.singular.empty() || (one.quick[0] == 0 && one.full[0] == 0));
  }
}

void expect_valid(const RigidBody<double>& body) {
  EXPECT_GE(body.mass, 0);
  EXPECT_GE(body.moments.minCoeff(), 0);
  EXPECT_LE(2 * body.moments.maxCoeff(), body.moments.sum()) << body.moments.transpose();
  EXPECT_GT(body.axes.squaredNorm(), 0);
  EXPECT_TRUE(body.mass > 0 || body.massless());
}

TEST(StressFamilies, AreValidMechanisms) {
  for (const Family& one : everything())
    for (const double value : affordable(one)) {
      SCOPED_TRACE(one.name + " at " + std::to_string(value));
      const Case c = one.make(value, 3);
      for (const double number : numbers(c)) ASSERT_TRUE(std::isfinite(number));
      EXPECT_EQ(c.q.size(), c.model.nq());
      EXPECT_EQ(c.qd.size(), c.model.nv());
      EXPECT_TRUE(c.qd.allFinite());
      EXPECT_FALSE(c.qd.isZero());
      for (int k = 0; k < c.model.nv(); ++k) {
        const Joint<double>& joint = c.model.joint(k);
        EXPECT_LT(joint.parent, k);
        EXPECT_GE(joint.r, 0);
        EXPECT_GT(joint.rotation.squaredNorm(), 0);
        expect_valid(joint.body);
        EXPECT_TRUE(joint.coordinate != Coordinate::quaternion ||
                    c.q.segment<4>(joint.q_index).norm() > 0);
      }
    }
}

// Within the range of float: what is not zero stays so, and is finite. Large units are not.
TEST(StressFamilies, FitFloat32) {
  const auto fits = [](double x) {
    const float rounded = static_cast<float>(x);
    return std::isfinite(rounded) && (x == 0 || std::abs(rounded) >= 1.2e-38f);
  };
  for (const Family& one : everything())
    for (const double value : ends_with(one.name, "_unit") ? one.quick : affordable(one)) {
      SCOPED_TRACE(one.name + " at " + std::to_string(value));
      const Case c = one.make(value, 3);
      for (int k = 0; k < c.model.nv(); ++k) {
        const RigidBody<double>& body = c.model.joint(k).body;
        EXPECT_TRUE(fits(body.mass) && fits(body.mass * body.com.squaredNorm()));
        for (const double moment : body.moments) EXPECT_TRUE(fits(moment)) << moment;
      }
    }
}

TEST(StressFamilies, HaveAnInverseWhereTheySaySo) {
  const Digits digits(200);
  for (const Family& one : everything())
    for (const double value : one.quick)
      for (const std::uint64_t seed : {1, 2}) {
        const Outcome outcome = factored(one.make(value, seed));
        SCOPED_TRACE(one.name + " at " + std::to_string(value));
        if (value == 0 && !one.singular.empty()) {
          EXPECT_EQ(outcome.status, Outcome::Status::singular);
          EXPECT_EQ(std::count(one.singular.begin(), one.singular.end(), outcome.joint), 1);
        } else {
          EXPECT_TRUE(outcome) << to_string(outcome.status) << " at " << outcome.joint;
        }
      }
}

TEST(StressFamilies, HaveTheirNumberOfJoints) {
  const std::map<std::string, int> other = {{"non_minimum_phase", 64},
                                            {"non_minimum_phase_bend", 64},
                                            {"com_fraction", 32},
                                            {"heavy_leaves", 15},
                                            {"humanoid_torso", 30},
                                            {"humanoid_feet", 30},
                                            {"far_com", 3},
                                            {"floating_base", 30},
                                            {"step_tree", 31}};
  for (const Family& one : families()) {
    if (ends_with(one.name, "wild")) continue;
    for (const double value : one.quick) {
      const int nv = one.make(value, 1).model.nv();
      const auto known = other.find(one.name);
      const int expected = one.parameter == "N"   ? static_cast<int>(value)
                           : one.name == "torso"  ? 6 + 4 * static_cast<int>(value)
                           : known == other.end() ? 12
                                                  : known->second;
      EXPECT_EQ(nv, expected) << one.name;
    }
  }
}

TEST(StressFamilies, DependOnTheSeedAsTheySay) {
  for (const Family& one : everything()) {
    SCOPED_TRACE(one.name);
    const double value = one.quick.back();
    const Case first = one.make(value, 5), again = one.make(value, 5), other = one.make(value, 6);
    EXPECT_EQ(numbers(first), numbers(again));
    EXPECT_EQ(first.qd, again.qd);
    EXPECT_EQ(numbers(first) != numbers(other), one.random);
    EXPECT_TRUE(first.qd.size() != other.qd.size() || first.qd != other.qd);
  }
}

TEST(StressFamilies, ReachTheLongestChain) {
  const Case c = family("straight").make(100000, 1);
  EXPECT_EQ(c.model.nv(), 100000);
  EXPECT_TRUE(c.q.isZero(0));
}

// --- closed forms

struct EndOfChain {
  double D, g;  // of the first joint; g of the force across the link
};

EndOfChain filtered(const Case& c) {
  VectorX<double> D(c.model.nv());
  MatrixX<double> g(6, c.model.nv());
  const auto solver = make_solver<double>("Sequential<ArrayMGS>", c.model);
  EXPECT_TRUE(solver->factors(c.q, D, g));
  EXPECT_NEAR(g(2, 0), 1, 1e-15);
  return {D[0], g(4, 0)};
}

VectorX<double> eigenvalues(const Case& c) {
  return Eigen::SelfAdjointEigenSolver<MatrixX<double>>(mass_matrix_of(c)).eigenvalues();
}

double condition(const std::string& name, int N) {
  const VectorX<double> all = eigenvalues(family(name).make(N, 1));
  return all[N - 1] / all[0];
}

TEST(StressFamilies, StraightChainHasItsClosedForms) {
  const double I = 1.015 / 12, p = std::sqrt(I);
  const Case c = family("straight").make(63, 1);
  const EndOfChain end = filtered(c);
  EXPECT_NEAR(end.D, (0.5 + p) * (0.5 + p), 1e-14);
  EXPECT_NEAR(end.D, 0.625415, 1e-6);
  EXPECT_NEAR(end.g, 1 / (0.5 + p), 1e-14);
  EXPECT_NEAR(end.g, 1.264491, 1e-6);  // psi = 1 - g = -0.26449

  EXPECT_NEAR(eigenvalues(c)[0], I / 4, 0.01 * I / 4);
}

// The clamped beam has eigenvalues 1.87510^4 / N^4: 3.825 = 4 / (1.87510^4 I).
TEST(StressFamilies, StraightChainHasTheConditionOfABeam) {
  const auto excess = [](int N) { return condition("straight", N) / std::pow(N, 4) / 3.825 - 1; };
  EXPECT_NEAR(excess(127), 0, 0.02);
  EXPECT_LT(std::abs(excess(127)), 0.6 * std::abs(excess(63)));
}

TEST(StressFamilies, BendingMakesChainsEasier) {
  // Stairs are a beam too, and stiffer; curled up or folded, a chain is no longer than a few links.
  EXPECT_NEAR(condition("zigzag", 127) / std::pow(127, 4), 0.30, 0.02);
  for (const char* name : {"bent", "folded"})
    EXPECT_NEAR(std::log2(condition(name, 126) / condition(name, 63)), 2, 0.4) << name;
}

TEST(StressFamilies, ComFractionHasItsClosedForms) {
  const double I = 1e-12;
  for (const double c : {0.1, 0.3, 0.7, 0.9}) {
    const Case chain = family("com_fraction").make(c, 1);
    const double root = std::sqrt((1 - 2 * c) * (1 - 2 * c) + 4 * I), p = (1 - 2 * c + root) / 2;
    const EndOfChain end = filtered(chain);
    EXPECT_NEAR(end.D, (c + p) * (c + p), 1e-9) << c;
    EXPECT_NEAR(end.g, 1 / (c + p), 1e-9) << c;
    if (c < 0.5) continue;
    EXPECT_NEAR(eigenvalues(chain)[0], root * root / 16, 0.03 * root * root / 16) << c;
  }
  const Case chain = family("non_minimum_phase").make(1, 1);
  const double p = (0.4 + std::sqrt(0.16 + 4)) / 2;
  EXPECT_NEAR(filtered(chain).D, (0.3 + p) * (0.3 + p), 1e-12);
}

// --- the value is what it says

double length(const Case& c, int k) { return 2 * c.model.joint(k).body.com.norm(); }

double mass(const Case& c, int k) { return c.model.joint(k).body.mass; }

double heaviest_to_lightest(const Case& c) {
  double low = HUGE_VAL, high = 0;
  for (int k = 0; k < c.model.nv(); ++k) {
    if (c.model.joint(k).body.massless()) continue;
    low = std::min(low, mass(c, k));
    high = std::max(high, mass(c, k));
  }
  return high / low;
}

double gap(const Joint<double>& joint) {
  EXPECT_EQ(rotation(joint.rotation).col(2), Vec3(0, 0, 1));
  return joint.translation.head<2>().norm();
}

double turned_by(const Eigen::Quaternion<double>& q) {
  return 2 * std::atan2(q.vec().norm(), q.w());
}

double angle_from_lock(const Case& c) {  // between axes 6 and 8
  LinkKinematics<double> kin(c.model);
  set_position(c.model, c.q, kin);
  const Vec3 axis = kin.phi[6].R * kin.phi[7].R.col(2);
  EXPECT_TRUE(kin.phi[6].p.isZero(0) && kin.phi[7].p.isZero(0));
  return std::atan2(axis.head<2>().norm(), axis[2]);
}

double gyration(const RigidBody<double>& body) {
  return std::sqrt(body.moments.maxCoeff() / body.mass);
}

struct Meaning {
  const char* name;
  std::function<double(const Case&)> measured;  // the value, by the mechanism
};

std::vector<Meaning> meanings() {
  const auto body = [](int k, const auto& of) {
    return [k, of](const Case& c) { return of(c.model.joint(k).body); };
  };
  const auto masses = [](int k, int j) {
    return [k, j](const Case& c) {
      EXPECT_NEAR(heaviest_to_lightest(c), mass(c, k) / mass(c, j), 1e-9 * mass(c, k));
      return mass(c, k) / mass(c, j);
    };
  };
  const auto lengths = [](int k, int j) {
    return [k, j](const Case& c) {
      const double next = c.model.joint(j + 1).translation.norm();  // hangs on link j's end
      EXPECT_NEAR(next, length(c, j), 1e-15 * next);
      return length(c, k) / length(c, j);
    };
  };
  const auto r = [](int k) { return [k](const Case& c) { return c.model.joint(k).r; }; };
  return {
      {"heavy_tip", masses(11, 0)},
      {"heavy_base", masses(0, 11)},
      {"alternating", masses(1, 10)},
      {"growing", masses(11, 0)},
      {"decaying", masses(0, 11)},
      {"heavy_point", masses(7, 6)},
      {"planar_heavy", masses(11, 0)},
      {"heavy_leaves", masses(14, 0)},
      {"humanoid_torso", masses(5, 6)},
      {"humanoid_feet", masses(17, 5)},
      {"taper", lengths(11, 0)},
      {"inverse_taper", lengths(11, 0)},
      {"short_links", lengths(1, 0)},
      {"light_links", lengths(3, 2)},
      {"far_com", body(2, [](const auto& b) { return b.com.norm(); })},
      {"base_offset", [](const Case& c) { return c.model.joint(0).translation.norm(); }},
      {"skew", [](const Case& c) { return turned_by(c.model.joint(7).rotation); }},
      {"axis_gap", [](const Case& c) { return gap(c.model.joint(6)); }},
      {"rods", body(4,
                    [](const auto& b) {
                      EXPECT_NEAR(std::abs((b.axes * Vec3(1, 0, 0)).dot(b.com)), 0.5,
                                  1e-15);  // along the link
                      return b.moments[0] /
                             family("rods").make(1, 1).model.joint(4).body.moments[0];
                    })},
      {"point_masses",
       body(4,
            [](const auto& b) {
              return b.moments[2] /
                     family("point_masses").make(1, 1).model.joint(4).body.moments[2];
            })},
      {"flywheel", body(11,
                        [](const auto& b) {
                          return b.moments[2] /
                                 family("flywheel").make(1, 1).model.joint(11).body.moments[2];
                        })},
      {"armature", r(4)},
      {"armature_heavy_tip", r(11)},
      {"floating_base", [](const Case& c) { return c.q.head<3>().norm(); }},
      {"point_on_axis", body(11, [](const auto& b) { return b.com.template head<2>().norm(); })},
      {"rod_on_axis", body(11,
                           [](const auto& b) {
                             EXPECT_EQ(b.moments[2], 0);
                             return 2 * std::tan(turned_by(b.axes) / 2);
                           })},
      {"coaxial", [](const Case& c) { return gap(c.model.joint(6)); }},
      {"gimbal_lock", angle_from_lock},
      {"point_on_ball", body(11, gyration)},
      {"massless_tip", body(11, [](const auto& b) { return b.mass; })},
      {"massless_slide", body(10, [](const auto& b) { return b.mass; })},
      {"massless_oblique", body(5, [](const auto& b) { return b.mass; })},
      {"point_off_axis", body(11, gyration)},
  };
}

TEST(StressFamilies, MeanWhatTheirValueSays) {
  for (const Meaning& meaning : meanings())
    for (const double value : family(meaning.name).full) {
      SCOPED_TRACE(std::string(meaning.name) + " at " + std::to_string(value));
      EXPECT_NEAR(meaning.measured(family(meaning.name).make(value, 1)), value, 1e-14 * value);
    }
}

TEST(StressFamilies, ScaleBodiesAsAWholeUnlessTheySayOtherwise) {
  for (const char* name : {"heavy_tip", "growing", "alternating", "random_masses"}) {
    const Case c = family(name).make(1e12, 1);
    for (int k = 0; k < 12; ++k) {
      EXPECT_GE(gyration(c.model.joint(k).body), 0.2) << name;
      EXPECT_LE(gyration(c.model.joint(k).body), std::sqrt(0.12)) << name;
    }
  }
  EXPECT_LE(family("heavy_point").make(1e12, 1).model.joint(7).body.moments.maxCoeff(), 0.12);
  EXPECT_EQ(family("flywheel").make(1e12, 1).model.joint(11).body.mass, 1);
  const double ratio = heaviest_to_lightest(family("random_masses").make(1e12, 1));
  EXPECT_GT(ratio, 1e6);
  EXPECT_LE(ratio, 1e12);
}

TEST(StressFamilies, TaperAllDimensionsOfALinkButInShortLinks) {
  for (const char* name : {"taper", "inverse_taper", "light_links", "short_links"}) {
    const Case c = family(name).make(0.01, 1);
    for (int k = 0; k < 12; ++k) {
      const double l = length(c, k), cube = l * l * l;
      EXPECT_NEAR(mass(c, k), name == std::string("short_links") ? 1 : cube, 1e-14) << name;
      EXPECT_NEAR(gyration(c.model.joint(k).body) / l, 0.27, 0.08) << name;
    }
  }
}

TEST(StressFamilies, StiffJointsStandForAnImplicitStep) {
  const Case c = family("stiff").make(1e6, 1);
  for (int k = 0; k < 12; ++k)
    EXPECT_NEAR(c.model.joint(k).r, k % 2 ? 0.01 + 1e-3 * 2e3 + 1e-6 * 1e6 : 0, 1e-15) << k;
}

TEST(StressFamilies, StepsHaveTheNoiseOfAnImplicitStep) {
  const double h = 2e-3, k = 1e6, b = 2e3;
  for (const char* name : {"step_gain", "step_heavy_tip"}) {
    const Case c = family(name).make(k, 1);
    for (int i = 0; i < 12; ++i)
      EXPECT_NEAR(c.model.joint(i).r, h * b + h * h * k, 1e-14) << name << i;
  }
  const Case fast = family("step_size").make(1e-4, 1);
  EXPECT_NEAR(fast.model.joint(3).r, 1e-4 * b + 1e-8 * k, 1e-15);
  // Ball joints have no springs.
  const Case tree = family("step_tree").make(1e12, 3), free = family("step_tree").make(1, 3);
  for (int i = 0; i < 31; ++i) {
    const Joint<double>& joint = tree.model.joint(i);
    const bool single =
        joint.coordinate == Coordinate::angle || joint.coordinate == Coordinate::distance;
    EXPECT_EQ(joint.r > 1e5, single) << i;
    EXPECT_EQ(joint.r == free.model.joint(i).r, !single) << i;
  }
  // The wild ones are those of `wild`, but for r.
  const Case wild = family("wild").make(1, 7), held = family("step_wild").make(1e8, 7);
  ASSERT_EQ(wild.model.nv(), held.model.nv());
  EXPECT_EQ(wild.q, held.q);
  int more = 0;
  for (int i = 0; i < wild.model.nv(); ++i) {
    EXPECT_EQ(mass(wild, i), mass(held, i));
    EXPECT_GE(held.model.joint(i).r, wild.model.joint(i).r);
    more += held.model.joint(i).r > wild.model.joint(i).r;
  }
  EXPECT_GT(more, 0);
}

// Powers of two are exact: M is the same to the last bit.
TEST(StressFamilies, UnitsScaleTheMassMatrixExactly) {
  const std::map<std::string, int> power = {{"mass_unit", 1}, {"length_unit", 2}};
  for (const auto& [name, exponent] : power) {
    const MatrixX<double> M = mass_matrix_of(family(name).make(1, 1));
    for (const int j : {-40, 40})
      EXPECT_EQ(mass_matrix_of(family(name).make(std::ldexp(1, j), 1)),
                M * std::ldexp(1, j * exponent))
          << name;
    for (const double unit : family(name).full)
      EXPECT_LE((mass_matrix_of(family(name).make(unit, 1)) / std::pow(unit, exponent) - M).norm(),
                1e-13 * M.norm())
          << name << ' ' << unit;
  }
}

TEST(StressFamilies, WildMechanismsAreSpreadAsTheySay) {
  constexpr int seeds = 400;
  double joints = 0, slides = 0, with_r = 0, branches = 0, parallel = 0, skew = 0;
  double light = HUGE_VAL, heavy = 0, shortest = HUGE_VAL, longest = 0;
  std::set<int> sizes;
  for (int seed = 0; seed < seeds; ++seed) {
    const Case c = family("wild").make(1, seed);
    sizes.insert(c.model.nv());
    for (int k = 0; k < c.model.nv(); ++k) {
      const Joint<double>& joint = c.model.joint(k);
      const double turn = turned_by(joint.rotation);
      ++joints;
      slides += joint.slides;
      with_r += joint.r > 0;
      branches += joint.parent != k - 1;
      parallel += turn == 0;
      skew += turn > 0 && turn <= 0.1 && joint.rotation.y() == 0;
      light = std::min(light, mass(c, k));
      heavy = std::max(heavy, mass(c, k));
      shortest = std::min(shortest, length(c, k));
      longest = std::max(longest, length(c, k));
      EXPECT_LE(gyration(joint.body), 2 * length(c, k));
      EXPECT_TRUE(!joint.slides || std::abs(c.q[k]) <= length(c, k));
    }
  }
  EXPECT_EQ(*sizes.begin(), 4);
  EXPECT_EQ(*sizes.rbegin(), 23);
  EXPECT_EQ(sizes.size(), 20u);
  EXPECT_NEAR(slides / joints, 0.25, 0.03);
  EXPECT_NEAR(with_r / joints, 0.30, 0.03);
  EXPECT_NEAR(parallel / joints, 0.15, 0.03);
  EXPECT_NEAR(skew / joints, 0.10, 0.03);
  EXPECT_GT(branches / joints, 0.15);
  EXPECT_LT(branches / joints, 0.30);
  EXPECT_NEAR(std::log10(light), -6, 0.1);
  EXPECT_NEAR(std::log10(heavy), 6, 0.1);
  EXPECT_NEAR(std::log10(shortest), -2, 0.1);
  EXPECT_NEAR(std::log10(longest), 2, 0.1);
}

// --- robots

TEST(StressedRobots, AreAllThatShip) {
  for (const std::string& name : shipped_robots()) {
    const Model<double> shipped = load_scene(name).model;
    for (const char* what : {"_payload", "_light_wrist", "_pose"})
      EXPECT_EQ(family(name + what).make(1, 1).model.nv(), shipped.nv()) << name;
  }
}

// At 1 every robot is as it ships. Otherwise so many links, or the armature, are scaled.
TEST(StressedRobots, ChangeWhatTheySay) {
  for (const std::string& name : shipped_robots()) {
    SCOPED_TRACE(name);
    const Model<double> shipped = load_scene(name).model;
    const auto scaled_links = [&](const char* what, double value) {
      const Case c = family(name + what).make(value, 1);
      int scaled = 0;
      for (int k = 0; k < shipped.nv(); ++k) {
        if (shipped.joint(k).body.massless()) continue;
        const double ratio = mass(c, k) / shipped.joint(k).body.mass;
        scaled += ratio != 1;
        EXPECT_TRUE(ratio == 1 || std::abs(ratio / value - 1) < 1e-15);
      }
      return scaled;
    };
    EXPECT_EQ(scaled_links("_payload", 1), 0);
    EXPECT_EQ(scaled_links("_payload", 1e3), 1);
    EXPECT_EQ(scaled_links("_light_wrist", 1), 0);
    EXPECT_EQ(scaled_links("_light_wrist", 1e-3), name == "two_link" ? 1 : 3);
  }
}

TEST(StressedRobots, CanBeStretchedOut) {
  for (const Family& one : robots()) {
    if (!ends_with(one.name, "_pose")) continue;
    const Case c = one.make(0, 1);
    for (int k = 0; k < c.model.nv(); ++k) {
      const Joint<double>& joint = c.model.joint(k);
      if (joint.coordinate == Coordinate::quaternion) {
        const Eigen::Vector4d turn = c.q.segment<4>(joint.q_index);
        EXPECT_EQ(turn, Eigen::Vector4d(1, 0, 0, 0)) << one.name;
      } else if (joint.coordinate != Coordinate::follower) {
        EXPECT_EQ(c.q[joint.q_index], 0) << one.name;
      }
    }
  }
}

TEST(StressedRobots, CanDoWithoutArmature) {
  int with_armature = 0;
  for (const Family& one : robots()) {
    if (!ends_with(one.name, "_armature")) continue;
    ++with_armature;
    const Case off = one.make(0, 1), on = one.make(1, 1);
    double total = 0;
    for (int k = 0; k < on.model.nv(); ++k) {
      EXPECT_EQ(off.model.joint(k).r, 0) << one.name;
      total += on.model.joint(k).r;
    }
    EXPECT_GT(total, 0) << one.name;
  }
  EXPECT_EQ(with_armature, 8);  // of eleven; the files of hyq, iiwa14 and two_link have none
}

}  // namespace
}  // namespace kalmarm::stress
