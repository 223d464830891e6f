// What bench_constrained asks of another library: a robot whose loops are closed by points that coincide, exactly.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "algorithms/spatial/spatial.hpp"
#include "benchmarks/peers/peer.hpp"
#include "kalmarm/constraint.hpp"
#include "robots/scene/scene.hpp"

namespace kalmarm {

class LoopPeer {
 public:
  virtual ~LoopPeer() = default;

  virtual std::string name() const = 0;
  // With which rows are added to inertias [kg], where they are.
  virtual double stiffness() const { return 0; }

  // The timed call, of state i, in the library's own conventions.
  virtual void run(int i) = 0;
  // Of the last call, in Kalmarm's: accelerations (nv), or A = J M^-1 J' (m x m) by rows.
  virtual VectorX<double> result(int i) const = 0;
};

using LoopPeers = std::vector<std::unique_ptr<LoopPeer>>;

struct PeersOfLoops {
  LoopPeers accelerations, delassus;
};

// points: constraints of kind point.
PeersOfLoops pinocchio_loops(const Mechanism& mechanism, const std::vector<Constraint>& points,
                             const std::vector<State>& states);

}  // namespace kalmarm
