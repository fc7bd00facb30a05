#pragma once

#include <vrpipe/component/parameter.h>
#include <vrpipe/memory/cache_organization.h>

namespace vrpipe {

/// Of a ZROP: one of your own derives its parameters from these.
struct ZropParameters : ParameterSet {
  Integer quads_per_cycle{
      *this,
      "quads_per_cycle",
      16,
      1,
      16,
      "quads",
      "measured on a GH100 graphics GPC: 8 quads a cycle and ROP partition; the paper's GPC has two",
      "tested in a cycle"};
  Integer latency_cycles{
      *this, "latency_cycles", 8, 1, 1000, "cycles", source::open, "of a test, z-cache read included"};
  Integer updates_per_cycle{*this,
                            "updates_per_cycle",
                            1,
                            1,
                            16,
                            "signals",
                            source::open,
                            "termination updates, each a read-modify-write of the z-cache; such a cycle tests nothing"};
  CacheParameters cache{*this,
                        {"cache_bytes", 16384, 1 << 24, "z-cache, where memory is connected", 0,
                         "ATTILA: 4 ways of 16 lines of 256 bytes for each ROP"}};
  RopMshrs mshrs{*this};
  Integer input_quads{*this,
                      "input_quads",
                      4096,
                      1,
                      65536,
                      "quads",
                      "ATTILA: fetch queue of 256 stamps for each that a ROP tests in a cycle",
                      "between z-cache look-up and test; hides the latency of fills; at least a beat"};
  Integer input_halves{
      *this,
      "input_halves",
      0,
      0,
      65536,
      "halves of blocks",
      "left open by the paper; measured on a GH100 graphics GPC: 300 to 400",
      "between the second look at tags, if there is one, and the test, in place of input_quads: each of 4x8 "
      "pixels in which a primitive has quads; 0: input_quads"};
  Integer input_updates{*this,        "input_updates",
                        64,           1,
                        65536,        "signals",
                        source::open, "between z-cache look-up and update; hides the latency of fills"};
  RopSectorsPerCycle sectors_per_cycle{*this,
                                       "filled or written back in a cycle in which nothing is tested or updated"};
  Real half_block_cycles{*this,
                         "half_block_cycles",
                         0,
                         0,
                         100,
                         "cycles",
                         "left open by the paper; measured on a GH100 graphics GPC: 1",
                         "of tests for each half, 4x8 pixels, of an 8x8 block in which a primitive has quads, if that "
                         "is more than quads_per_cycle takes"};
  Real block_cycles{*this,
                    "block_cycles",
                    0,
                    0,
                    100,
                    "cycles",
                    "left open by the paper; measured on a GH100 graphics GPC: 1.5 to 1.9",
                    "the least that such a block takes"};
  Integer fetch_ahead_lines{*this,
                            "fetch_ahead_lines",
                            0,
                            0,
                            65536,
                            "lines",
                            "left open by the paper; measured on a GH100 graphics GPC: 128 to 512",
                            "if any, tags run ahead of data: a look at them asks for sectors, and a second one, at "
                            "most so many lines of primitives "
                            "later, stops for lines that come back; a line may go while it is fetched for a test"};
  Switch fast_clear{*this, "fast_clear", true, "ATTILA: a state for each block of the target, on the chip",
                    "sectors to which nothing was written back after a clear are not read"};
};

}  // namespace vrpipe
