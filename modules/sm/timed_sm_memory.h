#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "attribute_traffic.h"

#include <vrpipe/memory/sectored_cache.h>
#include <vrpipe/memory/timed_memory_port.h>
#include <vrpipe/model/timed.h>

namespace vrpipe {

/// As sm_memory.h, at lt: who calls does so in the order of time as far as he can. L1s see the launches in their order.
class TimedSmMemory {
 public:
  TimedSmMemory(PortOwner& owner, const RenderContext& context, const SmTime& time, SectoredCacheStatistics& statistics)
      : timing_(time.fetch),
        traffic_(context, time.fetch),
        port_(owner, "memory"),
        statistics_(statistics),
        cores_(time.cores),
        answered_(timing_.attribute_writes, 0) {}

  tlm::tlm_initiator_socket<32>& socket() { return port_.socket; }
  const MemoryBytes& moved() const { return port_.moved(); }
  /// Before the first access.
  void connect() {
    for (std::uint32_t core = 0; core < cores_; ++core) l1s_.emplace_back(timing_, statistics_);
  }

  /// When what a vertex warp reads is there, asked for in cycle `at`.
  Cycle fetch_vertices(const VertexWarp& warp, Cycle at) {
    Cycle there = at;
    traffic_.read_vertices(warp,
                           [&](const MemoryRequest& request) { there = std::max(there, port_.access(request, at)); });
    return there;
  }
  /// What a vertex warp that is shaded in a cycle writes is to be sent; returns how many accesses that is.
  unsigned write_attributes(const VertexWarp& warp, Cycle done) {
    const std::size_t before = unsent_.size();
    traffic_.write_attributes(warp, [&](const MemoryRequest& request) { unsent_.push({request, done}); });
    return static_cast<unsigned>(unsent_.size() - before);
  }
  /// When the next write goes: once the one as many before it as may be in flight has been answered.
  Cycle next_write() const { return unsent_.empty() ? never : std::max(unsent_.front().shaded, answered_[turn_]); }
  /// Sends it; returns when.
  Cycle send_write() {
    const Cycle at = next_write();
    answered_[turn_] = port_.access(traffic_.in_buffer(unsent_.front().request), at);
    turn_ = turn_ + 1 == answered_.size() ? 0 : turn_ + 1;
    unsent_.pop();
    return at;
  }
  struct Fetch {
    Cycle looked_up;  ///< the warp can be launched
    Cycle there;      ///< the last of its attributes
  };
  /// Looks a fragment warp up in the L1 of a core, in cycle `at` or as soon as there is room.
  Fetch fetch_attributes(const Warp& warp, std::uint32_t core, Cycle at) {
    traffic_.find_reads(warp, reads_);
    L1& l1 = l1s_[core];
    if (!l1.cache || reads_.traffic != MemoryTraffic::attribute) return fetch_past(l1, at);
    Cycle there = 0;
    std::uint64_t sectors = 0;
    for (unsigned i = 0; i < reads_.count; ++i) {
      LineAccess access;
      access.address = reads_.lines[i].address;
      access.sectors = reads_.lines[i].sectors;
      l1.cache->look_up(access);
      std::array<Cycle, sectors_of_a_line>& line = l1.there[access.line];
      if (access.replaced) {
        // It stays until what it waits for has come.
        at = std::max(at, *std::max_element(line.begin(), line.end()));
        line = {};
      }
      for (std::uint32_t missing = access.filled; missing != 0;) at = fill(l1, access, missing, line, at);
      for (std::uint32_t needed = access.sectors; needed != 0; needed &= needed - 1) {
        there = std::max(there, line[static_cast<unsigned>(__builtin_ctz(needed))]);
        ++sectors;
      }
    }
    l1.cache->accessed(reads_.count, sectors);
    return {at, std::max(there, at + timing_.l1_latency_cycles)};
  }

 private:
  static constexpr unsigned sectors_of_a_line = AttributeTraffic::line_bytes / AttributeTraffic::sector_bytes;

  /// Of a core.
  struct L1 {
    L1(const AttributeFetch& timing, SectoredCacheStatistics& statistics)
        : mshrs(timing.l1_mshrs), fills(statistics), there(timing.l1.lines()) {
      if (timing.has_l1()) cache.emplace(timing.l1, statistics);
    }
    std::optional<SectoredCache> cache;  ///< none where memory has it all
    SlotPool mshrs;
    AnnotatedFillCounter fills;
    std::vector<std::array<Cycle, sectors_of_a_line>> there;  ///< by line and sector: since when
  };

  /// The same where the core has none, and past it: each warp asks for all that it reads.
  Fetch fetch_past(L1& l1, Cycle at) {
    Cycle there = 0;
    for (unsigned i = 0; i < reads_.count; ++i) {
      for (std::uint32_t left = reads_.lines[i].sectors; left != 0;) {
        SectorRun run;
        there = std::max(there, ask(l1, reads_.lines[i].address, left, run, at));
      }
    }
    return {at, there};
  }
  /// Asks for the first of the sectors that are missing in a line, from cycle `at` on, and says when and for which;
  /// returns when these are there.
  Cycle ask(L1& l1, std::uint64_t line, std::uint32_t& missing, SectorRun& run, Cycle& at) {
    run = take_sector_run(missing, std::min(sectors_of_a_line, timing_.l1_mshrs));
    at = l1.mshrs.free_from(at, run.count);
    const Cycle there = port_.access(traffic_.read(reads_.traffic, line, run), at);
    l1.mshrs.take(run.count, there);
    return there;
  }
  /// The same for a line of the L1; returns when.
  Cycle fill(L1& l1, const LineAccess& access, std::uint32_t& missing, std::array<Cycle, sectors_of_a_line>& line,
             Cycle at) {
    SectorRun run;
    const Cycle there = ask(l1, access.address, missing, run, at);
    l1.fills.ask(run.count, at, there);
    for (unsigned i = 0; i < run.count; ++i) line[run.first + i] = there;
    return at;
  }

  const AttributeFetch timing_;
  const AttributeTraffic traffic_;
  TimedMemoryPort port_;
  SectoredCacheStatistics& statistics_;
  const std::uint32_t cores_;
  std::vector<Cycle> answered_;  ///< the last writes, as many as may be in flight: a ring
  std::size_t turn_ = 0;
  struct Write {
    MemoryRequest request;
    Cycle shaded = 0;
  };
  Ring<Write> unsent_;
  std::vector<L1> l1s_;  ///< by core
  AttributeTraffic::FragmentReads reads_;
};

}  // namespace vrpipe
