// Generated code as a rung of the ladder: an engine that answers by it, and asks the library's loops for all else.
//
//   acceleration       where margin > 0, with the estimated error; other states climb to the loops
//   inverse            where margin > 0; no error is told, as the loops tell none
//   diagonal           the same, of M^-1
//   solve              the same, of rows: one state is solved by factors that are kept
//   derivatives        the same, of rows, where all three matrices are wanted
//   inverse_dynamics   where no entry of q is beyond the angles that it reduces
//   mass               the same, of rows where the result is finite too
//
// of one state in double, and of rows in both precisions. One state of float is answered in double, as the loops do.
// A question with frames that are loaded has code of calls with loads, which leaves those without to the loops. Forces,
// contacts, gravity, joint noise and columns of a call are the loops', and a result that overlaps what is given.
//
// One state is the loops' too where code has more operations than most_operations_of_one_state (task.hpp).
//
// Whatever keeps code from being there, compiling it or its test against the loops, leaves the loops alone, and a note
// says in a line what it was. The loops alone are for mechanisms of slides, for accelerations at rest, which have shorter
// sweeps, and where the tolerance asks for refined answers.
#pragma once

#include <memory>

#include "algorithms/fast/engine/engine.hpp"
#include "kalmarm/kernels.hpp"

namespace kalmarm {

// loops: of the same robot and options. Adds to the notes, a line for every task: what was compiled, or why not.
template <class T>
std::unique_ptr<Engine<T>> with_generated_code(std::unique_ptr<Engine<T>> loops,
                                               const RobotModel& robot,
                                               const EngineOptions& options,
                                               const CodeOptions& code,
                                               std::vector<std::string>& notes);

}  // namespace kalmarm
