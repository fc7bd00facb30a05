#pragma once

#include <vrpipe/platforms/simulation.h>

namespace vrpipe {

// The shipped platforms, a source each.
Platform agx_orin();
Platform agx_orin_ideal_memory();
Platform agx_orin_lpddr5();
Platform agx_orin_emerald_2();
Platform agx_orin_emerald_1();
Platform gh100_gpc();
Platform mobile();
Platform desktop();

}  // namespace vrpipe
