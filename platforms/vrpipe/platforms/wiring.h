#pragma once

#include <string>

#include <vrpipe/platforms/gpu.h>

namespace vrpipe {

/// The pipeline of one GPC behind a front end of `draw` and `vpo`: adds its units and connects them as agx-orin does.
/// Building block for platforms of several GPCs.
void wire_gpc(Gpu& gpu, unsigned gpc);

}  // namespace vrpipe
