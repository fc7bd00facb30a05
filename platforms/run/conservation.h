#pragma once

#include "elaboration/untimed_gpu.h"

#include <vrpipe/platforms/gpu.h>
#include <vrpipe/platforms/simulation.h>

namespace vrpipe {

// Of a run that has come to its end. They throw SimulationFault for what was lost, or came from nowhere.

/// Quads and fragments, from unit to unit.
void check_conservation(const Counts& counts);
/// Bytes: what units and memories have asked a memory for is what it delivered.
void check_conservation(const Gpu& gpu, const Netlist& netlist);
void check_conservation(const UntimedGpu& gpu, const Netlist& netlist);

}  // namespace vrpipe
