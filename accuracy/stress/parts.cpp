#include "accuracy/stress/parts.hpp"

#include <cmath>
#include <iterator>

#include "robots/scene/families.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm::stress {

std::vector<double> decades(int first, int last, int step) {
  std::vector<double> values;
  for (int exponent = first; exponent <= last; exponent += step)
    values.push_back(std::pow(10, exponent));
  return values;
}

Sweep mass_ratios() { return {decades(0, 16, 4), decades(0, 24, 2)}; }

Case at_random(const Model<double>& model, std::uint64_t seed) {
  // ~seed: other numbers than those that made the mechanism
  State state = random_states(generated_scene("", model), 1, ~seed)[0];
  return {model, std::move(state.q), std::move(state.qd)};
}

Case at(const Model<double>& model, const VectorX<double>& q, std::uint64_t seed) {
  Case out = at_random(model, seed);
  out.q = q;
  return out;
}

Joints joints_of(const Model<double>& model) {
  Joints joints;
  for (int k = 0; k < model.nv(); ++k) joints.push_back(model.joint(k));
  return joints;
}

void hold(Joint<double>& joint, double h, double k) {
  const double b = 2 * std::sqrt(k);
  joint.r += h * (b + h * k);
}

Model<double> held(const Model<double>& model, double h, double k) {
  return changed(model, [&](Joints& joints) {
    for (Joint<double>& joint : joints)
      if (joint.coordinate == Coordinate::angle || joint.coordinate == Coordinate::distance)
        hold(joint, h, k);
  });
}

void make_heavy(RigidBody<double>& body, double factor) {
  body.mass *= factor;
  body.moments *= factor;
}

void make_long(Joints& joints, int k, double factor) {
  joints[k].body.com *= factor;
  joints[k].body.moments *= factor * factor;
  for (Joint<double>& joint : joints)
    if (joint.parent == k) joint.translation *= factor;
}

void make_large(Joints& joints, int k, double factor) {
  make_long(joints, k, factor);
  make_heavy(joints[k].body, factor * factor * factor);
}

const char* to_string(FamilyKind kind) {
  switch (kind) {
    case FamilyKind::long_chain:
      return "long_chain";
    case FamilyKind::heavy_outboard:
      return "heavy_outboard";
    case FamilyKind::heavy_inboard:
      return "heavy_inboard";
    case FamilyKind::uneven_lengths:
      return "uneven_lengths";
    case FamilyKind::near_parallel_axes:
      return "near_parallel_axes";
    case FamilyKind::point_masses:
      return "point_masses";
    case FamilyKind::inboard_com:
      return "inboard_com";
    case FamilyKind::joint_noise:
      return "joint_noise";
    case FamilyKind::tree:
      return "tree";
    case FamilyKind::units:
      return "units";
    case FamilyKind::singular:
      return "singular";
    case FamilyKind::robot:
      return "robot";
    case FamilyKind::wild:
      return "wild";
  }
  return "";
}

std::vector<Family> on_chain(const std::vector<OnChain>& all) {
  std::vector<Family> families;
  for (const OnChain& one : all) {
    const auto make = [change = one.change](double value, std::uint64_t seed) {
      const Model<double> chain = random_chain(base_links, seed, 1);
      return at_random(changed(chain, [&](Joints& joints) { change(joints, value); }), seed);
    };
    families.push_back({one.kind, one.name, one.parameter, one.describes, true, one.sweep.quick,
                        one.sweep.full, make, one.singular});
  }
  return families;
}

const std::vector<Family>& families() {
  static const std::vector<Family> all = [] {
    std::vector<Family> all;
    for (const auto& theme : {length_families, mass_families, geometry_families, singular_families,
                              tree_families, step_families}) {
      std::vector<Family> some = theme();
      std::move(some.begin(), some.end(), std::back_inserter(all));
    }
    return all;
  }();
  return all;
}

}  // namespace kalmarm::stress
