#include <algorithm>
#include <optional>

#include <vrpipe/model/occupancy.h>
#include <vrpipe/model/untimed.h>
#include <vrpipe/pipeline/order_monitor.h>

namespace vrpipe {

namespace {

/// CROP without time. It signals quad by quad. Ports as in crop_timed.cpp, but for the memory.
class UntimedCrop : public UntimedUnit {
 public:
  UntimedCrop(const std::string& name, std::unique_ptr<CropBehaviour> behaviour, const RenderContext& context)
      : UntimedUnit(name),
        context_(context),
        out_(*this, "out_terminations"),
        in_(input<ShadedWarpItem>("in_color", [this](const ShadedWarpItem& item) { take(*item.warp); })),
        behaviour_(std::move(behaviour)) {}

  Behaviour& behaviour() override { return *behaviour_; }

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

  void observe(BlendObserver& observer) override {
    observer_ = &observer;
    const CropBehaviour::TimingParameters timing = behaviour_->timing();
    writes_unchanged_ = timing.writes_unchanged;
    looked_up_at_once_ = quads_looked_up_at_once(timing);
  }

 private:
  void take(const ShadedWarp& warp) {
    if (warp.mark != Mark::none) {
      behaviour_->pass(warp.mark);
      return warp.release();
    }
    if (!monitor_) {
      const ColorSurface& surface = *behaviour_->surface();
      monitor_.emplace(surface.width(), surface.height());
    }
    if (observer_ == nullptr) {
      blend(warp, 0, warp.count);
    } else {
      for (unsigned from = 0; from < warp.count; from += looked_up_at_once_) {
        const unsigned to = std::min<unsigned>(from + looked_up_at_once_, warp.count);
        behaviour_->look_up(warp, from, to, cache_);
        for (unsigned line = 0; line < cache_.count; ++line) observer_->looked_up(cache_.lines[line]);
        blend(warp, from, to);
      }
    }
    warp.release();
  }

  void blend(const ShadedWarp& warp, unsigned from, unsigned to) {
    monitor_->blended(warp, from, to, 0);
    CropBehaviour::Outcomes outcomes;
    behaviour_->blend_quads(warp, from, to, outcomes);
    for (unsigned i = from; i < to; ++i) {
      const CropBehaviour::Outcome outcome = outcomes[i];
      if (observer_ != nullptr) account(warp, i, outcome);
      if (outcome.terminated == 0) continue;
      TerminationBeat beat;
      beat.count = 1;
      beat.signals[0] = {warp.tile, warp.position[i], outcome.terminated, context_.draw(warp.draw[i]).epoch};
      out_.send(beat);
    }
  }

  void account(const ShadedWarp& warp, unsigned index, const CropBehaviour::Outcome& outcome) {
    if (cache_.count > 0 && (outcome.changed || writes_unchanged_)) {
      behaviour_->make_dirty(cache_.lines[cache_.line_of[index]].line, cache_.sectors_of[index]);
    }
    observer_->blended(warp, index, outcome);
  }

  const RenderContext& context_;
  UntimedOut<TerminationBeat> out_;
  std::unique_ptr<UntimedIn<ShadedWarpItem>> in_;
  std::unique_ptr<CropBehaviour> behaviour_;
  std::optional<BlendOrderMonitor> monitor_;
  BlendObserver* observer_ = nullptr;
  bool writes_unchanged_ = false;
  unsigned looked_up_at_once_ = quads_per_warp;
  CropBehaviour::CacheLookUp cache_;
};

[[maybe_unused]] const bool registered = [] {
  register_untimed_unit_maker("crop", [](const std::string& name, std::unique_ptr<Behaviour> behaviour,
                                         const RenderContext& context, unsigned) {
    return std::make_unique<UntimedCrop>(name, behaviour_as<CropBehaviour>(std::move(behaviour)), context);
  });
  return true;
}();

}  // namespace

}  // namespace vrpipe
