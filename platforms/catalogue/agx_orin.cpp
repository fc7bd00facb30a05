#include "catalogue/catalogue.h"

#include <vrpipe/platforms/wiring.h>

namespace vrpipe {

/// The paper's simulated configuration (table "Simulation configuration"): one GPC of 16 SIMT cores at 612 MHz. The
/// units' defaults are that table's.
Platform agx_orin() {
  Platform platform;
  platform.name = "agx-orin";
  platform.description = "the paper's simulated GPU: 1 GPC, 16 cores, 612 MHz, 2 quads a cycle of RGBA16F";
  platform.gpcs = 1;
  platform.frequency_mhz = 612;
  platform.wire = wire_pipeline;
  return platform;
}

/// The table's memory: 16 channels of LPDDR3-1600, as published 32 bits wide.
Platform agx_orin_lpddr3() {
  Platform platform = agx_orin();
  platform.name = "agx-orin-lpddr3";
  platform.description = "agx-orin with a 4 MB L2 that misses and the paper's DRAM, LPDDR3-1600 at 102.4 GB/s";
  platform.wire = [](Netlist& netlist) {
    wire_pipeline(netlist);
    wire_dram(netlist, "lpddr3-1600");
    connect_attribute_traffic(netlist);
    connect_depth_stencil_traffic(netlist);
  };
  return platform;
}

/// The memory of the GPU that the table is after.
Platform agx_orin_lpddr5() {
  Platform platform = agx_orin();
  platform.name = "agx-orin-lpddr5";
  platform.description =
      "agx-orin with a 4 MB L2 that misses and the Jetson AGX Orin's DRAM, LPDDR5-6400 at 204.8 GB/s";
  platform.wire = [](Netlist& netlist) {
    wire_pipeline(netlist);
    wire_dram(netlist, "lpddr5-6400");
    connect_attribute_traffic(netlist);
    connect_depth_stencil_traffic(netlist);
  };
  return platform;
}

}  // namespace vrpipe
