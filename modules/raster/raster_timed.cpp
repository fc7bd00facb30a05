#include "raster/raster.h"

#include <vrpipe/kernel/rate.h>
#include <vrpipe/model/timed.h>
#include <vrpipe/pipeline/slots/raster.h>

namespace vrpipe {

namespace {

/// RASTER at lt. What ZROP has stored comes long before its time, and counts from then on. Ports as
/// in raster_unit.cpp.
class TimedRaster : public TimedUnit {
 public:
  TimedRaster(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<RasterBehaviour> behaviour)
      : TimedUnit(name, domain, behaviour->time().kinds()),
        out_(*this, "out_quads"),
        in_hi_z_(*this, "in_hi_z",
                 [this](const HiZUpdate& update, CycleInterval visible) { return take(update, visible.first); }),
        in_(*this, "in_jobs",
            [this](const RasterJob& job, CycleInterval visible) { return rasterize(job, visible.first); }),
        behaviour_(std::move(behaviour)),
        time_(behaviour_->time()),
        coarse_(time_.coarse_tiles_per_cycle),
        fine_(time_.fine_tiles_per_cycle),
        quads_out_(time_.quads_per_cycle) {
    out_.set_pipeline(time_.pipeline());
    in_hi_z_.set_optional();
    in_hi_z_.set_comes_ahead();
  }

  Behaviour& behaviour() override { return *behaviour_; }
  void close_account(Cycle end) override {
    apply_updates(never);
    TimedUnit::close_account(end);
  }

 private:
  struct Update {
    HiZUpdate update;
    Cycle at = 0;
  };
  Cycle take(const HiZUpdate& update, Cycle visible) {
    updates_.push({update, visible});
    if (update.mark == Mark::none) return visible;
    // Of what was waited for.
    apply_updates(never);
    holds_ = false;
    charge(UnitState::starved, now_);
    now_ = std::max(now_, visible);
    charge(UnitState::latency, now_);
    return visible;
  }
  void apply_updates(Cycle until) {
    if (until != never) in_hi_z_.ask(until);
    for (; !updates_.empty() && updates_.front().at <= until; updates_.pop()) {
      behaviour_->update(updates_.front().update);
    }
  }

  Cycle rasterize(const RasterJob& job, Cycle visible) {
    now_ = std::max({now_, visible, out_.last()});
    charge(UnitState::blocked, out_.last());
    charge(UnitState::starved, now_);
    if (job.mark != Mark::none) {
      QuadBeat mark;
      mark.mark = job.mark;
      holds_ = !in_hi_z_.is_stub() && behaviour_->waits_at(job.mark);
      // It comes back meanwhile.
      const Cycle sent = out_.send(mark, now_).first;
      now_ = std::max(now_, sent);
      clock.domain->wait_until([this] { return !holds_; });
      if (holds_) throw SimulationFault(name(), now_, "ZROP has not passed a mark that Hi-Z waits for");
      return sent;
    }
    now_ = setups_.free_from(now_);
    const Cycle setup = now_;
    const RasterTime::SetUp set_up = time_.set_up(job.primitive.draw);
    const Cycle is_set_up = setups_.take(setup, set_up.thousandths);
    did(set_up.work, 1, setup, std::max(is_set_up, setup + 1));
    charge(UnitState::busy, setup + 1);
    apply_updates(now_);
    behaviour_->begin(job.primitive, job.clip);
    QuadBeat tile;
    unsigned tests = 0;
    bool new_screen_tile = false;
    while (behaviour_->next(tile, tests, new_screen_tile)) {
      test_tiles(tests);
      const Cycle fine = fine_.take(now_);
      did(RasterWork::fine, 1, fine);
      now_ = std::max(coarse_done_, fine);
      if (new_screen_tile) {
        now_ = pairs_.free_from(now_);
        const Cycle over = pairs_.take(now_, time_.screen_tile_interval_thousandths);
        did(RasterWork::pairs, 1, now_, std::max(over, now_ + 1));
      }
      if (tile.count == 0) continue;
      const CycleInterval at = quads_out_.take(now_, tile.count);
      frame_lasts(at.last + 1);
      did(RasterWork::quads, tile.count, at.last);
      charge(UnitState::busy, at.last);
      now_ = out_.send(tile, at, static_cast<unsigned>(at.last - at.first) + 1).last;
      charge(UnitState::blocked, now_);
      charge(UnitState::busy, now_ + 1);
      apply_updates(now_);
    }
    test_tiles(tests);
    return setup;
  }

  /// Coarse tests, which may take several cycles.
  void test_tiles(unsigned tests) {
    const CycleInterval at = coarse_.take(now_, tests);
    did(RasterWork::coarse, tests, at.first, at.last + 1);
    coarse_done_ = at.last;
  }

  TimedOut<QuadBeat> out_;
  TimedIn<HiZUpdate> in_hi_z_;
  TimedIn<RasterJob> in_;
  std::unique_ptr<RasterBehaviour> behaviour_;
  const RasterTime time_;
  ThroughputPort coarse_;
  IssuePort fine_;
  ThroughputPort quads_out_;
  Ring<Update> updates_;  ///< whose time has not come
  Cycle now_ = 0;         ///< how far the primitive in hand has come
  ThousandthsPort pairs_;
  ThousandthsPort setups_;
  Cycle coarse_done_ = 0;
  bool holds_ = false;  ///< while a mark has not come back from ZROP
};

[[maybe_unused]] const bool raster_timed_registered = [] {
  register_timed_unit_maker("raster", [](const std::string& name, ClockDomain& domain,
                                         std::unique_ptr<Behaviour> behaviour, const RenderContext&, unsigned) {
    return std::make_unique<TimedRaster>(name.c_str(), domain, behaviour_as<RasterBehaviour>(std::move(behaviour)));
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
