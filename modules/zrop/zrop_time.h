#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "block_price.h"
#include "z_cache.h"
#include "zrop_parameters.h"

#include <vrpipe/kernel/accounting.h>
#include <vrpipe/kernel/pipeline_stages.h>
#include <vrpipe/pipeline/slots/zrop.h>

namespace vrpipe {

/// What ZROP's work takes, by its parameters: all that its models of `cycle`, `lt` and `bound` ask for. One port into the z-cache:
/// a cycle tests, applies updates, or moves sectors.
struct ZropTime {
  /// Throws UserError for a z-cache that cannot be.
  ZropTime(const ZropParameters& parameters, DepthFormat format)
      : quads_per_cycle(parameters.quads_per_cycle),
        latency_cycles(parameters.latency_cycles),
        updates_per_cycle(parameters.updates_per_cycle),
        z_cache(parameters, format),
        blocks(parameters.half_block_cycles.thousandths(), parameters.block_cycles.thousandths()) {}

  const std::uint32_t quads_per_cycle;
  const std::uint32_t latency_cycles;
  const std::uint32_t updates_per_cycle;  ///< signals
  const ZCache z_cache;
  const BlockPrice blocks;  ///< of what is tested before shading

  /// The first cycle after so many quads that are tested from one on.
  Cycle end_of_tests(Cycle at, unsigned quads) const { return at + (quads + quads_per_cycle - 1) / quads_per_cycle; }

  /// Of what it has tested, early or late, and of its reports to Hi-Z.
  PipelineStages pipeline() const { return PipelineStages::of_latency(latency_cycles, quads_per_cycle); }
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
