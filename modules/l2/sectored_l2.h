#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "l2/own_clock.h"

#include <vrpipe/arithmetic/divisor.h>
#include <vrpipe/component/parameter.h>
#include <vrpipe/memory/interleaving.h>
#include <vrpipe/memory/memory_request.h>
#include <vrpipe/memory/sectored_cache.h>
#include <vrpipe/pipeline/render_context.h>
#include <vrpipe/pipeline/slots/memory.h>

namespace vrpipe {

/// Where a cache stands: what it is called, and what is other there than in other places by default.
struct CacheLevel {
  const char* slot;
  const char* name;
  CacheParameters::Defaults cache;
  bool writes_through;
  const char* writes_source;
  bool holds_attributes;
  const char* holds_source;
  std::uint32_t banks;
  const char* banks_source;
  const char* bank_bytes_source;
  std::uint32_t mshrs;
  const char* mshrs_source;
  std::uint32_t latency_cycles;
  const char* latency_source;
  const char* port_requests_source;
  bool sees_all_writes;  ///< to what it holds
};
extern const CacheLevel level_of_l1;
extern const CacheLevel level_of_l2;

struct SectoredL2Parameters : ParameterSet {
  explicit SectoredL2Parameters(const CacheLevel& of = level_of_l2) : level(of) {}

  const CacheLevel& level;
  CacheParameters cache{*this, level.cache};
  Choice write_policy{*this,
                      "write_policy",
                      {"write-back", "write-through"},
                      level.writes_through ? 1U : 0U,
                      level.writes_source,
                      "what is written stays until its line goes, or goes below at once, past the cache"};
  Choice write_allocate{*this,
                        "write_allocate",
                        {"fill", "byte-mask"},
                        0,
                        source::open,
                        "what a write of a part of a sector does that is not there: has it filled, or marks its bytes"};
  Switch hold_attributes{*this, "hold_attributes", level.holds_attributes, level.holds_source,
                         "a line of attributes goes only where its set has no other that can"};
  Integer banks{
      *this, "banks", level.banks,        1,
      64,    "banks", level.banks_source, "among which the sets are dealt out evenly: set n is in bank n mod banks"};
  Integer bank_bytes_per_cycle{*this,
                               "bank_bytes_per_cycle",
                               32,
                               16,
                               1024,
                               "bytes",
                               level.bank_bytes_source,
                               "read, written or filled in a bank"};
  Integer mshrs{*this, "mshrs",    level.mshrs,        1,
                65536, "requests", level.mshrs_source, "of a bank: that wait for fills"};
  Integer write_backs{*this, "write_backs", 32,           1,
                      65536, "accesses",    source::open, "of a bank, that wait for the memory below"};
  Integer latency_cycles{*this,  "latency_cycles", level.latency_cycles, 1,
                         100000, "cycles",         level.latency_source, "from request to data"};
  Integer bytes_per_cycle{
      *this,        "bytes_per_cycle",
      128,          32,
      4096,         "bytes",
      source::open, "that the crossbar moves for each of its ports, in each direction: four sectors"};
  Integer header_bytes{*this,
                       "header_bytes",
                       8,
                       1,
                       128,
                       "bytes",
                       "Accel-Sim, SM87_ORIN: flits of 40 bytes carry 32",
                       "a read, or what acknowledges a write, takes of the crossbar"};
  Integer port_requests{*this,
                        "port_requests",
                        512,
                        1,
                        65536,
                        "requests",
                        level.port_requests_source,
                        "that wait at a port of the crossbar"};
  Choice arbitration{*this, "arbitration", {"round-robin", "oldest"},
                     0,     source::open,  "of the ports that have requests for a bank"};
  OwnClock::Parameter frequency_mhz{*this};
};

/// Sees the look-ups of an L2, in their order.
class L2Observer {
 public:
  virtual ~L2Observer() = default;
  /// @param part  of a request: what lies in one line
  virtual void looked_up(const MemoryRequest& part) = 0;
  /// At `cycle`: what it needed is there, and its line, which was pinned from the look-up on, may go.
  virtual void served(const MemoryRequest& part) = 0;
};

/// The L2 that all GPCs share, or an L1 of an SM array: a sectored cache in banks behind a crossbar. A request of several
/// lines is an access to each. It writes back, or through: then a write changes no tags, and what is there of its sectors
/// stays there.
class SectoredL2 final : public MemoryBehaviour {
 public:
  /// Throws UserError for a cache that cannot be, sets that cannot be dealt out evenly to the banks, or a port or bank
  /// narrower than a sector.
  SectoredL2(const SectoredL2Parameters& parameters, const RenderContext& context);

  void access(const MemoryRequest& request) override;
  bool needs_below() const override { return true; }
  void hold_as(const Behaviour& other) override;
  MemoryBytes delivered() const override { return traffic_.bytes(); }
  MemoryBytes memory_bytes() const override {
    const MemoryBytes of_lines{statistics_.bytes_filled.value(), statistics_.bytes_written_back.value()};
    return {of_lines.read, of_lines.written + (writes_through_ ? traffic_.bytes().written : 0)};
  }
  std::vector<OccupancyPart> least_occupancy(double period_ps) const override;
  TimingParameters timing() const override { return clock_.of_units({sizes_.latency_cycles, sizes_.bytes_per_cycle}); }

  void observe(L2Observer& observer) { observer_ = &observer; }

  struct Sizes {
    std::uint32_t banks, bank_bytes_per_cycle, mshrs, write_backs;
    std::uint32_t latency_cycles, bytes_per_cycle, header_bytes, port_requests;
    bool oldest_first;
  };
  /// In cycles of its clock, as all that it is asked for.
  const Sizes& sizes() const { return sizes_; }
  const OwnClock& clock() const { return clock_; }

  // For timing models.

  /// The address that a request is looked up at: where it does not see all writes, other contents are at others.
  std::uint64_t looked_up_at(const MemoryRequest& request) const {
    return sees_all_writes_ ? request.address : request.address | std::uint64_t{request.origin.round} << round_shift;
  }
  /// The request that goes below for one that was looked up.
  MemoryRequest below_as(MemoryRequest request) const {
    if (!sees_all_writes_) request.address &= (std::uint64_t{1} << round_shift) - 1;
    return request;
  }
  bool writes_through() const { return writes_through_; }
  /// Whether a request goes below without a look-up.
  bool passes(const MemoryRequest& request) const { return writes_through_ && is_write(request); }
  /// Of a piece of a request.
  std::uint32_t bank_of(std::uint64_t address) const { return bank_of_set(cache_.set_of(address)); }
  std::uint32_t bank_of_line(SectoredCache::Line line) const { return bank_of_set(cache_.set_of_line(line)); }
  SectoredCache& cache() { return cache_; }
  SectoredCacheStatistics& statistics() { return statistics_; }
  /// At a port.
  void count(const MemoryRequest& request) { traffic_.count(request); }
  /// All at once for a part, if it hits: `sectors` gets those needed. Returns the line, or `no_line`; then `look_up` follows.
  SectoredCache::Line hit(const MemoryRequest& part, std::uint32_t& sectors) {
    const SectoredCache::Line line = cache_.hit(part.address, part.bytes, is_write(part), sectors);
    if (line != SectoredCache::no_line) looked_up(part, static_cast<unsigned>(__builtin_popcount(sectors)), 0);
    return line;
  }
  LineAccess look_up(const MemoryRequest& part) {
    const LineAccess done = cache_.access(part.address, part.bytes, is_write(part));
    looked_up(part, static_cast<unsigned>(__builtin_popcount(done.sectors)),
              static_cast<unsigned>(__builtin_popcount(done.missed)));
    return done;
  }
  /// In a line: so many sectors, of which so many were missed.
  void looked_up(const MemoryRequest& part, std::uint64_t sectors, std::uint64_t missed) {
    OfTraffic& counted = of_traffic_[static_cast<unsigned>(part.origin.traffic)];
    counted.sectors += sectors;
    counted.misses += missed;
    if (observer_ != nullptr) observer_->looked_up(part);
  }
  void served(const MemoryRequest& part) {
    if (observer_ != nullptr && !passes(part)) observer_->served(part);
  }
  /// In a bank.
  void count_bank(std::uint32_t bank, std::uint64_t bytes) { bank_cycles_[bank] += bank_cycles(bytes); }
  /// How long so many bytes keep a bank.
  std::uint32_t bank_cycles(std::uint64_t bytes) const {
    return static_cast<std::uint32_t>(bank_width_.quotient_up(bytes));
  }
  /// Whose data a line of the cache holds: what is written back has its origin.
  const MemoryOrigin& origin(SectoredCache::Line line) const { return origins_[line]; }
  /// A line was allocated for someone; `spared`: another one went instead of one that is kept.
  void allocated(SectoredCache::Line line, const MemoryOrigin& origin, bool spared) {
    origins_[line] = origin;
    if (holds_attributes_ && origin.traffic == MemoryTraffic::attribute) cache_.keep(line);
    if (spared) ++attribute_lines_held_;
  }
  /// Of a request in one line: its first byte there.
  std::uint32_t first_of(const MemoryRequest& request) const {
    return static_cast<std::uint32_t>(request.address & last_of_line_);
  }
  std::uint32_t sectors_of(const MemoryRequest& request) const {
    const std::uint32_t first = first_of(request);
    const std::uint32_t from = first >> sector_shift_;
    return sector_mask(from, ((first + request.bytes - 1) >> sector_shift_) - from + 1);
  }
  /// Bytes on the way in and on the way out.
  std::uint32_t request_bytes(const MemoryRequest& request) const {
    return is_write(request) ? request.bytes : sizes_.header_bytes;
  }
  std::uint32_t response_bytes(const MemoryRequest& request) const {
    return is_write(request) ? sizes_.header_bytes : request.bytes;
  }
  bool is_in_one_line(const MemoryRequest& request) const {
    return (request.address & last_of_line_) + request.bytes <= last_of_line_ + 1;
  }
  /// Calls `each(part)` with what of a request is in each line, at the address that it is looked up at.
  template <class Each>
  void for_each_part(const MemoryRequest& request, Each&& each) const {
    const std::uint64_t at = looked_up_at(request);
    // As it is: a copy would wait for the stores that have just made it.
    if (at == request.address && is_in_one_line(request)) return each(request);
    for_each_line(at, request.bytes, [&](std::uint64_t address, std::uint32_t bytes) {
      each(MemoryRequest{address, bytes, request.command, request.origin});
    });
  }
  /// Calls `piece(address, bytes)` with the part in each line of so many bytes from an address on.
  template <class Piece>
  void for_each_line(std::uint64_t address, std::uint64_t bytes, Piece&& piece) const {
    for (const std::uint64_t past = address + bytes; address < past;) {
      const std::uint64_t end = std::min(past, (address | last_of_line_) + 1);
      piece(address, static_cast<std::uint32_t>(end - address));
      address = end;
    }
  }
  /// Calls `access(request)` for sectors of a line, in as few accesses as their alignment allows.
  template <class Access>
  void for_each_run(std::uint64_t line_address, std::uint32_t sectors, tlm::tlm_command command,
                    const MemoryOrigin& origin, Access&& access) const {
    const CacheOrganization& organization = cache_.organization();
    while (sectors != 0) {
      const SectorRun run = take_sector_run(sectors, organization.sectors_of_a_line());
      access(below_as({line_address + std::uint64_t{run.first} * organization.sector_bytes,
                       run.count * organization.sector_bytes, command, origin}),
             run);
    }
  }

 private:
  std::uint32_t bank_of_set(std::uint32_t set) const { return interleaving_.share(set).place; }
  /// Whether a bank has to serve the request whatever the order of accesses is.
  bool is_certain(const MemoryRequest& request) const;
  void access_part(const MemoryRequest& part, bool certain);
  void access_below(MemoryRequest moved, bool certain) {
    moved.is_certain = certain;
    if (below_ != nullptr) below_->access(moved);
  }
  struct OfTraffic {
    Counter sectors, misses;
  };
  static constexpr unsigned round_shift = 48;  ///< beyond all addresses

  const OwnClock clock_;
  const Sizes sizes_;
  const unsigned gpcs_;
  const bool sees_all_writes_;
  const bool writes_through_;
  const bool holds_attributes_;
  MemoryTrafficCounters traffic_{*this};
  std::array<OfTraffic, memory_traffics> of_traffic_;
  Counter attribute_lines_held_{*this, "attribute_lines_held", "lines",
                                "of attributes that another line went instead of"};
  SectoredCacheStatistics statistics_{*this, "cache"};
  SectoredCache cache_;
  const std::uint64_t last_of_line_;  ///< byte
  const unsigned sector_shift_;       ///< log2 of the bytes of a sector
  const Divisor bank_width_;          ///< bytes a cycle
  const Interleaving interleaving_;   ///< of sets, to banks
  const bool terminates_early_;       ///< the frame
  L2Observer* observer_ = nullptr;
  std::vector<MemoryOrigin> origins_;       ///< by line of the cache
  std::vector<std::uint64_t> bank_cycles_;  ///< by bank
};

}  // namespace vrpipe
