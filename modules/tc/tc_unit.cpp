#include <deque>

#include "tc/tc.h"

#include <vrpipe/model/unit.h>

namespace vrpipe {

namespace {

/// TC at cycle fidelity: takes quads at its rate, hands flushed bins to PROP at the same rate.
/// Ports: in_quads (QuadBeat), out_bins (QuadBeat).
class TcUnit : public Unit {
 public:
  TcUnit(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<TcBehaviour> behaviour,
         const RenderContext& context)
      : Unit(name, domain, behaviour->time().kinds()),
        in_(*this, "in_quads"),
        out_(*this, "out_bins"),
        behaviour_(std::move(behaviour)),
        passing_(context),
        time_(behaviour_->time()),
        idle_timeout_cycles_(time_.timeout_in(context.termination)),
        time_out_gate_(context, "tc.time_out"),
        queue_(time_.flush_queue_bins) {
    out_.set_pipeline(time_.pipeline());
  }

  bool idle() const override { return in_.empty() && queued_ == 0 && mark_ == Mark::none && !holds_quads_; }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  using Flush = TcBehaviour::Flush;
  bool has_room() const { return queued_ < time_.flush_queue_bins; }
  Flush& next_place() { return queue_[first_ + queued_ - (first_ + queued_ < queue_.size() ? 0 : queue_.size())]; }

  bool collect(Cycle now) {
    bool moved = false;
    for (unsigned budget = time_.quads_per_cycle; budget > 0 && mark_ == Mark::none && in_.ready() && has_room();) {
      const QuadBeat& beat = in_.front();
      if (beat.mark != Mark::none) {
        mark_ = beat.mark;
        in_.pop();
        return true;
      }
      bool flushed = false;
      unsigned taken = 0;
      if (beat.count - from_ <= budget) {
        taken = behaviour_->insert(beat, from_, next_place(), flushed);
      } else {
        QuadBeat part = beat;
        part.count = static_cast<std::uint8_t>(from_ + budget);
        taken = behaviour_->insert(part, from_, next_place(), flushed);
      }
      if (flushed) ++queued_;
      from_ += taken;
      did(TcWork::quads, taken, now);
      budget -= taken;
      holds_quads_ = true;
      last_arrival_ = now;
      moved = true;
      if (from_ == beat.count) {
        in_.pop();
        from_ = 0;
      }
    }
    return moved;
  }

  bool flush_idle_or_ending(Cycle now) {
    if (!has_room()) return false;
    if (mark_ != Mark::none && !drained_) {
      if (behaviour_->flush_oldest(TcBehaviour::FlushReason::end_of_draw, next_place())) {
        ++queued_;
      } else {
        drained_ = true;
        holds_quads_ = false;
      }
      return true;
    }
    if (mark_ == Mark::none && holds_quads_ && timeout_due() <= now) {
      if (!time_out_gate_.enter()) {
        idle_timeout_cycles_ = 0;
        return false;
      }
      if (behaviour_->flush_oldest(TcBehaviour::FlushReason::timed_out, next_place())) {
        ++queued_;
      } else {
        holds_quads_ = false;
      }
      return true;
    }
    return false;
  }

  Cycle timeout_due() const {
    return idle_timeout_cycles_ == 0 || !holds_quads_ ? never : last_arrival_ + idle_timeout_cycles_;
  }

  /// Once all bins before the mark have gone; false while there is no room for it.
  [[gnu::noinline]] bool pass_mark() {
    if (passing_.has(mark_)) {
      if (out_.credits() == 0) return false;
      QuadBeat beat;
      beat.mark = mark_;
      out_.push(beat);
    }
    mark_ = Mark::none;
    drained_ = false;
    return true;
  }

  bool send(Cycle now) {
    if (queued_ == 0) return drained_ && pass_mark();
    if (out_.credits() == 0) return false;
    const Flush& flush = queue_[first_];
    QuadBeat beat;
    beat.tile = flush.tile;
    const auto left = static_cast<unsigned>(flush.quads.size()) - sent_;
    beat.count = static_cast<std::uint8_t>(std::min(left, time_.quads_per_cycle));
    std::copy_n(flush.quads.begin() + sent_, beat.count, beat.quads.begin());
    sent_ += beat.count;
    beat.last_of_bin = sent_ == flush.quads.size();
    out_.push(beat);
    did(TcWork::beats, 1, now);
    if (beat.last_of_bin) {
      first_ = first_ + 1 == queue_.size() ? 0 : first_ + 1;
      --queued_;
      sent_ = 0;
    }
    return true;
  }

  Cycle tick(Cycle now) override {
    const bool sent = send(now);
    const bool collected = collect(now);
    const bool flushed = flush_idle_or_ending(now);
    if (sent || collected || flushed) {
      enter(UnitState::busy, now);
      return now + 1;
    }
    if (queued_ > 0 || drained_) {
      enter(UnitState::blocked, now);
      return has_room() && mark_ == Mark::none ? std::min(in_.next_ready(), timeout_due()) : never;
    }
    enter(UnitState::starved, now);
    return std::min(in_.next_ready(), timeout_due());
  }

  StreamIn<QuadBeat> in_;
  StreamOut<QuadBeat> out_;
  std::unique_ptr<TcBehaviour> behaviour_;
  const PassingMarks passing_;
  const TcTime time_;
  std::uint32_t idle_timeout_cycles_;  ///< 0: never
  EffectGate time_out_gate_;
  std::vector<Flush> queue_;  ///< flushed bins, a ring
  unsigned first_ = 0;
  unsigned queued_ = 0;
  unsigned sent_ = 0;  ///< quads of the first bin
  unsigned from_ = 0;  ///< quads taken of the beat at the head
  bool holds_quads_ = false;
  Mark mark_ = Mark::none;  ///< that has arrived
  bool drained_ = false;    ///< and all bins before it are flushed
  Cycle last_arrival_ = 0;
};

[[maybe_unused]] const bool tc_unit_registered = [] {
  register_unit_maker("tc", [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                               const RenderContext& context, unsigned) {
    return std::make_unique<TcUnit>(name.c_str(), domain, behaviour_as<TcBehaviour>(std::move(behaviour)), context);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
