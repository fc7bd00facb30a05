#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "l2/sectored_l2.h"

#include <vrpipe/kernel/clock_crossing.h>
#include <vrpipe/kernel/clock_domain.h>
#include <vrpipe/kernel/ring.h>
#include <vrpipe/memory/bandwidth.h>
#include <vrpipe/memory/memory_port.h>
#include <vrpipe/model/memory_unit.h>
#include <vrpipe/model/occupancy.h>

namespace vrpipe {

/// The sectored L2 at `cycle`. A request waits at its port of the crossbar, by bank; each bank takes one at a time. There
/// it looks up its lines, starts their fills, and waits for them among the MSHRs; then its data takes its turn on the
/// way back. A bank whose request cannot go on, for want of an MSHR, a line or a place for what it evicts, takes no
/// other.
///
/// A request that arrives in cycle t and meets nobody is taken at t + 1, which counts as t, and answered at t + 1 +
/// latency; a fill leaves at t + 1. These are cycles of its own clock; each of its edges is taken in the first cycle of the
/// units that is not before it.
class ClockedL2 final : public sc_core::sc_module, public MemoryUnit, private Clocked, private PortOwner {
 public:
  /// @param ports  bytes a cycle of each
  ClockedL2(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<SectoredL2> behaviour,
            const std::vector<unsigned>& ports);
  ~ClockedL2() override;

  tlm::tlm_base_target_socket_b<32>& target(unsigned index) override;
  tlm::tlm_initiator_socket<32>* below() override { return &memory_.socket; }
  MemoryBytes delivered() const override { return behaviour_->delivered(); }
  MemoryBytes memory_bytes() const override { return memory_.moved(); }
  MemoryBehaviour& behaviour() override { return *behaviour_; }
  const StatisticSet& statistics() const override { return statistics_; }
  std::vector<OccupancyPart> parts(Cycle end) const override;

 private:
  class Port;
  static constexpr std::uint32_t nobody = ~0U;
  /// A request, or the part of it in one line.
  struct Request {
    MemoryRequest access;
    ClockedTarget::Asker asker;
    Cycle arrival = 0;
    std::uint32_t port = 0;
    std::uint32_t waits_for = 0;   ///< sectors of its line
    std::uint32_t next = nobody;   ///< in the same queue, or that waits for the same line
    std::uint32_t whole = nobody;  ///< what it is a part of; nobody if it is all
    std::uint32_t parts = 0;       ///< of a whole, that are not answered yet
    Cycle answered = 0;            ///< those that are
  };
  /// Requests, chained through `next`.
  struct Queue {
    std::uint32_t first = nobody;
    std::uint32_t last = nobody;
    void push(std::uint32_t request, std::vector<Request>& requests) {
      (first == nobody ? first : requests[last].next) = request;
      last = request;
    }
    void pop(std::vector<Request>& requests) { first = std::exchange(requests[first].next, nobody); }
  };
  struct Bank {
    Cycle free_at = 0;
    std::uint32_t turn = 0;  ///< the port that is asked first
    std::uint32_t mshrs = 0;
    std::uint32_t write_backs = 0;
    std::uint32_t queued = 0;  ///< requests, at all ports
    bool stuck = false;        ///< its request waits for a fill or the memory below
  };
  struct Below {
    MemoryRequest access;
    std::uint32_t bank = 0;
    SectoredCache::Line line = 0;
    std::uint32_t sectors = 0;
    Cycle since = 0;
    std::uint32_t request = nobody;  ///< that is served with it
  };

  Cycle tick(Cycle cycle) override;
  std::uint32_t make_request() {
    if (free_requests_.empty()) {
      free_requests_.push_back(static_cast<std::uint32_t>(requests_.size()));
      requests_.emplace_back();
    }
    const std::uint32_t made = free_requests_.back();
    free_requests_.pop_back();
    return made;
  }
  void queue(std::uint32_t request);
  void queue_at_bank(std::uint32_t request);
  [[gnu::noinline]] void queue_by_line(std::uint32_t request);
  Queue& queue_of(std::uint32_t bank, std::uint32_t port) { return queues_[bank * ports_.size() + port]; }
  /// Each of a bank or below returns when there is more to do, if nothing arrives; `never` for nothing.
  Cycle take_requests(Cycle now);
  Cycle ask_below();
  void finish_fills(Cycle now, Cycle after);
  /// The port whose first request for a bank has its turn, of those with room on their way in; nobody for none.
  std::uint32_t choose(std::uint32_t index, Cycle now) const;
  bool take_one(std::uint32_t index, Cycle now);
  /// Whether a request, of a line that is held or none, finds an MSHR, a line and a place for what that evicts, as far as it
  /// may need them.
  bool can_go_on(std::uint32_t index, const MemoryRequest& access, SectoredCache::Line line) const;
  /// Most requests: what they need is there.
  void hit(std::uint32_t index, std::uint32_t request, SectoredCache::Line line, std::uint32_t sectors, Cycle now);
  [[gnu::noinline]] void look_up(std::uint32_t index, std::uint32_t request, SectoredCache::Line line, Cycle now);
  [[gnu::noinline]] void pass(std::uint32_t index, std::uint32_t request, Cycle now);
  /// What a request needs is there in a cycle, of which a bank takes so many.
  void respond(std::uint32_t request, std::uint32_t cycles, Cycle from, Cycle now);
  [[gnu::noinline]] void respond(std::uint32_t request, Cycle from, Cycle now);
  [[gnu::noinline]] void respond_in_part(std::uint32_t whole, Cycle at);
  void occupy(std::uint32_t bank, std::uint32_t cycles, Cycle now);

  std::unique_ptr<SectoredL2> behaviour_;
  const ClockCrossing crossing_;
  const SectoredL2::Sizes sizes_;
  SectoredCache& cache_;
  Occupancy occupancy_;  ///< of the banks
  MemoryPort memory_;
  std::vector<std::unique_ptr<Port>> ports_;
  std::vector<Bank> banks_;
  std::uint64_t banks_with_requests_ = 0;  ///< a bit each
  std::uint32_t first_bank_ = 0;           ///< that found no room on its port's way in: it is asked first
  std::vector<Queue> queues_;              ///< by bank, then port
  std::vector<Request> requests_;
  std::vector<std::uint32_t> free_requests_;
  std::vector<std::uint32_t> waiting_;  ///< the first that waits for a line of the cache
  Ring<Below> reads_;                   ///< that the memory below has not taken
  Ring<Below> writes_;
  std::vector<Below> asked_;  ///< by tag
  std::vector<std::uint32_t> free_tags_;

  StatisticSet statistics_;
  Histogram queue_cycles_{statistics_, Histogram::Buckets::log2(), "queue_cycles", "cycles",
                          "that a request waits for its turn at a bank"};
  Histogram mshrs_used_{statistics_, Histogram::Buckets::log2(), "mshrs_used", "requests",
                        "of its bank that wait for fills when another one begins to"};
  Counter bank_stalls_{statistics_, "bank_stalls", "requests",
                       "that had to wait in a bank for an MSHR, a line or the memory below"};
};

}  // namespace vrpipe
