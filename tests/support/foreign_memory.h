#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <utility>

#include <tlm_utils/peq_with_get.h>
#include <tlm_utils/simple_target_socket.h>
#include <systemc>
#include <tlm>

namespace foreign {

/// A DRAM as another project might write one: the base protocol of TLM-2.0 and times of its own, nothing of vrpipe's. It
/// takes a request after a time (back-pressure), answers as its banks are done (out of order), and refreshes for ever.
class Dram : public sc_core::sc_module {
 public:
  SC_HAS_PROCESS(Dram);
  Dram(const sc_core::sc_module_name& name, sc_core::sc_time accept, sc_core::sc_time row_hit,
       sc_core::sc_time row_miss)
      : sc_module(name),
        socket("socket"),
        accept_(accept),
        row_hit_(row_hit),
        row_miss_(row_miss),
        answers_("answers") {
    socket.register_b_transport(this, &Dram::b_transport);
    socket.register_nb_transport_fw(this, &Dram::nb_transport_fw);
    SC_THREAD(respond);
    SC_METHOD(end_request);
    sensitive << accepted_;
    dont_initialize();
    SC_METHOD(refresh);
  }
  tlm_utils::simple_target_socket<Dram> socket;

  /// Answers no request after so many.
  void fall_silent_after(std::uint64_t accesses) { silent_after_ = accesses; }
  void never_refresh() { refreshes_ = false; }
  void answer_with(tlm::tlm_response_status status) { status_ = status; }
  /// A response ends with END_RESP alone, whatever nb_transport_bw returns beside it, and the next one waits for it.
  void wait_for_end_resp() { waits_for_end_resp_ = true; }
  /// It takes a request when it has answered the one before.
  void take_one_at_a_time() { one_at_a_time_ = true; }
  std::uint64_t requests = 0, responses = 0, out_of_order = 0, refreshes = 0;

 private:
  sc_core::sc_time latency_of(std::uint64_t address, const sc_core::sc_time& arrival) {
    const std::uint64_t row = address / 1024;
    std::uint64_t& open_row = open_rows_[row % 4];
    const sc_core::sc_time latency = open_row == row ? row_hit_ : row_miss_;
    open_row = row;
    return latency + (arrival < refreshed_at_ ? refreshed_at_ - arrival : sc_core::SC_ZERO_TIME);
  }
  void b_transport(tlm::tlm_generic_payload& payload, sc_core::sc_time& delay) {
    ++requests;
    ++responses;
    delay += latency_of(payload.get_address(), sc_core::sc_time_stamp() + delay);
    payload.set_response_status(status_);
  }
  tlm::tlm_sync_enum nb_transport_fw(tlm::tlm_generic_payload& payload, tlm::tlm_phase& phase,
                                     sc_core::sc_time& delay) {
    if (phase == tlm::END_RESP) {
      responding_ = false;
      ended_.notify();
    }
    if (phase != tlm::BEGIN_REQ) return tlm::TLM_COMPLETED;
    payload.acquire();
    accepting_ = &payload;
    if (!one_at_a_time_ || waiting_.empty()) accepted_.notify(delay + accept_);
    return tlm::TLM_ACCEPTED;
  }
  void end_request() {
    tlm::tlm_generic_payload* const payload = std::exchange(accepting_, nullptr);
    waiting_.push_back(payload);
    if (requests++ < silent_after_) {
      answers_.notify(*payload, latency_of(payload->get_address(), sc_core::sc_time_stamp()));
    }
    tlm::tlm_phase phase = tlm::END_REQ;
    sc_core::sc_time delay;
    socket->nb_transport_bw(*payload, phase, delay);
  }
  void respond() {
    while (true) {
      wait(answers_.get_event());
      while (tlm::tlm_generic_payload* const payload = answers_.get_next_transaction()) {
        if (payload != waiting_.front()) ++out_of_order;
        waiting_.erase(std::find(waiting_.begin(), waiting_.end(), payload));
        ++responses;
        payload->set_response_status(status_);
        tlm::tlm_phase phase = tlm::BEGIN_RESP;
        sc_core::sc_time delay;
        responding_ = true;
        const tlm::tlm_sync_enum status = socket->nb_transport_bw(*payload, phase, delay);
        if (status == tlm::TLM_UPDATED && phase == tlm::END_RESP) responding_ = false;
        if (status == tlm::TLM_COMPLETED && !waits_for_end_resp_) responding_ = false;
        while (responding_) wait(ended_);
        payload->release();
        if (one_at_a_time_ && accepting_ != nullptr) accepted_.notify(accept_);
      }
    }
  }
  void refresh() {
    if (!refreshes_) return;
    ++refreshes;
    refreshed_at_ = sc_core::sc_time_stamp() + sc_core::sc_time(350, sc_core::SC_NS);
    next_trigger(3.9, sc_core::SC_US);
  }

  const sc_core::sc_time accept_, row_hit_, row_miss_;
  sc_core::sc_time refreshed_at_;
  sc_core::sc_event accepted_;
  tlm_utils::peq_with_get<tlm::tlm_generic_payload> answers_;
  tlm::tlm_generic_payload* accepting_ = nullptr;
  std::deque<tlm::tlm_generic_payload*> waiting_;     ///< for an answer, as they came
  std::map<std::uint64_t, std::uint64_t> open_rows_;  ///< by bank
  tlm::tlm_response_status status_ = tlm::TLM_OK_RESPONSE;
  std::uint64_t silent_after_ = ~std::uint64_t{0};
  bool refreshes_ = true, waits_for_end_resp_ = false, one_at_a_time_ = false;
  sc_core::sc_event ended_;  ///< a response
  bool responding_ = false;  ///< BEGIN_RESP without END_RESP yet
};

}  // namespace foreign
