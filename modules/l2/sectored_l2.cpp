#include "l2/sectored_l2.h"

#include <algorithm>

#include <fmt/format.h>

#include <vrpipe/component/error.h>

namespace vrpipe {

namespace {

SectoredL2::Sizes sizes_of(const SectoredL2Parameters& parameters) {
  return {parameters.banks,        parameters.bank_bytes_per_cycle, parameters.mshrs,
          parameters.write_backs,  parameters.latency_cycles,       parameters.bytes_per_cycle,
          parameters.header_bytes, parameters.port_requests,        parameters.arbitration == 1U};
}

CacheOrganization checked(const SectoredL2Parameters& parameters) {
  CacheOrganization organization = parameters.cache.organization();
  organization.write_allocate = static_cast<WriteAllocate>(static_cast<unsigned>(parameters.write_allocate));
  organization.check("L2", "l2", "bytes");
  const std::uint32_t banks = parameters.banks;
  if ((banks & (banks - 1)) != 0) {
    throw UserError("unusable L2", "l2.banks", fmt::format("{} is no power of two", banks), "use a power of two");
  }
  if (banks > organization.sets()) {
    throw UserError("unusable L2", "l2.banks, l2.ways",
                    fmt::format("{} sets cannot be dealt out to {} banks", organization.sets(), banks),
                    fmt::format("use at most {} banks, or fewer ways", organization.sets()));
  }
  return organization;
}

}  // namespace

SectoredL2::SectoredL2(const SectoredL2Parameters& parameters, const RenderContext& context)
    : sizes_(sizes_of(parameters)),
      gpcs_(context.placement.gpcs),
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
      cache_(checked(parameters), statistics_),
      origins_(cache_.organization().lines()),
      bank_cycles_(sizes_.banks) {}

void SectoredL2::access(const MemoryRequest& request) {
  traffic_.count(request);
  const bool writes = request.command == tlm::TLM_WRITE_COMMAND;
  for_each_line(request, [&](std::uint64_t address, std::uint32_t bytes) {
    const LineAccess done = cache_.access(address, bytes, writes);
    looked_up({address, bytes, request.command, request.origin},
              static_cast<unsigned>(__builtin_popcount(done.sectors)),
              static_cast<unsigned>(__builtin_popcount(done.missed)));
    const auto below = [&](const MemoryRequest& moved, const SectorRun&) {
      if (below_ != nullptr) below_->access(moved);
    };
    for_each_run(done.old_address, done.written_back, tlm::TLM_WRITE_COMMAND, origins_[done.line], below);
    if (done.replaced) allocated(done.line, request.origin, done.spared);
    for_each_run(done.address, done.filled, tlm::TLM_READ_COMMAND, request.origin, below);
    const auto moved = static_cast<unsigned>(__builtin_popcount(done.filled) + __builtin_popcount(done.written_back));
    if (!is_for_quads(request)) return;
    count_bank(bank_of(address), bytes + std::uint64_t{moved} * cache_.organization().sector_bytes);
  });
}

std::vector<OccupancyPart> SectoredL2::least_occupancy(double /*period_ps*/) const {
  const std::uint64_t busiest = *std::max_element(bank_cycles_.begin(), bank_cycles_.end());
  // The last that CROP writes back may wait at its port.
  const std::uint64_t waiting =
      std::uint64_t{sizes_.port_requests} * bank_cycles(cache_.organization().line_bytes) * gpcs_;
  return {{"banks", 0, static_cast<double>(busiest - std::min(busiest, waiting)), true}};
}

}  // namespace vrpipe
