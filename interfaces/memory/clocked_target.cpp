#include <vrpipe/memory/clocked_target.h>

#include <algorithm>
#include <utility>

#include <vrpipe/component/error.h>
#include <vrpipe/memory/memory_port.h>

namespace vrpipe {

ClockedTarget::ClockedTarget(const std::string& name, const ClockDomain& domain)
    : socket(name.c_str()), domain_(domain) {
  socket.bind(*this);
}

void ClockedTarget::end_request() {
  if (held_back_ == nullptr) return port_->end_request();
  tlm::tlm_phase phase = tlm::END_REQ;
  sc_core::sc_time delay = sc_core::SC_ZERO_TIME;
  socket->nb_transport_bw(*std::exchange(held_back_, nullptr), phase, delay);
}

void ClockedTarget::send_answers(Cycle present) {
  while (!answers_.empty() && !responding_) {
    const auto [done, asker] = answers_.front();
    answers_.pop();
    const Cycle at = std::max(done, present + 1);
    if (asker.payload == nullptr) {
      port_->complete(at, asker.tag);
      continue;
    }
    auto delay = sc_core::sc_time::from_value((at - present) * domain_.period().value());
    tlm::tlm_phase phase = tlm::BEGIN_RESP;
    asker.payload->set_response_status(tlm::TLM_OK_RESPONSE);
    responding_ = true;  // until the initiator says otherwise, perhaps from within the call
    if (socket->nb_transport_bw(*asker.payload, phase, delay) != tlm::TLM_ACCEPTED) responding_ = false;
    asker.payload->release();
  }
}

tlm::tlm_sync_enum ClockedTarget::nb_transport_fw(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                                                  sc_core::sc_time& delay) {
  // Also from outside an edge, by what has time of its own.
  const Cycle present = domain_.edge_after(sc_core::SC_ZERO_TIME) - 1;
  if (phase == tlm::END_RESP) {
    responding_ = false;
    send_answers(present);
    return tlm::TLM_COMPLETED;
  }
  if (phase != tlm::BEGIN_REQ) return tlm::TLM_ACCEPTED;  // ignorable ones of the initiator's
  payload.acquire();
  if (!take(request_of(payload), {&payload, 0}, present + domain_.whole_cycles(delay))) {
    held_back_ = &payload;
    return tlm::TLM_ACCEPTED;
  }
  phase = tlm::END_REQ;
  return tlm::TLM_UPDATED;
}

void ClockedTarget::b_transport(tlm::tlm_generic_payload&, sc_core::sc_time&) {
  throw SimulationFault(socket.name(), domain_.now(), "b_transport at cycle, where it may have to wait");
}

}  // namespace vrpipe
