// A recorder on a link of a platform, at each fidelity that has links.
#include <functional>
#include <memory>
#include <vector>

#include <vrpipe/batch.h>
#include <vrpipe/link.h>
#include <vrpipe/platforms/gpu.h>
#include <vrpipe/platforms/wiring.h>

#include "support/simulate.h"

namespace vrpipe {
namespace {

using namespace testing;

// A flushed bin goes in beats at cycle, in one piece at lt and at.
std::unique_ptr<LinkRecorder<QuadBeat>> beats;
std::unique_ptr<LinkRecorder<BinItem>> bins;

/// Puts a recorder between TC and PROP if they exchange such items.
template <class Item>
void record(Gpu& gpu, std::unique_ptr<LinkRecorder<Item>>& recorder) {
  auto* const out = dynamic_cast<OutEnd<Item>*>(&gpu.unit("gpc0.tc").out("out_bins"));
  if (out == nullptr) return;
  recorder = std::make_unique<LinkRecorder<Item>>("bins", gpu.clock());
  connect_recorded(*out, gpu.unit("gpc0.prop").in("in_bins"), *recorder, 8);
}

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
  record(gpu, beats);
  record(gpu, bins);
}

struct Seen {
  TileId tile;
  unsigned quads;
  bool end_of_draw;
  bool operator==(const Seen& other) const {
    return tile == other.tile && quads == other.quads && end_of_draw == other.end_of_draw;
  }
};

/// The bins of a recording; checks that the records are in the order of time and within the run.
template <class Record>
std::vector<Seen> seen_in(const std::vector<Record>& records, Cycle end, const std::function<Seen(const Record&)>& what,
                          const std::function<bool(const Record&)>& closes) {
  std::vector<Seen> all;
  Cycle last = 0;
  bool open = false;
  for (const Record& record : records) {
    EXPECT_GE(record.cycle, last);
    EXPECT_LE(record.cycle, end);
    last = record.cycle;
    const Seen seen = what(record);
    if (open) {
      EXPECT_EQ(seen.tile, all.back().tile);
      all.back().quads += seen.quads;
    } else {
      all.push_back(seen);
    }
    open = !closes(record);
  }
  return all;
}

TEST(Recorder, SeesTheSameBinsAtEveryFidelityAndChangesNothing) {
  Platform platform = platform_named("agx-orin");
  platform.name = "recorded";
  platform.wire = wire_recorded;
  const Draw draw = random_draw(150, 90, 300, 9);
  using Beat = LinkRecorder<QuadBeat>::Record;
  using Bin = LinkRecorder<BinItem>::Record;

  std::vector<Seen> reference;
  for (const Fidelity fidelity : {Fidelity::cycle, Fidelity::lt, Fidelity::at}) {
    SCOPED_TRACE(name_of(fidelity));
    RunRequest request = request_of("het+qm", fidelity, strictly);
    const RunResult plain = run(request, draw);
    request.platform = &platform;
    const RunResult recorded = run(request, draw);
    EXPECT_EQ(recorded.result_hash, plain.result_hash);
    std::vector<Seen> seen;
    if (fidelity == Fidelity::cycle) {
      seen = seen_in<Beat>(
          beats->records(), *recorded.cycles,
          [](const Beat& beat) {
            return Seen{beat.item.tile, beat.item.count, beat.item.end_of_draw};
          },
          [](const Beat& beat) { return beat.item.last_of_bin || beat.item.end_of_draw; });
      reference = seen;
    } else {
      seen = seen_in<Bin>(
          bins->records(), *recorded.cycles,
          [](const Bin& bin) {
            return Seen{bin.item.tile, bin.item.quads, bin.item.end_of_draw};
          },
          [](const Bin&) { return true; });
    }
    std::uint64_t quads = 0;
    for (const Seen& bin : seen) quads += bin.quads;
    EXPECT_EQ(quads, recorded.counts.quads_rasterized);
    EXPECT_TRUE(seen == reference);
    beats.reset();
    bins.reset();
  }
}

}  // namespace
}  // namespace vrpipe
