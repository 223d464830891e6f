// The table of an instruction set: what makes an engine of its kernels. Everything else that the
// kernels' files define is local to their instruction set.
#pragma once

#include "algorithms/fast/engine/engine.hpp"

namespace kalmarm {

// In double, each in a file of its own.
std::unique_ptr<Engine<double>> make_spatial_engine(const RobotModel& robot,
                                                    const EngineOptions& options);
std::unique_ptr<Engine<double>> make_translational_engine(const RobotModel& robot,
                                                          const EngineOptions& options);

struct Engines {
  std::unique_ptr<Engine<float>> (*make_float)(const RobotModel&, const EngineOptions&);
  std::unique_ptr<Engine<double>> (*make_double)(const RobotModel&, const EngineOptions&);
};

}  // namespace kalmarm

// One for each instruction set that the library was built for; KALMARM_ENGINES names it.
extern "C" const kalmarm::Engines kalmarm_engines_native, kalmarm_engines_v2, kalmarm_engines_v3,
    kalmarm_engines_v4;
