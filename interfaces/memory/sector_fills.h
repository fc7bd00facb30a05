#pragma once

#include <cstdint>
#include <list>
#include <map>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include <vrpipe/kernel/clock_domain.h>
#include <vrpipe/kernel/ring.h>
#include <vrpipe/memory/cache_statistics.h>
#include <vrpipe/memory/memory_port.h>
#include <vrpipe/memory/timed_memory_port.h>

/// What a cache of unbounded capacity fetches from the memory below it: each sector that was neither read nor written
/// whole before, once, in a request of its own that keeps the origin of who asked. Nothing is written back.

namespace vrpipe {

/// At `lt`: the memory below says at once when a sector will be there.
class AnnotatedFills : private PortOwner {
 public:
  AnnotatedFills(ClockDomain& domain, CompulsoryMissStatistics& statistics);

  tlm::tlm_initiator_socket<32>& socket() { return memory_.socket; }
  /// The cycle in which all sectors of an access that arrives in a cycle are there; not before it arrives.
  Cycle filled(const MemoryRequest& request, Cycle arrival);

 private:
  struct Sector {
    Cycle asked = 0;
    Cycle there = 0;
  };
  TimedMemoryPort memory_;
  CompulsoryMissStatistics& statistics_;
  std::unordered_map<std::uint64_t, Sector> sectors_;  ///< by address / bytes of a sector
};

/// At `cycle`. Requests are looked up in the cycle after they arrive, in the order of the ports, so that the order in
/// which units tick does not matter.
class ClockedFills : public Clocked, private PortOwner {
 public:
  /// Where requests come from.
  class Port {
   public:
    virtual ~Port() = default;
    /// All sectors of a request that arrived are there, from a cycle on.
    virtual void filled(tlm::tlm_generic_payload& payload, Cycle from) = 0;
    /// Called in each of the cache's cycles, after all that is filled.
    virtual void respond() = 0;
  };
  ClockedFills(ClockDomain& domain, CompulsoryMissStatistics& statistics);

  tlm::tlm_initiator_socket<32>& socket() { return memory_.socket; }
  void attach(Port& port) { ports_.push_back(&port); }
  /// A request at a port, by the order of attachment, after an annotated delay.
  void arrive(unsigned port, tlm::tlm_generic_payload& payload, const sc_core::sc_time& delay);
  /// `respond` is to be called again.
  void wake() { clock.domain->wake(clock.unit, clock.domain->now() + 1); }

 private:
  struct Waiting {
    unsigned port;
    tlm::tlm_generic_payload* payload;
    unsigned fills;  ///< that it still waits for
  };
  using WaitingPlace = std::list<Waiting>::iterator;
  struct Fetch {
    std::uint64_t sector;
    MemoryOrigin origin;
  };
  Cycle tick(Cycle now) override;
  void finish_fills(Cycle now);
  void look_up(unsigned port, tlm::tlm_generic_payload& payload, Cycle arrival);
  void fetch();

  MemoryPort memory_;
  CompulsoryMissStatistics& statistics_;
  std::vector<Port*> ports_;
  std::multimap<std::pair<Cycle, unsigned>, tlm::tlm_generic_payload*> arrived_;  ///< by cycle and port
  std::list<Waiting> waiting_;
  std::unordered_set<std::uint64_t> there_;                                    ///< sectors
  std::unordered_map<std::uint64_t, std::vector<WaitingPlace>> on_their_way_;  ///< sectors, and who waits for each
  Ring<Fetch> fetches_;  ///< that the memory below has not taken yet
  std::vector<std::uint64_t> sector_of_tag_;
  std::vector<std::uint32_t> free_tags_;
};

}  // namespace vrpipe
