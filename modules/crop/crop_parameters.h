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
  Integer sectors_per_cycle{*this,
                            "sectors_per_cycle",
                            16,
                            1,
                            64,
                            "sectors",
                            "measured on a GH100 graphics GPC: 8 a cycle and ROP partition; the paper's GPC has two",
                            "filled or written back in a cycle in which nothing is blended"};
  Switch writes_unchanged{*this, "writes_unchanged", false, source::measured,
                          "write sectors back in which no value changed"};
  Integer line_cycles{
      *this,
      "line_cycles",
      0,
      0,
      64,
      "cycles",
      "left open by the paper; measured on a GH100 graphics GPC: 1",
      "of blending that a line takes which is written back, or fetched for a quad that changes a value, "
      "however many of its sectors move; 0: sectors_per_cycle says what moving takes"};
  Switch fetch_ahead{
      *this, "fetch_ahead", false, "left open by the paper; measured on a GH100 graphics GPC: on",
      "tags run ahead of data by input_quads: a line may go while quads wait to be blended into it, and is "
      "fetched a second time if it is wanted again before that"};
  Integer line_return_cycles{*this,
                             "line_return_cycles",
                             0,
                             0,
                             100000,
                             "cycles",
                             "left open by the paper; measured on a GH100 graphics GPC: 503",
                             "from the last blend into a line that leaves the cache to the next one"};
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
