#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "l2/sectored_l2.h"

#include <vrpipe/kernel/clock_crossing.h>
#include <vrpipe/kernel/clock_domain.h>
#include <vrpipe/memory/bandwidth.h>
#include <vrpipe/memory/memory_port.h>
#include <vrpipe/memory/place_reservation.h>
#include <vrpipe/memory/timed_memory_port.h>
#include <vrpipe/model/memory_unit.h>

namespace vrpipe {

/// The sectored L2 at `lt`: it is looked up in the order of the calls, and says at once when an access is
/// complete. It counts in the cycles of its own clock. Ports, banks, their MSHRs and their places for what is evicted are reserved in time. A bank whose request
/// has to wait for one takes no other meanwhile.
class AnnotatedL2 final : public sc_core::sc_module, public MemoryUnit, private PortOwner {
 public:
  AnnotatedL2(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<SectoredL2> behaviour,
              const std::vector<unsigned>& ports);
  ~AnnotatedL2() override;

  tlm::tlm_base_target_socket_b<32>& target(unsigned index) override;
  tlm::tlm_initiator_socket<32>* below() override { return &memory_.socket; }
  MemoryBytes delivered() const override { return behaviour_->delivered(); }
  MemoryBytes memory_bytes() const override { return memory_.moved(); }
  MemoryBehaviour& behaviour() override { return *behaviour_; }
  const StatisticSet& statistics() const override { return statistics_; }
  /// The limits are measured: benchmarks/lt_errors.
  Order order(Cycle end, bool is_bottleneck) const override;
  std::vector<OccupancyPart> parts(Cycle end) const override;

 private:
  class Port;
  /// When a sector of a line of the cache was asked for from below, and is there.
  struct Fill {
    Cycle asked = 0;
    Cycle there = 0;
  };
  struct Bank {
    static std::uint32_t most(std::uint32_t places) { return std::min(places, 65535U); }
    Bank(const SectoredL2::Sizes& sizes, std::size_t ports)
        : of_port(ports, BandwidthReservation(1)), mshrs(most(sizes.mshrs)), write_backs(most(sizes.write_backs)) {}
    BandwidthReservation time{1};               ///< whole cycles
    std::vector<BandwidthReservation> of_port;  ///< of what waits, as if each had the bank for itself
    PlaceReservation mshrs, write_backs;
    Cycle stuck_until = 0;     ///< by requests that waited for places: it takes no other then
    std::uint64_t cycles = 0;  ///< in which it moves bytes
  };
  /// Whether a request needs sectors of a line that are on their way in a cycle.
  static bool awaits(const Fill* fills, std::uint32_t sectors, Cycle at);
  /// Writes what a line held that goes; returns the bytes.
  std::uint64_t write_back(const LineAccess& done, Bank& bank, Cycle at);
  /// Keeps a bank for a port for so many cycles from one on, and for the time until `begin` before; the first in which they
  /// are over.
  Cycle occupy(Bank& bank, unsigned port, Cycle from, Cycle begin, std::uint32_t cycles) {
    const auto waits = begin > from ? static_cast<unsigned>(begin - from - bank.time.reserved_between(from, begin)) : 0;
    bank.cycles += cycles;
    const Cycle over = bank.time.take(from, waits + cycles, now());
    bank.stuck_until = std::max(bank.stuck_until, waits > 0 ? begin : 0);
    if (!takes_turns_ || over <= from + 2 * cycles) return over;
    // Behind those of its own that wait, each with one of another port, and no longer, though as much of the bank's time has been
    // taken: who comes later waits for that.
    return std::min(over, bank.of_port[port].take(std::max(from, bank.stuck_until), 2 * cycles, now()));
  }
  /// What a request waits for that does not find all that it needs.
  struct Wait {
    Cycle begin;          ///< its bank has what it needs to go on
    Cycle all_there;      ///< its data
    std::uint64_t moved;  ///< bytes, by its bank
  };
  /// Of what was looked up.
  Wait fetch(const MemoryRequest& access, const LineAccess& done, Bank& bank, Cycle arrival);
  /// Of a request in one line.
  struct Served {
    Cycle from;   ///< its bank has begun on it
    Cycle there;  ///< the first cycle in which it has its data
  };
  Served look_up(const MemoryRequest& access, unsigned port, Cycle arrival);
  /// One that did not find all that it needs; its own bytes take the bank so many cycles.
  [[gnu::noinline]] Served wait(const MemoryRequest& access, const LineAccess& done, unsigned port, Cycle arrival,
                                std::uint32_t cycles);
  /// One that goes below without a look-up, and is served when that has it.
  Served pass(const MemoryRequest& access, unsigned port, Cycle arrival);
  /// The present.
  Cycle now() const { return crossing_.edge_of(clock.domain->now()); }
  /// An access to the memory below.
  Cycle access_below(const MemoryRequest& access, Cycle at) {
    return crossing_.edge_of(memory_.access(access, crossing_.cycle_of(at)));
  }
  /// Writes to the memory below, from a cycle on.
  Cycle write(const MemoryRequest& access, Bank& bank, Cycle at);

  std::unique_ptr<SectoredL2> behaviour_;
  const ClockCrossing crossing_;
  const SectoredL2::Sizes& sizes_;
  const bool takes_turns_;  ///< ports do, at a bank
  SectoredCache& cache_;
  TimedMemoryPort memory_;
  std::vector<std::unique_ptr<Port>> ports_;
  std::vector<Bank> banks_;
  std::vector<Fill> fills_;  ///< by line of the cache and sector
  AnnotatedFillCounter counted_fills_;
  Cycle quickest_write_ = never;  ///< below, in cycles: what takes longer waits for its turn
  Cycle quickest_read_ = never;
  std::uint64_t reads_ = 0, read_cycles_ = 0;
  StatisticSet statistics_;
};

}  // namespace vrpipe
