#include "dram/clocked_dram.h"

#include <algorithm>
#include <string>
#include <utility>

#include <vrpipe/component/error.h>
#include <vrpipe/kernel/ring.h>

namespace vrpipe {

class ClockedDram::Port final : public ClockedTarget {
 public:
  static constexpr std::uint32_t nobody = ~0U;
  Port(unsigned index, ClockedDram& dram)
      : ClockedTarget("port_" + std::to_string(index), dram.domain_), dram_(dram), index_(index) {}

  std::vector<Waiting>& waiting() { return waiting_; }
  /// Of the requests `left` have entered the queues of their channels. What leaves in a cycle leaves room from the next
  /// on, so that the order of ticks does not matter.
  void leave(std::size_t left, Cycle now) {
    left_ = left;
    left_at_ = now;
  }
  /// Whether a request that was held up can be let in.
  bool admits() const { return held_ != nobody && waiting_.size() <= dram_.settings_.port_requests; }
  void admit() {
    held_ = nobody;
    end_request();
  }
  /// Of a request that is done: one that was held up ends with it.
  void answer(std::uint32_t tag, const Asker& asker, Cycle at) {
    if (tag == held_) admit();
    ClockedTarget::answer(asker, at);
  }
  using ClockedTarget::send_answers;

 private:
  bool take(const MemoryRequest& request, const Asker& asker, Cycle arrival) override {
    const Cycle present = clock().edge_after(sc_core::SC_ZERO_TIME) - 1;
    last_arrival_ = std::max(last_arrival_, arrival);
    check_alignment(socket, arrival, request.address, request.bytes);
    dram_.behaviour_.count(request);
    const unsigned bursts = dram_.settings_.bursts(request.bytes);
    const bool reads = request.command != tlm::TLM_WRITE_COMMAND;
    const std::uint32_t tag = dram_.take(index_, asker, last_arrival_, bursts, reads);
    const std::size_t left = left_at_ == present ? left_ : 0;
    const bool has_room = waiting_.size() + left < dram_.settings_.port_requests;
    waiting_.push_back({tag, request.address, static_cast<std::uint16_t>(bursts), 0});
    dram_.domain_.wake(dram_.handle_, last_arrival_ + 1);
    if (has_room) return true;
    ++dram_.statistics.requests_held;
    held_ = tag;
    return false;
  }

  ClockedDram& dram_;
  const unsigned index_;
  std::vector<Waiting> waiting_;
  std::uint32_t held_ = nobody;  ///< the request that has not ended yet: the last that came
  Cycle last_arrival_ = 0;
  Cycle left_at_ = never;
  std::size_t left_ = 0;
};

ClockedDram::ClockedDram(const sc_core::sc_module_name& name, ClockDomain& domain, Dram& behaviour, unsigned ports)
    : sc_module(name),
      domain_(domain),
      handle_(domain.attach(*this)),
      behaviour_(behaviour),
      settings_(behaviour.settings()),
      clock_(domain, settings_.tck_ps, settings_.controller_ps),
      data_(domain.frame_end(), clock_),
      due_(settings_.channels, never) {
  for (unsigned index = 0; index < settings_.channels; ++index)
    channels_.emplace_back(settings_.timing, statistics.channels, behaviour_.refresh_gate()).tell(data_);
  for (unsigned index = 0; index < ports; ++index) ports_.push_back(std::make_unique<Port>(index, *this));
}

ClockedDram::~ClockedDram() = default;

tlm::tlm_base_target_socket_b<32>& ClockedDram::port(unsigned index) { return ports_.at(index)->socket; }

std::uint32_t ClockedDram::take(unsigned port, const ClockedTarget::Asker& asker, Cycle arrived, unsigned bursts,
                                bool reads) {
  if (free_tags_.empty()) {
    free_tags_.push_back(static_cast<std::uint32_t>(pending_.size()));
    pending_.emplace_back();
  }
  const std::uint32_t tag = free_tags_.back();
  free_tags_.pop_back();
  pending_[tag] = {asker, arrived, 0, static_cast<std::uint16_t>(port), static_cast<std::uint16_t>(bursts), reads};
  return tag;
}

Cycle ClockedDram::tick(Cycle now) {
  const Cycle edge = clock_.edge_of(now);
  for (const auto& port : ports_) {
    if (port->admits()) port->admit();
  }
  Cycle next = never;
  // Whose turn it is to be first changes from cycle to cycle.
  const std::size_t count = ports_.size();
  const std::size_t first = count < 2 ? 0 : now % count;
  for (std::size_t i = 0; i < count; ++i) {
    Port& port = *ports_[first + i < count ? first + i : first + i - count];
    next = std::min(next, enter(port, now, edge));
    if (port.admits()) next = now + 1;
  }
  for (std::size_t index = 0; index < channels_.size(); ++index) {
    if (due_[index] > now) {
      next = std::min(next, due_[index]);
      continue;
    }
    DramChannel& channel = channels_[index];
    channel.advance(edge);
    collect(channel);
    due_[index] = never;
    if (!channel.awaits_reads()) continue;
    // The next data is not seen earlier, and is to be answered in a cycle before.
    due_[index] = std::max(now + 1, clock_.seen(channel.next_command() + channel.data_cycles()) - 1);
    next = std::min(next, due_[index]);
  }
  for (const auto& port : ports_) port->send_answers(now);
  return next;
}

Cycle ClockedDram::enter(Port& port, Cycle now, Cycle edge) {
  std::vector<Waiting>& waiting = port.waiting();
  std::uint64_t full = 0;
  Cycle again = never;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < waiting.size(); ++i) {
    const Cycle arrived = pending_[waiting[i].tag].arrived;
    if (arrived >= now) again = std::min(again, arrived + 1);
    if (arrived < now && enter(waiting[i], now, edge, full)) continue;
    waiting[kept++] = waiting[i];
  }
  port.leave(waiting.size() - kept, now);
  waiting.resize(kept);
  for (; full != 0; full &= full - 1) {
    DramChannel& channel = channels_[static_cast<unsigned>(__builtin_ctzll(full))];
    again = std::min(again, std::max(now + 1, clock_.after(channel.next_command())));
  }
  return again;
}

bool ClockedDram::enter(Waiting& waiting, Cycle now, Cycle edge, std::uint64_t& full) {
  Pending& pending = pending_[waiting.tag];
  for (; waiting.entered < waiting.bursts; ++waiting.entered) {
    const DramAddress place = settings_.map.place_of(waiting.address + waiting.entered * settings_.burst_bytes);
    // Requests for a channel do not overtake one another, and so stay in order where they are for the same bytes.
    if ((full >> place.channel & 1U) != 0) return false;
    DramChannel& channel = channels_[place.channel];
    channel.advance(edge);
    if (!(pending.reads ? channel.can_read() : channel.can_write())) {
      full |= std::uint64_t{1} << place.channel;
      return false;
    }
    if (pending.reads) {
      channel.read(place, waiting.tag, edge);
    } else {
      channel.write(place, edge);
      --pending.bursts;
      pending.done = edge;
    }
    due_[place.channel] = now;
  }
  if (!pending.reads) answer(waiting.tag);
  return true;
}

void ClockedDram::collect(DramChannel& channel) {
  for (Ring<DramChannel::Completion>& done = channel.completions(); !done.empty(); done.pop()) {
    Pending& pending = pending_[done.front().tag];
    pending.done = std::max(pending.done, done.front().at);
    if (--pending.bursts > 0) continue;
    statistics.read_latency.see(std::max(clock_.seen(pending.done), domain_.now() + 1) - pending.arrived);
    answer(done.front().tag);
  }
}

void ClockedDram::answer(std::uint32_t tag) {
  const Pending& pending = pending_[tag];
  ports_[pending.port]->answer(tag, pending.asker, clock_.seen(pending.done));
  free_tags_.push_back(tag);
}

void ClockedDram::close(Cycle end) {
  const Cycle edge = clock_.edge_of(end);
  for (DramChannel& channel : channels_) {
    channel.advance(edge);
    channel.close(edge);
  }
  statistics.channels.data_cycles += data_.cycles(end);
}

}  // namespace vrpipe
