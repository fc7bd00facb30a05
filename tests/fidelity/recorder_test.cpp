// A recorder on a link of a platform, at each fidelity that has links.
#include <map>

#include <vrpipe/link.h>
#include <vrpipe/platforms/gpu.h>
#include <vrpipe/platforms/wiring.h>

#include "support/simulate.h"

namespace vrpipe {
namespace {

using namespace testing;

std::unique_ptr<LinkRecorder<QuadBeat>> bins;

/// agx-orin with a recorder between TC and PROP.
void wire_recorded(Gpu& gpu) {
  gpu.add_front_end("draw");
  gpu.add_front_end("vpo");
  for (const char* slot : {"tgc", "raster", "tc", "prop", "zrop", "qru", "sm", "crop"}) gpu.add(0, slot);
  gpu.connect("draw.out_vertices_0", "gpc0.sm.in_vertices");
  gpu.connect("gpc0.sm.out_vertices", "vpo.in_vertices_0");
  gpu.connect("vpo.out_primitives_0", "gpc0.tgc.in_primitives", 16);
  gpu.connect("gpc0.tgc.out_jobs", "gpc0.raster.in_jobs", 16);
  gpu.connect("gpc0.raster.out_quads", "gpc0.tc.in_quads", 8);
  gpu.connect("gpc0.prop.out_test", "gpc0.zrop.in_quads", 8);
  gpu.connect("gpc0.zrop.out_quads", "gpc0.prop.in_tested", 8);
  gpu.connect("gpc0.prop.out_survivors", "gpc0.qru.in_quads", 8);
  gpu.connect("gpc0.qru.out_warps", "gpc0.sm.in_warps", 8);
  gpu.connect("gpc0.sm.out_shaded", "gpc0.prop.in_shaded", 64);
  gpu.connect("gpc0.prop.out_release", "gpc0.sm.in_release", 8);
  gpu.connect("gpc0.prop.out_color", "gpc0.crop.in_color", 8);
  gpu.connect("gpc0.crop.out_terminations", "gpc0.zrop.in_terminations", 16);
  gpu.connect_to_l2("gpc0.crop");
  bins = std::make_unique<LinkRecorder<QuadBeat>>("bins", gpu.clock());
  connect_recorded(dynamic_cast<OutEnd<QuadBeat>&>(gpu.unit("gpc0.tc").out("out_bins")),
                   gpu.unit("gpc0.prop").in("in_bins"), *bins, 8);
}

TEST(Recorder, SeesTheSameItemsAtEveryFidelity) {
  Platform platform = platform_named("agx-orin");
  platform.name = "recorded";
  platform.wire = wire_recorded;
  const Draw draw = random_draw(150, 90, 300, 9);

  struct Seen {
    TileId tile;
    unsigned quads;
    bool last_of_bin;
    bool end_of_draw;
    bool operator==(const Seen& other) const {
      return tile == other.tile && quads == other.quads && last_of_bin == other.last_of_bin &&
             end_of_draw == other.end_of_draw;
    }
  };
  std::vector<Seen> reference;
  for (const Fidelity fidelity : {Fidelity::cycle, Fidelity::lt, Fidelity::at}) {
    RunRequest request = request_of("het+qm", fidelity, strictly);
    const RunResult plain = run(request, draw);
    request.platform = &platform;
    const RunResult recorded = run(request, draw);
    EXPECT_EQ(recorded.result_hash, plain.result_hash) << name_of(fidelity) << ": a recorder changes nothing";
    std::vector<Seen> seen;
    std::uint64_t quads = 0;
    Cycle last = 0;
    for (const auto& record : bins->records()) {
      seen.push_back({record.item.tile, record.item.count, record.item.last_of_bin, record.item.end_of_draw});
      quads += record.item.count;
      EXPECT_GE(record.cycle, last) << name_of(fidelity);
      EXPECT_LE(record.cycle, *recorded.cycles) << name_of(fidelity);
      last = record.cycle;
    }
    EXPECT_EQ(quads, recorded.counts.quads_rasterized) << name_of(fidelity);
    if (fidelity == Fidelity::cycle) reference = seen;
    EXPECT_TRUE(seen == reference) << name_of(fidelity);
    bins.reset();
  }
}

}  // namespace
}  // namespace vrpipe
