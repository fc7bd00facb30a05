// The bound is one: no run with links takes fewer cycles, whatever the configuration.
#include <vrpipe/component/error.h>

#include "scenes.h"

namespace vrpipe {
namespace {

using namespace testing;

/// A parameter far from its default, or not so far.
rc::Gen<Setting> setting() {
  struct Choice {
    const char* unit;
    const char* parameter;
    std::vector<const char*> values;
  };
  static const std::vector<Choice> choices{{"draw", "warps_per_1024_cycles", {"1", "8", "1024"}},
                                           {"draw", "rectangle_warps_per_1024_cycles", {"1", "8", "1024"}},
                                           {"vpo", "triangles_per_cycle", {"1", "16"}},
                                           {"tgc", "entries_per_cycle", {"1", "8"}},
                                           {"raster", "setup_interval_cycles", {"0.25", "2.7", "7", "1000"}},
                                           {"raster", "bare_setup_interval_cycles", {"0.25", "7", "1000"}},
                                           {"raster", "rectangle_setup_interval_cycles", {"0.25", "7", "1000"}},
                                           {"raster", "screen_tile_interval_cycles", {"0.5", "6", "1000"}},
                                           {"raster", "coarse_tiles_per_cycle", {"1", "64"}},
                                           {"raster", "quads_per_cycle", {"1", "3"}},
                                           {"tc", "quads_per_cycle", {"1", "5"}},
                                           {"tc", "idle_timeout_cycles", {"0", "1", "20"}},
                                           {"tc", "flush_queue_bins", {"1", "64"}},
                                           {"prop", "quads_per_cycle", {"1", "5"}},
                                           {"prop", "color_bytes_per_cycle", {"16", "256"}},
                                           {"zrop", "quads_per_cycle", {"1", "5"}},
                                           {"zrop", "updates_per_cycle", {"1", "16"}},
                                           {"qru", "quads_per_cycle", {"1", "3"}},
                                           {"sm", "cores", {"1", "3"}},
                                           {"sm", "warps_per_core", {"1", "5"}},
                                           {"sm", "warps_to_one_core", {"1", "256"}},
                                           {"sm", "lanes_per_scheduler", {"1", "32"}},
                                           {"sm", "merge_instructions", {"1000"}},
                                           {"crop", "bytes_per_cycle", {"16", "256"}},
                                           {"crop", "input_quads", {"1", "9"}},
                                           {"crop", "mshrs", {"1", "5"}},
                                           {"crop", "cache_bytes", {"128", "1024"}},
                                           {"crop", "ways", {"1", "4"}},
                                           {"crop", "replacement", {"fifo", "random"}},
                                           {"crop", "hash_sets", {"on"}},
                                           {"crop", "sectors_per_cycle", {"1", "64"}},
                                           {"crop", "forwarding", {"off"}},
                                           {"crop", "previous_alpha_check", {"off"}},
                                           {"crop", "writes_unchanged", {"on"}},
                                           {"crop", "port_flits_per_cycle", {"1", "3"}},
                                           {"crop", "port_backlog_flits", {"1", "5000"}},
                                           {"crop", "gob_hazards", {"on"}},
                                           {"crop", "gob_lines", {"on"}},
                                           {"crop", "rgba32f_latency_cycles", {"12"}},
                                           {"raster", "half_tile_order", {"on"}},
                                           {"crop", "fetch_ahead_quads", {"1", "512"}},
                                           {"crop", "pairs_in_sector", {"on"}},
                                           {"crop", "rgba32f_column_cycles", {"1", "4"}},
                                           {"zrop", "half_block_cycles", {"0.3", "1"}},
                                           {"zrop", "block_cycles", {"1.4", "7"}},
                                           {"zrop", "fetch_ahead_lines", {"1", "256"}},
                                           {"zrop", "input_halves", {"1", "384"}},
                                           {"sm", "warp_launch_cycles", {"0.5", "2.5"}},
                                           {"sm", "visit_launch_cycles", {"4", "11.5"}},
                                           {"sm", "discard_launch_cycles", {"1.2"}},
                                           {"l2", "latency_cycles", {"1", "1000"}},
                                           {"l2", "near_latency_cycles", {"1", "300"}},
                                           {"l2", "color_latency_cycles", {"45"}},
                                           {"l2", "bytes_per_cycle", {"32"}},
                                           {"state", "termination_threshold", {"0.1", "1e-9"}}};
  return rc::gen::mapcat(rc::gen::elementOf(choices), [](const Choice& choice) {
    return rc::gen::map(rc::gen::elementOf(choice.values), [choice](const char* value) {
      return Setting{choice.unit, choice.parameter, value};
    });
  });
}

TEST(Bound, LetsQuadsShareTheLastCycleOfABlock) {
  // Splats that stencil kills, over each other, without lines that come back. Of a block's bins the first pays, the others come in what that
  // leaves.
  std::vector<Splat> splats;
  for (unsigned y = 0; y + 16 <= 256; y += 8) {
    for (unsigned x = 0; x + 16 <= 256; x += 8) {
      const auto left = static_cast<float>(x);
      const auto top = static_cast<float>(y);
      splats.push_back(flat_box(left, top, left + 16, top + 16, 0.5F));
    }
  }
  RunRequest r = request(variant_named("baseline"), ColorFormat::rgba8, Fidelity::bound);
  r.platform = &platform_named("gh100-gpc");
  r.settings = {{"tc", "bin_quads", "4"},
                {"zrop", "block_cycles", "1.9"},
                {"zrop", "input_halves", "0"},
                {"zrop", "fetch_ahead_lines", "0"}};
  Frame frame(256, 256);
  DrawState state = draw_state_of(r);
  state.stencil.test = true;
  state.stencil.front.compare = state.stencil.back.compare = Compare::none;
  frame.draw(geometry_of(256, 256, splats), state);
  const auto cycles = [&](Fidelity fidelity) {
    r.fidelity = fidelity;
    fresh_simulation();
    return *simulate(r, frame).cycles;
  };
  const Cycle bound = cycles(Fidelity::bound);
  for (const Fidelity fidelity : {Fidelity::cycle, Fidelity::lt}) {
    const Cycle timed = cycles(fidelity);
    EXPECT_LE(bound, timed) << name_of(fidelity);
    EXPECT_GE(bound, 0.9 * static_cast<double>(timed)) << name_of(fidelity);
  }
}

RC_GTEST_PROP(Bound, IsNeverAboveTheFidelitiesWithLinks, ()) {
  const Draw draw = *scene(60, 1.0F);
  RunRequest r = drawn_request(Fidelity::bound);
  r.platform = &platforms()[static_cast<std::size_t>(*whole(0, static_cast<int>(platforms().size())))];
  r.termination = *rc::gen::element(Termination::paper, Termination::strict);
  r.settings = *bins();
  r.settings.push_back({"prop", "order", *rc::gen::element("draw", "tile")});
  const auto far = *rc::gen::resize(4, rc::gen::container<std::vector<Setting>>(setting()));
  r.settings.insert(r.settings.end(), far.begin(), far.end());
  try {
    check_configuration(r);
  } catch (const UserError&) {
    RC_DISCARD("a cache that cannot be");
  }
  const Cycle bound = *run_trapped(r, draw).cycles;
  for (const Fidelity fidelity : {Fidelity::cycle, Fidelity::lt}) {
    r.fidelity = fidelity;
    const Cycle cycles = *run_trapped(r, draw).cycles;
    if (bound <= cycles) continue;
    std::string settings;
    for (const Setting& each : r.settings) settings += " " + each.unit + "." + each.parameter + "=" + each.value;
    RC_LOG() << r.platform->name << " " << r.variant.name << " " << name_of(r.format) << " "
             << (r.termination == Termination::paper ? "paper" : "strict") << settings << ": bound " << bound << ", "
             << name_of(fidelity) << " " << cycles;
    RC_FAIL("the bound is above");
  }
}

}  // namespace
}  // namespace vrpipe
