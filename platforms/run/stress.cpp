#include <vrpipe/platforms/stress.h>

#include <algorithm>

#include <vrpipe/platforms/configuration.h>

namespace vrpipe {

namespace {

StressConfiguration with_links_of_depth(std::uint32_t depth, bool quick = false) {
  return {"links of depth " + std::to_string(depth), {}, depth, quick};
}

StressConfiguration with_terminations_of_depth(unsigned depth, bool quick = false) {
  return {"termination queue of depth " + std::to_string(depth),
          {{"link.crop.terminations", "depth", std::to_string(depth)}},
          {},
          quick};
}

/// `UNIT.PARAMETER=VALUE`, also of links, several with blanks between.
StressConfiguration with(const std::string& settings, bool quick = false) {
  StressConfiguration configuration{settings, {}, {}, quick};
  for (std::size_t begin = 0; begin < settings.size();) {
    const std::size_t end = std::min(settings.find(' ', begin), settings.size());
    const std::size_t equals = settings.find('=', begin);
    const std::size_t dot = settings.rfind('.', equals);
    configuration.settings.push_back({settings.substr(begin, dot - begin), settings.substr(dot + 1, equals - dot - 1),
                                      settings.substr(equals + 1, end - equals - 1)});
    begin = end + 1;
  }
  return configuration;
}

std::vector<StressConfiguration> make() {
  return {
      {"no change", {}, {}},
      // Short queues.
      with_links_of_depth(1, true),
      with_links_of_depth(2),
      with_terminations_of_depth(1, true),
      with_terminations_of_depth(4),
      with("crop.input_quads=1"),
      with("crop.input_quads=8", true),
      with("crop.input_quads=16"),
      with("crop.input_quads=64"),
      with("crop.input_quads=128"),
      with("crop.input_quads=256"),
      with("tc.flush_queue_bins=1"),
      with("crop.fetch_ahead_quads=1"),
      // Links of which an item takes many cycles, or that have places for few of what is under way.
      with("link.raster.quads.latency_cycles=30"),
      with("link.prop.survivors.latency_cycles=80"),
      with("link.prop.color.latency_cycles=80"),
      with("link.crop.terminations.latency_cycles=500"),
      // Each unit the bottleneck.
      with("draw.warps_per_1024_cycles=8"),
      with("vpo.triangles_per_cycle=1 draw.warps_per_1024_cycles=1024"),
      with("tgc.entries_per_cycle=1 tgc.bins=4 tgc.bin_primitives=2"),
      with("raster.setup_interval_cycles=20"),
      with("raster.screen_tile_interval_cycles=6"),
      with("raster.coarse_tiles_per_cycle=1"),
      with("raster.fine_tiles_per_cycle=1"),
      with("raster.quads_per_cycle=2"),
      with("tc.quads_per_cycle=2"),
      with("tc.bins=2"),
      with("tc.bin_quads=8"),
      with("prop.quads_per_cycle=2"),
      with("prop.color_bytes_per_cycle=32"),
      with("prop.order=draw"),
      with("zrop.quads_per_cycle=2"),
      with("zrop.updates_per_cycle=4"),
      with("qru.quads_per_cycle=1"),
      with("sm.cores=4"),
      with("sm.cores=1"),
      with("crop.bytes_per_cycle=32"),
      with("crop.sectors_per_cycle=1"),
      with("l2.bytes_per_cycle=32 crop.cache_bytes=4096"),
      with("l2.frequency_mhz=401"),
      with("l2.frequency_mhz=150 crop.cache_bytes=4096"),
      // Few places, and long waits for them.
      with("sm.warps_per_core=8", true),
      with("sm.warps_per_core=2"),
      with("sm.warps_to_one_core=256"),
      with("sm.warps_to_one_core=256 sm.warps_per_core=8"),
      with("sm.warps_to_one_core=1"),
      with("sm.vertex_warps=1"),
      with("sm.fragment_latency_cycles=1000"),
      with("crop.mshrs=1"),
      with("crop.mshrs=4", true),
      with("crop.mshrs=16"),
      with("crop.mshrs=64"),
      with("crop.cache_bytes=1024"),
      with("crop.cache_bytes=4096"),
      with("crop.cache_bytes=262144"),
      with("l2.latency_cycles=1000", true),
      with("l2.latency_cycles=1000 crop.cache_bytes=4096"),
      with("crop.cache_bytes=4096 crop.replacement=random"),
      with("crop.cache_bytes=4096 crop.replacement=fifo"),
      with("crop.latency_cycles=200"),
      with("zrop.latency_cycles=200"),
      with("crop.forwarding=off", true),
      with("crop.forwarding=off crop.latency_cycles=30"),
  };
}

}  // namespace

const std::vector<StressConfiguration>& stress_configurations() {
  static const std::vector<StressConfiguration> all = make();
  return all;
}

RunRequest stressed(RunRequest request, const StressConfiguration& configuration) {
  RunRequest whole = request;
  whole.effects = EffectChoice::parse("all");
  std::vector<Setting> changes = configuration.settings;
  if (configuration.link_depth) {
    const Configuration unchanged(whole, Frame(1, 1));
    for (const Link& link : unchanged.netlist().links()) {
      if (link.parameters->depth > *configuration.link_depth)
        changes.push_back({"link." + link.name(), "depth", std::to_string(*configuration.link_depth)});
    }
  }
  for (RunRequest* const each : {&whole, &request})
    each->settings.insert(each->settings.end(), changes.begin(), changes.end());
  const Configuration changed(whole, Frame(1, 1));
  for (const Instance& instance : changed.netlist().instances()) changed.make(instance);
  return request;
}

}  // namespace vrpipe
