#include <algorithm>
#include <deque>
#include <utility>

#include "tc/tc.h"

#include <vrpipe/model/timed.h>

namespace vrpipe {

namespace {

/// TC at lt: as tc_unit.cpp, but a flushed bin goes in one piece.
/// Ports: in_quads (QuadBeat), out_bins (BinItem).
class TimedTc : public TimedUnit {
 public:
  TimedTc(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<TcBehaviour> behaviour,
          const RenderContext& context)
      : TimedUnit(name, domain, behaviour->time().kinds()),
        out_(*this, "out_bins"),
        in_(*this, "in_quads",
            [this](const QuadBeat& beat, CycleInterval visible) -> CycleInterval {
              const Cycle at = collect(beat, visible.last);
              return {at - (visible.last - visible.first), at};  // each part as it came
            }),
        behaviour_(std::move(behaviour)),
        passing_(context),
        time_(behaviour_->time()),
        idle_timeout_cycles_(time_.timeout_in(context.termination)),
        time_out_gate_(context, "tc.time_out"),
        entries_(time_.quads_per_cycle),
        sent_at_(time_.flush_queue_bins, 0) {
    out_.set_pipeline(time_.pipeline());
  }

  Behaviour& behaviour() override { return *behaviour_; }

 private:
  using Reason = TcBehaviour::FlushReason;

  Cycle collect(const QuadBeat& beat, Cycle visible) {
    flush_idle(visible);
    if (beat.mark != Mark::none) return drain(beat.mark, visible);
    charge(UnitState::starved, visible);
    Cycle at = visible;
    for (unsigned from = 0; from < beat.count;) {
      bool flushed = false;
      const unsigned taken = behaviour_->insert(beat, from, next_storage().flush, flushed);
      at = entries_.take(std::max(visible, place_free_at()), taken).last;
      from += taken;
      if (flushed) send(at);
    }
    did(TcWork::quads, beat.count, at);
    last_arrival_ = at;
    if (!std::exchange(holds_quads_, true) && timeout_due() != never)
      clock.domain->wake(clock.unit, std::max(timeout_due(), now() + 1));
    charge(UnitState::blocked, at);
    charge(UnitState::busy, at + 1);
    return at;
  }

  /// A place for the next bin.
  BinStorage& next_storage() {
    if (next_storage_->in_use) find_storage();
    return *next_storage_;
  }
  void find_storage() {
    for (std::size_t tried = 0; tried < storage_.size(); ++tried) {
      storage_at_ = storage_at_ + 1 == storage_.size() ? 0 : storage_at_ + 1;
      next_storage_ = &storage_[storage_at_];
      if (!next_storage_->in_use) return;
    }
    storage_at_ = storage_.size();
    next_storage_ = &storage_.emplace_back();
  }

  /// Hands on the bin flushed in a cycle.
  void send(Cycle flushed) {
    BinStorage& storage = next_storage();
    storage.in_use = true;
    BinItem item;
    item.storage = &storage;
    item.tile = storage.flush.tile;
    item.quads = static_cast<std::uint32_t>(storage.flush.quads.size());
    item.beats = (item.quads + time_.quads_per_cycle - 1) / time_.quads_per_cycle;
    const Cycle begin = std::max({flushed, sent_, out_.last()}) + 1;
    sent_ = out_.send(item, {begin, begin + item.beats - 1}, item.beats).last;
    did(TcWork::beats, item.beats, sent_);
    sent_at_[place_] = sent_;
    place_ = place_ + 1 == sent_at_.size() ? 0 : place_ + 1;
  }

  /// When the bin has gone whose place the next takes.
  Cycle place_free_at() const { return sent_at_[place_]; }

  Cycle timeout_due() const {
    if (idle_timeout_cycles_ == 0 || !holds_quads_) return never;
    return std::max({last_arrival_ + idle_timeout_cycles_, timed_out_ + 1, place_free_at()});
  }

  /// Flushes the bins whose time is out before a quad comes.
  void flush_idle(Cycle next_arrival) {
    if (next_arrival <= last_arrival_ + idle_timeout_cycles_) return;
    for (Cycle due = timeout_due(); due < next_arrival; due = timeout_due()) {
      if (!time_out_gate_.enter()) {
        idle_timeout_cycles_ = 0;
        return;
      }
      if (!behaviour_->flush_oldest(Reason::timed_out, next_storage().flush)) {
        holds_quads_ = false;
        return;
      }
      charge(UnitState::starved, due);
      charge(UnitState::busy, due + 1);
      timed_out_ = due;
      send(due);
    }
  }

  /// Whether quads come or not.
  Cycle tick(Cycle now) override {
    flush_idle(now + 1);
    return timeout_due();
  }

  Cycle drain(Mark mark, Cycle visible) {
    Cycle at = visible + 1;
    while (behaviour_->flush_oldest(Reason::end_of_draw, next_storage().flush)) {
      at = std::max(at, place_free_at());
      send(at++);
    }
    holds_quads_ = false;
    if (!passing_.has(mark)) return visible;
    BinItem item;
    item.mark = mark;
    out_.send(item, std::max({at, sent_ + 1, out_.last() + 1}));
    return visible;
  }

  TimedOut<BinItem> out_;
  TimedIn<QuadBeat> in_;
  std::unique_ptr<TcBehaviour> behaviour_;
  const PassingMarks passing_;
  const TcTime time_;
  std::uint32_t idle_timeout_cycles_;  ///< 0: never
  EffectGate time_out_gate_;
  std::deque<BinStorage> storage_ = std::deque<BinStorage>(1);
  std::size_t storage_at_ = 0;
  BinStorage* next_storage_ = &storage_[0];
  ThroughputPort entries_;
  std::vector<Cycle> sent_at_;  ///< the last beat of the last bins, a ring
  std::size_t place_ = 0;       ///< of the bin that has to have gone before the next is flushed
  Cycle sent_ = 0;              ///< the last beat
  Cycle last_arrival_ = 0;
  Cycle timed_out_ = 0;
  bool holds_quads_ = false;
};

[[maybe_unused]] const bool tc_timed_registered = [] {
  register_timed_unit_maker("tc", [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                                     const RenderContext& context, unsigned) {
    return std::make_unique<TimedTc>(name.c_str(), domain, behaviour_as<TcBehaviour>(std::move(behaviour)), context);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
