#include <algorithm>
#include <optional>

#include <vrpipe/model/untimed.h>
#include <vrpipe/pipeline/barrier_plan.h>
#include <vrpipe/pipeline/order_monitor.h>
#include <vrpipe/pipeline/slots/crop.h>

namespace vrpipe {

namespace {

/// CROP without time. It signals quad by quad. Ports as in crop_timed.cpp.
class UntimedCrop : public UntimedUnit {
 public:
  UntimedCrop(const std::string& name, std::unique_ptr<CropBehaviour> behaviour, const RenderContext& context)
      : UntimedUnit(name),
        context_(context),
        out_(*this, "out_terminations"),
        out_done_(*this, "out_done"),
        in_(input<ShadedWarpItem>("in_color", [this](const ShadedWarpItem& item) { take(*item.warp); })),
        behaviour_(std::move(behaviour)),
        barriers_(context),
        timing_(behaviour_->timing()),
        organization_(timing_.cache()),
        looked_up_at_once_(quads_looked_up_at_once(timing_)),
        memory_({MemoryTraffic::color, static_cast<std::uint16_t>(context.placement.gpc)}) {
    out_done_.set_optional();
  }

  Behaviour& behaviour() override { return *behaviour_; }
  UntimedMemoryPort* memory_port() override { return &memory_; }

  void prefetch(const Warp& warp) override {
    if (warp.count == 0) return;
    const ColorSurface& surface = *behaviour_->surface();
    const std::size_t tile = surface.grid().place(warp.tile, 0);
    for (unsigned i = 0; i < warp.count; ++i) {
      const std::size_t place = tile + warp.quads[i].position;
      __builtin_prefetch(&surface.quad(place), 1);
      if (monitor_) monitor_->prefetch(place);
    }
  }

  void observe(BlendObserver& observer) override { observer_ = &observer; }

 private:
  void take(const ShadedWarp& warp) {
    if (warp.mark != Mark::none) {
      behaviour_->pass(warp.mark);
      if (barriers_.is_barrier(warp.mark)) out_done_.send({warp.mark});
      return warp.release();
    }
    if (!monitor_) {
      const ColorSurface& surface = *behaviour_->surface();
      monitor_.emplace(surface.width(), surface.height());
    }
    if (!follows_cache()) {
      blend(warp, 0, warp.count);
    } else {
      for (unsigned from = 0; from < warp.count; from += looked_up_at_once_) {
        const unsigned to = std::min<unsigned>(from + looked_up_at_once_, warp.count);
        behaviour_->look_up(warp, from, to, cache_);
        for (unsigned line = 0; line < cache_.count; ++line) {
          if (observer_ != nullptr) observer_->looked_up(cache_.lines[line]);
          if (memory_.connected()) memory_.move(cache_.lines[line], organization_);
        }
        blend(warp, from, to);
      }
    }
    warp.release();
  }

  /// Whether anybody wants to know what the colour cache does.
  bool follows_cache() const { return observer_ != nullptr || memory_.connected(); }

  void blend(const ShadedWarp& warp, unsigned from, unsigned to) {
    monitor_->blended(warp, from, to, 0);
    CropBehaviour::Outcomes outcomes;
    behaviour_->blend_quads(warp, from, to, outcomes);
    for (unsigned i = from; i < to; ++i) {
      const CropBehaviour::Outcome outcome = outcomes[i];
      if (follows_cache()) account(warp, i, outcome);
      if (outcome.terminated == 0) continue;
      TerminationBeat beat;
      beat.count = 1;
      beat.signals[0] = {warp.tile, warp.position[i], outcome.terminated, context_.draw(warp.draw[i]).epoch};
      out_.send(beat);
    }
  }

  void account(const ShadedWarp& warp, unsigned index, const CropBehaviour::Outcome& outcome) {
    if (cache_.count > 0 && (outcome.changed || timing_.writes_unchanged)) {
      behaviour_->make_dirty(cache_.lines[cache_.line_of[index]].line, cache_.sectors_of[index]);
    }
    if (observer_ != nullptr) observer_->blended(warp, index, outcome);
  }

  const RenderContext& context_;
  UntimedOut<TerminationBeat> out_;
  UntimedOut<BlendsDone> out_done_;
  std::unique_ptr<UntimedIn<ShadedWarpItem>> in_;
  std::unique_ptr<CropBehaviour> behaviour_;
  const BarrierPlan barriers_;
  std::optional<BlendOrderMonitor> monitor_;
  BlendObserver* observer_ = nullptr;
  const CropBehaviour::TimingParameters timing_;
  const CacheOrganization organization_;
  const unsigned looked_up_at_once_;
  UntimedMemoryPort memory_;
  CropBehaviour::CacheLookUp cache_;
};

[[maybe_unused]] const bool crop_untimed_registered = [] {
  register_untimed_unit_maker("crop", [](const std::string& name, std::unique_ptr<Behaviour> behaviour,
                                         const RenderContext& context, unsigned) {
    return std::make_unique<UntimedCrop>(name, behaviour_as<CropBehaviour>(std::move(behaviour)), context);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
