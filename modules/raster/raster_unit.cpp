#include "raster/raster.h"

#include <vrpipe/kernel/rate.h>
#include <vrpipe/model/unit.h>
#include <vrpipe/pipeline/slots/raster.h>

namespace vrpipe {

namespace {

/// RASTER at cycle fidelity: set-up, coarse tests and fine tiles at their rates, quads to TC as they come out.
/// What ZROP has stored is known in the cycle in which it comes.
/// Ports: in_jobs (RasterJob), out_quads (QuadBeat), in_hi_z (HiZUpdate; optional).
class RasterUnit : public Unit {
 public:
  RasterUnit(const sc_core::sc_module_name& name, ClockDomain& domain, std::unique_ptr<RasterBehaviour> behaviour)
      : Unit(name, domain, behaviour->time().kinds()),
        in_(*this, "in_jobs"),
        out_(*this, "out_quads"),
        in_hi_z_(*this, "in_hi_z"),
        behaviour_(std::move(behaviour)),
        time_(behaviour_->time()) {
    out_.set_pipeline(time_.pipeline());
    in_hi_z_.set_optional();
    in_hi_z_.set_answers();
  }

  bool idle() const override { return in_.empty() && in_hi_z_.empty() && !active_ && at_ == tile_.count; }
  Behaviour& behaviour() override { return *behaviour_; }

 private:
  /// Sends quads of the tile in hand, as many as the cycle has room for. False when the receiver takes none.
  bool send(unsigned& quad_budget) {
    while (at_ < tile_.count && quad_budget > 0) {
      if (out_.credits() == 0) return false;
      if (at_ == 0 && tile_.count <= quad_budget) {
        out_.push(tile_);
        quad_budget -= tile_.count;
        at_ = tile_.count;
        break;
      }
      send_part(quad_budget);
    }
    return true;
  }

  [[gnu::noinline]] void send_part(unsigned& quad_budget) {
    QuadBeat beat;
    beat.tile = tile_.tile;
    while (at_ < tile_.count && quad_budget > 0) {
      beat.quads[beat.count++] = tile_.quads[at_++];
      --quad_budget;
    }
    out_.push(beat);
  }

  [[gnu::noinline]] void pass_mark() {
    QuadBeat mark;
    mark.mark = in_.front().mark;
    out_.push(mark);
    in_.pop();
    waits_ = !in_hi_z_.is_stub() && behaviour_->waits_at(mark.mark);
  }
  [[gnu::noinline]] void take_updates() {
    for (; in_hi_z_.ready(); in_hi_z_.pop()) {
      behaviour_->update(in_hi_z_.front());
      if (in_hi_z_.front().mark != Mark::none) waits_ = false;
    }
  }

  Cycle tick(Cycle now) override {
    if (!in_hi_z_.empty()) take_updates();
    return std::min(work(now), in_hi_z_.next_ready());
  }
  Cycle work(Cycle now) {
    unsigned quad_budget = time_.quads_per_cycle;
    unsigned fine_budget = time_.fine_tiles_per_cycle;
    unsigned coarse_budget = time_.coarse_tiles_per_cycle;
    bool moved = false;
    while (true) {
      if (coarse_debt_ > 0) {
        const unsigned paid = std::min(coarse_debt_, coarse_budget);
        coarse_debt_ -= paid;
        coarse_budget -= paid;
        did(RasterWork::coarse, paid, now);
        moved = moved || paid > 0;
        if (coarse_debt_ > 0) break;
      }
      if (at_ < tile_.count) {
        if (now < tile_due_) break;
        const unsigned before = quad_budget;
        const bool taken = send(quad_budget);
        if (quad_budget != before) {
          moved = true;
          frame_lasts(now + 1);
          did(RasterWork::quads, before - quad_budget, now);
        }
        if (!taken && !moved) {
          enter(UnitState::blocked, now);
          return never;
        }
        if (at_ < tile_.count) break;
      }
      if (fine_budget == 0) break;
      if (!active_) {
        if (waits_) {
          if (moved) break;
          enter(UnitState::latency, now);
          return never;
        }
        if (!in_.ready()) {
          if (moved) break;
          enter(UnitState::starved, now);
          return in_.next_ready();
        }
        if (in_.front().mark != Mark::none) {
          if (out_.credits() == 0) {
            if (moved) break;
            enter(UnitState::blocked, now);
            return never;
          }
          pass_mark();
          moved = true;
          break;
        }
        if (!setups_.is_free(now)) break;
        const RasterTime::SetUp set_up = time_.set_up(in_.front().primitive.draw);
        behaviour_->begin(in_.front().primitive, in_.front().clip);
        in_.pop();
        const Cycle is_set_up = setups_.take(now, set_up.thousandths);
        did(set_up.work, 1, now, std::max(is_set_up, now + 1));
      }
      unsigned tests = 0;
      bool new_screen_tile = false;
      active_ = behaviour_->next(tile_, tests, new_screen_tile);
      coarse_debt_ += tests;
      at_ = active_ ? 0U : tile_.count;
      if (active_) {
        --fine_budget;
        did(RasterWork::fine, 1, now);
        if (new_screen_tile) {
          tile_due_ = pairs_.free_from(now);
          const Cycle over = pairs_.take(tile_due_, time_.screen_tile_interval_thousandths);
          did(RasterWork::pairs, 1, tile_due_, std::max(over, tile_due_ + 1));
        }
      }
      moved = true;
    }
    enter(moved ? UnitState::busy : UnitState::latency, now);
    return now + 1;
  }

  StreamIn<RasterJob> in_;
  StreamOut<QuadBeat> out_;
  StreamIn<HiZUpdate> in_hi_z_;
  std::unique_ptr<RasterBehaviour> behaviour_;
  const RasterTime time_;
  bool active_ = false;
  bool waits_ = false;  ///< for a mark to come back from ZROP
  QuadBeat tile_;       ///< quads of the raster tile in hand, sent up to `at_`
  unsigned at_ = 0;
  unsigned coarse_debt_ = 0;  ///< raster tiles tested ahead of the coarse rasteriser's rate
  Cycle tile_due_ = 0;
  ThousandthsPort pairs_;
  ThousandthsPort setups_;
};

[[maybe_unused]] const bool raster_unit_registered = [] {
  register_unit_maker("raster", [](const std::string& name, ClockDomain& domain, std::unique_ptr<Behaviour> behaviour,
                                   const RenderContext&, unsigned) {
    return std::make_unique<RasterUnit>(name.c_str(), domain, behaviour_as<RasterBehaviour>(std::move(behaviour)));
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
