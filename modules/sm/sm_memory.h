#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "attribute_traffic.h"

#include <vrpipe/kernel/ring.h>
#include <vrpipe/memory/memory_port.h>
#include <vrpipe/memory/sectored_cache.h>

namespace vrpipe {

/// What an SM array has to do with memory at cycle: the reads and writes of vertex warps, and an L1 for each core through
/// which fragment warps read attributes. Warps are called by their slots: vertex slots, and those of fragments.
///
/// Reads of vertices are sent at once. Attributes are written without waiting for an answer; `attribute_writes` may be
/// without one, and what comes behind them waits. Fills are sent as a warp is looked up, which waits while all miss
/// registers of its core are taken, or no line of its set can go: one whose fill is on its way stays. Where cores have
/// no L1s, a warp asks for all that it reads. So does one that reads colour: what an L1 held of it would be stale.
class SmMemory {
 public:
  SmMemory(PortOwner& owner, const RenderContext& context, const SmTime& time, SectoredCacheStatistics& statistics)
      : timing_(time.fetch),
        traffic_(context, time.fetch),
        port_(owner, "memory",
              time.vertex_warps * AttributeTraffic::most_vertex_reads + timing_.attribute_writes +
                  time.cores * timing_.l1_mshrs),
        statistics_(statistics),
        reads_left_(time.vertex_warps, 0),
        writes_left_(time.vertex_warps, 0),
        fills_awaited_(time.fragment_slots(), 0),
        cores_(time.cores) {}

  tlm::tlm_initiator_socket<32>& socket() { return port_.socket; }
  /// Before the first access.
  void connect() {
    for (std::uint32_t core = 0; core < cores_; ++core) l1s_.emplace_back(timing_, statistics_);
  }
  const MemoryBytes& moved() const { return port_.moved(); }
  Cycle next_completion() const { return port_.next_completion(); }
  /// Whether attributes wait for those before them.
  bool holds_writes() const { return !writes_.empty(); }

  /// Asks for what a vertex warp reads; `finish` says when it is there.
  void fetch_vertices(std::uint32_t slot, const VertexWarp& warp) {
    traffic_.read_vertices(warp, [&](const MemoryRequest& request) {
      reads_.push({request, slot});
      ++reads_left_[slot];
    });
  }
  /// And for what it writes; `send` says when it has been sent. False if it is nothing.
  bool write_attributes(std::uint32_t slot, const VertexWarp& warp) {
    traffic_.write_attributes(warp, [&](const MemoryRequest& request) {
      writes_.push({traffic_.in_buffer(request), slot});
      ++writes_left_[slot];
    });
    return writes_left_[slot] > 0;
  }

  /// Begins to look a fragment warp up in the L1 of a core.
  void begin_look_up(std::uint32_t slot, std::uint32_t core, const Warp& warp) {
    traffic_.find_reads(warp, look_up_);
    core_ = core;
    slot_ = slot;
    at_ = 0;
    seen_ = 0;
  }
  /// Goes on with it; false while it has to wait.
  bool look_up(Cycle now) {
    L1& l1 = l1s_[core_];
    if (!l1.cache || look_up_.traffic != MemoryTraffic::attribute) return ask_for_all(l1, now);
    SectoredCache& cache = *l1.cache;
    std::uint64_t sectors = 0;
    for (; at_ < look_up_.count; ++at_, seen_ = 0) {
      const AttributeTraffic::LineSectors& needed = look_up_.lines[at_];
      SectoredCache::Line line = cache.find(needed.address);
      if (line == SectoredCache::no_line) {
        if (!cache.can_allocate(needed.address)) return false;
        SectoredCache::Evicted clean;
        line = cache.allocate(needed.address, clean);
      }
      if (!look_up_line(l1, needed, line, now)) return false;
      cache.looked_up(line, needed.sectors);
    }
    for (unsigned i = 0; i < look_up_.count; ++i) {
      sectors += static_cast<unsigned>(__builtin_popcount(look_up_.lines[i].sectors));
    }
    cache.accessed(look_up_.count, sectors);
    return true;
  }
  /// Fills that a looked-up warp waits for.
  std::uint32_t fills_awaited(std::uint32_t slot) const { return fills_awaited_[slot]; }

  /// Takes what has been answered: calls `fetched_vertices(slot)` and `fetched_attributes(slot)` for warps whose last
  /// answer that was.
  template <class FetchedVertices, class FetchedAttributes>
  void finish(Cycle now, FetchedVertices&& fetched_vertices, FetchedAttributes&& fetched_attributes) {
    std::uint32_t tag = 0;
    while (port_.next_completed(tag)) {
      if (tag == write_tag) {
        --writes_in_flight_;
      } else if ((tag & vertex_tag) != 0) {
        const std::uint32_t slot = tag & ~vertex_tag;
        if (--reads_left_[slot] == 0) fetched_vertices(slot);
      } else {
        finish_fill(tag, now, fetched_attributes);
      }
    }
  }

  /// Sends what waits; calls `written(slot)` for a vertex warp whose last write that was.
  template <class Written>
  void send(Written&& written) {
    for (; !reads_.empty() && port_.available(); reads_.pop()) {
      port_.access(reads_.front().request, vertex_tag | reads_.front().slot);
    }
    while (!writes_.empty() && port_.available() && writes_in_flight_ < timing_.attribute_writes) {
      const VertexAccess access = writes_.front();
      writes_.pop();
      port_.access(access.request, write_tag);
      ++writes_in_flight_;
      if (--writes_left_[access.slot] == 0) written(access.slot);
    }
  }

 private:
  static constexpr std::uint32_t write_tag = ~0U;
  static constexpr std::uint32_t vertex_tag = 1U << 31;
  static constexpr std::uint32_t none = ~0U;
  static constexpr unsigned sectors_of_a_line = AttributeTraffic::line_bytes / AttributeTraffic::sector_bytes;

  struct VertexAccess {
    MemoryRequest request;
    std::uint32_t slot = 0;
  };
  /// Of a core.
  struct L1 {
    L1(const AttributeFetch& timing, SectoredCacheStatistics& statistics)
        : free_mshrs(timing.l1_mshrs), fills(timing.l1.lines()) {
      if (timing.has_l1()) cache.emplace(timing.l1, statistics);
    }
    std::optional<SectoredCache> cache;                               ///< none where memory has it all
    std::uint32_t free_mshrs;                                         ///< sectors
    std::vector<std::array<std::uint32_t, sectors_of_a_line>> fills;  ///< by line and sector, of those on their way
  };
  /// Neighbouring sectors of a line that were asked for together.
  struct Fill {
    std::uint32_t core = 0;
    SectoredCache::Line line = SectoredCache::no_line;  ///< of the L1, if it goes there
    SectorRun sectors;
    std::uint32_t waiters = none;  ///< a chain
    Cycle asked = 0;
  };
  struct Waiter {
    std::uint32_t slot = 0;
    std::uint32_t next = none;
  };

  /// As `look_up`, without an L1 or past it.
  bool ask_for_all(L1& l1, Cycle now) {
    for (; at_ < look_up_.count; ++at_, seen_ = 0) {
      const AttributeTraffic::LineSectors& needed = look_up_.lines[at_];
      for (std::uint32_t left = needed.sectors & ~seen_; left != 0;) {
        std::uint32_t fill = none;
        if (!ask(l1, needed, left, SectoredCache::no_line, now, fill)) return false;
      }
    }
    return true;
  }
  /// Asks for the first of the missing sectors of a line, for which the warp then waits; false if that has to wait.
  bool ask(L1& l1, const AttributeTraffic::LineSectors& needed, std::uint32_t& missing, SectoredCache::Line line,
           Cycle now, std::uint32_t& fill) {
    if (l1.free_mshrs == 0 || !port_.available()) return false;
    const SectorRun run = take_sector_run(missing, l1.free_mshrs);
    fill = new_fill({core_, line, run, none, now});
    l1.free_mshrs -= run.count;
    seen_ |= sector_mask(run.first, run.count);
    await(fill);
    port_.access(traffic_.read(look_up_.traffic, needed.address, run), fill);
    return true;
  }

  /// Goes on with a line; sectors once seen are not looked at again.
  bool look_up_line(L1& l1, const AttributeTraffic::LineSectors& needed, SectoredCache::Line line, Cycle now) {
    for (std::uint32_t coming = needed.sectors & l1.cache->filling(line) & ~seen_; coming != 0;) {
      const std::uint32_t fill = l1.fills[line][static_cast<unsigned>(__builtin_ctz(coming))];
      const SectorRun run = fills_[fill].sectors;
      coming &= ~sector_mask(run.first, run.count);
      seen_ |= sector_mask(run.first, run.count);
      await(fill);
    }
    std::uint32_t missing = needed.sectors & l1.cache->absent(line) & ~seen_;
    while (missing != 0) {
      std::uint32_t fill = none;
      if (!ask(l1, needed, missing, line, now, fill)) return false;
      const SectorRun run = fills_[fill].sectors;
      l1.cache->start_fill(line, sector_mask(run.first, run.count));
      for (unsigned sector = run.first; sector < run.first + run.count; ++sector) l1.fills[line][sector] = fill;
      l1.cache->pin(line);
    }
    return true;
  }

  template <class FetchedAttributes>
  void finish_fill(std::uint32_t index, Cycle now, FetchedAttributes&& fetched_attributes) {
    const Fill fill = fills_[index];
    free_fills_.push_back(index);
    L1& l1 = l1s_[fill.core];
    l1.free_mshrs += fill.sectors.count;
    if (fill.line != SectoredCache::no_line) {
      const std::uint32_t sectors = sector_mask(fill.sectors.first, fill.sectors.count);
      l1.cache->finish_fill(fill.line, sectors);
      statistics_.see_fill(sectors, now - fill.asked);
      l1.cache->unpin(fill.line);
    }
    for (std::uint32_t waiter = fill.waiters; waiter != none;) {
      const Waiter waiting = waiters_[waiter];
      free_waiters_.push_back(waiter);
      if (--fills_awaited_[waiting.slot] == 0) fetched_attributes(waiting.slot);
      waiter = waiting.next;
    }
  }

  std::uint32_t new_fill(const Fill& fill) { return put(fill, fills_, free_fills_); }
  void await(std::uint32_t fill) {
    ++fills_awaited_[slot_];
    fills_[fill].waiters = put({slot_, fills_[fill].waiters}, waiters_, free_waiters_);
  }
  template <class Entry>
  static std::uint32_t put(const Entry& entry, std::vector<Entry>& entries, std::vector<std::uint32_t>& free) {
    if (free.empty()) {
      free.push_back(static_cast<std::uint32_t>(entries.size()));
      entries.emplace_back();
    }
    const std::uint32_t index = free.back();
    free.pop_back();
    entries[index] = entry;
    return index;
  }

  const AttributeFetch timing_;
  const AttributeTraffic traffic_;
  MemoryPort port_;
  SectoredCacheStatistics& statistics_;
  Ring<VertexAccess> reads_;   ///< to be sent
  Ring<VertexAccess> writes_;  ///< to be sent
  std::uint32_t writes_in_flight_ = 0;
  std::vector<std::uint32_t> reads_left_;     ///< by vertex slot: not answered
  std::vector<std::uint32_t> writes_left_;    ///< by vertex slot: not sent
  std::vector<std::uint32_t> fills_awaited_;  ///< by fragment slot
  const std::uint32_t cores_;
  std::vector<L1> l1s_;      ///< by core
  std::vector<Fill> fills_;  ///< as many as were ever on their way at a time
  std::vector<std::uint32_t> free_fills_;
  std::vector<Waiter> waiters_;
  std::vector<std::uint32_t> free_waiters_;
  // The warp that is looked up.
  AttributeTraffic::FragmentReads look_up_;
  std::uint32_t core_ = 0;
  std::uint32_t slot_ = 0;
  unsigned at_ = 0;         ///< the line that is looked up next
  std::uint32_t seen_ = 0;  ///< its sectors that were looked up, of those that were not there
};

}  // namespace vrpipe
