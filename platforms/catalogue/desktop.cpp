#include "catalogue/catalogue.h"

#include <vrpipe/platforms/wiring.h>

namespace vrpipe {

/// Four of the paper's GPCs at a desktop clock. Screen tiles alternate between GPCs; a primitive goes to every GPC that
/// owns a tile of its bounding box.
Platform desktop() {
  Platform platform;
  platform.name = "desktop";
  platform.description = "four GPCs of agx-orin at 1700 MHz; screen tiles alternate between them";
  platform.gpcs = 4;
  platform.frequency_mhz = 1700;
  platform.settings = {
      {"draw", "warps_per_1024_cycles", "352"},
      {"vpo", "triangles_per_cycle", "4"},
  };
  platform.wire = wire_pipeline;
  return platform;
}

}  // namespace vrpipe
