#include "catalogue/catalogue.h"

#include <vrpipe/platforms/wiring.h>

namespace vrpipe {

/// The one graphics GPC of an NVIDIA H200 (Hopper GH100), as measured through OpenGL: 4 SMs in 2 TPCs and one ROP
/// partition at 1980 MHz. Every setting is from a microbenchmark of that GPU, none from a scene of splats; where none was
/// measured it is the unit's default. docs/silicon.md says which, and what it predicts.
Platform gh100_gpc() {
  Platform platform;
  platform.name = "gh100-gpc";
  platform.description = "a graphics GPC measured on silicon: NVIDIA H200, 4 SMs, 1 quad a cycle of RGBA16F, 1980 MHz";
  platform.gpcs = 1;
  platform.frequency_mhz = 1980;
  platform.settings = {
      // Vertices: 5.86 cycles a splat of two triangles, 3.88 a filled rectangle.
      {"draw", "warps_per_1024_cycles", "22"},
      {"draw", "rectangle_warps_per_1024_cycles", "25"},
      // 64 pixels a cycle, 256 of what Hi-Z kills; small splats of two triangles every 9.11 cycles, with attributes.
      {"raster", "fine_tiles_per_cycle", "1"},
      {"raster", "coarse_tiles_per_cycle", "4"},
      {"raster", "setup_interval_cycles", "4.55"},
      {"raster", "bare_setup_interval_cycles", "2.9"},
      {"raster", "rectangle_setup_interval_cycles", "4.17"},
      {"raster", "half_tile_order", "on"},
      // 32 bins of 16x16 pixels, first in, first out: the defaults. Two quads part from a gap of 151 cycles on, of which nine
      // are the second's way.
      {"tc", "idle_timeout_cycles", "160"},
      // 8 quads a cycle of full blocks, each touched half of one a cycle, a block at least 1.5; a line is two blocks of stencil.
      {"zrop", "quads_per_cycle", "8"},
      {"zrop", "half_block_cycles", "1"},
      {"zrop", "block_cycles", "1.5"},
      {"zrop", "cache_bytes", "16384"},
      {"zrop", "line_bytes", "512"},
      {"zrop", "fetch_ahead_lines", "256"},
      {"zrop", "input_halves", "384"},
      {"zrop", "fast_clear", "off"},
      {"zrop", "mshrs", "2048"},
      // 64 quads to an SM, SMs in turn; 3.2 quads a cycle, 4 to 5.2 cycles a primitive and screen tile.
      {"sm", "cores", "4"},
      {"sm", "lanes_per_scheduler", "32"},
      {"sm", "warp_launch_cycles", "2.5"},
      {"sm", "visit_launch_cycles", "4"},
      {"sm", "discard_launch_cycles", "1.7"},
      {"sm", "discard_warp_cycles", "1.03"},
      // 4 pixels a cycle of RGBA16F, 8 of RGBA8 in pairs, 0.5 of RGBA32F; lines of 256 bytes at a cycle each; the same
      // quad again after 9 cycles.
      {"prop", "color_bytes_per_cycle", "32"},
      {"crop", "bytes_per_cycle", "32"},
      {"crop", "pairs_in_sector", "on"},
      {"crop", "rgba32f_column_cycles", "4"},
      {"crop", "forwarding", "off"},
      {"crop", "latency_cycles", "9"},
      {"crop", "cache_bytes", "8192"},
      {"crop", "line_bytes", "256"},
      {"crop", "port_flits_per_cycle", "1"},
      {"crop", "port_backlog_flits", "512"},
      {"crop", "gob_lines", "on"},
      {"crop", "gob_hazards", "on"},
      {"crop", "rgba32f_latency_cycles", "12"},
      {"crop", "fetch_ahead_quads", "512"},
      {"crop", "mshrs", "2048"},
      {"l2", "latency_cycles", "433"},
      {"l2", "near_latency_cycles", "242"},
      {"l2", "color_latency_cycles", "43"},
      {"l2", "slice_spread_cycles", "17"},
  };
  platform.wire = [](Netlist& netlist) {
    wire_pipeline(netlist);
    connect_depth_stencil_traffic(netlist);
    netlist.connect("gpc0.zrop.out_reads", "gpc0.crop.in_reads", 8);
  };
  return platform;
}

}  // namespace vrpipe
