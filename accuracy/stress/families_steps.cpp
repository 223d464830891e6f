// Implicit steps: springs and dampers as joint noise r = armature + h b + h^2 k (kalmarm/implicit_step.hpp).
#include <cmath>

#include "accuracy/stress/parts.hpp"
#include "robots/scene/families.hpp"

namespace kalmarm::stress {
namespace {

constexpr double usual_step = 2e-3, stiff_spring = 1e6;  // h [s], k [N m/rad]
constexpr double heavy_mass = 1e6;                       // of the tip

Case step_wild(double k, std::uint64_t seed) {
  Case out = wild_mechanism(seed);
  Draw draw(~seed);
  const double h = draw.power_of_ten(-4, std::log10(2e-2));
  out.model = changed(out.model, [&](Joints& joints) {
    for (Joint<double>& joint : joints)
      if (draw.chance(0.7)) hold(joint, h, k * draw.power_of_ten(-2, 0));
  });
  return out;
}

}  // namespace

std::vector<Family> step_families() {
  const char* const stiffness = "stiffness [N m/rad]";
  const Sweep gains = {decades(0, 12, 3), decades(0, 12, 1)};
  std::vector<Family> all;
  const auto add = [&](const char* name, const char* parameter, const char* describes,
                       const Sweep& sweep, const auto& make) {
    all.push_back(
        {FamilyKind::joint_noise, name, parameter, describes, true, sweep.quick, sweep.full, make});
  };
  add("step_gain", stiffness, "A chain held by position controllers, in an implicit step of 2 ms.",
      gains, [](double k, std::uint64_t seed) {
        return at_random(held(random_chain(base_links, seed, 1), usual_step, k), seed);
      });
  add("step_size", "h [s]", "A chain held by position controllers of 1e6 N m/rad.",
      {{1e-4, 1e-3, 2e-2}, {1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2}},
      [](double h, std::uint64_t seed) {
        return at_random(held(random_chain(base_links, seed, 1), h, stiff_spring), seed);
      });
  add("step_heavy_tip", stiffness,
      "The same chain with a last link of 1e6 kg, in an implicit step of 2 ms.", gains,
      [](double k, std::uint64_t seed) {
        const Model<double> chain = held(random_chain(base_links, seed, 1), usual_step, k);
        return at_random(
            changed(chain, [](Joints& joints) { make_heavy(joints.back().body, heavy_mass); }),
            seed);
      });
  add("step_tree", stiffness, "A tree of random joints held likewise.", gains,
      [](double k, std::uint64_t seed) {
        return at_random(held(random_tree(31, seed, 1), usual_step, k), seed);
      });
  add("step_length", "N", "A chain held by position controllers of 1e6 N m/rad, in a step of 2 ms.",
      {{12, 50, 150}, {12, 25, 50, 100, 150, 250, 500}}, [](double N, std::uint64_t seed) {
        const Model<double> chain = random_chain(static_cast<int>(N), seed, 1);
        return at_random(held(chain, usual_step, stiff_spring), seed);
      });
  add("step_wild", stiffness, "Any mechanism, most of its joints held, in any implicit step.",
      {{1, 1e4, 1e8, 1e12}, decades(0, 12, 1)}, step_wild);
  return all;
}

}  // namespace kalmarm::stress
