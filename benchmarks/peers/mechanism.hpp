// A model as other libraries see it: joints of several DoF are whole again.
#pragma once

#include "benchmarks/peers/peer.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm {

// Refers to the model. Throws InputError where a joint of several DoF does not end in its body.
Mechanism make_mechanism(const Model<double>& model);

// The same robot with no armature, for libraries that know none.
Scene without_armature(const Scene& scene);

}  // namespace kalmarm
