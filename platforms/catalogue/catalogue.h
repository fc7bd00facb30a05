#pragma once

#include <vrpipe/platforms/simulation.h>

namespace vrpipe {

// The shipped platforms, a source each.
Platform agx_orin();
Platform agx_orin_lpddr3();
Platform agx_orin_lpddr5();
Platform gh100_gpc();
Platform mobile();
Platform desktop();

}  // namespace vrpipe
