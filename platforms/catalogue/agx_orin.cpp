#include "catalogue/catalogue.h"

#include <vrpipe/platforms/wiring.h>

namespace vrpipe {

namespace {

Platform papers_gpu(const char* name, const char* description) {
  Platform platform;
  platform.name = name;
  platform.description = description;
  platform.gpcs = 1;
  platform.frequency_mhz = 612;
  return platform;
}

Platform with_dram(const char* name, const char* description, const char* dram) {
  Platform platform = papers_gpu(name, description);
  platform.wire = [dram](Netlist& netlist) {
    wire_pipeline(netlist);
    wire_dram(netlist, dram);
    connect_attribute_traffic(netlist);
    connect_depth_stencil_traffic(netlist);
  };
  return platform;
}

}  // namespace

/// The paper's simulated configuration (table "Simulation configuration"): one GPC of 16 SIMT cores at 612 MHz, a 4 MB
/// L2 and 16 channels of LPDDR3-1600, as published 32 bits wide. The units' defaults are that table's.
Platform agx_orin() {
  return with_dram("agx-orin",
                   "the paper's simulated GPU: 1 GPC, 16 cores, 612 MHz, 2 quads a cycle of RGBA16F, LPDDR3",
                   "lpddr3-1600");
}

/// The same pipeline where no memory holds it up: an L2 that holds everything, and z-cache and attributes that never miss.
Platform agx_orin_ideal_memory() {
  Platform platform =
      papers_gpu("agx-orin-ideal-memory", "agx-orin with an ideal L2, which holds everything, and no DRAM");
  platform.wire = wire_pipeline;
  return platform;
}

/// The memory of the GPU that the table is after.
Platform agx_orin_lpddr5() {
  return with_dram("agx-orin-lpddr5", "agx-orin with the Jetson AGX Orin's DRAM, LPDDR5-6400 at 204.8 GB/s",
                   "lpddr5-6400");
}

// The front end of the simulator that the paper changed: Emerald visits the raster tiles of a primitive's box, empty ones
// included, so many a cycle, and makes as many into quads; nothing of it goes by screen tiles.

/// With the rates that Emerald registers (gpu-sim.cc: graphics_coarse_tiles, graphics_fine_tiles).
Platform agx_orin_emerald_2() {
  Platform platform = agx_orin();
  platform.name = "agx-orin-emerald-2";
  platform.description = "agx-orin with Emerald's registered front end: 2 coarse and 2 fine raster tiles a cycle";
  platform.settings = {{"raster", "coarse_tiles_per_cycle", "2"},
                       {"raster", "fine_tiles_per_cycle", "2"},
                       {"raster", "screen_tile_interval_cycles", "0.001"}};
  return platform;
}

/// With those of its standalone example, which has the paper's raster and screen tiles, and that example's queues
/// (graphics_setup_q_len 100000, graphics_core_prim_pipe_warps 5000), as deep as they go here.
Platform agx_orin_emerald_1() {
  Platform platform = agx_orin();
  platform.name = "agx-orin-emerald-1";
  platform.description =
      "agx-orin with the front end of Emerald's example: 1 coarse and 1 fine raster tile a cycle, queues of thousands";
  platform.settings = {{"raster", "coarse_tiles_per_cycle", "1"},
                       {"raster", "fine_tiles_per_cycle", "1"},
                       {"raster", "screen_tile_interval_cycles", "0.001"},
                       {"link.tgc.jobs", "depth", "65536"},
                       {"sm", "vertex_warps", "1024"},
                       {"link.qru.warps", "depth", "5000"}};
  return platform;
}

}  // namespace vrpipe
