#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "block_price.h"

#include <vrpipe/component/parameter.h>
#include <vrpipe/kernel/accounting.h>
#include <vrpipe/memory/cache_organization.h>
#include <vrpipe/pipeline/slots/zrop.h>

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
  Integer input_updates{*this,        "input_updates",
                        64,           1,
                        65536,        "signals",
                        source::open, "between z-cache look-up and update; hides the latency of fills"};
  Integer sectors_per_cycle{*this,
                            "sectors_per_cycle",
                            16,
                            1,
                            64,
                            "sectors",
                            "measured on a GH100 graphics GPC: 8 a cycle and ROP partition; the paper's GPC has two",
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
                    "left open by the paper; measured on a GH100 graphics GPC: 1.4",
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
  ZCache z_cache() const {
    ZCache made;
    made.organization = cache.organization();
    made.mshrs = mshrs;
    made.input_quads = input_quads;
    made.input_updates = input_updates;
    made.sectors_per_cycle = sectors_per_cycle;
    made.fast_clear = fast_clear;
    made.fetch_ahead_lines = fetch_ahead_lines;
    return made;
  }
};

/// What ZROP's work takes, by its parameters: all that its models of `cycle`, `lt` and `bound` ask for. One port into the z-cache:
/// a cycle tests, applies updates, or moves sectors.
struct ZropTime {
  /// Throws UserError for a z-cache that cannot be (ZCache::check).
  ZropTime(const ZropParameters& parameters, DepthFormat format)
      : quads_per_cycle(parameters.quads_per_cycle),
        latency_cycles(parameters.latency_cycles),
        updates_per_cycle(parameters.updates_per_cycle),
        z_cache(parameters.z_cache()),
        blocks(parameters.half_block_cycles.thousandths(), parameters.block_cycles.thousandths()) {
    z_cache.check(format);
  }

  const std::uint32_t quads_per_cycle;
  const std::uint32_t latency_cycles;
  const std::uint32_t updates_per_cycle;  ///< signals
  const ZCache z_cache;
  const BlockPrice blocks;  ///< of what is tested before shading

  /// The first cycle after so many quads that are tested from one on.
  Cycle end_of_tests(Cycle at, unsigned quads) const { return at + (quads + quads_per_cycle - 1) / quads_per_cycle; }

  /// As in ZropWork.
  std::vector<WorkKind> kinds() const {
    return {{"tests", 0, 1.0 / quads_per_cycle, true},
            {"updates", 0, 1.0, false},
            {"sectors", 0, 1.0 / z_cache.sectors_per_cycle, false},
            {"late tests", 0, 1.0 / quads_per_cycle, true},
            {"blocks", 0, 1.0 / 1000, false}};
  }

  // Of a sum of work, for `bound`:
  /// Beside beats that take several cycles updates take nothing of their own.
  bool updates_hide() const { return quads_per_cycle < QuadBeat::capacity || blocks.is_on(); }
  /// Thousandths of a cycle of one beat's blocks.
  std::uint64_t longest_beat() const { return blocks.most_of(QuadBeat::capacity); }
  /// Look-ups run ahead by the quads of a queue: sectors that these fill, an earlier part of a run may have filled for them.
  std::uint64_t sectors_not_ahead(std::uint64_t filled) const {
    const std::uint64_t sectors = filled - std::min<std::uint64_t>(filled, z_cache.input_quads);
    return sectors - sectors % z_cache.sectors_per_cycle;
  }
  /// As UntimedUnit::least_parts; here updates are signals.
  std::vector<OccupancyPart> least_parts(const std::array<std::uint64_t, most_work_kinds>& items, bool to_last) const {
    const auto cycles = [&](unsigned kind, std::uint32_t in_a_cycle) {
      return static_cast<double>(items[kind]) / in_a_cycle;
    };
    const double tests = cycles(ZropWork::tests, quads_per_cycle);
    const double in_blocks = cycles(ZropWork::blocks, 1000);
    const double updates = cycles(ZropWork::updates, updates_per_cycle) - (updates_hide() ? tests + in_blocks : 0);
    // A cycle in which sectors move may be the last that a block takes part of.
    const double sectors = cycles(ZropWork::sectors, z_cache.sectors_per_cycle) - in_blocks;
    // For what the last beat takes nobody waits.
    const double of_last = to_last ? std::min(in_blocks, static_cast<double>(longest_beat()) / 1000) : 0;
    const double least[] = {tests, updates, sectors, cycles(ZropWork::late_tests, quads_per_cycle),
                            in_blocks - of_last};
    std::vector<OccupancyPart> parts;
    for (const WorkKind& kind : kinds())
      parts.push_back({kind.name, kind.resource, std::max(0.0, least[parts.size()]), kind.is_throughput});
    return parts;
  }
};

}  // namespace vrpipe
