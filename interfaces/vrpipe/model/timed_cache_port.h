#pragma once

#include <string>
#include <utility>

#include <vrpipe/memory/cache_statistics.h>
#include <vrpipe/memory/sectors.h>
#include <vrpipe/memory/timed_memory_port.h>
#include <vrpipe/model/timed.h>

namespace vrpipe {

/// The memory port of a sectored cache at `lt`: moves what a look-up says. Neighbouring sectors go in one access.
class TimedCachePort {
 public:
  /// @param mshrs        sectors that are filled at a time
  /// @param longest_run  sectors of an access at most
  /// @param statistics   of the cache; outlive it
  TimedCachePort(TimedUnit& owner, const std::string& name, unsigned mshrs, unsigned longest_run, unsigned sector_bytes,
                 SectoredCacheStatistics& statistics, MemoryOrigin origin)
      : memory_(owner, name, origin),
        fills_(statistics),
        mshrs_(mshrs),
        longest_run_(longest_run),
        sector_shift_(static_cast<unsigned>(__builtin_ctz(sector_bytes))) {}

  tlm::tlm_initiator_socket<32>& socket() { return memory_.socket; }
  const MemoryBytes& moved() const { return memory_.moved(); }

  /// Reads the sectors that a line does without, from `at` on, which becomes the cycle in which the last is asked for.
  /// Returns when that is there; `filled(first, count, cycle)` says so of all.
  template <class Filled>
  [[gnu::always_inline]] Cycle fill(const LineAccess& access, Cycle& at, Filled&& filled) {
    Cycle there = 0;
    // An access takes as many registers as are free, like CachePort's.
    for (std::uint32_t missing = access.filled; missing != 0;) {
      at = mshrs_.free_from(at, 1);
      const SectorRun run = take_sector_run(missing, mshrs_.free_at(at, longest_run_));
      there = ask(access.address, run.first, run.count, at);
      mshrs_.take(run.count, there);
      filled(run.first, run.count, there);
    }
    return there;
  }
  [[gnu::always_inline]] Cycle fill(const LineAccess& access, Cycle& at) {
    return fill(access, at, [](unsigned, unsigned, Cycle) {});
  }
  /// The same without registers, in a cycle that may be later than those of the next.
  Cycle fill_at_once(const LineAccess& access, Cycle at) {
    Cycle there = 0;
    for_each_sector_run(access.filled, longest_run_,
                        [&](unsigned sector, unsigned sectors) { there = ask(access.address, sector, sectors, at); });
    return there;
  }
  /// Writes the dirty sectors of an evicted line back.
  void write_back(const LineAccess& access, Cycle at) {
    for_each_sector_run(access.written_back, longest_run_, [&](unsigned sector, unsigned sectors) {
      memory_.write(access.old_address + (std::uint64_t{sector} << sector_shift_), sectors << sector_shift_, at);
      sectors_moved_ += sectors;
    });
  }
  /// Sectors, since this was last called.
  unsigned take_moved() { return std::exchange(sectors_moved_, 0); }

 private:
  Cycle ask(std::uint64_t line, unsigned sector, unsigned sectors, Cycle at) {
    const Cycle there = memory_.read(line + (std::uint64_t{sector} << sector_shift_), sectors << sector_shift_, at);
    fills_.ask(sectors, at, there);
    sectors_moved_ += sectors;
    return there;
  }

  TimedMemoryPort memory_;
  AnnotatedFillCounter fills_;
  SlotPool mshrs_;
  const unsigned longest_run_;
  const unsigned sector_shift_;
  unsigned sectors_moved_ = 0;
};

}  // namespace vrpipe
