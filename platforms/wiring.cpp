#include <algorithm>

#include <vrpipe/platforms/wiring.h>

namespace vrpipe {

void wire_gpc(Gpu& gpu, unsigned gpc, const LinkDepths& depths) {
  const std::string index = std::to_string(gpc);
  const std::string self = "gpc" + index + ".";
  for (const char* slot : {"tgc", "raster", "tc", "prop", "zrop", "qru", "sm", "crop"}) gpu.add(gpc, slot);
  const auto connect = [&](const std::string& out, const std::string& in, unsigned depth = 4) {
    gpu.connect(out, in, std::min(depth, depths.most));
  };

  // Vertices: issued, shaded on the SM array, assembled.
  connect("draw.out_vertices_" + index, self + "sm.in_vertices");
  connect(self + "sm.out_vertices", "vpo.in_vertices_" + index);

  // Primitives to quads, quads to bins.
  connect("vpo.out_primitives_" + index, self + "tgc.in_primitives", 16);
  connect(self + "tgc.out_jobs", self + "raster.in_jobs", 16);
  connect(self + "raster.out_quads", self + "tc.in_quads", 8);
  connect(self + "tc.out_bins", self + "prop.in_bins", 8);

  // The early tests, and back.
  connect(self + "prop.out_test", self + "zrop.in_quads", 8);
  connect(self + "zrop.out_quads", self + "prop.in_tested", 8);

  // Warps to the SMs, shaded quads in order to CROP.
  connect(self + "prop.out_survivors", self + "qru.in_quads", 8);
  connect(self + "qru.out_warps", self + "sm.in_warps", 8);
  connect(self + "sm.out_shaded", self + "prop.in_shaded", 64);
  connect(self + "prop.out_release", self + "sm.in_release", 8);
  connect(self + "prop.out_color", self + "crop.in_color", 8);

  // Early termination: from the alpha test back to the stencil.
  connect(self + "crop.out_terminations", self + "zrop.in_terminations", depths.terminations);

  gpu.connect_to_l2(self + "crop");
}

}  // namespace vrpipe
