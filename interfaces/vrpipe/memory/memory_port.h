#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <deque>
#include <initializer_list>
#include <memory>
#include <vector>

#include <systemc>
#include <tlm>

#include <vrpipe/kernel/clock_crossing.h>
#include <vrpipe/kernel/clock_domain.h>
#include <vrpipe/kernel/link.h>
#include <vrpipe/kernel/ring.h>
#include <vrpipe/memory/bandwidth.h>
#include <vrpipe/memory/cache_statistics.h>
#include <vrpipe/memory/clocked_target.h>
#include <vrpipe/memory/memory_request.h>

namespace vrpipe {

[[noreturn]] void fault_of_alignment(const sc_core::sc_object& port, Cycle now, std::uint64_t address, unsigned bytes);
[[noreturn]] void fault_of_response(const sc_core::sc_object& port, Cycle now, const tlm::tlm_generic_payload& access);

/// Throws SimulationFault naming the port, unless the access is naturally aligned and a power of two long.
inline void check_alignment(const sc_core::sc_object& port, Cycle now, std::uint64_t address, unsigned bytes) {
  if (bytes == 0 || ((address | bytes) & (bytes - 1)) != 0) fault_of_alignment(port, now, address, bytes);
}

/// Throws SimulationFault naming the port, if the memory answered an access with an error.
inline void check_response(const sc_core::sc_object& port, Cycle now, const tlm::tlm_generic_payload& access) {
  if (access.is_response_error()) fault_of_response(port, now, access);
}

/// One that says as soon as an access begins when it will be complete. A port that is bound to it with nothing in
/// between asks it directly instead of through the sockets, as with a direct memory interface; in the same cycles.
class EarlyCompletionMemory : public ClockedMemory {
 public:
  /// Takes an access that arrives in a cycle; returns the cycle in which it is complete. Accesses need not come in the
  /// order of their cycles: at `lt` units run ahead of the clock.
  virtual Cycle serve(const MemoryRequest& request, Cycle arrival) = 0;
  /// Whether it can say so. If not, it answers through the sockets.
  virtual bool completes_early() const { return true; }
};

/// The memory that a socket is bound to, if it completes early and counts the cycles of this clock; null otherwise.
EarlyCompletionMemory* early_completion_memory_of(tlm::tlm_initiator_socket<32>& socket, const ClockDomain& clock);
/// The same of one that answers later.
ClockedTarget* clocked_target_of(tlm::tlm_initiator_socket<32>& socket, const ClockDomain& clock);
/// Whether what a socket is bound to has time of its own, as everything may but a ClockedMemory.
bool meets_own_time(tlm::tlm_initiator_socket<32>& socket, const ClockDomain& clock);

/// An initiator on the unmodified TLM-2.0 base protocol, for timing only: payloads carry addresses and lengths, data
/// stays with the behaviours. Accesses are naturally aligned and a power of two long, checked in every build.
/// Understands early completion, annotated delays and all four phases, so that any memory model binds.
class MemoryPort : private tlm::tlm_bw_transport_if<>, private tlm::tlm_mm_interface, private OutsidePort {
 public:
  /// @param in_flight most accesses at a time
  /// @param origin    of reads and writes
  MemoryPort(PortOwner& owner, const std::string& name, unsigned in_flight, MemoryOrigin origin = {});
  ~MemoryPort() override;

  tlm::tlm_initiator_socket<32> socket;

  /// Whether another access can be issued now.
  bool available() const { return in_flight_ < most_in_flight_ && requesting_until_ <= clock_.domain->now(); }
  /// Issues an access, in an edge of its unit. Its tag comes back from `next_completed`.
  void read(std::uint64_t address, unsigned bytes, std::uint32_t tag) {
    access({address, bytes, tlm::TLM_READ_COMMAND, origin_}, tag);
  }
  void write(std::uint64_t address, unsigned bytes, std::uint32_t tag) {
    access({address, bytes, tlm::TLM_WRITE_COMMAND, origin_}, tag);
  }
  /// On behalf of another origin than the port's, as a cache does.
  void access(const MemoryRequest& request, std::uint32_t tag) {
    const Cycle now = clock_.domain->now();
    check_alignment(socket, now, request.address, request.bytes);
    ++in_flight_;
    moved_.count(request);
    if (memory_ != nullptr) return complete(std::max(memory_->serve(request, now), now + 1), tag);
    if (target_ == nullptr) return send(request, tag);
    if (!target_->ask(request, tag, *this)) requesting_until_ = never;
  }
  /// Takes the next access that has completed, in a cycle after the one in which it was answered; false for none.
  bool next_completed(std::uint32_t& tag) {
    if (next_completion_ > clock_.domain->now()) return false;
    tag = completions_.front().tag;
    completions_.pop();
    next_completion_ = completions_.empty() ? never : completions_.front().at;
    --in_flight_;
    return true;
  }
  /// Asked for so far.
  const MemoryBytes& moved() const { return moved_; }
  /// When the next known completion is due; `never` for none.
  Cycle next_completion() const { return next_completion_; }

  // For a ClockedTarget that is called past the socket.

  /// An access is complete in a cycle, later than now.
  void complete(Cycle at, std::uint32_t tag) {
    // Nearly always the last: memories answer in order.
    completions_.push_in_order({at, tag}, &Completion::at);
    if (at >= next_completion_) return;  // its unit comes for the earlier one, and asks again then
    next_completion_ = at;
    clock_.domain->wake(clock_.unit, at);
  }
  /// Another one may begin.
  void end_request() {
    // Whether or not an edge of the present time has been, or is to be: a unit that sleeps sees what one does that is awake.
    requesting_until_ = clock_.domain->edge_after(sc_core::SC_ZERO_TIME);
    clock_.domain->wake(clock_.unit, requesting_until_);
  }

 private:
  struct Access : tlm::tlm_generic_payload {
    std::uint32_t tag = 0;
    std::vector<unsigned char> data;
    bool pending = false;  ///< not answered yet
    Cycle since = 0;
    MemoryRequestExtension* extension = nullptr;  ///< the payload's
  };
  struct Completion {
    Cycle at;
    std::uint32_t tag;
  };
  Access* unused_access();
  [[gnu::noinline]] void send(const MemoryRequest& request, std::uint32_t tag);
  void answer(Access& access, const sc_core::sc_time& delay);
  tlm::tlm_sync_enum nb_transport_bw(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                                     sc_core::sc_time& delay) override;
  void invalidate_direct_mem_ptr(sc_dt::uint64, sc_dt::uint64) override {}
  /// The last holder of a payload, port or memory, has released it.
  void free(tlm::tlm_generic_payload* payload) override;
  bool meets_own_time() override;
  Unanswered oldest_unanswered() const override;

  const ClockHandle clock_;
  std::deque<Access> accesses_;  ///< as many as were ever in use at a time; free once answered and no longer held
  std::vector<Access*> free_accesses_;
  Access* next_access_ = nullptr;            ///< for the next request; null before the first
  EarlyCompletionMemory* memory_ = nullptr;  ///< if it can be asked directly
  ClockedTarget* target_ = nullptr;          ///< the same of one that answers later
  const MemoryOrigin origin_;
  const unsigned most_in_flight_;
  unsigned in_flight_ = 0;
  MemoryBytes moved_;
  Ring<Completion> completions_;  ///< by cycle
  Cycle next_completion_ = never;
  const Access* requesting_ = nullptr;  ///< BEGIN_REQ without END_REQ yet
  /// `never` until then; after a late END_REQ, the next cycle: the order of ticks does not matter.
  Cycle requesting_until_ = 0;
};

[[gnu::always_inline]] inline void ClockedTarget::respond(const Asker& asker, Cycle at, Cycle present) {
  if (asker.payload == nullptr) return port_->complete(std::max(at, present + 1), asker.tag);
  answer(asker, at);
  send_answers(present);
}

/// Whether a memory has another one below it, and how it asks that.
enum class MemoryBelow : std::uint8_t {
  none,
  annotated,  ///< at `lt`: by calls of b_transport, which annotates its time
  clocked,    ///< at `cycle`: in the phases of the base protocol
};

class AnnotatedFills;
class ClockedFills;

/// From request to data, in cycles. An L2 has slices near by and others, and of either some that are nearer still and some that
/// are farther: an address is of the slice that parities of its bits say.
struct MemoryLatency {
  // NOLINTNEXTLINE(google-explicit-constructor): the same for all
  MemoryLatency(std::uint32_t cycles) : far(cycles), near(cycles) {}
  /// `slice_spread`: below the others.
  MemoryLatency(std::uint32_t far_cycles, std::uint32_t near_cycles, std::uint32_t more_of_color,
                std::uint32_t slice_spread)
      : far(far_cycles), near(near_cycles), color(more_of_color), spread(slice_spread) {}
  std::uint32_t far;
  std::uint32_t near;        ///< of the other half of the addresses
  std::uint32_t color = 0;   ///< CROP's accesses, on top
  std::uint32_t spread = 0;  ///< that a quarter of either half takes less, and a quarter more
  std::uint32_t of(const MemoryRequest& request) const {
    const std::uint32_t more = request.origin.traffic == MemoryTraffic::color ? color : 0;
    return more + (near == far && spread == 0 ? far : of_slice(request.address));
  }
  /// The least of all.
  std::uint32_t least() const { return std::min(near, far) - spread; }
  /// Of tiles of 1 KB in a row, by bits of their number (measured on a GH100 graphics GPC, all 1024 of them).
  static bool is_near(std::uint64_t address) { return parity(address, {1, 4, 8}) != 0; }

 private:
  std::uint32_t of_slice(std::uint64_t address) const {
    return (is_near(address) ? near : far) + static_cast<std::uint32_t>(steps_of(address)) * spread;
  }
  /// -1, 0 or 1: how its slice lies to the mean of its half. Says three quarters of the variance of those tiles.
  static int steps_of(std::uint64_t address) {
    constexpr std::array<int, 8> steps{0, -1, 1, 0, -1, 0, 0, -1};
    const int step =
        steps[parity(address, {2, 7}) | parity(address, {0, 8}) << 1U | parity(address, {1, 4, 8, 9}) << 2U];
    return parity(address, {4, 6, 8}) != 0 ? -step : step;
  }
  /// Of some bits of the number of its tile.
  static unsigned parity(std::uint64_t address, std::initializer_list<unsigned> bits) {
    std::uint64_t mask = 0;
    for (const unsigned bit : bits) mask |= std::uint64_t{1} << (10 + bit);
    return static_cast<unsigned>(__builtin_parityll(address & mask));
  }
};

/// A memory that answers every access after its latency; each port moves a number of bytes per cycle. Ports may stay
/// unbound.
///
/// With a memory below it, it is a cache of unbounded capacity, which has compulsory misses only. What is read, or
/// written in part, is fetched from below a sector at a time unless it is there or on its way already; the request
/// leaves a cycle after the access has arrived, and keeps its origin. Then the access is served as if it arrived when
/// the last of its sectors came. A write of whole sectors needs no fill, nothing is written back, and an access to what
/// is there takes as long as without a memory below. Any number of fills may be under way.
class FixedLatencyMemory : public sc_core::sc_module, public StatisticSet {
 public:
  /// Of a fill.
  static constexpr unsigned sector_bytes = 32;

  /// @param domain  outlives it
  FixedLatencyMemory(const sc_core::sc_module_name& name, ClockDomain& domain, MemoryLatency latency,
                     unsigned bytes_per_cycle, unsigned ports, MemoryBelow below = MemoryBelow::none);
  /// @param bytes_per_cycle  of each port
  /// @param period_ps        of a clock of its own, in whose cycles these are; 0 for the domain's
  FixedLatencyMemory(const sc_core::sc_module_name& name, ClockDomain& domain, MemoryLatency latency,
                     const std::vector<unsigned>& bytes_per_cycle, MemoryBelow below = MemoryBelow::none,
                     std::uint64_t period_ps = 0);
  ~FixedLatencyMemory() override;
  /// Each port is for one initiator.
  tlm::tlm_base_target_socket_b<32>& port(unsigned index);
  /// To be bound to the memory below. Throws std::logic_error if it was made to have none.
  tlm::tlm_initiator_socket<32>& below();
  /// Moved in all, or before cycle `end`.
  std::uint64_t bytes(Cycle end = never) const;
  /// Bytes per cycle of the domain of all ports.
  double peak_rate() const;
  /// Of all ports.
  const MemoryTrafficCounters& traffic() const { return traffic_; }
  /// With a memory below it.
  const CompulsoryMissStatistics& cache() const { return cache_; }

 private:
  class MemoryTarget;
  const ClockDomain& domain_;
  const ClockCrossing crossing_;
  const MemoryLatency latency_;
  MemoryTrafficCounters traffic_;
  CompulsoryMissStatistics cache_{*this, "cache"};
  std::unique_ptr<AnnotatedFills> annotated_;  ///< of MemoryBelow::annotated
  std::unique_ptr<ClockedFills> clocked_;      ///< of MemoryBelow::clocked
  std::vector<std::unique_ptr<MemoryTarget>> ports_;
};

/// For a memory port that may stay unconnected, before the end of elaboration: binds its socket, if nothing was bound to
/// it, to a memory that is never asked. Null if something was.
std::unique_ptr<FixedLatencyMemory> stub_unbound(tlm::tlm_initiator_socket<32>& socket, ClockDomain& domain);

}  // namespace vrpipe
