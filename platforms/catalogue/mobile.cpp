#include "catalogue/catalogue.h"

#include <vrpipe/platforms/wiring.h>

namespace vrpipe {

/// A phone-sized part after no product: a quarter of the cores and half the ROP width of agx-orin, smaller bins and
/// colour cache, a slower front end, a farther L2.
Platform mobile() {
  Platform platform;
  platform.name = "mobile";
  platform.description =
      "a phone-sized GPU: 1 GPC, 4 cores, 800 MHz, 1 quad a cycle of RGBA16F, small bins and cache, an ideal L2";
  platform.gpcs = 1;
  platform.frequency_mhz = 800;
  platform.settings = {
      {"draw", "warps_per_1024_cycles", "44"},
      {"raster", "fine_tiles_per_cycle", "1"},
      {"raster", "quads_per_cycle", "8"},
      {"tc", "bins", "16"},
      {"tc", "bin_quads", "64"},
      {"tc", "quads_per_cycle", "8"},
      {"prop", "quads_per_cycle", "8"},
      {"prop", "color_bytes_per_cycle", "32"},
      {"zrop", "quads_per_cycle", "8"},
      {"qru", "bin_quads", "64"},
      {"tgc", "bins", "64"},
      {"sm", "cores", "4"},
      {"crop", "bytes_per_cycle", "32"},
      {"crop", "cache_bytes", "8192"},
      {"l2", "latency_cycles", "200"},
      {"l2", "bytes_per_cycle", "64"},
  };
  platform.wire = wire_pipeline;
  return platform;
}

}  // namespace vrpipe
