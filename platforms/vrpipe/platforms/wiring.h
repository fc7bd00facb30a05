#pragma once

#include <string>

#include <vrpipe/platforms/gpu.h>

namespace vrpipe {

/// Items that the links of a GPC hold: at most, and between CROP and ZROP.
struct LinkDepths {
  unsigned most = 64;
  unsigned terminations = 16;
};

/// The pipeline of one GPC behind a front end of `draw` and `vpo`: adds its units and connects them as agx-orin does.
/// Building block for platforms of several GPCs.
void wire_gpc(Gpu& gpu, unsigned gpc, const LinkDepths& depths = {});

}  // namespace vrpipe
