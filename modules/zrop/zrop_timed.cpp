#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "zrop/block_time.h"
#include "zrop/hi_z_reports.h"
#include "zrop/late_quads.h"
#include "zrop/timed_z_cache.h"

#include <vrpipe/model/timed.h>
#include <vrpipe/pipeline/late_plan.h>
#include <vrpipe/pipeline/slots/tc.h>
#include <vrpipe/pipeline/slots/zrop.h>

namespace vrpipe {

namespace {

/// ZROP at lt. Updates go first, so that the cycle of one is known when it arrives; a test applies those of its
/// past. Late tests, too, go first: they come long before their time, and what they take of the z-cache's one port is
/// kept for the tests that are to make way. With the memory port connected, quads and updates are looked up in the z-cache first
/// (timed_z_cache.h).
/// Ports: in_quads, out_quads (BinItem), in_terminations (TerminationBeat), in_late, out_late (ShadedWarpItem; optional),
/// out_hi_z (HiZUpdate; optional), memory (TLM-2.0 base protocol; optional).
class TimedZrop : public TimedUnit {
 public:
  TimedZrop(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<ZropBehaviour> behaviour,
            const RenderContext& context)
      : TimedUnit(name, domain, behaviour->time().kinds()),
        context_(context),
        plan_(context),
        out_(*this, "out_quads"),
        out_hi_z_(*this, "out_hi_z"),
        out_late_(*this, "out_late"),
        out_reads_(*this, "out_reads"),
        in_terminations_(*this, "in_terminations",
                         [this](const TerminationBeat& beat, CycleInterval visible) {
                           return update(beat, visible.first);
                         }),
        in_late_(*this, "in_late",
                 [this](const ShadedWarpItem& item, CycleInterval visible) { return test_late(item, visible.first); }),
        in_(*this, "in_quads", [this](const BinItem& item, CycleInterval visible) { return test(item, visible); }),
        behaviour_(std::move(behaviour)),
        time_(behaviour_->time()),
        tests_(time_.quads_per_cycle),
        late_tests_(time_.quads_per_cycle),
        updates_(time_.updates_per_cycle),
        z_(*this, out_reads_, time_, context.placement, cache_statistics_),
        z_cache_gate_(context, "zrop.z_cache"),
        blocks_(time_.blocks),
        block_time_(time_.quads_per_cycle,
                    [this](std::uint64_t work, Cycle from, Cycle until) { did(ZropWork::blocks, work, from, until); }),
        hi_z_(context) {
    out_.set_pipeline(time_.pipeline());
    out_hi_z_.set_pipeline(time_.pipeline());
    if (!EffectGate(context, "cache.details").is_active()) cache_statistics_.leave_out_details();
    out_hi_z_.set_optional();
    out_late_.set_pipeline(time_.pipeline());
    out_late_.set_optional();
    in_late_.set_optional();
    in_terminations_.set_comes_ahead();
    in_late_.set_comes_ahead();
    out_reads_.set_optional();
  }

  Behaviour& behaviour() override { return *behaviour_; }
  tlm::tlm_initiator_socket<32>* memory_socket() override { return &z_.socket(); }
  bool memory_is_optional() const override { return true; }
  MemoryBytes memory_bytes() const override { return z_.moved(); }

  void close_account(Cycle end) override {
    if (has_cache_) look_up_updates(never);
    while (!pending_.empty()) apply_update();
    make_way(never);
    block_time_.settle(never);
    TimedUnit::close_account(end);
  }

 private:
  struct Pending {
    TerminationSignal signal;
    Cycle at = 0;
  };
  struct LateTest {
    unsigned quads = 0;
    Cycle at = 0;
  };

  void before_end_of_elaboration() override {
    no_memory_ = stub_unbound(z_.socket(), *clock.domain);
    has_cache_ = no_memory_ == nullptr && z_cache_gate_.is_active();
    lacks_cache_ = no_memory_ == nullptr && !has_cache_;
    if (!has_cache_) return;
    const DepthStencilSurface* const surface = behaviour_->surface();
    if (surface == nullptr) throw SimulationFault(this->name(), 0, "no depth-stencil surface is attached");
    z_.make_cache(*surface);
  }

  Cycle update(const TerminationBeat& beat, Cycle visible) {
    Cycle at = visible;
    for (unsigned i = 0; i < beat.count; ++i) {
      at = updates_.take(has_cache_ ? z_.room_for_update(visible) : visible);
      if (has_cache_) z_.expect(beat.signals[i], at);
      (has_cache_ ? arrived_ : pending_).push({beat.signals[i], at});
    }
    return at;
  }

  /// Updates that have arrived up to a cycle. They come long before their time, so they wait for it.
  [[gnu::noinline]] void look_up_updates(Cycle until) {
    for (; !arrived_.empty() && arrived_.front().at <= until; arrived_.pop()) {
      const TerminationSignal signal = arrived_.front().signal;
      const Cycle at = z_.update(signal, arrived_.front().at);
      if (foreseen_ > 0) {
        --foreseen_;
      } else {
        pending_.push({signal, at});
      }
      note_moves();
    }
  }
  /// Updates that have arrived up to a test, also those that come behind its look-up, which may be long before: they are
  /// looked up behind beats that are not here yet.
  [[gnu::noinline]] void foresee_updates(Cycle test) {
    for (; foreseen_ < arrived_.size() && arrived_[foreseen_].at <= test; ++foreseen_) {
      const Pending& update = arrived_[foreseen_];
      pending_.push({update.signal, z_.foreseen(update.signal, update.at)});
    }
  }
  void note_moves() {
    if (const auto [at, cycles] = z_.take_moves(); cycles > 0) {
      for (unsigned cycle = 0; cycle < cycles; ++cycle) moves_.push(at);
    }
  }

  CycleInterval test(const BinItem& incoming, CycleInterval visible) {
    BinItem item = incoming;
    tests_.hold(out_.last());
    charge(UnitState::blocked, out_.last());
    if (item.mark != Mark::none) {
      const Cycle at = tests_.take(1, visible.first);
      if (plan_.waits_at(item.mark)) return send_around(item, at);
      if (has_cache_) look_up_updates(at);
      pass(item.mark, at);
      const Cycle taken = out_.send(item, at).first;
      tests_.hold(taken);
      // What they are caused by has gone before.
      if (has_cache_ && item.mark == Mark::end_of_frame) look_up_updates(never);
      return {at, taken};
    }
    std::vector<Quad>& quads = item.storage->flush.quads;
    const unsigned total = item.quads;
    const unsigned of_beat = width_.of(item.quads, item.beats);
    const unsigned parts = count_parts(quads, total, of_beat);
    CycleInterval tested(never, 0);
    CycleInterval left(never, 0);
    CycleInterval looked_up(never, 0);
    // All are of one state.
    const DrawState* const state = total > 0 ? &context_.state(quads.front().draw) : nullptr;
    if (lacks_cache_ && state != nullptr) z_cache_gate_.enter();
    const bool needs_stencil = has_cache_ && state != nullptr && state->reads_depth_stencil_early();
    const bool may_change = needs_stencil && state->tests_early() && state->writes_depth_stencil();
    const bool hi_z = total > 0 && hi_z_.wanted(quads.front().draw);
    QuadBeat beat;
    beat.tile = item.tile;
    item.quads = item.beats = 0;
    for (unsigned part = 0, from = 0, end = 0; part < parts; ++part, from = end) {
      end = end_of_part(quads, from, total, of_beat);
      beat.count = static_cast<std::uint8_t>(end - from);
      beat.last_of_bin = item.last_part && part + 1 == parts;
      std::copy_n(quads.begin() + from, beat.count, beat.quads.begin());
      Cycle ready = visible.of_part(part, parts);
      if (has_cache_) {
        const bool begins = from % of_beat == 0;
        ready = look_up(beat, ready, begins ? std::min(of_beat, total - from) : 0, needs_stencil, looked_up);
      }
      const Cycle at = take(ready, beat.count);
      if (has_cache_) z_.tested(needs_stencil, at);
      const unsigned tested_quads = beat.count;
      port_free_at_ = time_.end_of_tests(at, tested_quads);
      if (blocks_.is_on()) pay_for_blocks(beat, at);
      did(ZropWork::tests, tested_quads, at, port_free_at_);
      QuadBeat before;
      if (may_change || hi_z || tells_draws()) before = beat;
      const std::uint32_t changed = behaviour_->test(beat);
      if (may_change && changed != 0) {
        z_.change(before, changed, at);
        note_moves();
      }
      if (hi_z && changed != 0) tell(before, changed, at);
      if (beat.count < tested_quads) end_quads(before, tested_quads, at + time_.latency_cycles);
      tested.first = std::min(tested.first, at);
      tested.last = at;
      // A part without survivors goes no further, but for the mark that closes the bin.
      if (beat.count == 0 && !beat.last_of_bin) continue;
      std::copy_n(beat.quads.begin(), beat.count, quads.begin() + item.quads);
      item.quads += beat.count;
      left.first = std::min(left.first, at);
      left.last = at;
      ++item.beats;
    }
    if (has_cache_) {
      charge(UnitState::starved, looked_up.first);
      charge(UnitState::memory, tested.first);
    }
    charge(UnitState::starved, tested.first);
    if (item.beats == 0 && !item.last_part) {
      item.storage->in_use = false;
      return has_cache_ ? looked_up : tested;
    }
    const CycleInterval taken = out_.send(item, left, item.beats);
    charge(UnitState::busy, port_free_at_);
    charge(UnitState::blocked, taken.last);
    tests_.hold(taken.last);
    if (has_cache_) return looked_up;
    return {tested.first, std::max(tested.last, taken.last)};
  }

  /// Quads of a bin that are looked up, paid for and tested together: of one beat, and of one primitive where tags are looked at
  /// twice.
  unsigned end_of_part(const std::vector<Quad>& quads, unsigned from, unsigned total, unsigned of_beat) const {
    const unsigned most = std::min(total, (from / of_beat + 1) * of_beat);
    if (!has_cache_ || !time_.z_cache.fetches_ahead()) return most;
    unsigned end = from + 1;
    while (end < most && primitive_order(quads[end]) == primitive_order(quads[from])) ++end;
    return end;
  }
  unsigned count_parts(const std::vector<Quad>& quads, unsigned total, unsigned of_beat) const {
    unsigned parts = 0;
    for (unsigned from = 0; from < total; ++parts) from = end_of_part(quads, from, total, of_beat);
    return parts;
  }
  /// Some of them end, in the cycle before this one; of the others' draws it is known as well that they last so long.
  void end_quads(const QuadBeat& tested, unsigned count, Cycle cycle) {
    quads_last(cycle, count, [&](unsigned i) { return tested.quads[i].draw; });
  }
  [[gnu::noinline]] void pay_for_blocks(const QuadBeat& beat, Cycle at) {
    const std::uint64_t price = blocks_.of(beat.tile, beat.quads.data(), beat.count);
    port_free_at_ = std::max(port_free_at_, block_port_.take(at, price));
    tests_.hold(block_port_.free_from(0));
    block_time_.test(at, beat.count, price);
  }

  void pass(Mark mark, Cycle at) {
    if (mark != Mark::end_of_frame) {
      while (!pending_.empty() && pending_.front().at <= at) apply_update();
    }
    behaviour_->pass(mark);
    if (has_cache_ && context_.frame->clears_depth_stencil(mark)) z_.clear();
    if (hi_z_.returns(mark)) out_hi_z_.send(HiZReports::of_mark(mark), at);
  }

  /// A mark that is passed when it has come around, as it does meanwhile.
  [[gnu::noinline]] CycleInterval send_around(const BinItem& mark, Cycle at) {
    holds_ = true;
    const Cycle taken = out_.send(mark, at).first;
    tests_.hold(taken);
    clock.domain->wait_until([this] { return !holds_; });
    if (holds_) throw SimulationFault(name(), taken, "a mark has not come around");
    return {at, taken};
  }

  [[gnu::noinline]] Cycle test_late(const ShadedWarpItem& item, Cycle visible) {
    ShadedWarp& warp = item.warp->editable();
    late_tests_.hold(out_late_.last());
    if (warp.mark != Mark::none) {
      const Cycle at = late_tests_.take(visible);
      pass(warp.mark, at);
      holds_ = false;
      tests_.hold(at + 1);
      charge(UnitState::latency, at);
      late_tests_.hold(out_late_.send(item, at).first);
      return at;
    }
    const QuadBeat before = quads_of(warp);
    TimedZCache::Times times{visible, visible};
    if (has_cache_) {
      times = z_.look_up_late(before, visible);
      note_moves();
    }
    const Cycle at = late_tests_.take(times.there, before.count);
    if (has_cache_) z_.tested_late(before.count, at);
    late_.push({before.count, at});
    const std::uint32_t changed = behaviour_->test_late(warp);
    if (has_cache_ && changed != 0) {
      z_.change(before, changed, at);
      note_moves();
    }
    if (changed != 0 && hi_z_.wanted(before.quads[0].draw)) tell(before, changed, at);
    if (warp.count < before.count) end_quads(before, before.count, at + time_.latency_cycles);
    const Cycle taken = out_late_.send(item, at).first;
    late_tests_.hold(taken);
    return has_cache_ ? times.at : std::max(at, taken);
  }
  /// To the late tests up to a test of a cycle.
  [[gnu::noinline]] void make_way(Cycle test) {
    for (; !late_.empty() && late_.front().at <= std::max(test, tests_.next_free()); late_.pop()) {
      const unsigned quads = late_.front().quads;
      const Cycle at = tests_.take(quads, late_.front().at);
      const Cycle until = time_.end_of_tests(at, quads);
      did(ZropWork::late_tests, quads, at, until);
      if (blocks_.is_on()) block_time_.test(at, quads, 0);
      port_free_at_ = std::max(port_free_at_, until);
    }
  }

  /// To Hi-Z; tests do not wait for its room.
  [[gnu::noinline]] void tell(const QuadBeat& beat, std::uint32_t changed, Cycle at) {
    hi_z_.changed(beat, changed, *behaviour_->surface(), [&](const HiZUpdate& update) { out_hi_z_.send(update, at); });
  }

  /// The cycle in which so many quads are tested; applies the updates of its past.
  Cycle take(Cycle visible, unsigned quads) {
    if (!late_.empty()) make_way(visible);
    if (has_cache_) move_sectors(visible);
    Cycle at = tests_.free_from(quads, visible);
    know_updates(at);
    while (!pending_.empty() && pending_.front().at <= at) {
      // One z-cache port: a cycle with updates tests nothing.
      if (pending_.front().at == at) {
        at = tests_.free_from(quads, at + 1);
        know_updates(at);
      }
      apply_update();
    }
    tests_.take(quads);
    return at;
  }
  /// Those that are applied up to a test.
  void know_updates(Cycle test) {
    in_terminations_.ask(test);
    if (has_cache_) foresee_updates(test);
  }

  /// When a part of a bin can be tested; extends the cycles of its bin's look-ups. `begun`: quads of the beat that it begins, or 0.
  Cycle look_up(const QuadBeat& beat, Cycle visible, unsigned begun, bool needs_stencil, CycleInterval& looked_up) {
    const Cycle turn = z_.turn(beat.count, begun, visible);
    in_terminations_.ask(turn);
    look_up_updates(turn);
    const TimedZCache::Times times = z_.look_up(beat, turn, needs_stencil);
    note_moves();
    looked_up.first = std::min(looked_up.first, times.at);
    looked_up.last = times.at;
    return times.there;
  }
  /// Those that are to move before a test of a cycle can take place: one z-cache port.
  void move_sectors(Cycle test) {
    for (; !moves_.empty() && moves_.front() <= std::max(test, tests_.next_free()); moves_.pop()) {
      const Cycle at = tests_.take_cycle(moves_.front());
      port_free_at_ = at + 1;
      did(ZropWork::sectors, time_.z_cache.sectors_per_cycle, at);
      if (blocks_.is_on()) block_time_.take_cycle(at);
    }
  }

  /// The first of those pending. Beside a test, or other updates of its cycle, it takes nothing of its own.
  void apply_update() {
    const Cycle at = pending_.front().at;
    if (at >= port_free_at_) {
      did(ZropWork::updates, 1, at);
      if (blocks_.is_on()) block_time_.take_cycle(at);
      port_free_at_ = at + 1;
    }
    behaviour_->update(pending_.front().signal);
    pending_.pop();
  }

  const RenderContext& context_;
  const LatePlan plan_;
  TimedOut<BinItem> out_;
  TimedOut<HiZUpdate> out_hi_z_;
  TimedOut<ShadedWarpItem> out_late_;
  TimedOut<PortReads> out_reads_;
  TimedIn<TerminationBeat> in_terminations_;
  TimedIn<ShadedWarpItem> in_late_;
  TimedIn<BinItem> in_;
  std::unique_ptr<ZropBehaviour> behaviour_;
  const ZropTime time_;
  BeatWidth width_;  ///< of bins
  BatchLimit tests_;
  IssuePort late_tests_;
  Ring<LateTest> late_;  ///< that tests have not made way to yet
  IssuePort updates_;
  Ring<Pending> pending_;   ///< updates not applied yet, by cycle
  Cycle port_free_at_ = 0;  ///< of the z-cache, after the last test, update or move
  ZCacheStatistics cache_statistics_{*this, "cache"};
  TimedZCache z_;
  bool holds_ = false;  ///< while a mark has not come around
  bool has_cache_ = false;
  bool lacks_cache_ = false;  ///< memory is connected, and the cache was left out
  EffectGate z_cache_gate_;
  std::unique_ptr<FixedLatencyMemory> no_memory_;  ///< behind a port that is not connected
  Ring<Pending> arrived_;                          ///< updates not looked up yet
  std::size_t foreseen_ = 0;                       ///< of these, the first, which are among those pending
  Ring<Cycle> moves_;                              ///< of a cycle's worth each, not moved yet
  BlockPrice blocks_;
  ThousandthsPort block_port_;  ///< where they have a price
  BlockTime block_time_;
  HiZReports hi_z_;
};

[[maybe_unused]] const bool zrop_timed_registered = [] {
  register_timed_unit_maker("zrop", [](const std::string& name, ClockDomain& domain,
                                       std::unique_ptr<Behaviour> behaviour, const RenderContext& context, unsigned) {
    return std::make_unique<TimedZrop>(name.c_str(), domain, behaviour_as<ZropBehaviour>(std::move(behaviour)),
                                       context);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
