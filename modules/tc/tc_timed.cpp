#include <vrpipe/timed.h>

namespace vrpipe {

namespace {

/// TC at lt and at. Ports as in tc_unit.cpp.
class TimedTc : public TimedUnit {
 public:
  TimedTc(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<TcBehaviour> behaviour,
          Transport transport)
      : TimedUnit(name, domain, transport),
        out_(*this, "out_bins"),
        in_(*this, "in_quads", [this](const QuadBeat& beat, Cycle visible) { return collect(beat, visible); }, {&out_}),
        behaviour_(std::move(behaviour)),
        cost_(behaviour_->cost()),
        entries_(cost_.quads_per_cycle),
        sent_at_(cost_.flush_queue_bins, 0) {
    out_.set_pipeline(cost_.latency_cycles - 1, 1);
  }

  std::uint64_t work() const override { return taken_; }
  double peak_rate() const override { return cost_.quads_per_cycle; }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  using Reason = TcBehaviour::FlushReason;

  Cycle collect(const QuadBeat& beat, Cycle visible) {
    flush_idle(visible);
    if (beat.end_of_draw) return drain(visible);
    charge(UnitState::starved, visible);
    Cycle at = visible;
    for (unsigned from = 0; from < beat.count;) {
      bool flushed = false;
      const unsigned taken = behaviour_->insert(beat, from, bin_, flushed);
      at = entries_.take(std::max(visible, sent_at_[place_]), taken);
      from += taken;
      if (flushed) send(at);
    }
    taken_ += beat.count;
    holds_quads_ = true;
    last_arrival_ = at;
    charge(UnitState::blocked, at);
    charge(UnitState::busy, at + 1);
    return at;
  }

  /// Hands on the bin flushed in a cycle, a beat a cycle.
  void send(Cycle flushed) {
    Cycle at = std::max({flushed, sent_, out_.last()}) + 1;
    QuadBeat beat;
    beat.tile = bin_.tile;
    for (std::size_t sent = 0; sent < bin_.quads.size();) {
      const std::size_t left = bin_.quads.size() - sent;
      beat.count = static_cast<std::uint8_t>(std::min<std::size_t>(left, cost_.quads_per_cycle));
      std::copy_n(bin_.quads.begin() + static_cast<std::ptrdiff_t>(sent), beat.count, beat.quads.begin());
      sent += beat.count;
      beat.last_of_bin = sent == bin_.quads.size();
      sent_ = out_.send(beat, at);
      at = sent_ + 1;
    }
    sent_at_[place_] = sent_;
    place_ = place_ + 1 == sent_at_.size() ? 0 : place_ + 1;
  }

  Cycle timeout_due() const {
    if (cost_.idle_timeout_cycles == 0 || !holds_quads_) return never;
    return std::max({last_arrival_ + cost_.idle_timeout_cycles, timed_out_ + 1, sent_at_[place_]});
  }

  /// Flushes the bins whose time is out before a quad comes.
  void flush_idle(Cycle next_arrival) {
    for (Cycle due = timeout_due(); due < next_arrival && !out_.blocked(); due = timeout_due()) {
      if (!behaviour_->flush_oldest(Reason::timed_out, bin_)) {
        holds_quads_ = false;
        return;
      }
      charge(UnitState::starved, due);
      charge(UnitState::busy, due + 1);
      timed_out_ = due;
      send(due);
    }
  }

  Cycle drain(Cycle visible) {
    Cycle at = visible + 1;
    while (behaviour_->flush_oldest(Reason::end_of_draw, bin_)) {
      at = std::max(at, sent_at_[place_]);
      send(at++);
    }
    holds_quads_ = false;
    QuadBeat end;
    end.end_of_draw = true;
    out_.send(end, std::max(at, sent_ + 1));
    return visible;
  }

  Cycle tick(Cycle now) override {
    const Cycle next = TimedUnit::tick(now);
    if (in_.empty()) flush_idle(now + 1);
    return out_.blocked() ? next : std::min(next, std::max(timeout_due(), now + 1));
  }

  TimedOut<QuadBeat> out_;
  TimedIn<QuadBeat> in_;
  std::unique_ptr<TcBehaviour> behaviour_;
  const TcBehaviour::Cost cost_;
  TcBehaviour::Flush bin_;
  Flow entries_;
  std::vector<Cycle> sent_at_;  ///< the last beat of the last bins, a ring
  std::size_t place_ = 0;       ///< of the bin that has to have gone before the next is flushed
  Cycle sent_ = 0;              ///< the last beat
  Cycle last_arrival_ = 0;
  Cycle timed_out_ = 0;
  bool holds_quads_ = false;
  std::uint64_t taken_ = 0;
};

[[maybe_unused]] const bool registered = [] {
  register_timed_unit_maker("tc", [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                                     const RenderState&, unsigned, Transport transport) {
    return std::make_unique<TimedTc>(name.c_str(), domain, behaviour_as<TcBehaviour>(std::move(behaviour)), transport);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
