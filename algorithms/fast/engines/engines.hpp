// The table of an instruction set: what makes an engine of its kernels. Everything else that the
// kernels' files define is local to their instruction set.
#pragma once

#include "algorithms/fast/engine/engine.hpp"

namespace kalmarm {

template <class T>
std::unique_ptr<Engine<T>> make_planar_engine(const RobotModel& robot,
                                              const EngineOptions& options);
template <class T>
std::unique_ptr<Engine<T>> make_translational_engine(const RobotModel& robot,
                                                     const EngineOptions& options);

#define KALMARM_PLANAR_INSTANCES(KIND, T)                                               \
  KIND template std::unique_ptr<Engine<T>> make_planar_engine(const RobotModel&,        \
                                                              const EngineOptions&);    \
  KIND template std::unique_ptr<Engine<T>> make_translational_engine(const RobotModel&, \
                                                                     const EngineOptions&);

template <class T>
std::unique_ptr<Engine<T>> make_certified_engine(const RobotModel& robot,
                                                 const EngineOptions& options);

#define KALMARM_CERTIFIED_INSTANCES(KIND, T)                                        \
  KIND template std::unique_ptr<Engine<T>> make_certified_engine(const RobotModel&, \
                                                                 const EngineOptions&);

struct Engines {
  std::unique_ptr<Engine<float>> (*make_float)(const RobotModel&, const EngineOptions&);
  std::unique_ptr<Engine<double>> (*make_double)(const RobotModel&, const EngineOptions&);
};

}  // namespace kalmarm

// One for each instruction set that the library was built for; KALMARM_ENGINES names it.
extern "C" const kalmarm::Engines kalmarm_engines_native, kalmarm_engines_v2, kalmarm_engines_v3,
    kalmarm_engines_v4;
