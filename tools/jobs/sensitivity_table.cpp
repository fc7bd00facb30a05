#include "jobs/sensitivity_table.h"

#include <algorithm>
#include <cstddef>

#include <vrpipe/component/error.h>

namespace vrpipe::tools {
namespace {

std::vector<SensitivityParameter> headline() {
  const auto of = [](const char* name, std::size_t quick, std::vector<std::string> values) {
    return SensitivityParameter{name, Breadth::headline, std::move(values), quick};
  };
  return {
      of("raster.screen_tile_interval_cycles", 3,
         {"raster.screen_tile_interval_cycles=2", "raster.screen_tile_interval_cycles=3",
          "raster.screen_tile_interval_cycles=5", "raster.screen_tile_interval_cycles=1.5"}),
      of("raster.coarse_tiles_per_cycle", 0,
         {"raster.coarse_tiles_per_cycle=1", "raster.coarse_tiles_per_cycle=2", "raster.coarse_tiles_per_cycle=4"}),
      of("raster.fine_tiles_per_cycle", 1,
         {"raster.fine_tiles_per_cycle=1", "raster.fine_tiles_per_cycle=3", "raster.fine_tiles_per_cycle=4"}),
      of("link.qru.warps.depth", 0, {"link.qru.warps.depth=128", "link.qru.warps.depth=8192"}),
      of("memory", 0, {"platform=agx-orin-ideal-memory", "platform=agx-orin-lpddr5"}),
      of("tags that run ahead", 1, {"crop.fetch_ahead_quads=512,zrop.fetch_ahead_lines=256"}),
      of("tc.bins", 1, {"tc.bins=16", "tc.bins=64"}),
      of("state.termination_threshold", 1, {"state.termination_threshold=0.9999", "state.termination_threshold=0.98"}),
      of("qru.quads_per_cycle", 1, {"qru.quads_per_cycle=4", "qru.quads_per_cycle=3", "qru.quads_per_cycle=16"}),
      of("prop.quads_per_cycle", 1, {"prop.quads_per_cycle=4", "prop.quads_per_cycle=6", "prop.quads_per_cycle=8"}),
      of("raster.setup_interval_cycles", 0, {"raster.setup_interval_cycles=2", "raster.setup_interval_cycles=4"}),
      of("tgc.entries_per_cycle", 0, {"tgc.entries_per_cycle=1"}),
      of("tgc.bins", 0, {"tgc.bins=32", "tgc.bins=512"}),
      of("tgc.grid_tiles", 0, {"tgc.grid_tiles=2", "tgc.grid_tiles=8"}),
      of("sm.merge_instructions", 0, {"sm.merge_instructions=26"}),
  };
}

std::vector<SensitivityParameter> open() {
  std::vector<SensitivityParameter> all;
  const auto of = [&](const std::string& name, const std::vector<std::string>& values) {
    SensitivityParameter parameter{name, Breadth::open, {}, 0};
    for (const std::string& value : values) parameter.values.push_back(parameter.name + "=" + value);
    all.push_back(parameter);
  };
  of("tgc.latency_cycles", {"1", "40"});
  of("tc.quads_per_cycle", {"8"});
  of("tc.latency_cycles", {"1", "40"});
  of("tc.flush_queue_bins", {"1", "8"});
  of("prop.latency_cycles", {"1", "40"});
  of("zrop.latency_cycles", {"1", "80"});
  of("zrop.updates_per_cycle", {"4"});
  of("zrop.input_updates", {"8"});
  of("zrop.replacement", {"fifo"});
  of("zrop.hash_sets", {"on"});
  of("qru.latency_cycles", {"1", "40"});
  of("sm.vertex_warps", {"8", "128"});
  of("sm.vertex_instructions", {"10", "80"});
  of("sm.fragment_instructions", {"12", "48"});
  of("sm.merge_latency_cycles", {"0", "120"});
  of("sm.attribute_buffer_bytes", {"262144"});
  of("sm.attribute_writes", {"80"});
  of("crop.latency_cycles", {"1", "40"});
  of("crop.forwarding", {"off"});
  of("crop.replacement", {"fifo", "random", "tree-plru"});
  of("crop.hash_sets", {"on"});
  of("sm.l1_ways", {"4"});
  of("l2.bytes_per_cycle", {"64", "256"});
  of("l2.replacement", {"fifo"});
  of("l2.hash_sets", {"on"});
  of("l2.write_policy", {"write-through"});
  of("l2.write_allocate", {"byte-mask"});
  of("l2.write_backs", {"8"});
  of("l2.mshrs", {"16"});
  of("l2.arbitration", {"oldest"});
  of("dram.age_cap_cycles", {"128"});
  of("dram.port_requests", {"16"});
  of("state.exponential", {"exact", "fp16", "table256", "table16"});
  of("state.blend_rounding", {"rtz", "measured"});
  of("state.obb_padding", {"0", "4"});
  for (const char* link :
       {"draw.vertices", "sm.vertices", "vpo.primitives", "tgc.jobs", "raster.quads", "tc.bins", "prop.test",
        "zrop.quads", "prop.survivors", "sm.shaded", "prop.release", "prop.color", "crop.terminations"}) {
    of(std::string("link.") + link + ".depth", {"2", "128"});
  }
  return all;
}

/// "UNIT.PARAMETER=VALUE"; a unit may have dots.
Setting setting_of(const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::size_t dot = text.rfind('.', equals);
  return {text.substr(0, dot), text.substr(dot + 1, equals - dot - 1), text.substr(equals + 1)};
}

}  // namespace

const std::vector<SensitivityParameter>& sensitivity_parameters() {
  static const std::vector<SensitivityParameter> all = [] {
    std::vector<SensitivityParameter> parameters = headline();
    const std::vector<SensitivityParameter> more = open();
    parameters.insert(parameters.end(), more.begin(), more.end());
    return parameters;
  }();
  return all;
}

const std::vector<NotVaried>& parameters_not_varied() {
  static const std::vector<NotVaried> all{
      {"*.random_seed", "tells only with random replacement, which is tried"},
      {"sm.mesh_instructions", "there are no meshes"},
      {"sm.alpha_threshold_instructions", "of software termination alone"},
      {"state.merging", "takes no time of its own; `vrpipe accuracy` tries it"},
      {"state.export_format", "takes no time of its own; `vrpipe accuracy` tries it"},
      {"wdx.*", "these platforms have one GPC, and no crossbar"},
      {"l1.*", "the slot is empty on these platforms; --unit l1=NAME puts a cache there"},
      {"link.prop.late.depth", "of tests after shading, which these frames do not have"},
      {"link.zrop.late.depth", "of tests after shading, which these frames do not have"},
      {"link.zrop.hi_z.depth", "of Hi-Z, which frames without depth do not have"},
      {"link.crop.done.depth", "of barriers between draws, which these frames do not have"},
  };
  return all;
}

RunRequest with_settings(RunRequest request, const std::string& settings) {
  for (std::size_t start = 0; start < settings.size();) {
    const std::size_t end = std::min(settings.find(',', start), settings.size());
    const std::string text = settings.substr(start, end - start);
    start = end + 1;
    if (text.rfind("platform=", 0) == 0) {
      request.platform = &platform_named(text.substr(text.find('=') + 1));
    } else if (text.rfind("termination=", 0) == 0) {
      request.termination = termination_named(text.substr(text.find('=') + 1));
    } else {
      request.settings.push_back(setting_of(text));
    }
  }
  check_configuration(request);
  return request;
}

}  // namespace vrpipe::tools
