// A variant as it is named on a command line, made for a scene: the fast path by its own engines,
// others as engines of the study, MuJoCo by itself.
#pragma once

#include <memory>
#include <string>

#include "algorithms/study/solver.hpp"
#include "kalmarm/dynamics.hpp"
#include "robots/scene/question.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm {

inline constexpr const char* mujoco_variant = "MuJoCo";  // stands beside those of the registry

struct Contender {
  std::string variant, precision;  // as on the command line: float32, float64 or mp
};

// Of the whole robot. Throws InputError where the variant is unknown or has no such precision.
template <class T>
std::unique_ptr<Solver<T>> make_contender(const Contender& by, const Scene& scene,
                                          const Model<T>& model);

// The same behind the door.
template <class T>
Dynamics<T> make_robot(const Contender& by, const Scene& scene, const DynamicsOptions& asked);

// What is asked of Dynamics: the question, and the rules that the variant can follow. Throws
// InputError where MuJoCo cannot answer.
DynamicsOptions asked_of(const Contender& by, const QuestionOptions& asked,
                         const Question& question);

}  // namespace kalmarm
