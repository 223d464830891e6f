// What may happen to a user's robot: a stress is the robot with one number to turn up or down.
//
//   poses        the robot as it is given
//   payload      a load on a tip: mass and inertia of its link times 1 + value
//   armature     armature times value; 0 is none
//   light_wrist  mass and inertia of the last links times value: up to three of the longest limb,
//                one less than it has, and what they carry
//   long_tool    a thin rod on the tip of the longest limb, value times as long as the tip's link,
//                of 1 % of its mass, from the joint through the link's centre of mass
//   contact      the end of a rod as long as each tip's link resists motions of all directions with value
//                [kg]: a point of that mass there, so that the robot's M^-1 is H^-1, H = M + J'DJ
//                (docs/contacts.md), in which a batch method and the filter have value squared; its accelerations
//                are those of a robot that carries these points. The library's contacts keep more (`contacts`)
//   light_base   mass and inertia of the longest limb's first link times value
//   gain         implicit steps of 2 ms with position controllers of value [N m/rad or N/m] on every
//                hinge and slide: M^ of kalmarm/implicit_step.hpp, damping 2 sqrt(value)
//   step         the same with 1e5, in steps of value [ms]
//
// Links without inertia do not count. A limb ends at a link that carries no other; where several
// end side by side on one link, as fingers do on a hand, that link is the tip. Of limbs whose links
// have the same masses, left and right, the first is loaded. A link's length is that of a rod with
// its mass and its inertia about its joint's origin: sqrt(3 (c'c + tr(J) / (2 m))).
//
// A body that moves by itself has no tip: to scale it is to change the unit of mass.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "algorithms/model/model.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm::limits {

struct Stress {
  std::string name;   // such as "payload"; several tips: "payload:TIP"
  std::string title;  // "Payload on hand"
  std::string unit;   // of the values: "times its mass"
  std::string
      range;  // where it ends, for the sentence: "with up to {} times the mass of hand on it"
  std::vector<double> values;  // from the least change on; 1 may be none, where `scales`
  bool scales = false;         // what is there already: at 1 the robot is as given
  std::function<Model<double>(double value)> model;
  bool told = false;  // in the sentence, though the promise is kept at all values
};

// The first is `poses`, whose one value is 1.
std::vector<Stress> stresses_of(const Scene& scene);

// 3000, 0.01, 1e6
std::string short_value(double value);

}  // namespace kalmarm::limits
