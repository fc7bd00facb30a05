// A platform of one's own: two GPCs with a deeper queue in front of the colour ROPs, drawn in every variant.
#include <cstdio>
#include <string>

#include <vrpipe/error.h>
#include <vrpipe/platforms/netlist.h>
#include <vrpipe/platforms/simulation.h>
#include <vrpipe/workloads/scene.h>

namespace {

void wire_twin(vrpipe::Netlist& gpu) {
  gpu.add("draw");
  gpu.add("vpo");
  gpu.add_memory("l2");
  for (unsigned gpc = 0; gpc < gpu.gpcs(); ++gpc) {
    const std::string index = std::to_string(gpc);
    const std::string self = "gpc" + index + ".";
    for (const char* slot : {"tgc", "raster", "tc", "prop", "zrop", "qru", "sm", "crop"}) gpu.add(self + slot);
    gpu.connect("draw.out_vertices_" + index, self + "sm.in_vertices");
    gpu.connect(self + "sm.out_vertices", "vpo.in_vertices_" + index);
    gpu.connect("vpo.out_primitives_" + index, self + "tgc.in_primitives", 16);
    gpu.connect(self + "tgc.out_jobs", self + "raster.in_jobs", 16);
    gpu.connect(self + "raster.out_quads", self + "tc.in_quads", 8);
    gpu.connect(self + "tc.out_bins", self + "prop.in_bins", 8);
    gpu.connect(self + "prop.out_test", self + "zrop.in_quads", 8);
    gpu.connect(self + "zrop.out_quads", self + "prop.in_tested", 8);
    gpu.connect(self + "prop.out_survivors", self + "qru.in_quads", 8);
    gpu.connect(self + "qru.out_warps", self + "sm.in_warps", 8);
    gpu.connect(self + "sm.out_shaded", self + "prop.in_shaded", 64);
    gpu.connect(self + "prop.out_release", self + "sm.in_release", 8);
    gpu.connect(self + "prop.out_color", self + "crop.in_color", 256);
    gpu.connect(self + "crop.out_terminations", self + "zrop.in_terminations", 16);
    gpu.connect_memory(self + "crop", "l2");
  }
}

vrpipe::Platform twin() {
  vrpipe::Platform platform;
  platform.name = "twin";
  platform.description = "two GPCs of agx-orin, 256 beats in front of each CROP";
  platform.gpcs = 2;
  platform.frequency_mhz = 612;
  platform.settings = {{"draw", "warps_per_1024_cycles", "176"}, {"vpo", "triangles_per_cycle", "4"}};
  platform.wire = wire_twin;
  return platform;
}

}  // namespace

int main() try {
  vrpipe::add_platform(twin());

  vrpipe::SceneRequest scene;
  scene.scene = "builtin:object";
  scene.size = vrpipe::ImageSize{160, 120};
  const vrpipe::Draw draw = vrpipe::load_scene(scene).draw;

  for (const char* platform : {"agx-orin", "twin"}) {
    for (const vrpipe::Variant& variant : vrpipe::variants()) {
      vrpipe::RunRequest request;
      request.platform = &vrpipe::platform_named(platform);
      request.variant = variant;
      vrpipe::fresh_simulation();
      const vrpipe::RunResult result = vrpipe::simulate(request, draw);
      std::printf("%s %s %llu cycles\n", platform, variant.name.c_str(),
                  static_cast<unsigned long long>(result.cycles.value()));
    }
  }
  return 0;
} catch (const vrpipe::UserError& error) {
  std::fprintf(stderr, "twin_gpu: error: %s\n", error.what());
  return 2;
}
