#pragma once

#include <vrpipe/component/parameter.h>
#include <vrpipe/memory/cache_organization.h>

namespace vrpipe {

/// Of a CROP: one of your own derives its parameters from these.
struct CropParameters : ParameterSet {
  Integer bytes_per_cycle{
      *this,
      "bytes_per_cycle",
      64,
      16,
      256,
      "bytes",
      source::paper_text,
      "of target format blended in a cycle: 4 quads of RGBA8, 2 of RGBA16F, 1 of RGBA32F (assumed); what is no whole "
      "number of quads is a fraction of one"};
  Integer input_quads{*this,
                      "input_quads",
                      512,
                      1,
                      65536,
                      "quads",
                      "ATTILA: fetch queue of 256 stamps for each ROP of 1 stamp a cycle",
                      "between cache look-up and blending; hides the latency of fills"};
  Integer latency_cycles{*this,
                         "latency_cycles",
                         8,
                         1,
                         1000,
                         "cycles",
                         source::open,
                         "of a blend; its termination signal leaves after that"};
  Switch forwarding{*this, "forwarding", true, source::open,
                    "an overlapping quad takes the value in the pipeline; without, it waits for the latency, which "
                    "flatters QM"};
  Switch previous_alpha_check{*this, "previous_alpha_check", true, source::paper_text,
                              "signal only pixels that newly pass the threshold (paper 5.2)"};
  CacheParameters cache{*this, {"cache_bytes", 16384, 1 << 24, "CROP cache", 0, source::measured}};
  RopMshrs mshrs{*this};
  RopSectorsPerCycle sectors_per_cycle{*this, "filled or written back in a cycle in which nothing is blended"};
  Switch writes_unchanged{*this, "writes_unchanged", false, source::measured,
                          "write sectors back in which no value changed"};
  Integer port_flits_per_cycle{
      *this,
      "port_flits_per_cycle",
      0,
      0,
      16,
      "flits",
      "left open by the paper; measured on a GH100 graphics GPC: 1",
      "of a sector each, to L2, beside the blender: one for a line of which a triangle reads, one for a line written "
      "back "
      "and one for each sector of it; 0: sectors_per_cycle says what moving takes, of the blender"};
  Integer port_backlog_flits{*this,
                             "port_backlog_flits",
                             64,
                             1,
                             65536,
                             "flits",
                             "assumed; on a GH100 graphics GPC 16 to 2000 make 2 % of a small scene",
                             "that wait for the port; of more, nothing is looked up or blended"};
  Integer fetch_ahead_quads{*this,
                            "fetch_ahead_quads",
                            0,
                            0,
                            65536,
                            "quads",
                            "left open by the paper; measured on a GH100 graphics GPC: 512 to 1024",
                            "if any, tags run ahead of data: a look at them asks for sectors, and a second one, at "
                            "most so many quads later, stops "
                            "for lines that come back; a line may go while quads wait to be blended into it"};
  Switch gob_lines{*this, "gob_lines", false, "left open by the paper; measured on a GH100 graphics GPC: on",
                   "a tile's colours are in memory in blocks of 32 bytes by 8 rows, not in Morton order"};
  Switch gob_hazards{*this, "gob_hazards", false, "left open by the paper; measured on a GH100 graphics GPC: on",
                     "without forwarding, pixels in a row of a screen tile wait for one another that have the same "
                     "place in 64 bytes (the width of a GOB), not only the same pixels"};
  Integer rgba32f_latency_cycles{*this,
                                 "rgba32f_latency_cycles",
                                 0,
                                 0,
                                 1000,
                                 "cycles",
                                 "left open by the paper; measured on a GH100 graphics GPC: 12",
                                 "of a blend of RGBA32F; 0: latency_cycles"};
  Integer rgba32f_column_cycles{
      *this,
      "rgba32f_column_cycles",
      0,
      0,
      64,
      "cycles",
      "left open by the paper; measured on a GH100 graphics GPC: 4",
      "of blending RGBA32F, for each column of two pixels of a quad that has live samples; 0: "
      "bytes_per_cycle says what a quad takes"};
  Switch pairs_in_sector{*this, "pairs_in_sector", false,
                         "left open by the paper; measured on a GH100 graphics GPC: on",
                         "quads of one cycle share a sector, as two neighbours of RGBA8 do; others take a cycle each"};
};

}  // namespace vrpipe
