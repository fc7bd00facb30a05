#pragma once

#include <cstdint>
#include <string>

#include <systemc>
#include <tlm>

#include <vrpipe/kernel/clock_domain.h>
#include <vrpipe/kernel/ring.h>
#include <vrpipe/memory/memory_request.h>

namespace vrpipe {

class MemoryPort;

/// A memory that works in the cycles of a clock, and answers in them.
class ClockedMemory {
 public:
  virtual ~ClockedMemory() = default;
  virtual const ClockDomain& clock() const = 0;
  /// Whether its answers depend on anything but the requests and their cycles: on sc_time, or timers.
  virtual bool has_own_time() const { return false; }
};

/// Where a memory at `cycle` takes the requests of one initiator, in the phases of the base protocol, to answer them later in any
/// order. A MemoryPort that is bound to it with nothing in between calls it, and is called back, past the sockets; in the same
/// cycles.
class ClockedTarget : public ClockedMemory, public tlm::tlm_fw_transport_if<> {
 public:
  /// `domain` outlives it.
  ClockedTarget(const std::string& name, const ClockDomain& domain);

  tlm::tlm_target_socket<32, tlm::tlm_base_protocol_types, 1, sc_core::SC_ZERO_OR_MORE_BOUND> socket;

  const ClockDomain& clock() const final { return domain_; }
  /// Whom an answer is for: what waits at the socket, or with a tag at the port.
  struct Asker {
    tlm::tlm_generic_payload* payload = nullptr;
    std::uint32_t tag = 0;
  };
  /// A request of a port begins in this cycle. False if the next one has to wait until the port is told that it has ended.
  bool ask(const MemoryRequest& request, std::uint32_t tag, MemoryPort& port) {
    port_ = &port;
    return take(request, {nullptr, tag}, domain_.now());
  }

 protected:
  /// A request arrives in a cycle, now or later. False if `end_request` follows, before which there is no other.
  virtual bool take(const MemoryRequest& request, const Asker& asker, Cycle arrival) = 0;
  void end_request();
  /// Of a request that is complete in a cycle; sent by `send_answers`, in the order of these cycles, and later than `present`.
  void answer(const Asker& asker, Cycle at) { answers_.push_in_order({at, asker}, &Answer::at); }
  void send_answers(Cycle present);
  /// Both for one request.
  inline void respond(const Asker& asker, Cycle at, Cycle present);

 private:
  struct Answer {
    Cycle at = 0;
    Asker asker;
  };
  tlm::tlm_sync_enum nb_transport_fw(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                                     sc_core::sc_time& delay) override;
  void b_transport(tlm::tlm_generic_payload& payload, sc_core::sc_time& delay) override;
  bool get_direct_mem_ptr(tlm::tlm_generic_payload&, tlm::tlm_dmi&) override { return false; }
  unsigned transport_dbg(tlm::tlm_generic_payload&) override { return 0; }

  const ClockDomain& domain_;
  MemoryPort* port_ = nullptr;  ///< that calls past the socket
  Ring<Answer> answers_;        ///< not sent yet
  // At the socket:
  tlm::tlm_generic_payload* held_back_ = nullptr;  ///< BEGIN_REQ without END_REQ yet
  bool responding_ = false;                        ///< BEGIN_RESP without END_RESP yet
};

}  // namespace vrpipe
