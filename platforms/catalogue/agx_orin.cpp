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

}  // namespace vrpipe
