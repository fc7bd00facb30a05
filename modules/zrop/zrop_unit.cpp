#include <algorithm>
#include <memory>

#include "zrop/block_time.h"
#include "zrop/hi_z_reports.h"
#include "zrop/late_quads.h"
#include "zrop/z_port.h"

#include <vrpipe/model/unit.h>
#include <vrpipe/pipeline/slots/zrop.h>

namespace vrpipe {

namespace {

/// ZROP at cycle fidelity. One port into the z-cache: a cycle either moves sectors, a whole cycle's worth of them, or
/// applies updates, or tests, in this order; late tests go before others. Without memory the z-cache holds everything.
/// Ports: in_quads, out_quads (QuadBeat), in_terminations (TerminationBeat), in_late, out_late (ShadedWarpItem; optional),
/// out_hi_z (HiZUpdate; optional), out_reads (PortReads; optional), memory (TLM-2.0 base protocol; optional).
class ZropUnit : public Unit {
 public:
  ZropUnit(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<ZropBehaviour> behaviour,
           const RenderContext& context)
      : Unit(name, domain, behaviour->time().kinds()),
        in_(*this, "in_quads"),
        out_(*this, "out_quads"),
        out_hi_z_(*this, "out_hi_z"),
        in_terminations_(*this, "in_terminations"),
        in_late_(*this, "in_late"),
        out_late_(*this, "out_late"),
        out_reads_(*this, "out_reads"),
        context_(context),
        plan_(context),
        tests_late_(plan_.is_used()),
        behaviour_(std::move(behaviour)),
        time_(behaviour_->time()),
        z_(*this, out_reads_, time_, context, plan_),
        z_cache_gate_(context, "zrop.z_cache"),
        limit_(time_.quads_per_cycle),
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
    in_late_.set_comes_ahead();
    in_terminations_.set_answers();
    out_reads_.set_optional();
  }

  bool idle() const override {
    return in_.empty() && in_terminations_.empty() && in_late_.empty() && told_.empty() && z_.idle();
  }
  Behaviour& behaviour() override { return *behaviour_; }
  tlm::tlm_initiator_socket<32>* memory_socket() override { return &z_.socket(); }
  bool memory_is_optional() const override { return true; }
  MemoryBytes memory_bytes() const override { return z_.moved(); }
  void close_account(Cycle end) override {
    block_time_.settle(never);
    Unit::close_account(end);
  }

 private:
  void before_end_of_elaboration() override {
    no_memory_ = stub_unbound(z_.socket(), *clock.domain);
    has_cache_ = no_memory_ == nullptr && z_cache_gate_.is_active();
    lacks_cache_ = no_memory_ == nullptr && !has_cache_;
    if (!has_cache_) return;
    const DepthStencilSurface* const surface = behaviour_->surface();
    if (surface == nullptr) throw SimulationFault(this->name(), 0, "no depth-stencil surface is attached");
    z_.make_cache(*surface, cache_statistics_);
  }

  bool update(Cycle now) {
    unsigned budget = time_.updates_per_cycle;
    bool moved = false;
    while (budget > 0 && in_terminations_.ready()) {
      const TerminationBeat& beat = in_terminations_.front();
      while (budget > 0 && signal_ < beat.count) {
        behaviour_->update(beat.signals[signal_++]);
        --budget;
      }
      moved = true;
      if (signal_ < beat.count) break;
      in_terminations_.pop();
      signal_ = 0;
    }
    return count_updates(moved, now);
  }
  bool count_updates(bool moved, Cycle now) {
    // Beside a beat that takes several cycles an update takes nothing of its own.
    if (moved && now >= tested_until_) {
      did(ZropWork::updates, 1, now);
      if (blocks_.is_on()) block_time_.take_cycle(now);
    }
    return moved;
  }

  /// Those that were looked up.
  bool apply_updates(Cycle now) {
    bool moved = false;
    for (unsigned budget = time_.updates_per_cycle; budget > 0 && z_.update_is_there(); --budget) {
      behaviour_->update(z_.front_update());
      z_.pop_update();
      moved = true;
    }
    return count_updates(moved, now);
  }

  bool move_sectors(Cycle now) {
    const unsigned sectors = time_.z_cache.sectors_per_cycle;
    if (z_.owed_sectors() < sectors || now < free_at_) return false;
    z_.pay_sectors(sectors);
    did(ZropWork::sectors, sectors, now);
    if (blocks_.is_on()) block_time_.take_cycle(now);
    return true;
  }

  bool test(Cycle now) {
    bool moved = false;
    while (!waits_ && (has_cache_ ? z_.beat_is_there() && !z_.holds_changed() : in_.ready()) && out_.credits() > 0) {
      const QuadBeat& next = has_cache_ ? z_.front() : in_.front();
      const unsigned width = std::max<unsigned>(next.count, 1);
      if (!limit_.allows(width, now) || !block_port_.is_free(now)) break;
      QuadBeat beat = next;
      has_cache_ ? z_.pop() : in_.pop();
      tested_until_ = time_.end_of_tests(now, width);
      if (blocks_.is_on()) pay_for_blocks(beat, now);
      did(ZropWork::tests, beat.count, now, tested_until_);
      const unsigned tested = beat.count;
      if (lacks_cache_ && tested > 0) z_cache_gate_.enter();
      // Of what may write, the quads that come in.
      QuadBeat before;
      const bool hi_z = tested > 0 && hi_z_.wanted(beat.quads[0].draw);
      if (hi_z || tells_draws() ||
          (has_cache_ && tested > 0 && context_.state(beat.quads[0].draw).writes_depth_stencil()))
        before = beat;
      if (beat.mark == Mark::none) {
        const std::uint32_t changed = behaviour_->test(beat);
        if (has_cache_ && changed != 0) z_.change(before, changed);
        if (hi_z && changed != 0) tell_later(before, changed);
      } else if (plan_.waits_at(beat.mark)) {
        waits_ = true;
      } else {
        pass(beat.mark);
      }
      if (beat.count < tested) end_quads(before, tested, now + time_.latency_cycles);
      moved = true;
      // A beat without survivors goes no further, but for the mark that closes a bin.
      if (beat.count > 0 || beat.last_of_bin || beat.mark != Mark::none) out_.push(beat);
      limit_.take(width);
    }
    if (moved) free_at_ = block_port_.free_from(limit_.next(now));
    return moved;
  }
  /// Some of them end, in the cycle before this one; of the others' draws it is known as well that they last so long.
  void end_quads(const QuadBeat& tested, unsigned count, Cycle cycle) {
    quads_last(cycle, count, [&](unsigned i) { return tested.quads[i].draw; });
  }
  [[gnu::noinline]] void pay_for_blocks(const QuadBeat& beat, Cycle now) {
    const std::uint64_t price = blocks_.of(beat.tile, beat.quads.data(), beat.count);
    tested_until_ = std::max(tested_until_, block_port_.take(now, price));
    block_time_.test(now, beat.count, price);
  }

  bool test_all(Cycle now) {
    const bool late = tests_late_ && test_late(now);
    return test(now) || late;
  }
  [[gnu::noinline]] bool test_late(Cycle now) {
    bool moved = false;
    while ((has_cache_ ? z_.late_is_there() && !z_.holds_changed() : in_late_.ready()) && out_late_.credits() > 0) {
      const ShadedWarpItem item = has_cache_ ? z_.front_late() : in_late_.front();
      const unsigned width = std::max<unsigned>(item.warp->count, 1);
      if (!limit_.allows(width, now)) break;
      has_cache_ ? z_.pop_late() : in_late_.pop();
      limit_.take(width);
      tested_until_ = time_.end_of_tests(now, width);
      if (item.warp->mark == Mark::none) {
        test_late(item.warp->editable(), now);
      } else {
        pass(item.warp->mark);
        waits_ = false;
        z_.mark_is_back(item.warp->mark);
      }
      out_late_.push(item);
      moved = true;
    }
    if (moved) free_at_ = limit_.next(now);
    return moved;
  }
  void test_late(ShadedWarp& warp, Cycle now) {
    const QuadBeat before = quads_of(warp);
    const std::uint32_t changed = behaviour_->test_late(warp);
    did(ZropWork::late_tests, before.count, now, tested_until_);
    if (blocks_.is_on()) block_time_.test(now, before.count, 0);
    if (has_cache_ && changed != 0) z_.change(before, changed);
    if (changed != 0 && hi_z_.wanted(before.quads[0].draw)) tell_later(before, changed);
    if (warp.count < before.count) end_quads(before, before.count, now + time_.latency_cycles);
  }

  void pass(Mark mark) {
    behaviour_->pass(mark);
    if (hi_z_.returns(mark)) told_.push(HiZReports::of_mark(mark));
  }
  [[gnu::noinline]] void tell_later(const QuadBeat& beat, std::uint32_t changed) {
    hi_z_.changed(beat, changed, *behaviour_->surface(), [this](const HiZUpdate& update) { told_.push(update); });
  }
  /// To Hi-Z, which may take it later: tests do not wait for that.
  [[gnu::noinline]] void tell() {
    for (; !told_.empty() && out_hi_z_.credits() > 0; told_.pop()) out_hi_z_.push(told_.front());
  }

  Cycle tick(Cycle now) override {
    const Cycle next = has_cache_ ? tick_cache(now) : work(now);
    if (!told_.empty()) tell();
    return next;
  }
  Cycle work(Cycle now) {
    if (update(now) || (now >= free_at_ && test_all(now))) {
      enter(UnitState::busy, now);
      return now + 1;
    }
    if (now < free_at_) {
      enter(UnitState::busy, now);
      return std::min(free_at_, in_terminations_.next_ready());
    }
    if (tests_late_) return wait(now);
    if (in_.ready()) {
      enter(UnitState::blocked, now);
      return in_terminations_.next_ready();
    }
    enter(UnitState::starved, now);
    return std::min(in_.next_ready(), in_terminations_.next_ready());
  }

  /// In a frame with late tests, that nothing could be done.
  [[gnu::noinline]] Cycle wait(Cycle now) {
    const bool is_blocked = in_late_.ready() || (in_.ready() && !waits_);
    enter(is_blocked ? UnitState::blocked : waits_ ? UnitState::latency : UnitState::starved, now);
    Cycle next = in_terminations_.next_ready();
    for (const Cycle at : {in_.next_ready(), in_late_.next_ready()}) {
      if (at > now) next = std::min(next, at);
    }
    return next;
  }

  [[gnu::noinline]] Cycle tick_cache(Cycle now) {
    const bool looked_up = z_.advance(now, in_, in_terminations_, in_late_);
    const bool worked = move_sectors(now) || apply_updates(now) || (now >= free_at_ && test_all(now));
    const bool has_work = z_.has_beats() || in_.ready() || z_.has_late() || in_late_.ready();
    enter(worked || now < free_at_                                ? UnitState::busy
          : waits_ && !z_.has_late() && !in_late_.ready()         ? UnitState::latency
          : !has_work                                             ? UnitState::starved
          : z_.late_is_there() || (z_.beat_is_there() && !waits_) ? UnitState::blocked
                                                                  : UnitState::memory,
          now);
    if (looked_up || worked || z_.owed_sectors() >= time_.z_cache.sectors_per_cycle) return now + 1;
    const Cycle next = z_.next(now, in_, in_terminations_, in_late_);
    return now < free_at_ ? std::min(next, free_at_) : next;
  }

  StreamIn<QuadBeat> in_;
  StreamOut<QuadBeat> out_;
  StreamOut<HiZUpdate> out_hi_z_;
  StreamIn<TerminationBeat> in_terminations_;
  StreamIn<ShadedWarpItem> in_late_;
  StreamOut<ShadedWarpItem> out_late_;
  StreamOut<PortReads> out_reads_;
  const RenderContext& context_;
  const LatePlan plan_;
  const bool tests_late_;  ///< any draw
  std::unique_ptr<ZropBehaviour> behaviour_;
  const ZropTime time_;
  ZPort z_;
  bool has_cache_ = false;
  bool lacks_cache_ = false;  ///< memory is connected, and the cache was left out
  EffectGate z_cache_gate_;
  std::unique_ptr<FixedLatencyMemory> no_memory_;  ///< behind a port that is not connected
  unsigned signal_ = 0;
  BatchLimit limit_;
  BlockPrice blocks_;
  ThousandthsPort block_port_;  ///< where they have a price
  BlockTime block_time_;
  Cycle tested_until_ = 0;  ///< the last beat, rounded up to whole cycles
  Cycle free_at_ = 0;       ///< after a beat wider than the unit
  bool waits_ = false;      ///< for a mark to come around
  HiZReports hi_z_;
  Ring<HiZUpdate> told_;  ///< and not sent yet
  ZCacheStatistics cache_statistics_{*this, "cache"};
};

[[maybe_unused]] const bool zrop_unit_registered = [] {
  register_unit_maker("zrop", [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                                 const RenderContext& context, unsigned) {
    return std::make_unique<ZropUnit>(name.c_str(), domain, behaviour_as<ZropBehaviour>(std::move(behaviour)), context);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
