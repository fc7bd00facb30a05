#pragma once

#include <vrpipe/platforms/netlist.h>
#include <vrpipe/platforms/simulation.h>

namespace vrpipe {

/// Adds the pipeline of one GPC behind `draw`, and connects it as in agx-orin; of several GPCs, primitives go through a
/// crossbar, `wdx`. They are there already, as is CROP's memory, `memory`. Building block for platforms of several GPCs.
void wire_gpc(Netlist& netlist, unsigned gpc, const std::string& memory = "l2");

/// The same for all GPCs, with what they share: `draw`, `wdx` if they are several, and an L2 that holds everything.
void wire_pipeline(Netlist& netlist);

/// Behind such a pipeline, makes the L2 a cache and puts a DRAM below it, of an implementation of slot `dram`.
void wire_dram(Netlist& netlist, const std::string& dram);

/// Binds the memory port of every SM array, so that vertices and attributes are fetched from a memory instead of by a fixed
/// latency.
void connect_attribute_traffic(Netlist& netlist, const std::string& memory = "l2");

/// Puts an L1, of an implementation of slot `l1`, between the memory port of every SM array and what that is bound to:
/// gpcN.l1, which the array's cores share. The arrays want `sm.l1_bytes=0`; if not, theirs are above it. Throws UserError
/// where an array's port is bound to nothing.
void insert_l1(Netlist& netlist, const std::string& implementation = "");

/// Binds the memory port of every ZROP, so that its z-cache is one that misses.
void connect_depth_stencil_traffic(Netlist& netlist, const std::string& memory = "l2");

}  // namespace vrpipe
