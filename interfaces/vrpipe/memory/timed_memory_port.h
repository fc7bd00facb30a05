#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <systemc>
#include <tlm>

#include <vrpipe/kernel/clock_domain.h>
#include <vrpipe/kernel/link.h>
#include <vrpipe/memory/memory_port.h>
#include <vrpipe/memory/memory_request.h>

namespace vrpipe {

/// An initiator on the TLM-2.0 base protocol, for timing only, whose accesses are b_transport calls that return when the
/// data is there. The memory must annotate its time, not wait: units are not threads.
class TimedMemoryPort : private tlm::tlm_bw_transport_if<>, private OutsidePort {
 public:
  /// @param origin  of reads and writes
  TimedMemoryPort(PortOwner& owner, const std::string& name, MemoryOrigin origin = {});
  ~TimedMemoryPort() override;

  tlm::tlm_initiator_socket<32> socket;

  /// An access in cycle `at`; returns the cycle in which it is complete. It may be far ahead of the clock, or behind it:
  /// what has waited for its time, as an update of the z-cache does, is only looked up when something comes after it.
  Cycle read(std::uint64_t address, unsigned bytes, Cycle at) {
    return access({address, bytes, tlm::TLM_READ_COMMAND, origin_}, at);
  }
  Cycle write(std::uint64_t address, unsigned bytes, Cycle at) {
    return access({address, bytes, tlm::TLM_WRITE_COMMAND, origin_}, at);
  }
  /// On behalf of another origin than the port's, as a cache does.
  Cycle access(const MemoryRequest& request, Cycle at) {
    check_alignment(socket, at, request.address, request.bytes);
    moved_.count(request);
    return memory_ == nullptr ? send(request, at) : memory_->serve(request, at);
  }
  /// Asked for so far.
  const MemoryBytes& moved() const { return moved_; }

 private:
  [[gnu::noinline]] Cycle send(const MemoryRequest& request, Cycle at);
  tlm::tlm_sync_enum nb_transport_bw(tlm::tlm_generic_payload&, tlm::tlm_phase&, sc_core::sc_time&) override {
    return tlm::TLM_ACCEPTED;
  }
  void invalidate_direct_mem_ptr(sc_dt::uint64, sc_dt::uint64) override {}

  bool meets_own_time() override;
  Unanswered oldest_unanswered() const override { return {}; }

  const ClockHandle clock_;
  EarlyCompletionMemory* memory_ = nullptr;  ///< if it can be asked directly
  const MemoryOrigin origin_;
  MemoryBytes moved_;
  MemoryRequestExtension* const extension_;  ///< the payload's
  tlm::tlm_generic_payload payload_;
  std::vector<unsigned char> data_;  ///< empty before the first access
};

}  // namespace vrpipe
