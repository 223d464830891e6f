#include "accuracy/limits/stresses.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "accuracy/stress/parts.hpp"
#include "algorithms/spatial/principal_axes.hpp"

namespace kalmarm::limits {
namespace {

using stress::changed;
using stress::decades;
using stress::held;
using stress::make_heavy;

constexpr double tool_mass = 0.01;                     // of the link's
constexpr int wrist_links = 3;                         // at most
constexpr double usual_step = 2e-3, usual_gain = 1e5;  // [s], [N m/rad]
constexpr double same_mass = 1e-3;  // relative difference of links that are alike

// The tree of the links with inertia.
class Limbs {
 public:
  explicit Limbs(const Model<double>& model) : model_(model), children_(model.nv(), 0) {
    for (int k = 0; k < model.nv(); ++k)
      if (!massless(k) && parent(k) >= 0) ++children_[parent(k)];
  }

  // Every tip once, in order, but for bodies that move by themselves.
  std::vector<int> tips() const {
    std::vector<int> out, leaves(model_.nv(), 0);
    const auto is_leaf = [&](int k) { return !massless(k) && children_[k] == 0 && parent(k) >= 0; };
    for (int k = 0; k < model_.nv(); ++k)
      if (is_leaf(k)) ++leaves[parent(k)];
    for (int k = 0; k < model_.nv(); ++k) {
      if (!is_leaf(k)) continue;
      const int tip = leaves[parent(k)] > 1 ? parent(k) : k;
      if (std::ranges::find(out, tip) == out.end()) out.push_back(tip);
    }
    return out;
  }

  // The tips that are not like one before.
  std::vector<int> different_tips() const {
    std::vector<int> out;
    for (const int tip : tips())
      if (std::ranges::none_of(out, [&](int other) { return alike(tip, other); }))
        out.push_back(tip);
    return out;
  }

  // From a tip to the base.
  std::vector<int> chain(int tip) const {
    std::vector<int> out;
    for (int k = tip; k >= 0; k = parent(k)) out.push_back(k);
    return out;
  }

  // The link and all that it carries.
  std::vector<int> carried(int link) const {
    std::vector<int> out;
    for (int k = link; k < model_.nv(); ++k)
      if (k == link || std::ranges::find(out, model_.parent(k)) != out.end()) out.push_back(k);
    return out;
  }

 private:
  bool massless(int k) const { return model_.joint(k).body.massless(); }

  int parent(int k) const {
    do k = model_.parent(k);
    while (k >= 0 && massless(k));
    return k;
  }

  // Masses from the tip to where the limb branches off.
  std::vector<double> masses(int tip) const {
    std::vector<double> out = {model_.joint(tip).body.mass};
    for (int k = parent(tip); k >= 0 && children_[k] == 1; k = parent(k))
      out.push_back(model_.joint(k).body.mass);
    return out;
  }

  bool alike(int a, int b) const {
    return std::ranges::equal(masses(a), masses(b), [](double x, double y) {
      return std::abs(x - y) <= same_mass * std::max(x, y);
    });
  }

  const Model<double>& model_;
  std::vector<int> children_;
};

// Mass and inertia of some links times a factor.
Model<double> scaled(const Model<double>& model, const std::vector<int>& links, double factor) {
  return changed(model, [&](Joints& joints) {
    for (const int k : links) make_heavy(joints[k].body, factor);
  });
}

double length_of(const RigidBody<double>& body) {
  const double inertia = body.mass > 0 ? body.moments.sum() / (2 * body.mass) : 0;
  return std::sqrt(3 * (body.com.squaredNorm() + inertia));
}

// A thin rod from the origin, along the way to the body's com or, where that is the origin, z.
RigidBody<double> tool(const RigidBody<double>& body, double times) {
  const double mass = tool_mass * body.mass, length = times * length_of(body);
  const Vector3<double> z = Vector3<double>::UnitZ(),
                        along = body.com.norm() > 0 ? body.com.normalized().eval() : z;
  const double moment = mass * length * length / 12;
  return {mass,
          along * (length / 2),
          Eigen::Quaternion<double>::FromTwoVectors(z, along),
          {moment, moment, 0}};
}

Stress payload(const Scene& scene, int tip, bool one_of_many) {
  const std::string link = link_name(scene, tip);
  return {"payload" + (one_of_many ? ":" + link : ""),
          "Payload on " + link,
          "times its mass",
          "with up to {} times the mass of " + link + " on it",
          decades(0, 8, 1),
          false,
          [model = scene.model, tip](double value) { return scaled(model, {tip}, 1 + value); }};
}

Stress armature(const Scene& scene) {
  return {"armature",
          "Armature",
          "of the given",
          "with armature down to {} of the given",
          {1, 0.1, 0.01, 1e-3, 1e-4, 0},
          true,
          [model = scene.model](double value) {
            return changed(model, [&](Joints& joints) {
              for (Joint<double>& joint : joints) joint.r *= value;
            });
          }};
}

// Links lose their mass: the first of them carries the others. part: its name in the title.
Stress light(const Scene& scene, const std::string& name, const std::string& part,
             const std::vector<int>& links) {
  const bool alone = links.size() == 1;
  const std::string what = link_name(scene, links[0]) + (alone ? "" : " and all that it carries");
  return {name,
          "Light " + part + ", " + what,
          "of the given mass",
          "with " + what + " down to {} of " + (alone ? "its" : "their") + " mass",
          {1, 1e-2, 1e-4, 1e-6, 1e-8},
          true,
          [model = scene.model, links](double value) { return scaled(model, links, value); }};
}

// chain: the longest limb.
Stress light_wrist(const Scene& scene, const Limbs& limbs, const std::vector<int>& chain) {
  const int links = std::min<int>(wrist_links, static_cast<int>(chain.size()) - 1);
  return light(scene, "light_wrist", "wrist", limbs.carried(chain[links - 1]));
}

Stress long_tool(const Scene& scene, int tip) {
  const std::string link = link_name(scene, tip);
  return {"long_tool",
          "Light rod on " + link,
          "times its length",
          "with a light rod on " + link + " up to {} times as long as it",
          decades(0, 3, 1),
          false,
          [model = scene.model, tip](double value) {
            return changed(model, [&](Joints& joints) {
              RigidBody<double>& body = joints[tip].body;
              body = welded(body, tool(body, value));
            });
          }};
}

Stress contact(const Scene& scene, const std::vector<int>& tips) {
  const std::string links = tips.size() == 1 ? link_name(scene, tips[0]) : "all tips";
  return {"contact",
          "Points of contact on " + links,
          "kg",
          "on " + links + " with contacts of up to {} kg",
          decades(0, 12, 2),
          false,
          [model = scene.model, tips](double value) {
            return changed(model, [&](Joints& joints) {
              for (const int tip : tips) {
                RigidBody<double>& body = joints[tip].body;
                const Vector3<double> end = 2 * tool(body, 1).com;
                body = welded(body, {value, end});
              }
            });
          }};
}

Stress gain(const Scene& scene) {
  return {"gain",
          "Position gains in steps of 2 ms",
          "N m/rad",
          "by discrete steps of 2 ms with position gains up to {} N m/rad",
          {1, 1e3, 1e6, 1e9},
          false,
          [model = scene.model](double value) { return held(model, usual_step, value); },
          true};
}

Stress step(const Scene& scene) {
  return {"step",
          "Steps with position gains of 1e5 N m/rad",
          "ms",
          "by discrete steps of up to {} ms with position gains of 1e5 N m/rad",
          {0.1, 1, 20},
          false,
          [model = scene.model](double value) { return held(model, 1e-3 * value, usual_gain); }};
}

bool has_armature(const Model<double>& model) {
  for (int k = 0; k < model.nv(); ++k)
    if (model.joint(k).r > 0) return true;
  return false;
}

}  // namespace

std::vector<Stress> stresses_of(const Scene& scene) {
  const Model<double>& model = scene.model;
  const Limbs limbs(model);
  std::vector<Stress> out = {
      {"poses", "All poses", "", "", {1}, true, [model](double) { return model; }}};
  const std::vector<int> tips = limbs.different_tips();
  for (const int tip : tips) out.push_back(payload(scene, tip, tips.size() > 1));
  if (has_armature(model)) out.push_back(armature(scene));
  if (tips.empty()) return out;
  std::vector<int> longest;
  for (const int tip : tips)
    if (const std::vector<int> chain = limbs.chain(tip); chain.size() > longest.size())
      longest = chain;
  if (longest.size() > 1) out.push_back(light_wrist(scene, limbs, longest));
  out.push_back(long_tool(scene, longest.front()));
  if (longest.size() > 1) out.push_back(light(scene, "light_base", "first link", {longest.back()}));
  out.push_back(contact(scene, tips));
  out.push_back(gain(scene));
  out.push_back(step(scene));
  return out;
}

std::string short_value(double value) {
  char text[32];
  if (value != 0 && (std::abs(value) >= 1e4 || std::abs(value) < 1e-3)) {
    const double exponent = std::floor(std::log10(std::abs(value)) + 1e-9);
    std::snprintf(text, sizeof text, "%.3ge%.0f", value / std::pow(10, exponent), exponent);
  } else {
    std::snprintf(text, sizeof text, "%.4g", value);
  }
  return text;
}

}  // namespace kalmarm::limits
