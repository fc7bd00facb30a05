#include "l2/sectored_l2.h"

#include <algorithm>

#include <fmt/format.h>

#include <vrpipe/component/error.h>

namespace vrpipe {

// Of the 16 cores of the paper's GPC, whose L1s one of an array stands for.
const CacheLevel level_of_l1{"l1",
                             "L1",
                             {"bytes", 16 * 49152, 1U << 30, "48 KB for each of 16 cores", 96,
                              "Accel-Sim, QV100: 4 sets in the L1 of a core, whatever its size"},
                             true,
                             "Accel-Sim, SM87_ORIN: an L1 writes through",
                             false,
                             source::open,
                             64,
                             "Accel-Sim, SM87_ORIN: 4 in the L1 of a core",
                             "Accel-Sim: a sector a cycle",
                             96,
                             "Accel-Sim, SM87_ORIN: 384 in the L1 of a core",
                             38,
                             "Accel-Sim, SM87_ORIN: L1 latency",
                             source::open,
                             false};
const CacheLevel level_of_l2{"l2",
                             "L2",
                             {"bytes", 4 << 20, 1U << 30, "shared by all GPCs", 16,
                              "Accel-Sim, SM87_ORIN: 32 sub-partitions of 64 sets of 16 ways of 128 bytes"},
                             false,
                             source::open,
                             true,
                             source::paper_text,
                             32,
                             "Accel-Sim, SM87_ORIN: 16 partitions of 2 sub-partitions",
                             "Accel-Sim: a sector a cycle",
                             64,
                             source::open,
                             146,
                             "Accel-Sim, SM87_ORIN: L2 latency",
                             "Accel-Sim, SM87_ORIN: buffers of 512 at the crossbar",
                             true};

namespace {

SectoredL2::Sizes sizes_of(const SectoredL2Parameters& parameters) {
  return {parameters.banks,        parameters.bank_bytes_per_cycle, parameters.mshrs,
          parameters.write_backs,  parameters.latency_cycles,       parameters.bytes_per_cycle,
          parameters.header_bytes, parameters.port_requests,        parameters.arbitration == 1U};
}

SectoredCacheStatistics& followed(SectoredCacheStatistics& statistics, const RenderContext& context) {
  if (!EffectGate(context, "cache.details").is_active()) statistics.leave_out_details();
  return statistics;
}

CacheOrganization checked(const SectoredL2Parameters& parameters) {
  CacheOrganization organization = parameters.cache.organization();
  organization.write_allocate = static_cast<WriteAllocate>(static_cast<unsigned>(parameters.write_allocate));
  const std::string name = parameters.level.name;
  const std::string slot = parameters.level.slot;
  organization.check(name, slot, "bytes");
  const std::uint32_t banks = parameters.banks;
  if (organization.sets() % banks != 0) {
    const std::uint64_t of_banks = std::uint64_t{banks} * organization.ways_of_a_set() * organization.line_bytes;
    throw UserError("unusable " + name, slot + ".banks, " + slot + ".bytes",
                    fmt::format("{} sets cannot be dealt out evenly to {} banks", organization.sets(), banks),
                    fmt::format("use a multiple of {} bytes (banks x ways x line), or other banks or ways", of_banks));
  }
  return organization;
}

}  // namespace

SectoredL2::SectoredL2(const SectoredL2Parameters& parameters, const RenderContext& context)
    : clock_(parameters.level.slot, parameters.frequency_mhz, context),
      sizes_(sizes_of(parameters)),
      gpcs_(context.placement.gpcs),
      sees_all_writes_(parameters.level.sees_all_writes),
      writes_through_(parameters.write_policy == 1U),
      holds_attributes_(parameters.hold_attributes),
      of_traffic_{{{{*this, "other_sectors", "sectors", "accessed by initiators that do not say what for"},
                    {*this, "other_sector_misses", "sectors", "missed by these"}},
                   {{*this, "color_sectors", "sectors", "accessed of the colour target"},
                    {*this, "color_sector_misses", "sectors", "missed of it"}},
                   {{*this, "depth_stencil_sectors", "sectors", "accessed of the depth and stencil target"},
                    {*this, "depth_stencil_sector_misses", "sectors", "missed of it"}},
                   {{*this, "vertex_sectors", "sectors", "accessed of the splats or vertices of a draw"},
                    {*this, "vertex_sector_misses", "sectors", "missed of these"}},
                   {{*this, "attribute_sectors", "sectors", "accessed of the attributes of shaded vertices"},
                    {*this, "attribute_sector_misses", "sectors", "missed of these"}}}},
      cache_(checked(parameters), followed(statistics_, context)),
      last_of_line_(cache_.organization().line_bytes - 1),
      sector_shift_(static_cast<unsigned>(__builtin_ctz(cache_.organization().sector_bytes))),
      bank_width_(sizes_.bank_bytes_per_cycle),
      interleaving_(sizes_.banks),
      terminates_early_(context.frame != nullptr && context.frame->terminates_early()),
      origins_(cache_.organization().lines()),
      bank_cycles_(sizes_.banks) {}

void SectoredL2::access(const MemoryRequest& request) {
  traffic_.count(request);
  const bool certain = counts_least_ && is_certain(request);
  for_each_part(request, [&](const MemoryRequest& part) { access_part(part, certain); });
}

void SectoredL2::access_part(const MemoryRequest& part, bool certain) {
  if (passes(part)) {
    access_below(below_as(part), certain);
    if (certain) count_bank(bank_of(part.address), part.bytes);
    return;
  }
  std::uint32_t sectors = 0;
  if (const SectoredCache::Line line = hit(part, sectors); line != SectoredCache::no_line) {
    if (certain) count_bank(bank_of_line(line), part.bytes);
    return;
  }
  const LineAccess done = look_up(part);
  // What goes, and is missed once more, is so because of what came between.
  const bool is_first = certain && done.filled == done.filled_first;
  for_each_run(done.old_address, done.written_back, tlm::TLM_WRITE_COMMAND, origins_[done.line],
               [&](const MemoryRequest& moved, const SectorRun&) { access_below(moved, false); });
  if (done.replaced) allocated(done.line, part.origin, done.spared);
  for_each_run(done.address, done.filled, tlm::TLM_READ_COMMAND, part.origin,
               [&](const MemoryRequest& moved, const SectorRun&) { access_below(moved, is_first); });
  if (!certain) return;
  const auto filled = is_first ? static_cast<unsigned>(__builtin_popcount(done.filled)) : 0U;
  count_bank(bank_of(part.address), part.bytes + std::uint64_t{filled} * cache_.organization().sector_bytes);
}

bool SectoredL2::is_certain(const MemoryRequest& request) const {
  // Which sectors of the stencil are dirty when they go depends on when terminations land.
  const bool follows_terminations = terminates_early_ && request.origin.traffic == MemoryTraffic::depth_stencil;
  return request.is_certain && is_for_quads(request) && !follows_terminations;
}

std::vector<OccupancyPart> SectoredL2::least_occupancy(double /*period_ps*/) const {
  const std::uint64_t busiest = *std::max_element(bank_cycles_.begin(), bank_cycles_.end());
  // The last that CROP writes back may wait at its port.
  const std::uint64_t waiting =
      std::uint64_t{sizes_.port_requests} * bank_cycles(cache_.organization().line_bytes) * gpcs_;
  return {{"banks", 0, static_cast<double>(busiest - std::min(busiest, waiting)) * clock_.ratio(), true}};
}

void SectoredL2::hold_as(const Behaviour& other) {
  const auto& same = dynamic_cast<const SectoredL2&>(other);
  cache_.hold_as(same.cache_);
  origins_ = same.origins_;
}

}  // namespace vrpipe
