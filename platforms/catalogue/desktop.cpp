#include "catalogue/catalogue.h"

#include <vrpipe/platforms/wiring.h>

namespace vrpipe {

/// Four of the paper's GPCs at a desktop clock, with an ideal memory.
Platform desktop() {
  Platform platform;
  platform.name = "desktop";
  platform.description = "four GPCs of agx-orin at 1700 MHz; screen tiles alternate between them; an ideal L2";
  platform.gpcs = 4;
  platform.frequency_mhz = 1700;
  platform.wire = wire_pipeline;
  return platform;
}

}  // namespace vrpipe
