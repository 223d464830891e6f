// The table of an instruction set: what makes the engines of its kernels. Everything else that the
// kernels' files define is local to their instruction set.
#pragma once

#include <vector>

#include "algorithms/fast/check/check_engine.hpp"
#include "algorithms/fast/derivatives/gradient_engine.hpp"
#include "algorithms/fast/engine/engine.hpp"
#include "algorithms/fast/frames/kinematics_engine.hpp"

namespace kalmarm {

// In double, each in a file of its own.
std::unique_ptr<Engine<double>> make_spatial_engine(const RobotModel& robot,
                                                    const EngineOptions& options);
std::unique_ptr<Engine<double>> make_translational_engine(const RobotModel& robot,
                                                          const EngineOptions& options);

template <class T>
std::unique_ptr<KinematicsEngine<T>> make_engine_of_kinematics(const RobotModel& robot,
                                                               const std::vector<Frame>& frames,
                                                               const std::vector<int>& bodies);

template <class T>
std::unique_ptr<GradientEngine<T>> make_engine_of_gradients(const RobotModel& robot,
                                                            const CallFrames& frames);

std::unique_ptr<CheckEngine> make_check_engine(const RobotModel& robot,
                                               const AnswerCheckOptions& options);

struct Engines {
  std::unique_ptr<Engine<float>> (*make_float)(const RobotModel&, const EngineOptions&);
  std::unique_ptr<Engine<double>> (*make_double)(const RobotModel&, const EngineOptions&);
  std::unique_ptr<KinematicsEngine<float>> (*kinematics_float)(const RobotModel&,
                                                               const std::vector<Frame>&,
                                                               const std::vector<int>&);
  std::unique_ptr<KinematicsEngine<double>> (*kinematics_double)(const RobotModel&,
                                                                 const std::vector<Frame>&,
                                                                 const std::vector<int>&);
  std::unique_ptr<GradientEngine<float>> (*gradients_float)(const RobotModel&, const CallFrames&);
  std::unique_ptr<GradientEngine<double>> (*gradients_double)(const RobotModel&, const CallFrames&);
  std::unique_ptr<CheckEngine> (*check)(const RobotModel&, const AnswerCheckOptions&);
};

}  // namespace kalmarm

// One for each instruction set that the library was built for; KALMARM_ENGINES names it.
extern "C" const kalmarm::Engines kalmarm_engines_native, kalmarm_engines_v2, kalmarm_engines_v3,
    kalmarm_engines_v4;
